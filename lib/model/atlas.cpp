#include "lib/model/atlas.hpp"

#include <algorithm>
#include <map>
#include <span>

#include "lib/model/view_checks.hpp"

namespace stx {
namespace {

std::string nameOf(const AtlasRectangle& r, std::size_t index) {
    return fmt::format("rectangle {} ({}x{} at {},{} of page {})", index, r.atlasWidth(),
                       r.atlasHeight(), r.atlasX, r.atlasY, r.page);
}

/// What a rectangle takes on its page, the texels around it included.
struct PaddedArea {
    std::int64_t x0, y0, x1, y1;
};

/// A rectangle with `around` texels on each side, as far as its view goes.
PaddedArea paddedArea(const AtlasRectangle& r, const Camera& camera, int around) {
    const int left = std::min(around, r.viewX), above = std::min(around, r.viewY);
    const int right = std::min(around, camera.width - r.viewX - r.width);
    const int below = std::min(around, camera.height - r.viewY - r.height);
    const std::int64_t x = r.atlasX, y = r.atlasY;
    if (r.turned)
        return {x - below, y - left, x + r.atlasWidth() + above, y + r.atlasHeight() + right};
    return {x - left, y - above, x + r.atlasWidth() + right, y + r.atlasHeight() + below};
}

/// The boxes, with their numbers, that overlap: sweeps along x and keeps what is open by y. A box
/// that overlaps one is not kept, so there are fewer pairs than boxes.
std::vector<std::pair<std::size_t, std::size_t>> overlapsOf(
    const std::vector<std::pair<std::size_t, PaddedArea>>& boxes) {
    struct Event {
        std::int64_t x;
        bool opens;
        std::size_t index;
    };
    std::vector<Event> events;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        events.push_back({boxes[i].second.x0, true, i});
        events.push_back({boxes[i].second.x1, false, i});
    }
    std::sort(events.begin(), events.end(), [](const Event& a, const Event& b) {
        return std::tie(a.x, a.opens, a.index) < std::tie(b.x, b.opens, b.index);
    });
    std::vector<std::pair<std::size_t, std::size_t>> overlaps;
    std::map<std::int64_t, std::size_t> open;  // by top edge; what is open does not overlap
    for (const auto& e : events) {
        const PaddedArea& box = boxes[e.index].second;
        if (!e.opens) {
            if (const auto it = open.find(box.y0); it != open.end() && it->second == e.index)
                open.erase(it);
            continue;
        }
        const auto below = open.lower_bound(box.y0);
        const auto above = below == open.begin() ? open.end() : std::prev(below);
        if (below != open.end() && below->first < box.y1)
            overlaps.emplace_back(boxes[below->second].first, boxes[e.index].first);
        else if (above != open.end() && boxes[above->second].second.y1 > box.y0)
            overlaps.emplace_back(boxes[above->second].first, boxes[e.index].first);
        else
            open.emplace(box.y0, e.index);
    }
    return overlaps;
}

/// The boxes of the rectangles on a page, with their numbers.
std::vector<std::pair<std::size_t, PaddedArea>> boxesOf(const Atlas& atlas, std::size_t page,
                                                        int around) {
    std::vector<std::pair<std::size_t, PaddedArea>> boxes;
    for (std::size_t i = 0; i < atlas.rectangles.size(); ++i) {
        const AtlasRectangle& r = atlas.rectangles[i];
        if (r.page == static_cast<int>(page))
            boxes.emplace_back(i, paddedArea(r, atlas.views[r.view].camera, around));
    }
    return boxes;
}

/// Of an atlas or an object.
template <class Of>
Result<void> checkOwnNumbers(const Of& of) {
    STX_CHECK(checkOrigin(of.origin));
    if (of.sourcePixels >= 0 && of.keptPixels >= 0) return {};
    return fail(ErrorCode::invalidInput,
                "sourcePixels is {} and keptPixels {}; 0 or more are expected", of.sourcePixels,
                of.keptPixels);
}

}  // namespace

std::vector<std::pair<std::size_t, std::size_t>> findOverlaps(
    const std::vector<AtlasRectangle>& rectangles, int page) {
    std::vector<std::pair<std::size_t, PaddedArea>> boxes;
    for (std::size_t i = 0; i < rectangles.size(); ++i) {
        const AtlasRectangle& r = rectangles[i];
        if (r.page != page) continue;
        boxes.push_back({i,
                         {r.atlasX, r.atlasY, std::int64_t{r.atlasX} + r.atlasWidth(),
                          std::int64_t{r.atlasY} + r.atlasHeight()}});
    }
    return overlapsOf(boxes);
}

std::int64_t Atlas::pointCount() const {
    std::int64_t points = 0;
    for (const AtlasRectangle& r : rectangles) {
        const Image<float>& depth = pages[r.page].depth;
        for (int y = r.atlasY; y < r.atlasY + r.atlasHeight(); ++y)
            for (int x = r.atlasX; x < r.atlasX + r.atlasWidth(); ++x)
                points += hasPoint(depth.at(x, y)) ? 1 : 0;
    }
    return points;
}

int Atlas::textureCount() const {
    int count = 0;
    for (const auto& p : pages)
        count += 2 + (p.normal.empty() ? 0 : 1) + (p.splatU.empty() ? 0 : 1);
    return count;
}

int Atlas::materialTextureCount() const {
    int count = 0;
    for (const auto& p : pages)
        count += (p.metallicRoughness.empty() ? 0 : 1) + (p.emissive.empty() ? 0 : 1);
    return count;
}

std::int64_t coveredPixels(const std::vector<AtlasRectangle>& rectangles, int first, int views) {
    std::int64_t covered = 0;
    for (const auto& r : rectangles) {
        if (r.view >= first && r.view - first < views)
            covered += static_cast<std::int64_t>(r.width) * r.height;
    }
    return covered;
}

double Atlas::used() const {
    const auto covered =
        static_cast<double>(coveredPixels(rectangles, 0, static_cast<int>(views.size())));
    const double area = static_cast<double>(width()) * height() * static_cast<double>(pages.size());
    return area > 0 ? covered / area : 0.0;
}

bool Atlas::paddingHolds(int texels) const {
    for (std::size_t page = 0; page < pages.size(); ++page) {
        const auto boxes = boxesOf(*this, page, texels);
        for (const auto& [index, box] : boxes) {
            const PaddedArea written = paddedArea(
                rectangles[index], views[rectangles[index].view].camera, std::min(texels, padding));
            if (box.x0 != written.x0 || box.y0 != written.y0 || box.x1 != written.x1 ||
                box.y1 != written.y1 || box.x0 < 0 || box.y0 < 0 || box.x1 > width() ||
                box.y1 > height())
                return false;
        }
        if (!overlapsOf(boxes).empty()) return false;
    }
    return true;
}

Result<void> checkNames(const Atlas& atlas) {
    if (atlas.objects.empty()) return checkNames(viewNamesOf(atlas.views));
    const std::span<const ReferenceView> views(atlas.views);
    for (const AtlasObject& o : atlas.objects)
        STX_CHECK(within(fmt::format("object '{}'", o.name),
                         checkNames(viewNamesOf(views.subspan(o.firstView, o.views)))));
    return {};
}

Result<void> Atlas::check() const {
    if (views.empty()) return fail(ErrorCode::invalidInput, "the atlas has no reference view");
    if (pages.empty()) return fail(ErrorCode::invalidInput, "the atlas has no page");
    // As much as a side may have is what readers take.
    if (const int most = Limits().maxImageSide; padding < 0 || padding > most)
        return fail(ErrorCode::invalidInput, "the atlas' padding is {}; 0 to {} is expected",
                    padding, most);
    if (layout != "grid" && layout != "tight")
        return fail(ErrorCode::invalidInput, "the atlas' layout is '{}'; grid or tight is expected",
                    layout);
    STX_CHECK(checkOwnNumbers(*this));
    STX_CHECK(checkObjects(objects, views.size()));
    for (std::size_t i = 0; i < views.size(); ++i) {
        STX_CHECK(within(fmt::format("view {}", i), checkNumbers(views[i])));
    }
    for (const AtlasObject& o : objects)
        STX_CHECK(within(fmt::format("object '{}'", o.name), checkOwnNumbers(o)));
    for (std::size_t i = 0; i < pages.size(); ++i) {
        const auto& p = pages[i];
        const auto same = [&](const auto& image) {
            return image.width() == width() && image.height() == height();
        };
        if (p.depth.empty() || !same(p.depth) || !same(p.texture) ||
            (!p.normal.empty() && !same(p.normal)) || (!p.splatU.empty() && !same(p.splatU)) ||
            p.splatU.size() != p.splatV.size() || p.normal.empty() != pages[0].normal.empty() ||
            p.splatU.empty() != pages[0].splatU.empty() ||
            (!p.metallicRoughness.empty() && !same(p.metallicRoughness)) ||
            (!p.emissive.empty() && !same(p.emissive)) ||
            p.metallicRoughness.empty() != pages[0].metallicRoughness.empty() ||
            p.emissive.empty() != pages[0].emissive.empty())
            return fail(ErrorCode::invalidInput,
                        "page {}: its textures must all be there and {}x{} like page 0's depth", i,
                        width(), height());
        STX_CHECK(within(fmt::format("page {}", i), p.texture.check()));
        if (p.texture.isLinear() != pages[0].texture.isLinear())
            return fail(ErrorCode::invalidInput, "page {} has another colour space than page 0", i);
        STX_CHECK(within(fmt::format("page {}", i), countPoints(p.depth)));
    }
    if (textureCount() > 4)
        return fail(ErrorCode::invalidInput, "the atlas has {} textures; at most 4 are possible",
                    textureCount());
    for (std::size_t i = 0; i < rectangles.size(); ++i) {
        const auto& r = rectangles[i];
        if (r.view < 0 || r.view >= static_cast<int>(views.size()))
            return fail(ErrorCode::invalidInput,
                        "rectangle {} is of view {}, but there are {} views", i, r.view,
                        views.size());
        if (r.page < 0 || r.page >= static_cast<int>(pages.size()))
            return fail(ErrorCode::invalidInput,
                        "rectangle {} is on page {}, but there are {} pages", i, r.page,
                        pages.size());
        const auto& camera = views[r.view].camera;
        const auto within = [](int at, int size, int whole) {
            return at >= 0 && size > 0 && size <= whole && at <= whole - size;
        };
        if (!within(r.viewX, r.width, camera.width) || !within(r.viewY, r.height, camera.height))
            return fail(ErrorCode::invalidInput,
                        "rectangle {} ({}x{} at {},{}) leaves view {} of {}x{}", i, r.width,
                        r.height, r.viewX, r.viewY, r.view, camera.width, camera.height);
        if (!within(r.atlasX, r.atlasWidth(), width()) ||
            !within(r.atlasY, r.atlasHeight(), height()))
            return fail(ErrorCode::invalidInput, "{} leaves its page of {}x{}", nameOf(r, i),
                        width(), height());
    }
    for (std::size_t page = 0; page < pages.size(); ++page) {
        const auto overlaps = findOverlaps(rectangles, static_cast<int>(page));
        if (overlaps.empty()) continue;
        const auto [a, b] = overlaps.front();
        return fail(ErrorCode::invalidInput, "{} and {} overlap", nameOf(rectangles[a], a),
                    nameOf(rectangles[b], b));
    }
    return {};
}

}  // namespace stx

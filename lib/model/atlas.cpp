#include "lib/model/atlas.hpp"

#include <algorithm>
#include <map>

namespace stx {
namespace {

std::string nameOf(const AtlasRectangle& r, std::size_t index) {
    return fmt::format("rectangle {} ({}x{} at {},{} of page {})", index, r.atlasWidth(),
                       r.atlasHeight(), r.atlasX, r.atlasY, r.page);
}

/// Two rectangles of one page that overlap, or none: sweeps along x and keeps what is open by y.
std::optional<std::pair<std::size_t, std::size_t>> findOverlap(
    const std::vector<AtlasRectangle>& rectangles, int page) {
    struct Event {
        std::int64_t x;
        bool opens;
        std::size_t index;
    };
    std::vector<Event> events;
    for (std::size_t i = 0; i < rectangles.size(); ++i) {
        const auto& r = rectangles[i];
        if (r.page != page) continue;
        events.push_back({r.atlasX, true, i});
        events.push_back({std::int64_t{r.atlasX} + r.atlasWidth(), false, i});
    }
    std::sort(events.begin(), events.end(), [](const Event& a, const Event& b) {
        return std::tie(a.x, a.opens, a.index) < std::tie(b.x, b.opens, b.index);
    });
    std::map<int, std::size_t> open;  // by top edge; what is open does not overlap
    for (const auto& e : events) {
        const auto& r = rectangles[e.index];
        if (!e.opens) {
            open.erase(r.atlasY);
            continue;
        }
        const auto below = open.lower_bound(r.atlasY);
        if (below != open.end() && below->first < r.atlasY + r.atlasHeight())
            return std::pair(below->second, e.index);
        if (below != open.begin()) {
            const auto above = std::prev(below);
            const auto& other = rectangles[above->second];
            if (other.atlasY + other.atlasHeight() > r.atlasY)
                return std::pair(above->second, e.index);
        }
        open.emplace(r.atlasY, e.index);
    }
    return std::nullopt;
}

}  // namespace

int Atlas::textureCount() const {
    int count = 0;
    for (const auto& p : pages)
        count += 2 + (p.normal.empty() ? 0 : 1) + (p.splatU.empty() ? 0 : 1);
    return count;
}

double Atlas::used() const {
    double covered = 0;
    for (const auto& r : rectangles) covered += static_cast<double>(r.width) * r.height;
    const double area = static_cast<double>(width()) * height() * static_cast<double>(pages.size());
    return area > 0 ? covered / area : 0.0;
}

Result<void> Atlas::check() const {
    if (views.empty()) return fail(ErrorCode::invalidInput, "the atlas has no reference view");
    if (pages.empty()) return fail(ErrorCode::invalidInput, "the atlas has no page");
    if (padding < 0) return fail(ErrorCode::invalidInput, "the atlas' padding is {}", padding);
    for (std::size_t i = 0; i < views.size(); ++i) {
        if (auto ok = views[i].camera.check(); !ok)
            return tl::unexpected(ok.error().at(fmt::format("view {}", i)));
    }
    for (std::size_t i = 0; i < pages.size(); ++i) {
        const auto& p = pages[i];
        const auto same = [&](const auto& image) {
            return image.width() == width() && image.height() == height();
        };
        if (p.depth.empty() || !same(p.depth) || !same(p.texture) ||
            (!p.normal.empty() && !same(p.normal)) || (!p.splatU.empty() && !same(p.splatU)) ||
            p.splatU.size() != p.splatV.size() || p.normal.empty() != pages[0].normal.empty() ||
            p.splatU.empty() != pages[0].splatU.empty())
            return fail(ErrorCode::invalidInput,
                        "page {}: its textures must all be there and {}x{} like page 0's depth", i,
                        width(), height());
        if (p.texture.isLinear() != pages[0].texture.isLinear())
            return fail(ErrorCode::invalidInput, "page {} has another colour space than page 0", i);
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
        if (const auto hit = findOverlap(rectangles, static_cast<int>(page)))
            return fail(ErrorCode::invalidInput, "{} and {} overlap",
                        nameOf(rectangles[hit->first], hit->first),
                        nameOf(rectangles[hit->second], hit->second));
    }
    return {};
}

}  // namespace stx

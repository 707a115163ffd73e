#include "lib/model/atlas.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace stx {

int Atlas::textureCount() const {
    int count = 0;
    for (const auto& page : pages) {
        count += page.texture.empty() ? 0 : 1;
        count += page.depth.empty() ? 0 : 1;
        count += page.normal.empty() ? 0 : 1;
        count += page.splatU.empty() && page.splatV.empty() ? 0 : 1;  // they share one
    }
    return count;
}

double Atlas::used() const {
    double covered = 0, area = 0;
    for (const auto& r : rectangles) covered += static_cast<double>(r.width) * r.height;
    for (const auto& page : pages)
        area += static_cast<double>(page.depth.width()) * page.depth.height();
    return area > 0 ? covered / area : 0.0;
}

namespace {

/// Errors when two rectangles of a page share a pixel. A line sweeps down; the rectangles that it
/// crosses are held by their left edges, so that only neighbours need to be compared.
Result<void> checkApart(const std::vector<AtlasRectangle>& rectangles, int page) {
    struct Event {
        int y;
        bool begins;
        std::size_t index;
    };
    std::vector<Event> events;
    for (std::size_t i = 0; i < rectangles.size(); ++i) {
        const auto& r = rectangles[i];
        if (r.page != page) continue;
        events.push_back({r.atlasY, true, i});
        events.push_back({r.atlasY + r.atlasHeight(), false, i});
    }
    std::sort(events.begin(), events.end(), [](const Event& a, const Event& b) {
        if (a.y != b.y) return a.y < b.y;
        if (a.begins != b.begins) return !a.begins;  // one may begin where another ends
        return a.index < b.index;
    });
    std::map<int, std::size_t> active;
    const auto overlap = [&](std::size_t a, std::size_t b) {
        return fail(ErrorCode::invalidInput, "rectangles {} and {} overlap on page {}",
                    std::min(a, b), std::max(a, b), page);
    };
    for (const auto& e : events) {
        const auto& r = rectangles[e.index];
        if (!e.begins) {
            active.erase(r.atlasX);
            continue;
        }
        const auto next = active.lower_bound(r.atlasX);
        if (next != active.end() && next->first < r.atlasX + r.atlasWidth())
            return overlap(e.index, next->second);
        if (next != active.begin()) {
            const auto before = std::prev(next);
            const auto& left = rectangles[before->second];
            if (left.atlasX + left.atlasWidth() > r.atlasX) return overlap(e.index, before->second);
        }
        active.emplace(r.atlasX, e.index);
    }
    return {};
}

bool inside(int at, int size, int whole) {
    return at >= 0 && size > 0 && std::int64_t{at} + size <= whole;
}

template <class Image>
bool emptyOr(const Image& image, int width, int height) {
    return image.empty() || (image.width() == width && image.height() == height);
}

}  // namespace

Result<void> Atlas::check() const {
    if (views.empty()) return fail(ErrorCode::invalidInput, "the atlas has no reference view");
    if (pages.empty()) return fail(ErrorCode::invalidInput, "the atlas has no page");
    if (textureCount() > 4)
        return fail(ErrorCode::invalidInput, "the atlas has {} textures; at most 4 are possible",
                    textureCount());
    if (padding < 0) return fail(ErrorCode::invalidInput, "the padding is {}", padding);
    for (std::size_t i = 0; i < views.size(); ++i) {
        const auto& v = views[i];
        if (auto ok = v.camera.check(); !ok)
            return tl::unexpected(ok.error().at(fmt::format("view {}", i)));
        if (!std::isfinite(v.nearPlane) || !std::isfinite(v.farPlane) || v.nearPlane < 0 ||
            !(v.nearPlane < v.farPlane))
            return fail(ErrorCode::invalidInput,
                        "view {}: nearPlane is {:g} and farPlane {:g}; 0 <= nearPlane < farPlane "
                        "must hold",
                        i, v.nearPlane, v.farPlane);
        if (v.depthBits != 8 && v.depthBits != 16 && v.depthBits != 32)
            return fail(ErrorCode::invalidInput,
                        "view {}: depth has {} bits; 8, 16 or 32 (float) is possible", i,
                        v.depthBits);
    }
    for (std::size_t i = 0; i < pages.size(); ++i) {
        const auto& p = pages[i];
        if (p.depth.empty() || p.texture.empty())
            return fail(ErrorCode::invalidInput, "page {} has no {}", i,
                        p.depth.empty() ? "depth" : "texture");
        const int w = width(), h = height();
        if (!emptyOr(p.depth, w, h) || !emptyOr(p.texture, w, h) || !emptyOr(p.normal, w, h) ||
            !emptyOr(p.splatU, w, h) || !emptyOr(p.splatV, w, h))
            return fail(ErrorCode::invalidInput,
                        "page {} has images of unlike size; all must be {}x{} as the depth of page "
                        "0",
                        i, w, h);
        if (p.splatU.empty() != p.splatV.empty())
            return fail(ErrorCode::invalidInput, "page {} has only one of splatU and splatV", i);
        if (p.texture.isLinear() != pages[0].texture.isLinear())
            return fail(ErrorCode::invalidInput, "the pages' colour spaces differ");
        for (const float d : p.depth.pixels()) {
            if (!(d >= 0))
                return fail(ErrorCode::invalidInput,
                            "page {}: depth holds {}; distances are 0 or more", i, d);
        }
    }
    for (std::size_t i = 0; i < rectangles.size(); ++i) {
        const auto& r = rectangles[i];
        if (r.view < 0 || r.view >= static_cast<int>(views.size()) || r.page < 0 ||
            r.page >= static_cast<int>(pages.size()))
            return fail(
                ErrorCode::invalidInput,
                "rectangle {} is of view {} on page {}, but there are {} views and {} pages", i,
                r.view, r.page, views.size(), pages.size());
        const auto& camera = views[r.view].camera;
        if (!inside(r.viewX, r.width, camera.width) || !inside(r.viewY, r.height, camera.height))
            return fail(ErrorCode::invalidInput,
                        "rectangle {} ({}x{} at {}, {}) leaves view {} of {}x{} pixels", i, r.width,
                        r.height, r.viewX, r.viewY, r.view, camera.width, camera.height);
        if (!inside(r.atlasX, r.atlasWidth(), width()) ||
            !inside(r.atlasY, r.atlasHeight(), height()))
            return fail(ErrorCode::invalidInput,
                        "rectangle {} ({}x{} at {}, {}) leaves its page of {}x{} pixels", i,
                        r.atlasWidth(), r.atlasHeight(), r.atlasX, r.atlasY, width(), height());
    }
    for (std::size_t i = 0; i < pages.size(); ++i)
        STX_CHECK(checkApart(rectangles, static_cast<int>(i)));
    return {};
}

}  // namespace stx

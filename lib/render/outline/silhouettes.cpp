#include "lib/render/outline/silhouettes.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <span>
#include <utility>

#include "lib/base/parallel.hpp"
#include "lib/render/outline/round_outlines.hpp"

namespace stx {
namespace {

// Where no source is named the value was chosen by trial on the project's image sets and meshes.

constexpr int kReach = 2;    // pixels from the background that are looked at
constexpr int kSamples = 4;  // per pixel and axis
constexpr std::uint32_t kAllSamples = (1u << (kSamples * kSamples)) - 1;
/// Points that touch a silhouette have an alpha of one half there; below this, clearly less, a ray
/// passes by. Of 255.
constexpr float kFree = 0.43f * 255.0f;
/// Depths that are looked at along the ray of a pixel: steps of one pixel's size behind (above 0)
/// and in front of its splat. The nearest come first, since they decide most pixels; the gaps grow
/// with the distance. Half a pixel beside the silhouette a ball with a radius of 300 pixels is
/// sqrt(300) = 17 pixels deep: the list goes as far in front and, for larger balls, farther behind.
constexpr std::array kDepthSteps = {0, 1, 3, -2, 5, 8, -5, 12, 17, -10, 24, 32, -18, 44};

/// The farthest depth of a pixel that has one and of those around it.
float farthestAround(const Image<float>& depth, int x, int y) {
    float farthest = depth.at(x, y);
    for (int v = y - 1; v <= y + 1; ++v)
        for (int u = x - 1; u <= x + 1; ++u)
            if (depth.contains(u, v) && hasPoint(depth.at(u, v)))
                farthest = std::max(farthest, depth.at(u, v));
    return farthest;
}

/// What happens between kReach pixels before a row of bytes' element and kReach after it, for all
/// but the first and last kReach. Without branches, so that compilers make vectors of it.
template <class F>
void overReach(std::span<const std::uint8_t> row, std::span<std::uint8_t> to, const F& joined) {
    static_assert(kReach == 2);
    for (std::size_t x = kReach; x + kReach < row.size(); ++x)
        to[x] =
            joined(joined(joined(row[x - 2], row[x - 1]), joined(row[x], row[x + 1])), row[x + 2]);
}

/// Sets 1 where an empty pixel lies within kReach in the same row, of `count` pixels. `empty` holds
/// kReach elements more on either side, which are 0. Without branches, so that compilers make
/// vectors of it.
void markRow(const float* depth, int count, std::uint8_t* empty, std::uint8_t* near) {
    for (int x = 0; x < count; ++x) empty[kReach + x] = hasPoint(depth[x]) ? 0 : 1;
    static_assert(kReach == 2);
    for (int x = 0; x < count; ++x)
        near[x] = empty[x] | empty[x + 1] | empty[x + 2] | empty[x + 3] | empty[x + 4];
}

/// The alpha of a frame's surface near a pixel, some of which are covered in part: the largest
/// within kReach.
float alphaAround(const Frame& frame, int x, int y) {
    float most = 0;
    for (int v = y - kReach; v <= y + kReach; ++v)
        for (int u = x - kReach; u <= x + kReach; ++u)
            if (frame.colour.contains(u, v)) most = std::max(most, frame.colour.at(u, v).a);
    return std::min(most, 1.0f);
}

}  // namespace

float Silhouettes::alphaOf(const PageRectangle& r, std::size_t texel) const {
    const auto page = static_cast<std::size_t>(r.page);
    if (const std::uint8_t covered = glass_.coverage(page, texel)) return covered;
    const Texture& texture = *set_.pages()[page].texture;
    if (const auto* image = texture.rgba8()) return image->data()[texel].a;
    return std::round(std::clamp(texture.rgbaFloat()->data()[texel].a, 0.0f, 1.0f) * 255.0f);
}

Image<std::uint8_t> Silhouettes::alphaOf(std::size_t number) const {
    const Camera& camera = set_.views()[number].camera;
    Image<std::uint8_t> alpha(camera.width, camera.height);
    for (int y = 0; y < camera.height; ++y) {
        for (int x = 0; x < camera.width; ++x) {
            const PageRectangle* r = set_.find(number, x, y);
            alpha.at(x, y) = static_cast<std::uint8_t>(r ? alphaOf(*r, r->texel(x, y))
                                                       : set_.objectOutside(number, x, y) ? 255.0f
                                                                                          : 0.0f);
        }
    }
    return alpha;
}

/// Coverage within kReach of each pixel; mixed where that leaves the picture.
Image<Silhouettes::Around> Silhouettes::aroundOf(const Image<std::uint8_t>& alpha) {
    const int w = alpha.width(), h = alpha.height();
    Image<Around> around(w, h, Around::mixed);
    const auto lesser = [](std::uint8_t a, std::uint8_t b) { return a < b ? a : b; };
    const auto greater = [](std::uint8_t a, std::uint8_t b) { return a > b ? a : b; };
    Image<std::uint8_t> least(w, h), most(w, h);  // of each row
    for (int y = 0; y < h; ++y) {
        overReach(alpha.row(y), least.row(y), lesser);
        overReach(alpha.row(y), most.row(y), greater);
    }
    for (int y = kReach; y + kReach < h; ++y) {
        Around* to = around.row(y).data();
        const std::uint8_t *low[2 * kReach + 1], *high[2 * kReach + 1];
        for (int j = 0; j <= 2 * kReach; ++j) {
            low[j] = least.row(y + j - kReach).data();
            high[j] = most.row(y + j - kReach).data();
        }
        for (int x = kReach; x < w - kReach; ++x) {
            std::uint8_t a = low[0][x], b = high[0][x];
            for (int j = 1; j <= 2 * kReach; ++j) {
                a = lesser(a, low[j][x]);
                b = greater(b, high[j][x]);
            }
            to[x] = a == 255 ? Around::full : b == 0 ? Around::empty : Around::mixed;
        }
    }
    return around;
}

/// Bilinear coverage at a pixel position; full outside the image, where nothing is known.
float Silhouettes::alphaBilinear(const View& view, double x, double y) const {
    const double px = x - 0.5, py = y - 0.5;
    const double bx = std::floor(px), by = std::floor(py);
    if (!(bx >= 0 && by >= 0 && bx < view.camera.width - 1 && by < view.camera.height - 1))
        return 255.0f;
    const int ix = static_cast<int>(bx), iy = static_cast<int>(by);
    const auto fx = static_cast<float>(px - bx), fy = static_cast<float>(py - by);
    const auto between = [&](float a, float b, float c, float d) {
        const float top = a * (1 - fx) + b * fx, bottom = c * (1 - fx) + d * fx;
        return top * (1 - fy) + bottom * fy;
    };
    if (!view.alpha.empty()) {
        const std::uint8_t* a = view.alpha.row(iy).data() + ix;
        const std::uint8_t* b = view.alpha.row(iy + 1).data() + ix;
        return between(a[0], a[1], b[0], b[1]);
    }
    const PageRectangle* r = set_.find(view.number, ix, iy, ix + 1, iy + 1);
    const auto at = [&](int i, int j) {
        if (r) return alphaOf(*r, r->texel(i, j));
        return set_.objectOutside(view.number, i, j) ? 255.0f : 0.0f;
    };
    return between(at(ix, iy), at(ix + 1, iy), at(ix, iy + 1), at(ix + 1, iy + 1));
}

Silhouettes::Silhouettes(PageSet set) : set_(std::move(set)), glass_(set_) {
    std::vector<View> all(set_.views().size());
    parallelFor(0, all.size(), [&](std::size_t n) {
        set_.settle();
        const auto number = n;
        if (set_.views()[number].unread) return;
        const Camera& camera = set_.views()[number].camera;
        const int w = camera.width, h = camera.height;
        Image<std::uint8_t> alpha = alphaOf(number);
        if (std::all_of(alpha.data(), alpha.data() + alpha.count(),
                        [](std::uint8_t a) { return a == 255; }))
            return;
        View view{number, camera, {}, {}};
        view.around = aroundOf(alpha);
        if (set_.find(number, 0, 0, w - 1, h - 1)) view.alpha = std::move(alpha);
        view.around.moveTo(set_.spool());
        view.alpha.moveTo(set_.spool());
        all[number] = std::move(view);
    });
    for (auto& view : all) {
        if (!view.around.empty()) views_.push_back(std::move(view));
    }
    const bool unread = std::ranges::any_of(
        set_.views(), [](const PageView& v) { return v.unread && v.unread->open; });
    if (!views_.empty() || unread) outlines_.emplace(set_, &glass_);
    if (!outlines_ || glass_.none()) return;
    for (std::size_t n = 0; n < set_.views().size(); ++n) {
        const auto hasGlass = [&](const PageRectangle& r) {
            return !glass_.none(static_cast<std::size_t>(r.page));
        };
        if (std::ranges::any_of(set_.rectanglesOf(n), hasGlass))
            glassViews_.push_back({n, set_.views()[n].camera});
    }
}

/// Which of the `wanted` samples of a pixel, a bit for each, are free at that depth. Asks view
/// `first` first, and leaves there the one that told the last of them.
std::uint32_t Silhouettes::freeSamples(const Maps& maps, int x, int y, double depth,
                                       std::uint32_t wanted, std::size_t& first) const {
    std::uint32_t free = 0;
    static_assert(kSamples * kSamples <= 32);
    const std::size_t asked = first;
    for (std::size_t k = 0; k < views_.size(); ++k) {
        const std::size_t v = k == 0 ? asked : k <= asked ? k - 1 : k;
        const View& view = views_[v];
        const PixelMap& m = maps[v];
        const auto project = [&](const glm::dvec3& h) {
            const double w = view.camera.orthographic ? 1.0 : 1.0 / h.z;
            return glm::dvec2(h.x * w + 0.5, h.y * w + 0.5);
        };
        const glm::dvec3 h = (m.a0 + m.au * double(x) + m.av * double(y)) * depth + m.b0 +
                             m.bu * double(x) + m.bv * double(y);
        if (!(h.z > 0)) continue;
        const glm::dvec2 centre = project(h);
        if (!(centre.x >= 0 && centre.y >= 0 && centre.x < view.camera.width &&
              centre.y < view.camera.height))
            continue;
        const auto around = view.around.at(static_cast<int>(centre.x), static_cast<int>(centre.y));
        if (around == Around::full) continue;
        if (around == Around::empty) {
            first = v;
            return wanted;
        }
        // Within a pixel the way into a reference is as good as affine.
        const auto right = project(h + m.au * depth + m.bu) - centre;
        const auto down = project(h + m.av * depth + m.bv) - centre;
        for (std::uint32_t rest = wanted & ~free; rest; rest &= rest - 1) {
            const int sample = std::countr_zero(rest);
            const double dx = (sample % kSamples + 0.5) / kSamples - 0.5;
            const double dy = (sample / kSamples + 0.5) / kSamples - 0.5;
            const auto p = centre + right * dx + down * dy;
            if (alphaBilinear(view, p.x, p.y) < kFree) free |= 1u << sample;
        }
        if (free == wanted) {
            first = v;
            break;
        }
    }
    return free;
}

bool Silhouettes::nearGlass(const Maps& maps, int x, int y, double depth) const {
    for (std::size_t k = 0; k < glassViews_.size(); ++k) {
        const auto& [number, camera] = glassViews_[k];
        const PixelMap& m = maps[k];
        const glm::dvec3 h = (m.a0 + m.au * double(x) + m.av * double(y)) * depth + m.b0 +
                             m.bu * double(x) + m.bv * double(y);
        if (!(h.z > 0)) continue;
        const double w = camera.orthographic ? 1.0 : 1.0 / h.z;
        const glm::dvec2 at(h.x * w + 0.5, h.y * w + 0.5);
        if (!(at.x >= 0 && at.y >= 0 && at.x < camera.width && at.y < camera.height)) continue;
        // What sticks out of glass lies beside it.
        for (const int down : {0, -kReach, kReach}) {
            for (const int across : {0, -kReach, kReach}) {
                const int i = static_cast<int>(at.x) + across, j = static_cast<int>(at.y) + down;
                if (i < 0 || j < 0 || i >= camera.width || j >= camera.height) continue;
                const PageRectangle* r = set_.find(number, i, j);
                if (r && glass_.coverage(static_cast<std::size_t>(r->page), r->texel(i, j)) > 0)
                    return true;
            }
        }
    }
    return false;
}

float Silhouettes::coverage(const Camera& camera, const Maps& maps, int x, int y,
                            const Image<float>& depths, std::size_t& first) const {
    // At a silhouette the surface runs along the ray, so the splat's depth is the least certain
    // thing there is (half a pixel aside is 17 pixels deep on a ball of 300): a ray passes by only
    // if nothing around that depth is solid for all references. Nor around that of what is behind
    // it, which the pixels beside it show: a splat that sticks out hides the surface behind it.
    std::uint32_t free = kAllSamples;
    const float here = depths.at(x, y), behind = farthestAround(depths, x, y);
    const auto spacing = camera.sampleSpacing(here);
    const double pixel = std::max(spacing.x, spacing.y);
    for (const float depth : {here, behind}) {
        for (const int k : kDepthSteps) {
            const double at = depth + k * pixel;
            if (!camera.orthographic && at <= 0) continue;
            free = freeSamples(maps, x, y, at, free, first);
            if (free == 0) return 1.0f;
        }
        if (behind < here + pixel) break;
    }
    return 1.0f - static_cast<float>(std::popcount(free)) / (kSamples * kSamples);
}

void Silhouettes::carve(Frame& frame, const Camera& camera, const Extent& drawn) {
    if (none()) return;
    constexpr int kRowsPerTask = 16;
    const int w = frame.depth.width(), h = frame.depth.height();
    // Whatever is not empty in it has what is near in it, too.
    const Extent part = drawn.grown(kReach, w, h);
    const int across = part.x1 - part.x0,
              tasks = (part.y1 - part.y0 + kRowsPerTask - 1) / kRowsPerTask;
    Maps maps;
    for (const View& view : views_) maps.push_back(pixelMap(camera, view.camera));
    // Whether a pixel is looked at depends on depths that carving changes: look first, carve then.
    if (covered_.size() != frame.depth.size()) covered_ = Image<float>(w, h, -1.0f);
    const auto partOf = [&](int y) {
        return covered_.row(y).subspan(static_cast<std::size_t>(part.x0),
                                       static_cast<std::size_t>(across));
    };
    const auto inRows = [&](const auto& call) {
        parallelFor(0, tasks, [&](int task) {
            const int from = part.y0 + task * kRowsPerTask;
            call(from, std::min(part.y1, from + kRowsPerTask));
        });
    };
    inRows([&](int from, int to) {
        const int first = std::max(part.y0, from - kReach),
                  last = std::min(part.y1 - 1, to - 1 + kReach);
        Image<std::uint8_t> rowMarks(across, last - first + 1);
        const auto width = static_cast<std::size_t>(std::max(across, 0));
        std::vector<std::uint8_t> empty(width + 2 * kReach), mark(width);
        for (int y = first; y <= last; ++y)
            markRow(frame.depth.row(y).data() + part.x0, across, empty.data(),
                    rowMarks.row(y - first).data());
        for (int y = from; y < to; ++y) {
            std::fill(mark.begin(), mark.end(), std::uint8_t{0});
            for (int j = std::max(first, y - kReach); j <= std::min(last, y + kReach); ++j) {
                const std::uint8_t* rowMark = rowMarks.row(j - first).data();
                for (int x = 0; x < across; ++x) mark[x] |= rowMark[x];
            }
            const float* depth = frame.depth.row(y).data() + part.x0;
            float* asked = partOf(y).data();
            for (int x = 0; x < across; ++x)
                asked[x] = (mark[x] != 0) & hasPoint(depth[x]) ? Outlines::kAsked : -1.0f;
        }
    });
    outlines_->measure(frame, camera, covered_, part);
    inRows([&](int from, int to) {
        // What one view sees past at a pixel it mostly sees past beside it, and before and behind.
        std::size_t seesPast = 0;
        for (int y = from; y < to; ++y)
            forWhere(
                partOf(y), [](float c) { return c == Outlines::kAsked; },
                [&](int column) {
                    const int x = part.x0 + column;
                    covered_.at(x, y) = coverage(camera, maps, x, y, frame.depth, seesPast);
                });
    });
    // Calls for each pixel that has a share.
    const auto forShares = [&](const auto& call) {
        inRows([&](int from, int to) {
            for (int y = from; y < to; ++y)
                forWhere(
                    partOf(y), [](float c) { return c >= 0.0f; },
                    [&](int column) { call(part.x0 + column, y); });
        });
    };
    if (!glassViews_.empty()) {
        Maps glassMaps;
        for (const GlassView& view : glassViews_)
            glassMaps.push_back(pixelMap(camera, view.camera));
        // Before any pixel is changed: what is around one is looked at.
        forShares([&](int x, int y) {
            if (!nearGlass(glassMaps, x, y, frame.depth.at(x, y))) return;
            float& share = covered_.at(x, y);
            // Something opaque around it does not make glass opaque.
            share = std::min(share * alphaAround(frame, x, y), frame.colour.at(x, y).a);
        });
    }
    forShares(
        [&](int x, int y) { setCoverage(frame, x, y, std::exchange(covered_.at(x, y), -1.0f)); });
}

}  // namespace stx

#include "lib/render/splat/others.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "lib/base/parallel.hpp"

namespace stx::splat {
namespace {

// Where no source is named the value was chosen by trial on the project's image sets and meshes.

constexpr int kHalf = kBlock / 2, kQuarters = 4;
/// Points of a quarter that are looked up: one of every 2x2.
constexpr int kSamples = kHalf / 2 * (kHalf / 2);
/// Views that see a point from less far apart than this hardly ever make each other needless.
constexpr double kSameSide = 0.97;  // cosine, 14 degrees
/// And this far apart they hardly ever show the same.
constexpr double kOtherSide = -0.2;
/// A view whose samples lie farther apart than this many times those of the block does not do.
constexpr float kCoarsest = 1.5f;
/// Nor one from which the surface is steeper (Slope, both ways together): its splats leave gaps.
constexpr float kSteepestShown = 2.0f;
/// Depths of one surface differ by no more than this share and this many sample spacings.
constexpr float kSameDepth = 0.002f, kSameSpacings = 1.0f;
/// What weighs less than this share of what shows it better is left out.
constexpr float kNeedless = 0.15f;
/// Only views that weigh so much more count as showing it better: the order of views that weigh
/// about the same may differ from block to block, and none may go because of a view that goes too.
constexpr float kClearly = 1.2f;

/// Where a view is seen from a point: direction = at * point - place, of no certain length.
glm::vec4 directionOf(const Camera& camera) {
    return camera.orthographic ? glm::vec4(-camera.forward(), 0.0f)
                               : glm::vec4(camera.position, 1.0f);
}

glm::vec3 towards(const glm::vec4& view, glm::vec3 point) {
    return glm::normalize(view.w * point - glm::vec3(view));
}

/// Points of a quarter in pixels of its rectangle from the block's first one on.
struct Samples {
    std::array<float, kSamples> u, v, depth;
    int count = 0;
    bool edges = false;  // not all are linked
};

Samples samplesOf(const PageRectangle& r, const Page& page, const Pixels<Slope>& slopes,
                  const BlockInfo& b, int quarter) {
    Samples out;
    const int x0 = b.u0 + (quarter & 1) * kHalf, y0 = b.v0 + (quarter >> 1) * kHalf;
    const int x1 = std::min<int>(x0 + kHalf, b.u1), y1 = std::min<int>(y0 + kHalf, b.v1);
    const auto texelOf = [&](int x, int y) {
        return static_cast<std::size_t>(r.pageY + y) * page.width() + r.pageX + x;
    };
    const auto isDrawn = [&](std::size_t texel) {
        return hasPoint(page.depth->data()[texel]) && (b.opaque || page.texture->alpha(texel) > 0);
    };
    const auto isOpaque = [&](std::size_t texel) {
        return !b.glass || page.texture->alpha(texel) >= 1.0f;
    };
    for (int y = y0; y < y1; ++y)
        for (int x = x0; x < x1; ++x)
            out.edges =
                out.edges || !(hasPoint(page.depth->data()[texelOf(x, y)]) &&
                               slopes[texelOf(x, y)].u & Slope::kLinked && isOpaque(texelOf(x, y)));
    for (int y = y0; y < y1; y += 2) {
        for (int x = x0; x < x1; x += 2) {
            // The first of four that is drawn, another one first each time.
            for (int k = 0; k < 4; ++k) {
                const int turn = k ^ ((x / 2 + y) & 3);
                const int i = x + (turn & 1), j = y + (turn >> 1);
                if (i >= x1 || j >= y1 || !isDrawn(texelOf(i, j))) continue;
                const auto n = static_cast<std::size_t>(out.count++);
                out.u[n] = static_cast<float>(i - b.u0);
                out.v[n] = static_cast<float>(j - b.v0);
                out.depth[n] = page.depth->data()[texelOf(i, j)];
                break;
            }
        }
    }
    return out;
}

/// How the pixels of a block lie in another view: see PixelMap, counted from the block's first one.
struct BlockMap {
    glm::vec3 a0, au, av, b0, bu, bv;
    BlockMap(const PixelMap& m, const BlockInfo& b)
        : a0(m.a0 + m.au * double(b.u0) + m.av * double(b.v0)),
          au(m.au),
          av(m.av),
          b0(m.b0 + m.bu * double(b.u0) + m.bv * double(b.v0)),
          bu(m.bu),
          bv(m.bv) {}
};

/// Looks up points in a view.
class Lookup {
  public:
    Lookup(const PageSet& set, const PreparedPages& prepared, std::size_t view)
        : set_(set), prepared_(prepared), view_(view), camera_(set.views()[view].camera) {}

    /// Whether the view shows all of some points, each inside of a surface, and no coarser than
    /// `spacing` (of samples, over depth unless orthographic) allows.
    [[nodiscard]] bool shows(const BlockMap& m, const Samples& s, float spacing,
                             bool orthographic) const {
        const auto width = static_cast<float>(camera_.width - 1),
                   height = static_cast<float>(camera_.height - 1);
        const auto pixel = static_cast<float>(1.0 / std::min(camera_.fx, camera_.fy));
        std::array<Place, kSamples> places;
        const auto count = static_cast<std::size_t>(s.count);
        // One first, since most that show it not at all do not show that. The others are found
        // first and looked at then, so that memory is waited for once and not for each.
        for (std::size_t from = 0, to = 1; from < count; from = to, to = count) {
            for (std::size_t n = from; n < to; ++n) {
                const glm::vec3 h = (m.a0 + m.au * s.u[n] + m.av * s.v[n]) * s.depth[n] + m.b0 +
                                    m.bu * s.u[n] + m.bv * s.v[n];
                const float scale = camera_.orthographic ? 1.0f : 1.0f / h.z;
                const float x = h.x * scale, y = h.y * scale;
                // False for what is not a number.
                if (!(h.z > 0 && x > 0 && y > 0 && x < width && y < height)) return false;
                const float there = pixel * (camera_.orthographic ? 1.0f : h.z);
                if (there > kCoarsest * spacing * (orthographic ? 1.0f : s.depth[n])) return false;
                Place& p = places[n];
                if (!find(static_cast<int>(x + 0.5f), static_cast<int>(y + 0.5f), p)) return false;
                p.dist = h.z;
                p.spacing = there;
                __builtin_prefetch(p.depth);
                __builtin_prefetch(p.slope);
            }
            for (std::size_t n = from; n < to; ++n)
                if (!isSurface(places[n])) return false;
        }
        return s.count > 0;
    }

  private:
    struct Place {
        const float* depth;
        const Slope* slope;
        float dist, spacing;  ///< of the point that is looked up
        bool opaque;          ///< true without a look where nothing is glass: linked points are
    };
    [[nodiscard]] bool find(int x, int y, Place& place) const {
        if (set_.views()[view_].unread) return false;
        const PageRectangle* r = set_.find(view_, x, y);
        // Padding repeats what other rectangles show, or what was pruned.
        if (!r || x < r->x0 || y < r->y0 || x >= r->x1 || y >= r->y1) return false;
        const auto page = static_cast<std::size_t>(r->page);
        const std::size_t texel = r->texel(x, y);
        place.depth = set_.pages()[page].depth->data() + texel;
        place.slope = prepared_.pages[page].slopes.data() + texel;
        place.opaque = !prepared_.glass || set_.pages()[page].texture->alpha(texel) >= 1.0f;
        return true;
    }
    [[nodiscard]] static bool isSurface(const Place& p) {
        if (!hasPoint(*p.depth) || !(p.slope->u & Slope::kLinked) || !p.opaque) return false;
        const auto steepness =
            static_cast<float>(std::abs(int{p.slope->u}) + std::abs(int{p.slope->v})) / kSlopeScale;
        if (steepness > kSteepestShown) return false;
        // Up to half a pixel beside.
        return std::abs(p.dist - *p.depth) <
               kSameDepth * p.dist + (kSameSpacings + 0.5f * steepness) * p.spacing;
    }

    const PageSet& set_;
    const PreparedPages& prepared_;
    std::size_t view_;
    const Camera& camera_;
};

/// The views that may show what a rectangle shows from elsewhere, the nearest first.
std::vector<std::size_t> candidates(const PageSet& set, const PreparedRectangle& rectangle) {
    glm::dvec3 middle(0.0);
    for (const BlockInfo& b : rectangle.blocks) middle += glm::dvec3(b.middle);
    middle /= std::max<double>(1.0, static_cast<double>(rectangle.blocks.size()));
    const auto own = static_cast<std::size_t>(rectangle.rectangle->view);
    const glm::vec3 mine = towards(directionOf(rectangle.camera()), middle);
    std::vector<std::pair<float, std::size_t>> found;
    for (std::size_t t = 0; t < set.views().size(); ++t) {
        const float cosine = glm::dot(mine, towards(directionOf(set.views()[t].camera), middle));
        if (t != own && cosine < kSameSide && cosine > kOtherSide) found.emplace_back(-cosine, t);
    }
    std::sort(found.begin(), found.end());
    if (found.size() > Others::kMost) found.resize(Others::kMost);
    std::vector<std::size_t> out;
    for (const auto& [angle, view] : found) out.push_back(view);
    return out;
}

}  // namespace

void findOthers(const PageSet& set, PreparedPages& prepared) {
    for (PreparedRectangle& rectangle : prepared.rectangles) {
        set.settle();
        const PageRectangle& r = *rectangle.rectangle;
        const Camera& own = rectangle.camera();
        for (BlockInfo& b : rectangle.blocks) {
            const glm::dvec3 inCamera =
                own.unproject(0.5 * (b.u0 + b.u1), 0.5 * (b.v0 + b.v1), 0.5 * (b.zMin + b.zMax));
            b.middle = own.position + own.orientation * inCamera;
        }
        const auto views = candidates(set, rectangle);
        rectangle.others = {};
        if (views.empty()) continue;
        std::vector<Lookup> lookups;
        std::vector<PixelMap> maps;
        for (std::size_t n = 0; n < views.size(); ++n) {
            const Camera& camera = set.views()[views[n]].camera;
            rectangle.others.set(n, directionOf(camera));
            lookups.emplace_back(set, prepared, views[n]);
            maps.push_back(pixelMap(own, camera));
        }
        const Page& page = set.pages()[r.page];
        const auto& slopes = prepared.pages[r.page].slopes;
        const auto spacing = static_cast<float>(1.0 / std::min(own.fx, own.fy));
        const auto find = [&](std::int64_t from, std::int64_t to) {
            for (auto k = static_cast<std::size_t>(from); k < static_cast<std::size_t>(to); ++k) {
                BlockInfo& b = rectangle.blocks[k];
                std::array<Samples, kQuarters> samples;
                for (std::size_t q = 0; q < kQuarters; ++q) {
                    samples[q] = samplesOf(r, page, slopes, b, static_cast<int>(q));
                }
                for (std::size_t n = 0; n < views.size(); ++n) {
                    const BlockMap map(maps[n], b);
                    for (std::size_t q = 0; q < kQuarters; ++q)
                        // Splats that stick out cover the pixels of an outline in part: without
                        // them it flickers.
                        if (!samples[q].edges &&
                            lookups[n].shows(map, samples[q], spacing, own.orthographic))
                            b.shownBy[q] |= static_cast<std::uint16_t>(1u << n);
                }
            }
        };
        parallelForBlocks(0, rectangle.blocks.size(), 32, find);
    }
}

std::uint8_t neededQuarters(const PreparedRectangle& rectangle, const BlockInfo& block,
                            const Camera& novel, float quality) {
    constexpr std::uint8_t kAll = 15;
    const unsigned some = block.shownBy[0] | block.shownBy[1] | block.shownBy[2] | block.shownBy[3];
    if (!some) return kAll;
    const glm::vec3 to = towards(directionOf(novel), block.middle);
    const Others& o = rectangle.others;
    // Without branches, so that compilers make vectors of it.
    std::array<float, Others::kMost> weights;
    for (std::size_t n = 0; n < Others::kMost; ++n) {
        const float x = o.at[n] * block.middle.x - o.x[n], y = o.at[n] * block.middle.y - o.y[n],
                    z = o.at[n] * block.middle.z - o.z[n];
        const float length2 = x * x + y * y + z * z;
        const float weight = qualityOf((x * to.x + y * to.y + z * to.z) / std::sqrt(length2));
        weights[n] = weight > kClearly * quality ? weight : 0.0f;
    }
    std::uint8_t needed = kAll;
    for (std::size_t q = 0; q < kQuarters; ++q) {
        float better = 0;
        for (std::size_t n = 0; n < Others::kMost; ++n)
            better += block.shownBy[q] >> n & 1 ? weights[n] : 0.0f;
        if (quality < kNeedless * better) needed &= static_cast<std::uint8_t>(~(1u << q));
    }
    return needed;
}

}  // namespace stx::splat

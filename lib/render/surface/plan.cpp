#include "lib/render/surface/plan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "lib/base/parallel.hpp"

namespace stx::surface {
namespace {

/// What a block may reach out of its range by, relative to SourceBlock::reach, and the share of q
/// that rounding may add.
constexpr float kBlockMargin = 1.05f, kBlockRounding = 1e-5f;
/// What rounding may add to the terms that tell which way a block faces.
constexpr double kFacingRounding = 1e-3;
/// Where some of a block is behind the camera, it counts from this share of its largest w.
constexpr float kNearestShare = 1e-4f;

void addBounds(const Source& s, Bounds& bounds) {
    for (int by = 0; by < s.blocksY; ++by) {
        for (int bx = 0; bx < s.blocksX; ++bx) {
            const SourceBlock& block = s.blocks[static_cast<std::size_t>(by) * s.blocksX + bx];
            if (!(block.qMax > 0)) continue;
            for (int corner = 0; corner < 8; ++corner) {
                const double x = std::min((bx + (corner & 1)) * kBlock, s.width);
                const double y = std::min((by + (corner >> 1 & 1)) * kBlock, s.height);
                const double q = (corner & 4) ? block.qMax : block.qMin;
                const glm::dvec4 p = s.space.worldFromPixel * glm::dvec4(x, y, q, 1.0);
                bounds.add(glm::dvec3(p) / p.w);
            }
        }
    }
}

/// Whether all that is drawn of a block is seen from behind. `eye`: that of the frame in the space
/// of the source's pixels, homogeneous.
bool isTurnedAway(const Source& s, const BlockRange& block, int x, int y, const glm::dvec4& eye) {
    // A plane q = q0 + gx (x - x0) + gy (y - y0) faces the eye where
    // gx (x - x0) + gy (y - y0) < q - q0 there; each term by its range over the block.
    struct Range {
        double low, high;
        [[nodiscard]] double size() const { return std::max(std::abs(low), std::abs(high)); }
    };
    const auto between = [](double a, double b) { return Range{std::min(a, b), std::max(a, b)}; };
    const auto product = [&](Range a, Range b) {
        const double all[] = {a.low * b.low, a.low * b.high, a.high * b.low, a.high * b.high};
        return Range{*std::min_element(all, all + 4), *std::max_element(all, all + 4)};
    };
    const double margin =
        kBlockMargin * block.reach + kBlockRounding * s.space.axis.relativeScale(block.qMax);
    const auto along = [&](double at, double from, float least, float most) {
        return product({least, most},
                       between(at - (from - 1.0) * eye.w, at - (from + kBlock + 2.0) * eye.w));
    };
    const Range ofX = along(eye.x, x, block.leastSlope.x, block.mostSlope.x);
    const Range ofY = along(eye.y, y, block.leastSlope.y, block.mostSlope.y);
    const Range depth =
        between(eye.z - (block.qMin - margin) * eye.w, eye.z - (block.qMax + margin) * eye.w);
    return ofX.low + ofY.low - depth.high >
           kFacingRounding * (ofX.size() + ofY.size() + depth.size());
}

/// The corners of the room that a block is drawn in, as a frame has them; side by side, so that
/// compilers make vectors of it.
struct Corners {
    std::array<float, 8> x, y, w;  ///< homogeneous
    struct Box {
        float x0 = std::numeric_limits<float>::max(), y0 = x0, x1 = -x0, y1 = -x0;

        void add(float x, float y) {
            x0 = std::min(x0, x);
            x1 = std::max(x1, x);
            y0 = std::min(y0, y);
            y1 = std::max(y1, y);
        }
    };

    /// Of the block whose first pixel is (bx, by).
    Corners(const Warp& warp, float bx, float by, float qNear, float qFar) {
        const auto& m = warp.m;
        for (std::size_t k = 0; k < 8; ++k) {
            const float u = (k & 1) ? bx + kBlock + 1.5f : bx - 0.5f;
            const float v = (k & 2) ? by + kBlock + 1.5f : by - 0.5f;
            const float q = (k & 4) ? qNear : qFar;
            x[k] = m[0] * u + m[1] * v + m[2] * q + m[3];
            y[k] = m[4] * u + m[5] * v + m[6] * q + m[7];
            w[k] = m[12] * u + m[13] * v + m[14] * q + m[15];
        }
    }
    /// Where they are when all are in front of the camera.
    [[nodiscard]] Box all() const {
        std::array<float, 8> u, v;
        for (std::size_t k = 0; k < 8; ++k) {
            u[k] = x[k] / w[k];
            v[k] = y[k] / w[k];
        }
        const auto [x0, x1] = std::ranges::minmax(u);
        const auto [y0, y1] = std::ranges::minmax(v);
        return {x0, y0, x1, y1};
    }
    /// Where what is before the camera is: what is behind is cut off, and what is next to nothing
    /// before it, nearer than `cut`.
    [[nodiscard]] Box inFront(float cut) const {
        Box box;
        for (std::size_t k = 0; k < 8; ++k) {
            if (w[k] > 0) box.add(x[k] / w[k], y[k] / w[k]);
            for (const std::size_t bit : {1u, 2u, 4u}) {
                const std::size_t to = k ^ bit;
                if (!(w[k] > cut && w[to] < cut)) continue;
                const float along = (w[k] - cut) / (w[k] - w[to]);
                const float at = w[k] + (w[to] - w[k]) * along;
                box.add((x[k] + (x[to] - x[k]) * along) / at, (y[k] + (y[to] - y[k]) * along) / at);
            }
        }
        return box;
    }
};

FrameSource placeSource(const Source& s, const PixelSpace& space, int tilesX, int tilesY) {
    FrameSource f;
    f.source = &s;
    f.pixelFromSource = space.pixelFromWorld * s.space.worldFromPixel;
    f.sourceFromPixel = warpFrom(s.space.pixelFromWorld * space.worldFromPixel);
    f.fromEye = rayFrom(s.space, space);
    const Warp warp = warpFrom(f.pixelFromSource);
    const glm::dvec4 eye = s.space.pixelFromWorld * (space.camera.orthographic
                                                         ? glm::dvec4(-space.camera.forward(), 0.0)
                                                         : glm::dvec4(space.camera.position, 1.0));
    f.turnedAway.assign(s.blocks.size(), 0);
    struct Range {
        std::uint32_t block;
        int x0, y0, x1, y1;
        double middle;
    };
    std::vector<Range> ranges;
    f.tileBegin.assign(static_cast<std::size_t>(tilesX) * tilesY + 1, 0);
    for (const Source::PlannedBlock& block : s.planned) {
        const std::uint32_t index = block.number;
        const auto bx = static_cast<float>(index % s.blocksX * kBlock);
        const auto by = static_cast<float>(index / s.blocksX * kBlock);
        const float margin =
            kBlockMargin * block.reach + kBlockRounding * s.space.axis.relativeScale(block.qMax);
        const Corners corners(warp, bx, by, block.qMax + margin,
                              std::max(block.qMin - margin, 0.5f * block.qMin));
        const auto [least, most] = std::ranges::minmax(corners.w);
        if (!(most > 0)) continue;
        const bool behind = !(least > 0);
        auto [x0, y0, x1, y1] = behind ? corners.inFront(kNearestShare * most) : corners.all();
        const auto limitX = static_cast<float>(space.camera.width),
                   limitY = static_cast<float>(space.camera.height);
        x0 = std::max(x0 - 0.5f, 0.0f);
        y0 = std::max(y0 - 0.5f, 0.0f);
        x1 = std::min(x1 + 0.5f, limitX - 0.5f);
        y1 = std::min(y1 + 0.5f, limitY - 0.5f);
        if (!(x0 <= x1 && y0 <= y1)) continue;
        const glm::dvec4 h = f.pixelFromSource * glm::dvec4(bx + 0.5 * kBlock, by + 0.5 * kBlock,
                                                            0.5 * (block.qMin + block.qMax), 1.0);
        const Range r{index,
                      static_cast<int>(x0) / kTile,
                      static_cast<int>(y0) / kTile,
                      static_cast<int>(x1) / kTile,
                      static_cast<int>(y1) / kTile,
                      h.w > 0 ? (behind ? -h.z : h.z) / h.w : 0.0};
        ranges.push_back(r);
        f.turnedAway[index] =
            isTurnedAway(s, block, static_cast<int>(bx), static_cast<int>(by), eye);
        for (int ty = r.y0; ty <= r.y1; ++ty)
            for (int tx = r.x0; tx <= r.x1; ++tx)
                ++f.tileBegin[static_cast<std::size_t>(ty * tilesX + tx) + 1];
    }
    for (std::size_t t = 1; t < f.tileBegin.size(); ++t) f.tileBegin[t] += f.tileBegin[t - 1];
    f.blocks.resize(f.tileBegin.back());
    f.middles.resize(f.tileBegin.back());
    std::vector<std::uint32_t> next(f.tileBegin.begin(), f.tileBegin.end() - 1);
    for (const Range& r : ranges)
        for (int ty = r.y0; ty <= r.y1; ++ty)
            for (int tx = r.x0; tx <= r.x1; ++tx) {
                const std::uint32_t at = next[static_cast<std::size_t>(ty * tilesX + tx)]++;
                f.blocks[at] = r.block;
                f.middles[at] = r.middle;
            }
    return f;
}

}  // namespace

Ray rayFrom(const PixelSpace& eye, const PixelSpace& frame) {
    Ray ray{};
    const glm::dmat4& m = frame.worldFromPixel;
    const glm::dvec3 at = eye.camera.position;
    const glm::dvec3 forward = eye.camera.forward();
    for (int axis = 0; axis < 3; ++axis) {
        for (int column = 0; column < 4; ++column) {
            const double value = eye.camera.orthographic
                                     ? (column == 3 ? forward[axis] : 0.0)
                                     : m[column][axis] - at[axis] * m[column][3];
            ray[static_cast<std::size_t>(axis * 4 + column)] = static_cast<float>(value);
        }
    }
    return ray;
}

Effort effortOf(Quality quality, const SurfaceScene& scene) {
    Effort e;
    switch (quality) {
        case Quality::draft:
            e.samplesPerPixel = 1;
            e.mostGeometry = 4;
            e.shade.mostSources = 2;
            break;
        case Quality::normal:
            e.freeAlpha = kFreeAlphaOfFew;
            break;
        case Quality::best:
            e.mostGeometry = kMostTileSources;
            break;
    }
    double valid = 0;
    for (const Source& s : scene.sources)
        valid += s.validShare / static_cast<double>(scene.sources.size());
    // Pruned views share the surface among them: each may be the only one left to show a piece of
    // it. Of views with gaps as many are needed as together show what the usual number would.
    if (scene.set.pruned()) {
        e.mostGeometry = kMostTileSources;
        e.freeAlpha = kFreeAlphaPruned;
        e.preferShown = true;
    } else if (valid < 1) {
        e.mostGeometry =
            static_cast<int>(std::min<double>(kMostTileSources, std::ceil(e.mostGeometry / valid)));
    }
    return e;
}

std::vector<int> SurfaceFrame::sourcesOf(int tile) const {
    std::vector<int> chosen;
    const auto count = static_cast<int>(sources.size());
    if (count <= effort.mostGeometry) {
        for (int i = 0; i < count; ++i) chosen.push_back(i);
        return chosen;
    }
    const double q = middles[static_cast<std::size_t>(tile)];
    if (!(q > 0)) return chosen;
    const glm::dvec4 h = space.worldFromPixel *
                         glm::dvec4(tileX(tile) + kTile * 0.5, tileY(tile) + kTile * 0.5, q, 1.0);
    const glm::dvec3 point = glm::dvec3(h) / h.w;
    const auto towards = [&](const Camera& c) {
        return c.orthographic ? c.forward() : glm::normalize(point - c.position);
    };
    const glm::dvec3 look = towards(space.camera);
    // A camera may stand right where the view is drawn from and look elsewhere.
    const auto inPicture = [&](const Source& s) {
        const glm::dvec4 at = s.space.pixelFromWorld * glm::dvec4(point, 1.0);
        return at.w > 0 && at.x >= 0 && at.y >= 0 && at.x <= at.w * s.width &&
               at.y <= at.w * s.height;
    };
    // The first of what is left, by rank; those that show nothing there come last, by theirs.
    using Ranked = std::pair<double, int>;
    std::vector<Ranked> left, idle;
    left.reserve(sources.size());
    for (int i = 0; i < count; ++i)
        left.emplace_back(
            -glm::dot(look, towards(sources[static_cast<std::size_t>(i)].source->space.camera)), i);
    std::make_heap(left.begin(), left.end(), std::greater<>());
    const auto most = static_cast<std::size_t>(effort.mostGeometry);
    while (!left.empty() && chosen.size() < most) {
        std::pop_heap(left.begin(), left.end(), std::greater<>());
        const auto [rank, i] = left.back();
        left.pop_back();
        const FrameSource& f = sources[static_cast<std::size_t>(i)];
        if (inPicture(*f.source) && !(effort.preferShown && f.blocksOf(tile).empty()))
            chosen.push_back(i);
        else
            idle.emplace_back(rank, i);
    }
    std::sort(idle.begin(), idle.end());
    for (std::size_t k = 0; chosen.size() < most; ++k) chosen.push_back(idle[k].second);
    std::sort(chosen.begin(), chosen.end());
    return chosen;
}

glm::dmat4 SurfaceFrame::sampleFromPixel(int tile, int perPixel, int apron) const {
    glm::dmat4 m(1.0);
    m[0][0] = m[1][1] = perPixel;
    m[3][0] = -(tileX(tile) - apron) * perPixel - 0.5;
    m[3][1] = -(tileY(tile) - apron) * perPixel - 0.5;
    return m;
}

float SurfaceFrame::qLimit() const {
    return space.axis.inverse ? std::numeric_limits<float>::max()
                              : static_cast<float>(space.axis.q(0.0));
}

void keepTiles(SurfaceFrame& frame, std::span<const std::uint8_t> wanted) {
    for (std::size_t t = 0; t < frame.middles.size(); ++t)
        if (!wanted[t]) frame.middles[t] = 0;
    for (FrameSource& f : frame.sources) {
        std::uint32_t kept = 0, begin = 0;
        for (std::size_t t = 0; t < wanted.size(); ++t) {
            const std::uint32_t end = f.tileBegin[t + 1];
            if (wanted[t])
                for (std::uint32_t b = begin; b < end; ++b, ++kept) {
                    f.blocks[kept] = f.blocks[b];
                }
            begin = end;
            f.tileBegin[t + 1] = kept;
        }
        f.blocks.resize(kept);
    }
}

/// By tile: q in the middle of the blocks that fall in it, 0 = none.
std::vector<double> middlesOf(const SurfaceFrame& frame) {
    struct Sum {
        double q = 0;
        int blocks = 0;
    };
    // Where some of a block is behind the camera, its middle may be anywhere: only without others.
    const std::size_t tiles = static_cast<std::size_t>(frame.tilesX) * frame.tilesY;
    std::vector<std::array<Sum, 2>> sums(tiles);
    for (const FrameSource& f : frame.sources) {
        for (std::size_t t = 0; t < tiles; ++t) {
            for (std::uint32_t b = f.tileBegin[t]; b < f.tileBegin[t + 1]; ++b) {
                const double middle = f.middles[b];
                if (!(std::abs(middle) > 0)) continue;
                Sum& sum = sums[t][middle > 0 ? 0 : 1];
                sum.q += std::abs(middle);
                ++sum.blocks;
            }
        }
    }
    std::vector<double> middles(tiles, 0.0);
    for (std::size_t t = 0; t < tiles; ++t)
        if (const Sum& sum = sums[t][sums[t][0].blocks ? 0 : 1]; sum.blocks)
            middles[t] = sum.q / sum.blocks;
    return middles;
}

Bounds boundsOf(const SurfaceScene& scene) {
    Bounds bounds;
    for (const Source& s : scene.sources) addBounds(s, bounds);
    return bounds;
}

SurfaceFrame planFrame(const SurfaceScene& scene, const Bounds& bounds, const Effort& effort,
                       const Camera& camera) {
    double farthest = 1.0;
    if (!bounds.empty())
        farthest = std::max(
            1e-6 * bounds.radius(),
            glm::dot(bounds.centre() - camera.position, camera.forward()) + bounds.radius());
    SurfaceFrame f;
    f.space = PixelSpace(camera, farthest);
    f.tilesX = (camera.width + kTile - 1) / kTile;
    f.tilesY = (camera.height + kTile - 1) / kTile;
    f.effort = effort;
    f.sources.resize(scene.sources.size());
    parallelFor(0, static_cast<std::int64_t>(f.sources.size()), [&](std::int64_t i) {
        const auto k = static_cast<std::size_t>(i);
        f.sources[k] = placeSource(scene.sources[k], f.space, f.tilesX, f.tilesY);
    });
    if (static_cast<int>(f.sources.size()) > effort.mostGeometry) f.middles = middlesOf(f);
    return f;
}

}  // namespace stx::surface

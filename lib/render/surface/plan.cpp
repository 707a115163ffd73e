#include "lib/render/surface/plan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
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
bool isTurnedAway(const Source& s, const SourceBlock& block, int x, int y, const glm::dvec4& eye) {
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
    for (std::uint32_t index = 0; index < s.blocks.size(); ++index) {
        const SourceBlock& block = s.blocks[index];
        if (!(block.qMax > 0)) continue;
        const auto bx = static_cast<float>(index % s.blocksX * kBlock);
        const auto by = static_cast<float>(index / s.blocksX * kBlock);
        const float margin =
            kBlockMargin * block.reach + kBlockRounding * s.space.axis.relativeScale(block.qMax);
        float x0 = std::numeric_limits<float>::max(), y0 = x0, x1 = -x0, y1 = -x0;
        const auto add = [&](glm::vec4 h) {
            x0 = std::min(x0, h.x / h.w);
            x1 = std::max(x1, h.x / h.w);
            y0 = std::min(y0, h.y / h.w);
            y1 = std::max(y1, h.y / h.w);
        };
        std::array<glm::vec4, 8> corners;
        float most = 0, least = std::numeric_limits<float>::max();
        for (int corner = 0; corner < 8; ++corner) {
            const float x = (corner & 1) ? bx + kBlock + 1.5f : bx - 0.5f;
            const float y = (corner & 2) ? by + kBlock + 1.5f : by - 0.5f;
            const float q = (corner & 4) ? block.qMax + margin
                                         : std::max(block.qMin - margin, 0.5f * block.qMin);
            const glm::vec4 h = corners[static_cast<std::size_t>(corner)] =
                warp.homogeneous(x, y, q);
            most = std::max(most, h.w);
            least = std::min(least, h.w);
            if (h.w > 0) add(h);
        }
        if (!(most > 0)) continue;
        const bool behind = !(least > 0);
        // Cut off what is behind, and what is next to nothing before the camera.
        const float cut = kNearestShare * most;
        for (std::size_t corner = 0; behind && corner < 8; ++corner) {
            for (const std::size_t bit : {1u, 2u, 4u}) {
                const glm::vec4 from = corners[corner], to = corners[corner ^ bit];
                if (from.w > cut && to.w < cut)
                    add(from + (to - from) * ((from.w - cut) / (from.w - to.w)));
            }
        }
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
    // A point of the scene in the middle of the tile: where the blocks that fall in it are.
    double q = 0;
    int blocks = 0;
    // Where some of a block is behind the camera, its middle may be anywhere: only without others.
    for (const double sign : {1.0, -1.0}) {
        for (const FrameSource& f : sources) {
            for (const double middle : f.middlesOf(tile)) {
                if (!(sign * middle > 0)) continue;
                q += sign * middle;
                ++blocks;
            }
        }
        if (blocks) break;
    }
    if (!blocks) return chosen;
    const glm::dvec4 h =
        space.worldFromPixel *
        glm::dvec4(tileX(tile) + kTile * 0.5, tileY(tile) + kTile * 0.5, q / blocks, 1.0);
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
    std::vector<std::pair<double, int>> ranked;
    for (int i = 0; i < count; ++i) {
        const FrameSource& f = sources[static_cast<std::size_t>(i)];
        const bool shows =
            inPicture(*f.source) && !(effort.preferShown && f.blocksOf(tile).empty());
        const double idle = shows ? 0.0 : 2.0;
        ranked.emplace_back(idle - glm::dot(look, towards(f.source->space.camera)), i);
    }
    std::nth_element(ranked.begin(), ranked.begin() + effort.mostGeometry - 1, ranked.end());
    for (int i = 0; i < effort.mostGeometry; ++i)
        chosen.push_back(ranked[static_cast<std::size_t>(i)].second);
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
    for (FrameSource& f : frame.sources) {
        std::uint32_t kept = 0, begin = 0;
        for (std::size_t t = 0; t < wanted.size(); ++t) {
            const std::uint32_t end = f.tileBegin[t + 1];
            if (wanted[t])
                for (std::uint32_t b = begin; b < end; ++b, ++kept) {
                    f.blocks[kept] = f.blocks[b];
                    f.middles[kept] = f.middles[b];
                }
            begin = end;
            f.tileBegin[t + 1] = kept;
        }
        f.blocks.resize(kept);
        f.middles.resize(kept);
    }
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
    return f;
}

}  // namespace stx::surface

#include "lib/render/splat/view.hpp"

#include <cmath>

#include "lib/base/parallel.hpp"

namespace stx::splat {
namespace {

// Steeper than 83 degrees is a discontinuity, not a surface.
constexpr float kSteepest = 8.0f, kSteepestRim = 1.0f;

std::int16_t coded(float slope) {
    return static_cast<std::int16_t>(
        std::lround(std::clamp(slope, -kSteepest, kSteepest) * kSlopeScale));
}

// Line of sight of a pixel in camera space, with z = -1 (orthographic: the axis).
glm::vec3 rayOf(const Camera& c, int x, int y) {
    if (c.orthographic) return {0, 0, -1};
    return {(x + 0.5 - c.cx) / c.fx, -(y + 0.5 - c.cy) / c.fy, -1.0};
}

// The tilt of a plane with the given normal in camera space, seen along `ray`.
glm::vec2 slopeFromNormal(glm::vec3 n, glm::vec3 ray) {
    const float towards = glm::dot(n, ray);
    // A normal that faces away says nothing of a surface that was seen.
    if (!(towards < -1e-3f * glm::length(n))) return glm::vec2(0.0f);
    return {-n.x / towards, n.y / towards};
}

glm::vec3 normalFromSlope(glm::vec2 slope, glm::vec3 ray) {
    // The tangents along u and v in camera space, per sample spacing; their product faces the
    // camera.
    const glm::vec3 alongU = glm::vec3(1, 0, 0) + slope.x * ray;
    const glm::vec3 alongV = glm::vec3(0, -1, 0) + slope.y * ray;
    return glm::normalize(glm::cross(alongV, alongU));
}

// Slope along one axis from the depths before, at and after a pixel, `scale` making it a tangent.
// A side counts when it is a point and not too steep; when only one does, that one.
float slopeFromNeighbours(float before, float at, float after, float scaleBefore,
                          float scaleAfter) {
    const float a = (at - before) * scaleBefore, b = (after - at) * scaleAfter;
    const bool hasA = std::abs(a) <= kSteepest,
               hasB = std::abs(b) <= kSteepest;  // false for inf, NaN
    if (hasA && hasB) {
        // At the rim of a smooth surface one side is a bend or a crease: trust the flatter.
        if (std::abs(a) > 3 * std::abs(b) + 0.5f) return b;
        if (std::abs(b) > 3 * std::abs(a) + 0.5f) return a;
        return 0.5f * (a + b);
    }
    return hasA ? a : hasB ? b : 0.0f;
}

glm::vec2 slopeFromDepth(const ReferenceView& v, int x, int y) {
    const auto& c = v.camera;
    const float z = v.depth.at(x, y);
    const auto depth = [&](int i, int j) {
        return v.depth.contains(i, j) ? v.depth.at(i, j) : kNoDepth;
    };
    // On a plane 1/z is linear in the picture, so the exact tangent divides by the other depth.
    const auto scale = [&](double f, float other) {
        return static_cast<float>(c.orthographic ? f : f / other);
    };
    const float l = depth(x - 1, y), r = depth(x + 1, y), t = depth(x, y - 1), b = depth(x, y + 1);
    return {slopeFromNeighbours(l, z, r, scale(c.fx, l), scale(c.fx, r)),
            slopeFromNeighbours(t, z, b, scale(c.fy, t), scale(c.fy, b))};
}

struct Surroundings {
    bool linked = true;
    bool rim = false;
};

// See Slope: how a point hangs together with its four neighbours.
Surroundings surroundings(const ReferenceView& v, int x, int y) {
    Surroundings out;
    const auto& c = v.camera;
    const float z = v.depth.at(x, y);
    out.linked = v.texture.at(x, y).a >= 1.0f;
    bool behind[4] = {};
    constexpr glm::ivec2 kSteps[4] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
    for (int k = 0; k < 4; ++k) {
        const int i = x + kSteps[k].x, j = y + kSteps[k].y;
        if (!v.depth.contains(i, j)) {
            out.linked = false;
            continue;
        }
        const float other = v.depth.at(i, j);
        const double f = k < 2 ? c.fx : c.fy;
        const float slope = (other - z) * static_cast<float>(c.orthographic ? f : f / other);
        const bool same = std::abs(slope) <= kSteepest;
        if (!same || v.texture.at(i, j).a < 1.0f) out.linked = false;
        behind[k] = !same && other > z;
    }
    // What is one pixel thin has no rim: it would break into dots.
    const bool thin = (behind[0] && behind[1]) || (behind[2] && behind[3]);
    out.rim = !thin && (behind[0] || behind[1] || behind[2] || behind[3]);
    return out;
}

bool usable(glm::vec3 v) {
    return glm::dot(v, v) > 0.0f;
}

void prepareRow(const ReferenceView& v, const glm::mat3& cameraFromWorld, int y, ViewInfo& out) {
    const int width = v.camera.width;
    const glm::mat3 worldFromCamera = glm::transpose(cameraFromWorld);
    for (int x = 0; x < width; ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * width + x;
        if (!hasPoint(v.depth.at(x, y))) continue;
        const glm::vec3 ray = rayOf(v.camera, x, y);
        glm::vec2 slope;
        const bool hasSplat =
            v.hasSplats() && usable(glm::cross(v.splatU.at(x, y), v.splatV.at(x, y)));
        if (hasSplat) {
            const glm::vec3 u = cameraFromWorld * v.splatU.at(x, y);
            const glm::vec3 w = cameraFromWorld * v.splatV.at(x, y);
            glm::vec3 n = glm::cross(u, w);
            if (glm::dot(n, ray) > 0) n = -n;
            slope = slopeFromNormal(n, ray);
            // Area of the ellipse's parallelogram against that of a lattice cell's on the same
            // plane, whose half diagonals just close the lattice: half a cell.
            const auto spacing = v.camera.sampleSpacing(v.depth.at(x, y));
            const float cell = static_cast<float>(spacing.x * spacing.y) *
                               glm::length(glm::cross(glm::vec3(1, 0, 0) + slope.x * ray,
                                                      glm::vec3(0, -1, 0) + slope.y * ray));
            const float size =
                std::sqrt(glm::length(glm::cross(u, w)) / std::max(0.5f * cell, 1e-30f));
            out.sizes[i] = static_cast<std::uint8_t>(std::clamp(size, 0.5f, 3.9f) * 64.0f);
        } else if (v.hasNormals() && usable(v.normal.at(x, y))) {
            slope = slopeFromNormal(cameraFromWorld * v.normal.at(x, y), ray);
        } else {
            slope = slopeFromDepth(v, x, y);
        }
        const Surroundings around = surroundings(v, x, y);
        // Where a surface turns away its tilt runs off to infinity; a splat that followed it would
        // stick out.
        if (around.rim && !hasSplat)
            slope = glm::clamp(slope, glm::vec2(-kSteepestRim), glm::vec2(kSteepestRim));
        const auto flagged = [](std::int16_t code, bool flag) {
            return static_cast<std::int16_t>((code & ~1) | (flag ? 1 : 0));
        };
        out.slopes[i] = {flagged(coded(slope.x), around.linked),
                         flagged(coded(slope.y), around.rim)};
        if (!out.normals.empty()) {
            const glm::vec3 n = v.hasNormals() && usable(v.normal.at(x, y))
                                    ? glm::normalize(v.normal.at(x, y))
                                    : worldFromCamera * normalFromSlope(slope, ray);
            out.normals[i] = glm::i8vec4(glm::round(glm::vec4(n, 0) * 127.0f));
        }
    }
}

std::vector<BlockInfo> blocksOfRow(const ViewInfo& info, int v0) {
    const auto& view = *info.view;
    const int width = view.camera.width, v1 = std::min(v0 + kBlock, view.camera.height);
    std::vector<BlockInfo> out;
    for (int u0 = 0; u0 < width; u0 += kBlock) {
        BlockInfo b;
        b.u0 = static_cast<std::uint16_t>(u0);
        b.v0 = static_cast<std::uint16_t>(v0);
        b.u1 = static_cast<std::uint16_t>(std::min(u0 + kBlock, width));
        b.v1 = static_cast<std::uint16_t>(v1);
        b.zMin = kNoDepth;
        b.slopeMin = {32767, 32767};
        b.slopeMax = {-32768, -32768};
        b.size = info.sizes.empty() ? 1.0f : 0.0f;
        for (int y = v0; y < v1; ++y) {
            for (int x = u0; x < b.u1; ++x) {
                const float z = view.depth.at(x, y);
                if (!hasPoint(z)) continue;
                const float alpha = view.texture.at(x, y).a;
                if (!(alpha > 0)) continue;
                const std::size_t i = static_cast<std::size_t>(y) * width + x;
                b.zMin = std::min(b.zMin, z);
                b.zMax = std::max(b.zMax, z);
                const Slope s = info.slopes[i];
                b.slopeMin = {std::min(b.slopeMin.u, s.u), std::min(b.slopeMin.v, s.v)};
                b.slopeMax = {std::max(b.slopeMax.u, s.u), std::max(b.slopeMax.v, s.v)};
                if (!info.sizes.empty()) b.size = std::max(b.size, info.sizes[i] / 64.0f);
                b.opaque = b.opaque && alpha >= 1.0f;
                b.linked = b.linked && (s.u & Slope::kLinked);
            }
        }
        // Points of alpha 0 still have to be told apart from the others.
        for (int y = v0; y < v1 && b.opaque; ++y)
            for (int x = u0; x < b.u1; ++x)
                if (hasPoint(view.depth.at(x, y)) && !(view.texture.at(x, y).a > 0))
                    b.opaque = false;
        if (b.zMin < kNoDepth) out.push_back(b);
    }
    return out;
}

}  // namespace

std::vector<ViewInfo> prepareViews(const Bundle& bundle, bool wantNormals) {
    std::vector<ViewInfo> out(bundle.views.size());
    std::uint32_t firstPoint = 0;
    for (std::size_t k = 0; k < out.size(); ++k) {
        const auto& v = bundle.views[k];
        ViewInfo& info = out[k];
        info.view = &v;
        info.firstPoint = firstPoint;
        firstPoint += static_cast<std::uint32_t>(v.depth.count());
        info.slopes.resize(v.depth.count());
        if (wantNormals) info.normals.resize(v.depth.count());
        if (v.hasSplats()) info.sizes.assign(v.depth.count(), 64);
        const glm::mat3 cameraFromWorld(glm::mat3_cast(glm::conjugate(v.camera.orientation)));
        parallelForBlocks(0, v.camera.height, 16, [&](std::int64_t from, std::int64_t to) {
            for (auto y = from; y < to; ++y)
                prepareRow(v, cameraFromWorld, static_cast<int>(y), info);
        });
        const int rows = (v.camera.height + kBlock - 1) / kBlock;
        std::vector<std::vector<BlockInfo>> perRow(rows);
        parallelFor(0, rows, [&](std::int64_t r) {
            perRow[r] = blocksOfRow(info, static_cast<int>(r) * kBlock);
        });
        for (auto& r : perRow) info.blocks.insert(info.blocks.end(), r.begin(), r.end());
    }
    return out;
}

}  // namespace stx::splat

#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "lib/base/image.hpp"
#include "lib/geometry/camera.hpp"
#include "lib/model/reference_view.hpp"
#include "lib/render/surface/constants.hpp"

namespace stx::surface {

/// The depth coordinate q in which planes are affine over the image, larger = nearer, 0 = no point.
/// Perspective: q = 1 / dist. Orthographic: q = (origin - dist) / unit, at least 1 on the scene.
struct DepthAxis {
    bool inverse = true;
    double origin = 0.0;  ///< scene units, orthographic only
    double unit = 1.0;    ///< scene units, orthographic only

    [[nodiscard]] double q(double dist) const {
        return inverse ? 1.0 / dist : (origin - dist) / unit;
    }
    [[nodiscard]] double dist(double q) const { return inverse ? 1.0 / q : origin - unit * q; }
    /// What a relative depth difference of 1 is in q: q itself, or 1 when orthographic.
    [[nodiscard]] float whole(float q) const { return inverse ? q : 1.0f; }
    /// How much q changes over one scene unit of distance.
    [[nodiscard]] float perUnit(float q) const {
        return inverse ? q * q : static_cast<float>(1.0 / unit);
    }
};

/// A projective map of (x, y, q, 1): rows x, y, q and the denominator, which is positive in front.
struct Warp {
    std::array<float, 16> m{};

    [[nodiscard]] glm::vec4 homogeneous(float x, float y, float q) const {
        return {m[0] * x + m[1] * y + m[2] * q + m[3], m[4] * x + m[5] * y + m[6] * q + m[7],
                m[8] * x + m[9] * y + m[10] * q + m[11], m[12] * x + m[13] * y + m[14] * q + m[15]};
    }
};

/// A camera with its depth axis, ready to be mapped into another one.
struct PixelSpace {
    Camera camera;
    DepthAxis axis;
    glm::dmat4 pixelFromWorld{1.0};  ///< (x, y, q, 1) up to scale from a world point
    glm::dmat4 worldFromPixel{1.0};

    PixelSpace() = default;
    /// `farthest`: an upper bound of the distances that the scene has from this camera.
    PixelSpace(const Camera& camera, double farthest);
};

[[nodiscard]] Warp warpFrom(const glm::dmat4& m);

/// Side of the blocks that sources are prepared in, pixels.
inline constexpr int kBlock = 16;
/// Edge distances are counted up to this.
inline constexpr int kFarFromEdge = 4;

/// A square of (size+1)² pixels that lie on one plane: q = q0 + qx * (column - x) + qy * (row - y).
struct Leaf {
    std::uint16_t x, y, size;
    float q0, qx, qy;
};

/// What one 16x16 block of a source holds.
struct SourceBlock {
    float qMin = 0, qMax = 0;  ///< over the block and one pixel around; 0, 0 = nothing here
    std::uint32_t leafBegin = 0, leafEnd = 0;
    std::array<std::uint16_t, kBlock> cells{};  ///< 2x2 quads, by upper left pixel, in no leaf
    std::array<std::uint16_t, kBlock> edges{};  ///< pixels that lay out an extension
    bool anyCell = false, anyEdge = false;
};

/// One reference view prepared for warping: links between neighbours, edges, planar pieces.
/// Refers to the view, which must outlive it.
struct Source {
    const ReferenceView* view = nullptr;
    PixelSpace space;
    int width = 0, height = 0;
    bool hasAlpha = false;  ///< some pixel is not fully covered
    float freeAlpha = kFreeAlpha;
    float step = 0;     ///< scene units between neighbouring depth codes
    double told = 1.0;  ///< share of the pixels of the object (points, or full alpha) with depth
    float noise = 0;    ///< how far, as a share of q, pixels stray from their neighbours
    float flat = 0;     ///< share of q by which pixels may leave the plane of a piece
    /// 0 = nothing here; below 0 = pruned: the object is here, other sources tell its distance.
    Image<float> q;

    static constexpr std::uint8_t kLinkRight = 1, kLinkDown = 2, kBesideBackground = 4;
    Image<std::uint8_t> info;  ///< the links, and the distance to the nearest edge << 4

    int blocksX = 0, blocksY = 0;
    std::vector<SourceBlock> blocks;
    std::vector<Leaf> leaves;

    [[nodiscard]] int edgeDistance(int x, int y) const { return info.at(x, y) >> 4; }
    [[nodiscard]] bool linkRight(int x, int y) const { return info.at(x, y) & kLinkRight; }
    [[nodiscard]] bool linkDown(int x, int y) const { return info.at(x, y) & kLinkDown; }
    [[nodiscard]] bool pruned(int x, int y) const { return q.at(x, y) < 0.0f; }
    /// Alpha 0..1 of a pixel.
    [[nodiscard]] float alpha(int x, int y) const {
        if (const auto* i = view->texture.rgba8()) return i->at(x, y).a * (1.0f / 255.0f);
        return view->texture.rgbaFloat()->at(x, y).a;
    }
    /// dq/dx and dq/dy on the surface of a pixel, from its linked neighbours.
    [[nodiscard]] glm::vec2 gradient(int x, int y) const;
};

[[nodiscard]] Source prepareSource(const ReferenceView& view);

/// Share of the image border where the view has points or full alpha: near 1 in scenes that fill
/// the frame.
[[nodiscard]] double borderCoverage(const Source& source);

}  // namespace stx::surface

#include "lib/render/splat/plan.hpp"

#include <cmath>
#include <limits>

#include "lib/render/splat/constants.hpp"
#include "lib/render/splat/others.hpp"

namespace stx::splat {
namespace {

// Where no source is named the value was chosen by trial on the project's image sets and meshes.

// Depth behind the front that still belongs to it (Lee & Park blend all; 1 to 3 % is known to be
// good), a share of the ShareLength: for blocks whose tilt is known, and for others.
constexpr double kTolerance = 0.01, kToleranceRough = 0.02;
// But no less of the distance than what rounding may tell apart: some steps of floats.
constexpr double kLeastTolerance = 1e-6;
// A block is smooth, and one tilt serves for all of it, when its tilts (tangents) spread less than
// this and its farthest point is nearer than this many times the distance of the nearest.
constexpr float kSmoothSlopes = 0.35f, kSmoothDepths = 1.2f;
// The corners of a block differ a little from its middle, and so do the squared sizes of splats.
constexpr double kCornerRoom = 1.08;
// No splat's core is smaller, squared pixels: half the diagonal of a pixel.
constexpr double kLeastCore2 = 0.5;
// A block whose depths spread further reaches behind the camera: nearest over farthest.
constexpr double kCrossing = 1e-6;
// A plane seen this nearly edge-on (area over squared length of a cell) gives no slope.
constexpr double kEdgeOn = 1e-3;
// Splats of a block reach this many pixels beyond its points: those of 2x2 pixels, and large ones,
// in parts of the radius that closes the lattice. A large splat ends at sqrt(kReach2) *
// kSigmaSource = 1.12 sample spacings, 1.6 such radii; the rest is room for the filter and for
// rounding.
constexpr double kReachSmall = 1.0, kReachPixels = 2.0, kReachRadii = 2.4;

// How the picture of a source pixel's cell is spanned.
struct Cell {
    glm::dvec2 u, v;        // pixels per source pixel
    double zu = 0, zv = 0;  // relative change of novel depth per source pixel

    [[nodiscard]] double det() const { return u.x * v.y - u.y * v.x; }
    // Squared distance from a lattice point that closes the lattice: half the longer diagonal.
    [[nodiscard]] double cover2() const {
        const glm::dvec2 a = u + v, b = u - v;
        return 0.25 * std::max(glm::dot(a, a), glm::dot(b, b));
    }
};

Cell cellAt(const RectangleImages& s, double u, double v, double z, double slopeU, double slopeV,
            bool orthographic) {
    const PixelMap& m = s.map;
    const glm::dvec3 a = m.a0 + m.au * u + m.av * v;
    const glm::dvec3 h = a * z + m.b0 + m.bu * u + m.bv * v;
    const double spacing = s.orthographic ? 1.0 : z;
    const glm::dvec3 hu = m.au * z + m.bu + a * (slopeU * spacing / s.fx);
    const glm::dvec3 hv = m.av * z + m.bv + a * (slopeV * spacing / s.fy);
    Cell c;
    const double w = 1.0 / h.z;
    if (orthographic) {
        c.u = {hu.x, hu.y};
        c.v = {hv.x, hv.y};
    } else {
        const double x = h.x * w, y = h.y * w;
        c.u = {(hu.x - x * hu.z) * w, (hu.y - y * hu.z) * w};
        c.v = {(hv.x - x * hv.z) * w, (hv.y - y * hv.z) * w};
    }
    c.zu = hu.z * w;
    c.zv = hv.z * w;
    return c;
}

// Where the corners of a block are in the picture, and how far. All in front of the camera, they
// bound the block.
struct Corners {
    double x0 = 1e300, y0 = 1e300, x1 = -1e300, y1 = -1e300;
    double zMin = 1e300, zMax = -1e300;
};

Corners cornersOf(const BlockInfo& block, const PixelMap& m, bool orthographic) {
    Corners all;
    for (int corner = 0; corner < 4; ++corner) {
        const double u = (corner & 1) ? block.u1 - 1 : block.u0,
                     v = (corner & 2) ? block.v1 - 1 : block.v0;
        const glm::dvec3 a = m.a0 + m.au * u + m.av * v, b = m.b0 + m.bu * u + m.bv * v;
        for (const float z : {block.zMin, block.zMax}) {
            const glm::dvec3 h = a * double(z) + b;
            all.zMin = std::min(all.zMin, h.z);
            all.zMax = std::max(all.zMax, h.z);
            const double w = orthographic ? 1.0 : 1.0 / h.z;
            all.x0 = std::min(all.x0, h.x * w);
            all.x1 = std::max(all.x1, h.x * w);
            all.y0 = std::min(all.y0, h.y * w);
            all.y1 = std::max(all.y1, h.y * w);
        }
    }
    return all;
}

// The cells of a block: its middle one where the surface is smooth, else the corners of what
// occurs.
struct Cells {
    Cell middle;
    bool smooth = false;
    double cover2 = 0, det = -1e300, stretch2 = 0;  // the largest
};

Cells cellsOf(const BlockInfo& block, const RectangleImages& s, glm::dvec2 centre, bool crossing,
              bool orthographic) {
    const float unit = 1.0f / kSlopeScale;
    const float su0 = block.slopeMin.u * unit, su1 = block.slopeMax.u * unit;
    const float sv0 = block.slopeMin.v * unit, sv1 = block.slopeMax.v * unit;
    const auto at = [&](double z, double su, double sv) {
        return cellAt(s, centre.x, centre.y, z, su, sv, orthographic);
    };
    Cells all;
    all.smooth = su1 - su0 < kSmoothSlopes && sv1 - sv0 < kSmoothSlopes &&
                 block.zMax < kSmoothDepths * block.zMin;
    all.middle = at(0.5 * (block.zMin + block.zMax), 0.5 * (su0 + su1), 0.5 * (sv0 + sv1));
    if (crossing) {
        all.cover2 = 1e300;
        all.det = 1;
        all.stretch2 = 1;
        return all;
    }
    const auto consider = [&](const Cell& c) {
        all.cover2 = std::max(all.cover2, c.cover2());
        all.det = std::max(all.det, c.det());
        all.stretch2 = std::max({all.stretch2, glm::dot(c.u, c.u), glm::dot(c.v, c.v)});
    };
    for (int corner = 0; corner < 4; ++corner) {
        const double su = (corner & 1) ? su1 : su0, sv = (corner & 2) ? sv1 : sv0;
        // Smooth blocks need only half of the eight combinations.
        const bool first = corner == 0 || corner == 3;
        if (first || !all.smooth) consider(at(block.zMin, su, sv));
        if (!first || !all.smooth) consider(at(block.zMax, su, sv));
    }
    all.cover2 *= kCornerRoom;
    return all;
}

// As a share of the distance, which right before an orthographic eye would have no end.
float toleranceOf(bool smooth, double farthest, const ShareLength& shares) {
    const double shared = shares.at(farthest);
    const double share = shared / std::max(farthest, kCrossing * shared);
    return static_cast<float>(
        std::max(kLeastTolerance, (smooth ? kTolerance : kToleranceRough) * share));
}

// The plane and the gradient of uniform splats, from the middle cell.
void setSlopes(const Cells& cells, BlockTask& task) {
    task.slopeX = task.slopeY = 0;
    task.uAcross = task.vAcross = task.uDown = task.vDown = 0;
    const Cell& middle = cells.middle;
    const double d = middle.det();
    if (!cells.smooth || !(d > kEdgeOn * cells.stretch2)) return;
    constexpr double steepest = kSteepestPlane;
    task.slopeX = static_cast<float>(
        std::clamp((middle.zu * middle.v.y - middle.zv * middle.u.y) / d, -steepest, steepest));
    task.slopeY = static_cast<float>(
        std::clamp((middle.zv * middle.u.x - middle.zu * middle.v.x) / d, -steepest, steepest));
    const double half = 0.5 * kGradient * std::clamp(d / kFadeTo - 1.0, 0.0, 1.0) / d;
    task.uAcross = static_cast<float>(middle.v.y * half);
    task.uDown = static_cast<float>(-middle.v.x * half);
    task.vAcross = static_cast<float>(-middle.u.y * half);
    task.vDown = static_cast<float>(middle.u.x * half);
}

// The pixels that splats of the block may touch; false: none is in the picture.
bool setReach(const Corners& corners, bool crossing, double cover2, const Camera& novel,
              BlockTask& task) {
    const double reach = task.small ? kReachSmall : kReachPixels + kReachRadii * std::sqrt(cover2);
    task.reach = static_cast<float>(std::min(reach, 1e30));
    if (crossing) {
        task.x0 = task.y0 = 0;
        task.x1 = novel.width - 1;
        task.y1 = novel.height - 1;
        return true;
    }
    const double x0 = corners.x0 - reach, y0 = corners.y0 - reach;
    const double x1 = corners.x1 + reach, y1 = corners.y1 + reach;
    if (!(x1 >= 0 && y1 >= 0 && x0 <= novel.width - 1 && y0 <= novel.height - 1)) return false;
    task.x0 = static_cast<int>(std::max(0.0, std::floor(x0)));
    task.y0 = static_cast<int>(std::max(0.0, std::floor(y0)));
    task.x1 = static_cast<int>(std::min(novel.width - 1.0, std::ceil(x1)));
    task.y1 = static_cast<int>(std::min(novel.height - 1.0, std::ceil(y1)));
    return true;
}

}  // namespace

bool planBlock(const PreparedRectangle& rectangle, const BlockInfo& block, const RectangleImages& s,
               const Camera& novel, const ShareLength& shares, bool cullBackFaces,
               BlockTask& task) {
    task.u0 = block.u0;
    task.v0 = block.v0;
    task.u1 = block.u1;
    task.v1 = block.v1;
    task.opaque = block.opaque;
    task.glass = block.glass;
    const Corners corners = cornersOf(block, s.map, novel.orthographic);
    if (!(corners.zMax > 0)) return false;
    const bool crossing = !(corners.zMin > kCrossing * corners.zMax);
    task.zMin = crossing ? 0.0f : static_cast<float>(corners.zMin);

    const double uc = 0.5 * (block.u0 + block.u1 - 1), vc = 0.5 * (block.v0 + block.v1 - 1);
    const Cells cells = cellsOf(block, s, {uc, vc}, crossing, novel.orthographic);
    if (cullBackFaces && !(cells.det > 0)) return false;
    const double cover2 = cells.cover2 * (block.size * block.size);
    task.small = cover2 < kSmallCover2;
    task.uniform = task.small && cells.smooth && block.linked;
    task.core2 = static_cast<float>(std::max(kLeastCore2, kCornerRoom * cover2));

    task.tolerance = toleranceOf(cells.smooth, corners.zMax, shares);
    setSlopes(cells, task);

    // Views that saw the surface close (dense samples) and head-on count more, and those that saw
    // it from about the same place, since looks change with the angle.
    const double density = 1.0 / std::max(1.0, cells.stretch2);
    task.density = std::max(static_cast<float>(density * density), kLeastDensity);
    const auto& c = rectangle.camera();
    const glm::dvec3 point =
        c.position +
        c.orientation * c.unproject(uc + 0.5, vc + 0.5, 0.5 * (block.zMin + block.zMax));
    const auto directionFrom = [&](const Camera& camera) {
        return camera.orthographic ? camera.forward() : glm::normalize(point - camera.position);
    };
    task.quality = static_cast<float>(qualityOf(glm::dot(directionFrom(c), directionFrom(novel))));
    task.quarters = cullBackFaces ? neededQuarters(rectangle, block, novel, task.quality) : 15;
    if (task.quarters == 0) return false;

    // The plane of a splat comes nearer than its point: by its slope over a pixel either way if
    // small, else down to half (see the kernels). A little less for rounding.
    const float least = task.uniform ? 1.0f - std::abs(task.slopeX) - std::abs(task.slopeY)
                        : task.small ? 1.0f - 2 * kSteepestPlane
                                     : 0.5f;
    task.nearest = 0.999f * least * task.zMin / (1.0f + task.tolerance);

    return setReach(corners, crossing, cover2, novel, task);
}

float largestSplat(const Camera& novel) {
    if (novel.orthographic) return std::numeric_limits<float>::max();
    return std::max(kLargest,
                    kLargestShare * static_cast<float>(std::max(novel.width, novel.height)));
}

}  // namespace stx::splat

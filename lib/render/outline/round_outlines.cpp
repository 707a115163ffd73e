#include "lib/render/outline/round_outlines.hpp"

#include <algorithm>
#include <cmath>

#include "lib/base/parallel.hpp"

namespace stx {
namespace {

// Where no source is named the value was chosen by trial on the project's image sets and meshes.

/// Depth is compared so far inside the outline; pixels.
constexpr float kNear = 1.5f, kFar = 3.5f;
/// A surface turns away that is deeper by so many pixels' sizes per pixel towards the outline.
constexpr float kTurnedAway = 0.7f;
/// Pixels with less are covered in part.
constexpr float kWhole = 0.999f;
/// Views draw such surfaces too large. What they draw smaller than that by more than this is
/// something thin, beside which points of other parts lie.
constexpr float kSmaller = 0.2f;

bool turnsAway(const Image<float>& depth, const Camera& camera, int x, int y) {
    const glm::vec2 out = outwardAt(depth, x, y);
    if (out == glm::vec2(0.0f)) return false;
    const auto inside = [&](float by) {
        const int a = static_cast<int>(std::lround(static_cast<float>(x) - by * out.x));
        const int b = static_cast<int>(std::lround(static_cast<float>(y) - by * out.y));
        return depth.contains(a, b) ? depth.at(a, b) : kNoDepth;
    };
    const float near = inside(kNear), far = inside(kFar);
    if (!hasPoint(near) || !hasPoint(far)) return false;
    const auto pixel = camera.sampleSpacing(near);
    return near - far > kTurnedAway * (kFar - kNear) * std::max(pixel.x, pixel.y);
}

}  // namespace

void setCoverage(Frame& frame, int x, int y, float share) {
    const auto scaled = [share](glm::vec4 c) { return c.w > 0.0f ? c * (share / c.w) : c; };
    frame.colour.at(x, y) = scaled(frame.colour.at(x, y));
    if (!frame.albedo.empty()) frame.albedo.at(x, y) = scaled(frame.albedo.at(x, y));
    if (share > 0.0f) return;
    frame.depth.at(x, y) = kNoDepth;
    if (!frame.normal.empty()) frame.normal.at(x, y) = glm::vec3(0.0f);
}

void cutRoundOutlines(Outlines& outlines, const Camera& camera, Frame& frame) {
    const int w = frame.depth.width(), h = frame.depth.height();
    constexpr int kRows = 16;
    Image<float> covered(w, h, -1.0f);
    parallelFor(0, h, kRows, [&](int y) {
        const auto colour = frame.colour.row(y);
        for (int x = 0; x < w; ++x)
            if (colour[x].w > 0.0f && colour[x].w < kWhole && hasPoint(frame.depth.at(x, y)) &&
                turnsAway(frame.depth, camera, x, y))
                covered.at(x, y) = Outlines::kAsked;
    });
    outlines.measure(frame, camera, covered);
    parallelFor(0, h, kRows, [&](int y) {
        forWhere(
            covered.row(y), [](float c) { return c >= 0.0f; },
            [&](int x) {
                const float share = covered.at(x, y);
                if (share - frame.colour.at(x, y).w <= kSmaller) setCoverage(frame, x, y, share);
            });
    });
}

}  // namespace stx

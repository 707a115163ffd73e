#include "lib/background/frame_warp.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lib/background/mixed_pixels.hpp"
#include "lib/base/parallel.hpp"
#include "lib/geometry/catmull_rom.hpp"

namespace stx::temporal {
namespace {

/// Inverse distances of neighbours that differ by less than this share are of one surface.
constexpr float kSurface = 0.03f;
/// A frame looks through a place only when all its pixels within this reach are farther than the
/// place (pixels): where poses are not exact, edges of still things are off by one.
constexpr int kClear = 2;
/// Alpha of a pixel that its surface covers in full, in 0..255.
constexpr float kFullAlpha = 254.5f;

WarpFrame startFrame(const ReferenceView& view, const Camera& camera) {
    WarpFrame frame;
    frame.camera = camera;
    frame.inverse = inverseOf(view.depth);
    frame.step = static_cast<float>(view.depthBits == 32 ? 0.0 : view.depthCode().step());
    return frame;
}

}  // namespace

WarpFrame warpFrame(const ReferenceView& view, const Camera& camera, const DepthNoise& noise) {
    WarpFrame frame = startFrame(view, camera);
    const int w = camera.width, h = camera.height;
    frame.mixed = mixedPixels(frame.inverse, noise, frame.step, 0, h);
    frame.colour = Image<glm::vec3>(w, h);
    parallelForBlocks(0, h, 16, [&](std::int64_t from, std::int64_t to) {
        for (std::size_t i = static_cast<std::size_t>(from) * static_cast<std::size_t>(w);
             i < static_cast<std::size_t>(to) * static_cast<std::size_t>(w); ++i) {
            frame.colour.data()[i] = stepsOf(view.texture, i);
            if (255 * view.texture.at(i).a < kFullAlpha) frame.mixed.data()[i] = 1;
        }
    });
    return frame;
}

WarpFrame carveFrame(const ReferenceView& view, const Camera& camera, bool emptyIsFar) {
    WarpFrame frame = startFrame(view, camera);
    const int w = camera.width, h = camera.height;
    constexpr float kUnknown = std::numeric_limits<float>::infinity();
    Image<float> known = frame.inverse, across(w, h);
    for (std::size_t i = 0; i < known.count(); ++i)
        if (known.data()[i] == 0 && !(emptyIsFar && view.texture.at(i).a == 0))
            known.data()[i] = kUnknown;
    frame.nearest = Image<float>(w, h);
    parallelFor(0, h, 16, [&](int y) {
        const float* in = known.row(y).data();
        float* out = across.row(y).data();
        for (int x = 0; x < w; ++x) {
            float most = 0;
            for (int k = std::max(x - kClear, 0); k <= std::min(x + kClear, w - 1); ++k)
                most = std::max(most, in[k]);
            out[x] = most;
        }
    });
    parallelFor(0, h, 16, [&](int y) {
        float* out = frame.nearest.row(y).data();
        for (int k = std::max(y - kClear, 0); k <= std::min(y + kClear, h - 1); ++k) {
            const float* in = across.row(k).data();
            for (int x = 0; x < w; ++x) out[x] = std::max(out[x], in[x]);
        }
    });
    return frame;
}

CameraPair::CameraPair(const Camera& from, const Camera& to)
    : turn_(glm::mat3_cast(glm::conjugate(to.orientation) * from.orientation)),
      shift_(glm::conjugate(to.orientation) * (from.position - to.position)),
      fromCentre_(from.cx, from.cy),
      fromUnit_(1 / from.fx, 1 / from.fy),
      toCentre_(to.cx, to.cy),
      toFocal_(to.fx, to.fy) {}

Spot spotAt(const WarpFrame& frame, float x, float y) {
    const Image<float>& inverse = frame.inverse;
    const int w = inverse.width(), h = inverse.height();
    if (!(x >= 0 && y >= 0 && x < static_cast<float>(w) && y < static_cast<float>(h))) return {};
    Spot spot;
    spot.x = static_cast<int>(x);
    spot.y = static_cast<int>(y);
    spot.inverse = inverse.at(spot.x, spot.y);
    const float left = std::floor(x - 0.5f), top = std::floor(y - 0.5f);
    const int ix = static_cast<int>(left), iy = static_cast<int>(top);
    if (ix < 0 || iy < 0 || ix + 1 >= w || iy + 1 >= h) return spot;
    const float* r = &inverse.at(ix, iy);
    const float a = r[0], b = r[1], c = r[w], d = r[w + 1];
    const float least = std::min(std::min(a, b), std::min(c, d));
    const float most = std::max(std::max(a, b), std::max(c, d));
    if (!(least > 0) || most - least > kSurface * most) return spot;
    const float u = x - 0.5f - left, v = y - 0.5f - top;
    const float upper = a + (b - a) * u, lower = c + (d - c) * u;
    spot.inverse = upper + (lower - upper) * v;
    spot.whole = true;
    return spot;
}

glm::vec3 colourAt(const WarpFrame& frame, const Spot& spot, float x, float y) {
    const Image<glm::vec3>& colour = frame.colour;
    if (!spot.whole) return colour.at(spot.x, spot.y);
    const int w = colour.width();
    const float left = std::floor(x - 0.5f), top = std::floor(y - 0.5f);
    const int ix = static_cast<int>(left), iy = static_cast<int>(top);
    const float u = x - 0.5f - left, v = y - 0.5f - top;
    const bool wide = ix >= 1 && iy >= 1 && ix + 2 < w && iy + 2 < colour.height() &&
                      frame.mixed.at(spot.x, spot.y) == 0;
    if (!wide) {
        const glm::vec3* r = &colour.at(ix, iy);
        const glm::vec3 upper = glm::mix(r[0], r[1], u), lower = glm::mix(r[w], r[w + 1], u);
        return glm::mix(upper, lower, v);
    }
    const auto across = catmullRomWeights(u), down = catmullRomWeights(v);
    glm::vec3 sum(0.0f), least(1e30f), most(-1e30f);
    for (int j = 0; j < 4; ++j) {
        const glm::vec3* r = &colour.at(ix - 1, iy - 1 + j);
        sum +=
            down[j] * (across[0] * r[0] + across[1] * r[1] + across[2] * r[2] + across[3] * r[3]);
        least = glm::min(glm::min(least, glm::min(r[0], r[1])), glm::min(r[2], r[3]));
        most = glm::max(glm::max(most, glm::max(r[0], r[1])), glm::max(r[2], r[3]));
    }
    // No darker and no lighter than what is there.
    return glm::clamp(sum, least, most);
}

}  // namespace stx::temporal

#include "lib/refine/colours.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "lib/base/parallel.hpp"

namespace stx {
namespace {

// Chosen by trial on the sets of tests/bench/pictures.md with noise added.

/// Rounds: in the second one points are nearer to where they belong.
constexpr int kColourRounds = 2;
/// The views that each view is compared with.
constexpr std::size_t kColourPartners = 8;
/// Points are moved together with those around them, within so many pixels that are on one surface
/// within so many standard deviations.
constexpr int kWindow = 1;
constexpr float kWindowBand = 4.0f;
/// Colours of one point differ by this much in two views (0..1); differences beyond the second
/// count less.
constexpr float kColourNoise = 0.04f, kColourBand = 0.06f;
/// Another view shows the surface of a point within so many standard deviations.
constexpr float kShownBand = 4.0f;
/// No point moves farther than so many standard deviations at once.
constexpr float kFarthestMove = 1.0f;

/// How light the pixels of a view are, 0..1; below 0 where something else shows through.
Image<float> lightnessOf(const NoisyView& view) {
    Image<float> out(view.q->width(), view.q->height());
    parallelFor(0, out.height(), 32, [&](int y) {
        for (int x = 0; x < out.width(); ++x) {
            const glm::vec4 c = view.texture->at(x, y);
            out.at(x, y) = c.a >= 1.0f ? 0.25f * (c.r + 2 * c.g + c.b) : -1.0f;
        }
    });
    return out;
}

struct Beside {
    const NoisyView* view;
    const Image<float>* lightness;
    Warp warp;  ///< from the pixels of the view that is moved
};

/// What the points of a view say of how far they are to move, in shares of q: the slope and the
/// curvature of the squared difference of colours.
struct Pull {
    float slope = 0, curvature = 0;
};

Pull pullOf(const Beside& other, float x, float y, float q, float scale, float light, float doubt) {
    const ShownSurface s = surfaceShownBy(*other.view, other.warp, x, y, q);
    // The distance, beside the surface that the other view shows, by which a point is off whose
    // depth is off by its doubt.
    const float own = s.rate * doubt;
    if (!s.found || !(s.rate > 0.0f) ||
        s.off * s.off > kShownBand * kShownBand * (own * own + s.doubt * s.doubt))
        return {};
    const Image<float>& image = *other.lightness;
    const float fu = std::floor(s.u - 0.5f), fv = std::floor(s.v - 0.5f);
    if (!(fu >= 0.0f && fv >= 0.0f && fu + 1 < static_cast<float>(image.width()) &&
          fv + 1 < static_cast<float>(image.height())))
        return {};
    const int px = static_cast<int>(fu), py = static_cast<int>(fv);
    const float tx = s.u - 0.5f - fu, ty = s.v - 0.5f - fv;
    const float a = image.at(px, py), b = image.at(px + 1, py), c = image.at(px, py + 1),
                d = image.at(px + 1, py + 1);
    if (a < 0.0f || b < 0.0f || c < 0.0f || d < 0.0f) return {};
    const auto& m = other.warp.m;
    const float du = (m[2] - s.u * m[14]) * s.inverse * scale,
                dv = (m[6] - s.v * m[14]) * s.inverse * scale;
    const float gx = (b - a) * (1 - ty) + (d - c) * ty, gy = (c - a) * (1 - tx) + (d - b) * tx;
    const float g = gx * du + gy * dv;
    const float r = ((a * (1 - tx) + b * tx) * (1 - ty) + (c * (1 - tx) + d * tx) * ty) - light;
    const float e = r * (1.0f / kColourBand);
    const float weight = 1.0f / (1.0f + e * e);
    return {weight * g * r, weight * g * g};
}

Image<float> matched(std::span<const NoisyView> views, std::span<const Image<float>> lightness,
                     std::size_t number, PixelSpool* spool) {
    const NoisyView& view = views[number];
    const DepthAxis& axis = view.space->axis;
    std::vector<Beside> others;
    for (const std::size_t i : nearViews(views, number, kColourPartners))
        others.push_back({&views[i], &lightness[i],
                          warpFrom(views[i].space->pixelFromWorld * view.space->worldFromPixel)});
    Image<float> out = *view.q;
    Image<Pull> pulls(out.width(), out.height());
    forRows(out, spool, [&](int y) {
        for (int x = 0; x < out.width(); ++x) {
            const float q = view.q->at(x, y), doubt = view.surface.at(x, y).z;
            const float light = lightness[number].at(x, y);
            if (!(q > 0.0f) || !(doubt > 0.0f) || light < 0.0f) continue;
            Pull sum;
            for (const Beside& other : others) {
                const Pull pull =
                    pullOf(other, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, q,
                           axis.relativeScale(q), light, doubt);
                sum.slope += pull.slope;
                sum.curvature += pull.curvature;
            }
            pulls.at(x, y) = sum;
        }
    });
    parallelFor(0, out.height(), 16, [&](int y) {
        for (int x = 0; x < out.width(); ++x) {
            const float q = view.q->at(x, y), own = view.surface.at(x, y).z;
            if (!(q > 0.0f) || !(own > 0.0f)) continue;
            const glm::vec3 plane = view.surface.at(x, y);
            Pull sum;
            for (int v = std::max(y - kWindow, 0); v <= std::min(y + kWindow, out.height() - 1);
                 ++v) {
                for (int u = std::max(x - kWindow, 0); u <= std::min(x + kWindow, out.width() - 1);
                     ++u) {
                    const float there = view.q->at(u, v);
                    if (!(there > 0.0f)) continue;
                    const float off = there - q - plane.x * static_cast<float>(u - x) -
                                      plane.y * static_cast<float>(v - y);
                    if (std::abs(off) > kWindowBand * own) continue;
                    sum.slope += pulls.at(u, v).slope;
                    sum.curvature += pulls.at(u, v).curvature;
                }
            }
            const float scale = axis.relativeScale(q), doubt = own / scale;
            // The depth that was measured is as likely as its doubt says.
            const float prior = kColourNoise * kColourNoise / (doubt * doubt);
            const float move = -sum.slope / (sum.curvature + prior);
            const float most = kFarthestMove * doubt;
            const float value = q + scale * std::clamp(move, -most, most);
            if (value > 0.0f) out.at(x, y) = value;
        }
    });
    return out;
}

}  // namespace

void agreeOnColours(std::span<const NoisyView> views, PixelSpool* spool) {
    if (views.size() < 2) return;
    std::vector<Image<float>> lightness;
    for (const NoisyView& view : views) {
        lightness.push_back(lightnessOf(view));
        lightness.back().moveTo(spool);
    }
    for (int round = 0; round < kColourRounds; ++round) {
        std::vector<Image<float>> results;
        for (std::size_t i = 0; i < views.size(); ++i) {
            results.push_back(matched(views, lightness, i, spool));
            results.back().moveTo(spool);
        }
        for (std::size_t i = 0; i < views.size(); ++i) *views[i].q = std::move(results[i]);
    }
}

}  // namespace stx

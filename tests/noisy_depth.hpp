#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <numbers>
#include <string>

#include "lib/model/bundle.hpp"

/// Depth as sensors and stereo give it, and colours as cameras do, made from exact ones. The same
/// on every machine.
namespace noisy {

/// 0..1, above 0, of a pixel of a view.
inline double uniform(std::uint64_t view, std::uint64_t pixel, std::uint64_t what) {
    std::uint64_t h = (view << 40) ^ (pixel << 3) ^ what;
    for (int round = 0; round < 2; ++round) {  // splitmix64
        h += 0x9e3779b97f4a7c15u;
        h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9u;
        h = (h ^ (h >> 27)) * 0x94d049bb133111ebu;
        h ^= h >> 31;
    }
    return (static_cast<double>(h >> 11) + 0.5) / 9007199254740992.0;
}

inline double normal(std::uint64_t view, std::uint64_t pixel) {
    return std::sqrt(-2 * std::log(uniform(view, pixel, 0))) *
           std::cos(2 * std::numbers::pi * uniform(view, pixel, 1));
}

/// Every distance times 1 plus normal noise of this standard deviation.
inline void addNoise(stx::Bundle& bundle, double share) {
    for (std::size_t i = 0; i < bundle.views.size(); ++i) {
        auto& view = bundle.views[i];
        for (std::size_t k = 0; k < view.depth.count(); ++k) {
            float& dist = view.depth.data()[k];
            if (!stx::hasPoint(dist)) continue;
            const double noise = std::clamp(1 + share * normal(i, k), 0.5, 1.5);
            dist = static_cast<float>(dist * noise);
            view.nearPlane = std::min(view.nearPlane, 0.999 * dist);
            view.farPlane = std::max(view.farPlane, 1.001 * dist);
        }
    }
}

/// Distances in steps of an 8-bit depth code between the planes of each view.
inline void quantise(stx::Bundle& bundle) {
    for (auto& view : bundle.views) {
        view.depthBits = 8;
        const stx::DepthCode code = view.depthCode();
        for (float& dist : view.depth.pixels())
            if (stx::hasPoint(dist)) dist = static_cast<float>(code.decode(code.encode(dist)));
    }
}

/// Takes the depth of this share of the points away; their colour stays.
inline void loseDepth(stx::Bundle& bundle, double share) {
    for (std::size_t i = 0; i < bundle.views.size(); ++i)
        for (std::size_t k = 0; k < bundle.views[i].depth.count(); ++k)
            if (uniform(i, k, 2) < share) bundle.views[i].depth.data()[k] = stx::kNoDepth;
}

/// Surfaces in front grow over what is behind them by so many pixels, as stereo's do.
inline void displaceEdges(stx::Bundle& bundle, int pixels) {
    for (auto& view : bundle.views) {
        const stx::Image<float> exact = view.depth;
        for (int y = 0; y < exact.height(); ++y) {
            for (int x = 0; x < exact.width(); ++x) {
                float& dist = view.depth.at(x, y);
                if (!stx::hasPoint(dist)) continue;
                for (int j = -pixels; j <= pixels; ++j)
                    for (int i = -pixels; i <= pixels; ++i)
                        if (exact.contains(x + i, y + j) && stx::hasPoint(exact.at(x + i, y + j)))
                            dist = std::min(dist, exact.at(x + i, y + j));
            }
        }
    }
}

/// This share of the pixels beside a step of depth of 5 % and more lie anywhere between both
/// surfaces, as depth cameras have them where one pixel sees both ("flying pixels").
inline void mixEdges(stx::Bundle& bundle, double share) {
    for (std::size_t i = 0; i < bundle.views.size(); ++i) {
        auto& view = bundle.views[i];
        const stx::Image<float> exact = view.depth;
        for (int y = 1; y + 1 < exact.height(); ++y) {
            for (int x = 1; x + 1 < exact.width(); ++x) {
                const auto pixel = static_cast<std::uint64_t>(y * exact.width() + x);
                if (!stx::hasPoint(exact.at(x, y)) || uniform(i, pixel, 9) > share) continue;
                float low = exact.at(x, y), high = low;
                for (int v = y - 1; v <= y + 1; ++v) {
                    for (int u = x - 1; u <= x + 1; ++u) {
                        const float dist = exact.at(u, v);
                        low = stx::hasPoint(dist) ? std::min(low, dist) : low;
                        high = stx::hasPoint(dist) ? std::max(high, dist) : high;
                    }
                }
                if (high > 1.05f * low)
                    view.depth.at(x, y) =
                        low + (high - low) * static_cast<float>(uniform(i, pixel, 10));
            }
        }
    }
}

/// Pictures of cameras that expose for themselves: a gain of each view (up to 12 %) and channel (up
/// to 3 %) and a black of its own (up to 4 of 255). The colours of a third of the views stay.
inline void changeLight(stx::Bundle& bundle) {
    for (std::size_t i = 0; i < bundle.views.size(); ++i) {
        if (i % 3 == 0) continue;
        const auto between = [&](std::uint64_t what, double most) {
            return static_cast<float>((2 * uniform(i, 0, what) - 1) * most);
        };
        glm::vec4 gain(1.0f), black(0.0f);
        for (int channel = 0; channel < 3; ++channel) {
            gain[channel] = 1 + between(4, 0.12) + between(5 + channel, 0.03);
            black[channel] = between(8, 4.0 / 255);
        }
        auto& texture = bundle.views[i].texture;
        if (auto* bytes = texture.rgba8())
            for (auto& c : bytes->pixels()) {
                const glm::vec4 lit = (glm::vec4(c) / 255.0f * gain + black) * 255.0f + 0.5f;
                if (c.a > 0) c = glm::u8vec4(glm::clamp(lit, 0.0f, 255.0f));
            }
        if (auto* floats = texture.rgbaFloat())
            for (auto& c : floats->pixels())
                if (c.a > 0) c = glm::max(c * gain + black, 0.0f);
    }
}

/// By name: noiseN (percent of the distance), codes8, missing3, edges1, mixedN (percent of the
/// pixels beside edges), light.
inline bool damage(stx::Bundle& bundle, const std::string& kind) {
    if (kind.starts_with("noise") && std::atof(kind.c_str() + 5) > 0)
        addNoise(bundle, 0.01 * std::atof(kind.c_str() + 5));
    else if (kind == "codes8")
        quantise(bundle);
    else if (kind == "missing3")
        loseDepth(bundle, 0.03);
    else if (kind == "edges1")
        displaceEdges(bundle, 1);
    else if (kind.starts_with("mixed") && std::atof(kind.c_str() + 5) > 0)
        mixEdges(bundle, 0.01 * std::atof(kind.c_str() + 5));
    else if (kind == "light")
        changeLight(bundle);
    else
        return false;
    return true;
}

}  // namespace noisy

#include "tests/sweep/sensor.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "lib/model/median_distance.hpp"
#include "tests/noisy_depth.hpp"
#include "tests/sweep/pictures.hpp"

using namespace stx;

namespace sensor {
namespace {

/// `share` of the distance at `usual`, and more by the square of the distance farther away.
void addNoise(ReferenceView& view, std::size_t number, double share, double usual) {
    for (std::size_t k = 0; k < view.depth.count(); ++k) {
        float& dist = view.depth.data()[k];
        if (!hasPoint(dist)) continue;
        const double grown = share * dist / usual;
        const double noise = std::clamp(1 + grown * noisy::normal(number, k), 0.8, 1.2);
        dist = static_cast<float>(dist * noise);
        view.nearPlane = std::min(view.nearPlane, 0.999 * dist);
        view.farPlane = std::max(view.farPlane, 1.001 * dist);
    }
}

/// Whether depth jumps from `front` to the pixel beside it: by a twentieth of the distance, and by
/// three times what it changes by on either side of the step. So the slopes of walls and the limbs
/// of balls, which a few pixels show steep, are no jumps.
bool jumps(const Image<float>& depth, glm::ivec2 front, glm::ivec2 step) {
    const auto at = [&](glm::ivec2 p) {
        return depth.contains(p.x, p.y) ? depth.at(p.x, p.y) : kNoDepth;
    };
    const float near = at(front), far = at(front + step);
    if (!hasPoint(near) || !hasPoint(far) || !(near < 0.95f * far)) return false;
    const float before = at(front - step), behind = at(front + 2 * step);
    const float slope = std::max(hasPoint(before) ? std::abs(near - before) : 0.0f,
                                 hasPoint(behind) ? std::abs(behind - far) : 0.0f);
    return far - near > 3 * slope;
}

/// Surfaces in front reach over those behind them by so many pixels, where depth jumps.
void moveEdges(ReferenceView& view, int pixels) {
    constexpr std::array<glm::ivec2, 4> kSides{{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};
    const Image<float> before = view.depth;
    for (int y = 0; y < before.height(); ++y) {
        for (int x = 0; x < before.width(); ++x) {
            if (std::ranges::none_of(kSides, [&](glm::ivec2 s) {
                    return jumps(before, {x, y}, s);
                }))
                continue;
            for (int v = y - pixels; v <= y + pixels; ++v) {
                for (int u = x - pixels; u <= x + pixels; ++u) {
                    if (!before.contains(u, v) || !hasPoint(before.at(u, v))) continue;
                    float& moved = view.depth.at(u, v);
                    moved = std::min(moved, before.at(x, y));
                }
            }
        }
    }
}

bool isOpaque(const ReferenceView& view) {
    const Rgba8Image* texture = view.texture.rgba8();
    return texture && std::ranges::all_of(texture->pixels(), [](auto c) { return c.a == 255; });
}

}  // namespace

void loseDepth(ReferenceView& view, Random& random) {
    const int width = view.depth.width(), height = view.depth.height();
    const auto lose = [&](int x, int y) { view.depth.at(x, y) = kNoDepth; };
    const Image<float> before = view.depth;
    for (int y = 1; y + 1 < height; ++y)
        for (int x = 1; x + 1 < width; ++x)
            for (const auto& [dx, dy] : {std::pair(-1, 0), {1, 0}, {0, -1}, {0, 1}})
                if (std::abs(before.at(x + dx, y + dy) / before.at(x, y) - 1) > 0.1f) lose(x, y);
    const int border = random.whole(0, 3);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            if (x < border || y < border || x >= width - border || y >= height - border) lose(x, y);
    // Dark and shiny parts.
    for (int i = random.whole(0, 4); i > 0; --i) {
        const int w = random.whole(2, std::max(2, width / 4));
        const int h = random.whole(2, std::max(2, height / 4));
        const int left = random.whole(0, width - w), top = random.whole(0, height - h);
        for (int y = top; y < top + h; ++y)
            for (int x = left; x < left + w; ++x) lose(x, y);
    }
}

Bundle recorded(const Captured& captured, std::string& what) {
    Random random(captured.from.seed * 131 + std::uint64_t(captured.from.number));
    // Seen from another eye, the sensor is the same and its errors are others.
    const auto beside = std::uint64_t(captured.from.beside);
    Random errors(captured.from.seed * 131 + beside * 7919 + std::uint64_t(captured.from.number));
    Bundle out = captured.bundle;
    const auto add = [&](const std::string& kind) { what += (what.empty() ? "" : ", ") + kind; };
    // The cameras at the ends of a rig may see nothing.
    const auto seeing = std::ranges::find_if(
        out.views, [](const ReferenceView& view) { return view.pointCount() >= kFewest; });
    const double usual = medianDistance(seeing == out.views.end() ? out.views.front() : *seeing);
    if (random.chance(0.6)) {
        const double share = random.logBetween(0.001, 0.005);
        for (std::size_t i = 0; i < out.views.size(); ++i)
            addNoise(out.views[i], i + out.views.size() * beside, share, usual);
        add(fmt::format("noise of {:.2f} %", 100 * share));
    }
    if (random.chance(0.4)) {
        const int pixels = random.whole(1, 3);
        for (ReferenceView& view : out.views) moveEdges(view, pixels);
        add(fmt::format("edges moved by {}", pixels));
    }
    if (random.chance(0.6) && std::ranges::all_of(out.views, isOpaque)) {
        for (ReferenceView& view : out.views) {
            loseDepth(view, random);
            view.noDepth = NoDepth::unknown;
        }
        add("depth missing");
    }
    if (random.chance(0.4)) {
        const double share = random.logBetween(0.001, 0.005);
        const auto part = [&] { return (beside ? errors : random).between(-1, 1); };
        for (ReferenceView& view : out.views) {
            const double x = part(), y = part(), z = part();
            view.camera.position += share * usual * glm::dvec3(x, y, z);
        }
        add(fmt::format("positions off by {:.2f} %", 100 * share));
    }
    return out;
}

}  // namespace sensor

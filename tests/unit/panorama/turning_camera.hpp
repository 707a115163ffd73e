#pragma once

#include <cmath>
#include <random>

#include "lib/model/srgb8.hpp"
#include "lib/panorama/panorama.hpp"
#include "lib/panorama/turn_lens.hpp"

namespace stx {

/// A picture on a sphere: discs of all sizes and colours, softly blurred, no two places alike.
inline Rgba8Image texturedSphere(int width, std::uint32_t seed = 1) {
    Image<glm::vec3> light(width, width / 2, glm::vec3(0.4f, 0.45f, 0.5f));
    std::mt19937 random(seed);
    const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
    for (int i = 0; i < 6000; ++i) {
        const double z = 2 * uniform() - 1, turn = 2 * M_PI * uniform();
        const glm::dvec3 middle(std::sqrt(1 - z * z) * std::cos(turn), z,
                                std::sqrt(1 - z * z) * std::sin(turn));
        const double radius = 0.012 * std::pow(8.0, uniform() * uniform());
        const glm::vec3 colour(uniform(), uniform(), uniform());
        const glm::dvec2 at = PanoramaImage::position(middle, width);
        const double rows = radius / M_PI * width / 2 + 3;
        for (int y = std::max(0, static_cast<int>(at.y - rows));
             y < std::min(width / 2, static_cast<int>(at.y + rows)); ++y) {
            const double latitude = M_PI * (0.5 - 2 * (y + 0.5) / width);
            const double reach =
                std::min(width / 2.0, rows / std::max(0.01, std::cos(latitude)) + 2);
            for (int x = static_cast<int>(at.x - reach); x < static_cast<int>(at.x + reach); ++x) {
                const int column = (x % width + width) % width;
                const double angle = std::acos(std::clamp(
                    glm::dot(PanoramaImage::direction({column + 0.5, y + 0.5}, width), middle),
                    -1.0, 1.0));
                // Edges two pixels wide.
                const double t = std::clamp((radius - angle) / (4 * M_PI / width) + 0.5, 0.0, 1.0);
                light.at(column, y) =
                    glm::mix(light.at(column, y), colour, static_cast<float>(t * t * (3 - 2 * t)));
            }
        }
    }
    Rgba8Image out(width, width / 2);
    for (std::size_t i = 0; i < out.count(); ++i)
        out.pixels()[i] = glm::u8vec4(light.pixels()[i] * 255.0f + 0.5f, 255);
    return out;
}

/// Pictures of a sphere by a camera that turned, each known exactly.
class TurningCamera final : public PictureSource {
  public:
    glm::ivec2 size{320, 240};
    panorama::TurnLens lens{1.6, 0};
    std::vector<glm::dquat> worldFromCamera;
    std::vector<float> gains;     ///< of linear light; empty = 1
    std::vector<double> stretch;  ///< focal length of each picture over the lens's; empty = 1
    Vignetting vignetting;
    const PanoramaImage* sphere = nullptr;
    double hint = 0;

    [[nodiscard]] int count() const override { return static_cast<int>(worldFromCamera.size()); }
    [[nodiscard]] std::string name(int k) const override { return "view " + std::to_string(k); }
    [[nodiscard]] double focalHint(int) const override { return hint; }
    [[nodiscard]] Result<Rgba8Image> picture(int k) override {
        Rgba8Image out(size.x, size.y);
        const double half = 0.5 * glm::length(glm::dvec2(size));
        const float gain = gains.empty() ? 1.0f : gains[static_cast<std::size_t>(k)];
        const double longer = stretch.empty() ? 1.0 : stretch[static_cast<std::size_t>(k)];
        const panorama::TurnLens own{lens.focal * longer, lens.k1 * longer * longer};
        for (int y = 0; y < size.y; ++y)
            for (int x = 0; x < size.x; ++x) {
                const glm::dvec2 p =
                    glm::dvec2(x + 0.5 - 0.5 * size.x, 0.5 * size.y - y - 0.5) / half;
                glm::vec3 c(
                    sphere->sample(worldFromCamera[static_cast<std::size_t>(k)] * own.ray(p)));
                const float light =
                    vignetting.none() ? gain : gain / vignetting.clearing(glm::dot(p, p));
                for (int i = 0; i < 3 && light != 1; ++i)
                    c[i] = srgbByTable(std::min(1.0f, linearByTable(c[i]) * light));
                out.at(x, y) = glm::u8vec4(glm::clamp(c, 0.0f, 1.0f) * 255.0f + 0.5f, 255);
            }
        return out;
    }

    /// Turns to the left by `yaw`, up by `pitch`, and rolls; radians.
    void add(double yaw, double pitch, double roll) {
        worldFromCamera.push_back(glm::angleAxis(yaw, glm::dvec3(0, 1, 0)) *
                                  glm::angleAxis(pitch, glm::dvec3(1, 0, 0)) *
                                  glm::angleAxis(roll, glm::dvec3(0, 0, 1)));
    }
};

}  // namespace stx

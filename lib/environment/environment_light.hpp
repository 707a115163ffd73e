#pragma once

#include <array>
#include <memory>
#include <vector>

#include <glm/glm.hpp>

#include "lib/environment/environment_map.hpp"

namespace stx {

/// The light of an environment on surfaces, in the world's axes and linear light. Light of one
/// colour from all sides leaves an albedo times that colour. Safe to use from several threads.
class EnvironmentLight {
  public:
    /// `shininess`: the Phong exponent of glossy(), above 0; 0: no gloss is prepared. Errors:
    /// memory over the limit.
    [[nodiscard]] static Result<std::shared_ptr<const EnvironmentLight>> make(
        std::shared_ptr<const EnvironmentMap> environment, float shininess, const Limits& limits);

    /// Irradiance over pi on a surface of a unit normal: spherical harmonics up to order 2
    /// (Ramamoorthi & Hanrahan 2001), which are within a few percent of the integral.
    [[nodiscard]] glm::vec3 diffuse(glm::vec3 normal) const;
    /// The coefficients of diffuse(), as shaders/shared/environment_light.glsl has them.
    [[nodiscard]] const std::array<glm::vec3, 9>& harmonics() const { return harmonics_; }
    /// The mean of the light around a unit direction, weighed by cos^shininess (above a shininess
    /// of 3600, by an even footprint as wide). Zero where no gloss was prepared.
    [[nodiscard]] glm::vec3 glossy(glm::vec3 direction) const;

    /// glossy() as a table for shaders: the six faces, each kGlossSide texels a side and one more
    /// around from across its edges, row by row. Empty where no gloss was prepared, and where lobes
    /// are narrower than texels (shininess above kMostTableShininess).
    [[nodiscard]] const std::vector<glm::vec3>& glossTable() const { return glossTable_; }
    static constexpr int kGlossSide = 32;
    static constexpr float kMostTableShininess = 128.0f;

  private:
    std::array<glm::vec3, 9> harmonics_{};
    /// Weighed already, or the environment itself for lobes that are very narrow.
    std::shared_ptr<const EnvironmentMap> gloss_;
    float lobeRad_ = 0;  ///< footprint of the latter
    std::vector<glm::vec3> glossTable_;
};

}  // namespace stx

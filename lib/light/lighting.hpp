#pragma once

#include <memory>
#include <vector>

#include <glm/glm.hpp>

#include "lib/base/result.hpp"
#include "lib/environment/environment_light.hpp"

namespace stx {

/// A light of the Phong model (Lee & Park, section 3.2).
struct Light {
    enum class Kind { directional, point };
    Kind kind = Kind::directional;
    /// Directional: the way the light travels. Point: its position, scene units.
    glm::vec3 vector{0, 0, -1};
    glm::vec3 colour{1, 1, 1};
    bool inCameraSpace = false;  ///< moves with the camera (a headlight)
};

/// Phong lighting, all amounts linear light; off while there is no light. An environment lights
/// from all sides: its diffuse light adds to the ambient one, its gloss is what the mirrored
/// direction sees through a Phong lobe.
struct Lighting {
    std::vector<Light> lights;
    std::shared_ptr<const EnvironmentLight> environment;  ///< null: none
    glm::vec3 ambient{0.2f};
    glm::vec3 specular{0.0f};
    float shininess = 32.0f;  ///< exponent, > 0
    /// sRGB-coded colours grow beyond 1 in much light, as linear ones do, and the coding goes on
    /// there. For pictures of floats.
    bool beyondOne = false;

    [[nodiscard]] bool on() const { return !lights.empty() || environment; }
    /// Errors (usage): light below 0, a directional light without a direction, an exponent that is
    /// not above 0, values that are not finite.
    [[nodiscard]] Result<void> check() const;
};

/// Phong: albedo * (ambient + sum of diffuse) + sum of specular, in linear light. All vectors in
/// one space; `toEye` and `normal` unit, `position` the lit point. Unless `linear`, albedo and
/// result are sRGB-coded, 0..1 but for `beyondOne`: decoded, lit, coded again. The shaders share
/// its code.
[[nodiscard]] glm::vec3 shadePhong(const Lighting& lighting, glm::vec3 albedo, glm::vec3 position,
                                   glm::vec3 normal, glm::vec3 toEye, bool linear);

/// The lights with camera-space ones turned into the world of a camera. Point lights that are too
/// far away for floats become directional ones.
[[nodiscard]] Lighting lightsInWorld(const Lighting& lighting, const glm::dmat4& worldFromCamera);

}  // namespace stx

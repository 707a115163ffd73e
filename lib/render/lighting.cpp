#include "lib/render/lighting.hpp"

#include <cmath>

namespace stx {

glm::vec3 shadePhong(const Lighting& lighting, glm::vec3 albedo, glm::vec3 position,
                     glm::vec3 normal, glm::vec3 toEye) {
    glm::vec3 diffuse = lighting.ambient;
    glm::vec3 specular(0.0f);
    for (const auto& light : lighting.lights) {
        const glm::vec3 toLight =
            light.kind == Light::Kind::directional ? -light.vector : light.vector - position;
        const float length = glm::length(toLight);
        if (!(length > 0.0f)) continue;
        const glm::vec3 l = toLight / length;
        const float cosine = glm::dot(normal, l);
        if (cosine <= 0.0f) continue;
        diffuse += light.colour * cosine;
        const glm::vec3 mirrored = normal * (2.0f * cosine) - l;
        const float gloss = glm::dot(mirrored, toEye);
        if (gloss > 0.0f) specular += light.colour * std::pow(gloss, lighting.shininess);
    }
    return albedo * diffuse + specular * lighting.specular;
}

Lighting lightsInWorld(const Lighting& lighting, const glm::dmat4& worldFromCamera) {
    Lighting out = lighting;
    for (auto& light : out.lights) {
        if (!light.inCameraSpace) continue;
        const double w = light.kind == Light::Kind::point ? 1.0 : 0.0;
        light.vector = glm::vec3(worldFromCamera * glm::dvec4(light.vector, w));
        light.inCameraSpace = false;
    }
    return out;
}

}  // namespace stx

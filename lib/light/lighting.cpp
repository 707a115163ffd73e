#include "lib/light/lighting.hpp"

#include <limits>

#include "lib/model/srgb8.hpp"
#include "lib/model/texture.hpp"
#include "shaders/shared/language.hpp"

namespace stx {

namespace {
using namespace glsl;

struct Phong {
    const Lighting& lighting;
    [[nodiscard]] vec3 ambientLight() const { return lighting.ambient; }
    [[nodiscard]] vec3 specularLight() const { return lighting.specular; }
    [[nodiscard]] float shininess() const { return lighting.shininess; }
    [[nodiscard]] int lightCount() const { return static_cast<int>(lighting.lights.size()); }
    [[nodiscard]] const Light& light(int i) const { return lighting.lights[i]; }
    [[nodiscard]] vec3 lightColour(int i) const { return light(i).colour; }
    [[nodiscard]] vec4 lightVector(int i) const {
        return {light(i).vector, light(i).kind == Light::Kind::point ? 1.0f : 0.0f};
    }
    [[nodiscard]] vec3 environmentDiffuse(vec3 normal) const {
        return lighting.environment ? lighting.environment->diffuse(normal) : vec3(0.0f);
    }
    [[nodiscard]] vec3 environmentGloss(vec3 direction) const {
        return lighting.environment && lighting.specular != vec3(0.0f)
                   ? lighting.environment->glossy(direction)
                   : vec3(0.0f);
    }
    [[nodiscard]] static vec3 decoded(vec3 c) {
        return {linearByTable(c.x), linearByTable(c.y), linearByTable(c.z)};
    }
    [[nodiscard]] float brightest() const {
        return lighting.beyondOne ? std::numeric_limits<float>::max() : 1.0f;
    }
    [[nodiscard]] static vec3 coded(vec3 c) {
        return {srgbBeyondOne(c.x), srgbBeyondOne(c.y), srgbBeyondOne(c.z)};
    }
#include "shaders/shared/phong.glsl"
};

}  // namespace

glm::vec3 shadePhong(const Lighting& lighting, glm::vec3 albedo, glm::vec3 position,
                     glm::vec3 normal, glm::vec3 toEye, bool linear) {
    Phong phong{lighting};
    return linear ? phong.shadePhong(albedo, position, normal, toEye)
                  : phong.shadeCoded(albedo, position, normal, toEye);
}

Lighting lightsInWorld(const Lighting& lighting, const glm::dmat4& worldFromCamera) {
    Lighting out = lighting;
    for (auto& light : out.lights) {
        // Floats cannot square the length of each direction.
        if (light.kind == Light::Kind::directional && light.vector != glm::vec3(0.0f))
            light.vector = glm::vec3(glm::normalize(glm::dvec3(light.vector)));
        if (!light.inCameraSpace) continue;
        const double w = light.kind == Light::Kind::point ? 1.0 : 0.0;
        light.vector = glm::vec3(worldFromCamera * glm::dvec4(light.vector, w));
        light.inCameraSpace = false;
    }
    return out;
}

}  // namespace stx

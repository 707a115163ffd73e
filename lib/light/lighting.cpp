#include "lib/light/lighting.hpp"

#include <cmath>
#include <limits>
#include <utility>

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

Result<void> Lighting::check() const {
    const auto finite = [](glm::vec3 v) { return v * 0.0f == glm::vec3(0.0f); };
    const auto isLight = [&](glm::vec3 v) {
        return finite(v) && glm::all(glm::greaterThanEqual(v, glm::vec3(0.0f)));
    };
    if (!(shininess > 0) || !std::isfinite(shininess))
        return fail(ErrorCode::usage, "shininess is {:g}; a number above 0 is expected", shininess);
    for (const auto& [name, amount] : {std::pair{"ambient", ambient}, {"specular", specular}})
        if (!isLight(amount))
            return fail(ErrorCode::usage, "{} is {:g}, {:g}, {:g}; light is 0 or more", name,
                        amount.x, amount.y, amount.z);
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const Light& light = lights[i];
        const bool directed = light.kind == Light::Kind::point || light.vector != glm::vec3(0.0f);
        if (!finite(light.vector) || !directed)
            return fail(ErrorCode::usage, "light {} is {} {:g}, {:g}, {:g}; {} is expected", i,
                        light.kind == Light::Kind::point ? "at" : "along", light.vector.x,
                        light.vector.y, light.vector.z,
                        light.kind == Light::Kind::point ? "a place" : "a direction");
        if (!isLight(light.colour))
            return fail(ErrorCode::usage,
                        "light {} has the colour {:g}, {:g}, {:g}; light is 0 or more", i,
                        light.colour.x, light.colour.y, light.colour.z);
    }
    return {};
}

Lighting lightsInWorld(const Lighting& lighting, const glm::dmat4& worldFromCamera) {
    // A point light beyond this is as good as a directional one, and floats cannot square the
    // length of the way to one at 1e20.
    constexpr double kFarAway = 1e15;
    Lighting out = lighting;
    for (auto& light : out.lights) {
        // Floats cannot square the length of each direction.
        if (light.kind == Light::Kind::directional && light.vector != glm::vec3(0.0f))
            light.vector = glm::vec3(glm::normalize(glm::dvec3(light.vector)));
        const bool point = light.kind == Light::Kind::point;
        glm::dvec3 vector(light.vector);
        if (light.inCameraSpace)
            vector = glm::dvec3(worldFromCamera * glm::dvec4(vector, point ? 1.0 : 0.0));
        light.inCameraSpace = false;
        if (point && glm::length(vector) > kFarAway) {
            light.kind = Light::Kind::directional;
            vector = -glm::normalize(vector);
        }
        light.vector = glm::vec3(vector);
    }
    return out;
}

}  // namespace stx

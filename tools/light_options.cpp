#include "tools/light_options.hpp"

#include <algorithm>

#include "tools/program.hpp"

namespace stx::tools {

Result<glm::vec3> parseGreyOrRgb(const std::string& text, const char* option) {
    if (text.find(',') != std::string::npos) {
        STX_TRY(const auto v, parseVec3(text, option));
        return glm::vec3(v);
    }
    STX_TRY(const auto v, parseNumbers(text, 1, option));
    return glm::vec3(static_cast<float>(v[0]));
}

Result<Light> parseLight(const std::string& text, glm::dvec3 origin) {
    Light light;
    std::string body = text;
    if (const auto at = body.rfind("@camera"); at != std::string::npos && at + 7 == body.size()) {
        light.inCameraSpace = true;
        body.resize(at);
    }
    if (body.rfind("dir:", 0) == 0)
        light.kind = Light::Kind::directional;
    else if (body.rfind("point:", 0) == 0)
        light.kind = Light::Kind::point;
    else
        return fail(
            ErrorCode::usage,
            "--light is '{}'; dir:X,Y,Z[,r,g,b], point:X,Y,Z[,r,g,b] or environment is expected",
            text);
    body = body.substr(body.find(':') + 1);
    const auto commas = std::count(body.begin(), body.end(), ',');
    STX_TRY(const auto v, parseNumbers(body, commas >= 3 ? 6 : 3, "--light"));
    const glm::dvec3 vector(v[0], v[1], v[2]);
    const bool inWorld = light.kind == Light::Kind::point && !light.inCameraSpace;
    light.vector = glm::vec3(inWorld ? vector - origin : vector);
    if (v.size() == 6) light.colour = glm::vec3(v[3], v[4], v[5]);
    if (glm::any(glm::lessThan(light.colour, glm::vec3(0.0f))))
        return fail(ErrorCode::usage, "--light '{}' has a negative colour; light is 0 or more",
                    text);
    if (light.kind == Light::Kind::directional && light.vector == glm::vec3(0.0f))
        return fail(ErrorCode::usage, "--light '{}' has no direction", text);
    return light;
}

}  // namespace stx::tools

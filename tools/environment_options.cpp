#include "tools/environment_options.hpp"

#include "formats/environment/environment_files.hpp"
#include "lib/geometry/camera.hpp"

namespace stx::tools {
namespace {

/// What the environment's +Y becomes.
Result<glm::dvec3> upOf(const EnvironmentOptions& options) {
    if (options.up.empty()) return glm::dvec3(0, 1, 0);
    STX_TRY(const auto up, parseDirection(options.up, "--environment-up"));
    return glm::normalize(scaledToOne(up));
}

}  // namespace

void addEnvironmentOptions(const Command& command, EnvironmentOptions& options, const char* help) {
    Command c = command.under("Environment: what is behind everything, infinitely far away");
    c.option("--environment", options.file, help).reads("FILE|none");
    c.option("--environment-up", options.up,
             "Direction of the scene that is up in the environment: Z, X,Y,Z or with a minus "
             "--environment-up=-Y (default Y)")
        .takes("AXIS");
    c.option("--environment-turn", options.turnDeg,
             "Turns the environment about that direction, counter-clockwise from above (default 0)")
        .takes("DEG");
}

Result<void> checkEnvironmentOptions(const EnvironmentOptions& options, const Command& command) {
    if (!options.given() || options.none())
        STX_CHECK(command.refuse({"--environment-up", "--environment-turn"},
                                 "is of an environment; give --environment FILE, too"));
    STX_CHECK(upOf(options));
    return {};
}

Result<std::shared_ptr<const Environment>> environmentOf(const EnvironmentOptions& options,
                                                         Job& job) {
    if (!options.given() || options.none()) return std::shared_ptr<const Environment>();
    STX_TRY(auto environment, openEnvironment(options.file, job));
    STX_TRY(const glm::dvec3 up, upOf(options));
    const glm::dvec3 y(0, 1, 0);
    const glm::dvec3 axis = glm::cross(y, up);
    const double sine = glm::length(axis), angle = std::atan2(sine, glm::dot(y, up));
    glm::dquat turn(1, 0, 0, 0);
    // Upside down: about X.
    if (angle > 0)
        turn = quatFromAxisAngle(glm::dvec4(sine > 1e-12 ? axis : glm::dvec3(1, 0, 0), angle));
    if (options.turnDeg != 0)
        turn = quatFromAxisAngle(glm::dvec4(up, glm::radians(options.turnDeg))) * turn;
    if (turn == glm::dquat(1, 0, 0, 0)) return environment;
    auto turned = std::make_shared<Environment>(*environment);
    turned->orientation = glm::normalize(turn * environment->orientation);
    return std::shared_ptr<const Environment>(std::move(turned));
}

Result<std::shared_ptr<const EnvironmentLight>> environmentLight(
    std::shared_ptr<const EnvironmentMap> map, const Lighting& lighting, const Limits& limits) {
    if (!map)
        return fail(ErrorCode::usage,
                    "--light environment: the input has no environment of its own; give one by "
                    "--environment FILE");
    const bool gloss = lighting.specular != glm::vec3(0.0f);
    return EnvironmentLight::make(std::move(map), gloss ? lighting.shininess : 0.0f, limits);
}

}  // namespace stx::tools

#pragma once

#include <memory>
#include <string>

#include "lib/light/lighting.hpp"
#include "lib/model/environment.hpp"
#include "tools/command_line.hpp"
#include "tools/program.hpp"

namespace stx::tools {

/// What is behind the object, as the command line says it.
struct EnvironmentOptions {
    std::string file;  ///< "none"; empty = not given
    std::string up;    ///< an axis or "X,Y,Z"; empty: +Y
    double turnDeg = 0;

    [[nodiscard]] bool given() const { return !file.empty(); }
    [[nodiscard]] bool none() const { return file == "none"; }
};

void addEnvironmentOptions(const Command& command, EnvironmentOptions& options, const char* help);

/// Errors (usage) of options that need no file to be seen.
[[nodiscard]] Result<void> checkEnvironmentOptions(const EnvironmentOptions& options,
                                                   const Command& command);
/// The environment asked for, turned as asked; null for none and when it was not given.
[[nodiscard]] Result<std::shared_ptr<const Environment>> environmentOf(
    const EnvironmentOptions& options, Job& job);

/// What `--light environment` lights by, with the gloss that `lighting` asks for. Errors: usage
/// when `map` is null.
[[nodiscard]] Result<std::shared_ptr<const EnvironmentLight>> environmentLight(
    std::shared_ptr<const EnvironmentMap> map, const Lighting& lighting, const Limits& limits);

}  // namespace stx::tools

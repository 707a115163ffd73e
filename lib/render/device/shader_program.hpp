#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "lib/base/result.hpp"
#include "lib/render/device/gl_object.hpp"

namespace stx::gpu {

/// One shader of a program: its type and the pieces of its text, in order.
struct ShaderStage {
    GLenum type = GL_COMPUTE_SHADER;
    std::string_view name;  ///< for messages
    std::vector<std::string_view> pieces;
};

/// Compiles and links; `header` (#version, extensions and #defines) begins every stage. Errors: the
/// driver's log, first line.
[[nodiscard]] Result<GlProgram> buildProgram(const std::string& header,
                                             std::span<const ShaderStage> stages);

/// The whole text of one shader as a driver would get it, for tools that check it offline.
struct ShaderText {
    std::string name;    ///< what it is, such as "splat.comp pass 1 rule 0"
    std::string ending;  ///< "vert", "frag" or "comp"
    std::string text;
};
[[nodiscard]] ShaderText shaderText(std::string name, const std::string& header,
                                    const ShaderStage& stage);

}  // namespace stx::gpu

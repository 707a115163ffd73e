#pragma once

#include <span>
#include <string>
#include <string_view>

#include "lib/base/result.hpp"
#include "lib/render/gpu/gl_object.hpp"

namespace stx::gpu {

/// One shader of a program: its type and the pieces of its text, in order.
struct ShaderStage {
    GLenum type = GL_COMPUTE_SHADER;
    std::string_view name;  ///< for messages
    std::vector<std::string_view> pieces;
};

/// Compiles and links; `header` (extensions and #defines) comes after #version in every stage.
/// Errors: the driver's log, first line.
[[nodiscard]] Result<GlProgram> buildProgram(const std::string& header,
                                             std::span<const ShaderStage> stages);

}  // namespace stx::gpu

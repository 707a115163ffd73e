#pragma once

#include <string>
#include <vector>

#include "lib/render/device/shader_program.hpp"
#include "lib/render/surface/prepare/constants.hpp"

namespace stx::gpu {

/// What is the same for all shaders of a renderer in surface mode.
struct SurfaceVariant {
    int samplesPerPixel = 3;  ///< along a side
    int mostSources = 4;      ///< that a piece takes colours from
    float freeLevel = surface::kFreeLevel;
};

/// `fuse` runs again with 1 at the location kFuseCore, for what the first sources of a tile show
/// (SurfaceFrame::tileCore).
enum class SurfaceProgram { mesh, extensions, fuse, shade, resolve, resolveWithOrigin };
constexpr int kFuseCore = 0;

[[nodiscard]] std::string surfaceHeader(const SurfaceVariant& variant, SurfaceProgram program);
[[nodiscard]] ShaderStage surfaceStage(SurfaceProgram program);

/// Every shader of surface mode in every variant that a Quality asks for.
[[nodiscard]] std::vector<ShaderText> allSurfaceShaders();

}  // namespace stx::gpu

#pragma once

#include "shaders/shared/language.hpp"

/// The numbers that surface mode is tuned with and the codes of its pixels: one list for the
/// processor and the shaders.
namespace stx::surface {
using glsl::uint;
#include "shaders/shared/surface_cells.glsl"
#include "shaders/shared/surface_constants.glsl"
}  // namespace stx::surface

#pragma once

#include "shaders/shared/language.hpp"

/// The numbers that splat mode is tuned with, one list for the processor and the shaders.
namespace stx::splat {
#include "shaders/shared/splat_constants.glsl"
}  // namespace stx::splat

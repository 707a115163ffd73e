#pragma once

#include <memory>
#include <vector>

#include "lib/render/surface/prepare/source.hpp"

namespace stx::surface {

/// The textures of the scene's pages with the colours of surfaces made as much sharper as fitting
/// them (see ShadeSettings) blurs them: each channel gets 0.17 of its difference to the mean of the
/// four pixels around. Pixels beside edges, and alpha, stay as they are.
[[nodiscard]] std::vector<std::shared_ptr<const Texture>> sharpenedTextures(
    const SurfaceScene& scene);

}  // namespace stx::surface

#pragma once

#include <memory>

#include "lib/base/job.hpp"
#include "lib/model/mesh.hpp"
#include "lib/render/api/renderer.hpp"

namespace stx {

/// A renderer that rasterises the mesh itself: the truth to compare novel views with. Lighting is
/// as in the other renderers. The mesh must outlive it.
[[nodiscard]] std::unique_ptr<Renderer> makeMeshRenderer(const Mesh& mesh,
                                                         const RenderSettings& settings, Job& job);

}  // namespace stx

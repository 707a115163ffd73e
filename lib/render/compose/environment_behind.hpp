#pragma once

#include <memory>

#include "lib/environment/environment_map.hpp"
#include "lib/render/api/renderer.hpp"

namespace stx {

/// Lays a frame of a camera over an environment: where a pixel is open, by as much as it is open,
/// in the frame's own colour space, as a background colour is. Alpha becomes that of both together;
/// depth, normals and albedo stay those of what was drawn. An orthographic camera sees one
/// direction, so one colour.
void putEnvironmentBehind(Frame& frame, const Camera& camera, const EnvironmentMap& environment);

/// A renderer that shows an environment where `inner` shows nothing.
[[nodiscard]] std::unique_ptr<Renderer> withEnvironment(
    std::unique_ptr<Renderer> inner, std::shared_ptr<const EnvironmentMap> environment);

}  // namespace stx

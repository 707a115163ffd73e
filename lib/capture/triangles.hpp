#pragma once

#include <cstdint>
#include <vector>

#include "lib/capture/rasterizer.hpp"

/// The parts of rasterise().
namespace stx {

/// rasterise() of the triangles of a mesh alone; what is brighter than white goes on beyond 1.
[[nodiscard]] Result<RasterImage> rasteriseTriangles(const Mesh& mesh, const Camera& camera,
                                                     const RasterSettings& settings, Job& job);

/// Of each triangle of a mesh without translucent ones, 1 where it is the nearest at a sample of
/// the picture or at a pixel's centre, else 0.
[[nodiscard]] Result<std::vector<std::uint8_t>> shownTriangles(const Mesh& mesh,
                                                               const Camera& camera,
                                                               const RasterSettings& settings,
                                                               Job& job);

/// Bytes that drawing takes for a triangle, beside the mesh, where all are in one place.
[[nodiscard]] std::uint64_t memoryOfTriangle();

/// A mesh without loose points: each became a disc of triangles, facing outward from the camera's
/// position (or, when orthographic, along `-forward`), or the half of a ball that faces there.
/// Those that others hide in this picture may be left out, where all would take much of
/// Limits::maxMemoryBytes; an error where those that show take more. Not of splats.
[[nodiscard]] Result<Mesh> pointsAsTriangles(const Mesh& mesh, const Camera& camera,
                                             const RasterSettings& settings, Job& job);

}  // namespace stx

#include <algorithm>

#include "lib/base/parallel.hpp"
#include "lib/capture/material_sampler.hpp"
#include "lib/capture/triangles.hpp"
#include "lib/model/texture.hpp"
#include "lib/splats/draw.hpp"

namespace stx {
namespace {

/// What is brighter than white becomes white, under its coverage.
void clip(Image<glm::vec4>& colour) {
    parallelFor(0, colour.height(), 16, [&](int y) {
        for (auto& c : colour.row(y)) c = glm::vec4(glm::min(glm::vec3(c), c.w), c.w);
    });
}

Result<RasterImage> rasterisedMesh(const Mesh& mesh, const Camera& camera,
                                   const RasterSettings& settings, Job& job) {
    if (mesh.points.empty()) return rasteriseTriangles(mesh, camera, settings, job);
    STX_TRY(const Mesh solid, pointsAsTriangles(mesh, camera, settings, job));
    return rasteriseTriangles(solid, camera, settings, job);
}

/// Colours of linear light as sRGB-coded ones, under their coverage.
void codeColours(Image<glm::vec4>& colour) {
    parallelFor(0, colour.height(), 16, [&](int y) {
        for (auto& c : colour.row(y)) {
            if (!(c.w > 0.0f)) continue;
            for (int k = 0; k < 3; ++k) c[k] = srgbFromLinear(c[k] / c.w) * c.w;
        }
    });
}

}  // namespace

void RasterImage::code() {
    if (!linear) return;
    codeColours(colour);
    codeColours(lit);
    linear = false;
}

Result<RasterImage> rasterise(const Mesh& mesh, const Camera& camera,
                              const RasterSettings& settings, Job& job) {
    STX_CHECK(camera.check());
    if (settings.supersampling < 1 || settings.supersampling > 8)
        return fail(ErrorCode::usage, "supersampling is {}; 1 to 8 is possible",
                    settings.supersampling);
    STX_CHECK(job.limits.checkAllocation(static_cast<std::uint64_t>(camera.width) * camera.height,
                                         32, "the picture"));
    if (mesh.splats) {
        STX_TRY(auto drawn, drawSplats(*mesh.splats, camera, settings.normals, job));
        // Brighter than white is not clipped here, but by what makes codes of it, once all that is
        // behind has been added (Kerbl et al. 2023).
        const auto lit = settings.lighting.on() ? drawn.colour : Image<glm::vec4>();
        return RasterImage{drawn.colour, lit, drawn.depth,        drawn.normal,
                           {},           {},  mesh.splats->linear};
    }
    STX_CHECK(job.limits.checkAllocation(mesh.triangles.size(), memoryOfTriangle(), "the mesh"));
    STX_TRY(auto out, rasterisedMesh(mesh, camera, settings, job));
    if (settings.lighting.beyondOne || !mayExceedWhite(mesh)) return out;
    clip(out.colour);
    clip(out.lit);
    return out;
}

}  // namespace stx

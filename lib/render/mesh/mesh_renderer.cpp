#include "lib/render/mesh/mesh_renderer.hpp"

#include <algorithm>

#include "lib/capture/rasterizer.hpp"

namespace stx {
namespace {

class MeshRenderer : public Renderer {
  public:
    MeshRenderer(const Mesh& mesh, const RenderSettings& settings, Job& job)
        : mesh_(mesh), settings_(settings), job_(job) {}

    Result<Frame> render(const Camera& camera) override;
    [[nodiscard]] std::string backend() const override { return "cpu"; }
    [[nodiscard]] std::string device() const override { return "rasteriser"; }

  private:
    const Mesh& mesh_;
    RenderSettings settings_;
    Job& job_;
};

Result<Frame> MeshRenderer::render(const Camera& camera) {
    RasterSettings raster;
    raster.supersampling = 4;
    raster.normals = true;
    raster.lighting = lightsInWorld(settings_.lighting, lightPose(camera).worldFromCamera());
    STX_TRY(auto image, rasterise(mesh_, camera, raster, job_));
    Frame frame;
    frame.colour = std::move(image.colour);
    frame.linear = image.linear;
    frame.depth = std::move(image.depth);
    frame.normal = std::move(image.normal);
    if (settings_.wantNormals()) frame.albedo = frame.colour;
    if (raster.lighting.on()) frame.colour = std::move(image.lit);
    return frame;
}

}  // namespace

std::unique_ptr<Renderer> makeMeshRenderer(const Mesh& mesh, const RenderSettings& settings,
                                           Job& job) {
    if (settings.lighting.on() && std::ranges::any_of(mesh.materials, &Material::unlit))
        job.note("materials that are unlit (KHR_materials_unlit) keep their colour under lights");
    return std::make_unique<MeshRenderer>(mesh, settings, job);
}

}  // namespace stx

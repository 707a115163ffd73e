#pragma once

#include <span>
#include <vector>

#include "lib/base/job.hpp"
#include "lib/geometry/camera.hpp"
#include "lib/model/mesh.hpp"
#include "lib/model/reference_view.hpp"
#include "lib/render/api/renderer.hpp"

namespace stx {

/// How good rendered views are: PSNR against a truth drawn from the same cameras. Pictures are
/// compared as people see them: 8-bit sRGB, on black.
class ViewQuality {
  public:
    /// PSNR of RGB, dB; infinity when nothing differs.
    struct Psnr {
        double all = 0;    ///< from the mean squared error over all pictures
        double worst = 0;  ///< of the worst picture
    };

    /// Draws the truth, which is not needed afterwards. Errors: those of render(), cancelled.
    [[nodiscard]] static Result<ViewQuality> against(Renderer& truth, std::vector<Camera> cameras,
                                                     const Job& job);

    /// Against a mesh itself: six pictures from all sides, as somebody would look at the object.
    /// Errors: those of frameCamera() and render(), cancelled.
    [[nodiscard]] static Result<ViewQuality> against(const Mesh& mesh, int side, Job& job);
    /// The same pictures of a mesh, drawn by another renderer, which is not needed afterwards.
    [[nodiscard]] static Result<ViewQuality> against(Renderer& truth, const Mesh& mesh, int side,
                                                     const Job& job);
    /// Against what views show, where they are the truth: on black.
    [[nodiscard]] static ViewQuality of(std::span<const ReferenceView> views);

    /// Draws and compares. Errors: those of render(), cancelled.
    [[nodiscard]] Result<Psnr> measure(Renderer& renderer, const Job& job) const;

  private:
    std::vector<Camera> cameras_;
    std::vector<Rgba8Image> truth_;
};

}  // namespace stx

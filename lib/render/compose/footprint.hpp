#pragma once

#include <memory>

#include "lib/base/job.hpp"
#include "lib/geometry/pixel_space.hpp"
#include "lib/render/api/renderer.hpp"
#include "lib/render/scene/page_set.hpp"

namespace stx {

/// How many samples of the reference views go into one pixel of a camera, along a side: the median
/// over points of the scene that it sees; 1 when it sees none.
class Footprint {
  public:
    explicit Footprint(const PageSet& set);
    [[nodiscard]] double samplesPerPixel(const Camera& camera) const;
    /// By how much larger its picture is drawn, where memory allows it: 1 up to 1.5 samples.
    [[nodiscard]] int factor(const Camera& camera) const;

  private:
    struct SampledPoint {
        glm::dvec3 world;
        double spacing;  ///< of the samples there, scene units
    };
    std::vector<SampledPoint> points_;
};

/// The picture of a camera out of one that is `factor` times as wide and high: colours, albedo and
/// normals are means, the depth is that of the covered sample nearest to the pixel's centre where
/// half or more are covered. `large` must have the camera's size times the factor, `shares` is that
/// of the camera.
[[nodiscard]] Frame minified(const Frame& large, int factor, const ShareLength& shares);

/// A renderer that draws pictures which are smaller than the reference views as large as those, and
/// averages: the renderers of this library look at a handful of samples for each pixel and would
/// alias. Cameras that see the samples at up to 1.5 to the pixel, and without light the very
/// cameras of reference views, are left to `inner`. Larger pictures are held to 16 million pixels
/// and to the limits of `job`, which must outlive this, with a note. `settings`: those of `inner`.
[[nodiscard]] std::unique_ptr<Renderer> withFootprint(std::unique_ptr<Renderer> inner,
                                                      const PageSet& set,
                                                      const RenderSettings& settings, Job& job);

}  // namespace stx

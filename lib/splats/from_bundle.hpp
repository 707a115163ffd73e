#pragma once

#include "lib/base/job.hpp"
#include "lib/model/bundle.hpp"
#include "lib/model/splat_cloud.hpp"
#include "lib/model/view_table.hpp"

namespace stx {

struct SplatSettings {
    /// Standard deviations of a splat for each half axis of its texel's ellipse (bake()). Of 0.5 to
    /// 0.9, pictures are best from 0.6 to 0.7, see tests/bench/pictures.md.
    double size = 0.65;
    /// Pixels for each texel, above 0, in the pictures whose outlines are to be right. The rules of
    /// drawing widen each splat by a share of a pixel, and outlines, where many lie behind each
    /// other, by a whole one: so splats lie as far below the surface. In larger pictures the object
    /// is then a little too thin, in smaller ones too thick. 1: the size of the views.
    double pixelsPerTexel = 1.5;
    /// At most so many splats: flat pieces of one colour become one splat, those whose loss is
    /// least first; 0 = one for each texel.
    std::size_t most = 0;
};

/// A Gaussian for each place that views show, of the view that shows it finest: below its point
/// (see SplatSettings::pixelsPerTexel), flat in its surface, along the axes of its ellipse (those
/// of bake() where a view has none), with its colour, white where it is brighter (a note says so),
/// and 0.99 of its alpha. Splats of background views come first. The coordinates are the world's:
/// an origin is added, with a note where floats round it. What is up in the cloud is that of the
/// views' cameras (upOfCameras()).
///
/// Views are read one by one. What is known of each pixel is in a spool, if any: then memory is
/// taken for one view for each thread, and for the cloud.
///
/// Errors: those of bake() and of the views; (invalidInput) no point, more than 2^32 - 1; (failed)
/// flat pieces do not come down to `most`, with the least that they come to; memory over the limit,
/// cancelled.
[[nodiscard]] Result<SplatCloud> splatsOfViews(const ViewTable& table,
                                               const SplatSettings& settings, PixelSpool* spool,
                                               Job& job);
/// Memory that it takes with a spool, what that holds included, bytes. `most`: of the settings.
[[nodiscard]] std::uint64_t memoryOfSpooledSplats(const ViewTable& table, const Limits& limits,
                                                  std::size_t most = 0);

}  // namespace stx

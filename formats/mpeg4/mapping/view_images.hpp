#pragma once

#include <string>

#include "formats/mpeg4/mapping/mapping.hpp"
#include "formats/mpeg4/scene/placement.hpp"

namespace stx::mpeg4 {

/// The images of one view as MPEG-4 streams carry them, and what goes into its node beside them.
struct ViewImages {
    Padding padding;
    float nearPlane = 0, farPlane = 0;
    float longestSplat = 0;  ///< scene units; splatMinMax is (-longestSplat, longestSplat)
    Bytes texture, depth, normal, splatU, splatV;  ///< files; empty where the view has none
    std::string unknown;    ///< where its depth is unknown, if that can be: what its note says
    double worstDepth = 0;  ///< largest error of the depth's code, scene units
    bool clamped = false;   ///< linear colour above 1 was cut
    bool unmeasuredLost = false;  ///< colours without a depth
    bool coverageLost = false;
};

/// The largest error of depth that is rounded to codes, for a note.
class DepthLoss {
  public:
    /// Of a view whose depth is written in `bits`, with ViewImages::worstDepth.
    void add(const ViewHeader& view, int bits, double worstDepth);
    /// Says how far off depth is, if some is.
    void note(Job& job) const;

  private:
    double worst_ = 0;  ///< scene units
    int bits_ = 0;
};

/// Encodes the images of a view. `longestSplat` above 0: the range of the splats, of a sequence
/// whose frames share it; else the view's own. Errors: a principal point that padding cannot
/// centre, planes that do not fit floats, a depth that is NaN or below 0; those of the image
/// writers.
[[nodiscard]] Result<ViewImages> encodeView(const ReferenceView& view,
                                            const SceneWriteOptions& options, const Limits& limits,
                                            float longestSplat = 0);

/// Position, orientation and fieldOfView of a DepthImage.
void setCamera(Node& node, const Camera& camera);

/// Whether the view becomes a DepthImageV2.
[[nodiscard]] bool isWrittenAsV2(const ReferenceView& view, const SceneWriteOptions& options);
/// 8 or 16.
[[nodiscard]] int writtenDepthBits(const ViewHeader& view, const SceneWriteOptions& options);
/// The largest component of the splats' half axes; 1 where there is none.
[[nodiscard]] float longestSplatOf(const ReferenceView& view);

}  // namespace stx::mpeg4

#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "formats/mpeg4/mapping/mapping.hpp"
#include "formats/mpeg4/scene/placement.hpp"

namespace stx::mpeg4 {

/// The images of one view as MPEG-4 streams carry them, and what goes into its node beside them.
struct ViewImages {
    Padding padding;
    float nearPlane = 0, farPlane = 0;
    float longestSplat = 0;  ///< scene units; splatMinMax is (-longestSplat, longestSplat)
    Bytes texture, depth, normal, splatU, splatV;  ///< files; empty where the view has none
    std::string unknown;        ///< where its depth is unknown, if that can be: what its note says
    double worstDepth = 0;      ///< largest error of the depth's code, scene units
    bool depthClamped = false;  ///< some depth lay beyond the planes: that is the error then
    bool linear = false;        ///< colour was, and is 8-bit sRGB now
    bool clamped = false;       ///< linear colour above 1 was cut
    bool unmeasuredLost = false;  ///< colours without a depth
    bool coverageLost = false;
    bool splatsCoarse = false;  ///< SplatSteps::tooCoarse() of their codes
    /// Of planes of video, which have no alpha, where coverage is lost: a hash of it; else 0.
    std::size_t coverage = 0;
};

/// Whether depth that a code has with this error at most, scene units, lay beyond its planes:
/// rounding makes half a step, and floats a little.
[[nodiscard]] bool isBeyondPlanes(double worstDepth, const DepthCode& code);

/// The largest error of depth that is rounded to codes, for a note.
class DepthLoss {
  public:
    /// Of a view whose depth is written in `bits`, with ViewImages::worstDepth of what lay between
    /// the planes. `ownStep`: scene
    /// units between codes of its bits and its own planes; where a film has one range for all
    /// frames, depth may be further off than half of it.
    void add(const ViewHeader& view, int bits, double worstDepth, double ownStep);
    /// Adds what was added to another.
    void add(const DepthLoss& other);
    /// Says how far off depth is, if some is.
    void note(Job& job) const;

  private:
    double worst_ = 0;  ///< scene units
    int bits_ = 0;
};

/// What pictures of MPEG-4 lose of the views that are added, for notes.
struct PictureLoss {
    std::vector<DepthLoss> depth;  ///< of each view
    /// Of depth beyond the planes; 0: there was none.
    double worstClamped = 0;
    bool linear = false, clamped = false, coverage = false, splats = false;
    /// DepthLoss::add()'s of each view, where the views have the range of a film; else empty.
    std::vector<double> ownSteps;

    /// Of view number `i`, whose depth is written in `bits`.
    void add(std::size_t i, const ViewHeader& view, int bits, const ViewImages& images);
    void note(const SceneWriteOptions& options, Job& job) const;
};

/// Encodes the images of a view. `longestSplat` above 0: the range of the splats, of a sequence
/// whose frames share it; else the view's own. Errors: a principal point that padding cannot
/// centre, planes that do not fit floats, a depth that is NaN or below 0; those of the image
/// writers.
[[nodiscard]] Result<ViewImages> encodeView(const ReferenceView& view,
                                            const SceneWriteOptions& options, const Limits& limits,
                                            float longestSplat = 0);

/// Whether a DepthImage may have it: angles, or the sides of a window.
[[nodiscard]] bool isFieldOfView(glm::vec2 fov, bool orthographic);
/// What is expected of it, for messages.
[[nodiscard]] std::string_view fieldOfViewRule(bool orthographic);

/// Position, orientation and fieldOfView of a DepthImage. Errors (unsupported): they do not fit
/// floats.
[[nodiscard]] Result<void> setCamera(Node& node, const Camera& camera);

/// Whether the view becomes a DepthImageV2.
[[nodiscard]] bool isWrittenAsV2(const ReferenceView& view, const SceneWriteOptions& options);
/// 8 or 16.
[[nodiscard]] int writtenDepthBits(const ViewHeader& view, const SceneWriteOptions& options);
/// The largest component of the splats' half axes; 1 where there is none.
[[nodiscard]] float longestSplatOf(const ReferenceView& view);

}  // namespace stx::mpeg4

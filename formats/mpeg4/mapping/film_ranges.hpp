#pragma once

#include <limits>
#include <vector>

#include "formats/mpeg4/mapping/mapping.hpp"
#include "formats/mpeg4/mapping/view_notes.hpp"

namespace stx::mpeg4 {

/// What must not change of a view from frame to frame.
struct ViewRange {
    double nearPlane = std::numeric_limits<double>::infinity(), farPlane = 0;
    int depthBits = 8;
    float longestSplat = 0;
    bool normals = false, splats = false;
    bool everUnknown = false;  ///< NoDepth::unknown, of its frames
    bool everEmpty = false;
    bool everPruned = false;
    bool everWhole = false;  ///< neither pruned nor NoDepth::unknown
    UnknownPixels unknown;   ///< of films whose pictures have no alpha
    Refined refined;         ///< steps of the first frame, and the largest doubt
};

/// Whether pictures that change keep their alpha.
[[nodiscard]] bool keepsAlpha(const SceneWriteOptions& options);

/// The ranges of the views of a film, and its bounds, by all of its frames.
class FilmRanges {
  public:
    explicit FilmRanges(const SceneWriteOptions& options) : options_(options) {}

    /// Widens all by a frame, whose pixels are read where its headers do not tell all. Errors:
    /// (unsupported) what later frames cannot have otherwise than the first, or what pictures
    /// without alpha cannot hold; reading.
    [[nodiscard]] Result<void> add(const ViewTable& table, Job& job);
    /// When all frames are added, of which this is the first. Notes say what is in all that is in
    /// some.
    [[nodiscard]] std::vector<ViewRange> finish(const Bundle& first, Job& job);
    [[nodiscard]] const Bounds& bounds() const { return bounds_; }

  private:
    [[nodiscard]] Result<void> addView(ViewRange& range, const ViewHeader& view,
                                       const ViewImageKinds& kinds, bool first) const;

    const SceneWriteOptions& options_;
    std::vector<ViewRange> ranges_;
    Bounds bounds_;
};

}  // namespace stx::mpeg4

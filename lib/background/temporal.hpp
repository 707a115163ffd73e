#pragma once

#include <cstdint>
#include <memory>

#include "lib/base/job.hpp"
#include "lib/model/reference_view.hpp"

namespace stx {

/// What a still camera sees once everything that moves is taken away.
struct BackgroundModel {
    /// Colour and depth of the background, at the mean light of the frames; marked as
    /// ReferenceView::background. Pixels where it was never seen are empty: alpha 0, kNoDepth.
    ReferenceView view;
    Image<float> confidence;  ///< share of the frames that show it, 0..1; 0 = never seen
    Image<float> lastSeen;    ///< time of the last frame that shows it; 0 where never seen
    int frames = 0;           ///< that it was made of
};

struct TemporalBackgroundSettings {
    /// Share of the frames that must show a surface before it is believed; two frames at least.
    double support = 0.04;
    int keyViews = 8;  ///< poses of moving cameras that backgrounds are made for, at most
    std::uint64_t maxMemoryBytes = 0;  ///< 0 = what the job allows
};

/// Remembers what moving things uncover: the background of one still camera out of the frames of
/// its video with depth (after WO 2009/091563; Sun et al. 2012 keep a mode of colours where this
/// keeps layers of depth). Depth decides: of the layers that a pixel showed, the background is the
/// farthest that is well supported, so people who stand still for most of the time are not taken
/// in. Its colour is the middle of samples that were taken when nothing moved there, without those
/// in shadow.
///
/// Frames are streamed, none is kept: kBytesPerPixel of memory, whatever the length. With less
/// memory the picture is worked on in bands of rows, and the frames are streamed once for each:
///
///     STX_TRY(auto model, TemporalBackground::start(firstFrame, {}, job));
///     for (int pass = 0; pass < model.passes(); ++pass) {
///         for (each frame, in order) STX_CHECK(model.add(frame, time, job));
///         STX_CHECK(model.endPass(job));
///     }
///     STX_TRY(BackgroundModel background, model.finish(job));
///
/// The same bytes on any number of threads and in any number of passes.
class TemporalBackground {
  public:
    /// Memory of a pixel while frames are streamed: of 8-bit colour, and of linear light.
    static constexpr std::uint64_t kBytesPerPixel = 204, kBytesPerLinearPixel = 336;

    /// For frames of the size, camera and kind of colour of `first`, which is not yet counted.
    /// Errors: a view that fails checkHeader(), more memory for one row than the job allows.
    [[nodiscard]] static Result<TemporalBackground> start(
        const ReferenceView& first, const TemporalBackgroundSettings& settings, Job& job);
    TemporalBackground(TemporalBackground&&) noexcept;
    TemporalBackground& operator=(TemporalBackground&&) noexcept;
    ~TemporalBackground();

    /// How often the frames must be streamed.
    [[nodiscard]] int passes() const;
    /// One frame, of a time in seconds after the one before. Errors (invalidInput): another size,
    /// a camera that moved, a time that does not grow, linear and coded colours mixed.
    [[nodiscard]] Result<void> add(const ReferenceView& frame, double time, Job& job);
    /// After the last frame of a pass. Errors (invalidInput): a pass without frames, or with
    /// another number of them than the one before.
    [[nodiscard]] Result<void> endPass(Job& job);
    /// After the last pass. The view has the first frame's name, camera and depth bits.
    [[nodiscard]] Result<BackgroundModel> finish(Job& job);

  private:
    struct Impl;
    explicit TemporalBackground(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

}  // namespace stx

#pragma once

#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "formats/files/file_spool.hpp"
#include "formats/stx/stx.hpp"
#include "lib/model/sequence.hpp"
#include "lib/registration/camera_moves.hpp"

namespace stx::tools {

/// When the pictures of `stx render` are taken, as the command line says it.
struct TimeOptions {
    std::optional<double> time;  ///< seconds by the input's clock
    std::string times;           ///< "A:B[:STEP]" in such seconds, "all", or "cameras"

    [[nodiscard]] bool any() const { return time.has_value() || !times.empty(); }
};

/// The frame of --time, the first where it is not given; a time outside the film is noted, and one
/// of what does not move. Errors (usage): none of a film for what is of one moment only: `whatIs`,
/// as in "points are", else null.
[[nodiscard]] Result<std::size_t> momentOf(const std::optional<double>& time,
                                           const Timeline& timeline, const char* whatIs,
                                           const std::string& input, Job& job);

/// The times that are asked for, ascending; at least one. `all` (and `cameras`, whose
/// times are elsewhere): every frame; A:B without STEP:
/// every frame from A to B; with it: A, A + STEP, … up to B. Errors (usage): a text of another
/// form, a step of 0 or less, more than a million pictures, no frame between.
[[nodiscard]] Result<std::vector<double>> timesOf(const TimeOptions& options,
                                                  const Timeline& timeline);

/// The rate of a stream of all frames, as a fraction. A stream has one rate: where frames (`what`,
/// as in "frames of the film") do not last equally long it is the mean, with a note.
[[nodiscard]] std::pair<int, int> streamRateOf(const Timeline& line, const char* what, Job& job);

/// Renderers of the frames of a sequence, one after another; the next frame is read while one is
/// drawn. Frames that memory does not hold are drawn from files, one at a time (viewsToDraw()).
class MovingPictures {
  public:
    /// Files are made in `folder`. `job` must outlive this.
    MovingPictures(std::unique_ptr<Sequence> frames, RenderSettings settings, Backend backend,
                   int device, std::filesystem::path folder, Job& job);
    ~MovingPictures();

    [[nodiscard]] const Timeline& timeline() const { return frames_->timeline(); }
    /// The cameras of the reference views of the frame whose renderer is here.
    [[nodiscard]] const std::vector<Camera>& views() const { return views_; }
    /// The same as movedCameras().
    [[nodiscard]] const std::vector<MovedCamera>& moved() const { return moved_; }
    [[nodiscard]] std::int64_t points() const { return points_; }
    [[nodiscard]] const Bounds& bounds() const { return bounds_; }
    [[nodiscard]] glm::dvec3 origin() const { return origin_; }
    /// Light comes from the environment that is given, else from the frames' own; at() fails
    /// (usage) where there is none.
    void lightByEnvironment() { light_ = true; }
    /// Whether that frame is shown before an environment.
    [[nodiscard]] bool environment() const { return environment_; }

    /// The renderer of the frame of a time, which lives until the next call. `next`: the time that
    /// is asked for after it. Errors: those of the frame and of rendererOf().
    [[nodiscard]] Result<Renderer*> at(double time, std::optional<double> next);

  private:
    /// The views of a frame, in memory, or in a spool where that does not hold them.
    struct FrameViews {
        std::unique_ptr<FileSpool> spool;  ///< may be null
        Bundle bundle;
    };
    [[nodiscard]] Result<FrameViews> viewsOf(std::size_t frame);
    [[nodiscard]] Result<FrameViews> read(std::size_t frame, Job& job);

    std::unique_ptr<Sequence> frames_;
    RenderSettings settings_;
    Backend backend_;
    int device_;
    std::filesystem::path folder_;
    Job& job_;
    Job ahead_;          ///< of the frame that is read beside the drawing
    bool fits_ = false;  ///< a frame has been in memory: all have views of the same sizes
    std::future<Result<FrameViews>> coming_;
    std::optional<std::size_t> comingFrame_, frame_;
    /// The frame that is drawn, where it is in a spool. Not assigned to: the old bundle would
    /// outlive its spool.
    std::optional<FrameViews> spooled_;
    std::unique_ptr<Renderer> renderer_;
    std::vector<Camera> views_;
    std::vector<MovedCamera> moved_;
    std::shared_ptr<const Environment> own_;  ///< of the frames
    std::shared_ptr<const EnvironmentMap> ownMap_;
    std::shared_ptr<const EnvironmentLight> ownLight_;
    bool environment_ = false;
    bool light_ = false;
    std::int64_t points_ = 0;
    Bounds bounds_;
    glm::dvec3 origin_{0.0};
};

}  // namespace stx::tools

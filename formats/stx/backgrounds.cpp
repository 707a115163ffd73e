#include "formats/stx/stx.hpp"
#include "formats/video/video_frames.hpp"
#include "lib/background/sequence_background.hpp"

namespace stx {

Result<std::unique_ptr<Sequence>> background(std::unique_ptr<Sequence> frames,
                                             const BackgroundSettings& settings, Job& job) {
    if (!(settings.support > 0 && settings.support <= 1))
        return fail(ErrorCode::usage, "support is {:g}; a share above 0, at most 1 is expected",
                    settings.support);
    if (settings.keyViews < 1 || settings.keyViews > 64)
        return fail(ErrorCode::usage, "keyViews is {}; 1 to 64 is expected", settings.keyViews);
    if (!frames->timeline().moves())
        return fail(ErrorCode::invalidInput,
                    "it has one frame; a background is found in what others uncover");
    TemporalBackgroundSettings temporal;
    temporal.support = settings.support;
    temporal.keyViews = settings.keyViews;
    STX_TRY(auto found,
            rememberBackgrounds(
                frames->timeline().times,
                [&](std::size_t i, Job& part) { return frames->frame(i, part); }, temporal, job));
    if (found.empty())
        return fail(ErrorCode::invalidInput,
                    "nothing that stays was seen by two frames or more; a background is made of "
                    "what stays");
    return withBackgrounds(std::move(frames), std::move(found));
}

Result<StillBackground> background(const std::vector<std::filesystem::path>& inputs,
                                   const StillSettings& settings, Job& job) {
    STX_TRY(const auto frames, openVideoFrames(inputs, job));
    return stillBackground(*frames, settings, job);
}

}  // namespace stx

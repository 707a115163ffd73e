#include "lib/background/still.hpp"

#include "lib/background/still_methods.hpp"

namespace stx {
namespace {

Result<void> checkStillSettings(const StillSettings& s) {
    if (s.frames != 0 && s.frames < 2)
        return fail(ErrorCode::usage, "{} frames are asked for; at least 2 are needed", s.frames);
    if (s.quietest < 1 || s.quietest > 255)
        return fail(ErrorCode::usage,
                    "{} of the quietest frames are asked for; 1 to 255 are possible", s.quietest);
    if (s.windowDivisor < 1)
        return fail(ErrorCode::usage, "the window's divisor is {}; at least 1 is expected",
                    s.windowDivisor);
    if (!(s.adaptive >= 0 && s.adaptive <= 1e6))
        return fail(ErrorCode::usage, "the adaptive ratio is {}; 0 to 1000000 is expected",
                    s.adaptive);
    return {};
}

/// Frames of somebody else, which may not be what they say.
class CheckedFrames final : public StillFrames {
  public:
    explicit CheckedFrames(StillFrames& frames) : frames_(frames) {}
    [[nodiscard]] glm::ivec2 size() const override { return frames_.size(); }
    [[nodiscard]] int count() const override { return frames_.count(); }
    [[nodiscard]] Result<std::shared_ptr<const Rgba8Image>> frame(int k) override {
        STX_TRY(auto picture, frames_.frame(k));
        if (!picture) return fail(ErrorCode::invalidInput, "frame {} is not there", k);
        if (picture->size() != size())
            return fail(ErrorCode::invalidInput, "frame {} is {}x{}; {}x{} is expected", k,
                        picture->width(), picture->height(), size().x, size().y);
        return picture;
    }
    [[nodiscard]] int shownFor(int k) const override { return frames_.shownFor(k); }

  private:
    StillFrames& frames_;
};

}  // namespace

bool isSound(const StillFrames& frames, std::span<const int> which, std::size_t i) {
    return i == 0 || frames.shownFor(which[i]) != frames.shownFor(which[i - 1]);
}

int soundFrames(const StillFrames& frames, std::span<const int> which) {
    int sound = 0;
    for (std::size_t i = 0; i < which.size(); ++i) sound += isSound(frames, which, i);
    return sound;
}

Result<StillBackground> stillBackground(StillFrames& given, const StillSettings& settings,
                                        Job& job) {
    STX_CHECK(checkStillSettings(settings));
    CheckedFrames frames(given);
    if (frames.size().x < 1 || frames.size().y < 1)
        return fail(ErrorCode::invalidInput, "frames of {}x{} pixels; 1x1 is the least",
                    frames.size().x, frames.size().y);
    if (frames.count() < 2)
        return fail(ErrorCode::invalidInput,
                    "a background is made of at least 2 frames, and {} is here", frames.count());
    const bool n2pg = settings.method == StillMethod::n2pg;
    const auto which = spreadFrames(frames.count(), settings.frames);
    // Counts of values have 16 bits.
    constexpr std::size_t kMostFrames = 65535;
    if (!n2pg && which.size() > kMostFrames)
        return fail(ErrorCode::usage,
                    "{} frames are here, and at most {} are possible; take fewer, "
                    "spread evenly, with --frames",
                    which.size(), kMostFrames);
    return n2pg ? n2pgBackground(frames, which, job)
                : selectBackground(frames, which, settings, job);
}

}  // namespace stx

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

}  // namespace

Result<StillBackground> stillBackground(StillFrames& frames, const StillSettings& settings,
                                        Job& job) {
    STX_CHECK(checkStillSettings(settings));
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

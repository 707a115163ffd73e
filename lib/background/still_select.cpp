#include <algorithm>
#include <limits>
#include <optional>

#include "lib/background/still_methods.hpp"
#include "lib/background/still_motion.hpp"
#include "lib/base/parallel.hpp"
#include "lib/model/peak_memory.hpp"
#include "lib/model/same_pictures.hpp"

namespace stx {
namespace {

/// Frames that are looked at together: what is kept of a pixel is touched once for all of them.
constexpr std::size_t kFramesAtOnce = 16;
/// Pixels of a piece of a parallel loop.
constexpr std::int64_t kPixelsAtOnce = 2048;

/// The share of pixels whose quietest frames have at most the film's noise; the rest is edges that
/// tremble. tests/bench/backgrounds_and_panoramas.md has what others give.
constexpr double kNoiseShare = 0.75;
/// Of a pixel with fewer frames than are kept.
constexpr auto kNone = std::numeric_limits<std::uint32_t>::max();

/// How often each value of one pixel occurred.
struct ValueCounts {
    std::uint16_t counts[3][256];
    std::uint16_t frames;

    void add(glm::u8vec4 p) {
        if (!isSeen(p)) return;
        ++counts[0][p.r];
        ++counts[1][p.g];
        ++counts[2][p.b];
        ++frames;
    }
    /// Of an even number the mean of the two in the middle, rounded up.
    [[nodiscard]] std::uint8_t median(int channel) const {
        const auto& values = counts[channel];
        const int low = (frames - 1) / 2, high = frames / 2;
        int seen = 0, v = 0;
        while ((seen += values[v]) <= low) ++v;
        const int first = v;
        while (seen <= high) seen += values[++v];
        return static_cast<std::uint8_t>((first + v + 1) / 2);
    }
    /// Frames within kStillAgrees of a value.
    [[nodiscard]] int near(int channel, int value) const {
        int n = 0;
        const int last = std::min(255, value + kStillAgrees);
        for (int v = std::max(0, value - kStillAgrees); v <= last; ++v) n += counts[channel][v];
        return n;
    }
};
/// A frame's part of a band of rows.
struct BandFrame {
    std::vector<glm::u8vec4> colour;
    LumaRows luma;
    std::vector<std::uint32_t> motion;
    bool sound = true;
};
// With the frame before those.
static_assert(sizeof(ValueCounts) + (kFramesAtOnce + 1) * 10 <= kSelectBytesPerPixel);

/// Makes the background of a band of rows.
class BandSelector {
  public:
    BandSelector(StillFrames& frames, std::span<const int> which, const StillSettings& settings,
                 Job& job)
        : frames_(frames),
          which_(which),
          settings_(settings),
          job_(job),
          window_(frames.size().x, frames.size().y, settings.windowDivisor,
                  settings.drift ? MotionScore::gradient : MotionScore::luma),
          hashes_(which.size()) {}

    /// Looks for what the motion of the first frame is measured by. Before the first find().
    [[nodiscard]] Result<void> begin() {
        STX_TRY(const auto first, frames_.frame(which_[0]));
        for (second_ = 1; second_ + 1 < which_.size(); ++second_) {
            STX_CHECK(job_.checkCancelled());
            STX_TRY(const auto other, frames_.frame(which_[second_]));
            if (!(*other == *first)) break;
        }
        return {};
    }

    /// Of a band of rows, the largest motion that a frame may have to be kept.
    [[nodiscard]] Result<void> find(int first, int rows) {
        beginBand(first, rows);
        return findQuietest();
    }

    /// After the last find(): where the quietest frames move less than the film's noise, all
    /// frames that do are kept.
    void keepNoise() {
        auto means = quietestMeans_;
        const auto noise =
            means.begin() + static_cast<std::ptrdiff_t>(kNoiseShare * (means.size() - 1));
        std::nth_element(means.begin(), noise, means.end());
        const int width = frames_.size().x;
        parallelFor(0, largest_.size(), kPixelsAtOnce, [&](std::size_t p) {
            const int x = static_cast<int>(p) % width, y = static_cast<int>(p) / width;
            keep(p, double{*noise} * window_.pixels(x, y));
        });
    }

    /// The background of a band of rows.
    [[nodiscard]] Result<void> make(int first, int rows, StillBackground& to) {
        beginBand(first, rows);
        values_.assign(pixels_, ValueCounts{});
        STX_CHECK(forBlocks([&](std::size_t n) { count(n); }));
        write(to);
        return {};
    }

    std::int64_t steps = 0, allSteps = 0;  ///< of the progress, in frames

  private:
    /// Calls body(n) with the next n frames of the band in block_, in their order.
    Result<void> forBlocks(const std::function<void(std::size_t)>& body) {
        block_.resize(std::min(kFramesAtOnce, which_.size()));
        BandFrame before;
        for (std::size_t from = 0; from < which_.size(); from += block_.size()) {
            STX_CHECK(job_.checkCancelled());
            const std::size_t n = std::min(block_.size(), which_.size() - from);
            STX_CHECK(take(from, n));
            if (moving()) STX_CHECK(measure(from, n, before));
            body(n);
            std::swap(before, block_[n - 1]);
            steps += static_cast<std::int64_t>(n);
            job_.progress(steps, allSteps, "looking at frames");
        }
        return {};
    }

    [[nodiscard]] bool moving() const { return settings_.method == StillMethod::select; }

    /// The n frames of the band from which_[from] on.
    Result<void> take(std::size_t from, std::size_t n) {
        STX_CHECK(takeFrames(frames_, which_.subspan(from, n), job_.limits.maxMemoryBytes / 4,
                             [&](std::size_t i, const Rgba8Image& picture) {
                                 BandFrame& f = block_[i];
                                 const auto* at = picture.data() + offset_;
                                 f.colour.assign(at, at + pixels_);
                                 if (!moving()) return;
                                 takeLuma(picture, f.luma);
                                 auto& hash = hashes_[from + i];
                                 if (!hash) hash = hashOf(std::as_bytes(picture.pixels()));
                             }));
        for (std::size_t i = 0; i < n; ++i) block_[i].sound = isSound(frames_, which_, from + i);
        return {};
    }

    void takeLuma(const Rgba8Image& picture, LumaRows& to) const {
        to.take(picture, window_.firstNeeded(first_), window_.rowsNeeded(first_, rows_));
    }

    /// Whether a frame shows what the one before does: a film that stood still, or was made for
    /// more frames in a second.
    [[nodiscard]] bool isRepeated(std::size_t k) const {
        return k > 0 && hashes_[k] == hashes_[k - 1];
    }

    /// What moves in the block's frames.
    Result<void> measure(std::size_t from, std::size_t n, const BandFrame& before) {
        const auto previous = [&](std::size_t i) -> const BandFrame& {
            return i == 0 ? before : block_[i - 1];
        };
        parallelFor(0, n, [&](std::size_t i) {
            BandFrame& f = block_[i];
            f.motion.resize(pixels_);
            if (from + i > 0 && !isRepeated(from + i))
                window_.quantities(previous(i).luma, f.luma, first_, rows_, f.motion);
        });
        // Before the first frame there is none.
        if (from == 0) {
            LumaRows second;
            STX_TRY(const auto picture, frames_.frame(which_[second_]));
            takeLuma(*picture, second);
            window_.quantities(block_[0].luma, second, first_, rows_, block_[0].motion);
        }
        // Nothing moves in a repeated frame, which yet does not show that what is there stays.
        for (std::size_t i = 0; i < n; ++i)
            if (isRepeated(from + i)) block_[i].motion = previous(i).motion;
        return {};
    }

    void beginBand(int first, int rows) {
        first_ = first;
        rows_ = rows;
        pixels_ = static_cast<std::size_t>(rows) * frames_.size().x;
        offset_ = static_cast<std::size_t>(first) * frames_.size().x;
    }

    Result<void> findQuietest() {
        const auto kept = std::min(static_cast<std::size_t>(settings_.quietest), which_.size());
        const auto all = static_cast<std::size_t>(frames_.size().x) * frames_.size().y;
        largest_.resize(all);
        quietestMeans_.resize(all);
        quietest_.assign(pixels_ * kept, kNone);
        STX_CHECK(forBlocks([&](std::size_t n) {
            forPixels([&](std::size_t p) {
                std::uint32_t* const first = &quietest_[p * kept];
                for (std::size_t i = 0; i < n; ++i) {
                    const std::uint32_t motion = block_[i].motion[p];
                    std::uint32_t* at = first + kept - 1;
                    if (motion >= *at || !block_[i].sound || !isSeen(block_[i].colour[p])) continue;
                    for (; at > first && at[-1] > motion; --at) *at = at[-1];
                    *at = motion;
                }
            });
        }));
        forPixels([&](std::size_t p) {
            const std::uint32_t* const first = &quietest_[p * kept];
            double sum = 0, n = 0;
            for (std::size_t i = 0; i < kept && first[i] != kNone; ++i, ++n) sum += first[i];
            const double mean = n > 0 ? sum / n : 0;
            const int x = static_cast<int>(p) % frames_.size().x;
            const int y = first_ + static_cast<int>(p) / frames_.size().x;
            quietestMeans_[offset_ + p] = static_cast<float>(mean / window_.pixels(x, y));
            largest_[offset_ + p] = first[kept - 1];
            keep(offset_ + p, mean);
        });
        return {};
    }

    /// Keeps the frames of a pixel whose motion is not beyond the adaptive share of `motion`.
    void keep(std::size_t p, double motion) {
        const double limit = std::min(settings_.adaptive * motion, double{kNone});
        largest_[p] = std::max(largest_[p], static_cast<std::uint32_t>(limit));
    }

    void count(std::size_t n) {
        forPixels([&](std::size_t p) {
            for (std::size_t i = 0; i < n; ++i)
                if (block_[i].sound &&
                    (largest_.empty() || block_[i].motion[p] <= largest_[offset_ + p]))
                    values_[p].add(block_[i].colour[p]);
        });
    }

    void write(StillBackground& to) const {
        forPixels([&](std::size_t p) {
            const ValueCounts& v = values_[p];
            if (v.frames == 0) return;
            glm::u8vec4 colour(0, 0, 0, 255);
            int near = v.frames;
            for (int c = 0; c < 3; ++c) {
                colour[c] = v.median(c);
                near = std::min(near, v.near(c, colour[c]));
            }
            to.colour.pixels()[offset_ + p] = colour;
            to.confidence.pixels()[offset_ + p] =
                static_cast<std::uint8_t>((255 * near + v.frames / 2) / v.frames);
        });
    }

    template <class Body>
    void forPixels(const Body& body) const {
        parallelFor(0, pixels_, kPixelsAtOnce, [&](std::size_t p) { body(p); });
    }

    StillFrames& frames_;
    std::span<const int> which_;
    const StillSettings& settings_;
    Job& job_;
    MotionWindow window_;
    std::vector<std::optional<std::size_t>> hashes_;  ///< of the pictures, once they were read
    std::size_t second_ = 1;  ///< the first frame that shows something else than the first one
    int first_ = 0, rows_ = 0;
    std::size_t pixels_ = 0, offset_ = 0;  ///< of the band; of its first in the picture
    std::vector<BandFrame> block_;
    std::vector<std::uint32_t> quietest_;  ///< motion of the band's quietest frames, rising
    // Of the whole picture:
    std::vector<std::uint32_t> largest_;  ///< empty: every frame is kept
    std::vector<float> quietestMeans_;    ///< mean score of a pixel of a window
    std::vector<ValueCounts> values_;
};

}  // namespace

Result<StillBackground> selectBackground(StillFrames& frames, std::span<const int> which,
                                         const StillSettings& settings, Job& job) {
    const auto size = frames.size();
    // What comes out, and one frame that is being read; the rest adapts to what is left.
    STX_CHECK(checkPeak(peak::kBackground, static_cast<std::uint64_t>(size.x) * size.y, 0, 0,
                        job.limits));
    const std::uint64_t frameBytes = std::uint64_t{sizeof(glm::u8vec4)} * size.x * size.y;
    const std::uint64_t keptBytes = job.limits.maxMemoryBytes / 2;
    // Frames that stay in memory cost little to look at again: then bands are small enough for a
    // processor's caches. Else they are as large as memory allows.
    constexpr std::uint64_t kSmall = 32ull << 20, kLarge = 1ull << 30;
    const bool all = frameBytes * which.size() <= keptBytes;
    const std::uint64_t most = job.limits.maxMemoryBytes / 4;
    const std::uint64_t rowBytes = size.x * (kSelectBytesPerPixel + 4ull * settings.quietest);
    if (rowBytes > most)
        return fail(ErrorCode::failed,
                    "a row of {} pixels takes {} bytes, but a quarter of --max-memory is {}; raise "
                    "it",
                    size.x, rowBytes, most);
    const std::uint64_t room = std::max(rowBytes, std::min(all ? kSmall : kLarge, most));
    const int rows = static_cast<int>(std::min<std::uint64_t>(room / rowBytes, size.y));
    const int bands = (size.y + rows - 1) / rows;
    const int passes = bands * (settings.method == StillMethod::select ? 2 : 1);
    KeptFrames kept(frames, passes > 1 ? keptBytes : 0);
    StillBackground out;
    out.colour = Rgba8Image(size.x, size.y);
    out.confidence = Image<std::uint8_t>(size.x, size.y);
    BandSelector selector(kept, which, settings, job);
    selector.allSteps = static_cast<std::int64_t>(which.size()) * passes;
    const auto forBands = [&](const auto& body) -> Result<void> {
        for (int band = 0; band < bands; ++band) {
            // Of equal height, but for one row.
            const int first = static_cast<int>(std::int64_t{size.y} * band / bands);
            const int end = static_cast<int>(std::int64_t{size.y} * (band + 1) / bands);
            STX_CHECK(body(first, end - first));
        }
        return {};
    };
    if (settings.method == StillMethod::select) {
        STX_CHECK(selector.begin());
        STX_CHECK(forBands([&](int first, int count) { return selector.find(first, count); }));
        selector.keepNoise();
    }
    STX_CHECK(forBands([&](int first, int count) { return selector.make(first, count, out); }));
    out.framesUsed = soundFrames(kept, which);
    return out;
}

}  // namespace stx

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <mutex>

#include "lib/background/still_methods.hpp"
#include "lib/base/parallel.hpp"

namespace stx {
namespace {

/// A static pixel goes 1 / (times it was static + 2) of the way towards the new frame: a mean of
/// all of them, at least 0.05, so that it follows the light. Of 65536.
constexpr int kLeastShare = 3277;
/// Times in a row that what covers the background must be steady to replace it, at least; as many
/// as the background itself was static, if that is more.
constexpr int kSteadyTimes = 3;
/// Fraction bits of the background's colours: differences of two fit into 16 bits.
constexpr int kColourBits = 7;
/// Of the threshold: as many spreads above the median, and the least spread.
constexpr double kSpreads = 3.0 * 1.4826, kLeastSpread = 0.5;
/// The largest difference of two gradients: 2 * (255 + 255).
constexpr int kLargestDifference = 1020;
/// Rows of a piece of a parallel loop.
constexpr std::int64_t kRowsAtOnce = 32;

using Counts = std::array<std::uint32_t, kLargestDifference + 1>;

/// The least value that at least half of `total` counted values do not exceed.
int medianOf(const Counts& counts, std::uint64_t total) {
    std::uint64_t seen = 0;
    int v = 0;
    while ((seen += counts[v]) * 2 < total) ++v;
    return v;
}

/// med(D) + 3 * 1.4826 * max(MAD(D), 0.5), in whole numbers (D has no others).
int stabilityThreshold(const Counts& counts, std::uint64_t total) {
    const int median = medianOf(counts, total);
    Counts deviations{};
    for (int v = 0; v <= kLargestDifference; ++v) deviations[std::abs(v - median)] += counts[v];
    const double spread = std::max<double>(medianOf(deviations, total), kLeastSpread);
    return median + static_cast<int>(std::floor(kSpreads * spread));
}

/// |Dx| + |Dy| between the N2PG of two rows of luma; `below` are the rows under them.
void gradientDifference(const std::uint8_t* a, const std::uint8_t* aBelow, const std::uint8_t* b,
                        const std::uint8_t* bBelow, int width, std::uint16_t* to) {
    // In 16 bits, which the compiler then takes eight at a time.
    const auto change = [](std::uint8_t p, std::uint8_t q, std::int16_t here) {
        return static_cast<std::uint16_t>(std::abs(static_cast<std::int16_t>(p - q - here)));
    };
    const int last = width - 1;
    for (int x = 0; x < last; ++x) {
        const auto here = static_cast<std::int16_t>(a[x] - b[x]);
        to[x] = static_cast<std::uint16_t>(change(a[x + 1], b[x + 1], here) +
                                           change(aBelow[x], bBelow[x], here));
    }
    to[last] = change(aBelow[last], bBelow[last], static_cast<std::int16_t>(a[last] - b[last]));
}

/// Shares of a frame by the times that a pixel was static.
std::array<std::int16_t, 256> frameShares() {
    std::array<std::int16_t, 256> shares{};
    for (int n = 0; n < 256; ++n)
        shares[n] =
            static_cast<std::int16_t>(std::min(32767, std::max(kLeastShare, 65536 / (n + 2))));
    return shares;
}

/// The model of N2PG: 13 bytes a pixel.
class N2pgModel {
  public:
    explicit N2pgModel(glm::ivec2 size)
        : width_(size.x),
          height_(size.y),
          background_(count() * 3),
          backgroundLuma_(count()),
          luma_(count()),
          before_(count()),
          steadyFor_(count()),
          staticFor_(count()),
          difference_(count()) {}

    /// The first background.
    void begin(const Rgba8Image& frame) {
        forRows([&](int y, Row& row) {
            row.take(frame, y);
            for (int c = 0; c < 3; ++c)
                std::copy(row.colour[c].begin(), row.colour[c].end(), background(y, c));
            row.luma(&luma_[at(y)]);
            row.luma(&backgroundLuma_[at(y)]);
        });
    }

    /// An update frame.
    void update(const Rgba8Image& frame) {
        std::swap(before_, luma_);
        forRows([&](int y, Row& row) {
            row.take(frame, y);
            row.luma(&luma_[at(y)]);
        });
        const int threshold = compare();
        forRows([&](int y, Row& row) {
            row.take(frame, y);
            updateRow(row, y, threshold);
        });
    }

    void write(int frames, StillBackground& to) const {
        const int most = std::clamp(frames - 1, 1, 255);
        forRows([&](int y, Row&) {
            for (int x = 0; x < width_; ++x) {
                glm::u8vec4 colour(0, 0, 0, 255);
                for (int c = 0; c < 3; ++c)
                    colour[c] = static_cast<std::uint8_t>(
                        (background(y, c)[x] + (1 << (kColourBits - 1))) >> kColourBits);
                to.colour.at(x, y) = colour;
                const int times = staticFor_[at(y) + static_cast<std::size_t>(x)];
                to.confidence.at(x, y) =
                    static_cast<std::uint8_t>(255 * std::min(times, most) / most);
            }
        });
    }

  private:
    /// A row of a frame, and what is worked out for it.
    struct Row {
        explicit Row(int width)
            : change(static_cast<std::size_t>(width)),
              share(change.size()),
              replace(change.size()) {
            for (auto& c : colour) c.resize(change.size());
        }
        void take(const Rgba8Image& frame, int y) {
            const glm::u8vec4* const from = frame.row(y).data();
            for (std::size_t x = 0; x < change.size(); ++x) {
                for (int c = 0; c < 3; ++c)
                    colour[c][x] = static_cast<std::int16_t>(from[x][c] << kColourBits);
            }
        }
        /// stillLuma() of it.
        void luma(std::uint8_t* to) const {
            lumaOf(colour[0].data(), colour[1].data(), colour[2].data(), to, change.size());
        }
        static void lumaOf(const std::int16_t* r, const std::int16_t* g, const std::int16_t* b,
                           std::uint8_t* to, std::size_t width) {
            for (std::size_t x = 0; x < width; ++x) {
                const auto level = [](std::int16_t v) {
                    return static_cast<std::uint16_t>(static_cast<std::uint16_t>(v) >> kColourBits);
                };
                const auto sum = static_cast<std::uint16_t>(77 * level(r[x]) + 150 * level(g[x]) +
                                                            29 * level(b[x]) + 128);
                to[x] = static_cast<std::uint8_t>(sum >> 8);
            }
        }
        std::vector<std::int16_t> colour[3];       ///< levels * 128
        std::vector<std::uint16_t> change;         ///< of the N2PG since the frame before
        std::vector<std::int16_t> share, replace;  ///< of this frame; all bits set: it replaces
    };

    [[nodiscard]] std::size_t count() const { return static_cast<std::size_t>(width_) * height_; }
    [[nodiscard]] std::size_t at(int y) const { return static_cast<std::size_t>(y) * width_; }
    [[nodiscard]] std::size_t below(int y) const { return at(std::min(y + 1, height_ - 1)); }
    [[nodiscard]] std::int16_t* background(int y, int c) {
        return &background_[at(y) * 3 + static_cast<std::size_t>(c) * width_];
    }
    [[nodiscard]] const std::int16_t* background(int y, int c) const {
        return &background_[at(y) * 3 + static_cast<std::size_t>(c) * width_];
    }

    /// How the frame differs from the background, in difference_; gives the threshold.
    int compare() {
        Counts counts{};
        std::mutex mutex;
        parallelForBlocks(0, height_, kRowsAtOnce, [&](std::int64_t from, std::int64_t to) {
            // Most pixels differ by the same few levels: one table would wait for itself.
            std::array<Counts, 4> own{};
            for (int y = static_cast<int>(from); y < to; ++y) {
                std::uint16_t* const d = &difference_[at(y)];
                const std::uint8_t* const a = &luma_[at(y)];
                const std::uint8_t* const b = &backgroundLuma_[at(y)];
                gradientDifference(a, &luma_[below(y)], b, &backgroundLuma_[below(y)], width_, d);
                // Gradients alone see neither the inside of an even thing nor a change of level.
                for (int x = 0; x < width_; ++x) {
                    const auto level = static_cast<std::uint16_t>(std::abs(a[x] - b[x]));
                    d[x] = d[x] > level ? d[x] : level;
                }
                for (int x = 0; x < width_; ++x) ++own[x & 3][d[x]];
            }
            const std::lock_guard lock(mutex);
            for (const Counts& table : own)
                for (std::size_t v = 0; v < counts.size(); ++v) counts[v] += table[v];
        });
        return stabilityThreshold(counts, count());
    }

    void updateRow(Row& row, int y, int threshold) {
        static const auto kShares = frameShares();
        const auto width = static_cast<std::size_t>(width_);
        gradientDifference(&luma_[at(y)], &luma_[below(y)], &before_[at(y)], &before_[below(y)],
                           width_, row.change.data());
        const std::uint16_t* const difference = &difference_[at(y)];
        std::uint8_t* const steadyFor = &steadyFor_[at(y)];
        std::uint8_t* const staticFor = &staticFor_[at(y)];
        for (std::size_t x = 0; x < width; ++x) {
            const bool isStatic = difference[x] <= threshold;
            const bool steady = row.change[x] <= threshold;
            const int times = isStatic || !steady ? 0 : std::min(steadyFor[x] + 1, 255);
            const bool replace = times >= std::max<int>(kSteadyTimes, staticFor[x]);
            row.share[x] = isStatic ? kShares[staticFor[x]] : std::int16_t{0};
            row.replace[x] = static_cast<std::int16_t>(replace ? -1 : 0);
            const int age = std::min(staticFor[x] + (isStatic ? 1 : 0), 255);
            steadyFor[x] = static_cast<std::uint8_t>(replace ? 0 : times);
            staticFor[x] = static_cast<std::uint8_t>(replace ? 0 : age);
        }
        for (int c = 0; c < 3; ++c) {
            std::int16_t* const is = background(y, c);
            const std::int16_t* const to = row.colour[c].data();
            const std::int16_t* const share = row.share.data();
            const std::int16_t* const replace = row.replace.data();
            for (std::size_t x = 0; x < width; ++x) {
                const auto gap = static_cast<std::int16_t>(to[x] - is[x]);
                const auto step = static_cast<std::int16_t>(gap * share[x] >> 16);
                is[x] =
                    static_cast<std::int16_t>(is[x] + ((gap & replace[x]) | (step & ~replace[x])));
            }
        }
        Row::lumaOf(background(y, 0), background(y, 1), background(y, 2), &backgroundLuma_[at(y)],
                    width);
    }

    template <class Body>
    void forRows(const Body& body) const {
        parallelForBlocks(0, height_, kRowsAtOnce, [&](std::int64_t from, std::int64_t to) {
            Row row(width_);
            for (int y = static_cast<int>(from); y < to; ++y) body(y, row);
        });
    }

    int width_, height_;
    std::vector<std::int16_t> background_;      ///< of each row R, G, B: levels * 128
    std::vector<std::uint8_t> backgroundLuma_;  ///< its luma
    std::vector<std::uint8_t> luma_, before_;   ///< of this frame and the one before
    std::vector<std::uint8_t> steadyFor_;       ///< times that what covers the pixel was steady
    std::vector<std::uint8_t> staticFor_;       ///< times that it was static since it was replaced
    std::vector<std::uint16_t> difference_;     ///< of the N2PG of frame and background
};

}  // namespace

Result<StillBackground> n2pgBackground(StillFrames& frames, std::span<const int> which, Job& job) {
    const auto size = frames.size();
    STX_CHECK(job.limits.checkAllocation(static_cast<std::uint64_t>(size.x) * size.y,
                                         kN2pgBytesPerPixel, "a background"));
    N2pgModel model(size);
    for (std::size_t i = 0; i < which.size(); ++i) {
        STX_CHECK(job.checkCancelled());
        STX_TRY(const auto frame, frames.frame(which[i]));
        if (!std::all_of(frame->pixels().begin(), frame->pixels().end(), isSeen))
            return fail(ErrorCode::usage,
                        "frame {} has transparent pixels, which the method n2pg cannot leave out; "
                        "take --method select or median",
                        which[i]);
        if (i == 0)
            model.begin(*frame);
        else if (isSound(frames, which, i))
            model.update(*frame);
        job.progress(static_cast<std::int64_t>(i) + 1, static_cast<std::int64_t>(which.size()),
                     "looking at frames");
    }
    StillBackground out;
    out.colour = Rgba8Image(size.x, size.y);
    out.confidence = Image<std::uint8_t>(size.x, size.y);
    out.framesUsed = soundFrames(frames, which);
    model.write(out.framesUsed, out);
    return out;
}

}  // namespace stx

#include "formats/images/png_unfilter.hpp"

#include <algorithm>
#include <cstring>
#include <utility>
#include <vector>

namespace stx {
namespace {

// A filtered byte depends on the byte before it, so that a row can only be undone from left to
// right. But several rows are undone at once, each a pixel behind the row above it: the pixel above
// has then just been computed. GCC and clang make vector instructions of these types on every
// processor.

constexpr std::size_t kBytes = 16;
using Lanes = std::uint8_t __attribute__((vector_size(kBytes)));

/// A pixel as one number, and as many of them as fill Lanes. Pixels of 3 and 6 bytes leave some
/// idle.
template <class T>
struct PixelsOf {
    typedef T Type __attribute__((vector_size(kBytes)));
};

/// Which rows have which filter: all bits of their lanes.
struct Filters {
    Lanes sub{}, up{}, average{}, paeth{};
};

Lanes larger(Lanes a, Lanes b) {
    return a > b ? a : b;
}
Lanes smaller(Lanes a, Lanes b) {
    return a < b ? a : b;
}
Lanes select(Lanes mask, Lanes yes, Lanes no) {
    return (mask & yes) | (~mask & no);
}
/// All bits where a <= b. SSE2 has no other comparison of bytes without signs.
Lanes notAbove(Lanes a, Lanes b) {
    return reinterpret_cast<Lanes>(smaller(a, b) == a);
}

/// Of a, b and c the one nearest to a + b - c, in that order where they are as near.
Lanes paethOf(Lanes a, Lanes b, Lanes c) {
    const Lanes toA = larger(b, c) - smaller(b, c), toB = larger(a, c) - smaller(a, c);
    // To c: the sum of both where a and b lie on one side of it, which is never the least, or their
    // difference.
    const Lanes oneSide = reinterpret_cast<Lanes>(notAbove(c, a) == notAbove(c, b));
    const Lanes toC = (larger(toA, toB) - smaller(toA, toB)) | oneSide;
    const Lanes isA = notAbove(toA, smaller(toB, toC));
    return select(isA, a, select(notAbove(toB, toC), b, c));
}

template <bool kAllPaeth>
Lanes guessOf(const Filters& f, Lanes left, Lanes up, Lanes corner) {
    const Lanes paeth = paethOf(left, up, corner);
    if constexpr (kAllPaeth) return paeth;
    const Lanes average = (left & up) + ((left ^ up) >> 1);
    return (f.paeth & paeth) | (f.sub & left) | (f.up & up) | (f.average & average);
}

template <int kStep, class Pixel>
class Wave {
  public:
    static constexpr std::size_t kRows = kBytes / sizeof(Pixel);

    /// Rows that follow each other; at most kRows. `row`: behind the filter of the first, `above`:
    /// the row before it.
    Wave(std::uint8_t* row, const std::uint8_t* above, std::size_t size, std::size_t rows)
        : row_(row), above_(above), size_(size), rows_(rows) {
        std::uint8_t masks[kPngFilters][kBytes] = {};
        for (std::size_t k = 0; k < rows; ++k) {
            const std::uint8_t filter = (row - 1)[k * (size + 1)];
            allPaeth_ = allPaeth_ && filter == kFilterPaeth;
            std::memset(masks[filter] + k * sizeof(Pixel), 0xff, sizeof(Pixel));
        }
        std::memcpy(&filters_.sub, masks[kFilterSub], kBytes);
        std::memcpy(&filters_.up, masks[kFilterUp], kBytes);
        std::memcpy(&filters_.average, masks[kFilterAverage], kBytes);
        std::memcpy(&filters_.paeth, masks[kFilterPaeth], kBytes);
    }

    void run() {
        if (allPaeth_)
            runAs<true>();
        else
            runAs<false>();
    }

  private:
    using Pixels = typename PixelsOf<Pixel>::Type;

    template <bool kAllPaeth>
    void runAs() {
        const std::size_t width = size_ / kStep, whole = rows_ == kRows ? width : 0;
        std::size_t t = 0;
        for (; t + 1 < kRows; ++t) advance<kAllPaeth, false>(t);
        for (; t < whole; ++t) advance<kAllPaeth, true>(t);
        for (; t < width + kRows - 1; ++t) advance<kAllPaeth, false>(t);
    }

    /// Row k does its pixel t - k. `kAll`: all rows have one.
    template <bool kAllPaeth, bool kAll>
    void advance(std::size_t t) {
        each<kAllPaeth, kAll>(t, std::make_index_sequence<kRows>());
    }

    template <bool kAllPaeth, bool kAll, std::size_t... k>
    void each(std::size_t t, std::index_sequence<k...>) {
        const Pixels raw = {(kAll || has(t, k) ? load(at(t, k)) : Pixel{0})...};
        const Pixel first = t * kStep < size_ ? load(above_ + t * kStep) : Pixel{0};
        const auto before = reinterpret_cast<Pixels>(left_);
        const Pixels up = {(k == 0 ? first : before[k == 0 ? 0 : k - 1])...};
        const auto upBytes = reinterpret_cast<Lanes>(up);
        left_ =
            reinterpret_cast<Lanes>(raw) + guessOf<kAllPaeth>(filters_, left_, upBytes, corner_);
        corner_ = upBytes;
        const auto done = reinterpret_cast<Pixels>(left_);
        ((kAll || has(t, k) ? store(done[k], at(t, k)) : void()), ...);
    }

    [[nodiscard]] bool has(std::size_t t, std::size_t k) const {
        return k < rows_ && t >= k && (t - k) * kStep < size_;
    }
    [[nodiscard]] std::uint8_t* at(std::size_t t, std::size_t k) const {
        return row_ + k * (size_ + 1) + (t - k) * kStep;
    }
    static Pixel load(const std::uint8_t* from) {
        // What a pixel does not fill comes from behind it, which is quicker and does not matter.
        Pixel p;
        std::memcpy(&p, from, sizeof(p));
        return p;
    }
    static void store(Pixel p, std::uint8_t* to) { std::memcpy(to, &p, kStep); }

    std::uint8_t* row_;
    const std::uint8_t* above_;
    std::size_t size_, rows_;
    bool allPaeth_ = true;
    Filters filters_;
    Lanes left_{}, corner_{};
};

template <int kStep, class Pixel>
bool unfilter(std::span<std::uint8_t> rows, std::size_t count, std::size_t size,
              const std::function<void(std::size_t, std::size_t)>& ready) {
    const std::vector<std::uint8_t> zeros(size + kUnfilterSlack, 0);
    const std::uint8_t* above = zeros.data();
    for (std::size_t y = 0, end = 0; y < count; y = end) {
        std::uint8_t* row = rows.data() + y * (size + 1) + 1;
        end = std::min(y + Wave<kStep, Pixel>::kRows, count);
        for (std::size_t k = y; k < end; ++k)
            if (rows[k * (size + 1)] > kFilterPaeth) return false;
        // Rows of these two are not chains.
        if (row[-1] == kFilterNone || row[-1] == kFilterUp) {
            end = y + 1;
            for (std::size_t i = 0; row[-1] == kFilterUp && i < size; ++i)
                row[i] = static_cast<std::uint8_t>(row[i] + above[i]);
        } else {
            Wave<kStep, Pixel>(row, above, size, end - y).run();
        }
        ready(y, end);
        above = rows.data() + (end - 1) * (size + 1) + 1;
    }
    return true;
}

}  // namespace

bool unfilterPng(std::span<std::uint8_t> rows, std::size_t count, std::size_t size, int step,
                 const std::function<void(std::size_t, std::size_t)>& ready) {
    switch (step) {
        case 1:
            return unfilter<1, std::uint8_t>(rows, count, size, ready);
        case 2:
            return unfilter<2, std::uint16_t>(rows, count, size, ready);
        case 3:
            return unfilter<3, std::uint32_t>(rows, count, size, ready);
        case 4:
            return unfilter<4, std::uint32_t>(rows, count, size, ready);
        case 6:
            return unfilter<6, std::uint64_t>(rows, count, size, ready);
        case 8:
            return unfilter<8, std::uint64_t>(rows, count, size, ready);
        default:
            return false;
    }
}

}  // namespace stx

#include "lib/base/pack_rows.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <vector>

#include "lib/base/deflate_blocks.hpp"

namespace stx {
namespace {

// Found by trial on frames of the project's sets.
/// Runs are looked for in steps of this many bytes, and shorter ones are not taken.
constexpr std::uint32_t kLeastRun = 8;
/// Bytes are stored when coding them leaves more than this share of them.
constexpr float kStoredShare = 0.97f;
/// Shorter pieces of such bytes are coded with what is around them.
constexpr std::uint32_t kLeastStored = 48;
/// Bits that a block of its own codes takes before and behind its symbols, about.
constexpr float kBlockBits = 850.0f;
/// One row of as many is looked at before bytes are stored or coded.
constexpr int kLookedAt = 4;
/// Rows with fewer values tell nothing.
constexpr std::uint32_t kFewValues = 256;
/// Blocks with fewer literals are compared with the fixed codes, symbol by symbol.
constexpr std::uint32_t kFewLiterals = 1200;
/// What a value that was looked at counts beside one that was not, and beside a repeat.
constexpr std::uint32_t kSeenWeight = 8, kRepeatWeight = 2;

using Histogram = std::array<std::uint32_t, 256>;

/// Bytes from `begin` on: literals, or a repeat of what is `distance` before.
struct Piece {
    std::uint32_t begin, size;
    std::uint32_t distance;  ///< 0 of literals
    std::uint32_t kind;      ///< the part, by half
};

std::uint64_t eightBytes(const std::uint8_t* from) {
    std::uint64_t bytes;
    std::memcpy(&bytes, from, sizeof bytes);
    return bytes;
}

/// In four tables, since a count that follows the same one waits for it.
using Tables = std::array<Histogram, 4>;

void addTo(Tables& tables, std::span<const std::uint8_t> bytes) {
    std::size_t i = 0;
    for (; i + 4 <= bytes.size(); i += 4)
        for (std::size_t k = 0; k < 4; ++k) ++tables[k][bytes[i + k]];
    for (; i < bytes.size(); ++i) ++tables[0][bytes[i]];
}

/// Bits of all values of a histogram in the best code.
float bitsOf(const Histogram& histogram) {
    constexpr int kTable = 12;
    static const auto kLogarithms = [] {
        std::array<float, 1 << kTable> table{};
        for (std::size_t i = 1; i < table.size(); ++i) table[i] = std::log2(static_cast<float>(i));
        return table;
    }();
    const auto logarithm = [](std::uint32_t n) {
        const int beyond = std::max(static_cast<int>(std::bit_width(n)) - kTable, 0);
        return kLogarithms[n >> beyond] + static_cast<float>(beyond);
    };
    std::uint32_t all = 0;
    float bits = 0;
    for (const std::uint32_t n : histogram) {
        all += n;
        bits -= static_cast<float>(n) * logarithm(n);
    }
    return bits + static_cast<float>(all) * logarithm(all);
}

class RowPacker {
  public:
    RowPacker(std::span<const std::uint8_t> split, int rows, std::span<const RowPart> parts)
        : split_(split),
          rows_(rows),
          parts_(parts),
          half_(static_cast<std::uint32_t>(split.size() / 2)),
          tables_(2 * parts.size()),
          seen_(2 * parts.size()),
          stored_(2 * parts.size()) {}

    [[nodiscard]] std::size_t pack(std::uint32_t adler, std::uint8_t* to) {
        findPieces();
        std::array<deflate::Counts, 2> counts;
        for (std::size_t half = 0; half < 2; ++half) {
            choose(half);
            count(half, counts[half]);
        }
        const std::array<deflate::Codes, 2> codes = {deflate::Codes(counts[0]),
                                                     deflate::Codes(counts[1])};
        deflate::BlockWriter out(to);
        out.zlibHead();
        for (std::size_t at = 0; at < pieces_.size();)
            at = isStored(pieces_[at]) ? writeStored(at, out) : writeCoded(at, codes, out);
        return out.finishZlib(adler);
    }

  private:
    /// Cuts all bytes into pieces, and counts the literals of some rows.
    void findPieces();
    void findRuns(std::uint32_t begin, std::uint32_t end, std::uint32_t kind);
    void add(const Piece& piece);
    /// Which parts of a half are stored.
    void choose(std::size_t half);
    /// What is to be coded in a half.
    void count(std::size_t half, deflate::Counts& counts) const;
    [[nodiscard]] bool isStored(const Piece& p) const {
        return p.distance == 0 && p.size >= kLeastStored && stored_[p.kind];
    }
    [[nodiscard]] std::span<const std::uint8_t> bytesOf(const Piece& p) const {
        return split_.subspan(p.begin, p.size);
    }
    /// Writes pieces from `at` on, as many as go together; the first one behind them.
    [[nodiscard]] std::size_t writeStored(std::size_t at, deflate::BlockWriter& out) const;
    [[nodiscard]] std::size_t writeCoded(std::size_t at, std::span<const deflate::Codes, 2> codes,
                                         deflate::BlockWriter& out) const;

    std::span<const std::uint8_t> split_;
    int rows_;
    std::span<const RowPart> parts_;
    std::uint32_t half_;  ///< where the high bytes begin
    std::vector<Piece> pieces_;
    std::vector<Tables> tables_;   ///< of each part's rows that were looked at
    std::vector<Histogram> seen_;  ///< their sums
    std::vector<std::uint8_t> stored_;
};

void RowPacker::add(const Piece& piece) {
    if (piece.distance != 0 && !pieces_.empty()) {
        Piece& last = pieces_.back();
        // Both in one half: a block ends there.
        if (last.distance == piece.distance && piece.begin != half_) {
            last.size += piece.size;
            return;
        }
    }
    pieces_.push_back(piece);
}

void RowPacker::findRuns(std::uint32_t begin, std::uint32_t end, std::uint32_t kind) {
    const std::uint8_t* s = split_.data();
    const std::uint32_t period = parts_[kind % parts_.size()].period;
    std::uint32_t literals = begin, i = std::max(begin, period);
    while (i + kLeastRun <= end) {
        if (eightBytes(s + i) != eightBytes(s + i - period)) {
            i += kLeastRun;
            continue;
        }
        std::uint32_t first = i;
        while (first > literals && first > period && s[first - 1] == s[first - 1 - period]) --first;
        i += kLeastRun;
        while (i + 8 <= end && eightBytes(s + i) == eightBytes(s + i - period)) i += 8;
        while (i < end && s[i] == s[i - period]) ++i;
        if (first > literals) pieces_.push_back({literals, first - literals, 0, kind});
        add({first, i - first, period, kind});
        literals = i;
    }
    if (end > literals) pieces_.push_back({literals, end - literals, 0, kind});
}

void RowPacker::findPieces() {
    const std::uint8_t* s = split_.data();
    const auto count = static_cast<std::uint32_t>(parts_.size());
    std::vector<std::uint32_t> begins(count);
    std::uint32_t at = 0;
    for (int line = 0; line < 2 * rows_; ++line) {
        for (std::uint32_t k = 0; k < count; ++k) {
            const RowPart& part = parts_[k];
            const std::uint32_t end = at + part.bytes, kind = line < rows_ ? k : count + k;
            begins[k] = at;
            const auto before = pieces_.size();
            const std::uint32_t back = part.same < 0 ? 0 : at - begins[part.same];
            if (at > 0 && s[at] == s[at - 1] && std::memcmp(s + at, s + at - 1, part.bytes) == 0) {
                add({at, part.bytes, 1, kind});
            } else if (back > 0 && back <= deflate::kWindow && part.bytes > kLeastRun) {
                // What its first byte differs from is another's.
                pieces_.push_back({at, 1, 0, kind});
                pieces_.push_back({at + 1, part.bytes - 1, back, kind});
            } else {
                findRuns(at, end, kind);
            }
            for (auto i = before; line % rows_ % kLookedAt == 0 && i < pieces_.size(); ++i)
                if (const Piece& p = pieces_[i]; p.distance == 0 && p.size > 1)
                    addTo(tables_[kind], bytesOf(p));
            at = end;
        }
    }
    for (std::size_t kind = 0; kind < seen_.size(); ++kind)
        for (const Histogram& table : tables_[kind])
            for (std::size_t v = 0; v < 256; ++v) seen_[kind][v] += table[v];
}

void RowPacker::choose(std::size_t half) {
    Histogram coded{}, together{};
    std::uint32_t stored = 0;
    int switches = 0;
    bool wasStored = false;
    for (std::size_t kind = half * parts_.size(); kind < (half + 1) * parts_.size(); ++kind) {
        const Histogram& seen = seen_[kind];
        std::uint32_t values = 0, different = 0;
        for (std::size_t v = 0; v < 256; ++v) {
            values += seen[v];
            different += seen[v] > 0 ? 1 : 0;
            together[v] += seen[v];
        }
        if (values == 0) continue;
        // What few values seem to have in common is chance, for about 0.7 bits of each value.
        stored_[kind] =
            values >= kFewValues && bitsOf(seen) + 0.7f * static_cast<float>(different) >
                                        kStoredShare * 8.0f * static_cast<float>(values);
        if (stored_[kind])
            stored += values;
        else
            for (std::size_t v = 0; v < 256; ++v) coded[v] += seen[v];
        if (wasStored && !stored_[kind]) ++switches;
        wasStored = stored_[kind] != 0;
    }
    // A block of codes ends where bytes are stored, and tells its codes again behind them.
    const int looked = (rows_ + kLookedAt - 1) / kLookedAt;
    const float apart = bitsOf(coded) + 8.0f * static_cast<float>(stored) +
                        kBlockBits * static_cast<float>(switches * looked);
    if (bitsOf(together) + kBlockBits / kLookedAt < kStoredShare * apart)
        std::fill_n(stored_.begin() + static_cast<std::ptrdiff_t>(half * parts_.size()),
                    parts_.size(), std::uint8_t{0});
}

void RowPacker::count(std::size_t half, deflate::Counts& counts) const {
    // Any value may come in rows that were not looked at.
    for (std::size_t v = 0; v < 256; ++v) counts.symbols[v] = 1;
    for (std::size_t kind = half * parts_.size(); kind < (half + 1) * parts_.size(); ++kind)
        for (std::size_t v = 0; v < 256 && !stored_[kind]; ++v)
            counts.symbols[v] += kSeenWeight * seen_[kind][v];
    counts.symbols[256] = static_cast<std::uint32_t>(rows_);
    for (const Piece& p : pieces_) {
        if ((p.begin >= half_) != (half == 1)) continue;
        if (p.distance != 0)
            counts.addRepeat(p.size, p.distance, kRepeatWeight);
        else if (p.size < kLeastStored)
            for (const std::uint8_t byte : bytesOf(p)) ++counts.symbols[byte];
    }
}

std::size_t RowPacker::writeStored(std::size_t at, deflate::BlockWriter& out) const {
    std::size_t end = at, size = 0;
    for (; end < pieces_.size() && isStored(pieces_[end]); ++end) size += pieces_[end].size;
    out.stored(split_.subspan(pieces_[at].begin, size));
    return end;
}

std::size_t RowPacker::writeCoded(std::size_t at, std::span<const deflate::Codes, 2> codes,
                                  deflate::BlockWriter& out) const {
    const bool high = pieces_[at].begin >= half_;
    const deflate::Codes &own = codes[high ? 1 : 0], &fixed = deflate::Codes::fixed();
    std::size_t end = at;
    std::uint32_t literals = 0;
    for (; end < pieces_.size(); ++end) {
        const Piece& p = pieces_[end];
        if (isStored(p) || (p.begin >= half_) != high) break;
        if (p.distance == 0) literals += p.size;
    }
    const auto pieces = std::span(pieces_).subspan(at, end - at);
    const auto bits = [&](const deflate::Codes& by) {
        std::int64_t sum = by.blockBits();
        for (const Piece& p : pieces) {
            if (p.distance != 0)
                sum += by.repeatBits(p.size, p.distance);
            else
                for (const std::uint8_t byte : bytesOf(p)) sum += by.literalBits(byte);
        }
        return sum;
    };
    const bool plain = literals < kFewLiterals && bits(fixed) <= bits(own);
    out.begin(plain ? fixed : own);
    for (const Piece& p : pieces) {
        if (p.distance != 0)
            out.repeat(p.size, p.distance);
        else
            out.literals(bytesOf(p));
    }
    out.end();
    return end;
}

}  // namespace

std::size_t packRows(std::span<const std::uint8_t> split, int rows, std::span<const RowPart> parts,
                     std::uint32_t adler, std::uint8_t* to) {
    return RowPacker(split, rows, parts).pack(adler, to);
}

}  // namespace stx

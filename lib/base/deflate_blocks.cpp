#include "lib/base/deflate_blocks.hpp"

#include <algorithm>
#include <bit>

namespace stx::deflate {
namespace {

static_assert(std::endian::native == std::endian::little, "bits are written as numbers");

constexpr std::uint32_t kMostRepeat = 258;

/// A number as deflate has it: a symbol, and some bits more.
struct Coded {
    std::uint16_t symbol = 0;
    std::uint16_t extra = 0;
    std::uint8_t extraBits = 0;
};

/// Sizes of repeats, clause 3.2.5.
std::array<Coded, kMostRepeat + 1> codedSizes() {
    std::array<Coded, kMostRepeat + 1> out{};
    std::uint32_t size = kLeastRepeat;
    for (int symbol = 257; symbol < kSymbols - 1; ++symbol) {
        const int bits = symbol < 265 ? 0 : (symbol - 261) / 4;
        for (std::uint32_t extra = 0; extra < 1u << bits; ++extra, ++size)
            if (size < kMostRepeat)
                out[size] = {static_cast<std::uint16_t>(symbol), static_cast<std::uint16_t>(extra),
                             static_cast<std::uint8_t>(bits)};
    }
    out[kMostRepeat] = {kSymbols - 1, 0, 0};
    return out;
}
const std::array<Coded, kMostRepeat + 1> kSizes = codedSizes();

Coded codedDistance(std::uint32_t distance) {
    const std::uint32_t from0 = distance - 1;
    if (from0 < 4) return {static_cast<std::uint16_t>(from0), 0, 0};
    const int bits = std::bit_width(from0) - 2;
    return {static_cast<std::uint16_t>(2 * bits + (from0 >> bits)),
            static_cast<std::uint16_t>(from0 & ((1u << bits) - 1)),
            static_cast<std::uint8_t>(bits)};
}

/// Calls `one` with sizes from kLeastRepeat to kMostRepeat, which are `size` together.
template <class F>
void forRepeats(std::uint32_t size, F&& one) {
    while (size > kMostRepeat) {
        const std::uint32_t part =
            size - kMostRepeat < kLeastRepeat ? size - kLeastRepeat : kMostRepeat;
        one(part);
        size -= part;
    }
    one(size);
}

/// Bits of each symbol's word in a Huffman code whose words have no more than `longest`; 0 for
/// symbols that do not occur. In place, after Moffat and Katajainen, "In-Place Calculation of
/// Minimum-Redundancy Codes" (1995).
void wordSizes(std::span<const std::uint32_t> counts, int longest, std::uint8_t* sizes) {
    struct Leaf {
        std::uint32_t count;
        int symbol;
    };
    std::array<Leaf, kSymbols> leaves;
    int n = 0;
    for (std::size_t i = 0; i < counts.size(); ++i) {
        sizes[i] = 0;
        if (counts[i]) leaves[n++] = {counts[i], static_cast<int>(i)};
    }
    if (n == 0) return;
    if (n == 1) {
        sizes[leaves[0].symbol] = 1;
        return;
    }
    std::sort(leaves.begin(), leaves.begin() + n, [](const Leaf& a, const Leaf& b) {
        return a.count != b.count ? a.count < b.count : a.symbol < b.symbol;
    });
    std::array<std::uint32_t, kSymbols> a;
    for (int i = 0; i < n; ++i) a[i] = leaves[i].count;
    // Sums of the two least, with the place of the sum that each one went into.
    int node = 0, leaf = 0;
    for (int next = 0; next < n - 1; ++next) {
        std::uint32_t sum = 0;
        for (int side = 0; side < 2; ++side) {
            if (leaf >= n || (node < next && a[node] < a[leaf])) {
                sum += a[node];
                a[node++] = static_cast<std::uint32_t>(next);
            } else {
                sum += a[leaf++];
            }
        }
        a[next] = sum;
    }
    // Depths of the sums, then how many leaves there are in each depth.
    a[n - 2] = 0;
    for (int i = n - 3; i >= 0; --i) a[i] = a[a[i]] + 1;
    std::array<int, kSymbols + 1> deep{};
    int open = 1;
    node = n - 2;
    for (std::uint32_t depth = 0; open > 0; ++depth) {
        int sums = 0;
        for (; node >= 0 && a[node] == depth; --node) ++sums;
        deep[std::min(static_cast<int>(depth), longest)] += open - sums;
        open = 2 * sums;
    }
    // Words that were cut took too much: others give way, the longest first.
    std::uint32_t taken = 0;
    for (int size = 1; size <= longest; ++size)
        taken += static_cast<std::uint32_t>(deep[size]) << (longest - size);
    for (; taken > 1u << longest; --taken) {
        int size = longest - 1;
        while (deep[size] == 0) --size;
        --deep[longest];
        --deep[size];
        deep[size + 1] += 2;
    }
    for (int size = 1, i = n; size <= longest; ++size)
        for (int k = 0; k < deep[size]; ++k)
            sizes[leaves[--i].symbol] = static_cast<std::uint8_t>(size);
}

/// The words of clause 3.2.2.
void wordsFrom(std::span<const std::uint8_t> sizes, Codes::Word* words) {
    std::array<std::uint32_t, 17> next{};
    for (const std::uint8_t size : sizes)
        if (size) ++next[size + 1];
    for (int size = 1; size <= 16; ++size) next[size] = (next[size - 1] + next[size]) << 1;
    for (std::size_t i = 0; i < sizes.size(); ++i) {
        const int size = sizes[i];
        std::uint32_t reversed = 0;
        if (size) {
            const std::uint32_t word = next[size]++;
            for (int bit = 0; bit < size; ++bit) reversed |= (word >> bit & 1) << (size - 1 - bit);
        }
        words[i] = {static_cast<std::uint16_t>(reversed), static_cast<std::uint8_t>(size)};
    }
}

}  // namespace

void Counts::addRepeat(std::uint32_t size, std::uint32_t distance, std::uint32_t weight) {
    auto& count = distances[codedDistance(distance).symbol];
    forRepeats(size, [&](std::uint32_t part) {
        symbols[kSizes[part].symbol] += weight;
        count += weight;
    });
}

Codes::Codes(Counts counts) {
    counts.symbols[256] = std::max(counts.symbols[256], 1u);
    std::array<std::uint8_t, kSymbols> sizes{};
    wordSizes(counts.symbols, kLongestWord, sizes.data());
    wordsFrom(sizes, symbols_.data());
    // One code of no distance at all may not be left out.
    if (std::ranges::all_of(counts.distances, [](std::uint32_t c) { return c == 0; }))
        counts.distances[0] = 1;
    std::array<std::uint8_t, kDistances> distances{};
    wordSizes(counts.distances, kLongestWord, distances.data());
    wordsFrom(distances, distances_.data());
    writeHead();
}

const Codes& Codes::fixed() {
    static const Codes kFixed = [] {
        Codes codes;
        // Two of the symbols that the words count are not in use.
        std::array<std::uint8_t, 288> sizes{};
        for (std::size_t i = 0; i < sizes.size(); ++i)
            sizes[i] = i < 144 ? 8 : i < 256 ? 9 : i < 280 ? 7 : 8;
        std::array<Word, 288> words;
        wordsFrom(sizes, words.data());
        std::copy_n(words.begin(), kSymbols, codes.symbols_.begin());
        std::array<std::uint8_t, kDistances> distances;
        distances.fill(5);
        wordsFrom(distances, codes.distances_.data());
        codes.head_[0] = 1 << 1;
        codes.headBits_ = 3;
        return codes;
    }();
    return kFixed;
}

/// Clause 3.2.7.
void Codes::writeHead() {
    int symbols = kSymbols, distances = kDistances;
    while (symbols > 257 && symbols_[symbols - 1].size == 0) --symbols;
    while (distances > 1 && distances_[distances - 1].size == 0) --distances;
    std::array<std::uint8_t, kSymbols + kDistances> sizes;
    int count = 0;
    for (int i = 0; i < symbols; ++i) sizes[count++] = symbols_[i].size;
    for (int i = 0; i < distances; ++i) sizes[count++] = distances_[i].size;

    constexpr int kRepeat = 16, kZeros = 17, kManyZeros = 18, kSizeSymbols = 19;
    struct Token {
        std::uint8_t symbol, extra;
    };
    std::array<Token, kSymbols + kDistances> tokens;
    int n = 0;
    const auto add = [&](int symbol, int extra) {
        tokens[n++] = {static_cast<std::uint8_t>(symbol), static_cast<std::uint8_t>(extra)};
    };
    for (int i = 0; i < count;) {
        const int size = sizes[i];
        int run = 1;
        while (i + run < count && sizes[i + run] == size) ++run;
        i += run;
        if (size != 0) {
            add(size, 0);
            --run;
        }
        while (run >= 3) {
            const int part = std::min(run, size ? 6 : 138);
            if (size)
                add(kRepeat, part - 3);
            else if (part <= 10)
                add(kZeros, part - 3);
            else
                add(kManyZeros, part - 11);
            run -= part;
        }
        for (; run > 0; --run) add(size, 0);
    }
    std::array<std::uint32_t, kSizeSymbols> counts{};
    for (int i = 0; i < n; ++i) ++counts[tokens[i].symbol];
    std::array<std::uint8_t, kSizeSymbols> wordSize{};
    wordSizes(counts, 7, wordSize.data());
    std::array<Word, kSizeSymbols> words;
    wordsFrom(wordSize, words.data());
    constexpr std::array kOrder = {16, 17, 18, 0, 8,  7, 9,  6, 10, 5,
                                   11, 4,  12, 3, 13, 2, 14, 1, 15};
    int told = kSizeSymbols;
    while (told > 4 && wordSize[kOrder[told - 1]] == 0) --told;

    BlockWriter head(head_.data());
    head.put(2 << 1, 3);
    head.put(static_cast<std::uint64_t>(symbols - 257), 5);
    head.put(static_cast<std::uint64_t>(distances - 1), 5);
    head.put(static_cast<std::uint64_t>(told - 4), 4);
    for (int i = 0; i < told; ++i) head.put(wordSize[kOrder[i]], 3);
    for (int i = 0; i < n; ++i) {
        const Token& t = tokens[i];
        head.put(words[t.symbol].bits, words[t.symbol].size);
        if (t.symbol >= kRepeat)
            head.put(t.extra, t.symbol == kRepeat ? 2 : t.symbol == kZeros ? 3 : 7);
    }
    headBits_ = static_cast<int>(8 * (head.at_ - head.begin_)) + head.count_;
}

int Codes::repeatBits(std::uint32_t size, std::uint32_t distance) const {
    const Coded coded = codedDistance(distance);
    const int forDistance = distances_[coded.symbol].size + coded.extraBits;
    int bits = 0;
    forRepeats(size, [&](std::uint32_t part) {
        bits += symbols_[kSizes[part].symbol].size + kSizes[part].extraBits + forDistance;
    });
    return bits;
}

void BlockWriter::toByte() {
    if (count_ == 0) return;
    *at_++ = static_cast<std::uint8_t>(held_);
    held_ = 0;
    count_ = 0;
}

void BlockWriter::stored(std::span<const std::uint8_t> bytes) {
    constexpr std::size_t kMost = 65535;
    while (!bytes.empty()) {
        const auto part = bytes.first(std::min(bytes.size(), kMost));
        put(0, 3);
        toByte();
        put(part.size() | (~part.size() & kMost) << 16, 32);
        std::memcpy(at_, part.data(), part.size());
        at_ += part.size();
        bytes = bytes.subspan(part.size());
    }
}

void BlockWriter::begin(const Codes& codes) {
    codes_ = &codes;
    int left = codes.headBits_;
    for (const std::uint8_t* from = codes.head_.data(); left > 0; ++from, left -= 8) {
        const int bits = std::min(left, 8);
        put(*from & ((1u << bits) - 1), bits);
    }
}

void BlockWriter::literals(std::span<const std::uint8_t> bytes) {
    const Codes::Word* words = codes_->symbols_.data();
    const std::uint8_t* from = bytes.data();
    const std::uint8_t* const last = from + bytes.size();
    // A copy, for bytes that are written might be the object's own.
    BlockWriter out = *this;
    for (; last - from >= 4; from += 4) {
        // In pairs, for each word waits for the size of the one before.
        const auto a = words[from[0]], b = words[from[1]], c = words[from[2]], d = words[from[3]];
        const int first = a.size + b.size;
        const std::uint64_t ab = a.bits | static_cast<std::uint64_t>(b.bits) << a.size;
        const std::uint64_t cd = c.bits | static_cast<std::uint64_t>(d.bits) << c.size;
        out.put(ab | cd << first, first + c.size + d.size);
    }
    for (; from != last; ++from) out.put(words[*from].bits, words[*from].size);
    *this = out;
}

void BlockWriter::repeat(std::uint32_t size, std::uint32_t distance) {
    const Coded far = codedDistance(distance);
    const Codes::Word farWord = codes_->distances_[far.symbol];
    const std::uint64_t farBits = farWord.bits | static_cast<std::uint64_t>(far.extra)
                                                     << farWord.size;
    forRepeats(size, [&](std::uint32_t part) {
        const Coded& coded = kSizes[part];
        const Codes::Word word = codes_->symbols_[coded.symbol];
        const int bits = word.size + coded.extraBits;
        put(word.bits | static_cast<std::uint64_t>(coded.extra) << word.size | farBits << bits,
            bits + farWord.size + far.extraBits);
    });
}

void BlockWriter::end() {
    put(codes_->symbols_[256].bits, codes_->symbols_[256].size);
    codes_ = nullptr;
}

std::size_t BlockWriter::finishZlib(std::uint32_t adler) {
    // A block of clause 3.2.6 that ends at once.
    put(1 | 1 << 1, 3);
    put(0, 7);
    toByte();
    for (int shift = 24; shift >= 0; shift -= 8) put(adler >> shift & 0xff, 8);
    return static_cast<std::size_t>(at_ - begin_);
}

}  // namespace stx::deflate

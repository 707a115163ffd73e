#include "lib/render/surface/cpu/fuse.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <span>

#include "lib/render/surface/cpu/fuse_samples.hpp"
#include "lib/render/surface/prepare/votes.hpp"

namespace stx::surface {
namespace shared {
namespace {

/// The samples that one source has in the pixels of a row of a tile, summed up for each pixel.
struct RowRange {
    std::array<float, kTile> low, high;            ///< least and greatest sample
    std::array<std::uint32_t, kTile> any, common;  ///< flags of any, and of all that are there
};

/// Pixels of a row that are looked at together.
constexpr int kRun = 8;

/// Sums up pixels of S x S samples each. Only runs of pixels with some bit of `wanted` are looked
/// at; the others count as empty. False when the source has no sample in any of them.
template <int S>
bool summarisePixels(const float* lines, int stride, std::uint32_t wanted, RowRange& out) {
    constexpr int kSide = kRun * S;
    std::uint32_t all = 0;
    for (std::size_t begin = 0; begin < kTile; begin += kRun) {
        if (!(wanted >> begin & ((1u << kRun) - 1))) {
            for (std::size_t x = begin; x < begin + kRun; ++x) {
                out.low[x] = out.high[x] = 0.0f;
                out.any[x] = out.common[x] = 0;
            }
            continue;
        }
        // Columns are added up first, since vectors can do that.
        const float* const from = lines + begin * S;
        std::array<float, kSide> low, high;
        std::array<std::uint32_t, kSide> any, common;
        for (int i = 0; i < kSide; ++i) {
            const auto k = static_cast<std::size_t>(i);
            const auto bits = std::bit_cast<std::uint32_t>(from[i]);
            low[k] = high[k] = from[i];
            any[k] = bits;
            common[k] = bits == 0 ? ~0u : bits;
        }
        for (int j = 1; j < S; ++j) {
            const float* line = from + static_cast<std::ptrdiff_t>(j) * stride;
            for (int i = 0; i < kSide; ++i) {
                const auto k = static_cast<std::size_t>(i);
                const float q = line[i];
                const auto bits = std::bit_cast<std::uint32_t>(q);
                low[k] = q < low[k] ? q : low[k];
                high[k] = q > high[k] ? q : high[k];
                any[k] |= bits;
                common[k] &= bits == 0 ? ~0u : bits;
            }
        }
        for (const std::uint32_t bits : any) all |= bits;
        for (std::size_t x = 0; x < kRun; ++x) {
            const std::size_t first = x * S, at = begin + x;
            out.low[at] = low[first];
            out.high[at] = high[first];
            out.any[at] = any[first];
            out.common[at] = common[first];
            for (std::size_t i = first + 1; i < first + S; ++i) {
                out.low[at] = std::min(out.low[at], low[i]);
                out.high[at] = std::max(out.high[at], high[i]);
                out.any[at] |= any[i];
                out.common[at] &= common[i];
            }
        }
    }
    return all != 0;
}

struct Fuser : Votes {
    static constexpr int SAMPLES = 16;

    const SampleGrid grid;
    const DepthAxis& axis;
    TileEntry tile;
    int S, SIDE, stride;

    Fuser(std::span<const LocalSource> local, const SampleGrid& samples, const DepthAxis& frameAxis,
          int tileX, int tileY)
        : Votes{{local}},
          grid(samples),
          axis(frameAxis),
          tile{tileX, tileY, 0, static_cast<uint>(local.size()), 0, 0, 0, 0},
          S(grid.perPixel),
          SIDE(grid.side()),
          stride(grid.stride()) {
        for (const LocalSource& s : local) tile.step = std::max(tile.step, s.source->step);
    }

    [[nodiscard]] Axis frameAxis() const { return axis; }
    [[nodiscard]] static int sourceOf(int k) { return k; }
    [[nodiscard]] uint sampleOf(int k, int i, int j) const {
        const float* samples = locals[static_cast<std::size_t>(k)].samples;
        if (!samples) return 0;
        return floatBitsToUint(samples[static_cast<std::ptrdiff_t>(j) * stride + i]);
    }

#include "shaders/shared/surface_fuse.glsl"

    /// Calls fuseSamples() for a pixel in which only the sources `among` may have samples.
    void showSamples(std::span<const int> among, int column, int row) {
        ShownSamples shown;
        fuseSamplesOf({locals.first(tile.count), grid, axis, tile.step, tile.x, tile.y}, among,
                      column, row, shown);
        shownCount = 0;
        for (int k = 0; k < S * S; ++k) {
            const float q = shown.q[k];
            if (q == 0.0f) continue;
            int at = shownCount++;
            for (; at > 0 && shownQ[at - 1] < q; --at) {
                shownQ[at] = shownQ[at - 1];
                shownTo[at] = shownTo[at - 1];
                shownAt[at] = shownAt[at - 1];
            }
            shownQ[at] = q;
            shownTo[at] = shown.seenBy[k];
            shownAt[at] = k;
        }
    }

    using RowRanges = std::array<RowRange, kMostTileSources>;

    /// Adds what the first `tile.count` sources show in a pixel, of which `list` may have something
    /// there, with that share of it. False when it is simple, and all of it was added.
    bool fusePixel(const RowRanges& ranges, std::span<const int> list, int column, int row,
                   float share, Pieces& pieces) {
        const auto x = static_cast<std::size_t>(column);
        WholePixel whole = startPixel();
        for (const int k : list) {
            const RowRange& range = ranges[static_cast<std::size_t>(k)];
            addSource(whole, k, range.low[x], range.high[x], range.any[x]);
        }
        if (!whole.any) return true;
        Piece piece;
        if (isSimple(whole)) {
            uint also = 0;
            for (uint left = whole.others; left != 0; left &= left - 1) {
                const int k = findLSB(left);
                const RowRange& range = ranges[static_cast<std::size_t>(k)];
                if (alsoShows(whole, range.high[x], range.common[x])) also |= 1u << k;
            }
            if (simplePiece(whole, also, column, row, piece)) pieces.add(piece, share);
            return false;
        }
        showSamples(list, column, row);
        for (int begin = 0; begin < shownCount;) {
            const int end = pieceEnd(begin);
            pieces.add(pieceOf(column, row, begin, end), share);
            begin = end;
        }
        return true;
    }

    void fuseRow(int row, std::uint32_t wanted, int core, Pieces& pieces) {
        RowRanges ranges;
        std::array<int, kMostTileSources> list;  // sources that have something there
        int count = 0;
        for (std::size_t s = 0; s < locals.size(); ++s) {
            if (!locals[s].samples) continue;
            const float* lines = locals[s].samples + static_cast<std::ptrdiff_t>(row) * S * stride;
            constexpr std::array summarise = {summarisePixels<1>, summarisePixels<2>,
                                              summarisePixels<3>, summarisePixels<4>};
            if (summarise[static_cast<std::size_t>(S - 1)](lines, stride, wanted, ranges[s]))
                list[static_cast<std::size_t>(count++)] = static_cast<int>(s);
        }
        const std::span<const int> there{list.data(), static_cast<std::size_t>(count)};
        const std::span<const int> first{
            list.data(), static_cast<std::size_t>(
                             std::lower_bound(there.begin(), there.end(), core) - there.begin())};
        const auto all = static_cast<uint>(locals.size());
        const bool twice = core < static_cast<int>(all);
        for (std::uint32_t left = wanted; left; left &= left - 1) {
            const int column = std::countr_zero(left);
            const std::size_t before = pieces.size();
            if (!fusePixel(ranges, there, column, row, 1.0f, pieces) || !twice) continue;
            for (std::size_t i = before; i < pieces.size(); ++i) pieces.share[i] *= kAllShare;
            tile.count = static_cast<uint>(core);
            fusePixel(ranges, first, column, row, 1.0f - kAllShare, pieces);
            tile.count = all;
        }
    }
};

}  // namespace
}  // namespace shared

TilePixels pixelsInFrame(int tileX, int tileY, int width, int height) {
    const auto bitsBelow = [](int n) { return n >= kTile ? ~0u : (1u << std::max(n, 0)) - 1; };
    TilePixels pixels{};
    const std::uint32_t row = bitsBelow(width - tileX) & ~bitsBelow(-tileX);
    for (int y = std::max(-tileY, 0); y < std::min(kTile, height - tileY); ++y)
        pixels[static_cast<std::size_t>(y)] = row;
    return pixels;
}

void Pieces::clear() {
    x.clear();
    y.clear();
    q.clear();
    qx.clear();
    qy.clear();
    share.clear();
    sources.clear();
    pixel.clear();
}

void Pieces::resize(std::size_t size) {
    x.resize(size);
    y.resize(size);
    q.resize(size);
    qx.resize(size);
    qy.resize(size);
    share.resize(size);
    sources.resize(size);
    pixel.resize(size);
}

void Pieces::add(const Piece& piece, float of) {
    x.push_back(piece.x);
    y.push_back(piece.y);
    q.push_back(piece.q);
    qx.push_back(piece.qx);
    qy.push_back(piece.qy);
    share.push_back(piece.share * of);
    sources.push_back(piece.seenBy);
    pixel.push_back(static_cast<std::uint16_t>(piece.at));
}

void fuseTile(std::span<const LocalSource> sources, const SampleGrid& grid, const DepthAxis& axis,
              int tileX, int tileY, const TilePixels& wanted, Pieces& pieces, int core) {
    shared::Fuser fuser(sources, grid, axis, tileX, tileY);
    for (int row = 0; row < kTile; ++row)
        if (const std::uint32_t some = wanted[static_cast<std::size_t>(row)])
            fuser.fuseRow(row, some, core, pieces);
}

TilePixels fuseSettled(std::span<const LocalSource> sources, const SampleGrid& grid,
                       const DepthAxis& axis, int tileX, int tileY, const TilePixels& wanted,
                       int perPixel, Pieces& pieces) {
    static thread_local TileMiddles middles;
    // The first pixel of its rows belongs to the apron.
    shared::Fuser fuser(sources, grid, axis, tileX - kMiddles.apron, tileY - kMiddles.apron);
    settlePixels(sources, grid.stride(), axis, fuser.tile.step, perPixel, middles);
    TilePixels open{};
    std::size_t next = pieces.size(), most = next;
    for (std::size_t row = 0; row < kTile; ++row)
        most += static_cast<std::size_t>(std::popcount(middles.settled[row] & wanted[row]));
    pieces.resize(most);
    for (int row = 0; row < kTile; ++row) {
        const auto r = static_cast<std::size_t>(row), y = r + kMiddles.apron;
        const std::uint32_t settled = middles.settled[r] & wanted[r];
        open[r] = ~(settled | middles.empty[r]) & wanted[r];
        std::uint32_t alone = 0;
        for (std::size_t x = 0; x < kTile; ++x)
            alone |= (middles.alone[y][x + kMiddles.apron] ? 1u : 0u) << x;
        std::uint32_t shown = settled;
        if (sources.size() > 1) {
            for (std::uint32_t left = settled & alone; left; left &= left - 1) {
                const int column = std::countr_zero(left);
                const auto x = static_cast<std::size_t>(column + kMiddles.apron);
                if (fuser.rejected(middles.q[y][x], 0u, std::countr_zero(middles.seenBy[y][x]),
                                   static_cast<float>(tileX + column) + 0.5f,
                                   static_cast<float>(tileY + row) + 0.5f, column + kMiddles.apron,
                                   row + kMiddles.apron))
                    shown &= ~(1u << column);
            }
        }
        const auto put = [&](std::size_t at, std::size_t column) {
            const std::size_t x = column + kMiddles.apron;
            pieces.x[at] = static_cast<float>(tileX + static_cast<int>(column)) + 0.5f;
            pieces.y[at] = static_cast<float>(tileY + row) + 0.5f;
            pieces.q[at] = middles.q[y][x];
            pieces.qx[at] = middles.qx[y][x];
            pieces.qy[at] = middles.qy[y][x];
            pieces.share[at] = 1.0f;
            pieces.sources[at] = middles.seenBy[y][x];
            pieces.pixel[at] = static_cast<std::uint16_t>(r * kTile + column);
        };
        for (; shown; shown &= shown - 1)
            put(next++, static_cast<std::size_t>(std::countr_zero(shown)));
    }
    pieces.resize(next);
    return open;
}

}  // namespace stx::surface

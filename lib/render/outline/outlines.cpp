#include "lib/render/outline/outlines.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "lib/base/parallel.hpp"
#include "lib/geometry/cut_pixel.hpp"

namespace stx {
namespace {

// Where no source is named the value was chosen by trial on the project's image sets and meshes.

constexpr int kBandRows = 64;
constexpr int kTile = 4;
/// Pixels on each side that tell which way an outline runs.
constexpr int kAround = 2;
/// The fewest pixels that tell a direction.
constexpr float kEnoughPoints = 12.0f;
/// So many views are asked in a frame. The outermost of the points of more lie beyond the outline,
/// by what their pixels cover in part. Sides are those of the outline.
constexpr std::size_t kMostViews = 24, kSides = 8;
/// The outline of less even surroundings has no direction; of the sum of weights.
constexpr float kLeastDirection = 0.15f;

/// Whether a texel is a point: covered by half or more, as what hides in splat mode
/// is (kHides).
bool solid(const PageSet& set, const GlassPages* glass, std::size_t page, std::size_t texel) {
    if (set.pages()[page].texture->alpha(texel) >= 0.5f) return true;
    return glass && glass->coverage(page, texel) >= kHalfGlass;
}

}  // namespace

glm::vec2 outwardAt(const Image<float>& depth, int x, int y) {
    glm::vec2 out(0.0f);
    float all = 0;
    for (int j = -kAround; j <= kAround; ++j) {
        for (int i = -kAround; i <= kAround; ++i) {
            if (i == 0 && j == 0) continue;
            const float weight = 1.0f / static_cast<float>(i * i + j * j);
            all += weight;
            if (!depth.contains(x + i, y + j) || hasPoint(depth.at(x + i, y + j))) continue;
            out.x += weight * static_cast<float>(i);
            out.y += weight * static_cast<float>(j);
        }
    }
    const float length = std::hypot(out.x, out.y);
    return length > kLeastDirection * all ? out / length : glm::vec2(0.0f);
}

/// The pixels that are asked for on one side of an object, one of eight.
struct Outlines::Side {
    glm::dvec3 at{0}, out{0};  ///< sums of their places and of the ways out, as the camera has them
    double count = 0;

    static std::size_t of(glm::vec2 out) {
        return (out.x < 0 ? 4u : 0u) + (out.y < 0 ? 2u : 0u) +
               (std::abs(out.x) < std::abs(out.y) ? 1u : 0u);
    }
    void add(const Side& other) {
        at += other.at;
        out += other.out;
        count += other.count;
    }
};

/// Rows of the picture that one thread owns, as OutlineRows tells. Its memory serves for all
/// frames.
struct Outlines::Band {
    int left = 0, top = 0, rows = 0, width = 0, stride = 0;
    bool any = false;                ///< some pixel is asked for; else the arrays are not made
    std::vector<std::uint8_t> near;  ///< see OutlineRows
    std::vector<float> outX, outY;   ///< out of the object, length 1; NaN where not asked for
    std::vector<float> high, low;    ///< outermost and innermost point along that, pixels
    std::vector<float> count;        ///< of points
    std::vector<std::uint32_t> blocks;
    std::array<Side, kSides> sides;

    void make() {
        constexpr float kFar = std::numeric_limits<float>::infinity();
        constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
        stride = width + 4;
        const auto size = static_cast<std::size_t>(stride) * static_cast<std::size_t>(rows + 2);
        near.assign(size + 4, 0);  // four bytes are read at once
        outX.assign(size, kNone);
        outY.assign(size, kNone);
        high.assign(size, -kFar);
        low.assign(size, kFar);
        count.assign(size, 0.0f);
        any = true;
    }
    /// The element of a pixel of the picture.
    [[nodiscard]] std::size_t element(int x, int y) const {
        return static_cast<std::size_t>(y - top + 1) * static_cast<std::size_t>(stride) +
               static_cast<std::size_t>(x - left + 1);
    }
    [[nodiscard]] OutlineRows arrays() {
        return {width,       rows,        left,        top,        stride,      near.data(),
                outX.data(), outY.data(), high.data(), low.data(), count.data()};
    }
};

Outlines::Outlines(Outlines&&) noexcept = default;
Outlines::~Outlines() = default;

Outlines::Outlines(PageSet set, const GlassPages* glass) : set_(std::move(set)) {
    const auto rectangles = set_.rectangles();
    std::vector<std::vector<OutlineBlock>> found(rectangles.size());
    parallelFor(0, rectangles.size(), [&](std::int64_t n) {
        set_.settle();
        const PageRectangle& r = rectangles[n];
        if (set_.views()[r.view].unread) return;
        const auto number = static_cast<std::size_t>(r.page);
        const Page& page = set_.pages()[number];
        for (int v = 0; v < r.height; v += kOutlineBlock) {
            for (int u = 0; u < r.width; u += kOutlineBlock) {
                OutlineBlock b;
                b.rectangle = static_cast<std::uint32_t>(n);
                b.u0 = static_cast<std::uint16_t>(u);
                b.v0 = static_cast<std::uint16_t>(v);
                b.u1 = static_cast<std::uint16_t>(std::min(u + kOutlineBlock, r.width));
                b.v1 = static_cast<std::uint16_t>(std::min(v + kOutlineBlock, r.height));
                for (int y = v; y < b.v1; ++y) {
                    const std::size_t first =
                        static_cast<std::size_t>(r.pageY + y) * page.width() + r.pageX;
                    const float* depth = page.depth->data() + first;
                    for (int x = u; x < b.u1; ++x) {
                        if (!hasPoint(depth[x]) || !solid(set_, glass, number, first + x)) continue;
                        b.solid[y - v] |= static_cast<std::uint16_t>(1u << (x - u));
                        b.zMin = std::min(b.zMin, depth[x]);
                        b.zMax = std::max(b.zMax, depth[x]);
                    }
                }
                if (b.zMin < kNoDepth) found[n].push_back(b);
            }
        }
    });
    for (const auto& f : found) blocks_.insert(blocks_.end(), f.begin(), f.end());
}

std::vector<std::uint8_t> Outlines::askedViews(const Camera& camera) const {
    const auto views = set_.views();
    std::array<Side, kSides> sides{};
    for (const Band& band : bands_)
        for (std::size_t s = 0; s < kSides; ++s) sides[s].add(band.sides[s]);
    constexpr double kUnseen = -std::numeric_limits<double>::infinity();
    // By side and view: how much it looks at that side from in front, if it shows it at all.
    std::array<std::vector<double>, kSides> looks;
    for (std::size_t s = 0; s < kSides; ++s) {
        if (sides[s].count == 0) continue;
        const glm::dvec3 at = camera.position + camera.orientation * (sides[s].at / sides[s].count);
        const glm::dvec3 out = camera.orientation * sides[s].out;
        for (const PageView& view : views) {
            const Camera& c = view.camera;
            const glm::dvec3 from = c.orthographic ? -c.forward() : c.position - at;
            const glm::dvec3 seen = c.project(glm::conjugate(c.orientation) * (at - c.position));
            const bool shows = (c.orthographic || seen.z > 0) && seen.x >= 0 && seen.y >= 0 &&
                               seen.x < c.width && seen.y < c.height;
            looks[s].push_back(shows ? glm::dot(from, out) / glm::length(from) : kUnseen);
        }
    }
    // The best of each side first, then some of the others, evenly spread. No view on a turntable
    // looks from in front at the top of the object, and many views that see it flat tell more than
    // few.
    std::vector<std::uint8_t> asked(views.size(), 0);
    std::size_t count = 0;
    for (const std::vector<double>& of : looks) {
        std::size_t best = views.size();
        for (std::size_t i = 0; i < of.size(); ++i)
            if (!asked[i] && of[i] > kUnseen && (best == views.size() || of[i] > of[best]))
                best = i;
        if (best == views.size()) continue;
        asked[best] = 1;
        ++count;
    }
    // By how much they look at any side, so that the order of the views does not matter.
    std::vector<std::size_t> others;
    std::vector<double> most(views.size(), kUnseen);
    for (std::size_t i = 0; i < views.size(); ++i) {
        for (const std::vector<double>& of : looks)
            if (!of.empty()) most[i] = std::max(most[i], of[i]);
        if (!asked[i] && most[i] > kUnseen) others.push_back(i);
    }
    std::ranges::stable_sort(others, std::greater(), [&](std::size_t i) { return most[i]; });
    const std::size_t more = std::min(kMostViews - count, others.size());
    for (std::size_t k = 0; k < more; ++k) asked[others[k * others.size() / more]] = 1;
    return asked;
}

OutlineDepths Outlines::depthsOf(const OutlineBlock& block) const {
    const PageRectangle& r = set_.rectangles()[block.rectangle];
    const Page& page = set_.pages()[r.page];
    const auto stride = static_cast<std::size_t>(page.width());
    return {page.depth->data() + static_cast<std::size_t>(r.pageY) * stride + r.pageX, stride};
}

void Outlines::beginBand(std::size_t n, const Frame& frame, const Camera& camera,
                         const Image<float>& covered, const Extent& part, bool sides,
                         Image<std::uint8_t>& tiles) {
    const int w = frame.depth.width(), h = frame.depth.height();
    // Points beside the part tell of what is in it, too.
    const Extent around = part.grown(1, w, h);
    Band& band = bands_[n];
    band.left = around.x0;
    band.top = static_cast<int>(n) * kBandRows;
    band.rows = std::min(kBandRows, h - band.top);
    band.width = around.x1 - around.x0;
    band.any = false;
    band.blocks.clear();
    band.sides = {};
    const int last = std::min(part.y1, band.top + band.rows);
    for (int y = std::max(part.y0, band.top); y < last; ++y) {
        const auto prepare = [&](int column) {
            const int x = part.x0 + column;
            const glm::vec2 out = outwardAt(frame.depth, x, y);
            if (out == glm::vec2(0.0f)) return;
            if (!band.any) band.make();
            if (const float dist = frame.depth.at(x, y); sides && hasPoint(dist)) {
                const glm::dvec3 place = camera.unproject(x + 0.5, y + 0.5, dist);
                band.sides[Side::of(out)].add({place, {out.x, -out.y, 0}, 1});
            }
            const std::size_t at = band.element(x, y);
            band.outX[at] = out.x;
            band.outY[at] = out.y;
            for (int j = 0; j <= 2; ++j)
                for (int i = x - 1; i <= x + 1; ++i)
                    band.near[band.element(i, y + j - 1)] |= static_cast<std::uint8_t>(4 >> j);
            tiles.at(x / kTile, y / kTile) = 1;
        };
        forWhere(
            covered.row(y).subspan(static_cast<std::size_t>(part.x0),
                                   static_cast<std::size_t>(part.x1 - part.x0)),
            [](float c) { return c == kAsked; }, prepare);
    }
}

void Outlines::findBlocks(const Camera& camera, const std::vector<PixelMap>& maps,
                          const std::vector<std::uint8_t>& asked, const Image<std::uint8_t>& tiles,
                          glm::ivec2 size) {
    std::vector<std::array<glm::vec3, 6>> coarseMaps;  // near enough for the reach of a block
    for (const PixelMap& m : maps) coarseMaps.push_back({m.a0, m.au, m.av, m.b0, m.bu, m.bv});
    // How many tiles above and to the left of each are marked: few blocks reach any, and the
    // others must not cost.
    Image<std::uint32_t> before(tiles.width() + 1, tiles.height() + 1);
    for (int y = 0; y < tiles.height(); ++y) {
        std::uint32_t row = 0;
        for (int x = 0; x < tiles.width(); ++x) {
            row += tiles.at(x, y);
            before.at(x + 1, y + 1) = before.at(x + 1, y) + row;
        }
    }
    struct Rows {
        int from = 0, to = -1;  // inclusive
    };
    std::vector<Rows> reached(blocks_.size());
    parallelFor(0, blocks_.size(), 512, [&](std::size_t n) {
        const OutlineBlock& b = blocks_[n];
        const PageRectangle& r = set_.rectangles()[b.rectangle];
        if (!asked.empty() && !asked[r.view]) return;
        const auto& [a0, au, av, b0, bu, bv] = coarseMaps[b.rectangle];
        // Eight corners side by side, so that compilers make vectors of it.
        std::array<float, 8> x, y, along;
        for (std::size_t corner = 0; corner < 8; ++corner) {
            const auto u = static_cast<float>(corner & 1 ? b.u1 - 1 : b.u0);
            const auto v = static_cast<float>(corner & 2 ? b.v1 - 1 : b.v0);
            const float z = corner & 4 ? b.zMax : b.zMin;
            const glm::vec3 at = (a0 + au * u + av * v) * z + b0 + bu * u + bv * v;
            const float scale = camera.orthographic ? 1.0f : 1.0f / at.z;
            along[corner] = at.z;
            x[corner] = at.x * scale;
            y[corner] = at.y * scale;
        }
        const auto [x0, x1] = std::ranges::minmax(x);
        const auto [y0, y1] = std::ranges::minmax(y);
        const float least = std::ranges::min(along);
        // What reaches behind the camera is too near to draw an outline.
        if (!(least > 0)) return;
        constexpr float kRoom = 1.5f;
        if (!(x1 >= -kRoom && y1 >= -kRoom && x0 <= static_cast<float>(size.x) + kRoom &&
              y0 <= static_cast<float>(size.y) + kRoom))
            return;
        const int left = static_cast<int>(std::max(0.0f, x0 - kRoom));
        const int right = static_cast<int>(std::min(static_cast<float>(size.x - 1), x1 + kRoom));
        const int above = static_cast<int>(std::max(0.0f, y0 - kRoom));
        const int below = static_cast<int>(std::min(static_cast<float>(size.y - 1), y1 + kRoom));
        const int endX = right / kTile + 1, endY = below / kTile + 1;
        if (before.at(endX, endY) - before.at(left / kTile, endY) !=
            before.at(endX, above / kTile) - before.at(left / kTile, above / kTile))
            reached[n] = {above, below};
    });
    for (std::size_t n = 0; n < blocks_.size(); ++n)
        for (int b = reached[n].from / kBandRows; b <= reached[n].to / kBandRows; ++b)
            if (reached[n].to >= 0 && bands_[b].any)
                bands_[b].blocks.push_back(static_cast<std::uint32_t>(n));
}

void Outlines::measureBand(std::size_t n, const Camera& camera, const std::vector<PixelMap>& maps,
                           Image<float>& covered) {
    Band& band = bands_[n];
    if (!band.any) return;
    const OutlineRows rows = band.arrays();
    for (std::size_t k = 0; k < band.blocks.size(); ++k) {
        const OutlineBlock& block = blocks_[band.blocks[k]];
        const bool last = k + 1 == band.blocks.size();
        const OutlineBlock& next = last ? block : blocks_[band.blocks[k + 1]];
        addOutlinePoints(block, depthsOf(block), maps[block.rectangle], camera.orthographic, next,
                         last ? OutlineDepths{} : depthsOf(next), rows);
    }
    for (int y = band.top; y < band.top + band.rows; ++y) {
        const std::size_t first = band.element(band.left, y);
        const auto measured = [&](int column) {
            const std::size_t at = first + static_cast<std::size_t>(column);
            const float nx = band.outX[at], ny = band.outY[at];
            covered.at(band.left + column, y) =
                std::max(0.0f, areaBelow(band.high[at], nx, ny) - areaBelow(band.low[at], nx, ny));
        };
        forWhere(
            std::span(band.count).subspan(first, static_cast<std::size_t>(band.width)),
            [](float points) { return points >= kEnoughPoints; }, measured);
    }
}

void Outlines::measure(const Frame& frame, const Camera& camera, Image<float>& covered,
                       const Extent& within) {
    const int w = frame.depth.width(), h = frame.depth.height();
    const Extent part = within.grown(0, w, h);
    static_assert(kBandRows % kTile == 0);
    Image<std::uint8_t> tiles((w + kTile - 1) / kTile, (h + kTile - 1) / kTile);
    bands_.resize(static_cast<std::size_t>((h + kBandRows - 1) / kBandRows));
    const auto bands = static_cast<std::int64_t>(bands_.size());
    // Pruned views share the surface among them: all are needed.
    const bool choose = set_.views().size() > kMostViews && !set_.pruned();
    parallelFor(0, bands,
                [&](std::size_t n) { beginBand(n, frame, camera, covered, part, choose, tiles); });
    std::vector<PixelMap> maps;
    maps.reserve(set_.rectangles().size());
    for (const PageRectangle& r : set_.rectangles()) maps.push_back(pixelMap(r.window, camera));
    const auto asked = choose ? askedViews(camera) : std::vector<std::uint8_t>();
    findBlocks(camera, maps, asked, tiles, {w, h});
    parallelFor(0, bands, [&](std::size_t n) { measureBand(n, camera, maps, covered); });
}

}  // namespace stx

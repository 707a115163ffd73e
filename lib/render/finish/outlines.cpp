#include "lib/render/finish/outlines.hpp"

#include <hwy/cache_control.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "lib/base/parallel.hpp"
#include "lib/render/splat/plan.hpp"

namespace stx {
namespace {

// Where no source is named the value was chosen by trial on the project's image sets and meshes.

constexpr int kBandRows = 64;
constexpr int kTile = 4;
/// Pixels on each side that tell which way an outline runs.
constexpr int kAround = 2;
/// Points this far beside a pixel's centre, along the outline, tell where it runs; pixels.
constexpr float kBeside = 0.6f;
/// So many of them must be there.
constexpr float kEnoughPoints = 12.0f;
/// The outline of less even surroundings has no direction; of the sum of weights.
constexpr float kLeastDirection = 0.15f;

/// Area of the part of a unit square, centred at the origin, on which n . x < t; n has length 1.
float areaBelow(float t, float nx, float ny) {
    const float a = std::max(std::abs(nx), std::abs(ny)), b = std::min(std::abs(nx), std::abs(ny));
    const float half = 0.5f * (a + b), size = std::abs(t);
    if (size >= half) return t > 0 ? 1.0f : 0.0f;
    if (size <= 0.5f * (a - b)) return 0.5f + t / a;
    const float corner = (half - size) * (half - size) / (2 * a * b);
    return t > 0 ? 1.0f - corner : corner;
}

bool solid(const Texture& texture, std::size_t texel) {
    return PageSet::alphaOf(texture, texel) >= 0.5f;
}

}  // namespace

/// Rows of the picture that one thread owns. Images have a border of one pixel, and two pixels more
/// at the right, since four are added to at once.
struct Outlines::Band {
    int top = 0, rows = 0, width = 0;
    bool any = false;          ///< some pixel is asked for; else the images are empty
    Image<std::uint8_t> near;  ///< 1 where a pixel or a neighbour is asked for
    Image<float> outX, outY;   ///< out of the object, length 1; NaN where not asked for
    Image<float> high, low;    ///< outermost and innermost point along that, pixels
    Image<float> count;        ///< of points
    std::vector<std::uint32_t> blocks;

    void make() {
        constexpr float kFar = std::numeric_limits<float>::infinity();
        constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
        const int w = width + 4, h = rows + 2;
        near = Image<std::uint8_t>(w, h);
        outX = Image<float>(w, h, kNone);
        outY = Image<float>(w, h, kNone);
        high = Image<float>(w, h, -kFar);
        low = Image<float>(w, h, kFar);
        count = Image<float>(w, h);
        any = true;
    }
};

Outlines::Outlines(PageSet set) : set_(std::move(set)) {
    const auto rectangles = set_.rectangles();
    std::vector<std::vector<Block>> found(rectangles.size());
    parallelFor(0, static_cast<std::int64_t>(rectangles.size()), [&](std::int64_t n) {
        const PageRectangle& r = rectangles[static_cast<std::size_t>(n)];
        const Page& page = set_.pages()[static_cast<std::size_t>(r.page)];
        for (int v = 0; v < r.height; v += kBlockSide) {
            for (int u = 0; u < r.width; u += kBlockSide) {
                Block b;
                b.rectangle = static_cast<std::uint32_t>(n);
                b.u0 = static_cast<std::uint16_t>(u);
                b.v0 = static_cast<std::uint16_t>(v);
                b.u1 = static_cast<std::uint16_t>(std::min(u + kBlockSide, r.width));
                b.v1 = static_cast<std::uint16_t>(std::min(v + kBlockSide, r.height));
                for (int y = v; y < b.v1; ++y) {
                    const std::size_t first =
                        static_cast<std::size_t>(r.pageY + y) * page.width() + r.pageX;
                    const float* depth = page.depth->data() + first;
                    for (int x = u; x < b.u1; ++x) {
                        if (!hasPoint(depth[x]) || !solid(*page.texture, first + x)) continue;
                        b.solid[y - v] |= static_cast<std::uint16_t>(1u << (x - u));
                        b.zMin = std::min(b.zMin, depth[x]);
                        b.zMax = std::max(b.zMax, depth[x]);
                    }
                }
                if (b.zMin < kNoDepth) found[static_cast<std::size_t>(n)].push_back(b);
            }
        }
    });
    for (const auto& f : found) blocks_.insert(blocks_.end(), f.begin(), f.end());
}

/// Adds a point to four pixels of a row, from `first` on; it lies (dx, dy) from the first one's
/// centre. Without branches, so that compilers make vectors of it.
void Outlines::addToRow(Band& band, std::size_t first, float dx, float dy) {
    const float* __restrict nx = band.outX.data() + first;
    const float* __restrict ny = band.outY.data() + first;
    float* __restrict high = band.high.data() + first;
    float* __restrict low = band.low.data() + first;
    float* __restrict count = band.count.data() + first;
    for (int k = 0; k < 4; ++k) {
        const float x = dx - static_cast<float>(k);
        const float along = nx[k] * x + ny[k] * dy;
        const bool in = std::abs(nx[k] * dy - ny[k] * x) <= kBeside && std::abs(x) <= 1.5f;
        const float up = in ? along : -std::numeric_limits<float>::infinity();
        const float down = in ? along : std::numeric_limits<float>::infinity();
        high[k] = up > high[k] ? up : high[k];
        low[k] = down < low[k] ? down : low[k];
        count[k] += in ? 1.0f : 0.0f;
    }
}

void Outlines::addPoints(const Block& block, const splat::PixelMap& m, bool orthographic,
                         const Block* ahead, Band& band) const {
    // Memory cannot tell what comes next from rows of 16 pixels that are thousands of bytes apart.
    const auto fetch = [&](int rowAhead) {
        if (!ahead || ahead->v0 + rowAhead >= ahead->v1) return;
        const PageRectangle& next = set_.rectangles()[ahead->rectangle];
        const Page& its = set_.pages()[static_cast<std::size_t>(next.page)];
        hwy::Prefetch(its.depth->row(next.pageY + ahead->v0 + rowAhead).data() + next.pageX +
                      ahead->u1 - 1);
    };
    const PageRectangle& r = set_.rectangles()[block.rectangle];
    const Page& page = set_.pages()[static_cast<std::size_t>(r.page)];
    const auto width = static_cast<float>(band.width), rows = static_cast<float>(band.rows);
    const auto top = static_cast<float>(band.top);
    // Without branches, so that compilers make vectors of it; of what is not a number `low`.
    const auto held = [](float value, float low, float high) {
        value = value > low ? value : low;
        return value < high ? value : high;
    };
    const float perspective = orthographic ? 0.0f : 1.0f;
    float px[kBlockSide], py[kBlockSide], pz[kBlockSide];
    int column[kBlockSide], row[kBlockSide];
    const std::uint8_t* const near = band.near.data();
    const int stride = band.near.width();
    for (int v = block.v0; v < block.v1; ++v) {
        fetch(v - block.v0);
        const std::uint32_t points = block.solid[v - block.v0];
        if (!points) continue;
        const std::size_t first = static_cast<std::size_t>(r.pageY + v) * page.width() + r.pageX;
        const float* depth = page.depth->data() + first + block.u0;
        const glm::vec3 a(m.a0 + m.au * double(block.u0) + m.av * double(v));
        const glm::vec3 b(m.b0 + m.bu * double(block.u0) + m.bv * double(v));
        const glm::vec3 au(m.au), bu(m.bu);
        const int count = block.u1 - block.u0;
        for (int i = 0; i < count; ++i) {
            const auto at = static_cast<float>(i);
            const float z = depth[i];
            pz[i] = (a.z + at * au.z) * z + b.z + at * bu.z;
            const float w = perspective / pz[i] + (1.0f - perspective);
            px[i] = ((a.x + at * au.x) * z + b.x + at * bu.x) * w;
            py[i] = ((a.y + at * au.y) * z + b.y + at * bu.y) * w - top;
            // From the upper left corner of the border.
            column[i] = static_cast<int>(held(px[i], -1.0f, width) + 1.5f);
            row[i] = static_cast<int>(held(py[i], -1.0f, rows) + 1.5f);
        }
        for (std::uint32_t rest = points; rest; rest &= rest - 1) {
            const int i = std::countr_zero(rest);
            const int x = column[i], y = row[i];
            if (!near[y * stride + x]) continue;
            if (!(pz[i] > 0 && px[i] >= -0.5f && px[i] < width - 0.5f && py[i] >= -1.5f &&
                  py[i] < rows + 0.5f))
                continue;
            for (int j = y == 0 ? 0 : y - 1; j <= std::min(y + 1, band.rows + 1); ++j)
                addToRow(band, static_cast<std::size_t>(j * stride + x - 1),
                         px[i] - static_cast<float>(x - 2), py[i] - static_cast<float>(j - 1));
        }
    }
}

void Outlines::measure(const Frame& frame, const Camera& camera, Image<float>& covered) const {
    const int w = frame.depth.width(), h = frame.depth.height();
    const int tilesX = (w + kTile - 1) / kTile, tilesY = (h + kTile - 1) / kTile;
    static_assert(kBandRows % kTile == 0);
    Image<std::uint8_t> tiles(tilesX, tilesY);
    std::vector<Band> bands(static_cast<std::size_t>((h + kBandRows - 1) / kBandRows));
    parallelFor(0, static_cast<std::int64_t>(bands.size()), [&](std::int64_t n) {
        Band& band = bands[static_cast<std::size_t>(n)];
        band.top = static_cast<int>(n) * kBandRows;
        band.rows = std::min(kBandRows, h - band.top);
        band.width = w;
        for (int y = band.top; y < band.top + band.rows; ++y) {
            for (int x = 0; x < w; ++x) {
                if (covered.at(x, y) != kAsked) continue;
                float nx = 0, ny = 0, all = 0;
                for (int j = -kAround; j <= kAround; ++j) {
                    for (int i = -kAround; i <= kAround; ++i) {
                        if (i == 0 && j == 0) continue;
                        const float weight = 1.0f / static_cast<float>(i * i + j * j);
                        all += weight;
                        const int a = x + i, b = y + j;
                        if (a < 0 || b < 0 || a >= w || b >= h || hasPoint(frame.depth.at(a, b)))
                            continue;
                        nx += weight * static_cast<float>(i);
                        ny += weight * static_cast<float>(j);
                    }
                }
                const float length = std::hypot(nx, ny);
                if (!(length > kLeastDirection * all)) continue;
                if (!band.any) band.make();
                const int row = y - band.top;
                band.outX.at(x + 1, row + 1) = nx / length;
                band.outY.at(x + 1, row + 1) = ny / length;
                for (int j = row; j <= row + 2; ++j)
                    for (int i = x; i <= x + 2; ++i) band.near.at(i, j) = 1;
                tiles.at(x / kTile, y / kTile) = 1;
            }
        }
    });

    std::vector<splat::PixelMap> maps;
    for (const PageRectangle& r : set_.rectangles())
        maps.push_back(splat::pixelMap(r.window, camera));

    // Which blocks have points there.
    struct Rows {
        int from = 0, to = -1;  // inclusive
    };
    std::vector<Rows> reached(blocks_.size());
    parallelForBlocks(
        0, static_cast<std::int64_t>(blocks_.size()), 512, [&](std::int64_t from, std::int64_t to) {
            for (auto n = static_cast<std::size_t>(from); n < static_cast<std::size_t>(to); ++n) {
                const Block& b = blocks_[n];
                const splat::PixelMap& m = maps[b.rectangle];
                double x0 = 1e300, y0 = 1e300, x1 = -1e300, y1 = -1e300, least = 1e300;
                for (int corner = 0; corner < 4; ++corner) {
                    const double u = (corner & 1) ? b.u1 - 1 : b.u0;
                    const double v = (corner & 2) ? b.v1 - 1 : b.v0;
                    const glm::dvec3 a = m.a0 + m.au * u + m.av * v, o = m.b0 + m.bu * u + m.bv * v;
                    for (const float z : {b.zMin, b.zMax}) {
                        const glm::dvec3 at = a * double(z) + o;
                        least = std::min(least, at.z);
                        const double scale = camera.orthographic ? 1.0 : 1.0 / at.z;
                        x0 = std::min(x0, at.x * scale);
                        x1 = std::max(x1, at.x * scale);
                        y0 = std::min(y0, at.y * scale);
                        y1 = std::max(y1, at.y * scale);
                    }
                }
                // What reaches behind the camera is too near to draw an outline.
                if (!(least > 0)) continue;
                constexpr double kRoom = 1.5;
                if (!(x1 >= -kRoom && y1 >= -kRoom && x0 <= w + kRoom && y0 <= h + kRoom)) continue;
                const int left = static_cast<int>(std::max(0.0, x0 - kRoom));
                const int right = static_cast<int>(std::min(w - 1.0, x1 + kRoom));
                const int above = static_cast<int>(std::max(0.0, y0 - kRoom));
                const int below = static_cast<int>(std::min(h - 1.0, y1 + kRoom));
                for (int y = above / kTile; y <= below / kTile && reached[n].to < 0; ++y)
                    for (int x = left / kTile; x <= right / kTile; ++x)
                        if (tiles.at(x, y)) reached[n] = {above, below};
            }
        });
    for (std::size_t n = 0; n < blocks_.size(); ++n)
        for (int b = reached[n].from / kBandRows; b <= reached[n].to / kBandRows; ++b)
            if (reached[n].to >= 0 && bands[static_cast<std::size_t>(b)].any)
                bands[static_cast<std::size_t>(b)].blocks.push_back(static_cast<std::uint32_t>(n));

    parallelFor(0, static_cast<std::int64_t>(bands.size()), [&](std::int64_t n) {
        Band& band = bands[static_cast<std::size_t>(n)];
        for (std::size_t k = 0; k < band.blocks.size(); ++k) {
            const Block& block = blocks_[band.blocks[k]];
            const Block* ahead =
                k + 1 < band.blocks.size() ? &blocks_[band.blocks[k + 1]] : nullptr;
            addPoints(block, maps[block.rectangle], camera.orthographic, ahead, band);
        }
        if (!band.any) return;
        for (int y = 0; y < band.rows; ++y) {
            const auto count = band.count.row(y + 1);
            for (int x = 0; x < w; ++x) {
                if (count[x + 1] < kEnoughPoints) continue;
                const float nx = band.outX.at(x + 1, y + 1), ny = band.outY.at(x + 1, y + 1);
                covered.at(x, band.top + y) =
                    std::max(0.0f, areaBelow(band.high.at(x + 1, y + 1), nx, ny) -
                                       areaBelow(band.low.at(x + 1, y + 1), nx, ny));
            }
        }
    });
}

}  // namespace stx

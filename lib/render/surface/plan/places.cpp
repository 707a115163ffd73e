#include "lib/render/surface/plan/places.hpp"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "lib/base/parallel.hpp"

namespace stx::surface {
namespace {

/// Pixels of the sources that are looked at in a frame, all sources together, where each fills it.
/// With sixteen times as many, pictures of balls, eggs and tori from octahedral:4 differ by at most
/// 0.1 dB, and drawing spot from 16 views takes a tenth longer.
constexpr double kMostPlaces = 1 << 16;
/// The farthest that such pixels lie apart, pixels of the frame, when there are hundreds of views.
constexpr double kFarthestApart = kTile / 2;
/// A place is shown well enough by so many sources. One alone may show it at its very edge, and
/// votes remove what no other source supports: with one, the same balls are 1.4 dB and the eggs 1.2
/// dB worse.
constexpr int kEnough = 2;
/// Side of the cells in which the nearest place hides what is behind it, pixels of the frame. With
/// 8, a triangle of 15 pixels that a bowl lacks was open, since what is behind it was taken for
/// hidden (28.5 dB; 47.0 with 4, 47.1 with 2). The oak tree and spot from 64 views take as long.
constexpr int kCell = 2;

/// A pixel of a source where it falls in the frame.
struct ShownPlace {
    float x, y, q;
    float rise;  ///< how much its surface changes q along x and y, pixels of the frame, together
};

/// The nearest places of a frame, by cell.
class Nearest {
  public:
    explicit Nearest(const TileGrid& tiles)
        : first_(tiles.first),
          columns_(tiles.size.x * kTile / kCell),
          q_(static_cast<std::size_t>(tiles.count()) * (kTile / kCell) * (kTile / kCell), 0.0f) {}
    void add(float x, float y, float q) {
        float& most = q_[cellOf(x, y)];
        most = std::max(most, q);
    }
    void add(const Nearest& other) {
        for (std::size_t i = 0; i < q_.size(); ++i) q_[i] = std::max(q_[i], other.q_[i]);
    }
    /// Whether something else is before the place: not its own surface, elsewhere in the cell.
    [[nodiscard]] bool hides(const ShownPlace& p, const DepthAxis& axis) const {
        return q_[cellOf(p.x, p.y)] >
               p.q + kOneSurface * axis.relativeScale(p.q) + 2 * kCell * p.rise;
    }

  private:
    [[nodiscard]] std::size_t cellOf(float x, float y) const {
        const glm::ivec2 cell = glm::ivec2(glm::vec2(x, y) - glm::vec2(first_)) / kCell;
        return static_cast<std::size_t>(cell.y * columns_ + cell.x);
    }
    glm::ivec2 first_;
    int columns_;
    std::vector<float> q_;
};

/// Pixels of a block along one axis, `step` apart, and the first and the last of the picture: what
/// it alone shows may end there, in a tile that has no other pixel of it.
struct PixelsApart {
    int end, first;

    PixelsApart(int begin, int size, int step)
        : end(std::min(kBlock, size - begin)),
          first(begin == 0 ? 0 : std::min(step, end) / 2),
          step_(step),
          endsPicture_(begin + end == size) {}
    [[nodiscard]] int after(int at) const {
        const int next = at == 0 && step_ > 1 ? step_ / 2 : at + step_;
        return endsPicture_ && next >= end ? std::max(at + 1, end - 1) : next;
    }

  private:
    int step_;
    bool endsPicture_;
};

/// The pixels of a source in a frame.
class PlacesOf {
  public:
    PlacesOf(const FrameSource& f, const SurfaceFrame& frame)
        : source_(*f.source),
          warp_(warpFrom(f.pixelFromSource)),
          eye_(eyeIn(*f.source, frame.space.camera)),
          first_(frame.tiles.first),
          end_(frame.tiles.first + frame.tiles.size * kTile),
          qLimit_(frame.qLimit()) {}

    /// Calls visit(x, y, q, rise) for those of some blocks that face the camera, about so many
    /// pixels of the frame apart; rise(): see ShownPlace.
    template <class Visit>
    void visit(const PlacedBlocks& blocks, double apart, const Visit& visit) const {
        for (std::uint32_t i = blocks.begin; i < blocks.end; ++i)
            visitBlock(static_cast<int>(source_.planned[i]), apart, visit);
    }

  private:
    /// How the point at (x, y, q) of the frame, of this w, moves by a pixel of the source along
    /// column `n` of the warp, when q changes by `slope`.
    [[nodiscard]] glm::vec3 stepOf(std::size_t n, float slope, glm::vec3 at, float w) const {
        const auto& m = warp_.m;
        const float change = m[12 + n] + slope * m[14];
        return glm::vec3(m[n] + slope * m[2] - at.x * change,
                         m[4 + n] + slope * m[6] - at.y * change,
                         m[8 + n] + slope * m[10] - at.z * change) /
               w;
    }
    [[nodiscard]] float riseOf(glm::vec2 slope, glm::vec3 at, float w) const {
        const glm::vec3 a = stepOf(0, slope.x, at, w), b = stepOf(1, slope.y, at, w);
        const float area = std::abs(a.x * b.y - a.y * b.x);
        return (std::abs(a.z * b.y - b.z * a.y) + std::abs(b.z * a.x - a.z * b.x)) /
               std::max(area, 1e-12f);
    }
    /// The step is a power of two, so that the pixels of all blocks are evenly apart.
    [[nodiscard]] int pixelsApart(const BlockRange& block, int x0, int y0, double apart) const {
        constexpr float half = 0.5f * kBlock;
        const glm::vec4 h =
            warp_.homogeneous(static_cast<float>(x0) + half, static_cast<float>(y0) + half,
                              0.5f * (block.qMin + block.qMax));
        int pixels = 1;
        if (!(h.w > 0)) return pixels;
        const glm::vec3 at = glm::vec3(h) / h.w;
        const glm::vec3 a = stepOf(0, 0.0f, at, h.w), b = stepOf(1, 0.0f, at, h.w);
        const double most = std::max(std::max(std::abs(a.x), std::abs(a.y)),
                                     std::max(std::abs(b.x), std::abs(b.y)));
        while (pixels < kBlock && 2 * pixels * most <= apart) pixels *= 2;
        return pixels;
    }
    template <class Visit>
    void visitBlock(int number, double apart, const Visit& visit) const {
        const Source& s = source_;
        const int x0 = number % s.blocksX * kBlock, y0 = number / s.blocksX * kBlock;
        int step = pixelsApart(s.blocks[static_cast<std::size_t>(number)], x0, y0, apart);
        BlockBuffer buffer;
        const BlockTexels texels = blockTexels(s, x0, y0, buffer);
        if (step > 1) {
            // Pixels of a surface that the source sees at a low angle are much farther apart in a
            // frame from aside than those of one that faces it.
            float most = 0;
            visitPixels(texels, x0, y0, step, [&](glm::vec3 at, float w, glm::vec2 slope) {
                const glm::vec3 a = stepOf(0, slope.x, at, w), b = stepOf(1, slope.y, at, w);
                most = std::max({most, std::abs(a.x), std::abs(a.y), std::abs(b.x), std::abs(b.y)});
            });
            while (step > 1 && step * most > 2 * apart) step /= 2;
        }
        visitPixels(texels, x0, y0, step, [&](glm::vec3 at, float w, glm::vec2 slope) {
            visit(at.x, at.y, at.z, [&] { return riseOf(slope, at, w); });
        });
    }
    /// Calls visit(at, w, slope) for those pixels of a block, `step` apart, that face the camera
    /// and are in the frame: `at` there, with this w, and the slope of q in the source.
    template <class Visit>
    void visitPixels(const BlockTexels& texels, int x0, int y0, int step,
                     const Visit& visit) const {
        const Source& s = source_;
        const PixelsApart columns(x0, s.width, step), rows(y0, s.height, step);
        for (int j = rows.first; j < rows.end; j = rows.after(j)) {
            for (int i = columns.first; i < columns.end; i = columns.after(i)) {
                const std::ptrdiff_t texel = texels.at(i, j);
                const float q = texels.q[texel];
                if (!(q > 0)) continue;
                const float u = static_cast<float>(x0 + i) + 0.5f,
                            v = static_cast<float>(y0 + j) + 0.5f;
                const glm::vec4 h = warp_.homogeneous(u, v, q);
                if (!(h.w > 0)) continue;
                const glm::vec3 at = glm::vec3(h) / h.w;
                if (!(at.x >= first_.x && at.y >= first_.y && at.x < end_.x && at.y < end_.y &&
                      at.z < qLimit_))
                    continue;
                const glm::vec2 slope = gradientFrom(texels.q + texel, texels.info + texel, 1,
                                                     texels.stride, x0 + i > 0, y0 + j > 0);
                // See isTurnedAway().
                if (slope.x * (eye_.x - u * eye_.w) + slope.y * (eye_.y - v * eye_.w) >
                    eye_.z - q * eye_.w)
                    continue;
                visit(at, h.w, slope);
            }
        }
    }

    const Source& source_;
    Warp warp_;
    glm::vec4 eye_;          ///< the frame's, see eyeIn()
    glm::vec2 first_, end_;  ///< of the tiles, pixels
    float qLimit_;
};

/// Whether a source shows the surface at a place of the frame: by the pixel that it falls in.
bool shows(const FrameSource& f, const ShownPlace& p) {
    const glm::vec4 h = f.sourceFromPixel.homogeneous(p.x, p.y, p.q);
    if (!(h.w > 0)) return false;
    const Source& s = *f.source;
    const float u = h.x / h.w, v = h.y / h.w, at = h.z / h.w;
    if (!(u >= 0 && v >= 0 && u < static_cast<float>(s.width) && v < static_cast<float>(s.height)))
        return false;
    const int x = static_cast<int>(u), y = static_cast<int>(v);
    const Place kept = s.placeOf(x, y);
    const float there = s.qAt(kept, 0, 0);
    if (!(there > 0)) return false;
    const glm::vec2 g = s.gradientAt(kept, 0, 0, x, y);
    const float predicted =
        there + g.x * (u - 0.5f - static_cast<float>(x)) + g.y * (v - 0.5f - static_cast<float>(y));
    const float within = (kOnSurface + s.noise) * s.space.axis.relativeScale(at) +
                         s.step * s.space.axis.qPerUnit(at) +
                         kOnSlope * (std::abs(g.x) + std::abs(g.y));
    return std::abs(at - predicted) <= within;
}

bool enoughShow(const SurfaceFrame& frame, const std::vector<int>& chosen, const ShownPlace& p) {
    int count = 0;
    for (const int k : chosen) {
        count += shows(frame.sources[static_cast<std::size_t>(k)], p);
        if (count == kEnough) return true;
    }
    return false;
}

/// A place that too few sources of its tile show, and another source that does.
struct Wanting {
    ShownPlace place;
    int source;
};

/// Adds the sources that show most of what is wanting, one by one.
void addSources(const SurfaceFrame& frame, std::vector<Wanting> wanting, std::vector<int>& chosen) {
    std::vector<int> count(frame.sources.size());
    while (!wanting.empty() && chosen.size() < kMostTileSources) {
        std::fill(count.begin(), count.end(), 0);
        for (const Wanting& w : wanting) ++count[static_cast<std::size_t>(w.source)];
        const auto next =
            static_cast<int>(std::max_element(count.begin(), count.end()) - count.begin());
        chosen.push_back(next);
        std::erase_if(wanting, [&](const Wanting& w) {
            return w.source == next || enoughShow(frame, chosen, w.place);
        });
    }
    std::sort(chosen.begin(), chosen.end());
}

}  // namespace

void addSourcesOfPlaces(SurfaceFrame& frame, std::span<const std::vector<PlacedBlocks>> placed) {
    const Camera& camera = frame.space.camera;
    const auto count = static_cast<std::int64_t>(frame.sources.size());
    const double all =
        static_cast<double>(camera.width) * camera.height * static_cast<double>(count);
    const double apart = std::min(std::sqrt(all / kMostPlaces), kFarthestApart);
    const auto tileOf = [&](float x, float y) {
        return static_cast<std::size_t>(
            frame.tiles.at({static_cast<int>(std::floor(x)), static_cast<int>(std::floor(y))}));
    };
    Nearest nearest(frame.tiles);
    std::mutex mutex;
    // For each source, its places in tiles that are not built from it.
    std::vector<std::vector<ShownPlace>> others(frame.sources.size());
    parallelFor(0, count, [&](std::int64_t i) {
        const auto k = static_cast<std::size_t>(i);
        const PlacesOf places(frame.sources[k], frame);
        Nearest own(frame.tiles);
        for (const PlacedBlocks& blocks : placed[k]) {
            places.visit(blocks, apart, [&](float x, float y, float q, const auto& rise) {
                own.add(x, y, q);
                const std::vector<int>& chosen = frame.tileSources[tileOf(x, y)];
                if (!std::binary_search(chosen.begin(), chosen.end(), static_cast<int>(i)))
                    others[k].push_back({x, y, q, rise()});
            });
        }
        frame.sources[k].source->set->settle();
        const std::scoped_lock lock(mutex);
        nearest.add(own);
    });
    parallelFor(0, count, [&](std::int64_t i) {
        std::erase_if(others[static_cast<std::size_t>(i)], [&](const ShownPlace& p) {
            return nearest.hides(p, frame.space.axis) ||
                   enoughShow(frame, frame.tileSources[tileOf(p.x, p.y)], p);
        });
    });
    std::vector<std::vector<Wanting>> wanting(frame.tileSources.size());
    for (std::size_t k = 0; k < others.size(); ++k)
        for (const ShownPlace& p : others[k])
            wanting[tileOf(p.x, p.y)].push_back({p, static_cast<int>(k)});
    parallelFor(0, static_cast<std::int64_t>(wanting.size()), [&](std::int64_t i) {
        const auto t = static_cast<std::size_t>(i);
        if (!wanting[t].empty()) addSources(frame, std::move(wanting[t]), frame.tileSources[t]);
    });
}

}  // namespace stx::surface

#include "lib/render/surface/view_surfaces.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <memory>
#include <span>

#include "lib/base/parallel.hpp"
#include "lib/geometry/pixel_space.hpp"
#include "lib/model/peak_memory.hpp"
#include "lib/refine/edge_colours.hpp"
#include "lib/render/surface/plan/plan.hpp"
#include "lib/render/surface/prepare/cells.hpp"
#include "lib/render/surface/reach.hpp"

namespace stx {
namespace {

using namespace surface;

/// Another view shows a place better when its samples are denser by this factor; below one tenth
/// more, both are kept and overlap, so that no gap opens between what is of one and of the other.
constexpr double kDenser = 1.1;
/// What samples of other views count at a crease: their triangles lie otherwise there, so that two
/// views may each find the other's better and leave a gap. In a room of flat walls there are gaps
/// at 1; at 0 stripes of what is seen from afar cost up to 3 dB.
constexpr double kAtCrease = 0.6;
/// What a background view's samples count.
constexpr double kBehind = 0.25;
/// Pixels from an edge within which samples mix what is on both sides of it.
constexpr int kMixed = 2;
/// Squared distance of colours of which nothing is seen: a step and a half of 8 bits in each
/// channel.
constexpr float kLeastApart = 1e-4f;
/// A surface is of one colour where it varies, squared, by this share of what is across the edge.
constexpr float kOneColour = 0.05f;
constexpr float kLeastAlpha = 0.5f;
constexpr std::uint32_t kNone = 0xffffffffu;

/// Places of a triangle, as shares of its corners: of small ones the first four.
constexpr glm::dvec3 kPlaces[] = {{1 / 3.0, 1 / 3.0, 1 / 3.0},
                                  {1, 0, 0},
                                  {0, 1, 0},
                                  {0, 0, 1},
                                  {0.5, 0.5, 0},
                                  {0, 0.5, 0.5},
                                  {0.5, 0, 0.5},
                                  {2 / 3.0, 1 / 6.0, 1 / 6.0},
                                  {1 / 6.0, 2 / 3.0, 1 / 6.0},
                                  {1 / 6.0, 1 / 6.0, 2 / 3.0}};

/// Its corners are pixels of a view, counted row by row.
struct Triangle {
    std::array<std::uint32_t, 3> corners;
};

/// The share of a distance that tells surfaces apart is one of so many times what the picture shows
/// there: of views below 28 degrees. 1.2 are an orthographic camera's (pixel_space.cpp).
constexpr double kWindows = 2.0;

/// How far an eye goes to the side of a photograph, of the median distance: as behindPhoto() has it
/// unless another distance is asked for.
constexpr double kEyeAside = 0.08;
/// What such an eye sees between two pixels beside each other, in pixels: a narrower gap is joined.
constexpr double kNarrowGap = 1.5;

/// One view and what is behind it: no third one shows anything where these two are open.
struct OnePlace {
    const Source* front = nullptr;
    const Source* behind = nullptr;
    glm::ivec2 border{0};  ///< of the view behind: its pixels at the left and above
    /// How far points move in the picture when an eye goes to the side, in pixels times distance.
    double parallax = 0;
};

/// Nothing, if a scene is anything else than two views from one place with one direction.
OnePlace onePlaceOf(const SurfaceScene& scene) {
    OnePlace place;
    for (const Source& s : scene.sources) (s.view->background ? place.behind : place.front) = &s;
    if (scene.sources.size() != 2 || !place.front || !place.behind) return {};
    const Camera &a = place.front->view->camera, &b = place.behind->view->camera;
    const glm::dvec2 border(b.cx - a.cx, b.cy - a.cy);
    place.border = glm::ivec2(glm::round(border));
    const bool same = a.position == b.position && a.orientation == b.orientation && a.fx == b.fx &&
                      a.fy == b.fy && a.orthographic == b.orthographic &&
                      glm::length(border - glm::dvec2(place.border)) < 1e-3;
    if (!same) return {};
    // A million pixels tell the median as well as all of a large photograph.
    const auto all = place.front->whole->q.pixels();
    const std::size_t step = std::max<std::size_t>(1, all.size() >> 20);
    std::vector<float> q;
    for (std::size_t i = 0; i < all.size(); i += step)
        if (all[i] > 0) q.push_back(all[i]);
    if (q.empty()) return {};
    const auto middle = q.begin() + static_cast<std::ptrdiff_t>(q.size() / 2);
    std::ranges::nth_element(q, middle);
    place.parallax = kEyeAside * place.front->space.axis.dist(*middle) * std::max(a.fx, a.fy);
    return place;
}

class Maker {
  public:
    explicit Maker(const SurfaceScene& scene)
        : scene_(scene),
          used_(scene.sources.size()),
          reaches_(scene.sources.begin(), scene.sources.end()),
          radius_(boundsOf(scene).radius()),
          onePlace_(onePlaceOf(scene)) {}

    /// Before surfaceOf() of any. Triangles are found again then: those of all views are many.
    void prepare(std::size_t number) {
        const Source& s = scene_.sources[number];
        used_[number].resize(static_cast<std::size_t>(s.width) * s.height);
        for (int by = 0; by < s.blocksY; ++by)
            for (int bx = 0; bx < s.blocksX; ++bx)
                for (const Triangle& t : trianglesOf(s, bx, by))
                    for (const std::uint32_t corner : t.corners) used_[number][corner] = true;
        for (const Leaf& leaf : s.leaves) useInside(s, leaf, used_[number]);
    }

    /// All triangles of a block of a view, without a choice among views.
    [[nodiscard]] std::vector<Triangle> trianglesOf(const Source& s, int column, int row) const {
        std::vector<Triangle> out;
        const auto add = [&](int ax, int ay, int bx, int by, int cx, int cy) {
            const Triangle t{{index(s, ax, ay), index(s, bx, by), index(s, cx, cy)}};
            for (const std::uint32_t corner : t.corners)
                if (!shows(s, corner)) return;
            out.push_back(t);
        };
        const SourceBlock& block = s.blocks[static_cast<std::size_t>(row) * s.blocksX + column];
        const int x0 = column * kBlock, y0 = row * kBlock;
        for (std::uint32_t l = block.leafBegin; l < block.leafEnd; ++l) addLeaf(s.leaves[l], add);
        if (onePlace_.front) addWhereOpen(s, block, {x0, y0}, add);
        if (!block.anyCell) return out;
        BlockBuffer buffer;
        const BlockTexels texels = blockTexels(s, x0, y0, buffer);
        for (int j = 0; j < kBlock; ++j) {
            for (std::uint32_t left = block.cells[static_cast<std::size_t>(j)]; left;
                 left &= left - 1) {
                const int i = std::countr_zero(left);
                if (onePlace_.front && openAt(s, x0 + i, y0 + j)) continue;
                addCell(cellShape(s, texels, i, j), x0 + i, y0 + j, add);
            }
        }
        return out;
    }

    /// How densely a view samples a surface at a point, per area; 0 where it does not see it. On a
    /// crease `atCrease` of it.
    [[nodiscard]] double density(const Source& s, glm::dvec3 world, glm::dvec3 normal,
                                 double atCrease) const {
        const Camera& c = s.view->camera;
        const glm::dvec3 inCamera = glm::conjugate(c.orientation) * (world - c.position);
        if (!c.orthographic && !(inCamera.z < 0)) return 0;
        const glm::dvec3 at = c.project(inCamera);
        if (!(at.x >= 1 && at.y >= 1 && at.x < s.width - 1 && at.y < s.height - 1)) return 0;
        // Not only the pixel, but all that is around the place must be there.
        const glm::ivec2 cell = cellOf(s, at);
        if (!joined(s, cell.x, cell.y)) return 0;
        const std::uint32_t pixel = index(s, static_cast<int>(at.x), static_cast<int>(at.y));
        if (!sameDepth(s, pixel, at.z)) return 0;
        const double out = densityAt(s, world, normal, at);
        return onCrease(s, cell.x, cell.y) ? atCrease * out : out;
    }

    /// The same at a point of the view's own surface, which is `at` in its picture.
    [[nodiscard]] double densityAt(const Source& s, glm::dvec3 world, glm::dvec3 normal,
                                   glm::dvec3 at) const {
        const Camera& c = s.view->camera;
        const glm::dvec3 ray = c.orthographic ? c.forward() : glm::normalize(world - c.position);
        const double area = c.orthographic ? 1.0 : at.z * at.z;
        double out = c.fx * c.fy / area * std::abs(glm::dot(normal, ray));
        if (s.view->background) out *= kBehind;
        return besideEdge(s, at) ? 0.5 * out : out;
    }

    [[nodiscard]] glm::dvec3 worldOf(const Source& s, std::uint32_t pixel) const {
        const Camera& c = s.view->camera;
        const int x = static_cast<int>(pixel) % s.width, y = static_cast<int>(pixel) / s.width;
        const double dist = s.space.axis.dist(s.whole->q.data()[pixel]);
        return c.position + c.orientation * c.unproject(x + 0.5, y + 0.5, dist);
    }

    [[nodiscard]] ViewSurface surfaceOf(std::size_t source) const {
        const Source& s = scene_.sources[source];
        const std::vector<bool>& used = used_[source];
        const std::size_t count = used.size();
        std::vector<std::uint32_t> numbers(count, kNone);
        ViewSurface out;
        const auto add = [&](const Triangle& t) {
            for (const std::uint32_t corner : t.corners) {
                std::uint32_t& number = numbers[corner];
                if (number == kNone) {
                    number = static_cast<std::uint32_t>(out.pixels.size());
                    out.pixels.emplace_back(corner % s.width, corner / s.width);
                    out.positions.emplace_back(worldOf(s, corner));
                }
                out.triangles.push_back(number);
            }
        };
        for (int by = 0; by < s.blocksY; ++by) {
            for (int bx = 0; bx < s.blocksX; ++bx) {
                const auto triangles = trianglesOf(s, bx, by);
                if (triangles.empty()) continue;
                const auto others = othersAt(s, bx, by);
                for (const Triangle& t : triangles)
                    if (&s == onePlace_.behind || !shownBetter(s, t, others)) add(t);
            }
        }
        for (std::uint32_t pixel = 0; pixel < count; ++pixel) {
            if (used[pixel] || !shows(s, pixel)) continue;
            const glm::dvec3 world = worldOf(s, pixel);
            if (onSurfaceOfAnother(s, world)) continue;
            out.lonePixels.emplace_back(pixel % s.width, pixel / s.width);
            out.lonePositions.emplace_back(world);
        }
        for (std::uint32_t pixel = 0; pixel < count; ++pixel)
            if (shows(s, pixel) && edgeDistance(s, pixel) < kMixed) takeApart(s, pixel, out);
        return out;
    }

  private:
    /// The pixels inside of a leaf are corners of no triangle, but lie on those of the leaf.
    static void useInside(const Source& s, const Leaf& leaf, std::vector<bool>& used) {
        bool some = false;
        addLeaf(leaf, [&](int ax, int ay, int bx, int by, int cx, int cy) {
            some = some || (shows(s, index(s, ax, ay)) && shows(s, index(s, bx, by)) &&
                            shows(s, index(s, cx, cy)));
        });
        for (int y = leaf.y + 1; some && y < leaf.y + leaf.size; ++y)
            for (int x = leaf.x + 1; x < leaf.x + leaf.size; ++x) used[index(s, x, y)] = true;
    }

    /// Nothing is behind an edge in this cell, from wherever one looks: it is joined in spite of
    /// it.
    [[nodiscard]] bool openAt(const Source& s, int x, int y) const {
        if (x + 1 >= s.width || y + 1 >= s.height || joined(s, x, y)) return false;
        if (&s == onePlace_.behind) return true;
        if (gapAt(s, x, y) < kNarrowGap) return true;
        const Source& behind = *onePlace_.behind;
        for (int k = 0; k < 4; ++k) {
            const glm::ivec2 at = glm::ivec2(x + k % 2, y + k / 2) + onePlace_.border;
            if (!(at.x >= 0 && at.y >= 0 && at.x < behind.width && at.y < behind.height &&
                  shows(behind, index(behind, at.x, at.y))))
                return true;
        }
        return false;
    }

    /// The widest gap that an eye at the side sees in a cell, pixels.
    [[nodiscard]] double gapAt(const Source& s, int x, int y) const {
        double nearest = 0, farthest = std::numeric_limits<double>::infinity();
        for (int k = 0; k < 4; ++k) {
            const double q = s.whole->q.data()[index(s, x + k % 2, y + k / 2)];
            const double moved = onePlace_.parallax / s.space.axis.dist(q);
            nearest = std::max(nearest, moved);
            farthest = std::min(farthest, moved);
        }
        return nearest - farthest;
    }

    /// The cells of a block that have an edge in them and nothing behind it.
    template <class Add>
    void addWhereOpen(const Source& s, const SourceBlock& block, glm::ivec2 corner,
                      const Add& add) const {
        std::array<std::uint16_t, kBlock> inLeaf{};
        for (std::uint32_t l = block.leafBegin; l < block.leafEnd; ++l) {
            const Leaf& leaf = s.leaves[l];
            for (int v = 0; v < leaf.size; ++v)
                for (int u = 0; u < leaf.size; ++u)
                    inLeaf[static_cast<std::size_t>(leaf.y + v - corner.y)] |=
                        static_cast<std::uint16_t>(1u << (leaf.x + u - corner.x));
        }
        const float* q = s.whole->q.data();
        for (int j = 0; j < kBlock; ++j) {
            for (int i = 0; i < kBlock; ++i) {
                const int x = corner.x + i, y = corner.y + j;
                if ((inLeaf[static_cast<std::size_t>(j)] >> i & 1) || !openAt(s, x, y)) continue;
                addCell(splitOf(q[index(s, x, y)], q[index(s, x + 1, y)], q[index(s, x, y + 1)],
                                q[index(s, x + 1, y + 1)]),
                        x, y, add);
            }
        }
    }

    /// The pixels within kReach of one that are joined to it there.
    class Joined {
      public:
        Joined(const Source& s, int x, int y) : x_(x), y_(y) {
            std::array<glm::ivec2, kSide * kSide> open;
            std::size_t count = 0;
            const auto reach = [&](int u, int v) {
                if (!inside(u, v) || at(u, v)) return;
                at(u, v) = true;
                open[count++] = {u, v};
            };
            reach(x, y);
            for (std::size_t k = 0; k < count; ++k) {
                const auto [u, v] = std::pair(open[k].x, open[k].y);
                const std::uint8_t* info = s.whole->info.data() + index(s, u, v);
                if (*info & Info::kLinkRight) reach(u + 1, v);
                if (*info & Info::kLinkDown) reach(u, v + 1);
                if (u > 0 && (info[-1] & Info::kLinkRight)) reach(u - 1, v);
                if (v > 0 && (info[-s.width] & Info::kLinkDown)) reach(u, v - 1);
            }
        }
        [[nodiscard]] bool has(int u, int v) { return inside(u, v) && at(u, v); }

      private:
        static constexpr int kReach = 4, kSide = 2 * kReach + 1;  // as far as coloursAround() looks
        [[nodiscard]] bool inside(int u, int v) const {
            return std::abs(u - x_) <= kReach && std::abs(v - y_) <= kReach;
        }
        bool& at(int u, int v) {
            return joined_[static_cast<std::size_t>((v - y_ + kReach) * kSide + u - x_ + kReach)];
        }
        std::array<bool, kSide * kSide> joined_{};
        int x_, y_;
    };

    /// Puts a pixel beside an edge among mixedPixels where its colour is a mixture.
    static void takeApart(const Source& s, std::uint32_t pixel, ViewSurface& out) {
        const int x = static_cast<int>(pixel) % s.width, y = static_cast<int>(pixel) / s.width;
        Joined own(s, x, y);
        const EdgeColours colours = coloursAround(*s.whole->texture, x, y, [&](int u, int v) {
            if (u < 0 || v < 0 || u >= s.width || v >= s.height) return EdgeSide::neither;
            const std::uint32_t at = index(s, u, v);
            if (!shows(s, at) || edgeDistance(s, at) < kMixed) return EdgeSide::neither;
            return own.has(u, v) ? EdgeSide::front : EdgeSide::back;
        });
        if (!colours.known()) return;
        const glm::vec3 apart = colours.apart();
        const float squared = glm::dot(apart, apart);
        if (squared < kLeastApart || colours.front.variance() > kOneColour * squared) return;
        const glm::vec3 colour(s.whole->texture->at(pixel));
        const float share = colours.shareOf(colour);
        if (!(share >= 0 && share < 1)) return;  // something else
        out.mixedPixels.emplace_back(x, y);
        out.ownColours.push_back(glm::clamp(colour + (1 - share) * apart, 0.0f, 1.0f));
    }

    [[nodiscard]] static std::uint32_t index(const Source& s, int x, int y) {
        return static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(s.width) +
               static_cast<std::uint32_t>(x);
    }
    [[nodiscard]] static int edgeDistance(const Source& s, std::uint32_t pixel) {
        return s.whole->info.data()[pixel] >> 4;
    }
    [[nodiscard]] static bool shows(const Source& s, std::uint32_t pixel) {
        return s.whole->q.data()[pixel] > 0 && s.whole->texture->alpha(pixel) >= kLeastAlpha;
    }
    [[nodiscard]] bool sameDepth(const Source& s, std::uint32_t pixel, double dist) const {
        const double there = s.space.axis.dist(s.whole->q.data()[pixel]);
        const Camera& c = s.view->camera;
        double shared = ShareLength(c, radius_).at(std::abs(dist));
        // A telephoto camera tells depths apart as an orthographic one with such a window does.
        if (!c.orthographic)
            shared = std::min(
                shared, kWindows * std::max(c.width / c.fx, c.height / c.fy) * std::abs(dist));
        return std::abs(there - dist) <= kSameDepth * shared + kSameSteps * s.step;
    }
    /// The cell of four pixels has no edge in it.
    [[nodiscard]] static bool joined(const Source& s, int i, int j) {
        const std::uint8_t* info = s.whole->info.data() + index(s, i, j);
        const std::uint8_t both = Info::kLinkRight | Info::kLinkDown;
        if ((*info & both) != both || !(info[1] & Info::kLinkDown) ||
            !(info[s.width] & Info::kLinkRight))
            return false;
        return shows(s, index(s, i, j)) && shows(s, index(s, i + 1, j)) &&
               shows(s, index(s, i, j + 1)) && shows(s, index(s, i + 1, j + 1));
    }

    /// The upper left one of the four pixels around a place of the picture.
    [[nodiscard]] static glm::ivec2 cellOf(const Source& s, glm::dvec3 at) {
        const auto lower = [](double place, int size) {
            return std::clamp(static_cast<int>(std::floor(place - 0.5)), 0, std::max(size - 2, 0));
        };
        return {lower(at.x, s.width), lower(at.y, s.height)};
    }

    /// One of these four is near an edge.
    [[nodiscard]] static bool besideEdge(const Source& s, glm::dvec3 at) {
        const glm::ivec2 cell = cellOf(s, at);
        const int i = cell.x, j = cell.y;
        return std::min({edgeDistance(s, index(s, i, j)), edgeDistance(s, index(s, i + 1, j)),
                         edgeDistance(s, index(s, i, j + 1)),
                         edgeDistance(s, index(s, i + 1, j + 1))}) < kMixed;
    }

    [[nodiscard]] static bool onCrease(const Source& s, int i, int j) {
        const std::uint8_t* info = s.whole->info.data() + index(s, i, j);
        return (info[0] | info[1] | info[s.width] | info[s.width + 1]) & Info::kCrease;
    }

    /// A fan around the middle, with every pixel of the border.
    template <class Add>
    static void addLeaf(const Leaf& leaf, const Add& add) {
        const int n = leaf.size, cx = leaf.x + n / 2, cy = leaf.y + n / 2;
        const auto border = [&](int k) {
            const int side = k / n % 4, along = k % n;
            return side == 0   ? glm::ivec2(leaf.x, leaf.y + along)
                   : side == 1 ? glm::ivec2(leaf.x + along, leaf.y + n)
                   : side == 2 ? glm::ivec2(leaf.x + n, leaf.y + n - along)
                               : glm::ivec2(leaf.x + n - along, leaf.y);
        };
        for (int k = 0; k < 4 * n; ++k) {
            const glm::ivec2 a = border(k), b = border(k + 1);
            add(cx, cy, a.x, a.y, b.x, b.y);
        }
    }

    template <class Add>
    static void addCell(std::uint32_t shape, int x, int y, const Add& add) {
        const int r = x + 1, b = y + 1;
        switch (shape) {
            case kQuadCell:
            case kFallingSplit:
                add(x, y, x, b, r, b);
                add(x, y, r, b, r, y);
                break;
            case kRisingSplit:
                add(x, y, x, b, r, y);
                add(r, y, x, b, r, b);
                break;
            case kUpperLeft:
                add(x, y, x, b, r, y);
                break;
            case kUpperRight:
                add(x, y, r, b, r, y);
                break;
            case kLowerRight:
                add(r, y, x, b, r, b);
                break;
            case kLowerLeft:
                add(x, y, x, b, r, b);
                break;
            default:
                break;
        }
    }

    /// The other views whose pictures may show some of a block's triangles.
    [[nodiscard]] std::vector<Reach> othersAt(const Source& s, int bx, int by) const {
        const SourceBlock& block = s.blocks[static_cast<std::size_t>(by) * s.blocksX + bx];
        // Corners are the middles of its pixels and of those beside it.
        const double x0 = bx * kBlock, y0 = by * kBlock, reach = kBlock + 1;
        std::array<glm::dvec3, 8> corners;
        for (std::size_t k = 0; k < corners.size(); ++k) {
            const double dist = s.space.axis.dist(k & 4 ? block.qMax : block.qMin);
            corners[k] = s.view->camera.position +
                         s.view->camera.orientation *
                             s.view->camera.unproject(x0 + (k & 1 ? reach : 0),
                                                      y0 + (k & 2 ? reach : 0), dist);
        }
        std::vector<Reach> out;
        for (const Reach& other : reaches_)
            if (&other.source() != &s && other.holds(corners) &&
                mayShow(other.source().view->camera, corners))
                out.push_back(other);
        return out;
    }

    [[nodiscard]] bool shownBetter(const Source& s, const Triangle& t,
                                   std::span<const Reach> others) const {
        std::array<glm::dvec3, 3> p;
        glm::ivec2 low(s.width, s.height), high(0);
        for (std::size_t k = 0; k < 3; ++k) {
            p[k] = worldOf(s, t.corners[k]);
            const glm::ivec2 at(static_cast<int>(t.corners[k]) % s.width,
                                static_cast<int>(t.corners[k]) / s.width);
            low = glm::min(low, at);
            high = glm::max(high, at);
        }
        const glm::dvec3 across = glm::cross(p[1] - p[0], p[2] - p[0]);
        const double area = glm::length(across);
        if (!(area > 0)) return true;
        const glm::dvec3 normal = across / area;
        const Camera& c = s.view->camera;
        // All of it, each place by itself, so that of what several views show the densest stays: a
        // large triangle may reach where others have an edge or a crease, or are denser.
        const bool large = std::max(high.x - low.x, high.y - low.y) > 1;
        return std::ranges::all_of(
            std::span(kPlaces).first(large ? std::size(kPlaces) : 4), [&](glm::dvec3 share) {
                const glm::dvec3 place = p[0] * share.x + p[1] * share.y + p[2] * share.z;
                const glm::dvec3 at =
                    c.project(glm::conjugate(c.orientation) * (place - c.position));
                // What folds there for others is an outline that this view alone shows in full.
                return anotherShows(s, others, {place, normal, at},
                                    besideEdge(s, at) ? 0.0 : kAtCrease);
            });
    }

    /// A place of a view's surface.
    struct SeenPlace {
        glm::dvec3 world, normal;
        glm::dvec3 at;  ///< in the view's picture
    };
    /// Some other view sees the place from the same side, more densely by kDenser; so by the slope
    /// of that view's own surface, too: noise tilts both, and each would leave the place to the
    /// other.
    [[nodiscard]] bool anotherShows(const Source& s, std::span<const Reach> others,
                                    const SeenPlace& place, double atCrease) const {
        const double here = densityAt(s, place.world, place.normal, place.at);
        for (const Reach& reach : others) {
            if (!reach.holds(place.world)) continue;
            const Source& other = reach.source();
            const Camera& c = other.view->camera;
            const glm::dvec3 ray = c.orthographic ? c.forward() : place.world - c.position;
            if (!(glm::dot(ray, place.normal) < 0)) continue;
            if (!(density(other, place.world, place.normal, atCrease) > kDenser * here)) continue;
            const glm::dvec3 own = normalAt(other, place.world);
            if (density(other, place.world, own, atCrease) >
                kDenser * densityAt(s, place.world, own, place.at))
                return true;
        }
        return false;
    }

    /// The normal of a view's own surface at a place that density() finds on it.
    [[nodiscard]] glm::dvec3 normalAt(const Source& s, glm::dvec3 world) const {
        const Camera& c = s.view->camera;
        const glm::ivec2 cell =
            cellOf(s, c.project(glm::conjugate(c.orientation) * (world - c.position)));
        const glm::dvec3 corner = worldOf(s, index(s, cell.x, cell.y));
        const glm::dvec3 across = glm::cross(worldOf(s, index(s, cell.x + 1, cell.y)) - corner,
                                             worldOf(s, index(s, cell.x, cell.y + 1)) - corner);
        return across / std::max(glm::length(across), std::numeric_limits<double>::min());
    }

    /// The place is on a triangle of some other view, or next to one.
    [[nodiscard]] bool onSurfaceOfAnother(const Source& s, glm::dvec3 world) const {
        for (std::size_t k = 0; k < scene_.sources.size(); ++k) {
            const Source& other = scene_.sources[k];
            if (&other == &s || !reaches_[k].holds(world)) continue;
            const Camera& c = other.view->camera;
            const glm::dvec3 inCamera = glm::conjugate(c.orientation) * (world - c.position);
            if (!c.orthographic && !(inCamera.z < 0)) continue;
            const glm::dvec3 at = c.project(inCamera);
            if (!(at.x >= 0 && at.y >= 0 && at.x < other.width && at.y < other.height)) continue;
            const std::uint32_t pixel =
                index(other, static_cast<int>(at.x), static_cast<int>(at.y));
            if (used_[k][pixel] && sameDepth(other, pixel, at.z)) return true;
        }
        return false;
    }

    const SurfaceScene& scene_;
    std::vector<std::vector<bool>> used_;  ///< of each source: pixels that lie on triangles
    std::vector<Reach> reaches_;           ///< of each source
    double radius_;                        ///< of the scene
    OnePlace onePlace_;
};

}  // namespace

Result<void> forEachSurface(
    const Bundle& bundle, PixelSpool* spool, Job& job,
    const std::function<Result<void>(std::size_t index, ViewSurface surface)>& take) {
    STX_CHECK(bundle.check());
    if (!spool) STX_CHECK(checkPeak(peak::kSurfaces, bundle.views, job.limits));
    RenderSettings settings;
    settings.without.add(Stage::sharpen);
    settings.without.add(Stage::rims);
    auto scene = std::make_unique<const SurfaceScene>(
        spool ? PageSet(bundle, *spool) : PageSet(bundle), settings);
    STX_CHECK(job.checkCancelled());
    auto maker = std::make_unique<Maker>(*scene);
    const auto count = static_cast<std::int64_t>(bundle.views.size());
    parallelFor(0, count, [&](std::int64_t i) { maker->prepare(static_cast<std::size_t>(i)); });
    const std::int64_t atOnce = std::max<std::int64_t>(1, threadCount());
    for (std::int64_t first = 0; first < count; first += atOnce) {
        const std::int64_t end = std::min(first + atOnce, count);
        std::vector<ViewSurface> found(static_cast<std::size_t>(end - first));
        parallelFor(first, end, [&](std::int64_t i) {
            if (job.cancelled) return;
            found[static_cast<std::size_t>(i - first)] =
                maker->surfaceOf(static_cast<std::size_t>(i));
        });
        STX_CHECK(job.checkCancelled());
        if (end == count) {
            // The last views are written without what they were made of.
            maker.reset();
            scene.reset();
        }
        for (std::int64_t i = first; i < end; ++i)
            STX_CHECK(take(static_cast<std::size_t>(i),
                           std::move(found[static_cast<std::size_t>(i - first)])));
    }
    return {};
}

Result<std::vector<ViewSurface>> viewSurfaces(const Bundle& bundle, Job& job) {
    std::vector<ViewSurface> out(bundle.views.size());
    STX_CHECK(forEachSurface(bundle, nullptr, job,
                             [&](std::size_t index, ViewSurface surface) -> Result<void> {
                                 out[index] = std::move(surface);
                                 return {};
                             }));
    return out;
}

std::uint64_t memoryOfSpooledSurfaces(const ViewTable& table) {
    // Of one view, and of each pixel of all what is known of its block and whether it is a corner.
    constexpr PeakMemory kOfOne = {peak::kSurfaces.what,
                                   peak::kSurfaces.perPixel + peak::kSurfaces.perPixelOfLargest};
    constexpr std::uint64_t kKnownOfEach = 3;
    std::uint64_t pixels = 0;
    for (std::size_t i = 0; i < table.count(); ++i) pixels += table.pixelsOf(i);
    const std::uint64_t beside = memoryOfEach(table, kOfOne) + kKnownOfEach * pixels;
    return beside + beside / (kSpoolPart - 1);
}

}  // namespace stx

#include "lib/refine/unmeasured.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <glm/glm.hpp>

#include "lib/base/parallel.hpp"
#include "lib/geometry/depth_code.hpp"
#include "lib/geometry/near_views.hpp"
#include "lib/geometry/pixel_space.hpp"
#include "lib/refine/local_plane.hpp"
#include "lib/refine/plane_samples.hpp"
#include "lib/refine/reproject.hpp"

namespace stx {
namespace {

// Chosen by trial on the captured sets of tests/bench/pictures.md.

/// "Far away" is so many times the distance of the farthest point of all views.
constexpr double kFarTimes = 1000.0;
/// Views that a view is compared with.
constexpr std::size_t kComparedViews = 4;
/// Views that may show what pruning took from a view: as many as prune() asks.
constexpr std::size_t kPrunedByViews = 24;
/// Samples of another colour than the middle's count less: a difference by which they count 1 / e.
constexpr float kAlikeColour = 0.08f;
/// Planes that differ by this share of q are one.
constexpr float kSamePlane = 0.0005f;
/// The difference that a pixel gets which no other view shows.
constexpr float kUntold = 0.06f;
/// How much changes of colour on the way from the measured point count, and up to what sum.
constexpr float kPathWeight = 0.1f, kLongestPath = 0.3f;
/// Changes of colour up to this are noise.
constexpr float kNoiseOfColours = 0.02f;
/// Rounds of spreading, in both directions each.
constexpr int kRoundsOfSpreading = 1;
/// Planes are fitted to points within so many pixels, and in the end within a share of q.
constexpr int kPlaneRadius = 6;
constexpr float kFirstBand = 0.03f, kPlaneBand = 0.01f;
/// Pixels with points around those without that are drawn, too, so that surfaces meet.
constexpr int kRing = 2;

Rgba8Image codedColours(const RgbaFloatImage& linear) {
    Rgba8Image out(linear.width(), linear.height());
    parallelFor(0, out.count(), 4096, [&](std::size_t i) {
        const glm::vec4 c = glm::clamp(linear.data()[i], 0.0f, 1.0f);
        for (int k = 0; k < 3; ++k)
            out.data()[i][k] = static_cast<std::uint8_t>(255.0f * srgbFromLinear(c[k]) + 0.5f);
        out.data()[i].a = static_cast<std::uint8_t>(255.0f * c.a + 0.5f);
    });
    return out;
}

float apart(const glm::vec3& a, const glm::vec3& b) {
    const glm::vec3 d = glm::abs(a - b);
    return (d.x + d.y + d.z) * (1.0f / 3.0f);
}

/// Spreads planes over the pixels of one view.
class Spreading {
  public:
    Spreading(const Rgba8Image& colours, const Image<float>& q, std::vector<OtherView> others,
              float far)
        : colours_(colours), q_(q), others_(std::move(others)), far_(far), width_(q.width()) {}

    /// q of all pixels that are wanted: those where `wanted` is 1.
    void run(const Image<std::uint8_t>& wanted, Image<float>& out) {
        for (int y = 0; y < q_.height(); ++y)
            for (int x = 0; x < width_; ++x)
                if (wanted.at(x, y)) pixels_.push_back({x, y});
        state_ = Image<State>(width_, q_.height());
        for (const glm::ivec2 p : pixels_) {
            State& s = state_.at(p.x, p.y);
            s.open = true;
            s.plane = {far_, 0, 0};
            s.path = kLongestPath;
            lookAround(p.x, p.y);
            s.cost = difference(p.x, p.y, s.plane) + kPathWeight * s.path;
        }
        for (int round = 0; round < kRoundsOfSpreading; ++round) {
            for (const glm::ivec2 p : pixels_) take(p, -1);
            for (auto p = pixels_.rbegin(); p != pixels_.rend(); ++p) take(*p, 1);
        }
        for (const glm::ivec2 p : pixels_) out.at(p.x, p.y) = state_.at(p.x, p.y).plane.q;
    }

  private:
    struct State {
        PixelPlane plane;
        float path = 0, cost = 0;
        bool open = false, fitted = false;
    };

    [[nodiscard]] glm::vec3 colour(int x, int y) const {
        return glm::vec3(glm::u8vec3(colours_.at(x, y))) * (1.0f / 255.0f);
    }

    /// Takes the samples around a pixel.
    void lookAround(int x, int y) {
        const glm::vec3 middle = colour(x, y);
        for (std::size_t k = 0; k < PlaneSamples::kCount; ++k) {
            const int i = x + static_cast<int>(samples_.dx[k]),
                      j = y + static_cast<int>(samples_.dy[k]);
            samples_.weight[k] = 0.0f;
            if (!q_.contains(i, j)) continue;
            const glm::vec3 c = colour(i, j);
            samples_.red[k] = c.r;
            samples_.green[k] = c.g;
            samples_.blue[k] = c.b;
            samples_.weight[k] = std::exp(-apart(c, middle) * (1.0f / kAlikeColour));
        }
    }

    /// By how much other views show something else, of a pixel that was looked around at.
    [[nodiscard]] float difference(int x, int y, const PixelPlane& plane) const {
        std::array<float, kComparedViews> found;
        std::size_t count = 0;
        alignas(64) PlaneSamples::Floats off;
        for (const OtherView& other : others_) {
            differencesOn(plane, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f,
                          samples_, other, off);
            float sum = 0, weight = 0, all = 0;
            for (std::size_t k = 0; k < PlaneSamples::kCount; ++k) {
                const float w = samples_.weight[k];
                all += w;
                if (off[k] < 0.0f) continue;
                sum += w * off[k];
                weight += w;
            }
            if (weight > 0.5f * all) found[count++] = sum / weight;
        }
        if (count == 0) return kUntold;
        // Half of the views may have something else before it.
        const std::size_t best = (count + 1) / 2;
        std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(best),
                          found.begin() + static_cast<std::ptrdiff_t>(count));
        float sum = 0;
        for (std::size_t i = 0; i < best; ++i) sum += found[i];
        return sum / static_cast<float>(best);
    }

    [[nodiscard]] static bool isLike(const PixelPlane& a, const PixelPlane& b) {
        const float off = kSamePlane * a.q;
        return std::abs(a.q - b.q) < off && kPlaneRadius * std::abs(a.gx - b.gx) < off &&
               kPlaneRadius * std::abs(a.gy - b.gy) < off;
    }

    /// The plane of a pixel with a point.
    const State& fitted(int x, int y) {
        State& s = state_.at(x, y);
        if (s.fitted) return s;
        s.fitted = true;
        const float here = q_.at(x, y);
        LocalPlane plane{here};
        plane = fitAround(q_, x, y, kPlaneRadius, plane, kFirstBand * here);
        plane = fitAround(q_, x, y, kPlaneRadius, plane, kPlaneBand * here);
        s.plane = {plane.q0, plane.gx, plane.gy};
        return s;
    }

    /// Takes the plane of a neighbour, left and above (-1) or right and below (1), if it is better.
    void take(glm::ivec2 p, int side) {
        bool looked = false;
        State& s = state_.at(p.x, p.y);
        const glm::vec3 own = colour(p.x, p.y);
        for (int axis = 0; axis < 2; ++axis) {
            const int dx = axis == 0 ? side : 0, dy = axis == 0 ? 0 : side;
            const int nx = p.x + dx, ny = p.y + dy;
            if (!q_.contains(nx, ny)) continue;
            const bool known = q_.at(nx, ny) > 0.0f;
            if (!known && !state_.at(nx, ny).open) continue;
            const State& from = known ? fitted(nx, ny) : state_.at(nx, ny);
            if (!known && from.plane.q == far_) continue;
            const PixelPlane plane{from.plane.q - from.plane.gx * static_cast<float>(dx) -
                                       from.plane.gy * static_cast<float>(dy),
                                   from.plane.gx, from.plane.gy};
            if (!(plane.q > far_) || isLike(plane, s.plane)) continue;
            const float path =
                std::min(from.path + std::max(apart(own, colour(nx, ny)) - kNoiseOfColours, 0.0f),
                         kLongestPath);
            if (kPathWeight * path >= s.cost) continue;
            if (!looked) lookAround(p.x, p.y);
            looked = true;
            const float cost = difference(p.x, p.y, plane) + kPathWeight * path;
            if (!(cost < s.cost)) continue;
            s.plane = plane;
            s.path = path;
            s.cost = cost;
        }
    }

    const Rgba8Image& colours_;
    const Image<float>& q_;
    std::vector<OtherView> others_;
    float far_;
    int width_;
    std::vector<glm::ivec2> pixels_;
    Image<State> state_;
    PlaneSamples samples_;
};

/// What all steps need to know of a view.
struct Looked {
    PixelSpace space;
    Image<float> q;
    std::optional<Rgba8Image> coded;
    const Rgba8Image* colours = nullptr;
    double farthest = 0;
    glm::dvec3 middle{0.0};
    Image<std::uint8_t> wanted;  ///< 1: no depth, full alpha; empty: none is
};

/// Where a view has no depth under full alpha; empty where it has none such.
Image<std::uint8_t> openPixels(const RefineView& view) {
    const Image<float>& depth = *view.depth;
    if (view.header->camera.orthographic) return {};
    Image<std::uint8_t> open(depth.width(), depth.height(), std::uint8_t{0});
    bool any = false;
    for (std::size_t i = 0; i < open.count(); ++i) {
        // An object before emptiness: it would grow beyond its outlines by such pixels (a statue of
        // which 3 % have no depth loses 0.45 dB).
        if (view.texture->alpha(i) < 1.0f) return {};
        if (hasPoint(depth.data()[i])) continue;
        open.data()[i] = 1;
        any = true;
    }
    return any ? std::move(open) : Image<std::uint8_t>();
}

/// Fills in what is known of a perspective view.
void lookAt(const RefineView& view, Looked& l) {
    const Camera& camera = view.header->camera;
    const Image<float>& depth = *view.depth;
    l.space = PixelSpace(camera, 0.0);
    l.q = Image<float>(depth.width(), depth.height(), 0.0f);
    std::int64_t points = 0;
    for (int y = 0; y < depth.height(); ++y) {
        for (int x = 0; x < depth.width(); ++x) {
            const float dist = depth.at(x, y);
            if (!hasPoint(dist) || !(dist > 0.0f)) continue;
            l.q.at(x, y) = 1.0f / dist;
            l.farthest = std::max(l.farthest, static_cast<double>(dist));
            l.middle +=
                camera.position + camera.orientation * camera.unproject(x + 0.5, y + 0.5, dist);
            ++points;
        }
    }
    if (points > 0) l.middle /= static_cast<double>(points);
    l.colours = view.texture->rgba8();
    if (l.colours) return;
    l.coded = codedColours(*view.texture->rgbaFloat());
    l.colours = &*l.coded;
}

/// What pruning took from a perspective view is measured: others show it. Distances by these.
Image<float> distancesByOthers(std::span<const RefineView> views, std::size_t k) {
    const ViewHeader& header = *views[k].header;
    const Camera& camera = header.camera;
    const auto cameraOf = [&](std::size_t i) -> const Camera& { return views[i].header->camera; };
    const double middle = 0.5 * (header.nearPlane + header.farPlane);
    Image<float> nearest(camera.width, camera.height, kNoDepth);
    Job job;
    for (const std::size_t i :
         nearViews(views.size(), cameraOf, k, camera.position + middle * camera.forward(),
                   kPrunedByViews)) {
        if (views[i].header->background) continue;
        const auto seen = depthSeenBy(camera, {}, *views[i].depth, cameraOf(i), job);
        for (std::size_t p = 0; seen && p < nearest.count(); ++p)
            nearest.data()[p] = std::min(nearest.data()[p], seen->data()[p]);
    }
    return nearest;
}

/// Takes that in; only what nobody measured is wanted then. Faces of other views reach half a pixel
/// beyond what they measured, so that pixels beside what is left stay, too.
void takePruned(const Image<float>& others, Looked& l) {
    Image<std::uint8_t> left(others.width(), others.height(), std::uint8_t{0});
    bool any = false;
    for (int y = 0; y < others.height(); ++y) {
        for (int x = 0; x < others.width(); ++x) {
            if (!l.wanted.at(x, y) || hasPoint(others.at(x, y))) continue;
            any = true;
            for (int j = std::max(y - 1, 0); j <= std::min(y + 1, left.height() - 1); ++j)
                for (int i = std::max(x - 1, 0); i <= std::min(x + 1, left.width() - 1); ++i)
                    left.at(i, j) = l.wanted.at(i, j);
        }
    }
    for (std::size_t i = 0; i < others.count(); ++i)
        if (l.wanted.data()[i] && !left.data()[i]) l.q.data()[i] = 1.0f / others.data()[i];
    l.wanted = any ? std::move(left) : Image<std::uint8_t>();
}

/// Depth of the pixels that are wanted of 1/distance, with measured depth around them.
Image<float> withRing(const Looked& l, const Image<float>& q, const Image<float>& measured) {
    Image<float> depth(q.width(), q.height(), kNoDepth);
    for (int y = 0; y < q.height(); ++y) {
        for (int x = 0; x < q.width(); ++x) {
            if (!l.wanted.at(x, y)) continue;
            depth.at(x, y) = 1.0f / q.at(x, y);
            for (int j = std::max(y - kRing, 0); j <= std::min(y + kRing, q.height() - 1); ++j)
                for (int i = std::max(x - kRing, 0); i <= std::min(x + kRing, q.width() - 1); ++i)
                    if (l.q.at(i, j) > 0.0f)
                        depth.at(i, j) =
                            hasPoint(measured.at(i, j)) ? measured.at(i, j) : 1.0f / l.q.at(i, j);
        }
    }
    return depth;
}

}  // namespace

UnmeasuredDepth unmeasuredDepth(std::span<const RefineView> views,
                                const std::vector<bool>& wanted) {
    UnmeasuredDepth out;
    out.depth.resize(views.size());
    std::vector<Looked> looked(views.size());
    const auto count = static_cast<std::int64_t>(views.size());
    const auto ofEach = [&](const auto& call) {
        parallelFor(0, count, [&](std::size_t i) { call(i); });
    };
    ofEach([&](std::size_t k) {
        if (wanted[k]) looked[k].wanted = openPixels(views[k]);
    });
    if (std::ranges::all_of(looked, [](const Looked& l) { return l.wanted.empty(); })) return out;
    ofEach([&](std::size_t k) {
        if (!views[k].header->camera.orthographic) lookAt(views[k], looked[k]);
    });
    ofEach([&](std::size_t k) {
        if (views[k].header->pruned && !looked[k].wanted.empty())
            takePruned(distancesByOthers(views, k), looked[k]);
    });
    for (const Looked& l : looked) out.farAway = std::max(out.farAway, kFarTimes * l.farthest);
    if (!(out.farAway > 0)) return out;
    const auto far = static_cast<float>(1.0 / out.farAway);
    ofEach([&](std::size_t k) {
        const Looked& l = looked[k];
        if (l.wanted.empty()) return;
        std::vector<OtherView> others;
        for (const std::size_t i : nearViews(
                 views.size(),
                 [&](std::size_t n) -> const Camera& { return views[n].header->camera; }, k,
                 l.middle, kComparedViews))
            if (looked[i].colours)
                others.push_back(
                    {looked[i].colours, &looked[i].q,
                     warpFrom(looked[i].space.pixelFromWorld * l.space.worldFromPixel)});
        Image<float> q(l.q.width(), l.q.height(), 0.0f);
        Spreading(*l.colours, l.q, std::move(others), far).run(l.wanted, q);
        out.depth[k] = withRing(l, q, *views[k].depth);
    });
    for (std::size_t k = 0; k < views.size(); ++k) {
        if (out.depth[k].empty()) continue;
        for (std::size_t i = 0; i < out.depth[k].count(); ++i) {
            if (!looked[k].wanted.data()[i]) continue;
            ++(out.depth[k].data()[i] < 0.5 * out.farAway ? out.placed : out.far);
        }
    }
    return out;
}

}  // namespace stx

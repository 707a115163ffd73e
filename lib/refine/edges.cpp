#include "lib/refine/edges.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>
#include <vector>

#include "lib/base/median.hpp"
#include "lib/base/parallel.hpp"
#include "lib/refine/edge_colours.hpp"

namespace stx {
namespace {

// Chosen by trial on the sets of tests/bench/pictures.md with edges moved by a pixel.

/// An edge is a jump of more than this share of q, and so many times what q changes by beside it.
constexpr float kJumpOfEdge = 0.005f, kBesideSlope = 3.0f;
/// It is a jump of more than so many steps of a depth code, too.
constexpr float kJumpSteps = 2.5f;
/// And of more than so many standard deviations of noise, of which smoothing leaves some at single
/// pixels.
constexpr float kJumpNoises = 3.0f;
/// And of more than so many pixels' widths: closer surfaces are hardly seen apart from anywhere,
/// and views with noise of up to 0.15 of them do not count as noisy (isNoisy()).
constexpr float kJumpPixels = 1.0f;
/// Squared distance of two colours (0..1 each) that tell surfaces apart.
constexpr float kContrast = 3 * 0.04f * 0.04f;
/// And of so many times what the colours of both differ by among themselves (the sum of their
/// variances): a texture whose spots are a few pixels looks like an edge. With it the oak tree's
/// exact edges have 0.75 of their own colour, moved ones 0.52.
constexpr float kContrastOfSpread = 2.0f;
/// Rows and edges that are looked at in a view, about, and the fewest edges that tell.
constexpr int kRows = 128;
constexpr std::size_t kEdges = 600, kFewEdges = 60;
/// Edges of exact sets have 0.74 (an oak's leaves) to 1 of their own colour; with edges moved by a
/// pixel 0.07, and the oak 0.56. Aligned stereo (Aloe) has 0.64.
constexpr float kFat = 0.62f;
/// Where surfaces reach over their edges, at least this share of the pixels there has less than so
/// much of their own colour: 0.60 of the statue's, 0.30 of the oak's, 0.65 of the spheres', each
/// with edges moved by a pixel. A smooth texture alone gives shares around a half: none of exact
/// bars four pixels wide (tests/sweep, 14578:55) has less than 0.4.
constexpr float kLeastBehind = 0.15f, kBehind = 0.2f;
/// Pixels with more of the colour of the surface in front stay.
constexpr float kOwnColour = 0.6f;
constexpr int kMostRounds = 2;
/// The share of pixels at edges whose colour other views have on the surface in front: 0.70 to 1 in
/// exact views that have less than kFat of their own colour (four of a thousand cases of
/// tests/sweep: thin bars and plates), 0.19 and 0.34 where edges of statue and oak tree are moved
/// by a pixel. At least so many must tell; so many other views are asked, about.
constexpr float kFrontInOthers = 0.52f;
/// The same where others have a quarter of the edges in the same places to this share of a pixel's
/// width, or too few of them tell colours: 0.44 and more in exact views. Exact depth comes to 0.003
/// (the side of a plate one pixel wide, which looks like a fat edge), statue, oak tree and spheres
/// with edges moved by a pixel to 0.36, 0.54 and 0.21.
constexpr float kFrontInAgreeing = 0.4f, kSamePlaceOfPixel = 0.05f;
constexpr int kFewWitnesses = 20;
/// Fewer than those tell only that edges are not fat: from so many on, with more than
/// kFrontInAgreeing. Bars two pixels thick have 16 of 19 and 5 of 10 (tests/sweep, 1127800:175 and
/// 1127900:0).
constexpr int kFewestWitnesses = 5;
/// Pixels at edges beside which none tell colours are mostly fat where so many times as many have
/// their colours behind as in front, in other views: 2.8 of the statue, 1.8 of the oak tree, 5 and
/// more of rooms; 0.2 to 0.7 of bars three to ten pixels thick, each with edges moved by a pixel
/// (tests/sweep, 99100:165, 5001:10, 130, 194, 239), where more of the bars were taken than of what
/// reaches over them: 14.3 dB instead of 21.7, and 20.4 as they were.
constexpr float kMostlyBehind = 1.5f;
constexpr std::size_t kWitnesses = 16;
/// Points are compared on a grid of so many along the longer side of a view; the fewest that tell.
constexpr int kPointsAcross = 24;
constexpr std::size_t kFewPoints = 200;
/// Views show the same surface where they are apart by less than this share of q.
constexpr float kSameSurface = 0.03f;
/// And by less than so many pixels' widths, where edges may be in the same place.
constexpr float kSamePixels = 4.0f;
/// And by less than this share of the jump between two: a point of one is not one of the other.
constexpr float kSameOfJump = 0.25f;
/// Depths that are apart by less than this share of what they were are better.
constexpr float kClearlyCloser = 0.8f;

class Edges {
  public:
    Edges(const Image<float>& q, const EdgeView& view)
        : q_(q),
          texture_(*view.texture),
          axis_(view.space->axis),
          step_(view.step),
          noise_(view.noise) {}

    /// The neighbour of a pixel, of those where the surface ends, that is farthest behind; -1 =
    /// none, the surface does not end here.
    [[nodiscard]] int behind(int x, int y, int neighbours) const {
        const float here = q_.at(x, y);
        if (!(here > 0.0f)) return -1;
        const float least = jumpAt(here);
        int found = -1;
        float farthest = here;
        for (int i = 0; i < neighbours; ++i) {
            const int dx = kBeside[i][0], dy = kBeside[i][1];
            const float there = at(x + dx, y + dy);
            if (!(there > 0.0f) || !(here - there > least) || !(there < farthest)) continue;
            const float before = at(x - dx, y - dy), after = at(x + 2 * dx, y + 2 * dy);
            const float jump = (here - there) / kBesideSlope;
            if (before > 0.0f && before > here && before - here > jump) continue;
            if (after > 0.0f && after < there && there - after > jump) continue;
            farthest = there;
            found = i;
        }
        return found;
    }

    /// How much of a pixel's colour is that of its surface and not of what is behind at neighbour
    /// `i`, 0..1; nothing when they look alike.
    [[nodiscard]] std::optional<float> ownShare(int x, int y, int i) const {
        const EdgeColours colours = coloursAt(x, y, i);
        if (!colours.known()) return {};
        const glm::vec3 apart = colours.apart();
        const float squared = glm::dot(apart, apart);
        const float spread = colours.front.variance() + colours.back.variance();
        if (squared < kContrast || squared < kContrastOfSpread * spread) return {};
        return std::clamp(colours.shareOf(glm::vec3(texture_.at(x, y))), 0.0f, 1.0f);
    }

    /// Whether any pixels around tell the colours of both surfaces at neighbour `i`.
    [[nodiscard]] bool knowsColours(int x, int y, int i) const {
        return coloursAt(x, y, i).known();
    }

    /// What is behind at neighbour `i`, at this pixel.
    [[nodiscard]] float goesOn(int x, int y, int i) const {
        const int dx = kBeside[i][0], dy = kBeside[i][1];
        const float there = at(x + dx, y + dy), after = at(x + 2 * dx, y + 2 * dy);
        if (!(after > 0.0f) || !(std::abs(there - after) < jumpAt(there))) return there;
        return std::max(2 * there - after, 0.5f * there);
    }

    /// The smallest q of 3x3 pixels.
    [[nodiscard]] float farthestAround(int x, int y) const {
        float least = q_.at(x, y);
        for (const auto& d : kBeside) {
            const float there = at(x + d[0], y + d[1]);
            if (there > 0.0f) least = std::min(least, there);
        }
        return least;
    }
    /// The largest.
    [[nodiscard]] float nearestAround(int x, int y) const {
        float most = q_.at(x, y);
        for (const auto& d : kBeside) most = std::max(most, at(x + d[0], y + d[1]));
        return most;
    }

  private:
    /// Of the surfaces before and behind the edge at neighbour `i`.
    [[nodiscard]] EdgeColours coloursAt(int x, int y, int i) const {
        const float front = q_.at(x, y), back = at(x + kBeside[i][0], y + kBeside[i][1]);
        const float half = 0.5f * (front - back);
        return coloursAround(texture_, x, y, [&](int u, int v) {
            const float there = at(u, v);
            if (!(there > 0.0f)) return EdgeSide::neither;
            const bool isFront = std::abs(there - front) < half;
            if ((!isFront && !(std::abs(there - back) < half)) || besideJump(u, v, half))
                return EdgeSide::neither;
            return isFront ? EdgeSide::front : EdgeSide::back;
        });
    }
    [[nodiscard]] float at(int x, int y) const { return q_.contains(x, y) ? q_.at(x, y) : 0.0f; }
    [[nodiscard]] float jumpAt(float q) const {
        return std::max(
            std::max({kJumpOfEdge, kJumpNoises * noise_, kJumpPixels * axis_.pixelShare()}) *
                axis_.relativeScale(q),
            kJumpSteps * step_ * axis_.qPerUnit(q));
    }
    /// Its colour may be a mixture.
    [[nodiscard]] bool besideJump(int x, int y, float jump) const {
        const float here = q_.at(x, y);
        for (int i = 0; i < 4; ++i) {
            const float there = at(x + kBeside[i][0], y + kBeside[i][1]);
            if (there > 0.0f && std::abs(there - here) > jump) return true;
        }
        return false;
    }

    const Image<float>& q_;
    const Texture& texture_;
    const DepthAxis& axis_;
    float step_, noise_;
};

/// Which pixels of a view are given other depth.
enum class Change {
    edges,       ///< those at edges get what is behind
    everywhere,  ///< every pixel gets the farthest depth around it, but those of its own colour
    nearest,     ///< every pixel gets the nearest depth around it
};

/// A view with a pixel less of what is in front, or, of `nearest`, with one more. Pixels at edges
/// that are in `stay` are left as they are.
Image<float> changed(const EdgeView& view, Change change, std::span<const glm::ivec2> stay) {
    const Image<float>& from = *view.q;
    Image<std::uint8_t> stays(from.width(), from.height(), 0);
    for (const glm::ivec2 p : stay) stays.at(p.x, p.y) = 1;
    const Edges edges(from, view);
    Image<float> out = from;
    parallelFor(0, from.height(), 16, [&](int y) {
        for (int x = 0; x < from.width(); ++x) {
            const float here = from.at(x, y);
            if (!(here > 0.0f)) continue;
            if (change == Change::nearest) {
                out.at(x, y) = edges.nearestAround(x, y);
                continue;
            }
            const int i = edges.behind(x, y, 8);
            if (i >= 0 && (stays.at(x, y) || edges.ownShare(x, y, i).value_or(0) > kOwnColour))
                continue;
            if (change == Change::everywhere)
                out.at(x, y) = edges.farthestAround(x, y);
            else if (i >= 0)
                out.at(x, y) = edges.goesOn(x, y, i);
        }
    });
    return out;
}

/// q between the middles of four pixels, (0, 0) being the first one's; 0 where they are not one
/// surface.
float between(const Image<float>& q, float x, float y) {
    if (!(x >= 0.0f && y >= 0.0f)) return 0.0f;
    const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
    if (!q.contains(x0 + 1, y0 + 1)) return 0.0f;
    const float a = q.at(x0, y0), b = q.at(x0 + 1, y0), c = q.at(x0, y0 + 1),
                d = q.at(x0 + 1, y0 + 1);
    const float least = std::min({a, b, c, d}), most = std::max({a, b, c, d});
    if (!(least > 0.0f) || most - least > kSameSurface * most) return 0.0f;
    const float tx = x - static_cast<float>(x0), ty = y - static_cast<float>(y0);
    return (a * (1 - tx) + b * tx) * (1 - ty) + (c * (1 - tx) + d * tx) * ty;
}

/// A point of a grid over a view: its pixel's middle, and its q.
struct GridPixel {
    float x, y, q;
};

std::vector<GridPixel> gridOf(const Image<float>& q) {
    std::vector<GridPixel> grid;
    const int step = std::max(1, std::max(q.width(), q.height()) / kPointsAcross);
    for (int y = step / 2; y < q.height(); y += step)
        for (int x = step / 2; x < q.width(); x += step)
            if (const float here = q.at(x, y); here > 0.0f)
                grid.push_back({static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, here});
    return grid;
}

/// How far apart views are where they may show the same surface, at single points: shares of q, in
/// any order; none when they hardly do. Each view is looked at by itself: they need not all be in
/// memory.
std::vector<float> pointsApart(std::span<const EdgeView> views,
                               const std::vector<const Image<float>*>& q) {
    const auto count = static_cast<std::int64_t>(views.size());
    std::vector<std::vector<GridPixel>> grids(views.size());
    parallelFor(0, count, [&](std::size_t i) { grids[i] = gridOf(*q[i]); });
    std::vector<std::vector<float>> found(views.size());
    parallelFor(0, count, [&](std::size_t k) {
        for (std::size_t i = 0; i < views.size(); ++i) {
            if (k == i) continue;
            const Warp warp =
                warpFrom(views[k].space->pixelFromWorld * views[i].space->worldFromPixel);
            for (const GridPixel& p : grids[i]) {
                const glm::vec4 h = warp.homogeneous(p.x, p.y, p.q);
                if (!(h.w > 0.0f)) continue;
                const float u = h.x / h.w, v = h.y / h.w, at = h.z / h.w;
                const float there = between(*q[k], u - 0.5f, v - 0.5f);
                const float share = std::abs(there - at) / views[k].space->axis.relativeScale(at);
                if (there > 0.0f && share < kSameSurface) found[k].push_back(share);
            }
        }
    });
    std::vector<float> apart;
    for (const auto& part : found) apart.insert(apart.end(), part.begin(), part.end());
    if (apart.size() < kFewPoints) apart.clear();
    return apart;
}

/// What a quarter of them is below; there must be some.
float lowerQuartile(std::vector<float>& values) {
    const auto quarter = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 4);
    std::nth_element(values.begin(), quarter, values.end());
    return *quarter;
}

/// The median of pointsApart().
std::optional<float> disagreement(std::span<const EdgeView> views,
                                  const std::vector<const Image<float>*>& q) {
    auto apart = pointsApart(views, q);
    if (apart.empty()) return {};
    return medianOf(std::move(apart));
}

/// A pixel at the edge of a surface, whose own colour tells.
struct EdgePixel {
    int x, y;
    float front, back;  ///< q of both surfaces there
    float ownShare;
    glm::vec3 colour;
};

std::vector<EdgePixel> edgePixels(const EdgeView& view) {
    const Edges edges(*view.q, view);
    std::vector<glm::ivec3> found;
    const int height = view.q->height(), every = std::max(1, height / kRows);
    for (int y = every / 2; y < height; y += every)
        for (int x = 0; x < view.q->width(); ++x)
            if (const int i = edges.behind(x, y, 4); i >= 0) found.emplace_back(x, y, i);
    const std::size_t stride = std::max<std::size_t>(1, found.size() / kEdges);
    std::vector<EdgePixel> pixels;
    for (std::size_t k = 0; k < found.size(); k += stride) {
        const int x = found[k].x, y = found[k].y, i = found[k].z;
        if (const auto share = edges.ownShare(x, y, i))
            pixels.push_back({x, y, view.q->at(x, y), edges.goesOn(x, y, i), *share,
                              glm::vec3(view.texture->at(x, y))});
    }
    return pixels;
}

/// A point of one view in another.
struct SeenAt {
    float u = -1, v = -1;  ///< pixels
    float q = 0;           ///< 0: behind that view's camera, or beside its picture
};

SeenAt seenAt(const EdgeView& view, const Warp& warp, const EdgePixel& p, float q) {
    const glm::vec4 h =
        warp.homogeneous(static_cast<float>(p.x) + 0.5f, static_cast<float>(p.y) + 0.5f, q);
    if (!(h.w > 0.0f)) return {};
    const SeenAt at{h.x / h.w, h.y / h.w, h.z / h.w};
    const bool in = at.u >= 0.0f && at.v >= 0.0f && at.u < static_cast<float>(view.q->width()) &&
                    at.v < static_cast<float>(view.q->height());
    return in ? at : SeenAt{};
}

/// The colour that a view shows at a point of another, if it shows a surface there.
std::optional<glm::vec3> colourIn(const EdgeView& view, const SeenAt& at, float same) {
    if (!(at.q > 0.0f)) return {};
    const int x = static_cast<int>(at.u), y = static_cast<int>(at.v);
    const float there = view.q->at(x, y);
    if (!(there > 0.0f) || !(std::abs(there - at.q) < same * view.space->axis.relativeScale(at.q)))
        return {};
    const glm::vec4 c = view.texture->at(x, y);
    if (c.a < 1.0f) return {};
    return glm::vec3(c);
}

/// The colours that another view has on the surfaces before and behind the edge at a pixel.
struct ColoursSeen {
    glm::vec3 front, back;

    [[nodiscard]] bool isFront(glm::vec3 colour) const {
        return glm::distance(front, colour) < glm::distance(back, colour);
    }
};

/// Nothing unless it shows both. `warp`: from the pixels of `own`.
std::optional<ColoursSeen> coloursSeen(const EdgeView& view, const EdgeView& own, const Warp& warp,
                                       const EdgePixel& p) {
    const float same = std::min(
        kSameSurface, kSameOfJump * (p.front - p.back) / own.space->axis.relativeScale(p.front));
    const auto front = colourIn(view, seenAt(view, warp, p, p.front), same);
    const auto back = colourIn(view, seenAt(view, warp, p, p.back), same);
    if (!front || !back) return {};
    return ColoursSeen{*front, *back};
}

/// How far a point is from what a view shows there, if it may be the same surface: pixels' widths.
std::optional<float> pixelsOff(const EdgeView& view, const SeenAt& at) {
    const float there = between(*view.q, at.u - 0.5f, at.v - 0.5f);
    const DepthAxis& axis = view.space->axis;
    const float width = axis.relativeScale(at.q) * axis.pixelShare();
    if (!(there > 0.0f) || !(std::abs(there - at.q) < kSamePixels * width)) return {};
    return std::abs(there - at.q) / width;
}

/// What a view says of the pixels at edges of others.
struct Witnesses {
    int asked = 0, front = 0;  ///< have colours of both surfaces; that is theirs in front
    std::vector<float> off;    ///< pixelsOff()

    void add(const EdgeView& view, const EdgeView& own, const std::vector<EdgePixel>& pixels) {
        const Warp warp = warpFrom(view.space->pixelFromWorld * own.space->worldFromPixel);
        for (const EdgePixel& p : pixels) {
            if (const auto apart = pixelsOff(view, seenAt(view, warp, p, p.front)))
                off.push_back(*apart);
            const auto seen = coloursSeen(view, own, warp, p);
            if (!seen) continue;
            ++asked;
            front += seen->isFront(p.colour);
        }
    }
};

/// Each view is asked about every so many others: so few of them look at each.
std::size_t everyWitness(std::size_t views) {
    return std::max<std::size_t>(1, views / kWitnesses);
}

/// Whether other views deny that edges are fat: they have the colours of the pixels there on the
/// surface in front rather than on the one behind, or edges in just the same places.
bool othersShowTheFront(std::span<const EdgeView> views) {
    const std::size_t every = everyWitness(views.size());
    const auto count = static_cast<std::int64_t>(views.size());
    std::vector<std::vector<EdgePixel>> pixels(views.size());
    parallelFor(0, count, [&](std::size_t i) { pixels[i] = edgePixels(views[i]); });
    // Each view is looked at by itself, for those that ask it: every so many.
    std::vector<Witnesses> all(views.size());
    parallelFor(0, count, [&](std::size_t k) {
        for (std::size_t i = k % every; i < views.size(); i += every)
            if (i != k) all[k].add(views[k], views[i], pixels[i]);
    });
    Witnesses sum;
    for (const Witnesses& one : all) {
        sum.asked += one.asked;
        sum.front += one.front;
        sum.off.insert(sum.off.end(), one.off.begin(), one.off.end());
    }
    const auto shareAbove = [&](float share) {
        return static_cast<float>(sum.front) > share * static_cast<float>(sum.asked);
    };
    const bool tell = sum.asked >= kFewWitnesses;
    if (sum.asked >= kFewestWitnesses && shareAbove(tell ? kFrontInOthers : kFrontInAgreeing))
        return true;
    if (tell && !shareAbove(kFrontInAgreeing)) return false;
    return sum.off.size() >= static_cast<std::size_t>(kFewWitnesses) &&
           lowerQuartile(sum.off) < kSamePlaceOfPixel;
}

/// Pixels at edges whose colours do not tell whose they are.
struct Untold {
    std::vector<EdgePixel> pixels;
    std::vector<std::uint8_t> unknown;  ///< of each: none beside it tell the colours of both sides
};

Untold untoldOf(const EdgeView& view) {
    const Edges edges(*view.q, view);
    Untold found;
    for (int y = 0; y < view.q->height(); ++y) {
        for (int x = 0; x < view.q->width(); ++x) {
            const int i = edges.behind(x, y, 8);
            if (i < 0 || edges.ownShare(x, y, i)) continue;
            found.pixels.push_back({x, y, view.q->at(x, y), edges.goesOn(x, y, i), 0,
                                    glm::vec3(view.texture->at(x, y))});
            found.unknown.push_back(!edges.knowsColours(x, y, i));
        }
    }
    return found;
}

/// Of pixels of another view: by how many more views have their colour in front than behind.
using Votes = std::vector<std::atomic<int>>;

/// Those of one view: nothing where it has no colours of both, or such that look alike.
void vote(const EdgeView& view, const EdgeView& own, std::span<const EdgePixel> pixels,
          Votes& votes) {
    const Warp warp = warpFrom(view.space->pixelFromWorld * own.space->worldFromPixel);
    for (std::size_t n = 0; n < pixels.size(); ++n) {
        const auto seen = coloursSeen(view, own, warp, pixels[n]);
        if (!seen) continue;
        const glm::vec3 apart = seen->front - seen->back;
        if (glm::dot(apart, apart) < kContrast) continue;
        votes[n] += seen->isFront(pixels[n].colour) ? 1 : -1;
    }
}

/// Of each view, the pixels at edges that stay though their colours do not tell. Where surfaces are
/// thin, no pixels beside their edges tell, and other views mostly have the colours of those pixels
/// in front: then they stay, but for those whose colour more views have behind.
std::vector<std::vector<glm::ivec2>> thinParts(std::span<const EdgeView> views) {
    const std::size_t every = everyWitness(views.size());
    const auto count = static_cast<std::int64_t>(views.size());
    std::vector<Untold> untold(views.size());
    parallelFor(0, count, [&](std::size_t i) { untold[i] = untoldOf(views[i]); });
    std::vector<Votes> votes;
    for (const Untold& one : untold) votes.emplace_back(one.pixels.size());
    parallelFor(0, count, [&](std::size_t k) {
        for (std::size_t i = k % every; i < views.size(); i += every)
            if (i != k) vote(views[k], views[i], untold[i].pixels, votes[i]);
    });
    std::int64_t front = 0, back = 0;
    for (std::size_t i = 0; i < views.size(); ++i) {
        for (std::size_t n = 0; n < votes[i].size(); ++n) {
            if (!untold[i].unknown[n]) continue;
            front += votes[i][n] > 0;
            back += votes[i][n] < 0;
        }
    }
    std::vector<std::vector<glm::ivec2>> stay(views.size());
    if (static_cast<float>(back) >= kMostlyBehind * static_cast<float>(front)) return stay;
    for (std::size_t i = 0; i < views.size(); ++i)
        for (std::size_t n = 0; n < votes[i].size(); ++n)
            if (votes[i][n] >= 0)
                stay[i].emplace_back(untold[i].pixels[n].x, untold[i].pixels[n].y);
    return stay;
}

}  // namespace

std::vector<float> sharesAtEdges(const EdgeView& view) {
    std::vector<float> shares;
    for (const EdgePixel& pixel : edgePixels(view)) shares.push_back(pixel.ownShare);
    return shares;
}

float colourAtEdges(std::vector<float> shares) {
    const auto behind = std::ranges::count_if(shares, [](float share) { return share < kBehind; });
    const bool tell =
        shares.size() >= kFewEdges &&
        static_cast<float>(behind) >= kLeastBehind * static_cast<float>(shares.size());
    return tell ? medianOf(std::move(shares)) : 1.0f;
}

float colourAtEdges(std::span<const EdgeView> views) {
    std::vector<std::vector<float>> shares(views.size());
    parallelFor(0, views.size(), [&](std::size_t k) { shares[k] = sharesAtEdges(views[k]); });
    std::vector<float> all;
    for (const auto& part : shares) all.insert(all.end(), part.begin(), part.end());
    return colourAtEdges(std::move(all));
}

bool edgesAreFat(float colour) {
    return colour < kFat;
}

int thinFatEdges(std::span<const EdgeView> views, PixelSpool* spool) {
    std::vector<std::vector<glm::ivec2>> stay;
    const auto all = [&](Change change) {
        std::vector<Image<float>> images;
        for (std::size_t i = 0; i < views.size(); ++i) {
            images.push_back(changed(views[i], change, stay[i]));
            images.back().moveTo(spool);
        }
        return images;
    };
    const auto apart = [&](const std::vector<Image<float>>& images) {
        std::vector<const Image<float>*> q;
        for (const Image<float>& image : images) q.push_back(&image);
        return disagreement(views, q);
    };
    int round = 0;
    for (; round < kMostRounds && edgesAreFat(colourAtEdges(views)) && !othersShowTheFront(views);
         ++round) {
        std::vector<const Image<float>*> before;
        for (const EdgeView& view : views) before.push_back(view.q);
        const auto now = disagreement(views, before);
        stay = thinParts(views);
        std::vector<Image<float>> eroded = all(Change::everywhere);
        const auto closer = apart(eroded);
        bool everywhere = now && closer && *closer < kClearlyCloser * *now;
        if (everywhere) {
            // The farthest of nine noisy distances differ less than the distances do, too, and so
            // do the nearest.
            const auto grown = apart(all(Change::nearest));
            everywhere = grown && *closer < kClearlyCloser * *grown;
        }
        for (std::size_t i = 0; i < views.size(); ++i) {
            *views[i].q =
                everywhere ? std::move(eroded[i]) : changed(views[i], Change::edges, stay[i]);
            views[i].q->moveTo(spool);
        }
    }
    return round;
}

}  // namespace stx

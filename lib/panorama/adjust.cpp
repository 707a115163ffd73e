#include "lib/panorama/adjust.hpp"

#include <algorithm>
#include <array>

#include "lib/base/parallel.hpp"
#include "lib/panorama/small_solver.hpp"

namespace stx::panorama {
namespace {

/// How much a lens moves what is seen in the corners, standard deviation as a share of their
/// distance to the middle: where pictures cannot tell, there is no distortion.
constexpr double kDistortionSpread = 0.03;

/// How much the focal length of a picture differs from that of all, standard deviation of the
/// logarithm: lenses of cameras that focus anew become longer or shorter by about as much.
constexpr double kStretchSpread = 0.01;

/// Unknowns of a pair: turn of a (3), of b (3), logarithm of the focal length, k1 / focal^2; with
/// own focal lengths those of a and of b.
constexpr std::size_t kShared = 8, kOwn = 10;
/// Numbers of these unknowns in a block's equations; the turns of a and b begin at 0 and 3.
constexpr std::size_t kTurnOfB = 3, kFocal = 6, kDistortion = 7, kStretchOfA = 8, kStretchOfB = 9;
/// The step of derivatives by differences: of the logarithm of a focal length, and of the share by
/// which the distortion moves the corner. Small, but far above what rounding leaves.
constexpr double kSmallStep = 1e-6;
/// A match behind the other camera costs as much as one that is a whole diagonal off; squared,
/// halves of the diagonal.
constexpr double kBehindCamera = 4;
/// The most by which one step may change the logarithm of the focal length of all pictures, and the
/// largest values that it leaves to a picture's own one and to the distortion (a share of the
/// distance of the corner): the equations are linear, and true nearby only.
constexpr double kMostFocalStep = 0.2, kMostStretch = 0.1, kMostDistortion = 0.25;
/// Damping (Levenberg and Marquardt), a share of each equation's own weight: at first, at least,
/// and what it is multiplied by after a step that made the cost less or more.
constexpr double kFirstDamping = 1e-4, kLeastDamping = 1e-9, kDampLess = 0.2, kDampMore = 8;
/// A step that does not make the cost less is tried again so often, with more damping.
constexpr int kDampingTries = 8;
/// Added to each equation's own weight, so that what no match says anything about stays.
constexpr double kStays = 1e-9;
/// Steps end where one makes the cost less by less than this share.
constexpr double kSettledShare = 1e-7;
/// The difference of a match that one of the pictures cannot see, pixels: larger than any other.
constexpr double kNotSeen = 1e9;

struct Block {
    std::array<double, kOwn * kOwn> matrix{};
    std::array<double, kOwn> right{};
    double cost = 0;
};

/// The lens of a picture, with a little more focal length, and with a little more distortion.
using Lenses = std::array<TurnLens, 3>;

/// Distortion is counted at the corner, so that it has the size of a share for every lens.
TurnLens lensOf(double logFocal, double corner) {
    const double focal = std::exp(logFocal);
    return {focal, corner * focal * focal};
}

Lenses lensesOf(const TurnModel& model, int k) {
    const TurnLens lens = model.lensOf(k);
    const double logFocal = std::log(lens.focal), corner = lens.k1 / (lens.focal * lens.focal);
    return {lens, lensOf(logFocal + kSmallStep, corner), lensOf(logFocal, corner + kSmallStep)};
}

double robust(double squared, const AdjustSettings& s) {
    const double threshold = s.huberPixels;
    if (s.cauchy) return threshold * threshold * std::log1p(squared / (threshold * threshold));
    if (squared <= threshold * threshold) return squared;
    return 2 * threshold * std::sqrt(squared) - threshold * threshold;
}

/// Adds what one picture sees of the other's positions. `sign`: +1 when `from` is picture a.
void addSide(Block& block, glm::dmat3 worldFromFrom, glm::dmat3 worldFromTo, glm::dvec2 from,
             glm::dvec2 to, bool fromIsA, const Lenses& lensesFrom, const Lenses& lensesTo,
             const AdjustSettings& s, bool derive) {
    std::array<glm::dvec2, 3> seen;
    glm::dvec3 world(0), inTo(0);
    for (std::size_t l = 0; l < (derive ? 3 : 1); ++l) {
        const glm::dvec3 w = worldFromFrom * lensesFrom[l].ray(from);
        const glm::dvec3 r = w * worldFromTo;  // transposed: to camera space
        const auto p = lensesTo[l == 1 ? 0 : l].position(r);
        if (!p) {
            if (l == 0) block.cost += robust(kBehindCamera / (s.pixel * s.pixel), s);
            return;
        }
        seen[l] = *p;
        if (l == 0) {
            world = w;
            inTo = r;
        }
    }
    const glm::dvec2 e = (seen[0] - to) / s.pixel;
    const double squared = glm::dot(e, e);
    block.cost += robust(squared, s);
    if (!derive) return;
    const double limit = s.huberPixels * s.huberPixels;
    const double weight = s.cauchy           ? 1 / (1 + squared / limit)
                          : squared <= limit ? 1.0
                                             : s.huberPixels / std::sqrt(squared);
    // How the position changes with the ray in the camera.
    const TurnLens& lens = lensesTo[0];
    const double z = -inTo.z;
    const glm::dvec2 plane = glm::dvec2(inTo) / z;
    const double r2 = glm::dot(plane, plane), stretch = 1 + lens.k1 * r2;
    std::array<std::array<double, kOwn>, 2> j{};
    for (int row = 0; row < 2; ++row) {
        // d position / d plane, then d plane / d ray.
        glm::dvec2 byPlane = 2 * lens.k1 * plane[row] * plane;
        byPlane[row] += stretch;
        byPlane *= lens.focal / s.pixel;
        const glm::dvec3 byRay(byPlane.x / z, byPlane.y / z, glm::dot(byPlane, plane) / z);
        // ray = R_to^T (1 + [w_from] - [w_to]) world
        const glm::dvec3 byTurn = glm::cross(world, worldFromTo * byRay);
        auto& own = j[row];
        for (int i = 0; i < 3; ++i) {
            own[i] = fromIsA ? byTurn[i] : -byTurn[i];
            own[kTurnOfB + static_cast<std::size_t>(i)] = -own[i];
        }
        const double byFrom = (seen[1][row] - seen[0][row]) / (s.pixel * kSmallStep);
        // The distortion stays where it is in the picture.
        const double byTo = (1 + 3 * lens.k1 * r2) * lens.focal * plane[row] / s.pixel;
        own[kFocal] = byFrom + byTo;
        own[kDistortion] = (seen[2][row] - seen[0][row]) / (s.pixel * kSmallStep);
        own[kStretchOfA] = fromIsA ? byFrom : byTo;
        own[kStretchOfB] = fromIsA ? byTo : byFrom;
        const std::size_t count = s.ownFocals ? kOwn : kShared;
        for (std::size_t a = 0; a < count; ++a) {
            block.right[a] -= weight * own[a] * e[row];
            for (std::size_t b = 0; b < count; ++b)
                block.matrix[a * kOwn + b] += weight * own[a] * own[b];
        }
    }
}

std::vector<Block> blocksOf(const TurnModel& model, const std::vector<Pair>& pairs,
                            const AdjustSettings& s, bool derive) {
    std::vector<Block> blocks(pairs.size());
    parallelFor(0, pairs.size(), [&](std::size_t i) {
        const Pair& pair = pairs[i];
        const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
        if (!model.known[a] || !model.known[b]) return;
        const glm::dmat3 ra = glm::mat3_cast(model.worldFromCamera[a]);
        const glm::dmat3 rb = glm::mat3_cast(model.worldFromCamera[b]);
        const Lenses la = lensesOf(model, pair.a), lb = lensesOf(model, pair.b);
        Block& block = blocks[i];
        for (const Match& m : pair.matches) {
            addSide(block, ra, rb, m.a, m.b, true, la, lb, s, derive);
            addSide(block, rb, ra, m.b, m.a, false, lb, la, s, derive);
        }
    });
    return blocks;
}

double priorCost(const TurnModel& model, const AdjustSettings& s) {
    const TurnLens& lens = model.lens;
    const double f = std::log(lens.focal / s.expectedFocal) / s.focalSpread;
    const double k = lens.k1 / (lens.focal * lens.focal) / kDistortionSpread;
    double stretched = 0;
    for (const double t : model.stretch) stretched += t * t;
    stretched /= kStretchSpread * kStretchSpread;
    return (f * f + k * k + stretched) * s.noisePixels * s.noisePixels;
}

double costOf(const TurnModel& model, const std::vector<Pair>& pairs, const AdjustSettings& s) {
    double cost = priorCost(model, s);
    for (const Block& block : blocksOf(model, pairs, s, false)) cost += block.cost;
    return cost;
}

/// Where each unknown is in the equations; SIZE_MAX where there is none.
struct Unknowns {
    std::vector<std::size_t> turn;  ///< three for each known picture but the first
    std::vector<std::size_t>
        stretch;  ///< one for each known picture, with AdjustSettings::ownFocals
    std::size_t focal = 0, corner = 0, count = 0;

    Unknowns(const TurnModel& model, const AdjustSettings& s)
        : turn(model.known.size(), SIZE_MAX), stretch(model.known.size(), SIZE_MAX) {
        bool first = true;
        for (std::size_t k = 0; k < turn.size(); ++k) {
            if (!model.known[k]) continue;
            if (!first) {
                turn[k] = count;
                count += 3;
            }
            first = false;
        }
        focal = count++;
        corner = count++;
        for (std::size_t k = 0; s.ownFocals && k < turn.size(); ++k)
            if (model.known[k]) stretch[k] = count++;
    }

    /// Those of the block of a pair.
    [[nodiscard]] std::array<std::size_t, kOwn> of(const Pair& pair,
                                                   const AdjustSettings& s) const {
        const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
        std::array<std::size_t, kOwn> index{};
        for (std::size_t i = 0; i < 3; ++i) {
            index[i] = turn[a] == SIZE_MAX ? SIZE_MAX : turn[a] + i;
            index[kTurnOfB + i] = turn[b] == SIZE_MAX ? SIZE_MAX : turn[b] + i;
        }
        index[kFocal] = s.fixFocal ? SIZE_MAX : focal;
        index[kDistortion] = s.fixDistortion ? SIZE_MAX : corner;
        index[kStretchOfA] = stretch[a];
        index[kStretchOfB] = stretch[b];
        return index;
    }
};

double cornerOf(const TurnModel& model) {
    return model.lens.k1 / (model.lens.focal * model.lens.focal);
}

/// The normal equations of one step: `matrix` by rows.
struct Equations {
    std::vector<double> matrix, right;
};

Equations equationsOf(const TurnModel& model, const std::vector<Pair>& pairs,
                      const AdjustSettings& s, const Unknowns& at) {
    const std::size_t n = at.count;
    Equations e{std::vector<double>(n * n, 0.0), std::vector<double>(n, 0.0)};
    const auto blocks = blocksOf(model, pairs, s, true);
    for (std::size_t p = 0; p < pairs.size(); ++p) {
        const auto index = at.of(pairs[p], s);
        for (std::size_t i = 0; i < kOwn; ++i) {
            if (index[i] == SIZE_MAX) continue;
            e.right[index[i]] += blocks[p].right[i];
            for (std::size_t j = 0; j < kOwn; ++j)
                if (index[j] != SIZE_MAX)
                    e.matrix[index[i] * n + index[j]] += blocks[p].matrix[i * kOwn + j];
        }
    }
    // What is expected of the lens, against the noise of the matches.
    const double noise = s.noisePixels * s.noisePixels;
    const auto expect = [&](std::size_t i, double spread, double off, bool fixed) {
        const double weight = noise / (spread * spread);
        e.matrix[i * n + i] += weight;
        if (!fixed) e.right[i] -= weight * off;
    };
    expect(at.focal, s.focalSpread, std::log(model.lens.focal / s.expectedFocal), s.fixFocal);
    expect(at.corner, kDistortionSpread, cornerOf(model), s.fixDistortion);
    for (std::size_t c = 0; c < at.stretch.size(); ++c)
        if (at.stretch[c] != SIZE_MAX)
            expect(at.stretch[c], kStretchSpread, model.stretch[c], false);
    return e;
}

/// The model after a step, of which the lens takes no more than is allowed.
TurnModel movedBy(const TurnModel& model, const std::vector<double>& step, const Unknowns& at,
                  const AdjustSettings& s) {
    TurnModel moved = model;
    for (std::size_t c = 0; c < at.turn.size(); ++c) {
        const std::size_t t = at.turn[c];
        if (t != SIZE_MAX)
            moved.worldFromCamera[c] = glm::normalize(quatOf({step[t], step[t + 1], step[t + 2]}) *
                                                      moved.worldFromCamera[c]);
        if (at.stretch[c] != SIZE_MAX)
            moved.stretch[c] =
                std::clamp(moved.stretch[c] + step[at.stretch[c]], -kMostStretch, kMostStretch);
    }
    const double logFocal =
        std::log(model.lens.focal) + std::clamp(step[at.focal], -kMostFocalStep, kMostFocalStep);
    moved.lens = lensOf(
        logFocal, std::clamp(cornerOf(model) + step[at.corner], -kMostDistortion, kMostDistortion));
    if (s.fixFocal) moved.lens.focal = model.lens.focal;
    if (s.fixDistortion) moved.lens.k1 = model.lens.k1;
    return moved;
}

}  // namespace

// Levenberg and Marquardt: a step that makes it worse is tried again with more damping.
double adjust(TurnModel& model, const std::vector<Pair>& pairs, const AdjustSettings& s) {
    const Unknowns at(model, s);
    if (s.ownFocals) model.stretch.resize(model.known.size(), 0.0);
    double damping = kFirstDamping;
    double cost = costOf(model, pairs, s);
    for (int iteration = 0; iteration < s.iterations; ++iteration) {
        const Equations equations = equationsOf(model, pairs, s, at);
        bool better = false;
        double gain = 0;
        for (int tries = 0; tries < kDampingTries && !better; ++tries) {
            auto [damped, step] = equations;
            for (std::size_t i = 0; i < at.count; ++i)
                damped[i * at.count + i] += damping * equations.matrix[i * at.count + i] + kStays;
            if (solveSymmetric(damped, step)) {
                TurnModel moved = movedBy(model, step, at, s);
                const double now = costOf(moved, pairs, s);
                if (now < cost) {
                    gain = cost - now;
                    cost = now;
                    model = std::move(moved);
                    better = true;
                }
            }
            damping = better ? std::max(damping * kDampLess, kLeastDamping) : damping * kDampMore;
        }
        if (!better || gain < kSettledShare * cost) break;
    }
    return cost;
}

std::optional<glm::dvec2> seenBy(const TurnModel& model, int a, int b, glm::dvec2 p) {
    const auto& from = model.worldFromCamera[a];
    const auto& to = model.worldFromCamera[b];
    return model.lensOf(b).position(glm::inverse(to) * (from * model.lensOf(a).ray(p)));
}

double differenceOf(const TurnModel& model, const Pair& pair, const Match& match, double pixel) {
    const auto inB = seenBy(model, pair.a, pair.b, match.a);
    const auto inA = seenBy(model, pair.b, pair.a, match.b);
    if (!inA || !inB) return kNotSeen;
    return 0.5 * (glm::distance(*inA, match.a) + glm::distance(*inB, match.b)) / pixel;
}

}  // namespace stx::panorama

#include "lib/panorama/matching.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <numeric>
#include <random>

#include "lib/base/parallel.hpp"
#include "lib/panorama/kernels.hpp"
#include "lib/panorama/small_solver.hpp"

namespace stx::panorama {
namespace {

/// Matches that agree with one rotation are taken for chance when they are fewer than this, or than
/// so many and a share of all that were tried.
constexpr std::size_t kFewest = 8;
constexpr double kByChance = 5, kByChanceShare = 0.12;
/// The nearest feature must be nearer than this share of the next one's distance.
constexpr int kRatioPercent = 86;
/// How far a match may be off the rotation, halves of the diagonal: the focal length is not exact
/// yet, and the lens is taken for one without distortion.
constexpr double kRoughTolerance = 0.009;
/// Corners of one picture that are nearer to each other than this, pixels of the work copy, are
/// one, found on two levels or with two directions.
constexpr float kSameCorner = 4.0f;
/// Matches are one where they are nearer to each other than this in both pictures, halves of the
/// diagonal (1.5 and 3 pixels of a usual work copy).
constexpr double kSameInA = 2e-3, kSameInB = 4e-3;
/// Rotations are found by trying two matches at a time. Two right ones are among them with 99.99 %
/// after -ln(1e-4) over the square of the share of right ones; so many times as many are tried,
/// since matches are not exact, some more, and no more than a limit.
constexpr double kLogOfSure = 9.2, kMoreTries = 4, kExtraTries = 20, kMostTries = 1500;
/// The angle between two rays may differ by so many times the tolerance from that between their
/// matches, and must itself be at least so many times the tolerance: else it says little.
constexpr double kAngleTolerance = 1.5, kLeastAngle = 8;
/// A rotation with fewer matches has none to be found better by.
constexpr std::size_t kFewestOfTurn = 3;
/// A rotation is fitted anew to the matches that agree with it, so often.
constexpr int kRefits = 3;
/// Steps of the fit of a rotation, at most, and the least step, radians: what doubles hold.
constexpr int kTurnSteps = 8;
constexpr double kTurnExact = 1e-12;

std::vector<std::int16_t> sumsOf(const std::vector<Descriptor>& descriptors) {
    std::vector<std::int16_t> sums;
    sums.reserve(descriptors.size());
    for (const Descriptor& d : descriptors)
        sums.push_back(static_cast<std::int16_t>(std::accumulate(d.begin(), d.end(), 0)));
    return sums;
}

/// A turn that takes two rays of one picture to two of another, whose angles are about the same.
glm::dquat turnOfTwo(glm::dvec3 a1, glm::dvec3 a2, glm::dvec3 b1, glm::dvec3 b2) {
    const auto frame = [](glm::dvec3 u, glm::dvec3 v) {
        const glm::dvec3 middle = glm::normalize(u + v);
        const glm::dvec3 across = glm::normalize(v - u);
        return glm::dmat3(middle, across, glm::cross(middle, across));
    };
    return glm::normalize(glm::quat_cast(frame(b1, b2) * glm::transpose(frame(a1, a2))));
}

/// Matches of so many tried ones that must agree.
double fewestOf(std::size_t tried) {
    return std::max(static_cast<double>(kFewest),
                    kByChance + kByChanceShare * static_cast<double>(tried));
}

bool enough(const Pair& pair, std::size_t tried) {
    return static_cast<double>(pair.matches.size()) >= fewestOf(tried);
}

/// How often two matches are tried when this share of all is right.
int triesFor(double share) {
    return static_cast<int>(
        std::min(kMostTries, kMoreTries * kLogOfSure / (share * share) + kExtraTries));
}

}  // namespace

std::vector<Match> matchFeatures(const WorkCopy& copyA, const Features& a, const WorkCopy& copyB,
                                 const Features& b) {
    std::vector<int> nearestOfB(b.points.size(), -1);
    std::vector<std::int16_t> distanceOfB(b.points.size(), kFarDescriptors);
    struct Best {
        int at = -1;
        std::int16_t distance = kFarDescriptors, next = kFarDescriptors;
    };
    std::vector<Best> best(a.points.size());
    const auto sumsA = sumsOf(a.descriptors), sumsB = sumsOf(b.descriptors);
    std::array<std::int16_t, kDescriptorBlock> distances;
    std::array<std::uint8_t, kDescriptorBlock> indices;
    for (std::size_t block = 0; block < b.points.size(); block += kDescriptorBlock) {
        const std::size_t count = std::min(kDescriptorBlock, b.points.size() - block);
        for (std::size_t i = 0; i < a.points.size(); ++i) {
            Best& mine = best[i];
            const std::size_t near = nearDescriptors(
                a.descriptors[i], sumsA[i], b.descriptors.data() + block, sumsB.data() + block,
                distanceOfB.data() + block, count, mine.next, distances.data(), indices.data());
            for (std::size_t n = 0; n < near; ++n) {
                const std::size_t j = block + indices[n];
                const std::int16_t d = distances[indices[n]];
                if (d < distanceOfB[j]) {
                    distanceOfB[j] = d;
                    nearestOfB[j] = static_cast<int>(i);
                }
                if (d >= mine.next) continue;
                // The same corner on another level, or turned, is not another corner.
                const bool same = mine.at >= 0 && glm::distance(b.points[mine.at].pixel,
                                                                b.points[j].pixel) < kSameCorner;
                if (d < mine.distance) {
                    if (!same) mine.next = mine.distance;
                    mine.distance = d;
                    mine.at = static_cast<int>(j);
                } else if (!same) {
                    mine.next = d;
                }
            }
        }
    }
    std::vector<Match> matches;
    for (std::size_t i = 0; i < best.size(); ++i) {
        const Best& m = best[i];
        if (m.at < 0 || nearestOfB[m.at] != static_cast<int>(i)) continue;
        // Where b has no other feature, nothing can be mistaken for it.
        if (m.next < kFarDescriptors && m.distance * 100 > m.next * kRatioPercent) continue;
        matches.push_back(
            {copyA.position(a.points[i].pixel), copyB.position(b.points[m.at].pixel)});
    }
    // One match for each place.
    std::vector<Match> single;
    for (const Match& m : matches) {
        const bool known = std::any_of(single.begin(), single.end(), [&](const Match& s) {
            return glm::distance(s.a, m.a) < kSameInA && glm::distance(s.b, m.b) < kSameInB;
        });
        if (!known) single.push_back(m);
    }
    return single;
}

glm::dquat turnOf(const std::vector<Match>& matches, const TurnLens& lensA, const TurnLens& lensB,
                  glm::dquat turn) {
    std::vector<std::pair<glm::dvec3, glm::dvec3>> rays;
    for (const Match& m : matches) rays.emplace_back(lensA.ray(m.a), lensB.ray(m.b));
    for (int iteration = 0; iteration < kTurnSteps; ++iteration) {
        // b = exp(w) turn a, to first order; least squares over the differences of the rays.
        std::vector<double> matrix(9, 0.0), right(3, 0.0);
        for (const auto& [a, b] : rays) {
            const glm::dvec3 here = turn * a;
            const glm::dvec3 moment = glm::cross(here, b);
            for (int i = 0; i < 3; ++i) {
                right[i] += moment[i];
                for (int j = 0; j < 3; ++j)
                    matrix[3 * i + j] += (i == j ? 1.0 : 0.0) - here[i] * here[j];
            }
        }
        if (!solveSymmetric(matrix, right)) break;
        const glm::dvec3 step(right[0], right[1], right[2]);
        turn = glm::normalize(quatOf(step) * turn);
        if (glm::length(step) < kTurnExact) break;
    }
    return turn;
}

Pair agreeingMatches(const std::vector<Match>& matches, const TurnLens& lens, double tolerance) {
    Pair best;
    if (matches.size() < 2) return best;
    std::vector<glm::dvec3> a, b;
    for (const Match& m : matches) {
        a.push_back(lens.ray(m.a));
        b.push_back(lens.ray(m.b));
    }
    const auto agrees = [&](glm::dquat turn, std::size_t i) {
        const auto p = lens.position(turn * a[i]);
        return p && glm::distance(*p, matches[i].b) < tolerance;
    };
    // The same, one array for each coordinate.
    std::vector<double> columns(5 * matches.size());
    const auto column = [&](std::size_t c) { return columns.data() + c * matches.size(); };
    for (std::size_t i = 0; i < matches.size(); ++i)
        for (int axis = 0; axis < 3; ++axis) {
            column(static_cast<std::size_t>(axis))[i] = a[i][axis];
            if (axis < 2) column(static_cast<std::size_t>(3 + axis))[i] = matches[i].b[axis];
        }
    const RayMatches rays{column(0), column(1), column(2), column(3), column(4), matches.size()};
    std::mt19937 random(static_cast<std::uint32_t>(matches.size()));
    std::size_t most = 1;
    const double angle = kAngleTolerance * tolerance / lens.focal;
    const auto all = static_cast<double>(matches.size());
    const auto count32 = static_cast<std::uint32_t>(matches.size());
    // What is too little to count needs not be found; a larger share, once found, needs fewer.
    int tries = triesFor(std::min(1.0, fewestOf(matches.size()) / all));
    for (int t = 0; t < tries; ++t) {
        // Numbers of 32 bits are divided in a third of the time.
        const std::uint32_t i = static_cast<std::uint32_t>(random()) % count32,
                            j = static_cast<std::uint32_t>(random()) % count32;
        if (i == j) continue;
        const double between = glm::distance(a[i], a[j]);
        if (between < kLeastAngle * tolerance) continue;
        if (std::abs(between - glm::distance(b[i], b[j])) > angle) continue;
        const glm::dquat turn = turnOfTwo(a[i], a[j], b[i], b[j]);
        const std::size_t count =
            countAgreeing(rays, glm::mat3_cast(turn), lens.focal, tolerance, most);
        if (count > most) {
            most = count;
            best.bFromA = turn;
            tries = std::min(tries, triesFor(static_cast<double>(most) / all));
        }
    }
    if (most < kFewestOfTurn) return best;
    for (int round = 0; round < kRefits; ++round) {
        best.matches.clear();
        for (std::size_t i = 0; i < matches.size(); ++i)
            if (agrees(best.bFromA, i)) best.matches.push_back(matches[i]);
        if (best.matches.size() < kFewestOfTurn) break;
        best.bFromA = turnOf(best.matches, lens, best.bFromA);
    }
    return best;
}

Result<PairSearch> searchPairs(const std::vector<WorkCopy>& copies,
                               const std::vector<Features>& features,
                               const std::vector<double>& focals, Job& job) {
    const auto count = static_cast<int>(copies.size());
    std::vector<std::pair<int, int>> all;
    for (int a = 0; a < count; ++a)
        for (int b = a + 1; b < count; ++b) all.emplace_back(a, b);
    std::vector<std::vector<Match>> matches(all.size());
    std::vector<std::vector<Pair>> found(all.size());
    std::atomic<std::int64_t> done = 0;
    parallelFor(0, all.size(), [&](std::size_t i) {
        if (job.cancelled) return;
        const auto k = i;
        const auto a = static_cast<std::size_t>(all[k].first);
        const auto b = static_cast<std::size_t>(all[k].second);
        matches[k] = matchFeatures(copies[a], features[a], copies[b], features[b]);
        if (matches[k].size() >= kFewest) {
            for (const double focal : focals) {
                Pair pair = agreeingMatches(matches[k], {focal, 0}, kRoughTolerance);
                if (!enough(pair, matches[k].size())) pair.matches.clear();
                found[k].push_back(std::move(pair));
            }
        }
        job.progress(++done, static_cast<std::int64_t>(all.size()), "comparing pictures");
    });
    STX_CHECK(job.checkCancelled());
    PairSearch out;
    std::size_t best = 0, most = 0;
    for (std::size_t f = 0; f < focals.size(); ++f) {
        std::size_t sum = 0;
        for (const auto& pairs : found)
            if (!pairs.empty()) sum += pairs[f].matches.size();
        if (sum > most) {
            most = sum;
            best = f;
        }
    }
    out.focal = focals[best];
    for (std::size_t k = 0; k < all.size(); ++k) {
        if (found[k].empty()) continue;
        // A pair that another focal length serves better still helps to find the order.
        std::size_t use = best;
        if (found[k][use].matches.empty())
            for (std::size_t f = 0; f < focals.size(); ++f)
                if (found[k][f].matches.size() > found[k][use].matches.size()) use = f;
        if (found[k][use].matches.empty()) continue;
        Pair pair = std::move(found[k][use]);
        pair.a = all[k].first;
        pair.b = all[k].second;
        if (use != best) pair.bFromA = turnOf(pair.matches, {out.focal, 0}, pair.bFromA);
        out.pairs.push_back(std::move(pair));
    }
    return out;
}

}  // namespace stx::panorama

#include "lib/panorama/order.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "lib/base/parallel.hpp"

namespace stx::panorama {
namespace {

const glm::dquat kNoTurn(1, 0, 0, 0);

/// Another focal length is taken only where it makes the cost of focalByClosing() at most this
/// share of what it was, and less by at least so much: a turn that closes says both clearly, and
/// the rest is left to the adjustment.
constexpr double kClearShare = 0.6, kClearGain = 0.3;
/// Angles beyond this count as this in that cost, radians: mistakes all cost the same.
constexpr double kMostOff = 1.0;
/// The search for what is up: its first step and the least one, radians, and by how much a start's
/// cost must be below that of the starts before it.
constexpr double kFirstUpStep = 0.2, kLastUpStep = 2e-6, kLessCost = 1e-6;
/// The cosine of 20 degrees: pictures that look along what is up or down, or are no farther off,
/// have no direction around it to speak of. A small turn of theirs is a large one around it.
constexpr double kAlongUp = 0.94;

/// A direction across another one: of the X and Z axis one that is not nearly along it.
glm::dvec3 anyAcross(glm::dvec3 direction) {
    const bool alongX = std::abs(direction.x) >= 0.7;
    return glm::normalize(
        glm::cross(direction, alongX ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0)));
}

/// The relative turn that the matches of a pair say, to its second picture from its first.
std::vector<glm::dquat> turnsOf(const std::vector<Pair>& pairs, const TurnLens& lens) {
    std::vector<glm::dquat> turns(pairs.size());
    parallelFor(0, pairs.size(), [&](std::size_t i) {
        const Pair& pair = pairs[i];
        turns[i] = turnOf(pair.matches, lens, pair.bFromA);
    });
    return turns;
}

TurnModel chainOf(const PictureTree& tree, const std::vector<Pair>& pairs,
                  const std::vector<glm::dquat>& turns, const TurnLens& lens) {
    TurnModel model;
    model.lens = lens;
    model.worldFromCamera.assign(tree.parent.size(), kNoTurn);
    model.known.assign(tree.parent.size(), false);
    for (const int k : tree.order) {
        const auto i = static_cast<std::size_t>(k);
        model.known[i] = true;
        if (tree.parent[i] < 0) continue;
        const auto p = static_cast<std::size_t>(tree.pair[i]);
        const auto& before = model.worldFromCamera[tree.parent[i]];
        const glm::dquat& bFromA = turns[p];
        // worldFromB = worldFromA aFromB
        model.worldFromCamera[i] =
            glm::normalize(before * (pairs[p].b == k ? glm::inverse(bFromA) : bFromA));
    }
    return model;
}

/// The angle of a direction around an axis, radians.
double yawOf(glm::dvec3 direction, glm::dvec3 up, glm::dvec3 zero) {
    return std::atan2(glm::dot(direction, glm::cross(up, zero)), glm::dot(direction, zero));
}

double wrapped(double angle) {
    return angle - 2 * M_PI * std::round(angle / (2 * M_PI));
}

/// The direction in which a picture looks.
glm::dvec3 aheadOf(const TurnModel& model, std::size_t k) {
    return model.worldFromCamera[k] * glm::dvec3(0, 0, -1);
}

/// Of each picture, whether it is known and looks around `up` and not along it; where none does,
/// whether it is known.
std::vector<bool> thatLookAround(const TurnModel& model, glm::dvec3 up) {
    std::vector<bool> around = model.known;
    for (std::size_t k = 0; k < around.size(); ++k)
        around[k] = around[k] && std::abs(glm::dot(aheadOf(model, k), up)) <= kAlongUp;
    const bool some = std::find(around.begin(), around.end(), true) != around.end();
    return some ? around : model.known;
}

/// A pair's place in the order in which a tree is made: those of a lower rank before all others,
/// those of the last one never.
enum class Rank { first, usual, overTheJoint, never };

/// Whether a pair goes from the last pictures to the first, or so it seems by their numbers.
Rank rankOf(const Pair& pair, int pictures, bool closeLoop) {
    return !closeLoop && 2 * (pair.b - pair.a) > pictures ? Rank::overTheJoint : Rank::usual;
}

PictureTree treeByRank(int pictures, const std::vector<Pair>& pairs,
                       const std::vector<Rank>& ranks) {
    const auto count = static_cast<std::size_t>(pictures);
    std::vector<std::size_t> strongest;
    for (std::size_t p = 0; p < pairs.size(); ++p)
        if (ranks[p] != Rank::never) strongest.push_back(p);
    std::stable_sort(strongest.begin(), strongest.end(), [&](std::size_t x, std::size_t y) {
        return ranks[x] != ranks[y] ? ranks[x] < ranks[y]
                                    : pairs[x].matches.size() > pairs[y].matches.size();
    });
    // Kruskal's tree.
    std::vector<int> group(count);
    std::iota(group.begin(), group.end(), 0);
    const auto rootOf = [&](int k) {
        while (group[k] != k) k = group[k];
        return k;
    };
    PictureTree tree;
    tree.inTree.assign(pairs.size(), false);
    tree.parent.assign(count, -1);
    tree.pair.assign(count, -1);
    for (const std::size_t p : strongest) {
        const int a = rootOf(pairs[p].a), b = rootOf(pairs[p].b);
        if (a == b) continue;
        group[std::max(a, b)] = std::min(a, b);
        tree.inTree[p] = true;
    }
    std::vector<std::size_t> members(count, 0);
    for (int k = 0; k < pictures; ++k) ++members[rootOf(k)];
    const auto largest =
        static_cast<int>(std::max_element(members.begin(), members.end()) - members.begin());
    // The root is the picture with the most matches: the middle of the whole, more or less.
    std::vector<std::size_t> weight(count, 0);
    for (const Pair& pair : pairs) {
        weight[pair.a] += pair.matches.size();
        weight[pair.b] += pair.matches.size();
    }
    int root = -1;
    for (int k = 0; k < pictures; ++k)
        if (rootOf(k) == largest && (root < 0 || weight[k] > weight[root])) root = k;
    tree.order.push_back(root);
    std::vector<bool> reached(count, false);
    reached[root] = true;
    for (std::size_t at = 0; at < tree.order.size(); ++at) {
        for (std::size_t p = 0; p < pairs.size(); ++p) {
            if (!tree.inTree[p]) continue;
            const int here = tree.order[at];
            if (pairs[p].a != here && pairs[p].b != here) continue;
            const int other = pairs[p].a == here ? pairs[p].b : pairs[p].a;
            if (reached[other]) continue;
            reached[other] = true;
            tree.parent[other] = here;
            tree.pair[other] = static_cast<int>(p);
            tree.order.push_back(other);
        }
    }
    return tree;
}

}  // namespace

PictureTree treeOf(int pictures, const std::vector<Pair>& pairs, bool closeLoop) {
    std::vector<Rank> ranks;
    for (const Pair& pair : pairs) ranks.push_back(rankOf(pair, pictures, closeLoop));
    PictureTree tree = treeByRank(pictures, pairs, ranks);
    tree.closeLoop = closeLoop;
    return tree;
}

TurnModel chain(const PictureTree& tree, const std::vector<Pair>& pairs, const TurnLens& lens) {
    return chainOf(tree, pairs, turnsOf(pairs, lens), lens);
}

double focalByClosing(const PictureTree& tree, const std::vector<Pair>& pairs, double focal) {
    constexpr int kSteps = 50;
    constexpr double kStep = 0.012;  // of the logarithm: from 0.55 to 1.8 times the focal length
    std::vector<double> costs(2 * kSteps + 1);
    parallelFor(-kSteps, kSteps + 1, [&](std::int64_t i) {
        const TurnLens lens{focal * std::exp(kStep * static_cast<double>(i)), 0};
        std::vector<glm::dquat> turns;
        for (const Pair& pair : pairs) turns.push_back(turnOf(pair.matches, lens, pair.bFromA));
        const TurnModel model = chainOf(tree, pairs, turns, lens);
        double cost = 0;
        for (std::size_t p = 0; p < pairs.size(); ++p) {
            const auto a = static_cast<std::size_t>(pairs[p].a);
            const auto b = static_cast<std::size_t>(pairs[p].b);
            if (tree.inTree[p] || !model.known[a]) continue;
            const double off = angleBetween(
                turns[p], glm::inverse(model.worldFromCamera[b]) * model.worldFromCamera[a]);
            cost +=
                std::min(off, kMostOff) * std::sqrt(static_cast<double>(pairs[p].matches.size()));
        }
        costs[i + kSteps] = cost;
    });
    const auto least = std::min_element(costs.begin(), costs.end());
    const double start = costs[kSteps];
    if (*least > kClearShare * start || start - *least < kClearGain) return focal;
    return focal * std::exp(kStep * static_cast<double>(least - costs.begin() - kSteps));
}

namespace {

/// What it costs that a picture is on its side (unlikelihood()): of one whose camera wrote down how
/// it was held, and of others. The former are so only where the camera has no sense of it and
/// always writes the same. It is more than what a turn up and down costs, from -20 to 80 degrees
/// 3.3 a picture, and less than what a full turn of portraits costs when it is taken for one over
/// the zenith, 4.1 and more.
constexpr double kOrientedSideways = 3.5, kSideways = 1;
/// Pictures that nobody says the orientation of are upright where that costs no more than this for
/// each: in folders and viewers they are.
constexpr double kOwnTops = 1;
/// The cosine of 45 degrees: directions farther apart are another answer to what is up.
constexpr double kOtherUp = 0.7;

/// How unlikely it is that a camera is held so, the negative logarithm of a probability but for a
/// constant. Cameras are held upright or on their side, level within a degree or so, and few look
/// steeply up or down (without that, a camera that only rolled would have its axis for up).
/// `sideways`: what being on its side costs.
double unlikelihood(const glm::dmat3& frame, glm::dvec3 up, double sideways) {
    // Usual angles, radians, by which a camera leans, and looks up or down.
    constexpr double kLean = M_PI / 180, kPitch = M_PI / 9;
    // What looking straight up or down costs, and a camera upside down.
    constexpr double kSteep = 5, kUpsideDown = 3;
    const double lean = std::abs(glm::dot(frame[0], up)), top = glm::dot(frame[1], up);
    // Tails as Cauchy's: some are held at any angle.
    const auto unlikely = [&](double sine) { return std::log(1 + sine * sine / (kLean * kLean)); };
    const double upright = unlikely(lean) + (top < 0 ? kUpsideDown : 0);
    const double pitch = std::asin(std::min(1.0, std::abs(glm::dot(frame[2], up)))) / kPitch;
    return std::min(upright, unlikely(top) + sideways) +
           kSteep * (1 - std::exp(-pitch * pitch / kSteep));
}

/// The direction to which one axis of all cameras is nearest to being across, 0 = X, 1 = Y; on the
/// side of the other one of these, as a camera's own top and side are.
glm::dvec3 acrossAll(const std::vector<glm::dmat3>& frames, int axis) {
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    glm::dvec3 others(0);
    for (const auto& frame : frames) {
        const Eigen::Vector3d v(frame[axis].x, frame[axis].y, frame[axis].z);
        squares += v * v.transpose();
        others += frame[1 - axis];
    }
    const Eigen::Vector3d least =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(squares).eigenvectors().col(0);
    const glm::dvec3 across(least.x(), least.y(), least.z());
    return glm::dot(across, others) < 0 ? -across : across;
}

/// unlikelihood() of all frames. `sideways`: of each.
double unlikelihoodOfAll(const std::vector<glm::dmat3>& frames, const std::vector<double>& sideways,
                         glm::dvec3 up) {
    double cost = 0;
    for (std::size_t k = 0; k < frames.size(); ++k)
        cost += unlikelihood(frames[k], up, sideways[k]);
    return cost;
}

/// The direction of the least unlikelihoodOfAll(), and that cost.
struct LeastCost {
    glm::dvec3 up{0, 1, 0};
    double cost = std::numeric_limits<double>::max();
};
LeastCost leastCost(const std::vector<glm::dmat3>& frames, const std::vector<double>& sideways) {
    // From each camera's own top and sides, and, since no camera's top is near to what is up where
    // all look steeply up or down, from across the sides of all, or the tops of those on their
    // side.
    constexpr std::size_t kMostStarts = 24;
    std::vector<glm::dvec3> starts;
    const std::size_t stride = (frames.size() + kMostStarts - 1) / kMostStarts;
    for (std::size_t k = 0; k < frames.size(); k += stride)
        for (const glm::dvec3 start : {frames[k][1], frames[k][0], -frames[k][0]})
            starts.push_back(start);
    for (const int axis : {0, 1}) {
        const glm::dvec3 across = acrossAll(frames, axis);
        starts.push_back(across);
        starts.push_back(-across);
    }
    LeastCost best;
    // Always downhill, in steps that shrink.
    for (const glm::dvec3 start : starts) {
        glm::dvec3 up = start;
        double cost = unlikelihoodOfAll(frames, sideways, up);
        for (double step = kFirstUpStep; step > kLastUpStep;) {
            const glm::dvec3 across = anyAcross(up);
            const glm::dvec3 along = glm::cross(up, across);
            bool better = false;
            for (const glm::dvec3 d : {across, -across, along, -along}) {
                const glm::dvec3 next = glm::normalize(up + step * d);
                const double now = unlikelihoodOfAll(frames, sideways, next);
                if (!(now < cost)) continue;
                cost = now;
                up = next;
                better = true;
                break;
            }
            if (!better) step *= 0.5;
        }
        if (cost < best.cost - kLessCost) best = {up, cost};
    }
    return best;
}

}  // namespace

UpOfTurn findUp(const TurnModel& model, const std::vector<bool>& oriented) {
    std::vector<glm::dmat3> frames;
    std::vector<double> sideways;
    double notOriented = 0;
    for (std::size_t k = 0; k < model.known.size(); ++k) {
        if (!model.known[k]) continue;
        const bool written = !oriented.empty() && oriented[k];
        frames.push_back(glm::mat3_cast(model.worldFromCamera[k]));
        sideways.push_back(written ? kOrientedSideways : kSideways);
        notOriented += written ? 0 : 1;
    }
    const LeastCost any = leastCost(frames, sideways);
    const std::vector<double> never(frames.size(), std::numeric_limits<double>::infinity());
    // All say how they were held, or none is on its side.
    if (notOriented == 0 || unlikelihoodOfAll(frames, never, any.up) <= any.cost)
        return {any.up, false};
    const LeastCost upright = leastCost(frames, never);
    const bool byOwnTops = glm::dot(any.up, upright.up) < kOtherUp &&
                           upright.cost - any.cost <= kOwnTops * notOriented;
    return {byOwnTops ? upright.up : any.up, byOwnTops};
}

std::vector<int> pairsThatClose(const PictureTree& tree, const std::vector<Pair>& pairs,
                                const TurnModel& model) {
    const glm::dvec3 up = upOf(model);
    const glm::dvec3 zero = anyAcross(up);
    const auto yaw = [&](int k) {
        return yawOf(aheadOf(model, static_cast<std::size_t>(k)), up, zero);
    };
    // The tree without pictures that look along what is up, and joined anew where they joined it.
    const std::vector<bool> around = thatLookAround(model, up);
    const auto pictures = static_cast<int>(tree.parent.size());
    std::vector<Rank> ranks;
    for (std::size_t p = 0; p < pairs.size(); ++p) {
        const bool both = around[pairs[p].a] && around[pairs[p].b];
        const Rank others =
            tree.inTree[p] ? Rank::first : rankOf(pairs[p], pictures, tree.closeLoop);
        ranks.push_back(both ? others : Rank::never);
    }
    const PictureTree way = treeByRank(pictures, pairs, ranks);
    // How far each picture is turned from the root, along the tree.
    std::vector<double> turned(tree.parent.size(), 0.0);
    for (const int k : way.order) {
        const auto i = static_cast<std::size_t>(k);
        if (way.parent[i] < 0) continue;
        turned[i] = turned[way.parent[i]] + wrapped(yaw(k) - yaw(way.parent[i]));
    }
    std::vector<int> closing;
    for (std::size_t p = 0; p < pairs.size(); ++p) {
        const auto a = static_cast<std::size_t>(pairs[p].a);
        const auto b = static_cast<std::size_t>(pairs[p].b);
        if (ranks[p] == Rank::never || way.inTree[p]) continue;
        // Where b is by this pair's own turn, seen from a.
        const glm::dquat byPair = model.worldFromCamera[a] * glm::inverse(pairs[p].bFromA);
        const double own =
            wrapped(yawOf(byPair * glm::dvec3(0, 0, -1), up, zero) - yaw(pairs[p].a));
        if (std::abs(turned[b] - turned[a] - own) > M_PI) closing.push_back(static_cast<int>(p));
    }
    return closing;
}

std::vector<std::pair<int, int>> dropPairsThatClose(const PictureTree& tree,
                                                    std::vector<Pair>& pairs,
                                                    const TurnModel& model) {
    std::vector<std::pair<int, int>> dropped;
    const auto closing = pairsThatClose(tree, pairs, model);
    for (auto p = closing.rbegin(); p != closing.rend(); ++p) {
        dropped.emplace_back(pairs[*p].a, pairs[*p].b);
        pairs.erase(pairs.begin() + *p);
    }
    return dropped;
}

glm::dquat levelTurn(const TurnModel& model, glm::dvec3 up, bool closed) {
    const glm::dvec3 zero = anyAcross(up);
    std::vector<double> yaws;
    const std::vector<bool> around = thatLookAround(model, up);
    for (std::size_t k = 0; k < around.size(); ++k)
        if (around[k]) yaws.push_back(yawOf(aheadOf(model, k), up, zero));
    double middle = yaws.front();
    if (!closed) {
        // Opposite to the middle of the widest gap.
        std::sort(yaws.begin(), yaws.end());
        double widest = -1;
        for (std::size_t i = 0; i < yaws.size(); ++i) {
            const double next = i + 1 < yaws.size() ? yaws[i + 1] : yaws[0] + 2 * M_PI;
            if (next - yaws[i] > widest) {
                widest = next - yaws[i];
                middle = yaws[i] + 0.5 * widest + M_PI;
            }
        }
    }
    const glm::dvec3 ahead = std::cos(middle) * zero + std::sin(middle) * glm::cross(up, zero);
    const glm::dvec3 back = -ahead, right = glm::cross(up, back);
    return glm::normalize(glm::quat_cast(glm::transpose(glm::dmat3(right, up, back))));
}

}  // namespace stx::panorama

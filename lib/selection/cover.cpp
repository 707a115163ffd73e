#include "lib/selection/cover.hpp"

#include <algorithm>
#include <functional>
#include <limits>
#include <numeric>
#include <queue>

#include "lib/base/parallel.hpp"

namespace stx {
namespace {

/// Item visits that exchanging views may cost.
constexpr double kExchangeWork = 4e8;

using Best = std::vector<float>;  ///< best quality so far, per sample

double gainOf(const CoverProblem& problem, int view, const Best& best) {
    double gain = 0;
    for (const auto& item : problem.views[view]) {
        const double more = static_cast<double>(item.quality) - best[item.sample];
        if (more > 0) gain += problem.weights[item.sample] * more;
    }
    return gain;
}

void take(const CoverProblem& problem, int view, Best& best) {
    for (const auto& item : problem.views[view])
        best[item.sample] = std::max(best[item.sample], item.quality);
}

std::vector<double> allGains(const CoverProblem& problem, const Best& best) {
    std::vector<double> gains(problem.views.size());
    parallelFor(0, gains.size(),
                [&](std::int64_t v) { gains[v] = gainOf(problem, static_cast<int>(v), best); });
    return gains;
}

double valueOf(const CoverProblem& problem, const Best& best) {
    double value = 0;
    for (std::size_t i = 0; i < best.size(); ++i) value += problem.weights[i] * best[i];
    return value;
}

double largestSum(std::vector<double> gains, std::size_t count) {
    count = std::min(count, gains.size());
    std::partial_sort(gains.begin(), gains.begin() + static_cast<std::ptrdiff_t>(count),
                      gains.end(), std::greater<>());
    return std::accumulate(gains.begin(), gains.begin() + static_cast<std::ptrdiff_t>(count), 0.0);
}

/// Lazy greedy over `candidates`; alone[v] is the value of each view by itself.
void greedy(const CoverProblem& problem, const std::vector<int>& candidates, std::size_t most,
            double enough, const std::vector<double>& alone, CoverSolution& solution) {
    struct QueuedView {
        double gain;
        int view;
        std::size_t round;
        bool operator<(const QueuedView& o) const {
            return gain != o.gain ? gain < o.gain : view > o.view;
        }
    };
    Best best(problem.weights.size(), 0.0f);
    std::priority_queue<QueuedView> queue;
    for (const int v : candidates) queue.push({alone[v], v, 0});
    double value = 0;
    while (!queue.empty() && solution.chosen.size() < most && value < enough) {
        QueuedView top = queue.top();
        queue.pop();
        const std::size_t round = solution.chosen.size() + 1;
        if (top.round != round) {
            top.gain = gainOf(problem, top.view, best);
            top.round = round;
            queue.push(top);
            continue;
        }
        if (!(top.gain > 0)) break;
        take(problem, top.view, best);
        value += top.gain;
        solution.chosen.push_back(top.view);
        solution.values.push_back(value);
    }
}

/// Exchanges single views while F grows. True when something changed.
bool exchange(const CoverProblem& problem, std::vector<int>& chosen) {
    double items = 0;
    for (const auto& v : problem.views) items += static_cast<double>(v.size());
    const double perPass = items * static_cast<double>(chosen.size());
    bool changed = false;
    for (double work = perPass; work < kExchangeWork; work += perPass) {
        bool better = false;
        for (int& slot : chosen) {
            Best without(problem.weights.size(), 0.0f);
            for (const int v : chosen) {
                if (v != slot) take(problem, v, without);
            }
            const auto gains = allGains(problem, without);
            const int candidate =
                static_cast<int>(std::max_element(gains.begin(), gains.end()) - gains.begin());
            if (gains[candidate] > gains[slot] * (1 + 1e-9)) {
                slot = candidate;
                better = changed = true;
            }
        }
        if (!better) break;
    }
    return changed;
}

/// The first views of a solution.
CoverSolution firstOf(CoverSolution solution, std::size_t count) {
    solution.chosen.resize(count);
    solution.values.resize(count);
    return solution;
}

/// As many views, with others in the places of some where that makes F larger.
CoverSolution exchanged(const CoverProblem& problem, const std::vector<double>& alone,
                        CoverSolution solution) {
    const std::size_t count = solution.chosen.size();
    std::vector<int> chosen = solution.chosen;
    if (count >= problem.views.size() || !exchange(problem, chosen)) return solution;
    CoverSolution better;
    better.all = solution.all;
    greedy(problem, chosen, count, std::numeric_limits<double>::infinity(), alone, better);
    return better.values.back() > solution.values.back() ? better : solution;
}

}  // namespace

CoverSolution chooseCover(const CoverProblem& problem, int most, double share) {
    CoverSolution greedily;
    const std::size_t limit = std::min<std::size_t>(std::max(most, 0), problem.views.size());
    Best everything(problem.weights.size(), 0.0f);
    for (std::size_t v = 0; v < problem.views.size(); ++v)
        take(problem, static_cast<int>(v), everything);
    greedily.all = valueOf(problem, everything);
    const std::vector<double> alone = allGains(problem, Best(problem.weights.size(), 0.0f));

    std::vector<int> candidates(problem.views.size());
    std::iota(candidates.begin(), candidates.end(), 0);
    // A sum in another order may miss a share of 1 by rounding.
    const double enough = greedily.all * std::min(share, 1.0 - 1e-12);
    greedy(problem, candidates, limit, enough, alone, greedily);
    CoverSolution solution = exchanged(problem, alone, greedily);
    // What exchanging gains is often worth a view. A share of 1 takes every view that is the best
    // of some sample, and none is tried without.
    while (share < 1 && solution.chosen.size() > 1 && solution.values.back() >= enough) {
        const std::size_t less = solution.chosen.size() - 1;
        CoverSolution fewer = firstOf(solution, less);
        if (fewer.values.back() < enough)
            fewer = exchanged(problem, alone, firstOf(greedily, less));
        if (fewer.values.back() < enough) break;
        solution = std::move(fewer);
    }
    const std::size_t count = solution.chosen.size();

    // F(prefix) + the largest `count` gains beyond it bounds every choice of `count` views.
    solution.bound = std::min(solution.all, largestSum(alone, count));
    Best best(problem.weights.size(), 0.0f);
    for (std::size_t i = 0; i < solution.chosen.size(); ++i) {
        take(problem, solution.chosen[i], best);
        const bool last = i + 1 == solution.chosen.size();
        if (!last && problem.views.size() * solution.chosen.size() > 20000) continue;
        solution.bound = std::min(
            solution.bound, valueOf(problem, best) + largestSum(allGains(problem, best), count));
    }
    if (!solution.values.empty()) solution.bound = std::max(solution.bound, solution.values.back());
    return solution;
}

}  // namespace stx

#include "lib/background/behind_patches.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "lib/background/patch_level.hpp"
#include "lib/base/parallel.hpp"

namespace stx::behind {
namespace {

/// Halving stops before the photograph's shorter side is below this: then a patch is a seventh of
/// it, and holes are a few patches wide.
constexpr int kSmallestSide = 100;
/// Votes of the coarsest level, of those between, and of the finest. The coarse ones settle what
/// goes on where; more at the finest change a hundredth of the sources.
constexpr int kCoarseVotes = 8, kVotes = 3, kFineVotes = 1;
/// Rounds of the search between two votes.
constexpr int kRounds = 3;
/// Steps to the neighbours whose source is tried, of each round.
constexpr int kHops[kRounds] = {1, 4, 2};

}  // namespace

Result<Sources> findSources(const Layer& layer, Job& job) {
    std::vector<PatchLevel> levels;
    levels.emplace_back(layer);
    while (std::min(layer.photo.x, layer.photo.y) >> levels.size() >= kSmallestSide)
        levels.push_back(levels.back().halfAsLarge());
    const std::size_t coarsest = levels.size() - 1;
    for (std::size_t i = coarsest + 1; i-- > 0;) {
        PatchLevel& level = levels[i];
        if (i == coarsest)
            level.beginNear();
        else
            level.takeFrom(levels[i + 1]);
        levels.erase(levels.begin() + static_cast<std::ptrdiff_t>(i) + 1, levels.end());
        const int votes = i == 0 ? kFineVotes : i == coarsest ? kCoarseVotes : kVotes;
        for (int vote = 0; vote <= votes; ++vote) {
            for (const int hop : kHops) {
                STX_CHECK(job.checkCancelled());
                levels[i].improve(hop);
            }
            if (vote < votes) levels[i].vote();
        }
    }
    return levels.front().takeSources();
}

}  // namespace stx::behind

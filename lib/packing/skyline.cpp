#include "lib/packing/skyline.hpp"

#include <algorithm>
#include <limits>

namespace stx {
namespace {

/// Candidates looked at for one gap; enough that only thousands of unlike rectangles notice.
constexpr int kMostFitting = 400;

}  // namespace

Skyline::Skyline(const std::vector<RectangleGroup>& groups) : groups_(groups) {}

int Skyline::fill(int width, int maxHeight, const std::vector<int>& order, GapRule rule,
                  bool mayTurn, int giveUpAbove, std::vector<int>& left,
                  std::vector<SkylinePlace>* places) {
    constexpr int kHigh = std::numeric_limits<int>::max();
    const int count = static_cast<int>(order.size());
    // next_[i] follows position i - 1 of the order; next_[0] is the first position with some left.
    next_.resize(count + 1);
    sizes_.resize(count);
    int head = count, narrowest = kHigh;
    for (int i = count - 1; i >= 0; --i) {
        next_[i + 1] = head;
        sizes_[i] = {groups_[order[i]].width, groups_[order[i]].height};
        if (left[order[i]] > 0) {
            head = i;
            const auto& g = groups_[order[i]];
            narrowest = std::min(narrowest, mayTurn ? std::min(g.width, g.height) : g.width);
        }
    }
    next_[0] = head;
    segments_.assign(1, {0, 0, width});
    int top = 0;
    while (next_[0] < count) {
        std::size_t low = 0;
        for (std::size_t s = 1; s < segments_.size(); ++s) {
            if (segments_[s].y < segments_[low].y) low = s;
        }
        const Segment gap = segments_[low];
        if (gap.y >= maxHeight) break;
        const int leftWall = low > 0 ? segments_[low - 1].y - gap.y : kHigh;
        const int rightWall = low + 1 < segments_.size() ? segments_[low + 1].y - gap.y : kHigh;
        int bestBefore = -1, bestWidth = 0, bestHeight = 0;
        bool bestTurned = false;
        long long bestScore = -1;
        if (gap.width >= narrowest) {
            int fitting = 0;
            for (int before = 0; next_[before] < count && fitting < kMostFitting;
                 before = next_[before] + 1) {
                const glm::ivec2 g = sizes_[next_[before]];
                for (int turn = 0; turn < (mayTurn && g.x != g.y ? 2 : 1); ++turn) {
                    const int w = turn ? g.y : g.x, h = turn ? g.x : g.y;
                    if (w > gap.width || h > maxHeight - gap.y) continue;
                    ++fitting;
                    long long score;
                    if (rule == GapRule::widest) {
                        score = static_cast<long long>(w) * 65536 + h;
                    } else {
                        const bool meets = h == leftWall || h == rightWall;
                        if (w == gap.width) {
                            score = meets ? 5 : 4;
                        } else {
                            const bool waste =
                                rule == GapRule::avoidWaste && gap.width - w < narrowest;
                            score = meets ? 3 : waste ? 1 : 2;
                        }
                    }
                    if (score > bestScore) {
                        bestScore = score;
                        bestBefore = before;
                        bestWidth = w;
                        bestHeight = h;
                        bestTurned = turn == 1;
                    }
                }
                if (rule != GapRule::widest && bestScore == 5) break;
            }
        }
        if (bestBefore < 0) {
            // Nothing fits: the gap is lost up to its lower wall.
            const int raise = std::min(leftWall, rightWall);
            if (raise == kHigh) break;
            segments_[low].y += raise;
        } else {
            const int position = next_[bestBefore], group = order[position];
            const bool atLeft = bestWidth == gap.width || (leftWall >= rightWall);
            const int x = atLeft ? gap.x : gap.x + gap.width - bestWidth;
            if (places) places->push_back({group, x, gap.y, bestTurned});
            top = std::max(top, gap.y + bestHeight);
            if (top > giveUpAbove) return top;
            if (--left[group] == 0) next_[bestBefore] = next_[position + 1];
            const Segment placed{x, gap.y + bestHeight, bestWidth};
            if (bestWidth == gap.width) {
                segments_[low] = placed;
            } else if (atLeft) {
                segments_[low] = {gap.x + bestWidth, gap.y, gap.width - bestWidth};
                segments_.insert(segments_.begin() + static_cast<std::ptrdiff_t>(low), placed);
            } else {
                segments_[low].width -= bestWidth;
                segments_.insert(segments_.begin() + static_cast<std::ptrdiff_t>(low) + 1, placed);
            }
        }
        // Join neighbours of one height.
        const std::size_t from = low > 0 ? low - 1 : 0;
        for (std::size_t s = from; s + 1 < segments_.size() && s <= low + 2;) {
            if (segments_[s].y == segments_[s + 1].y) {
                segments_[s].width += segments_[s + 1].width;
                segments_.erase(segments_.begin() + static_cast<std::ptrdiff_t>(s) + 1);
            } else {
                ++s;
            }
        }
    }
    return top;
}

}  // namespace stx

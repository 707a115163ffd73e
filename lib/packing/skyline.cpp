#include "lib/packing/skyline.hpp"

#include <algorithm>
#include <limits>

namespace stx {
namespace {

/// Candidates looked at for one gap; enough that only thousands of unlike rectangles notice.
constexpr int kMostFitting = 400;
constexpr int kHigh = std::numeric_limits<int>::max();

/// How well a rectangle of `width` x `height` fits; the best score of all rules but `widest` is
/// kBest.
constexpr long long kBest = 5;
long long scoreOf(int width, int height, int gapWidth, bool meets, GapRule rule, int narrowest) {
    if (rule == GapRule::widest) return static_cast<long long>(width) * 65536 + height;
    if (width == gapWidth) return meets ? kBest : 4;
    const bool waste = rule == GapRule::avoidWaste && gapWidth - width < narrowest;
    return meets ? 3 : waste ? 1 : 2;
}

}  // namespace

Skyline::Skyline(const std::vector<RectangleGroup>& groups) : groups_(groups) {}

Skyline::Gap Skyline::lowestGap() const {
    Gap gap;
    for (std::size_t s = 1; s < segments_.size(); ++s)
        if (segments_[s].y < segments_[gap.at].y) gap.at = s;
    gap.segment = segments_[gap.at];
    const bool last = gap.at + 1 == segments_.size();
    gap.leftWall = gap.at > 0 ? segments_[gap.at - 1].y - gap.segment.y : kHigh;
    gap.rightWall = last ? kHigh : segments_[gap.at + 1].y - gap.segment.y;
    return gap;
}

Skyline::Fit Skyline::fitFor(const Gap& gap, int maxHeight, GapRule rule, bool mayTurn,
                             int narrowest) const {
    Fit best;
    const int width = gap.segment.width, count = static_cast<int>(sizes_.size());
    if (width < narrowest) return best;
    long long bestScore = -1;
    int fitting = 0;
    for (int before = 0; next_[before] < count && fitting < kMostFitting;
         before = next_[before] + 1) {
        const glm::ivec2 g = sizes_[next_[before]];
        for (int turn = 0; turn < (mayTurn && g.x != g.y ? 2 : 1); ++turn) {
            const int w = turn ? g.y : g.x, h = turn ? g.x : g.y;
            if (w > width || h > maxHeight - gap.segment.y) continue;
            ++fitting;
            const bool meets = h == gap.leftWall || h == gap.rightWall;
            const long long score = scoreOf(w, h, width, meets, rule, narrowest);
            if (score <= bestScore) continue;
            bestScore = score;
            best = {before, w, h, turn == 1};
        }
        if (rule != GapRule::widest && bestScore == kBest) break;
    }
    return best;
}

void Skyline::cover(const Gap& gap, const Fit& fit, bool atLeft) {
    const Segment& s = gap.segment;
    const auto here = segments_.begin() + static_cast<std::ptrdiff_t>(gap.at);
    const int x = atLeft ? s.x : s.x + s.width - fit.width;
    const Segment placed{x, s.y + fit.height, fit.width};
    if (fit.width == s.width) {
        *here = placed;
    } else if (atLeft) {
        *here = {s.x + fit.width, s.y, s.width - fit.width};
        segments_.insert(here, placed);
    } else {
        here->width -= fit.width;
        segments_.insert(here + 1, placed);
    }
}

void Skyline::join(std::size_t at) {
    for (std::size_t s = at > 0 ? at - 1 : 0; s + 1 < segments_.size() && s <= at + 2;) {
        if (segments_[s].y == segments_[s + 1].y) {
            segments_[s].width += segments_[s + 1].width;
            segments_.erase(segments_.begin() + static_cast<std::ptrdiff_t>(s) + 1);
        } else {
            ++s;
        }
    }
}

int Skyline::fill(int width, int maxHeight, const std::vector<int>& order, GapRule rule,
                  bool mayTurn, int giveUpAbove, std::vector<int>& left,
                  std::vector<SkylinePlace>* places) {
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
        const Gap gap = lowestGap();
        if (gap.segment.y >= maxHeight) break;
        const Fit fit = fitFor(gap, maxHeight, rule, mayTurn, narrowest);
        if (fit.before < 0) {
            // Nothing fits: the gap is lost up to its lower wall.
            const int raise = std::min(gap.leftWall, gap.rightWall);
            if (raise == kHigh) break;
            segments_[gap.at].y += raise;
        } else {
            const int position = next_[fit.before], group = order[position];
            const bool atLeft = fit.width == gap.segment.width || gap.leftWall >= gap.rightWall;
            const int x = atLeft ? gap.segment.x : gap.segment.x + gap.segment.width - fit.width;
            if (places) places->push_back({group, x, gap.segment.y, fit.turned});
            top = std::max(top, gap.segment.y + fit.height);
            if (top > giveUpAbove) return top;
            if (--left[group] == 0) next_[fit.before] = next_[position + 1];
            cover(gap, fit, atLeft);
        }
        join(gap.at);
    }
    return top;
}

}  // namespace stx

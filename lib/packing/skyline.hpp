#pragma once

#include <vector>

#include <glm/glm.hpp>

namespace stx {

/// Rectangles of one size.
struct RectangleGroup {
    int width = 0, height = 0;
    std::vector<int> members;  ///< indices of the rectangles, ascending
};

/// One placed rectangle of a group.
struct SkylinePlace {
    int group = 0;
    int x = 0, y = 0;
    bool turned = false;
};

/// How a gap's rectangle is chosen.
enum class GapRule {
    firstFit,    ///< the first in the order, one that fills the gap's width or meets its walls
                 ///< earlier
    avoidWaste,  ///< as firstFit, but those that leave a strip too narrow for anything come last
    widest,      ///< the widest that fits, then the highest
};

/// Fills pages of a given width from the bottom of a skyline.
class Skyline {
  public:
    /// `groups` must outlive the skyline.
    explicit Skyline(const std::vector<RectangleGroup>& groups);

    /// Packs one page of `width` x at most `maxHeight`. `left[g]` = rectangles of group g still to
    /// place, reduced by those placed; `order` = all groups. Returns the height used; places are
    /// appended to `places` when it is given. Stops early, with more than `giveUpAbove`, as soon as
    /// the height is sure to exceed that.
    int fill(int width, int maxHeight, const std::vector<int>& order, GapRule rule, bool mayTurn,
             int giveUpAbove, std::vector<int>& left, std::vector<SkylinePlace>* places);

  private:
    struct Segment {
        int x, y, width;
    };
    /// The lowest segment, and how far its neighbours rise above it.
    struct Gap {
        std::size_t at = 0;  ///< in segments_
        Segment segment{};
        int leftWall = 0, rightWall = 0;
    };
    /// What goes into a gap.
    struct Fit {
        int before = -1;  ///< position in next_; -1 = nothing fits
        int width = 0, height = 0;
        bool turned = false;
    };
    [[nodiscard]] Gap lowestGap() const;
    /// `narrowest`: the width of the narrowest rectangle.
    [[nodiscard]] Fit fitFor(const Gap& gap, int maxHeight, GapRule rule, bool mayTurn,
                             int narrowest) const;
    void cover(const Gap& gap, const Fit& fit, bool atLeft);
    /// Joins neighbours of one height around a segment.
    void join(std::size_t at);

    const std::vector<RectangleGroup>& groups_;
    std::vector<Segment> segments_;
    std::vector<glm::ivec2> sizes_;  ///< of the groups, in the order
    std::vector<int> next_;          ///< linked list over the order of groups with something left
};

}  // namespace stx

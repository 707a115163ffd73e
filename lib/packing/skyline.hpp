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
    const std::vector<RectangleGroup>& groups_;
    std::vector<Segment> segments_;
    std::vector<glm::ivec2> sizes_;  ///< of the groups, in the order
    std::vector<int> next_;          ///< linked list over the order of groups with something left
};

}  // namespace stx

#pragma once

#include <utility>
#include <vector>

#include "lib/panorama/adjust.hpp"

namespace stx::panorama {

/// The pictures that belong together, joined by the pairs with the most matches (a maximum spanning
/// tree).
struct PictureTree {
    std::vector<int> order;   ///< the pictures in the tree, parents first
    std::vector<int> parent;  ///< of each picture; -1 = it is the root, or not in the tree
    std::vector<int> pair;  ///< of each picture, the index of the pair that joins it to its parent
    std::vector<bool> inTree;  ///< of each pair
    bool closeLoop = true;     ///< as treeOf() was asked
};

/// The tree of the largest part of the pictures that pairs connect. When the loop is not to be
/// closed, pairs of pictures that are more than half of all apart join what no others do, whatever
/// their matches: a loop is then open between the last picture and the first.
[[nodiscard]] PictureTree treeOf(int pictures, const std::vector<Pair>& pairs,
                                 bool closeLoop = true);

/// The rotations of all pictures in the tree: each from that of its parent and the turn between the
/// two, which their matches give with this lens.
[[nodiscard]] TurnModel chain(const PictureTree& tree, const std::vector<Pair>& pairs,
                              const TurnLens& lens);

/// The focal length (halves of the diagonal) with which the pairs outside of the tree agree best
/// with the rotations that the tree gives: it is clear where pictures go once all around. `focal`
/// where it is not clear.
[[nodiscard]] double focalByClosing(const PictureTree& tree, const std::vector<Pair>& pairs,
                                    double focal);

/// What is up, and what that follows from.
struct UpOfTurn {
    glm::dvec3 up{0, 1, 0};  ///< unit
    /// The pictures may as well be on their side, one beside the other, as upright, one above the
    /// other: upright is taken, since none says how it was held.
    bool byOwnTops = false;
};

/// What is up: the direction in which the pictures most likely have their upper edge or a side.
/// Each camera may be rolled. `oriented`: of each picture, whether its camera wrote down how it was
/// held, by which it is upright; empty = none did.
[[nodiscard]] UpOfTurn findUp(const TurnModel& model, const std::vector<bool>& oriented);
/// The same where no camera wrote that down.
[[nodiscard]] inline glm::dvec3 upOf(const TurnModel& model) {
    return findUp(model, {}).up;
}

/// The pairs that close a full turn: they are not in the tree, and the way through it from one of
/// their pictures to the other and back by the pair goes once all around. Indices of pairs.
/// Pictures that look along what is up do not count, nor ways over them, while others are there.
[[nodiscard]] std::vector<int> pairsThatClose(const PictureTree& tree,
                                              const std::vector<Pair>& pairs,
                                              const TurnModel& model);

/// Takes such pairs away, of a series that stays open. Gives their pictures.
std::vector<std::pair<int, int>> dropPairsThatClose(const PictureTree& tree,
                                                    std::vector<Pair>& pairs,
                                                    const TurnModel& model);

/// The rotation into a world with `up` as +Y and, along -Z, the middle of what is seen; of a closed
/// turn, which has no middle, what the first picture looks at. Pictures that look along `up` do not
/// count while others are there.
[[nodiscard]] glm::dquat levelTurn(const TurnModel& model, glm::dvec3 up, bool closed);

}  // namespace stx::panorama

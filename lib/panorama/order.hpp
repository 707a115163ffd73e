#pragma once

#include <vector>

#include "lib/panorama/adjust.hpp"

namespace stx::panorama {

/// How pictures belong together: a tree of the best pairs.
struct PictureTree {
    std::vector<int> order;    ///< pictures of the largest connected part, parents first
    std::vector<int> parent;   ///< of each picture; -1 = the root, or not in the part
    std::vector<int> pair;     ///< index of the pair that links it to its parent
    std::vector<bool> inTree;  ///< of each pair
};

/// The tree with the most matches of the largest connected part.
[[nodiscard]] PictureTree treeOf(int pictures, const std::vector<Pair>& pairs);

/// Rotations of the tree, one pair after the other; turns are those of the matches with this lens.
[[nodiscard]] TurnModel chain(const PictureTree& tree, const std::vector<Pair>& pairs,
                              const TurnLens& lens);

/// The focal length with which pairs that are not in the tree fit best to the chain of those that
/// are: a turn that closes tells it. `focal` when none can tell.
[[nodiscard]] double focalByClosing(const PictureTree& tree, const std::vector<Pair>& pairs,
                                    double focal);

/// Axis that the pictures turn around, more or less: what is up, whatever the roll of each camera.
[[nodiscard]] glm::dvec3 upOf(const TurnModel& model);

/// Pairs that are not in the tree and with its path between their pictures go once all around.
[[nodiscard]] std::vector<int> pairsThatClose(const PictureTree& tree,
                                              const std::vector<Pair>& pairs,
                                              const TurnModel& model);

/// The world with `up` as +Y and the middle of what is seen along -Z; of a closed turn the first
/// picture.
[[nodiscard]] glm::dquat levelTurn(const TurnModel& model, glm::dvec3 up, bool closed);

}  // namespace stx::panorama

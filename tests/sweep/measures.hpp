#pragma once

#include "tests/sweep/rules.hpp"

/// The measures behind rules(), by what they need. Each returns nothing where it cannot judge.
namespace measures {

using Outcome = stx::Result<std::optional<Measure>>;

// against_truth.cpp: one picture against the formulas, or two ways of drawing against each other.
Outcome openWhereSeen(Pictures& pictures);
Outcome openInWidePictures(Pictures& pictures);
Outcome openBesideWalls(Pictures& pictures);
Outcome drawnWhereEmpty(Pictures& pictures);
Outcome filledWhereEmpty(Pictures& pictures);
Outcome betterQualityCoversLess(Pictures& pictures);
Outcome betterQualityIsWorse(Pictures& pictures);
Outcome surfaceBelowSplats(Pictures& pictures);
/// The views of a case with noise, of a `share` of the distance that follows from the case.
[[nodiscard]] stx::Bundle noisyViews(const Pictures& pictures, double& share);
Outcome noisySurfaceBelowSplats(Pictures& pictures);
Outcome exactDepthIsRepaired(Pictures& pictures);
Outcome exactViewsDisagree(Pictures& pictures);

// same_scene.cpp: the same scene, asked in another way.
Outcome crop(Pictures& pictures);
Outcome otherOrder(Pictures& pictures);
Outcome viewTwice(Pictures& pictures);
Outcome viewOfNothing(Pictures& pictures);
Outcome viewOfFewPixels(Pictures& pictures);
Outcome turned(Pictures& pictures);
Outcome scaled(Pictures& pictures);
Outcome movedFar(Pictures& pictures);
Outcome mirrored(Pictures& pictures);
Outcome threads(Pictures& pictures);
Outcome gpu(Pictures& pictures);

// files.cpp: the same scene, through a file.
Outcome container(Pictures& pictures);
Outcome atlas(Pictures& pictures);
Outcome prunedAtlas(Pictures& pictures);
Outcome prunedOutline(Pictures& pictures);
Outcome clock(Pictures& pictures);

// unknown_depth.cpp: pixels that a sensor missed.
Outcome unknownDepth(Pictures& pictures);

// recorded.cpp: views as a depth camera records them.
Outcome recordedBelowWarp(Pictures& pictures);
Outcome aligningIsWorse(Pictures& pictures);
Outcome refiningIsWorse(Pictures& pictures);

// chosen_views.cpp: some of the views, the pixels of the others not there.
Outcome chosenViews(Pictures& pictures);

/// A number that follows from the case, to choose among variants: 0 <= number < below.
[[nodiscard]] int pick(const Pictures& pictures, int salt, int below);

}  // namespace measures

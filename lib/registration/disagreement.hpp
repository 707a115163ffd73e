#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "lib/model/bundle.hpp"

/// How far views that overlap disagree about the distance of what they both see: because their
/// cameras are not where their poses say, or because depth is off. A renderer then shows edges
/// twice, or blurs what it blends.
namespace stx {

/// What is looked at of a view. The depth has the camera's size: scene units, kNoDepth = no point.
struct DepthView {
    const ViewHeader* header = nullptr;
    const Image<float>* depth = nullptr;
};
[[nodiscard]] std::vector<DepthView> depthViewsOf(const Bundle& bundle);

struct OverlapSettings {
    /// Two points are taken for the same surface when their distances differ by less than this
    /// share. What differs by more is in front or behind, or disagrees: ViewDisagreement::beyond.
    double overlapTolerance = 0.1;
    /// Pairs with a smaller overlap, as a share of either image, are left out.
    double minOverlap = 0.05;
    /// Each view is compared with this many others at most, those it overlaps most with.
    int neighbours = 8;
};

/// A view beside those that it overlaps with.
struct ViewDisagreement {
    int partners = 0;       ///< views that it was compared with; of none, all below is 0
    double overlap = 0;     ///< share of an image that its partner sees, mean over the pairs
    double relative = 0;    ///< share of the distance: that of its median pair, of two the smaller
    double oneSurface = 0;  ///< what of that counts as one surface
    int farthest = -1;      ///< the partner it disagrees with most, by index; -1: it has none
    double farthestBy = 0;  ///< by how much
    /// Not 0: it disagrees by more than this share, too much to compare points. With most of the
    /// views that have surfaces where it has points, or the other way round, one of the two sees
    /// past most of what the other shows.
    double beyond = 0;

    [[nodiscard]] bool disagrees() const { return relative > oneSurface || beyond > 0; }
};

struct DepthDisagreement {
    int pairs = 0;       ///< that overlap
    double overlap = 0;  ///< share of an image that its partner sees, mean over the pairs
    /// Median over the pairs. Of a pair it is what a quarter of its points are not above, share of
    /// the distance: among leaves most points of two exact views are of two surfaces (the median of
    /// an exact oak tree is 0.3 %). A camera that moved along walls and floors, which are most of
    /// what it sees, is not found by it.
    double relative = 0;
    std::vector<ViewDisagreement> views;  ///< as in the bundle

    /// Some view does.
    [[nodiscard]] bool disagrees() const;
};

/// Measures, changes nothing. Only surfaces count that both views see from the same side. Views
/// without points overlap with none, and backgrounds, which are of other times, with each other
/// only. The same on any number of threads.
[[nodiscard]] DepthDisagreement measureDepthDisagreement(std::span<const DepthView> views,
                                                         const OverlapSettings& settings = {});
[[nodiscard]] DepthDisagreement measureDepthDisagreement(const Bundle& bundle,
                                                         const OverlapSettings& settings = {});

/// For people: which views disagree, the worst ones by name, by how much, and what helps. Nothing
/// when none does. `aligned`: the poses of the bundle were refined before.
[[nodiscard]] std::optional<std::string> disagreementNote(const Bundle& bundle,
                                                          const DepthDisagreement& found,
                                                          bool aligned);

}  // namespace stx

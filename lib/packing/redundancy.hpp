#pragma once

#include <cmath>
#include <vector>

#include "lib/packing/prune.hpp"
#include "lib/surface/depth_gradient.hpp"

namespace stx {

/// One view prepared for finding pixels of other views in it.
struct PruneView {
    const ReferenceView* view = nullptr;
    DepthSurface surface;
    double worldRadius = 0;  ///< of the sphere around its points
    glm::dvec3 worldCentre{0.0};
    glm::dmat3 worldFromCamera{1.0}, cameraFromWorld{1.0};
    std::vector<int> partners;   ///< views that may show the same surface, best rank first
    Image<std::uint8_t> kept;    ///< 1 = still here
    Image<std::uint8_t> locked;  ///< 1 = replaces something, must stay
    Image<float> error;          ///< squared colour difference to the replacement, of pruned pixels

    [[nodiscard]] bool point(int x, int y) const { return !std::isnan(surface.w.at(x, y)); }
};

/// Where a pixel's surface is found in another view.
struct Replacement {
    bool found = false;
    int x = 0, y = 0;  ///< the upper left of the four pixels around its place
    double error = 0;  ///< squared colour difference, mean over the channels, 0..1
};

/// Prepares all views: surfaces, bounds, partners in the order of `rank` (rank[i] = view).
[[nodiscard]] Result<std::vector<PruneView>> preparePruning(const Bundle& bundle,
                                                            const std::vector<int>& rank, Job& job);

/// Looks for pixel (x, y) of `from` in view `to`.
[[nodiscard]] Replacement findReplacement(const PruneView& from, int x, int y, const PruneView& to,
                                          const PruneSettings& settings);

}  // namespace stx

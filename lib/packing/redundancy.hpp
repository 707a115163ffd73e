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

/// Prepares all views: bounds, partners in the order of `rank` (rank[i] = view). `surfaces` are
/// depthSurface() of all views.
[[nodiscard]] Result<std::vector<PruneView>> preparePruning(const Bundle& bundle,
                                                            const std::vector<int>& rank,
                                                            std::vector<DepthSurface> surfaces,
                                                            Job& job);

/// A pixel that others might replace.
struct PrunePixel {
    PrunePixel(const PruneView& view, int x, int y);

    glm::dvec3 world{0.0};   ///< its point
    glm::dvec3 normal{0.0};  ///< of its surface, towards its view; world, unit
    double rate = 0;         ///< samples per area of its surface
    glm::vec3 colour{0.0f};
};

/// Looks for a pixel of `from` in view `to`. A sheet that both see from opposite sides is two
/// surfaces.
[[nodiscard]] Replacement findReplacement(const PruneView& from, const PrunePixel& pixel,
                                          const PruneView& to, const PruneSettings& settings);

}  // namespace stx

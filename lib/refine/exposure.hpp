#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "lib/base/image.hpp"
#include "lib/base/result.hpp"
#include "lib/geometry/camera.hpp"
#include "lib/model/reference_view.hpp"
#include "lib/model/texture.hpp"
#include "lib/refine/colour_match.hpp"
#include "lib/refine/refine.hpp"

/// Cameras that expose for themselves: colours of views are matched where they show the same.

namespace stx {

/// Where a part of a view is read: in images of its own, or in a rectangle of an atlas.
struct PixelPart {
    const Texture* texture = nullptr;  ///< null: nothing shows the whole part
    const Image<float>* depth = nullptr;
    /// Pixel (x, y) of the view is texel first + x * stepX + y * stepY.
    std::ptrdiff_t first = 0, stepX = 1, stepY = 0;

    [[nodiscard]] std::size_t texel(int x, int y) const {
        return static_cast<std::size_t>(first + x * stepX + y * stepY);
    }
};

/// What holds the pixels from (x0, y0) to (x1, y1), inclusive, of a view; they are in the view.
using PartOfView = std::function<PixelPart(std::size_t view, int x0, int y0, int x1, int y1)>;

/// For each view the map that brings its colours to those of the others; see matchColours(). None
/// changes anything where the views agree. The same on any number of threads.
[[nodiscard]] std::vector<ColourMap> exposureMaps(std::span<const Camera> cameras,
                                                  const PartOfView& partOf);

/// A point of a view at which colours are compared.
struct ColourPoint {
    glm::dvec3 world;
    glm::dvec3 normal;  ///< of the surface; of single pixels that show no more of one: towards
                        ///< their camera
    glm::vec3 colour;   ///< stored values, 0..1
};
/// Those of each view.
using ColourPoints = std::vector<std::vector<ColourPoint>>;
/// Those of a view inside of surfaces, some hundred: means of 3x3 pixels.
[[nodiscard]] std::vector<ColourPoint> colourPointsOf(const ReferenceView& view);

/// Calls its argument with the number of each view, from any thread; `PartOfView` is asked for that
/// view alone meanwhile. Gives false where it did not look at all of them, because the maps are not
/// needed any more.
using EachView = std::function<Result<bool>(const std::function<void(std::size_t view)>& body)>;
/// The same of views that are not all there at a time: `each` is called twice, where very many
/// views show the same three times; where views have few points inside of surfaces twice as often.
/// Once less where colourPointsOf() all views are `known`. Nothing where `each` gave false, after
/// which it is not called again. Errors: those of `each`.
[[nodiscard]] Result<std::optional<std::vector<ColourMap>>> exposureMaps(
    std::span<const Camera> cameras, const PartOfView& partOf, const EachView& each,
    const ColourPoints* known = nullptr);

/// Applies a map to the texels from (x0, y0) to (x1, y1), the last excluded, but for transparent
/// ones; the report gets the pixels that changed, and by how much (a share of white).
void applyMap(const ColourMap& map, int x0, int y0, int x1, int y1, Texture& texture,
              RefineStepReport& report);

}  // namespace stx

#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lib/base/job.hpp"
#include "lib/model/environment.hpp"
#include "lib/model/reference_view.hpp"

namespace stx {

/// An object (or several) as reference views: what a SimpleTexture file holds.
struct Bundle {
    std::string title;
    std::vector<ReferenceView> views;
    /// Added to coordinates here (cameras, bounds), gives the world's; see Mesh::origin.
    glm::dvec3 origin{0.0};
    /// World bounds of all points, when known (WorldInfo, an EXR attribute).
    std::optional<Bounds> bounds;
    /// What stands far behind the object in all directions (Background); null: nothing.
    std::shared_ptr<const Environment> environment;
    /// Of a moment of a sequence: seconds by the sequence's clock (Timeline), and how long it is
    /// shown.
    std::optional<double> time, duration;

    /// "SimpleTextureV2" when a view carries normals or splats, else "SimpleTexture".
    [[nodiscard]] const char* nodeKind() const;
    [[nodiscard]] std::int64_t pointCount() const;
    /// Some view was pruned.
    [[nodiscard]] bool pruned() const;
    /// Some view has metallic-roughness or emissive images.
    [[nodiscard]] bool hasMaterial() const;
    /// Notes, where there are some, that they are left out of what is written.
    void noteMaterialLeftOut(Job& job) const;
    /// The bounds of all points, computed from the pixels.
    [[nodiscard]] Bounds computeBounds() const;
    /// Each view's check(), with its index; at least one view; one colour space in all views; an
    /// origin that is finite.
    ///
    /// Who calls it: it looks at every pixel, so a pixel is checked once, by whoever brings it in.
    /// A reader returns only bundles that pass; openBundle() and saveBundle() rely on that. A
    /// writer calls checkHeaders() and refuses a wrong depth in the loop that codes or counts the
    /// depths anyway, so bundles that a caller makes are checked, too. Algorithms of lib call
    /// check().
    [[nodiscard]] Result<void> check() const;
    /// The same with each view's checkHeader(): no pixel is looked at.
    [[nodiscard]] Result<void> checkHeaders() const;
};

}  // namespace stx

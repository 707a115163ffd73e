#pragma once

#include <array>
#include <cstddef>

#include <glm/glm.hpp>

#include "lib/base/image.hpp"
#include "lib/geometry/pixel_space.hpp"
#include "lib/model/texture.hpp"

namespace stx {

/// A plane in the pixel space of a view: q and its change per pixel.
struct PixelPlane {
    float q = 0, gx = 0, gy = 0;
};

/// Samples around a pixel, a window of kASide x kASide that are kStep pixels apart.
struct PlaneSamples {
    static constexpr int kASide = 3, kStep = 3;
    static constexpr std::size_t kCount = kASide * kASide;
    /// For whole vectors; what is behind kCount is 0.
    using Floats = std::array<float, 16>;

    alignas(64) Floats dx{}, dy{};              ///< from the pixel, pixels
    alignas(64) Floats red{}, green{}, blue{};  ///< 0..1
    alignas(64) Floats weight{};                ///< 0: not a sample

    PlaneSamples();
};

/// A view that may show the same places.
struct OtherView {
    const Rgba8Image* colours;
    const Image<float>* q;  ///< 0 or less: no point
    Warp warp;              ///< from the pixels of the view that has the samples
};

/// Colours that differ by more, mean of the channels, differ altogether.
inline constexpr float kMostDifferent = 0.12f;
/// What a measured point in another view may be off by, a share of q, and be the same surface.
inline constexpr float kSamePlaceThere = 0.02f;

/// By how much `other` shows another colour than each sample has, if that is on `plane` (of the
/// pixel in the middle, whose place in the view is x, y): up to kMostDifferent, which it is where
/// something is measured behind that place, too. -1: the other view does not show the place.
void differencesOn(const PixelPlane& plane, float x, float y, const PlaneSamples& samples,
                   const OtherView& other, PlaneSamples::Floats& differences);

}  // namespace stx

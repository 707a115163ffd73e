#pragma once

#include <span>
#include <vector>

#include "lib/base/image.hpp"
#include "lib/geometry/pixel_space.hpp"
#include "lib/model/texture.hpp"

namespace stx {

/// A view whose edges are looked at.
struct EdgeView {
    const PixelSpace* space = nullptr;
    const Texture* texture = nullptr;  ///< of the view alone, as large as its depth
    Image<float>* q = nullptr;         ///< as in PreparedPage
    float step = 0.0f;                 ///< of its depth code, scene units
    float noise = 0.0f;                ///< depthNoise() before it was smoothed, of noisy views
};

/// Where a surface ends before another, the last pixels with its depth should have its colour, at
/// least for a half. How much of it single ones of a view have, 0..1, of at most about 600.
[[nodiscard]] std::vector<float> sharesAtEdges(const EdgeView& view);

/// Their median, of one view or of all; 1 when too few of them tell, or too few have the colour of
/// what is behind.
[[nodiscard]] float colourAtEdges(std::vector<float> shares);
[[nodiscard]] float colourAtEdges(std::span<const EdgeView> views);

/// Whether that says that surfaces reach over their edges.
[[nodiscard]] bool edgesAreFat(float colour);

/// Takes a pixel off the surfaces in front, where stereo and filters of depth let them grow over
/// what is behind, as long as edgesAreFat() and no other views deny it: of thin bars and fine
/// textures a view alone cannot tell. Pixels whose own colour is that of the
/// surface in front stay, and so do those whose colour does not tell, where other views mostly have
/// the colours of such pixels in front. A filter that gives each pixel the nearest depth around it
/// moves slopes towards the camera, too: where the views agree clearly better on their surfaces
/// with the farthest depth around each pixel, than as they are and than with the nearest, every
/// pixel gets it instead. Gives by how many pixels; 0 = nothing was changed. New q of each view are
/// in `spool`, if any. The same on any number of threads.
int thinFatEdges(std::span<const EdgeView> views, PixelSpool* spool = nullptr);

}  // namespace stx

#pragma once

#include <cstdint>

#include "lib/base/image.hpp"
#include "lib/model/reference_view.hpp"

/// Steps of behindPhoto(), on blocks of pixels. Parallax is how far a point moves in the picture
/// when the eye makes the largest step to the side: pixels, larger is nearer.
namespace stx::behind {

/// What a block is, of the picture that is larger than the photograph by its border.
enum class Part : std::uint8_t {
    shown,   ///< only the photograph is there
    mixed,   ///< beside what is uncovered: its depth is known, its colour may hold what is in front
    hidden,  ///< some of its pixels can be uncovered: depth and colour are invented
    around,  ///< outside of the photograph
};

/// The larger picture in blocks of step x step pixels, the first one at its upper left corner.
struct Layer {
    int step = 1;
    glm::ivec2 border{0};  ///< blocks at the left, and above
    glm::ivec2 photo{0};   ///< size of the photograph in blocks, those cut by its edge included
    Image<Part> part;
    /// Of the photograph, the nearest and the farthest pixel of each block; around it what is
    /// nearest of it goes on. Pixels without a depth have kNoParallax.
    Image<float> front, far;
    /// Of what is behind: of hidden and mixed blocks and of those around.
    Image<float> parallax;
    /// Means of the photograph's pixels; around it nothing.
    Image<glm::vec3> shown;
    /// The same without fine, and without any detail: means of what is around at one depth.
    Image<glm::vec3> smooth, base;
    /// Colour behind, of the blocks that `parallax` has.
    Image<glm::vec3> colour;

    [[nodiscard]] int width() const { return part.width(); }
    [[nodiscard]] int height() const { return part.height(); }
    [[nodiscard]] bool made(std::size_t block) const { return part.data()[block] != Part::shown; }
    [[nodiscard]] bool inPhoto(int x, int y) const {
        return x >= border.x && y >= border.y && x < border.x + photo.x && y < border.y + photo.y;
    }
};

/// Parallax of pixels that show nothing, or nobody knows how far away. It never limits anything but
/// what goes on around the frame: nothing does where nothing is (NoDepth::empty).
inline constexpr float kNoParallax = -1.0f;

/// Parallaxes that differ by no more, in pixels, are one surface for what links neighbours. Stairs
/// of depth in 8 bits are 1.4 pixels in photographs of phones.
inline constexpr float kOneSurface = 2.0f;
/// The same as a share of what is in front minus what is behind it: rims on both sides of a thing
/// are never quite at one distance, and a crack between them would show.
inline constexpr float kOneSurfaceOfJump = 0.25f;

/// A pixel can be uncovered where its parallax is larger by this, in pixels, than the least around
/// plus the way there.
inline constexpr float kUncovered = 0.5f;

/// How much the parallax of what is invented changes at most from one block to the next, share of
/// it. Surface mode takes what changes by more than 0.005 from pixel to pixel for an edge unless it
/// goes on so, from 0.03 on always, and leaves edges open.
[[nodiscard]] inline float steepestBehind(const Layer& layer) {
    return std::max(0.012f, 0.004f * static_cast<float>(layer.step));
}

/// How far parallaxes of neighbours may differ to be one surface, at this block.
[[nodiscard]] inline float surfaceTolerance(const Layer& layer, std::size_t block) {
    if (layer.part.data()[block] != Part::hidden) return kOneSurface;
    return std::max(kOneSurface,
                    kOneSurfaceOfJump * (layer.front.data()[block] - layer.parallax.data()[block]));
}

/// The blocks of a view, with all that the photograph says and the parts but `mixed`; nothing is
/// invented yet. `scale`: parallax times distance; `border`: pixels at the left and above,
/// multiples of `step`; `size`: of the larger picture, pixels.
[[nodiscard]] Layer blocksOf(const ReferenceView& view, double scale, int step, glm::ivec2 border,
                             glm::ivec2 size);

/// Makes shown blocks mixed that something nearer is within a few pixels of.
void markMixed(Layer& layer);

/// Gives hidden blocks a depth: that of the nearest block beside them that is behind them, made
/// smooth. Blocks that nothing behind reaches become `shown`; then mixed ones are marked. Colours
/// of these are then the only other thing that is missing.
void inventDepth(Layer& layer);

/// The parallax of what is invented without steps, around the frame, too: nothing is behind them,
/// so that they would open. Blocks of the photograph that are uncovered beside the frame become
/// hidden.
[[nodiscard]] Image<float> closeSteps(Layer& layer);

/// Gives hidden and mixed blocks and those around a colour: the smoothest one that goes on what is
/// beside them at their depth. Blocks that nothing at their depth reaches take the nearest farther
/// colour, and where all that shows what is behind is mixed, its own.
void inventColour(Layer& layer);

/// For each block where in the photograph what is like it is seen; -1: nowhere. Both count in
/// blocks of the larger picture.
using Sources = Image<glm::ivec2>;

/// Lets what is hidden go on under what is before it, as it is where that begins: by some pixels
/// everywhere, and as far as it is seen from the side (where what is seen first has a slope that
/// hides what is behind it, that is farther than `hidden` blocks reach). `layer.parallax` has no
/// steps.
void growUnder(Layer& layer, Sources& sources);

}  // namespace stx::behind

#pragma once

#include <glm/glm.hpp>

#include "lib/base/image.hpp"
#include "lib/metrics/compare.hpp"

namespace stx {

/// How steady a sequence is beside its truth: what a picture changes from frame to frame beyond the
/// truth's own change. An error that stays where it is costs nothing; one that comes and goes
/// (popping, flicker, boiling surfaces) does.
class Steadiness {
  public:
    /// The next frame, in order: a picture and its truth, which compare() took with these settings.
    /// Frames of another size than the one before start anew.
    void add(const Image<glm::u8vec4>& picture, const Image<glm::u8vec4>& truth,
             const CompareSettings& settings);
    void add(const Image<glm::vec4>& picture, const Image<glm::vec4>& truth,
             const CompareSettings& settings);

    /// Steps between frames so far; the figures below mean nothing before there is one.
    [[nodiscard]] int steps() const { return steps_; }
    /// Mean over the steps of |change of the picture - change of the truth|, averaged over R, G, B
    /// and the pixels that count, in the first picture's own values: 0..255 for 8 bits.
    [[nodiscard]] double mean() const { return steps_ > 0 ? sum_ / steps_ : 0.0; }
    /// The largest of them.
    [[nodiscard]] double worst() const { return worst_; }
    /// The frame that it leads to: 1 is the second one added.
    [[nodiscard]] int worstFrame() const { return worstFrame_; }

  private:
    template <class P>
    void addFrame(const Image<P>& picture, const Image<P>& truth, const CompareSettings& settings,
                  double white);

    Image<glm::vec3> error_;                 ///< of the frame before, in its values
    double white_ = 1.0, firstWhite_ = 1.0;  ///< of the frame before, of the first one
    int frames_ = 0, steps_ = 0, worstFrame_ = 0;
    double sum_ = 0, worst_ = 0;
};

}  // namespace stx

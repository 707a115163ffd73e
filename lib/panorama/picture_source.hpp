#pragma once

#include <string>

#include "lib/base/job.hpp"
#include "lib/model/texture.hpp"

namespace stx {

/// Delivers the pictures of a turning camera, one at a time, so that a long series of large ones
/// needs the memory of a few.
class PictureSource {
  public:
    virtual ~PictureSource() = default;
    [[nodiscard]] virtual int count() const = 0;
    /// Picture `k`, upright, 8-bit sRGB. Alpha is 255, or 0 where it shows nothing (shownOrNot()).
    /// As often as wanted, from several threads at a time. Errors are those of reading it.
    [[nodiscard]] virtual Result<Rgba8Image> picture(int k) = 0;
    /// What to call picture k in messages: the name of its file.
    [[nodiscard]] virtual std::string name(int k) const = 0;
    /// Its focal length in halves of the picture's diagonal, when the camera wrote one down; 0 =
    /// not known.
    [[nodiscard]] virtual double focalHint(int k) const = 0;
    /// Whether the camera wrote down how it was held, by which picture() is upright; false: a
    /// picture may be on its side.
    [[nodiscard]] virtual bool oriented(int /*k*/) const { return false; }
};

/// The picture with alpha 255 where it shows more than it hides, else 0 and the colours of what is
/// shown beside (bleedColour()), which filters may reach.
[[nodiscard]] Rgba8Image shownOrNot(Rgba8Image picture);

}  // namespace stx

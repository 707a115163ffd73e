#pragma once

#include <string>

#include "formats/files/files.hpp"
#include "lib/model/texture.hpp"

namespace stx::photos {

/// Makes sRGB of colours that an ICC profile of the kind of a display describes (three primaries
/// and their curves, as Display P3); what sRGB does not have is clipped. Gives a note of what was
/// done; empty where the colours are sRGB already or `profile` is empty.
[[nodiscard]] std::string toSrgb(Rgba8Image& picture, ByteSpan profile);
/// The same of codes from 0 to 1.
[[nodiscard]] std::string toSrgb(RgbaFloatImage& picture, ByteSpan profile);

}  // namespace stx::photos

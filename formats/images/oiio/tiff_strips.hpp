#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace stx::codecs {

/// What is wrong with the first strip or tile of a TIFF that does not hold what it should, though
/// libtiff decodes it: it lies past byte `end`, where the true file ends; Deflate whose checksum
/// differs, PackBits that unpacks to another size or has bytes left over. Empty: nothing. Damage of
/// uncompressed strips, and of LZW, fax and PackBits that unpacks to the right size, cannot be
/// seen: these have no checksum.
[[nodiscard]] std::string damageOfStrips(std::span<const std::byte> file, std::uint64_t end);

}  // namespace stx::codecs

#pragma once

#include <span>

#include "formats/images/codec_table.hpp"
#include "formats/images/picture_answer.hpp"

namespace stx::codecs {

/// Decodes a WebP as the file has it, since OpenImageIO multiplies colours by alpha, and no
/// division gives them back. False for films, whose first picture is OpenImageIO's matter. Throws
/// Failed.
[[nodiscard]] bool decodeWebp(std::span<const std::byte> file, PictureAnswer& answer);

/// Without loss; OpenImageIO's own writer loses something at every quality. Throws Failed.
void encodeWebp(const EncodeRequest& request);

}  // namespace stx::codecs

#pragma once

#include "formats/decoders/decoder_process.hpp"
#include "formats/images/images.hpp"

namespace stx {

/// Decodes pictures of all kinds that are not read here, in a process of their own
/// (formats/decoders). Errors as decodeImage(), and those of DecoderProcess::start().
[[nodiscard]] Result<DecodedImage> decodeForeign(ByteSpan bytes, std::string_view name,
                                                 const Limits& limits);

/// What a process says of a picture in a file of so many bytes, which it has been asked for.
[[nodiscard]] Result<DecodedImage> receivePicture(DecoderProcess& process, std::size_t fileBytes,
                                                  const Limits& limits);

}  // namespace stx

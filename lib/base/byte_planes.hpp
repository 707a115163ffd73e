#pragma once

#include <cstdint>
#include <span>

namespace stx {

/// Bytes in the order in which zip compression of OpenEXR stores them ("Predictor" and "reorder" of
/// its reference code): the even ones first, then the odd ones, each as the difference from the one
/// before, plus 128; the first as it is. `to` has room for as many. `raw` is not empty.
void splitAndSubtract(std::span<const std::uint8_t> raw, std::uint8_t* to);

/// The same for 16-bit words that come piece by piece: `low` gets as many differences of their low
/// bytes, `high` those of their high bytes; `before` is the word before the first one.
void splitAndSubtract(std::span<const std::uint16_t> words, std::uint16_t before, std::uint8_t* low,
                      std::uint8_t* high);

/// The inverse of the first: fills `raw` from as many bytes, and changes them.
void addAndJoin(std::uint8_t* split, std::span<std::uint8_t> raw);

}  // namespace stx

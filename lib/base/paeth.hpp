#pragma once

#include <cstddef>
#include <cstdint>

namespace stx {

/// Bytes of a row less what PNG's filter Paeth (ISO/IEC 15948, clause 9.4) expects of the bytes
/// `step` before, above and above those. `row` and `above` have `step` bytes before their first.
void subtractPaeth(const std::uint8_t* row, const std::uint8_t* above, std::size_t size,
                   std::size_t step, std::uint8_t* out);

}  // namespace stx

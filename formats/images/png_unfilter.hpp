#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

namespace stx {

/// What was taken off the bytes of a row of a PNG, by the number before them (ISO/IEC 15948,
/// clause 9.2).
enum PngFilter : std::uint8_t { kFilterNone, kFilterSub, kFilterUp, kFilterAverage, kFilterPaeth };
inline constexpr int kPngFilters = 5;

/// Bytes that may be read behind the last row, of any value.
inline constexpr std::size_t kUnfilterSlack = 2;

/// Undoes the filters of a PNG's rows in place (ISO/IEC 15948, clause 9.2). `rows`: `count` rows,
/// each the number of its filter and `size` bytes behind it, and kUnfilterSlack bytes. `step`: the
/// bytes of a pixel, 1, 2, 3, 4, 6 or 8; `size` is a multiple of it, above 0. Calls ready(from, to)
/// for ranges of rows that are done, in their order. False for another step or a filter that is not
/// defined; some rows are done then.
[[nodiscard]] bool unfilterPng(std::span<std::uint8_t> rows, std::size_t count, std::size_t size,
                               int step,
                               const std::function<void(std::size_t, std::size_t)>& ready);

}  // namespace stx

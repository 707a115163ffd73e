#pragma once

#include <charconv>
#include <optional>
#include <string_view>
#include <type_traits>

namespace stx {

/// The number that all of a text is, whatever the locale; nothing when there is anything else in
/// it, or when T cannot hold it. `base` is that of whole numbers. Without '+' and blanks.
template <class T>
[[nodiscard]] std::optional<T> wholeNumber(std::string_view text, int base = 10) {
    T value{};
    const char* const end = text.data() + text.size();
    std::from_chars_result read;
    if constexpr (std::is_integral_v<T>)
        read = std::from_chars(text.data(), end, value, base);
    else
        read = std::from_chars(text.data(), end, value);
    if (read.ec != std::errc() || read.ptr != end) return std::nullopt;
    return value;
}

}  // namespace stx

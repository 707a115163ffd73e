#pragma once

#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>
#include <vector>

namespace stx {

/// The finite numbers of a text, separated by spaces, whatever the locale; nothing when there is
/// anything else in it.
[[nodiscard]] inline std::optional<std::vector<double>> numbersFrom(std::string_view text) {
    std::vector<double> numbers;
    const char* at = text.data();
    const char* const end = at + text.size();
    for (;;) {
        while (at != end && (*at == ' ' || *at == '\t' || *at == '\n' || *at == '\r')) ++at;
        if (at == end) return numbers;
        double value = 0;
        const auto [next, error] = std::from_chars(at, end, value);
        if (error != std::errc() || !std::isfinite(value)) return std::nullopt;
        if (next != end && *next != ' ' && *next != '\t' && *next != '\n' && *next != '\r')
            return std::nullopt;
        numbers.push_back(value);
        at = next;
    }
}

}  // namespace stx

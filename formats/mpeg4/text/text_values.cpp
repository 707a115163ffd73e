#include "formats/mpeg4/text/text_values.hpp"

#include <charconv>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "formats/files/no_case.hpp"
#include "lib/base/whole_number.hpp"

namespace stx::mpeg4 {
namespace {

bool isHex(std::string_view text) {
    return text.size() > 2 && text[0] == '0' && (text[1] == 'x' || text[1] == 'X');
}

/// A leading '+' is legal in the text forms but not for from_chars.
bool stripPlus(std::string_view& text) {
    if (!text.empty() && text[0] == '+') {
        text.remove_prefix(1);
        if (!text.empty() && (text[0] == '+' || text[0] == '-')) return false;
    }
    return !text.empty();
}

template <class T>
std::optional<T> realFromText(std::string_view text) {
    if (!stripPlus(text)) return {};
    if (isHex(text)) {
        const auto hex = wholeNumber<std::uint64_t>(text.substr(2), 16);
        return hex ? std::optional<T>(static_cast<T>(*hex)) : std::nullopt;
    }
    // from_chars would take "nan(17)", whose bits no decimal gives back.
    if (text.find('(') != std::string_view::npos) return {};
    T value = 0;
    const char* const end = text.data() + text.size();
    auto [at, error] = std::from_chars(text.data(), end, value);
    if (error == std::errc()) return at == end ? std::optional<T>(value) : std::nullopt;
    if (error != std::errc::result_out_of_range || at != end) return {};
    // Too large or too small; a wider type shows which. Below even that range: by the exponent.
    long double wide = 0;
    const auto [wideAt, wideError] = std::from_chars(text.data(), end, wide);
    if (wideError == std::errc()) {
        if (std::fabs(wide) > 1) return {};
        return static_cast<T>(wide);
    }
    const auto exponent = text.find_first_of("eE");
    if (exponent != std::string_view::npos && exponent + 1 < text.size() &&
        text[exponent + 1] == '-')
        return T(0);
    return {};
}

}  // namespace

std::optional<float> floatFromText(std::string_view text) {
    return realFromText<float>(text);
}
std::optional<double> doubleFromText(std::string_view text) {
    return realFromText<double>(text);
}

std::optional<std::int64_t> integerFromText(std::string_view text) {
    if (!stripPlus(text)) return {};
    const bool negative = text[0] == '-';
    const std::string_view digits = negative ? text.substr(1) : text;
    if (isHex(digits)) {
        const auto hex = wholeNumber<std::uint64_t>(digits.substr(2), 16);
        if (!hex || *hex > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()))
            return {};
        const auto value = static_cast<std::int64_t>(*hex);
        return negative ? -value : value;
    }
    if (const auto value = wholeNumber<std::int64_t>(text)) return value;
    const auto real = doubleFromText(text);
    if (!real || std::nearbyint(*real) != *real || std::fabs(*real) > 9e15) return {};
    return static_cast<std::int64_t>(*real);
}

std::optional<std::int32_t> int32FromText(std::string_view text) {
    const auto value = integerFromText(text);
    if (!value || *value < std::numeric_limits<std::int32_t>::min() ||
        *value > std::numeric_limits<std::uint32_t>::max())
        return {};
    return static_cast<std::int32_t>(static_cast<std::uint32_t>(*value));
}

std::optional<bool> boolFromText(std::string_view text) {
    if (text == "1" || equalNoCase(text, "true")) return true;
    if (text == "0" || equalNoCase(text, "false")) return false;
    return {};
}

std::optional<int> odFromUrl(std::string_view url) {
    if (url.size() >= 3 && equalNoCase(url.substr(0, 3), "od:")) {
        url.remove_prefix(3);
        if (url.starts_with("//")) url.remove_prefix(2);
        if (url.size() > 2 && equalNoCase(url.substr(0, 2), "od")) url.remove_prefix(2);
    }
    const auto id = wholeNumber<int>(url);
    if (!id || *id < 1 || *id > 1023) return {};
    return id;
}

std::string quotedText(std::string_view text) {
    std::string result = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') result += '\\';
        result += c;
    }
    result += '"';
    return result;
}

std::string excerpt(std::string_view text) {
    std::string result(text.substr(0, 40));
    for (char& c : result)
        if (static_cast<unsigned char>(c) < 32 || c == 127) c = '?';
    if (text.size() > 40) result += "...";
    return result;
}

}  // namespace stx::mpeg4

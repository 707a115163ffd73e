#include "lib/model/view_summary.hpp"

#include <bit>
#include <cmath>
#include <type_traits>

namespace stx {
namespace {

/// Counts up whenever a value would be another for the same pixels: what a renderer that
/// does not agree with a summary draws is not what it draws from the pixels.
constexpr std::string_view kSummaryVersion = "1 ";

/// Calls visit(value) for all values in the order of the text.
template <class Summary, class Visit>
void forValues(Summary& s, const Visit& visit) {
    visit(s.points);
    visit(s.validShare);
    visit(s.border);
    visit(s.open);
    visit(s.faint);
    visit(s.translucent);
    for (int axis = 0; axis < 3; ++axis) {
        visit(s.bounds.min[axis]);
        visit(s.bounds.max[axis]);
    }
    for (auto& value : s.farthest) visit(value);
}

/// The bits of a value, which text() writes as digits of base 16.
template <class T>
auto bitsOfValue(T value) {
    if constexpr (std::is_same_v<T, double>) return std::bit_cast<std::uint64_t>(value);
    if constexpr (std::is_same_v<T, float>) return std::bit_cast<std::uint32_t>(value);
    if constexpr (std::is_same_v<T, std::int64_t>) return static_cast<std::uint64_t>(value);
    if constexpr (std::is_same_v<T, bool>) return static_cast<std::uint8_t>(value);
}

template <class T, class Bits>
T valueOfBits(Bits bits) {
    if constexpr (std::is_same_v<T, double> || std::is_same_v<T, float>)
        return std::bit_cast<T>(bits);
    else
        return static_cast<T>(bits);
}

int digitOf(char c) {
    return c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

bool makesSense(const ViewSummary& s) {
    const auto isShare = [](double v) { return v >= 0 && v <= 1; };
    if (s.points < 0 || !isShare(s.validShare) || !isShare(s.border)) return false;
    for (int axis = 0; axis < 3 && !s.bounds.empty(); ++axis)
        if (!std::isfinite(s.bounds.min[axis]) || !std::isfinite(s.bounds.max[axis])) return false;
    for (const float far : s.farthest)
        if (!(far >= 0)) return false;
    return true;
}

}  // namespace

std::string ViewSummary::text() const {
    std::string out(kSummaryVersion);
    forValues(*this, [&](const auto& value) {
        const auto bits = bitsOfValue(value);
        for (int shift = 8 * static_cast<int>(sizeof bits) - 4; shift >= 0; shift -= 4)
            out += "0123456789abcdef"[bits >> shift & 15];
    });
    return out;
}

std::optional<ViewSummary> ViewSummary::from(std::string_view text) {
    ViewSummary s;
    if (text.size() != s.text().size() || !text.starts_with(kSummaryVersion)) return std::nullopt;
    std::size_t at = kSummaryVersion.size();
    bool digits = true;
    forValues(s, [&](auto& value) {
        using Value = std::remove_cvref_t<decltype(value)>;
        decltype(bitsOfValue(value)) bits = 0;
        for (std::size_t k = 0; k < 2 * sizeof bits; ++k) {
            const int digit = digitOf(text[at++]);
            digits = digits && digit >= 0;
            bits = static_cast<decltype(bits)>(bits << 4 | static_cast<unsigned>(digit & 15));
        }
        if (std::is_same_v<Value, bool>) digits = digits && bits <= 1;
        value = valueOfBits<Value>(bits);
    });
    if (!digits || !makesSense(s)) return std::nullopt;
    return s;
}

}  // namespace stx

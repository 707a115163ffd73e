#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "lib/base/whole_number.hpp"
#include "lib/model/reference_view.hpp"

namespace stx {

namespace {

/// How far from 1 the length of a turn may be.
constexpr double kUnit = 1e-6;

/// Numbers with a space before each.
std::optional<std::vector<double>> numbersOf(std::string_view text) {
    std::vector<double> out;
    while (!text.empty()) {
        text.remove_prefix(1);
        const std::size_t end = std::min(text.find(' '), text.size());
        const auto number = wholeNumber<double>(text.substr(0, end));
        if (!number || !std::isfinite(*number)) return {};
        out.push_back(*number);
        text.remove_prefix(end);
    }
    return out;
}

}  // namespace

std::string Refined::text() const {
    std::string out = fmt::format("{} {}", steps, doubt);
    if (moved)
        out += fmt::format(" {} {} {} {} {} {} {}", moved->shift.x, moved->shift.y, moved->shift.z,
                           moved->turn.x, moved->turn.y, moved->turn.z, moved->turn.w);
    return out;
}

std::optional<Refined> Refined::from(std::string_view text) {
    const auto space = text.find(' ');
    const std::string_view steps = text.substr(0, space);
    if (space == std::string_view::npos || steps.empty() ||
        steps.find_first_not_of("abcdefghijklmnopqrstuvwxyz,") != std::string_view::npos)
        return std::nullopt;
    const std::size_t end = std::min(text.find(' ', space + 1), text.size());
    const auto doubt =
        wholeNumber<decltype(Refined::doubt)>(text.substr(space + 1, end - space - 1));
    if (!doubt || !(*doubt >= 0 && *doubt <= 1)) return std::nullopt;
    Refined out{std::string(steps), *doubt};
    const auto more = numbersOf(text.substr(end));
    if (!more || (!more->empty() && more->size() != 7)) return std::nullopt;
    if (!more->empty()) {
        const std::vector<double>& n = *more;
        const CameraMove move{{n[0], n[1], n[2]}, glm::dquat(n[6], n[3], n[4], n[5])};
        if (!(std::abs(glm::length(move.turn) - 1) <= kUnit)) return std::nullopt;
        out.moved = move;
    }
    return out;
}

}  // namespace stx

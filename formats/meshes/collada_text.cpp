#include "formats/meshes/collada_text.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <string_view>

#include <fmt/format.h>
#include <glm/glm.hpp>

#include "formats/meshes/text_encoding.hpp"

namespace stx {
namespace {

/// As many numbers as there are places, and nothing else.
template <std::size_t N>
std::optional<std::array<double, N>> numbersIn(std::string_view text) {
    std::array<double, N> numbers{};
    for (double& number : numbers) {
        text = trimmed(text);
        if (text.starts_with('+')) text.remove_prefix(1);
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
        if (error != std::errc()) return std::nullopt;
        text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    }
    if (!trimmed(text).empty()) return std::nullopt;
    return numbers;
}

/// Eye, target and up. What has it looks along -z from the eye.
std::optional<glm::dmat4> lookat(std::string_view values) {
    const auto v = numbersIn<9>(values);
    if (!v) return std::nullopt;
    const glm::dvec3 eye((*v)[0], (*v)[1], (*v)[2]), target((*v)[3], (*v)[4], (*v)[5]),
        up((*v)[6], (*v)[7], (*v)[8]);
    const glm::dvec3 back = eye - target, right = glm::cross(up, back);
    if (!(glm::length(right) > 0)) return std::nullopt;
    const glm::dvec3 z = glm::normalize(back), x = glm::normalize(right);
    return glm::dmat4(glm::dvec4(x, 0), glm::dvec4(glm::cross(z, x), 0), glm::dvec4(z, 0),
                      glm::dvec4(eye, 1));
}

/// An angle in degrees, the axis that turns by it, and the axis along which points move for that,
/// as RenderMan's Skew.
Result<std::optional<glm::dmat4>> skew(std::string_view values) {
    const auto v = numbersIn<7>(values);
    if (!v) return std::nullopt;
    const double angle = glm::radians((*v)[0]);
    const glm::dvec3 turned = glm::normalize(glm::dvec3((*v)[1], (*v)[2], (*v)[3]));
    const glm::dvec3 along = glm::normalize(glm::dvec3((*v)[4], (*v)[5], (*v)[6]));
    const double cosine = glm::dot(turned, along);
    const glm::dvec3 aside = turned - cosine * along;
    const double sine = glm::length(aside);
    const double left = sine * std::cos(angle) - cosine * std::sin(angle);
    // Both are sines of angles; a right angle is one within the rounding of floats, too.
    constexpr double kNone = std::numeric_limits<float>::epsilon();
    if (!(sine > kNone && left > kNone))
        return fail(ErrorCode::invalidInput,
                    "skew '{}' has no meaning: its first axis cannot turn by the angle towards the "
                    "second; expected two axes with an angle between them that is larger",
                    trimmed(values));
    const double shift = (sine * std::sin(angle) + cosine * std::cos(angle)) / left - cosine / sine;
    return glm::dmat4(glm::dmat3(1.0) + glm::outerProduct(along, aside / sine) * shift);
}

}  // namespace

Result<std::optional<std::string>> withMatrices(ByteSpan bytes) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    std::string out;
    std::size_t copied = 0;
    for (auto at = text.find('<'); at != std::string_view::npos; at = text.find('<', at + 1)) {
        const auto rest = text.substr(at);
        if (rest.starts_with("<!--")) {
            at = text.find("-->", at);
            if (at == std::string_view::npos) break;
            continue;
        }
        const auto values = [&](std::string_view start, std::string_view end) {
            const auto open = rest.find('>'), close = rest.find('<', 1);
            const bool whole = rest.starts_with(start) && open < close &&
                               close != std::string_view::npos &&
                               rest.substr(close).starts_with(end);
            return whole ? rest.substr(open + 1, close - open - 1) : std::string_view();
        };
        std::optional<glm::dmat4> parentFromHere = lookat(values("<lookat", "</lookat>"));
        const auto skewed = values("<skew", "</skew>");
        if (!skewed.empty()) STX_SET(parentFromHere, skew(skewed));
        if (!parentFromHere) continue;
        out += text.substr(copied, at - copied);
        out += "<matrix>";
        for (int row = 0; row < 4; ++row)
            for (int column = 0; column < 4; ++column)
                out += fmt::format("{} ", (*parentFromHere)[column][row]);
        out += "</matrix>";
        copied = text.find('>', text.find('<', at + 1)) + 1;
    }
    if (copied == 0) return std::nullopt;
    out += text.substr(copied);
    return out;
}

}  // namespace stx

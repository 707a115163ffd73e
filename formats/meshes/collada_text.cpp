#include "formats/meshes/collada_text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
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

/// Calls visit(at) for each element's start and end; comments are passed over. Errors: of visit.
template <class Visit>
Result<void> eachTag(std::string_view text, const Visit& visit) {
    for (auto at = text.find('<'); at != std::string_view::npos; at = text.find('<', at + 1)) {
        if (text.substr(at).starts_with("<!--")) {
            at = text.find("-->", at);
            if (at == std::string_view::npos) break;
        } else {
            STX_CHECK(visit(at));
        }
    }
    return {};
}

/// What is between the tags, where `text` begins with an element of this name and nothing else is
/// in it; else empty.
std::string_view contentOf(std::string_view text, std::string_view name) {
    const auto named = [&](std::string_view tag) {
        return tag.starts_with(name) && tag.find_first_of("> \t\r\n", name.size()) == name.size();
    };
    if (!named(text.substr(1))) return {};
    const auto close = text.find('<', 1);
    if (close == std::string_view::npos) return {};
    const auto open = text.substr(0, close).find('>');
    const auto end = text.substr(close);
    if (open == std::string_view::npos || !end.starts_with("</") || !named(end.substr(2)))
        return {};
    return text.substr(open + 1, close - open - 1);
}

/// The value of an attribute in the tag that `text` begins with; empty without one.
std::string_view attributeOf(std::string_view text, std::string_view name) {
    const auto tag = text.substr(0, text.find_first_of("<>", 1));
    const auto fromWord = [](std::string_view rest) {
        return rest.substr(std::min(rest.find_first_not_of(" \t\r\n"), rest.size()));
    };
    for (auto at = tag.find(name); at != std::string_view::npos; at = tag.find(name, at + 1)) {
        const auto value = fromWord(tag.substr(at + name.size()));
        if (trimmed(tag.substr(at - 1, 1)).empty() && value.starts_with('=')) {
            const auto quoted = fromWord(value.substr(1));
            if (quoted.empty()) return {};
            return quoted.substr(1, quoted.find(quoted[0], 1) - 1);
        }
    }
    return {};
}

std::uint32_t numberIn(std::string_view digits) {
    std::uint32_t number = 0;
    std::from_chars(digits.data(), digits.data() + digits.size(), number);
    return number;
}

/// What Maya says in a texture of a sampler's wrap_s ('U') or wrap_t ('V'), which Assimp reads.
std::string mayaWrap(std::string_view wrap, char axis) {
    if (trimmed(wrap) == "CLAMP") return fmt::format("<wrap{0}>0</wrap{0}>", axis);
    if (trimmed(wrap) == "MIRROR") return fmt::format("<mirror{0}>1</mirror{0}>", axis);
    return {};
}

}  // namespace

Result<PlainCollada> plainCollada(ByteSpan bytes) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    PlainCollada out;
    std::map<std::uint32_t, std::size_t> sets;        // and how many are before each
    std::map<std::string_view, std::uint32_t> setOf;  // of what bind_vertex_input names
    STX_CHECK(eachTag(text, [&](std::size_t at) -> Result<void> {
        const auto tag = text.substr(at);
        if (tag.starts_with("<input") && attributeOf(tag, "semantic") == "TEXCOORD")
            sets.emplace(numberIn(attributeOf(tag, "set")), 0);
        if (tag.starts_with("<bind_vertex_input")) {
            const auto set = numberIn(attributeOf(tag, "input_set"));
            const auto [bound, isNew] = setOf.emplace(attributeOf(tag, "semantic"), set);
            if (!isNew && bound->second != set && out.boundTwice.empty())
                out.boundTwice = bound->first;
        }
        for (const std::string_view name : {"wrap_s", "wrap_t"}) {
            const auto wrap = trimmed(contentOf(tag, name));
            const bool known =
                wrap.empty() || wrap == "WRAP" || wrap == "CLAMP" || wrap == "MIRROR";
            if (out.wrap.empty() && !known) out.wrap = wrap;
        }
        return {};
    }));
    std::size_t before = 0;
    for (auto& [set, number] : sets) number = before++;
    // Of an effect's parameters, by sid: along s and t.
    std::map<std::string_view, std::pair<std::string, std::string>> wraps;
    std::string_view parameter;
    std::size_t copied = 0;
    const auto replace = [&](std::size_t from, std::size_t to, std::string_view with) {
        out.text += text.substr(copied, from - copied);
        out.text += with;
        copied = to;
    };
    STX_CHECK(eachTag(text, [&](std::size_t at) -> Result<void> {
        const auto tag = text.substr(at);
        if (tag.starts_with("<effect")) wraps.clear();
        if (tag.starts_with("<newparam")) parameter = attributeOf(tag, "sid");
        if (auto wrap = mayaWrap(contentOf(tag, "wrap_s"), 'U'); !wrap.empty())
            wraps[parameter].first = std::move(wrap);
        if (auto wrap = mayaWrap(contentOf(tag, "wrap_t"), 'V'); !wrap.empty())
            wraps[parameter].second = std::move(wrap);
        if (tag.starts_with("<texture")) {
            if (const auto name = attributeOf(tag, "texcoord"); !name.empty()) {
                const auto bound = setOf.find(name);
                const auto set = bound == setOf.end() ? sets.end() : sets.find(bound->second);
                const auto number = set == sets.end() ? 0 : set->second;
                const auto from = static_cast<std::size_t>(name.data() - text.data());
                replace(from, from + name.size(), fmt::format("{}", number));
            }
            const auto wrap = wraps.find(attributeOf(tag, "texture"));
            const auto end = text.find_first_of("<>", at + 1);
            if (wrap == wraps.end() || end == std::string_view::npos || text[end] == '<') return {};
            const bool isEmpty = text[end - 1] == '/';
            replace(
                isEmpty ? end - 1 : end, end + 1,
                fmt::format("><extra><technique profile=\"MAYA\">{}{}</technique></extra>{}",
                            wrap->second.first, wrap->second.second, isEmpty ? "</texture>" : ""));
            return {};
        }
        std::optional<glm::dmat4> parentFromHere = lookat(contentOf(tag, "lookat"));
        const auto skewed = contentOf(tag, "skew");
        if (!skewed.empty()) STX_SET(parentFromHere, skew(skewed));
        if (!parentFromHere) return {};
        std::string matrix = "<matrix>";
        for (int row = 0; row < 4; ++row)
            for (int column = 0; column < 4; ++column)
                matrix += fmt::format("{} ", (*parentFromHere)[column][row]);
        replace(at, text.find('>', text.find('<', at + 1)) + 1, matrix + "</matrix>");
        return {};
    }));
    out.text += text.substr(copied);
    return out;
}

}  // namespace stx

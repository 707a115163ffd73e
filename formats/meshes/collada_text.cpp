#include "formats/meshes/collada_text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

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

/// The name of the element whose start or end, with '/', `text` begins with.
std::string_view nameOf(std::string_view text) {
    return text.substr(1, text.find_first_of("/<> \t\r\n", 2) - 1);
}

/// What is between the tags, where `text` begins with an element of this name and nothing else is
/// in it; else empty.
std::string_view contentOf(std::string_view text, std::string_view name) {
    if (nameOf(text) != name) return {};
    const auto close = text.find('<', 1);
    if (close == std::string_view::npos) return {};
    const auto open = text.substr(0, close).find('>');
    const auto end = text.substr(close);
    if (open == std::string_view::npos || !end.starts_with("</") || nameOf(end.substr(1)) != name)
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

/// The sets of texture coordinates that textures are drawn with. Textures say a name, instances of
/// geometry say which set it is there. Assimp ignores what they say: a texture has a number, and
/// a mesh the sets that it has, without gaps. Here the numbers count the names of an effect, but
/// for those that all instances bind alike, and the parts of a geometry get their sets in that
/// order.
class TextureSets {
  public:
    /// Takes in the tag at `at`; all of them in their order, then resolve().
    void read(std::string_view text, std::size_t at);
    void resolve();
    /// The number of what a texture of an effect names.
    [[nodiscard]] std::size_t numberOf(std::string_view effect, std::string_view name) const {
        const auto known = numbers_.find({effect, name});
        return known == numbers_.end() ? 0 : known->second;
    }
    /// The numbers that the coordinates of the `input` at `at` get as sets; none: as they are.
    [[nodiscard]] std::vector<std::size_t> setsOf(std::size_t at) const {
        const auto known = sets_.find(at);
        return known == sets_.end() ? std::vector<std::size_t>() : known->second;
    }
    /// What is bound to sets that differ, where one must do; empty: nothing.
    [[nodiscard]] std::string_view boundTwice() const { return boundTwice_; }

  private:
    static constexpr std::uint32_t kUnbound = UINT32_MAX;
    static constexpr std::size_t kMostNames = 8;  ///< as many sets as Assimp reads
    /// A material of a part of a geometry, and the sets by the names of textures.
    struct Instance {
        std::string_view geometry, symbol, material;
        std::map<std::string_view, std::uint32_t> sets;
    };
    struct Part {
        std::string_view geometry, symbol;
        std::vector<std::pair<std::uint32_t, std::size_t>> inputs;  ///< sets, and where they are
    };
    void bind(std::string_view text);
    void plan(const Part& part, const std::vector<std::uint32_t>& bound);

    std::string_view effect_, material_, controller_, geometry_, instance_;  ///< that is open
    bool inPart_ = false;
    std::map<std::string_view, std::vector<std::string_view>> names_;  ///< of an effect's textures
    std::map<std::string_view, std::string_view> effectOf_,
        skinned_;  ///< of materials, controllers
    std::vector<Part> parts_;
    std::vector<Instance> instances_;
    std::map<std::pair<std::string_view, std::string_view>, std::size_t> numbers_;
    std::map<std::size_t, std::vector<std::size_t>> sets_;  ///< by where inputs are
    std::string_view boundTwice_;
};

void TextureSets::read(std::string_view text, std::size_t at) {
    constexpr std::string_view kParts[] = {"triangles", "trifans", "tristrips", "polylist",
                                           "polygons",  "lines",   "linestrips"};
    const auto tag = text.substr(at);
    const auto name = nameOf(tag);
    const auto reference = [&](std::string_view attribute) {
        auto id = attributeOf(tag, attribute);
        if (id.starts_with('#')) id.remove_prefix(1);
        return id;
    };
    if (name == "effect") effect_ = attributeOf(tag, "id");
    if (name == "material") material_ = attributeOf(tag, "id");
    if (name == "controller") controller_ = attributeOf(tag, "id");
    if (name == "geometry") geometry_ = attributeOf(tag, "id");
    if (name == "texture") {
        auto& names = names_[effect_];
        const auto texcoord = attributeOf(tag, "texcoord");
        if (!texcoord.empty() && names.size() < kMostNames &&
            std::ranges::find(names, texcoord) == names.end())
            names.push_back(texcoord);
    }
    if (name == "instance_effect") effectOf_.emplace(material_, reference("url"));
    if (name == "skin" || name == "morph") skinned_.emplace(controller_, reference("source"));
    if (name == "instance_geometry" || name == "instance_controller") instance_ = reference("url");
    if (name == "instance_material")
        instances_.push_back({instance_, attributeOf(tag, "symbol"), reference("target"), {}});
    if (name == "bind_vertex_input" && !instances_.empty()) bind(tag);
    if (std::ranges::find(kParts, name) != std::end(kParts)) {
        parts_.push_back({geometry_, attributeOf(tag, "material"), {}});
        inPart_ = true;
    }
    if (name.starts_with('/') && std::ranges::find(kParts, name.substr(1)) != std::end(kParts))
        inPart_ = false;
    if (inPart_ && name == "input" && attributeOf(tag, "semantic") == "TEXCOORD")
        parts_.back().inputs.emplace_back(numberIn(attributeOf(tag, "set")), at);
}

void TextureSets::bind(std::string_view text) {
    const auto set = numberIn(attributeOf(text, "input_set"));
    const auto [bound, isNew] = instances_.back().sets.emplace(attributeOf(text, "semantic"), set);
    if (!isNew && bound->second != set && boundTwice_.empty()) boundTwice_ = bound->first;
}

void TextureSets::resolve() {
    std::map<std::string_view, std::vector<const Instance*>> instancesOf;
    for (Instance& instance : instances_) {
        // At most the skin of a morph of a geometry.
        for (int k = 0; k < 2; ++k)
            if (const auto under = skinned_.find(instance.geometry); under != skinned_.end())
                instance.geometry = under->second;
        if (const auto effect = effectOf_.find(instance.material); effect != effectOf_.end())
            instancesOf[effect->second].push_back(&instance);
    }
    std::map<std::pair<std::string_view, std::string_view>, std::vector<std::uint32_t>> bound;
    for (const auto& [effect, names] : names_) {
        const auto& instances = instancesOf[effect];
        const auto setIn = [](const Instance& instance, std::string_view name) {
            const auto set = instance.sets.find(name);
            return set == instance.sets.end() ? kUnbound : set->second;
        };
        std::map<std::vector<std::uint32_t>, std::size_t> numbers;
        std::vector<std::string_view> firsts;
        for (const auto name : names) {
            std::vector<std::uint32_t> sets;
            for (const auto* instance : instances) sets.push_back(setIn(*instance, name));
            const auto [number, isNew] = numbers.emplace(std::move(sets), numbers.size());
            if (isNew) firsts.push_back(name);
            numbers_[{effect, name}] = number->second;
        }
        for (const auto* instance : instances) {
            std::vector<std::uint32_t> sets;
            for (const auto name : firsts) sets.push_back(setIn(*instance, name));
            auto& known = bound[{instance->geometry, instance->symbol}];
            const auto [here, there] = std::ranges::mismatch(sets, known);
            if (here == sets.end()) continue;
            if (there == known.end())
                known = std::move(sets);
            else if (boundTwice_.empty())
                boundTwice_ = firsts[static_cast<std::size_t>(here - sets.begin())];
        }
    }
    for (const Part& part : parts_)
        if (const auto sets = bound.find({part.geometry, part.symbol}); sets != bound.end())
            plan(part, sets->second);
}

/// Sets that nothing binds, or that the part does not have, are its first.
void TextureSets::plan(const Part& part, const std::vector<std::uint32_t>& bound) {
    if (part.inputs.empty() || bound.empty()) return;
    const auto first = std::ranges::min(part.inputs);
    for (std::size_t number = 0; number < bound.size(); ++number) {
        const auto input = std::ranges::find(part.inputs, bound[number],
                                             &std::pair<std::uint32_t, std::size_t>::first);
        sets_[input == part.inputs.end() ? first.second : input->second].push_back(number);
    }
    // What no texture uses stays, since it has a place among the indices.
    std::size_t number = bound.size();
    for (const auto& [set, at] : part.inputs)
        if (auto& sets = sets_[at]; sets.empty()) sets.push_back(number++);
}

}  // namespace

Result<PlainCollada> plainCollada(ByteSpan bytes) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    PlainCollada out;
    TextureSets sets;
    STX_CHECK(eachTag(text, [&](std::size_t at) -> Result<void> {
        const auto tag = text.substr(at);
        sets.read(text, at);
        for (const std::string_view name : {"wrap_s", "wrap_t"}) {
            const auto wrap = trimmed(contentOf(tag, name));
            const bool known =
                wrap.empty() || wrap == "WRAP" || wrap == "CLAMP" || wrap == "MIRROR";
            if (out.wrap.empty() && !known) out.wrap = wrap;
        }
        return {};
    }));
    sets.resolve();
    out.boundTwice = sets.boundTwice();
    std::string_view effect;
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
        if (nameOf(tag) == "effect") {
            wraps.clear();
            effect = attributeOf(tag, "id");
        }
        if (tag.starts_with("<newparam")) parameter = attributeOf(tag, "sid");
        if (auto wrap = mayaWrap(contentOf(tag, "wrap_s"), 'U'); !wrap.empty())
            wraps[parameter].first = std::move(wrap);
        if (auto wrap = mayaWrap(contentOf(tag, "wrap_t"), 'V'); !wrap.empty())
            wraps[parameter].second = std::move(wrap);
        if (tag.starts_with("<texture")) {
            if (const auto name = attributeOf(tag, "texcoord"); !name.empty()) {
                const auto from = static_cast<std::size_t>(name.data() - text.data());
                replace(from, from + name.size(), fmt::format("{}", sets.numberOf(effect, name)));
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
        if (const auto numbers = sets.setsOf(at); !numbers.empty()) {
            // Copies, then the tag itself with its own attributes.
            const auto source = attributeOf(tag, "source"), offset = attributeOf(tag, "offset");
            std::string before;
            for (std::size_t k = 1; k < numbers.size(); ++k)
                before += fmt::format(
                    "<input semantic=\"TEXCOORD\" source=\"{}\" offset=\"{}\" set=\"{}\"/>", source,
                    offset, numbers[k]);
            replace(at, at, before);
            if (const auto set = attributeOf(tag, "set"); !set.empty()) {
                const auto from = static_cast<std::size_t>(set.data() - text.data());
                replace(from, from + set.size(), fmt::format("{}", numbers[0]));
            } else {
                const auto end = at + std::string_view("<input").size();
                replace(end, end, fmt::format(" set=\"{}\"", numbers[0]));
            }
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

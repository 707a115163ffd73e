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

#include "formats/files/text_encoding.hpp"
#include "formats/meshes/collada_joints.hpp"
#include "formats/meshes/collada_tags.hpp"

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
    const auto name = collada::nameOf(tag);
    const auto reference = [&](std::string_view attribute) {
        auto id = collada::attributeOf(tag, attribute);
        if (id.starts_with('#')) id.remove_prefix(1);
        return id;
    };
    if (name == "effect") effect_ = collada::attributeOf(tag, "id");
    if (name == "material") material_ = collada::attributeOf(tag, "id");
    if (name == "controller") controller_ = collada::attributeOf(tag, "id");
    if (name == "geometry") geometry_ = collada::attributeOf(tag, "id");
    if (name == "texture") {
        auto& names = names_[effect_];
        const auto texcoord = collada::attributeOf(tag, "texcoord");
        if (!texcoord.empty() && names.size() < kMostNames &&
            std::ranges::find(names, texcoord) == names.end())
            names.push_back(texcoord);
    }
    if (name == "instance_effect") effectOf_.emplace(material_, reference("url"));
    if (name == "skin" || name == "morph") skinned_.emplace(controller_, reference("source"));
    if (name == "instance_geometry" || name == "instance_controller") instance_ = reference("url");
    if (name == "instance_material")
        instances_.push_back(
            {instance_, collada::attributeOf(tag, "symbol"), reference("target"), {}});
    if (name == "bind_vertex_input" && !instances_.empty()) bind(tag);
    if (std::ranges::find(kParts, name) != std::end(kParts)) {
        parts_.push_back({geometry_, collada::attributeOf(tag, "material"), {}});
        inPart_ = true;
    }
    if (name.starts_with('/') && std::ranges::find(kParts, name.substr(1)) != std::end(kParts))
        inPart_ = false;
    if (inPart_ && name == "input" && collada::attributeOf(tag, "semantic") == "TEXCOORD")
        parts_.back().inputs.emplace_back(numberIn(collada::attributeOf(tag, "set")), at);
}

void TextureSets::bind(std::string_view text) {
    const auto set = numberIn(collada::attributeOf(text, "input_set"));
    const auto [bound, isNew] =
        instances_.back().sets.emplace(collada::attributeOf(text, "semantic"), set);
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

/// The same without the prefix that the root's name has; nothing where it has none.
std::optional<std::string> withoutPrefix(std::string_view text) {
    if (text.find(":COLLADA") == std::string_view::npos) return std::nullopt;
    std::string prefix;
    std::string out;
    std::size_t copied = 0;
    (void)collada::eachTag(text, [&](std::size_t at) -> Result<void> {
        const auto name = collada::nameOf(text.substr(at));
        if (prefix.empty() && name.ends_with(":COLLADA"))
            prefix = name.substr(0, name.find(':') + 1);
        const std::size_t slash = name.starts_with('/') ? 1 : 0;
        if (prefix.empty() || !name.substr(slash).starts_with(prefix)) return {};
        const auto from = at + 1 + slash;
        out += text.substr(copied, from - copied);
        copied = from + prefix.size();
        return {};
    });
    out += text.substr(copied);
    return out;
}

/// The colours of an effect: what parameters are, and what is missing.
class EffectColours {
  public:
    /// What is to be put in place of `text` from its start to `end`, or nothing, for each tag.
    std::optional<std::string> read(std::string_view text, std::size_t at, std::size_t& end) {
        constexpr std::string_view kShaders[] = {"constant", "lambert", "phong", "blinn"};
        const auto tag = text.substr(at);
        const auto name = collada::nameOf(tag);
        if (name == "effect") parameters_.clear();
        if (name == "newparam") parameter_ = collada::attributeOf(tag, "sid");
        for (const auto& [type, form] : {std::pair{"float4", "<color>{}</color>"},
                                         {"float3", "<color>{} 1</color>"},
                                         {"float", "<float>{}</float>"}})
            if (const auto value = collada::contentOf(tag, type); !value.empty() && !inShader_)
                parameters_[parameter_] = fmt::format(fmt::runtime(form), value);
        end = at;
        if (std::ranges::find(kShaders, name) != std::end(kShaders)) {
            diffuse_ = emits_ = false;
            inShader_ = true;
            const auto close = collada::endOfTag(text, at);
            if (!text.substr(0, close).ends_with("/>")) return std::nullopt;
            inShader_ = false;
            end = close;
            return fmt::format("<{0}>{1}</{0}>", name, missing(name).value_or(""));
        }
        if (!inShader_) return std::nullopt;
        if (name.starts_with('/') &&
            std::ranges::find(kShaders, name.substr(1)) != std::end(kShaders)) {
            inShader_ = false;
            return missing(name.substr(1));
        }
        if (name == "diffuse" || name == "emission" || name == "ambient" || name == "specular" ||
            name == "reflective" || name == "transparent")
            property_ = name;
        std::optional<std::string> instead;
        if (name == "param") {
            const auto known = parameters_.find(collada::attributeOf(tag, "ref"));
            if (known == parameters_.end()) return std::nullopt;
            instead = known->second;
            end = collada::endOfElement(text, at);
        } else if (name != "color" && name != "texture") {
            return std::nullopt;
        }
        diffuse_ = diffuse_ || property_ == "diffuse";
        emits_ = emits_ || property_ == "emission";
        return instead;
    }

  private:
    [[nodiscard]] std::optional<std::string> missing(std::string_view shader) const {
        if (diffuse_) return std::nullopt;
        const float value = shader == "constant" && emits_ ? 0.0f : kNoColour;
        return fmt::format("<diffuse><color>{0} {0} {0} 1</color></diffuse>", value);
    }

    std::map<std::string_view, std::string> parameters_;  ///< elements of their values, by sid
    std::string_view parameter_, property_;               ///< that is open
    bool inShader_ = false, diffuse_ = false, emits_ = false;
};

/// Controllers that are morphs, and the geometries that they morph, by id.
class Morphs {
  public:
    void read(std::string_view text, std::size_t at) {
        const auto tag = text.substr(at);
        if (collada::nameOf(tag) == "controller") controller_ = collada::attributeOf(tag, "id");
        if (collada::nameOf(tag) == "morph") {
            auto source = collada::attributeOf(tag, "source");
            if (source.starts_with('#')) source.remove_prefix(1);
            bases_.emplace(controller_, source);
        }
    }
    [[nodiscard]] std::optional<std::string_view> baseOf(std::string_view id) const {
        if (id.starts_with('#')) id.remove_prefix(1);
        const auto known = bases_.find(id);
        if (known == bases_.end()) return std::nullopt;
        return known->second;
    }
    [[nodiscard]] std::size_t count() const { return bases_.size(); }

  private:
    std::string_view controller_;
    std::map<std::string_view, std::string_view> bases_;
};

}  // namespace

Result<PlainCollada> plainCollada(ByteSpan bytes) {
    const auto plain = withoutPrefix(textOf(bytes));
    const std::string_view text = plain ? std::string_view(*plain) : textOf(bytes);
    PlainCollada out;
    EffectColours colours;
    Morphs morphs;
    ColladaJoints joints;
    TextureSets sets;
    STX_CHECK(collada::eachTag(text, [&](std::size_t at) -> Result<void> {
        const auto tag = text.substr(at);
        sets.read(text, at);
        morphs.read(text, at);
        joints.read(text, at);
        for (const std::string_view name : {"wrap_s", "wrap_t"}) {
            const auto wrap = trimmed(collada::contentOf(tag, name));
            const bool known =
                wrap.empty() || wrap == "WRAP" || wrap == "CLAMP" || wrap == "MIRROR";
            if (out.wrap.empty() && !known) out.wrap = wrap;
        }
        return {};
    }));
    sets.resolve();
    joints.resolve();
    out.morphs = morphs.count();
    out.twoSkeletons = joints.twoSkeletons();
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
    bool inMorph = false, hasHoles = false;
    // What is an instance, or a skin, of a morph becomes that of its base.
    const auto replaceMorph = [&](std::size_t at) {
        const auto tag = text.substr(at);
        const auto name = collada::nameOf(tag);
        if (name == "controller" && morphs.baseOf(collada::attributeOf(tag, "id")))
            return replace(at, collada::endOfElement(text, at), "");
        if (name == "/instance_controller" && std::exchange(inMorph, false))
            return replace(at, at + 1 + name.size(), "</instance_geometry");
        if (name != "instance_controller" && name != "skin") return;
        const auto reference = collada::attributeOf(tag, name == "skin" ? "source" : "url");
        const auto base = morphs.baseOf(reference);
        if (!base) return;
        if (name != "skin") {
            replace(at, at + 1 + name.size(), "<instance_geometry");
            inMorph = !text.substr(0, collada::endOfTag(text, at)).ends_with("/>");
        }
        const auto from = static_cast<std::size_t>(reference.data() - text.data());
        replace(from, from + reference.size(), fmt::format("#{}", *base));
    };
    STX_CHECK(collada::eachTag(text, [&](std::size_t at) -> Result<void> {
        if (at < copied) return {};
        const auto tag = text.substr(at);
        const auto element = collada::nameOf(tag);
        std::size_t readTo = at;
        if (const auto colour = colours.read(text, at, readTo)) replace(at, readTo, *colour);
        replaceMorph(at);
        if (const auto joint = joints.replacedAt(text, at))
            replace(joint->from, joint->to, joint->with);
        if (element == "ph" || element == "/ph") {
            hasHoles = element == "ph";
            replace(at, collada::endOfTag(text, at), "");
            return {};
        }
        if (hasHoles && element == "h") {
            ++out.holes;
            replace(at, collada::endOfElement(text, at), "");
            return {};
        }
        if (element == "effect") {
            wraps.clear();
            effect = collada::attributeOf(tag, "id");
        }
        if (tag.starts_with("<newparam")) parameter = collada::attributeOf(tag, "sid");
        if (auto wrap = mayaWrap(collada::contentOf(tag, "wrap_s"), 'U'); !wrap.empty())
            wraps[parameter].first = std::move(wrap);
        if (auto wrap = mayaWrap(collada::contentOf(tag, "wrap_t"), 'V'); !wrap.empty())
            wraps[parameter].second = std::move(wrap);
        if (tag.starts_with("<texture")) {
            if (const auto name = collada::attributeOf(tag, "texcoord"); !name.empty()) {
                const auto from = static_cast<std::size_t>(name.data() - text.data());
                replace(from, from + name.size(), fmt::format("{}", sets.numberOf(effect, name)));
            }
            const auto wrap = wraps.find(collada::attributeOf(tag, "texture"));
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
            const auto source = collada::attributeOf(tag, "source"),
                       offset = collada::attributeOf(tag, "offset");
            std::string before;
            for (std::size_t k = 1; k < numbers.size(); ++k)
                before += fmt::format(
                    "<input semantic=\"TEXCOORD\" source=\"{}\" offset=\"{}\" set=\"{}\"/>", source,
                    offset, numbers[k]);
            replace(at, at, before);
            if (const auto set = collada::attributeOf(tag, "set"); !set.empty()) {
                const auto from = static_cast<std::size_t>(set.data() - text.data());
                replace(from, from + set.size(), fmt::format("{}", numbers[0]));
            } else {
                const auto end = at + std::string_view("<input").size();
                replace(end, end, fmt::format(" set=\"{}\"", numbers[0]));
            }
            return {};
        }
        std::optional<glm::dmat4> parentFromHere = lookat(collada::contentOf(tag, "lookat"));
        const auto skewed = collada::contentOf(tag, "skew");
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

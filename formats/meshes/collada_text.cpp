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
#include "formats/meshes/collada_texture_sets.hpp"

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

/// What Maya says in a texture of a sampler's wrap_s ('U') or wrap_t ('V'), which Assimp reads.
std::string mayaWrap(std::string_view wrap, char axis) {
    if (trimmed(wrap) == "CLAMP") return fmt::format("<wrap{0}>0</wrap{0}>", axis);
    if (trimmed(wrap) == "MIRROR") return fmt::format("<mirror{0}>1</mirror{0}>", axis);
    return {};
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

/// Writes the text again, tag by tag.
class Rewriter {
  public:
    explicit Rewriter(std::string_view text) : text_(text) {}
    /// What tags must know of others that come behind them.
    Result<void> read();
    Result<PlainCollada> write();

  private:
    Result<void> writeTag(std::size_t at);
    void writeMorph(std::size_t at);
    /// False: the tag is about no hole.
    bool writeHole(std::size_t at);
    void readWraps(std::size_t at);
    void writeTexture(std::size_t at);
    void writeInput(std::size_t at, const std::vector<std::size_t>& numbers);
    Result<void> writeTransform(std::size_t at);
    void replace(std::size_t from, std::size_t to, std::string_view with) {
        out_.text += text_.substr(copied_, from - copied_);
        out_.text += with;
        copied_ = to;
    }
    /// `part` is one of the text.
    void replace(std::string_view part, std::string_view with) {
        const auto from = static_cast<std::size_t>(part.data() - text_.data());
        replace(from, from + part.size(), with);
    }

    std::string_view text_;
    PlainCollada out_;
    std::size_t copied_ = 0;  ///< of the text
    EffectColours colours_;
    Morphs morphs_;
    ColladaJoints joints_;
    ColladaTextureSets sets_;
    bool inMorph_ = false, hasHoles_ = false;  ///< of what is open
    std::string_view effect_, parameter_;      ///< that is open
    /// Of an effect's parameters, by sid: along s and t.
    std::map<std::string_view, std::pair<std::string, std::string>> wraps_;
};

Result<void> Rewriter::read() {
    STX_CHECK(collada::eachTag(text_, [&](std::size_t at) -> Result<void> {
        sets_.read(text_, at);
        morphs_.read(text_, at);
        joints_.read(text_, at);
        for (const std::string_view name : {"wrap_s", "wrap_t"}) {
            const auto wrap = trimmed(collada::contentOf(text_.substr(at), name));
            const bool known =
                wrap.empty() || wrap == "WRAP" || wrap == "CLAMP" || wrap == "MIRROR";
            if (out_.wrap.empty() && !known) out_.wrap = wrap;
        }
        return {};
    }));
    sets_.resolve();
    joints_.resolve();
    out_.morphs = morphs_.count();
    out_.twoSkeletons = joints_.twoSkeletons();
    out_.boundTwice = sets_.boundTwice();
    return {};
}

Result<PlainCollada> Rewriter::write() {
    STX_CHECK(collada::eachTag(
        text_, [&](std::size_t at) { return at < copied_ ? Result<void>() : writeTag(at); }));
    out_.text += text_.substr(copied_);
    return std::move(out_);
}

Result<void> Rewriter::writeTag(std::size_t at) {
    std::size_t readTo = at;
    if (const auto colour = colours_.read(text_, at, readTo)) replace(at, readTo, *colour);
    writeMorph(at);
    if (const auto joint = joints_.replacedAt(text_, at))
        replace(joint->from, joint->to, joint->with);
    if (writeHole(at)) return {};
    readWraps(at);
    if (text_.substr(at).starts_with("<texture")) {
        writeTexture(at);
    } else if (const auto numbers = sets_.setsOf(at); !numbers.empty()) {
        writeInput(at, numbers);
    } else {
        return writeTransform(at);
    }
    return {};
}

/// What is an instance, or a skin, of a morph becomes that of its base.
void Rewriter::writeMorph(std::size_t at) {
    const auto tag = text_.substr(at);
    const auto name = collada::nameOf(tag);
    if (name == "controller" && morphs_.baseOf(collada::attributeOf(tag, "id")))
        return replace(at, collada::endOfElement(text_, at), "");
    if (name == "/instance_controller" && std::exchange(inMorph_, false))
        return replace(at, at + 1 + name.size(), "</instance_geometry");
    if (name != "instance_controller" && name != "skin") return;
    const auto reference = collada::attributeOf(tag, name == "skin" ? "source" : "url");
    const auto base = morphs_.baseOf(reference);
    if (!base) return;
    if (name != "skin") {
        replace(at, at + 1 + name.size(), "<instance_geometry");
        inMorph_ = !text_.substr(0, collada::endOfTag(text_, at)).ends_with("/>");
    }
    replace(reference, fmt::format("#{}", *base));
}

bool Rewriter::writeHole(std::size_t at) {
    const auto element = collada::nameOf(text_.substr(at));
    if (element == "ph" || element == "/ph") {
        hasHoles_ = element == "ph";
        replace(at, collada::endOfTag(text_, at), "");
        return true;
    }
    if (!hasHoles_ || element != "h") return false;
    ++out_.holes;
    replace(at, collada::endOfElement(text_, at), "");
    return true;
}

void Rewriter::readWraps(std::size_t at) {
    const auto tag = text_.substr(at);
    if (collada::nameOf(tag) == "effect") {
        wraps_.clear();
        effect_ = collada::attributeOf(tag, "id");
    }
    if (tag.starts_with("<newparam")) parameter_ = collada::attributeOf(tag, "sid");
    if (auto wrap = mayaWrap(collada::contentOf(tag, "wrap_s"), 'U'); !wrap.empty())
        wraps_[parameter_].first = std::move(wrap);
    if (auto wrap = mayaWrap(collada::contentOf(tag, "wrap_t"), 'V'); !wrap.empty())
        wraps_[parameter_].second = std::move(wrap);
}

void Rewriter::writeTexture(std::size_t at) {
    const auto tag = text_.substr(at);
    if (const auto name = collada::attributeOf(tag, "texcoord"); !name.empty())
        replace(name, fmt::format("{}", sets_.numberOf(effect_, name)));
    const auto wrap = wraps_.find(collada::attributeOf(tag, "texture"));
    const auto end = text_.find_first_of("<>", at + 1);
    if (wrap == wraps_.end() || end == std::string_view::npos || text_[end] == '<') return;
    const bool isEmpty = text_[end - 1] == '/';
    replace(isEmpty ? end - 1 : end, end + 1,
            fmt::format("><extra><technique profile=\"MAYA\">{}{}</technique></extra>{}",
                        wrap->second.first, wrap->second.second, isEmpty ? "</texture>" : ""));
}

/// Copies of an `input`, then the tag itself with its own attributes.
void Rewriter::writeInput(std::size_t at, const std::vector<std::size_t>& numbers) {
    const auto tag = text_.substr(at);
    const auto source = collada::attributeOf(tag, "source"),
               offset = collada::attributeOf(tag, "offset");
    std::string before;
    for (std::size_t k = 1; k < numbers.size(); ++k)
        before +=
            fmt::format("<input semantic=\"TEXCOORD\" source=\"{}\" offset=\"{}\" set=\"{}\"/>",
                        source, offset, numbers[k]);
    replace(at, at, before);
    if (const auto set = collada::attributeOf(tag, "set"); !set.empty())
        return replace(set, fmt::format("{}", numbers[0]));
    const auto end = at + std::string_view("<input").size();
    replace(end, end, fmt::format(" set=\"{}\"", numbers[0]));
}

Result<void> Rewriter::writeTransform(std::size_t at) {
    const auto tag = text_.substr(at);
    std::optional<glm::dmat4> parentFromHere = lookat(collada::contentOf(tag, "lookat"));
    const auto skewed = collada::contentOf(tag, "skew");
    if (!skewed.empty()) STX_SET(parentFromHere, skew(skewed));
    if (!parentFromHere) return {};
    std::string matrix = "<matrix>";
    for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column)
            matrix += fmt::format("{} ", (*parentFromHere)[column][row]);
    replace(at, text_.find('>', text_.find('<', at + 1)) + 1, matrix + "</matrix>");
    return {};
}

}  // namespace

Result<PlainCollada> plainCollada(ByteSpan bytes) {
    const auto plain = withoutPrefix(textOf(bytes));
    Rewriter rewriter(plain ? std::string_view(*plain) : textOf(bytes));
    STX_CHECK(rewriter.read());
    return rewriter.write();
}

}  // namespace stx

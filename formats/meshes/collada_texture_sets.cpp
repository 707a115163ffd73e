#include "formats/meshes/collada_texture_sets.hpp"

#include <algorithm>
#include <charconv>

#include "formats/meshes/collada_tags.hpp"

namespace stx {
namespace {

std::uint32_t numberIn(std::string_view digits) {
    std::uint32_t number = 0;
    std::from_chars(digits.data(), digits.data() + digits.size(), number);
    return number;
}

}  // namespace

void ColladaTextureSets::read(std::string_view text, std::size_t at) {
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

void ColladaTextureSets::bind(std::string_view text) {
    const auto set = numberIn(collada::attributeOf(text, "input_set"));
    const auto [bound, isNew] =
        instances_.back().sets.emplace(collada::attributeOf(text, "semantic"), set);
    if (!isNew && bound->second != set && boundTwice_.empty()) boundTwice_ = bound->first;
}

void ColladaTextureSets::resolve() {
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
void ColladaTextureSets::plan(const Part& part, const std::vector<std::uint32_t>& bound) {
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

}  // namespace stx

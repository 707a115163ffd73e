#include "formats/meshes/mtl_notes.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "formats/files/no_case.hpp"
#include "formats/files/text_encoding.hpp"
#include "lib/base/whole_number.hpp"

namespace stx {
namespace {

std::string_view takeLine(std::string_view& text) {
    const auto end = text.find('\n');
    const auto line = trimmed(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    return line;
}

/// A finite number that is all of a word.
std::optional<float> numberOf(std::string_view word) {
    if (word.starts_with('+')) word.remove_prefix(1);
    const auto value = wholeNumber<float>(word);
    return value && std::isfinite(*value) ? value : std::nullopt;
}

/// Takes numbers off a text until one is not; never its last word, which is the name of a file.
std::vector<float> takeNumbers(std::string_view& text, std::size_t most) {
    std::vector<float> numbers;
    while (numbers.size() < most) {
        auto rest = text;
        const auto number = numberOf(takeWord(rest));
        if (!number || rest.empty()) break;
        numbers.push_back(*number);
        text = rest;
    }
    return numbers;
}

/// The numbers that follow a keyword.
std::vector<float> numbersOf(std::string_view values) {
    std::vector<float> numbers;
    while (const auto number = numberOf(takeWord(values))) numbers.push_back(*number);
    return numbers;
}

/// Keywords, which some programs write in lower case, as Assimp and Wavefront's specification have
/// them.
constexpr std::string_view kKeys[] = {
    "newmtl",       "Kd",   "Ke",       "d",    "Tr",     "map_Kd", "map_d",    "map_Ke",
    "map_emissive", "bump", "map_bump", "norm", "map_Kn", "disp",   "map_disp", "decal"};

std::string_view keyOf(std::string_view word) {
    const auto* const found =
        std::ranges::find_if(kKeys, [&](std::string_view key) { return equalNoCase(key, word); });
    return found == std::end(kKeys) ? std::string_view{} : *found;
}

/// What is behind the keyword of a map, before the file: notes what the material has to know, and
/// gives the options that are for Assimp.
std::string takeOptions(std::string_view key, std::string_view& value, MtlMaterial& material) {
    std::string kept;
    const bool colour = key == "map_Kd";
    while (value.starts_with('-')) {
        const auto option = takeWord(value);
        if (colour && (option == "-t" || option == "-mm" || option == "-boost"))
            material.dropped.push_back(fmt::format("option {} of {}", option, key));
        if (option == "-o" || option == "-s" || option == "-t") {
            // v and w may be left out.
            const auto numbers = takeNumbers(value, 3);
            if (!colour || option == "-t") continue;
            auto& to = option == "-s" ? material.uvScale : material.uvOffset;
            for (std::size_t k = 0; k < std::min<std::size_t>(numbers.size(), 2); ++k)
                to[static_cast<int>(k)] = numbers[k];
        } else if (option == "-mm") {
            (void)takeNumbers(value, 2);
        } else {
            const auto word = takeWord(value);
            if (option == "-clamp") kept = fmt::format("-clamp {} ", word);
            if (option == "-imfchan" && key == "map_d" && !word.empty())
                material.alphaChannel = word.front();
        }
    }
    return kept;
}

/// A line with one of kKeys as Assimp shall have it; nothing when it is not understood.
std::optional<std::string> plainLine(std::string_view key, std::string_view value,
                                     MtlMaterial& material) {
    if (key == "Kd" || key == "Ke") {
        const auto rgb = numbersOf(value);
        if (rgb.size() != 1 && rgb.size() < 3) return std::nullopt;
        (key == "Kd" ? material.hasDiffuse : material.hasEmission) = true;
        // One value of a colour is all three.
        const bool one = rgb.size() == 1;
        return fmt::format("{} {} {} {}\n", key, rgb[0], rgb[one ? 0 : 1], rgb[one ? 0 : 2]);
    }
    if (key == "d" || key == "Tr") {
        constexpr std::string_view kHalo = "-halo";
        const bool halo = key == "d" && value.starts_with(kHalo);
        if (halo) value.remove_prefix(kHalo.size());
        const auto numbers = numbersOf(value);
        if (numbers.empty()) return std::nullopt;
        if (halo) material.dropped.push_back(fmt::format("option {} of d", kHalo));
        (key == "d" ? material.hasDissolve : material.hasTransparency) = true;
        return fmt::format("{} {}\n", key, numbers[0]);
    }
    if (key == "decal") {
        material.dropped.emplace_back(key);
        return "";
    }
    const auto options = takeOptions(key, value, material);
    if (value.empty()) return std::nullopt;
    if (key == "map_Kd" || key == "map_d") {
        auto file = value;
        if (file.size() > 1 && file.starts_with('"') && file.ends_with('"'))
            file = file.substr(1, file.size() - 2);
        (key == "map_Kd" ? material.diffuseMap : material.alphaMap) = file;
    }
    return fmt::format("{} {}{}\n", key, options, value);
}

}  // namespace

PlainMtl plainMtl(std::string_view text, const std::string& folder,
                  std::map<std::string, MtlMaterial>& materials) {
    PlainMtl out;
    MtlMaterial* current = nullptr;
    for (int number = 1; !text.empty(); ++number) {
        const auto line = takeLine(text);
        auto value = line;
        const auto key = keyOf(takeWord(value));
        if (key == "newmtl") {
            current = &materials[std::string(value)];
            current->folder = folder;
            out.text += fmt::format("newmtl {}\n", value);
        } else if (current && !key.empty()) {
            if (const auto plain = plainLine(key, value, *current))
                out.text += *plain;
            else
                out.unread.push_back(fmt::format("line {}: '{}', expected '{} {}'", number,
                                                 line.substr(0, 60), key,
                                                 key == "Kd" || key == "Ke"  ? "R G B"
                                                 : key == "d" || key == "Tr" ? "NUMBER"
                                                                             : "FILE"));
        }
    }
    return out;
}

std::vector<std::string> materialFilesIn(std::string_view line) {
    std::vector<std::string> names;
    const auto isEnd = [&](std::size_t at) {
        constexpr std::string_view kEnding = ".mtl";
        return at >= kEnding.size() && isBlank(line[at]) &&
               equalNoCase(line.substr(at - kEnding.size(), kEnding.size()), kEnding);
    };
    std::size_t from = 0;
    for (std::size_t at = 0; at <= line.size(); ++at) {
        if (at < line.size() && !isEnd(at)) continue;
        if (const auto name = trimmed(line.substr(from, at - from)); !name.empty())
            names.emplace_back(name);
        from = at;
    }
    return names;
}

}  // namespace stx

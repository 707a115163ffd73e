#include "formats/meshes/mtl_notes.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include "formats/meshes/text_encoding.hpp"

namespace stx {
namespace {

/// `-s u v w`: one to three numbers behind an option; v stays as it is when only u is given.
void readVector(std::string_view text, std::string_view option, glm::vec2& to) {
    // A word of its own, not a part of a name.
    const auto isWord = [&](std::size_t at) {
        const auto end = at + option.size();
        return (at == 0 || isBlank(text[at - 1])) && end < text.size() && isBlank(text[end]);
    };
    auto at = text.find(option);
    while (at != std::string_view::npos && !isWord(at)) at = text.find(option, at + 1);
    if (at == std::string_view::npos) return;
    text.remove_prefix(at + option.size());
    for (int k = 0; k < 2; ++k) {
        while (!text.empty() && (text.front() == ' ' || text.front() == '\t'))
            text.remove_prefix(1);
        if (text.starts_with('+')) text.remove_prefix(1);
        float value = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        const auto used = static_cast<std::size_t>(end - text.data());
        const bool whole = used == text.size() || text[used] == ' ' || text[used] == '\t';
        if (error != std::errc() || !whole || !std::isfinite(value)) return;
        to[k] = value;
        text.remove_prefix(used);
    }
}

/// A line of an MTL text: its first word, and what is behind it.
struct MtlLine {
    std::string_view key, value;
};

MtlLine takeLine(std::string_view& text) {
    const auto end = text.find('\n');
    const auto line = trimmed(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    const auto blank = line.find_first_of(" \t");
    if (blank == std::string_view::npos) return {line, {}};
    return {line.substr(0, blank), trimmed(line.substr(blank))};
}

constexpr std::string_view kHalo = "-halo";

bool hasHalo(const MtlLine& line) {
    return line.key == "d" && line.value.starts_with(kHalo);
}

bool isMap(std::string_view key) {
    constexpr std::string_view kOthers[] = {"bump", "decal", "disp", "norm", "refl"};
    return key.starts_with("map_") || std::ranges::find(kOthers, key) != std::end(kOthers);
}

std::string_view takeWord(std::string_view& text) {
    const auto word = text.substr(0, text.find_first_of(" \t"));
    text = trimmed(text.substr(word.size()));
    return word;
}

/// Whether it begins with a number and has more behind it: the last word is the file's name.
bool beginsWithNumber(std::string_view text) {
    auto word = takeWord(text);
    if (word.starts_with('+')) word.remove_prefix(1);
    float value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    return error == std::errc() && end == word.data() + word.size() && !text.empty();
}

/// What is behind the key of a map, all of u, v and w given in its options.
std::string withWholeOptions(std::string_view value) {
    std::string out;
    while (value.starts_with('-')) {
        const auto option = takeWord(value);
        out += fmt::format("{} ", option);
        // What begins with no number is left to Assimp.
        const bool vector =
            (option == "-o" || option == "-s" || option == "-t") && beginsWithNumber(value);
        const int most = vector ? 3 : option == "-mm" ? 2 : 1;
        int found = 0;
        for (; found < most && (!vector || beginsWithNumber(value)); ++found)
            out += fmt::format("{} ", takeWord(value));
        for (; vector && found < most; ++found) out += option == "-s" ? "1 " : "0 ";
    }
    return out.append(value);
}

}  // namespace

std::string plainMtl(std::string_view text) {
    std::string out;
    out.reserve(text.size());
    while (!text.empty()) {
        const auto before = text;
        const auto line = takeLine(text);
        const auto number = trimmed(line.value.substr(0, line.value.find('#')));
        const bool colour =
            line.key == "Kd" || line.key == "Ke" || line.key == "Ka" || line.key == "Ks";
        if (colour && !number.empty() && std::ranges::none_of(number, isBlank))
            out += fmt::format("{0} {1} {1} {1}\n", line.key, number);
        else if (hasHalo(line))
            out += fmt::format("d {}\n", trimmed(line.value.substr(kHalo.size())));
        else if (isMap(line.key) && line.value.starts_with('-'))
            out += fmt::format("{} {}\n", line.key, withWholeOptions(line.value));
        else
            out += before.substr(0, before.size() - text.size());
    }
    return out;
}

std::vector<std::string> materialFilesIn(std::string_view line) {
    std::vector<std::string> names;
    const auto isEnd = [&](std::size_t at) {
        constexpr std::string_view kEnding = ".mtl";
        return at >= kEnding.size() && isBlank(line[at]) &&
               std::ranges::equal(line.substr(at - kEnding.size(), kEnding.size()), kEnding, {},
                                  [](char c) { return c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c; });
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

void scanMtl(std::string_view text, std::map<std::string, MtlMaterial>& materials) {
    MtlMaterial* current = nullptr;
    while (!text.empty()) {
        const auto line = takeLine(text);
        const auto& [key, value] = line;
        if (key == "newmtl") {
            current = &materials[std::string(value)];
        } else if (!current) {
            continue;
        } else if (key == "Kd") {
            current->hasDiffuse = true;
        } else if (key == "d") {
            current->hasDissolve = true;
            if (hasHalo(line)) current->droppedOptions.push_back(fmt::format("{} of d", kHalo));
        } else if (key == "Ke") {
            current->hasEmission = true;
        } else if (key == "Tr") {
            current->hasTransparency = true;
        } else if (key == "map_Kd" || key == "map_d") {
            // The last word, or what is in quotes at the end.
            const bool quoted = value.size() > 1 && value.ends_with('"');
            const auto last =
                quoted ? value.rfind('"', value.size() - 2) : value.find_last_of(" \t");
            auto file = last == std::string_view::npos ? value : value.substr(last + 1);
            if (quoted) file.remove_suffix(1);
            (key == "map_Kd" ? current->diffuseMap : current->alphaMap) = file;
            if (key == "map_Kd") {
                readVector(value, "-s", current->uvScale);
                readVector(value, "-o", current->uvOffset);
            }
            for (const std::string_view option : {"-t ", "-mm ", "-boost "}) {
                if (key == "map_Kd" && value.find(option) != std::string_view::npos)
                    current->droppedOptions.push_back(fmt::format("{} of map_Kd", trimmed(option)));
            }
        }
    }
}

}  // namespace stx

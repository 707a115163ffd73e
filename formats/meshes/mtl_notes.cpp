#include "formats/meshes/mtl_notes.hpp"

#include <charconv>
#include <cmath>

#include "formats/meshes/text_encoding.hpp"

namespace stx {
namespace {

/// `-s u v w`: one to three numbers behind an option; v stays as it is when only u is given.
void readVector(std::string_view text, std::string_view option, glm::vec2& to) {
    auto at = text.find(option);
    // A word of its own, not the end of a name.
    if (at == std::string_view::npos || (at > 0 && text[at - 1] != ' ' && text[at - 1] != '\t'))
        return;
    text.remove_prefix(at + option.size());
    for (int k = 0; k < 2; ++k) {
        while (!text.empty() && (text.front() == ' ' || text.front() == '\t'))
            text.remove_prefix(1);
        float value = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        const auto used = static_cast<std::size_t>(end - text.data());
        const bool whole = used == text.size() || text[used] == ' ' || text[used] == '\t';
        if (error != std::errc() || !whole || !std::isfinite(value)) return;
        to[k] = value;
        text.remove_prefix(used);
    }
}

}  // namespace

void scanMtl(std::string_view text, std::map<std::string, MtlMaterial>& materials) {
    MtlMaterial* current = nullptr;
    while (!text.empty()) {
        const auto end = text.find('\n');
        const auto line = trimmed(text.substr(0, end));
        text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
        const auto blank = line.find_first_of(" \t");
        const auto key = line.substr(0, blank);
        const auto value =
            blank == std::string_view::npos ? std::string_view{} : trimmed(line.substr(blank));
        if (key == "newmtl") {
            current = &materials[std::string(value)];
        } else if (!current) {
            continue;
        } else if (key == "Kd") {
            current->hasDiffuse = true;
        } else if (key == "d") {
            current->hasDissolve = true;
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
                readVector(value, "-s ", current->uvScale);
                readVector(value, "-o ", current->uvOffset);
            }
            for (const std::string_view option : {"-t ", "-mm ", "-boost "}) {
                if (key == "map_Kd" && value.find(option) != std::string_view::npos)
                    current->droppedOptions.emplace_back(trimmed(option));
            }
        }
    }
}

}  // namespace stx

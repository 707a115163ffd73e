#include "formats/meshes/mtl_notes.hpp"

#include "formats/meshes/text_encoding.hpp"

namespace stx {

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
        } else if (key == "Tr") {
            current->hasTransparency = true;
        } else if (key == "map_Kd" || key == "map_d") {
            const auto last = value.find_last_of(" \t");
            const auto file = last == std::string_view::npos ? value : value.substr(last + 1);
            (key == "map_Kd" ? current->diffuseMap : current->alphaMap) = file;
            for (const std::string_view option : {"-s ", "-o ", "-t ", "-mm ", "-boost "}) {
                if (key == "map_Kd" && value.find(option) != std::string_view::npos)
                    current->droppedOptions.emplace_back(trimmed(option));
            }
        }
    }
}

}  // namespace stx

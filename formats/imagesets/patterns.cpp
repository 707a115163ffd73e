#include "formats/imagesets/patterns.hpp"

#include <utility>

#include <fmt/format.h>

namespace stx::imagesets {

std::string filled(std::string_view pattern, const Placeholders& p) {
    const std::pair<std::string_view, std::string> words[] = {
        {"{name}", p.name},
        {"{w}", std::to_string(p.width)},
        {"{h}", std::to_string(p.height)},
        {"{frame}", std::to_string(p.frame)},
        {"{frame:03}", fmt::format("{:03}", p.frame)},
        {"{frame:04}", fmt::format("{:04}", p.frame)}};
    std::string out;
    while (!pattern.empty()) {
        bool known = false;
        for (const auto& [word, value] : words) {
            if (!pattern.starts_with(word)) continue;
            out += value;
            pattern.remove_prefix(word.size());
            known = true;
            break;
        }
        if (known) continue;
        out += pattern.front();
        pattern.remove_prefix(1);
    }
    return out;
}

}  // namespace stx::imagesets

#include "formats/imagesets/patterns.hpp"

#include <algorithm>
#include <charconv>
#include <set>
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

int lastFrame(const std::filesystem::path& folder, const std::filesystem::path& file, int frame,
              const std::function<bool(int)>& there) {
    std::set<int, std::greater<>> numbers;
    const auto collect = [&](const std::filesystem::path& from) {
        std::error_code ec;
        for (std::filesystem::directory_iterator it(from, ec), end; !ec && it != end;
             it.increment(ec)) {
            const std::string name = it->path().filename().string();
            for (const char *at = name.data(), *last = at + name.size(); at != last;) {
                int number = 0;
                const auto [after, wrong] = std::from_chars(at, last, number);
                if (wrong == std::errc() && number > frame) numbers.insert(number);
                at = std::max(after, at + 1);
            }
        }
    };
    const auto beside = file.parent_path();
    collect(beside);
    if (beside != folder) collect(beside.parent_path());
    const auto last = std::ranges::find_if(numbers, there);
    return last == numbers.end() ? frame : *last;
}

}  // namespace stx::imagesets

#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace stx::imagesets {

/// What replaces the words of a pattern of file names.
struct Placeholders {
    std::string name;           ///< {name}
    int width = 0, height = 0;  ///< {w} {h}
    int frame = 0;              ///< {frame}, with zeros {frame:03} {frame:04}
};

/// The pattern with its words filled in; {format} and unknown ones are left as they are.
[[nodiscard]] std::string filled(std::string_view pattern, const Placeholders& placeholders);

/// The number of the last frame that `there` confirms, whatever is missing before it: of the
/// numbers from `frame` on in the names beside `file` (that of `frame`) and, within `folder`,
/// beside the folder in which it is; at least `frame`.
[[nodiscard]] int lastFrame(const std::filesystem::path& folder, const std::filesystem::path& file,
                            int frame, const std::function<bool(int)>& there);

}  // namespace stx::imagesets

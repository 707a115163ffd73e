#pragma once

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

}  // namespace stx::imagesets

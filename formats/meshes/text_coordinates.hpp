#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <glm/glm.hpp>

#include "formats/files/files.hpp"

namespace stx {

/// A model's text whose lines of coordinates Assimp reads as they are meant.
struct PlainText {
    std::optional<Bytes> text;  ///< nothing where all is fine as it is
    glm::dvec3 origin{0.0};     ///< is subtracted from the coordinates
    std::string unread;         ///< the first line that is not understood: all stays as it is
    bool dropsAlpha = false;    ///< the text is without alphas of vertices, some below full
};

/// OBJ text as Assimp reads what it means; nothing when it is so already:
///  - The numbers of `v`, `vt`, `vn` have a digit before their point: `.5`, which Wavefront's
///    specification allows, becomes `0.5`, since Assimp counts words that begin with a digit or a
///    sign only.
///  - They do not go on in the next line.
///  - No comment does either: one ends where its line does, also behind a backslash.
///  - Nothing is behind them and behind `f`, `l`, `p`: Assimp takes a comment there for a corner.
[[nodiscard]] std::optional<Bytes> plainObj(ByteSpan text);

/// Rewrites the lines that begin with `keyword` ("v" of OBJ, "vertex" of STL) where Assimp would
/// lose what they say:
///  - It reads coordinates as floats, which round those of maps (4000000.1 becomes 4000000). So
///    they are read in double precision first, and written from an origin where originFor() finds
///    them too large.
///  - It gives the k-th colour to the k-th vertex, also where vertices before it have none. So
///    vertices without a colour become white when others have one.
///  - It takes three, four or six numbers. So the alpha behind a colour is left out.
/// Vertices that are at no finite place stay so, and have no say in this.
[[nodiscard]] PlainText plainCoordinates(ByteSpan text, std::string_view keyword);

}  // namespace stx

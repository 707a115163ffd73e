#pragma once

#include "formats/files/files.hpp"
#include "formats/imagesets/set_view.hpp"

namespace stx::imagesets {

/// The colour of a source; `alpha` says whether its alpha is the file's own.
struct StoredColour {
    Texture texture;
    bool alpha = false;
};
/// `deep`: see ImageSetOptions::deepColour.
[[nodiscard]] Result<StoredColour> readColour(const PictureSource& source, const YuvColour& colour,
                                              bool deep, Job& job);

/// The same of a picture's file, as it is stored; `name` is for messages, and its ending for kinds
/// whose first bytes do not say what they are.
[[nodiscard]] Result<StoredColour> colourOfFile(ByteSpan bytes, const std::string& name, bool deep,
                                                Job& job);

/// The values of a depth or disparity image as they are stored.
struct StoredDepth {
    Image<float> values;
    int largest = 0;     ///< integer that can be stored: 255, 1023, 65535; 0: they are floats
    bool lossy = false;  ///< of a JPEG, beside a photo
};
[[nodiscard]] Result<StoredDepth> readDepth(const PictureSource& source, Job& job);

/// Width and height, from the header alone where that is possible (PNG, JPEG).
[[nodiscard]] Result<glm::ivec2> imageSizeOf(const PictureSource& source, Job& job);

/// Two images of these sizes have the same shape but for the rounding of one pixel.
[[nodiscard]] bool sameShape(glm::ivec2 a, glm::ivec2 b);

/// How depth lies that does not say itself how it is turned, beside a picture that does.
struct DepthTurn {
    bool asPicture = false;  ///< as the sensor saw it: it is to be turned as the picture
    std::string note;        ///< what a person should know of that
};
/// `size` of the depth as it is stored, `upright` of the picture as it is shown; `sideways`: the
/// picture's turn swaps its sides. It is turned where only the picture as it is stored has the same
/// shape.
[[nodiscard]] DepthTurn depthTurnOf(glm::ivec2 size, glm::ivec2 upright, bool sideways,
                                    const std::string& name);

/// `PF`/`Pf` files: floats, rows from the bottom, a negative scale for little-endian.
[[nodiscard]] Result<Image<float>> parsePfm(ByteSpan bytes, std::string_view name,
                                            const Limits& limits);
/// COLMAP's depth maps: `w&h&c&` in ASCII, then little-endian floats, x fastest, rows from the top.
[[nodiscard]] Result<Image<float>> parseColmapDepth(ByteSpan bytes, std::string_view name,
                                                    const Limits& limits);

}  // namespace stx::imagesets

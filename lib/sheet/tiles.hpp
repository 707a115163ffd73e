#pragma once

#include <optional>
#include <string>

#include <glm/glm.hpp>

#include "lib/base/image.hpp"
#include "lib/model/texture.hpp"
#include "lib/sheet/canvas.hpp"
#include "lib/sheet/false_colour.hpp"

namespace stx {

/// One small picture of a sheet and what is written below it.
struct Tile {
    Rgb8Image picture;
    std::string caption;
    bool bar = false;  ///< the map of its false colours is drawn below it
};

/// What tiles show where there is nothing.
inline constexpr glm::u8vec3 kEmptyColour{216, 216, 220};

/// The size of an image in a cell: shrunk to fit, or enlarged by a whole factor.
[[nodiscard]] glm::ivec2 sizeInCell(glm::ivec2 size, glm::ivec2 cell);

/// The mean of the pixels under each new one, in linear light, over kEmptyColour.
[[nodiscard]] Rgb8Image shrunk(const Texture& texture, glm::ivec2 cell);
/// The same of a picture without alpha.
[[nodiscard]] Rgb8Image shrunk(const Rgb8Image& picture, glm::ivec2 cell);
/// The least of the finite values under each new pixel, where they are at least half of all there;
/// else infinite.
[[nodiscard]] Image<float> shrunkValues(const Image<float>& values, glm::ivec2 cell);
/// The largest of the finite values under each new pixel; infinite where there are none.
[[nodiscard]] Image<float> shrunkLargest(const Image<float>& values, glm::ivec2 cell);

/// "depth 1.25 to 3.5", or that there is none.
[[nodiscard]] std::string rangeText(const std::string& what, const ValueRange& range);

[[nodiscard]] Tile colourTile(const Texture& texture, glm::ivec2 cell);
[[nodiscard]] Tile depthTile(const Image<float>& depth, glm::ivec2 cell);
/// World directions as colours, n / 2 + 1/2 of each axis.
[[nodiscard]] Tile normalTile(const Image<glm::vec3>& normal, glm::ivec2 cell);
/// As an engine sees the map: G = roughness, B = metallic.
[[nodiscard]] Tile metallicRoughnessTile(const Image<glm::vec2>& values, glm::ivec2 cell);
/// The light that is given off; where it exceeds 1, so much darker that its most is 1.
[[nodiscard]] Tile emissiveTile(const Image<glm::vec3>& emissive, glm::ivec2 cell);
/// The longer of the two half axes in false colour.
[[nodiscard]] Tile splatTile(const Image<glm::vec3>& splatU, const Image<glm::vec3>& splatV,
                             glm::ivec2 cell);

}  // namespace stx

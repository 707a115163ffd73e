#pragma once

#include <vector>

#include "formats/atlas/atlas_files.hpp"

namespace stx {

/// Pixels of an atlas' textures as the integers that PNG files hold, and back.

/// Codes of a page's depth: each rectangle and its padding with the code of its view, all else 0.
/// Counts points that no rectangle holds (they become 0) and points outside their view's planes.
struct DepthCodes {
    Image<std::uint16_t> codes;
    std::int64_t outside = 0;
    std::int64_t clamped = 0;
};
[[nodiscard]] DepthCodes depthCodes(const Atlas& atlas, int page);
/// The inverse, for an atlas whose rectangles were checked. A code beyond the view's dmax is an
/// error (invalidInput).
[[nodiscard]] Result<Image<float>> depthFromCodes(const Atlas& atlas, int page,
                                                  const Image<std::uint16_t>& codes);

/// The depth texture with a second picture: codes and `factor` times the colour's alpha.
[[nodiscard]] Image<std::uint16_t> withAlpha(const Image<std::uint16_t>& codes,
                                             const Rgba8Image& colour, const AtlasTexture& texture,
                                             int factor);
/// Interleaved RGB without alpha, filled from the neighbours at all pixels of alpha 0, so that a
/// lossy codec finds no edge beside the object. `texture` holds 8-bit sRGB.
[[nodiscard]] std::vector<std::uint8_t> opaqueBytes(Texture texture);
/// Puts alpha into a colour image of the same size.
void setAlpha(Rgba8Image& colour, const Image<std::uint8_t>& alpha);

/// Largest component of vectors, the scale of their codes; 1 when all are zero.
[[nodiscard]] double largestComponent(const Image<glm::vec3>& vectors);
/// 32768 + 32767 * v / scale of each component, into interleaved RGB at (x0, y0) of an image that
/// is `width` pixels wide.
void codeVectors(const Image<glm::vec3>& vectors, double scale, int x0, int y0, int width,
                 std::vector<std::uint16_t>& rgb);
/// The inverse; zero comes back as zero.
[[nodiscard]] Image<glm::vec3> vectorsFromCodes(const std::vector<std::uint16_t>& rgb, double scale,
                                                int x0, int y0, int width, glm::ivec2 size);

/// The linear light of code 255: the largest component, at least 1.
[[nodiscard]] double emissiveScale(const Image<glm::vec3>& emissive);
/// Says of which objects the one scale of a texture (AtlasTexture::scale) is too coarse, since
/// others have longer splats or more light: once each, whatever the page and the frame.
void noteCoarseScales(const Atlas& atlas, const std::vector<AtlasTexture>& textures, Job& job);

/// Interleaved RGB of glTF's metallicRoughnessTexture: G = roughness, B = metallic, and R = 255,
/// "not occluded" where an engine takes it for that, wherever one of the two is not 0.
[[nodiscard]] std::vector<std::uint8_t> bytesOf(const Image<glm::vec2>& metallicRoughness);
/// Interleaved sRGB of light / scale.
[[nodiscard]] std::vector<std::uint8_t> bytesOf(const Image<glm::vec3>& emissive, double scale);
/// The inverses, of images of `size` pixels; codes come back as the same codes.
[[nodiscard]] Image<glm::vec2> metallicRoughnessFrom(const std::vector<std::uint8_t>& rgb,
                                                     glm::ivec2 size);
[[nodiscard]] Image<glm::vec3> emissiveFrom(const std::vector<std::uint8_t>& rgb, double scale,
                                            glm::ivec2 size);

}  // namespace stx

#pragma once

#include "formats/images/images.hpp"
#include "formats/mpeg4/scene/placement.hpp"
#include "formats/mpeg4/scene/scene.hpp"
#include "lib/model/reference_view.hpp"

/// The images of SimpleTexture and SimpleTextureV2: pixels of a view <-> image files.
namespace stx::mpeg4 {

/// The picture of a PixelTexture; the file's first row is the lowest.
[[nodiscard]] DecodedImage decodedFromPixels(const PixelImage& image);

/// Distances of a grey image of depth codes, from channel `channel`. `greyBits`: 1, 2 or 4 when
/// the codes were spread from so few bits (ImageInfo::greyBits), else 0. Errors when the image has
/// neither 8 nor 16 bits.
[[nodiscard]] Result<Image<float>> depthFromImage(const DecodedImage& image, int channel,
                                                  int greyBits, double nearPlane, double farPlane);
/// Whether red, green and blue are equal in every pixel.
[[nodiscard]] bool isGrey(const DecodedImage& image);

/// Unit normals of an RGB image; zero where `depth` has no point and where the code is not a
/// direction.
[[nodiscard]] Result<Image<glm::vec3>> normalsFromImage(const DecodedImage& image,
                                                        const Image<float>& depth);
/// Tangent vectors of an RGB image, as mapping.hpp describes.
[[nodiscard]] Result<Image<glm::vec3>> splatsFromImage(const DecodedImage& image,
                                                       glm::vec2 splatMinMax,
                                                       const Image<float>& depth);

/// PNG of the depth codes, padded with 0. `worst` becomes the largest difference between a distance
/// and its code's, scene units.
[[nodiscard]] Result<Bytes> depthPng(const Image<float>& depth, const DepthCode& code,
                                     const Padding& padding, double& worst);
/// PNG of unit normals with 8 or 16 bits; zero vectors become 0 0 0.
[[nodiscard]] Result<Bytes> normalPng(const Image<glm::vec3>& normal, int bits,
                                      const Padding& padding);
/// PNG of tangent vectors, components scaled from [-longest, longest].
[[nodiscard]] Result<Bytes> splatPng(const Image<glm::vec3>& splat, float longest, int bits,
                                     const Padding& padding);
/// The largest absolute component.
[[nodiscard]] float largestComponent(const Image<glm::vec3>& image);

/// 8-bit sRGB of a texture; linear colour is coded, `clamped` says whether some was brighter
/// than 1.
[[nodiscard]] Rgba8Image rgba8FromTexture(const Texture& texture, bool& clamped);
/// Whether alpha is 255 where the depth has a point and 0 elsewhere, so that it need not be
/// written. `prunedToo`: it may be 255 elsewhere, too.
[[nodiscard]] bool alphaFollowsDepth(const Rgba8Image& texture, const Image<float>& depth,
                                     bool prunedToo = false);
/// An image with `padding` around it, its edge repeated (alpha 0 in what is new).
[[nodiscard]] Rgba8Image padded(const Rgba8Image& image, const Padding& padding);
/// PNG of colour, with alpha when asked, and JPEG; of what padded() gives, without the memory for
/// it.
[[nodiscard]] Result<Bytes> colourPng(const Rgba8Image& image, bool alpha,
                                      const Padding& padding = {});
[[nodiscard]] Result<Bytes> colourJpeg(const Rgba8Image& image, int quality,
                                       const Padding& padding = {});

}  // namespace stx::mpeg4

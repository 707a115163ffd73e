#pragma once

#include <string>

#include "formats/mpeg4/mapping/mapping.hpp"

/// Documents that are written out of bundles and environments: a scene, and streams of pictures.
namespace stx::mpeg4 {

/// Object descriptors take ids from here on: 1 is that of the presentation.
inline constexpr int kFirstImageOd = 2;
/// 1023 is forbidden.
inline constexpr int kLastImageOd = 1022;

/// A PNG or JPEG as a stream of its own behind a new object descriptor. The ids must not run out.
[[nodiscard]] Url addPictureStream(UpdateObjectDescriptors& update, std::string fileName,
                                   Bytes bytes);
/// The same with the bytes in a spool, if there is one; its source() is for the caller to set.
[[nodiscard]] Result<Url> addPictureStream(UpdateObjectDescriptors& update, std::string fileName,
                                           Bytes bytes, PictureSpool* spool);

/// A document whose one frame shows `root` in a scene of `size` pixels, with DEF names, and has
/// these object descriptors.
[[nodiscard]] Document newDocument(NodePtr root, UpdateObjectDescriptors update, glm::ivec2 size);

}  // namespace stx::mpeg4

#pragma once

#include "formats/mpeg4/mapping/mapping.hpp"
#include "formats/mpeg4/mapping/stream_images.hpp"
#include "formats/mpeg4/scene/scene_walk.hpp"
#include "lib/model/environment.hpp"

/// The Background node and environments (ISO/IEC 14496-11; VRML97, 6.5). Faces are turned as the
/// text says: top has +Z up, bottom -Z, +X is to the right on both. (GPAC draws these two turned by
/// a quarter.)
namespace stx::mpeg4 {

/// An ImageTexture with the url of a face, which StreamImages takes; null when the Background has
/// no picture there.
[[nodiscard]] NodePtr faceTexture(const Node& background, CubeFace face);

/// What the first of a scene's Backgrounds shows, which is the one that is bound; null: there is
/// none. What cannot be read (a picture that does not decode, angles that do not rise) is left out
/// with a note: it costs only what is far behind the object. Of pictures in time the one of the
/// moment of `images` is taken. Errors: cancelled.
[[nodiscard]] Result<std::shared_ptr<const Environment>> boundEnvironment(
    const std::vector<ShownBackground>& backgrounds, const StreamImages& images,
    const ImageDecoder& decode, Job& job);

/// A Background, under a Transform where the environment is turned, with a stream for each face. A
/// picture all around becomes six faces; linear light becomes 8-bit sRGB; where pictures are
/// transparent and the environment has no sky, the mean colours around the poles are added (a
/// Background is opaque); all with notes. Errors: Environment::check(), the image writers,
/// (unsupported) more pictures than there are object descriptors.
[[nodiscard]] Result<NodePtr> backgroundFromEnvironment(const Environment& environment,
                                                        const SceneWriteOptions& options,
                                                        UpdateObjectDescriptors& update, Job& job);

/// A presentation that shows an environment and nothing else.
[[nodiscard]] Result<Document> sceneFromEnvironment(const Environment& environment,
                                                    const SceneWriteOptions& options, Job& job);
/// The environment of the Background that a presentation shows at its first moment; null: none.
[[nodiscard]] Result<std::shared_ptr<const Environment>> environmentFromScene(
    const Document& document, const SceneReadOptions& options, Job& job);

}  // namespace stx::mpeg4

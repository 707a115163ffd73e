#pragma once

#include <cstdint>
#include <memory>

#include "formats/mpeg4/mapping/mapping.hpp"
#include "formats/mpeg4/mapping/scene_timeline.hpp"
#include "formats/mpeg4/mapping/stream_images.hpp"
#include "formats/mpeg4/scene/scene_walk.hpp"
#include "lib/model/sequence.hpp"

namespace stx::mpeg4 {

/// A presentation in time: MovieTextures (and other textures of streams with several pictures) at
/// their composition times, commands at theirs, interpolators that TimeSensors drive. Its timeline
/// is timelineOf(). Pictures are decoded when a frame is asked for. Errors as bundleFromScene().
[[nodiscard]] Result<std::unique_ptr<Sequence>> sequenceFromScene(Document document,
                                                                  const SceneReadOptions& options,
                                                                  Job& job);

/// Bytes of decoded pictures that such a sequence keeps at most, where something moves.
[[nodiscard]] std::uint64_t keptPictureBytes(const Limits& limits);

/// The object of a presentation in a scene, which shows `shown`, as it is at the moment of
/// `images`; see bundleFromScene().
[[nodiscard]] Result<Bundle> bundleOfMoment(const Document& document, const Scene& scene,
                                            const ShownScene& shown, const StreamImages& images,
                                            const SceneReadOptions& options, Job& job);

/// The same as a table; see viewsFromScene(). With `still` a note says what moves.
[[nodiscard]] Result<std::unique_ptr<ViewTable>> viewsOfMoment(
    std::shared_ptr<const Document> document, const Scene& scene, const ShownScene& shown,
    std::shared_ptr<const StreamImages> images, const SceneReadOptions& options, bool still,
    Job& job);

/// Says which interpolators of a document have keys that do not fit their values.
void noteBrokenKeys(const Document& document, Job& job);

}  // namespace stx::mpeg4

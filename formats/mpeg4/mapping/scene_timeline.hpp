#pragma once

#include <optional>

#include "formats/mpeg4/mapping/stream_images.hpp"
#include "lib/model/sequence.hpp"

namespace stx::mpeg4 {

/// When a presentation changes, by the film's own clock where a note tells how that begins: at
/// least one moment. That is at commands, where an object descriptor brings a shown texture another
/// stream, and at each picture; where a clock runs, 25 moments a second and the one at its end, but
/// none less than a step from a picture. Clocks and movies run by their fields as commands have
/// left them at each moment. What loops without a stop does so until all else has ended and its
/// cycle then under way, too; at least once. Moments of two streams within half a tick of the
/// coarser clock are one. Of a scene whose commands do not fit it, only commands are moments from
/// there on.
/// It ends where a note says how long it is, else with what runs longest.
/// Errors: (unsupported) more than four million moments, or too many nodes to look at.
/// `timesFromStart`: as SceneReadOptions has it. A note of `job` names the events of commands that
/// are lost.
[[nodiscard]] Result<Timeline> timelineOf(const Document& document, const StreamImages& images,
                                          bool timesFromStart = false, Job* job = nullptr);

/// The scene at its first moment as a film has it: with what clocks send then. `images` are of the
/// document; `timesFromStart`: as SceneReadOptions has it. Errors as composeScene(). The document
/// must have a frame.
[[nodiscard]] Result<Scene> sceneAtStart(const Document& document, StreamImages images,
                                         bool timesFromStart);

/// What a WorldInfo says of a film's own clock: when the presentation begins, and how long the film
/// or the moment is, in seconds.
struct OwnClock {
    double start = 0;
    std::optional<double> duration;
};
[[nodiscard]] OwnClock ownClock(const Scene& scene, const Limits& limits);

/// Whether a TimeSensor or a MovieTexture is active at a time of the scene, in seconds. `images`
/// are put to that time.
[[nodiscard]] bool isActive(const Node& node, StreamImages& images, double now);

}  // namespace stx::mpeg4

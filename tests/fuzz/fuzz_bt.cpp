// BT: what reads, writes, and reads back the same; and the way from the scene to bundles,
// at its first moment and in time.

#include "formats/mpeg4/mapping/mapping.hpp"
#include "formats/mpeg4/text/bt.hpp"
#include "tests/fuzz/scene_in_time.hpp"
#include "tests/fuzz/text_round_trip.hpp"
#include "tests/same_scenes.hpp"

using namespace stx;
using namespace stx::mpeg4;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    Job job;
    job.limits.maxMemoryBytes = 64u << 20;
    const auto trip = textRoundTrip(text, readBt, writeBt, job);
    if (!trip) return 0;
    if (!sameFrames(trip->document.frames, trip->again.frames, {.ids = false, .names = false}))
        violated("what is written reads back the same");
    SceneReadOptions options;
    options.decode = tinyPicture;
    const auto bundle = bundleFromScene(trip->document, options, job);
    if (bundle && !bundle->check()) violated("a bundle that is read keeps its rules");
    sceneInTime(trip->document, job);
    return 0;
}

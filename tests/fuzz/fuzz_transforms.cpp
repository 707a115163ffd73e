// JSON of transforms: any bytes give cameras that make sense and what of them moves, or one error.

#include "formats/imagesets/kinds.hpp"
#include "formats/imagesets/motion.hpp"
#include "tests/fuzz/violated.hpp"

using namespace stx;
using namespace stx::imagesets;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto json = parseJson({reinterpret_cast<const std::byte*>(data), size});
    if (!json || jsonKindOf(*json) != JsonKind::transforms) return 0;
    Job job;
    auto views = transformsViews(*json, job);
    if (!views) return 0;
    for (const SetView& view : *views)
        if (view.camera.width > 0 && !view.camera.check()) violated("a camera keeps its rules");
    SetDescription set;
    set.views = std::move(*views);
    const auto motion = motionOf(set, {});
    if (!motion && motion.error().message.empty()) violated("an error has a message");
    if (!motion || !motion->moves()) return 0;
    const Timeline line = motion->timeline();
    if (const auto sound = line.check(); !sound)
        violated("a timeline keeps its rules", sound.error().text());
    const std::size_t last = line.count() - 1;
    for (const std::size_t frame : {std::size_t{0}, last / 2, last})
        if (motion->moment(set, frame).views.size() != motion->tracks.size())
            violated("each camera has a picture at each moment");
    return 0;
}

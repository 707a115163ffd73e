// JSON of transforms: any bytes give cameras that make sense, or one error.

#include <cstdlib>

#include "formats/imagesets/kinds.hpp"

using namespace stx;
using namespace stx::imagesets;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto json = parseJson({reinterpret_cast<const std::byte*>(data), size});
    if (!json || jsonKindOf(*json) != JsonKind::transforms) return 0;
    Job job;
    const auto views = transformsViews(*json, job);
    if (!views) return 0;
    for (const SetView& view : *views)
        if (view.camera.width > 0 && !view.camera.check()) std::abort();
    return 0;
}

// Camera and image set formats. The first byte picks the parser, the rest is its file.

#include <cmath>
#include <cstdlib>

#include "formats/imagesets/colmap.hpp"
#include "formats/imagesets/kinds.hpp"
#include "formats/imagesets/middlebury.hpp"
#include "formats/imagesets/msr.hpp"
#include "formats/imagesets/pictures.hpp"
#include "formats/imagesets/rgbd.hpp"

using namespace stx;

namespace {

template <class T>
void checkError(const Result<T>& result) {
    if (!result && result.error().message.empty()) std::abort();
}

/// What a set gives must be a sound camera; later code relies on it. One without a size gets the
/// rest of its lens from its picture, later.
void checkViews(const Result<std::vector<imagesets::SetView>>& views) {
    checkError(views);
    if (!views) return;
    for (const auto& view : *views) {
        if (!view.panorama && view.camera.width > 0 && !view.camera.check()) std::abort();
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    const ByteSpan bytes(reinterpret_cast<const std::byte*>(data + 1), size - 1);
    const std::string_view text(reinterpret_cast<const char*>(data + 1), size - 1);
    Job job;
    job.limits.maxMemoryBytes = 64 << 20;
    job.limits.maxViews = 1000;
    switch (data[0] % 11) {
        case 0:
        case 1:
        case 2: {
            const auto json = imagesets::parseJson(bytes);
            checkError(json);
            if (!json) return 0;
            // As the readers do: each kind knows its own keys.
            const auto kind = imagesets::jsonKindOf(*json);
            if (kind == imagesets::JsonKind::transforms)
                checkViews(imagesets::transformsViews(*json, job));
            if (kind == imagesets::JsonKind::miv) checkViews(imagesets::mivViews(*json, job));
            if (kind == imagesets::JsonKind::cameras)
                checkViews(imagesets::camerasJsonViews(*json, job));
            if (kind == imagesets::JsonKind::cameraPath)
                checkViews(imagesets::cameraPathViews(*json, job));
            break;
        }
        case 3:
        case 4:
            checkError(imagesets::parseColmapCameras(bytes, data[0] % 11 == 4, job.limits));
            break;
        case 5:
        case 6:
            checkError(imagesets::parseColmapImages(bytes, data[0] % 11 == 6, job.limits));
            break;
        case 7:
            checkError(imagesets::parseMiddlebury(text, job.limits));
            break;
        case 8:
            checkError(imagesets::parseMsrCalibration(text, job.limits));
            break;
        case 9:
            checkError(imagesets::parseTrajectory(text));
            break;
        case 10:
            checkError(imagesets::parsePfm(bytes, "fuzz", job.limits));
            checkError(imagesets::parseColmapDepth(bytes, "fuzz", job.limits));
            break;
    }
    return 0;
}

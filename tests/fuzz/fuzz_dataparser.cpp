// dataparser_transforms.json of nerfstudio, and behind a zero byte perhaps the transforms.json that
// it belongs to: any bytes give cameras that keep their rules, or one error.

#include <cmath>

#include "formats/imagesets/kinds.hpp"
#include "tests/fuzz/violated.hpp"

using namespace stx;
using namespace stx::imagesets;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const ByteSpan all(reinterpret_cast<const std::byte*>(data), size);
    const auto zero =
        static_cast<std::size_t>(std::find(all.begin(), all.end(), std::byte{0}) - all.begin());
    const auto dataparser = parseJson(all.first(zero));
    if (!dataparser) return 0;
    const auto transforms = zero < size ? parseJson(all.subspan(zero + 1)) : Result<Json>(Json());
    if (!transforms) return 0;
    std::vector<SetView> views(2);
    for (auto& view : views)
        view.camera = Camera::fromFieldOfView({1, 2, 3}, {1, 0, 0, 0}, {1.0, 0.8}, false, 16, 12);
    Job job;
    const auto done = undoDataparser(*dataparser, zero < size ? &*transforms : nullptr, views, job);
    if (!done) {
        if (done.error().message.empty()) violated("an error has a message");
        return 0;
    }
    for (const SetView& view : views)
        if (const auto sound = view.camera.check(); !sound)
            violated("a camera keeps its rules", sound.error().text());
    return 0;
}

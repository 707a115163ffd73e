// BT: what reads, writes, and reads back the same; and the way from the scene to a bundle.

#include <cstdio>
#include <cstdlib>

#include "formats/mpeg4/bt.hpp"
#include "formats/mpeg4/mapping.hpp"

using namespace stx;
using namespace stx::mpeg4;

namespace {

[[noreturn]] void violated(const char* what) {
    std::fprintf(stderr, "violated: %s\n", what);
    std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    Job job;
    job.limits.maxMemoryBytes = 64u << 20;
    const auto document = readBt(text, "fuzz.bt", job);
    if (!document) return 0;
    const auto written = writeBt(*document, job);
    if (!written) {
        if (written.error().code != ErrorCode::unsupported) violated("what reads can be written");
        return 0;
    }
    const auto again = readBt(*written, "again.bt", job);
    if (!again) {
        std::fprintf(stderr, "%s\n%s\n", again.error().text().c_str(), written->c_str());
        violated("what is written reads");
    }
    if (!sameFrames(document->frames, again->frames, {.ids = false, .names = false}))
        violated("what is written reads back the same");
    SceneReadOptions options;
    // No image library: any picture is two grey pixels.
    options.decode = [](ByteSpan, std::string_view, const Limits&) -> Result<DecodedImage> {
        DecodedImage image;
        image.width = 2;
        image.height = image.channels = 1;
        image.values = std::vector<std::uint8_t>{0, 200};
        image.channelNames = {"Y"};
        return image;
    };
    const auto bundle = bundleFromScene(*document, options, job);
    if (bundle && !bundle->check()) violated("a bundle that is read keeps its rules");
    return 0;
}

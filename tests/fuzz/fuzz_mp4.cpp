// MP4 files: anything may be in them; what is read can be written, and reads back the same.

#include "formats/mpeg4/container/isobmff.hpp"
#include "tests/fuzz/scene_in_time.hpp"
#include "tests/fuzz/violated.hpp"
#include "tests/same_scenes.hpp"

using namespace stx;
using namespace stx::mpeg4;

namespace {

/// Quantised normals and rotations come back only within a step, so such scenes are not compared.
bool isQuantised(const Document& document) {
    bool found = false;
    for (const CommandFrame& frame : document.frames)
        for (const Command& command : frame.commands)
            forEachNode(command,
                        [&](const NodePtr& node) { found |= node->is("QuantizationParameter"); });
    return found;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Job job;
    job.limits.maxMemoryBytes = 64u << 20;
    const auto* bytesGiven = reinterpret_cast<const std::byte*>(data);
    const auto source = ByteSource::fromBytes(Bytes(bytesGiven, bytesGiven + size));
    const auto document = readMp4(source, job);
    if (!document) {
        if (document.error().message.empty()) violated("an error has a message");
        return 0;
    }
    for (const ObjectDescriptor* descriptor : document->objectDescriptors())
        for (const ElementaryStream& stream : descriptor->streams)
            for (const Sample& sample : stream.samples)
                if (!sample.data.load(job.limits)) violated("a sample lies in the file");
    (void)composeScene(document->frames);
    sceneInTime(*document, job);

    const auto bytes = writeMp4(*document, job);
    if (!bytes) return 0;
    const auto again = readMp4(ByteSource::fromBytes(*bytes), job);
    if (!again) violated("what is written can be read", again.error().text());
    if (!isQuantised(*document) && !sameFrames(document->frames, again->frames))
        violated("what is written reads the same");
    const auto twice = writeMp4(*again, job);
    if (!twice || (*twice != *bytes && !isQuantised(*document)))
        violated("writing again gives the same bytes");
    return 0;
}

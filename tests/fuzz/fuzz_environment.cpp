// OpenEXR files as environments: pictures around and cubes, in parts of any shape.

#include "formats/exr/environment_exr.hpp"
#include "tests/fuzz/violated.hpp"

using namespace stx;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Job job;
    job.limits.maxMemoryBytes = 64 << 20;
    job.limits.maxViews = 20;
    const auto reader =
        ExrReader::open({reinterpret_cast<const std::byte*>(data), size}, "fuzz", job.limits);
    if (!reader) return 0;
    for (int part = 0; part < static_cast<int>(reader->parts().size()); ++part) {
        const auto header = environmentHeader(reader->parts()[static_cast<std::size_t>(part)]);
        const auto environment = readEnvironmentPart(*reader, part, job);
        if (!environment) {
            if (environment.error().message.empty()) violated("an error has a message");
            continue;
        }
        if (!header) violated("a part that is read has a header");
        if (const auto sound = (*environment)->check(); !sound)
            violated("an environment keeps its rules", sound.error().text());
    }
    return 0;
}

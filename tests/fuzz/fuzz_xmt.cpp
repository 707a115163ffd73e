// XMT-A: what reads, writes, and reads back the same.

#include <cstdio>
#include <cstdlib>

#include "formats/mpeg4/xmt.hpp"

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
    const auto document = readXmt(text, "fuzz.xmt", job);
    if (!document) return 0;
    const auto written = writeXmt(*document, job);
    if (!written) {
        if (written.error().code != ErrorCode::unsupported) violated("what reads can be written");
        return 0;
    }
    const auto again = readXmt(*written, "again.xmt", job);
    if (!again) {
        std::fprintf(stderr, "%s\n%s\n", again.error().text().c_str(), written->c_str());
        violated("what is written reads");
    }
    // Characters that XML cannot hold are replaced once, and then stay.
    const auto twice = writeXmt(*again, job);
    if (!twice || *twice != *written) violated("writing again gives the same text");
    return 0;
}

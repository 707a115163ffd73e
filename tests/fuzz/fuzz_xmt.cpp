// XMT-A: what reads, writes, and reads back the same.

#include "formats/mpeg4/text/xmt.hpp"
#include "tests/fuzz/text_round_trip.hpp"

using namespace stx;
using namespace stx::mpeg4;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    Job job;
    job.limits.maxMemoryBytes = 64u << 20;
    const auto trip = textRoundTrip(text, readXmt, writeXmt, job);
    if (!trip) return 0;
    // Characters that XML cannot hold are replaced once, and then stay.
    const auto twice = writeXmt(trip->again, job);
    if (!twice || *twice != trip->written) violated("writing again gives the same text");
    return 0;
}

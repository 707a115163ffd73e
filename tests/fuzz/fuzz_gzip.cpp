// Packed models (.obj.gz, .ply.gz) and .spz: any bytes are refused or give no more than the limit
// allows, and what they give is the same after it was packed again.

#include "formats/files/deflate.hpp"
#include "tests/fuzz/violated.hpp"

using namespace stx;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Limits limits;
    limits.maxMemoryBytes = 1 << 16;
    const auto unpacked = gunzip({reinterpret_cast<const std::byte*>(data), size}, limits);
    if (!unpacked) {
        if (unpacked.error().message.empty()) violated("an error says what is wrong");
        return 0;
    }
    if (unpacked->size() > limits.maxMemoryBytes) violated("the limit holds");
    const auto again = gunzip(compressGzip(*unpacked, 1), limits);
    if (!again || *again != *unpacked) violated("packing and unpacking changes nothing");
    return 0;
}

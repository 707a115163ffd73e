// atlas.json: what is read can be written, and reads back the same.

#include <cstdlib>

#include "formats/atlas/atlas_json.hpp"

using namespace stx;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    const auto header = atlasFromJson(text, "fuzz", Limits());
    if (!header) return header.error().message.empty() ? (std::abort(), 0) : 0;
    const std::string written = atlasJson(*header);
    const auto again = atlasFromJson(written, "fuzz", Limits());
    if (!again || atlasJson(*again) != written) std::abort();
    return 0;
}

// Descriptors. Input: a byte that chooses OD frame, IOD or ES_Descriptor, then the bytes.

#include <array>

#include "formats/mpeg4/bifs/descriptors.hpp"
#include "tests/fuzz/violated.hpp"

using namespace stx;
using namespace stx::mpeg4;

namespace {

void frame(ByteSpan bytes) {
    constexpr std::array<std::uint32_t, 3> kMpod = {10, 11, 70000};
    std::vector<Mp4Deviation> deviations;
    const DescriptorContext context{kMpod, &deviations};
    const auto commands = decodeOdFrame(bytes, context);
    if (!commands) return;
    const auto referenceOf = [](std::uint32_t esId) -> std::uint32_t {
        return esId == 10 ? 1 : esId == 11 ? 2 : esId == 70000 ? 3 : 0;
    };
    const auto encoded = encodeOdFrame(*commands, referenceOf);
    if (!encoded) return;  // an id of 0, a stream that no track has
    const auto again = decodeOdFrame(*encoded, context);
    if (!again) violated("what is encoded can be decoded");
    const auto twice = encodeOdFrame(*again, referenceOf);
    if (!twice || *twice != *encoded) violated("encoding again gives the same bytes");
}

void initial(ByteSpan bytes) {
    const auto iod = decodeIod(bytes, {});
    if (!iod) return;
    const auto encoded = encodeIod(iod->iod, iod->trackIds);
    if (!encoded) return;
    const auto again = decodeIod(*encoded, {});
    if (!again || again->trackIds != iod->trackIds || again->iod.id != iod->iod.id ||
        again->iod.url != iod->iod.url)
        violated("an IOD reads back the same");
}

void stream(ByteSpan bytes) {
    const auto decoded = decodeEsDescriptor(bytes);
    if (!decoded) return;
    const auto encoded = encodeEsDescriptor(*decoded);
    if (!encoded) violated("a decoded ES_Descriptor can be encoded");
    const auto again = decodeEsDescriptor(*encoded);
    if (!again || again->decoderSpecificInfo != decoded->decoderSpecificInfo ||
        again->objectTypeIndication != decoded->objectTypeIndication ||
        again->url != decoded->url || again->ocrEsId != decoded->ocrEsId ||
        again->bufferSizeDB != decoded->bufferSizeDB)
        violated("an ES_Descriptor reads back the same");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    const ByteSpan bytes(reinterpret_cast<const std::byte*>(data) + 1, size - 1);
    switch (data[0] % 3) {
        case 0:
            frame(bytes);
            break;
        case 1:
            initial(bytes);
            break;
        default:
            stream(bytes);
            break;
    }
    return 0;
}

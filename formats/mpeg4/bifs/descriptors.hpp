#pragma once

#include <functional>
#include <span>
#include <vector>

#include "formats/mpeg4/scene/document.hpp"

/// Object descriptors and the descriptors in them (ISO/IEC 14496-1 7.2; file forms: 14496-14 3.1).
/// Errors carry `descriptor 0xNN at byte K` as their place, K counted from the start of the span.
namespace stx::mpeg4 {

/// What reading descriptors of a file needs to know about the file.
struct DescriptorContext {
    std::span<const std::uint32_t>
        mpod;  ///< tref/mpod of the OD track: ES_ID_Ref is 1-based into it
    /// Deviations are added here; may be null.
    std::vector<Mp4Deviation>* deviations = nullptr;
};

/// The commands of one OD access unit. Streams that came by reference have nothing but their esId
/// (= track_ID); an unknown reference is left out and recorded as a deviation.
[[nodiscard]] Result<std::vector<OdCommand>> decodeOdFrame(ByteSpan accessUnit,
                                                           const DescriptorContext& context);

/// The same commands in the file form. `referenceOf(esId)` is the 1-based place in tref/mpod.
/// Errors (invalidInput) on ids outside 1..1022 and on strings above 255 bytes.
[[nodiscard]] Result<Bytes> encodeOdFrame(
    const std::vector<OdCommand>& commands,
    const std::function<std::uint32_t(std::uint32_t esId)>& referenceOf);

/// The descriptor in `iods`, with the tracks it names (0x10 with ES_ID_Inc, or 0x02).
struct DecodedIod {
    InitialObjectDescriptor iod;
    std::vector<std::uint32_t> trackIds;
};
[[nodiscard]] Result<DecodedIod> decodeIod(ByteSpan bytes, const DescriptorContext& context);
[[nodiscard]] Result<Bytes> encodeIod(const InitialObjectDescriptor& iod,
                                      std::span<const std::uint32_t> trackIds);

/// The ES_Descriptor in `esds`: everything of a stream but its samples and timescale.
[[nodiscard]] Result<ElementaryStream> decodeEsDescriptor(ByteSpan bytes);
/// The file form, with ES_ID 0 and SLConfig 2.
[[nodiscard]] Result<Bytes> encodeEsDescriptor(const ElementaryStream& stream);

}  // namespace stx::mpeg4

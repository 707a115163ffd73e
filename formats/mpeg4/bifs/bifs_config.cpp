#include <algorithm>

#include "formats/mpeg4/bifs/bifs.hpp"
#include "formats/mpeg4/bifs/bit_stream.hpp"

namespace stx::mpeg4 {
namespace {

std::optional<BifsConfig> parse(ByteSpan bytes, int version) {
    BitReader in(bytes);
    BifsConfig config;
    config.version = version;
    if (version == 2) {
        config.use3DMeshCoding = in.flag();
        config.usePredictiveMFField = in.flag();
    }
    config.nodeIdBits = static_cast<int>(in.read(5));
    config.routeIdBits = static_cast<int>(in.read(5));
    if (version == 2) config.protoIdBits = static_cast<int>(in.read(5));
    config.isCommandStream = in.flag();
    if (config.isCommandStream) {
        config.pixelMetric = in.flag();
        config.hasSize = in.flag();
        if (config.hasSize) {
            config.pixelWidth = static_cast<int>(in.read(16));
            config.pixelHeight = static_cast<int>(in.read(16));
        }
    }
    if (in.failed() || in.left() >= 8) return {};
    return config;
}

}  // namespace

Result<BifsConfig> decodeBifsConfig(ByteSpan bytes, std::uint8_t objectTypeIndication) {
    const int stated = objectTypeIndication == oti::kSystemsV2 ? 2 : 1;
    for (const int version : {stated, 3 - stated})
        if (const auto config = parse(bytes, version)) {
            if (!config->isCommandStream)
                return fail(ErrorCode::unsupported,
                            "the BIFS stream is an animation stream, not a scene");
            return *config;
        }
    return fail(ErrorCode::invalidInput,
                "the BIFS decoder config has {} bytes, which fits neither version 1 nor version 2",
                bytes.size());
}

Bytes encodeBifsConfig(const BifsConfig& config) {
    BitWriter out;
    if (config.version == 2) {
        out.flag(config.use3DMeshCoding);
        out.flag(config.usePredictiveMFField);
    }
    out.write(static_cast<std::uint32_t>(config.nodeIdBits), 5);
    out.write(static_cast<std::uint32_t>(config.routeIdBits), 5);
    if (config.version == 2) out.write(static_cast<std::uint32_t>(config.protoIdBits), 5);
    out.flag(true);
    out.flag(config.pixelMetric);
    out.flag(config.hasSize);
    if (config.hasSize) {
        out.write(static_cast<std::uint32_t>(config.pixelWidth), 16);
        out.write(static_cast<std::uint32_t>(config.pixelHeight), 16);
    }
    return out.finish();
}

BifsConfig fitBifsConfig(BifsConfig config, const NodeIds& ids) {
    // All ones is NULL, so that the highest id (coded less one) must stay below it.
    config.nodeIdBits = std::max({config.nodeIdBits, 1, significantBits(ids.highestNode)});
    if (ids.highestRoute > 0)
        config.routeIdBits =
            std::max(config.routeIdBits, std::max(1, significantBits(ids.highestRoute - 1)));
    if (!ids.protos.empty()) {
        // PROTOs came with version 2.
        config.version = 2;
        config.protoIdBits = std::max({config.protoIdBits, 1, significantBits(ids.highestProto)});
    }
    return config;
}

}  // namespace stx::mpeg4

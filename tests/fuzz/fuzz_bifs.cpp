// BIFS access units. Input: a config in two bytes, then access units, each behind its size in a
// byte.

#include <set>

#include "formats/mpeg4/bifs/bifs.hpp"
#include "tests/fuzz/violated.hpp"
#include "tests/same_scenes.hpp"

using namespace stx;
using namespace stx::mpeg4;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size < 2) return 0;
    BifsConfig config;
    config.version = 1 + (data[0] >> 7);
    config.usePredictiveMFField = config.version == 2 && (data[0] >> 6 & 1) != 0;
    config.nodeIdBits = data[0] & 31;
    config.routeIdBits = data[1] & 31;
    config.protoIdBits = data[1] >> 5;
    Limits limits;
    limits.maxMemoryBytes = 64u << 20;

    BifsDecoder decoder(config, limits);
    std::vector<CommandFrame> frames;
    bool quantised = false;
    for (std::size_t at = 2; at < size;) {
        // The last access unit takes what is left.
        const std::size_t length =
            data[at] == 0 ? size - at - 1 : std::min<std::size_t>(data[at], size - at - 1);
        auto commands = decoder.decode({reinterpret_cast<const std::byte*>(data) + at + 1, length});
        if (!commands) {
            if (commands.error().where.rfind("bit ", 0) != 0)
                violated("an error has its bit", commands.error().text());
            break;
        }
        frames.push_back({frames.size(), std::move(*commands)});
        at += 1 + length;
    }
    if (frames.empty()) return 0;
    const auto look = [&](const NodePtr& node) { quantised |= node->is("QuantizationParameter"); };
    // PROTOs of one id get new ones, and names that were made of their ids follow.
    bool renumbered = false;
    std::set<std::uint32_t> protoIds;
    const std::function<void(const std::vector<ProtoPtr>&)> lookInto =
        [&](const std::vector<ProtoPtr>& protos) {
            for (const ProtoPtr& proto : protos) {
                renumbered |= !protoIds.insert(proto->id).second;
                for (const NodePtr& node : proto->body) forEachNode(node, look);
                lookInto(proto->protos);
            }
        };
    for (const CommandFrame& frame : frames)
        for (const Command& command : frame.commands) {
            forEachNode(command, look);
            if (const auto* scene = std::get_if<ReplaceScene>(&command)) lookInto(scene->protos);
        }
    (void)composeScene(frames);

    const NodeIds ids = assignNodeIds(frames);
    for (const BifsStyle style : {BifsStyle::maskAndVector(), BifsStyle::shortest()}) {
        const BifsConfig fitted = fitBifsConfig(config, ids);
        if (fitted.nodeIdBits > 31 || fitted.routeIdBits > 31) return 0;
        BifsEncoder encoder(fitted, style, ids);
        BifsDecoder second(fitted, limits);
        std::vector<CommandFrame> again;
        for (const CommandFrame& frame : frames) {
            const auto bytes = encoder.encode(frame.commands);
            if (!bytes) return 0;  // a command whose target is replaced by then, for one
            auto commands = second.decode(*bytes);
            if (!commands) violated("what is encoded can be decoded", commands.error().text());
            again.push_back({frame.time, std::move(*commands)});
        }
        if (!quantised && !renumbered && !sameFrames(frames, again))
            violated("what is encoded decodes to the same");
    }
    return 0;
}

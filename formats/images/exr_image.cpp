#include "formats/images/exr_image.hpp"

#include <algorithm>
#include <cstring>
#include <optional>

#include "formats/exr/exr_file.hpp"

namespace stx {
namespace {

/// What the names of a part's colours begin with: nothing, or those of one layer
/// (`ViewLayer.Combined.`), which is the picture as Blender names it, or else has the shortest
/// name.
std::optional<std::string> colourLayer(const ExrPart& part) {
    for (const char* name : {"R", "G", "B", "Y"})
        if (part.channel(name)) return "";
    std::optional<std::string> layer;
    for (const ExrChannel& channel : part.channels) {
        if (!channel.name.ends_with(".R")) continue;
        const std::string found = channel.name.substr(0, channel.name.size() - 1);
        if (!part.channel(found + "G") || !part.channel(found + "B")) continue;
        if (found.ends_with(".Combined.")) return found;
        if (!layer || found.size() < layer->size()) layer = found;
    }
    return layer;
}

bool hasColours(const ExrPart& part) {
    return colourLayer(part).has_value();
}

bool hasDepth(const ExrPart& part) {
    std::vector<std::string> names;
    for (const ExrChannel& channel : part.channels) names.push_back(channel.name);
    return depthChannelOf(names) >= 0;
}

/// The channels of a part in the order of the picture, and what they are called there.
struct Named {
    std::string channel, name;
};
std::vector<Named> channelsOf(const ExrPart& part) {
    std::vector<Named> out;
    const std::string layer = colourLayer(part).value_or("");
    for (const char* name : {"R", "G", "B", "Y", "A"})
        if (part.channel(layer + name)) out.push_back({layer + name, name});
    for (const auto& channel : part.channels)
        if (std::ranges::find(out, channel.name, &Named::channel) == out.end())
            out.push_back({channel.name, channel.name});
    return out;
}

}  // namespace

bool isExr(ByteSpan bytes) {
    return bytes.size() >= 4 && std::memcmp(bytes.data(), "\x76\x2f\x31\x01", 4) == 0;
}

int depthChannelOf(std::span<const std::string> names) {
    const auto find = [&](auto matches) {
        const auto it = std::ranges::find_if(names, matches);
        return it == names.end() ? -1 : static_cast<int>(it - names.begin());
    };
    int at = find([](const std::string& n) { return n == "Z"; });
    // N.Z beside N.X is a coordinate.
    if (at < 0)
        at = find([&](const std::string& n) {
            return n.ends_with(".Z") &&
                   std::ranges::find(names, n.substr(0, n.size() - 1) + "X") == names.end();
        });
    for (const char* other : {"depth", "Depth", "V", "Depth.V"})
        if (at < 0) at = find([&](const std::string& n) { return n == other; });
    return at;
}

Result<DecodedImage> decodeExr(ByteSpan bytes, std::string_view name, const Limits& limits,
                               bool depth) {
    STX_TRY(const auto reader, ExrReader::open(bytes, name, limits));
    const auto& parts = reader.parts();
    const auto wanted = std::ranges::find_if(parts, depth ? hasDepth : hasColours);
    const int index = wanted == parts.end() ? 0 : static_cast<int>(wanted - parts.begin());
    const ExrPart& part = parts[static_cast<std::size_t>(index)];
    DecodedImage image;
    image.width = part.width;
    image.height = part.height;
    image.channels = static_cast<int>(part.channels.size());
    image.originX = part.originX;
    image.originY = part.originY;
    image.displayWidth = part.displayWidth;
    image.displayHeight = part.displayHeight;
    image.linear = true;
    image.rec709FromRgb = part.rec709FromRgb;
    image.coloursNote = part.primariesNote;
    constexpr std::size_t kMaxChannels = 1024;
    if (part.channels.empty() || part.channels.size() > kMaxChannels)
        return failAt(reader.where(), ErrorCode::invalidInput,
                      "it has {} channels; 1 to {} are read", part.channels.size(), kMaxChannels);
    // One channel of any name is grey, two are grey with another.
    if (!depth && wanted == parts.end() && image.channels > 2)
        return failAt(reader.where(), ErrorCode::invalidInput,
                      "there are no channels R, G, B or Y in it");
    const auto channels = channelsOf(part);
    for (const Named& channel : channels) {
        image.channelNames.push_back(channel.name);
        image.premultiplied = image.premultiplied || channel.name == "A";
    }
    image.pictures = std::max<int>(1, std::ranges::count_if(parts, hasColours));
    const auto pixels = static_cast<std::uint64_t>(part.width) * part.height;
    STX_CHECK(
        within(reader.where(),
               limits.checkAllocation(pixels, part.channels.size() * sizeof(float), "the image")));
    STX_CHECK(reader.checkPlausible(index));
    auto& values = image.values.emplace<2>(pixels * part.channels.size());
    std::vector<ExrPixels> targets;
    for (std::size_t i = 0; i < channels.size(); ++i)
        targets.push_back({channels[i].channel, values.data() + i, channels.size()});
    STX_CHECK(reader.readPart(index, targets));
    return image;
}

}  // namespace stx

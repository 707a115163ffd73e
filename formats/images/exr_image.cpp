#include "formats/images/exr_image.hpp"

#include <algorithm>
#include <cstring>

#include "formats/exr/exr_file.hpp"

namespace stx {

bool isExr(ByteSpan bytes) {
    return bytes.size() >= 4 && std::memcmp(bytes.data(), "\x76\x2f\x31\x01", 4) == 0;
}

Result<DecodedImage> decodeExr(ByteSpan bytes, std::string_view name, const Limits& limits) {
    STX_TRY(const auto reader, ExrReader::open(bytes, name, limits));
    const ExrPart& part = reader.parts()[0];
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
    image.premultiplied = part.channel("A") != nullptr;
    constexpr std::size_t kMaxChannels = 1024;
    if (part.channels.empty() || part.channels.size() > kMaxChannels)
        return failAt(reader.where(), ErrorCode::invalidInput,
                      "it has {} channels; 1 to {} are read", part.channels.size(), kMaxChannels);
    for (const char* first : {"R", "G", "B", "A"}) {
        if (part.channel(first)) image.channelNames.emplace_back(first);
    }
    for (const auto& channel : part.channels) {
        const auto& known = image.channelNames;
        if (std::find(known.begin(), known.end(), channel.name) == known.end())
            image.channelNames.push_back(channel.name);
    }
    const auto isPicture = [](const ExrPart& p) { return p.channel("R") || p.channel("Y"); };
    image.pictures = std::max<int>(1, std::ranges::count_if(reader.parts(), isPicture));
    const auto pixels = static_cast<std::uint64_t>(part.width) * part.height;
    STX_CHECK(
        within(reader.where(),
               limits.checkAllocation(pixels, part.channels.size() * sizeof(float), "the image")));
    STX_CHECK(reader.checkPlausible(0));
    auto& values = image.values.emplace<2>(pixels * part.channels.size());
    std::vector<ExrPixels> targets;
    for (std::size_t i = 0; i < image.channelNames.size(); ++i)
        targets.push_back({image.channelNames[i], values.data() + i, image.channelNames.size()});
    STX_CHECK(reader.readPart(0, targets));
    return image;
}

}  // namespace stx

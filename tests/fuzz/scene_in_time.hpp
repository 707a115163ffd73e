#pragma once

#include <cstdint>
#include <vector>

#include "formats/mpeg4/mapping/scene_sequence.hpp"
#include "tests/fuzz/violated.hpp"

namespace stx {

/// No image library: any picture is two grey pixels.
inline Result<DecodedImage> tinyPicture(ByteSpan, std::string_view, const Limits&) {
    DecodedImage image;
    image.width = 2;
    image.height = image.channels = 1;
    image.values = std::vector<std::uint8_t>{0, 200};
    image.channelNames = {"Y"};
    return image;
}

/// The first, the middle and the last moment of a presentation, whatever its clocks say.
inline void sceneInTime(mpeg4::Document document, Job& job) {
    mpeg4::SceneReadOptions options;
    options.decode = tinyPicture;
    const auto sequence = mpeg4::sequenceFromScene(std::move(document), options, job);
    if (!sequence) {
        if (sequence.error().message.empty()) violated("an error has a message");
        return;
    }
    const Timeline& line = (*sequence)->timeline();
    if (const auto sound = line.check(); !sound)
        violated("a timeline keeps its rules", sound.error().text());
    const std::size_t count = line.count();
    for (const std::size_t index : {std::size_t{0}, count / 2, count - 1}) {
        const auto frame = (*sequence)->frame(index, job);
        if (frame && !frame->check())
            violated("a frame keeps its rules", frame->check().error().text());
        if (count == 1) break;
    }
}

}  // namespace stx

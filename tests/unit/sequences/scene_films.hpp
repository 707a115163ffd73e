#pragma once

#include <gtest/gtest.h>

#include "formats/images/images.hpp"
#include "formats/mpeg4/mapping/media_clock.hpp"
#include "formats/mpeg4/mapping/scene_sequence.hpp"
#include "formats/mpeg4/text/bt.hpp"

/// Small scenes that move: by clocks, by commands, by a film of pictures.
namespace scenes {

using namespace stx;
using namespace stx::mpeg4;

/// Seconds of the film and what it shows then.
using Shown = std::vector<std::pair<double, double>>;

inline Document readText(const std::string& text) {
    Job job;
    auto document = readBt(text, "test.bt", job);
    if (!document) ADD_FAILURE() << document.error().text() << "\n" << text;
    return document ? std::move(*document) : Document();
}

/// A view at x -1 that a clock moves from 0 to 4 in one cycle.
inline Document moved(const std::string& clock, const std::string& commands = "",
                      const std::string& more = "") {
    return readText(R"(Group { children [ DEF TR Transform { translation -1 0 0 children [
DepthImage { orthographic FALSE position 0 0 0 diTexture SimpleTexture {
    depth PixelTexture { image 1 1 1 200 } } } ] }
DEF TS TimeSensor { )" +
                    clock + R"( }
DEF PI PositionInterpolator { key [0 1] keyValue [0 0 0, 4 0 0] } )" +
                    more + R"( ] }
ROUTE TS.fraction_changed TO PI.set_fraction
DEF RR ROUTE PI.value_changed TO TR.translation
)" + commands);
}

/// A stream of pictures of one grey each: `greys` in turn, half a second long.
inline ElementaryStream pictures(const std::vector<std::uint8_t>& greys) {
    ElementaryStream stream;
    stream.objectTypeIndication = oti::kPng;
    stream.streamType = StreamType::visual;
    for (const std::uint8_t grey : greys) {
        const std::uint8_t rgb[] = {grey, grey, grey};
        auto png = encodePng(1, 1, 3, 8, rgb, true);
        if (!png) ADD_FAILURE() << png.error().text();
        Sample sample;
        sample.data = ByteRange::of(std::move(*png));
        sample.time = 500 * stream.samples.size();
        sample.duration = 500;
        stream.samples.push_back(sample);
    }
    return stream;
}

inline void addStream(Document& document, double time, ElementaryStream stream) {
    OdFrame frame;
    frame.time = ticksAt(time, document.odStream.timescale);
    ObjectDescriptor descriptor;
    descriptor.id = 10;
    descriptor.streams = {std::move(stream)};
    frame.commands.push_back(UpdateObjectDescriptors{{descriptor}});
    document.odFrames.push_back(frame);
}

/// A view whose colours are a film of six pictures: grey 0, 40, ... 200.
inline Document film(const std::string& movie, const std::string& commands = "") {
    Document document = readText(R"(Group { children [ DEF TR Transform { children [
DepthImage { orthographic FALSE position 0 0 0 diTexture SimpleTexture {
    depth PixelTexture { image 1 1 1 200 } texture DEF MT MovieTexture { url [od:10] )" +
                                 movie + R"( } } } ] } ] }
)" + commands);
    addStream(document, 0, pictures({0, 40, 80, 120, 160, 200}));
    return document;
}

inline std::unique_ptr<Sequence> opened(Document document, const SceneReadOptions& options = {}) {
    Job job;
    auto sequence = sequenceFromScene(std::move(document), options, job);
    if (!sequence) ADD_FAILURE() << sequence.error().text();
    return sequence ? std::move(*sequence) : nullptr;
}

inline Bundle frameAt(Sequence& sequence, double time) {
    Job job;
    auto frame = sequence.frame(sequence.timeline().frameAt(time), job);
    if (!frame) ADD_FAILURE() << frame.error().text();
    return frame ? std::move(*frame) : Bundle();
}

/// Expects the view at some x; in any order.
inline void expectPlaces(Document document, const Shown& shown, double tolerance = 1e-5) {
    const auto sequence = opened(std::move(document));
    ASSERT_TRUE(sequence);
    const auto expect = [&](const std::pair<double, double>& at) {
        const Bundle frame = frameAt(*sequence, at.first);
        ASSERT_EQ(frame.views.size(), 1u);
        EXPECT_NEAR(frame.views[0].camera.position.x, at.second, tolerance) << at.first << " s";
    };
    for (const auto& at : shown) expect(at);
    for (auto at = shown.rbegin(); at != shown.rend(); ++at) expect(*at);
}

/// Expects a picture of film() by its number.
inline void expectPictures(Document document, const Shown& shown) {
    const auto sequence = opened(std::move(document));
    ASSERT_TRUE(sequence);
    for (const auto& [time, number] : shown) {
        const Bundle frame = frameAt(*sequence, time);
        ASSERT_EQ(frame.views.size(), 1u);
        EXPECT_EQ(frame.views[0].texture.rgba8()->at(0, 0).r, 40 * number) << time << " s";
    }
}

}  // namespace scenes

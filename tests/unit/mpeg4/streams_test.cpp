// Streams that are no images, and when streams begin: what a file says is what every form keeps.

#include <gtest/gtest.h>

#include "formats/files/byte_io.hpp"
#include "tests/unit/mpeg4/core_fixtures.hpp"
#include "tests/unit/mpeg4/mapping_fixtures.hpp"
#include "tests/unit/mpeg4/round_trips.hpp"

namespace stx::mpeg4 {
namespace {

namespace fs = std::filesystem;

std::vector<ElementaryStream> streamsOf(const Document& document) {
    std::vector<ElementaryStream> streams;
    for (const ObjectDescriptor* od : document.objectDescriptors())
        for (const ElementaryStream& stream : od->streams) streams.push_back(stream);
    return streams;
}

Bytes bytesOf(const Sample& sample) {
    auto bytes = sample.data.load(Limits());
    EXPECT_TRUE(bytes);
    return bytes ? *bytes : Bytes();
}

void expectSameStreams(const Document& a, const Document& b) {
    const auto before = streamsOf(a), after = streamsOf(b);
    ASSERT_EQ(before.size(), after.size());
    for (std::size_t i = 0; i < before.size(); ++i) {
        SCOPED_TRACE(fmt::format("stream {}", i));
        EXPECT_EQ(before[i].objectTypeIndication, after[i].objectTypeIndication);
        EXPECT_EQ(before[i].streamType, after[i].streamType);
        EXPECT_EQ(hex(before[i].decoderSpecificInfo), hex(after[i].decoderSpecificInfo));
        EXPECT_EQ(hex(before[i].sampleEntry), hex(after[i].sampleEntry));
        EXPECT_EQ(before[i].handler, after[i].handler);
        EXPECT_EQ(before[i].timescale, after[i].timescale);
        EXPECT_EQ(before[i].edits.edits.size(), after[i].edits.edits.size());
        ASSERT_EQ(before[i].samples.size(), after[i].samples.size());
        for (std::size_t k = 0; k < before[i].samples.size(); ++k) {
            const Sample& x = before[i].samples[k];
            const Sample& y = after[i].samples[k];
            EXPECT_EQ(bytesOf(x), bytesOf(y));
            EXPECT_EQ(x.time, y.time);
            EXPECT_EQ(x.duration, y.duration);
            EXPECT_EQ(x.compositionOffset, y.compositionOffset);
            EXPECT_EQ(x.sync, y.sync);
        }
    }
    for (std::size_t i = 0; i < std::min(a.frames.size(), b.frames.size()); ++i) {
        EXPECT_EQ(a.frames[i].time, b.frames[i].time);
        EXPECT_EQ(a.frames[i].randomAccess, b.frames[i].randomAccess);
    }
    EXPECT_EQ(a.frames.size(), b.frames.size());
}

/// Writes a document in each form, reads it and compares the streams.
void expectStreamsKept(const Document& document) {
    const TemporaryFolder folder("streams");
    Job job;
    for (const char* name : {"a.mp4", "a.bt", "a.xmt"}) {
        SCOPED_TRACE(name);
        const auto written = writeMpeg4(document, folder / name, job);
        ASSERT_TRUE(written) << written.error().text();
        const auto back = readMpeg4(folder / name, job);
        ASSERT_TRUE(back) << back.error().text();
        expectSameStreams(document, *back);
        // And what the form became goes into the same .mp4.
        const auto again = writeMpeg4(*back, folder / "b.mp4", job);
        ASSERT_TRUE(again) << again.error().text();
        EXPECT_EQ(bytesOfFile(folder / "b.mp4"), bytesOfFile(folder / "a.mp4"));
    }
}

class MotionFile : public testing::TestWithParam<const char*> {};

TEST_P(MotionFile, IsTheSameInEveryForm) {
    REQUIRE_SHARED(path, std::string("reference/motion/") + GetParam());
    Job job;
    const auto document = readMpeg4(path, job);
    ASSERT_TRUE(document) << document.error().text();
    ASSERT_EQ(streamsOf(*document).size(), 2u);
    EXPECT_GT(streamsOf(*document)[0].samples.size(), 1u);
    expectStreamsKept(*document);
}
INSTANTIATE_TEST_SUITE_P(All, MotionFile,
                         testing::Values("avc.mp4", "hevc.mp4", "m4v.mp4", "imgseq.mp4"));

/// A scene with one view and its images, and what the object descriptors hold.
Document smallScene() {
    Bundle bundle;
    bundle.views = {makeView(8, 6, 8, 1)};
    return sceneOf(bundle);
}
std::vector<ObjectDescriptor>& descriptorsOf(Document& document) {
    return std::get<UpdateObjectDescriptors>(document.odFrames.at(0).commands.at(0)).descriptors;
}

TEST(Streams, AnEntryThatNobodyKnowsPassesThrough) {
    Document document = smallScene();
    ElementaryStream stream;
    ByteWriter entry;
    entry.u32(28);
    entry.text("wxyz");
    entry.zeros(6);
    entry.u16(1);
    entry.text("some config.");
    stream.sampleEntry = entry.take();
    stream.handler = "meta";
    stream.timescale = 90000;
    for (int i = 0; i < 3; ++i) {
        Sample sample;
        sample.data = ByteRange::of(Bytes(5 + static_cast<std::size_t>(i), std::byte(i)));
        sample.time = 3000ull * static_cast<unsigned>(i * i);
        sample.duration = i < 2 ? 3000u * static_cast<unsigned>(2 * i + 1) : 7u;
        sample.compositionOffset = i == 1 ? 500 : 0;
        sample.sync = i != 1;
        stream.samples.push_back(sample);
    }
    descriptorsOf(document).push_back({77, "", {stream}});
    const Document read = throughMp4(document);
    const auto streams = streamsOf(read);
    ASSERT_EQ(streams.size(), 3u);
    EXPECT_EQ(hex(streams[2].sampleEntry), hex(stream.sampleEntry));
    EXPECT_EQ(streams[2].handler, "meta");
    EXPECT_FALSE(streams[2].samples[1].sync);
    expectStreamsKept(read);
}

TEST(Streams, WhatIsNoPictureHasNoSize) {
    Document document = smallScene();
    ByteWriter png;  // of more pixels than a track can say
    png.u64(0x89504E470D0A1A0Aull);
    for (const std::uint32_t value : {13u, 0x49484452u, 2u, 70000u, 0x08020000u}) png.u32(value);
    ElementaryStream stream;
    stream.objectTypeIndication = 0x40;
    stream.streamType = StreamType::audio;
    stream.samples.resize(1);
    stream.samples[0].data = ByteRange::of(png.take());
    descriptorsOf(document).push_back({77, "", {stream}});
    expectStreamsKept(throughMp4(document));
}

/// A command that gives object descriptor 10 a stream of these bytes.
UpdateObjectDescriptors tenOf(std::uint32_t esId, const ByteRange& data) {
    ElementaryStream stream;
    stream.esId = esId;
    stream.objectTypeIndication = oti::kPng;
    stream.streamType = StreamType::visual;
    Sample sample;
    sample.data = data;
    stream.samples = {sample};
    return {{{10, "", {stream}}}};
}

TEST(Streams, AnEsIdThatComesAgainWithOtherBytesIsAnotherTrack) {
    const ByteRange red = ByteRange::of(Bytes(9, std::byte{1}));
    const ByteRange redAgain = ByteRange::of(Bytes(9, std::byte{1}));
    const ByteRange blue = ByteRange::of(Bytes(9, std::byte{2}));
    Document document = smallScene();
    std::uint64_t time = 0;
    for (const ByteRange& data : {red, blue, redAgain, blue, blue})
        document.odFrames.push_back({time += 1000, {tenOf(70, data)}});
    document.odFrames.push_back({time += 1000, {RemoveStreams{10, {70}}}});
    const Document read = throughMp4(document);
    std::vector<std::uint32_t> tracks;
    std::vector<std::byte> first;
    for (std::uint64_t at = 1000; at <= 5000; at += 1000)
        for (const ObjectDescriptor* od : read.objectDescriptors(at)) {
            if (od->id != 10) continue;
            tracks.push_back(od->streams.at(0).esId);
            first.push_back(bytesOf(od->streams.at(0).samples.at(0)).at(0));
        }
    using std::byte;
    EXPECT_EQ(first, (std::vector{byte{1}, byte{2}, byte{1}, byte{2}, byte{2}}));
    ASSERT_EQ(tracks.size(), 5u);
    EXPECT_EQ(tracks, (std::vector{70u, tracks[1], 70u, tracks[1], tracks[1]}));
    EXPECT_NE(tracks[1], 70u);
    const auto& removal = std::get<RemoveStreams>(read.odFrames.back().commands.at(0));
    EXPECT_EQ(removal.esIds, std::vector{tracks[1]});
    Document kept = read;  // but for what texts do not have
    kept.odFrames.pop_back();
    expectStreamsKept(kept);
}

TEST(Streams, AStartIsADelayInTheFileAndAStartTimeInTexts) {
    for (const std::uint64_t start : {500u, 333u}) {
        Document document = smallScene();
        descriptorsOf(document)[0].streams[0].samples[0].time = start;
        const Document read = throughMp4(document);
        EXPECT_EQ(streamsOf(read).at(0).samples.at(0).time, start);
        EXPECT_TRUE(streamsOf(read).at(0).edits.edits.empty());
        EXPECT_EQ(streamsOf(read).at(1).samples.at(0).time, 0u);
        expectStreamsKept(read);
        // An .mp4 has it as an empty edit.
        Job job;
        const auto bytes = writeMp4(document, job);
        ASSERT_TRUE(bytes);
        EXPECT_NE(hex(*bytes).find("65 6c 73 74"), std::string::npos) << "elst";
    }
}

TEST(Streams, ASceneThatBeginsLateKeepsItsTime) {
    Document document = smallScene();
    document.frames[0].time = 500;
    document.odFrames[0].time = 250;
    const Document read = throughMp4(document);
    EXPECT_EQ(read.frames.at(0).time, 500u);
    EXPECT_EQ(read.odFrames.at(0).time, 250u);
    expectStreamsKept(read);
    EXPECT_EQ(bundleOf(read).views.size(), 1u);
}

TEST(Streams, EditsThatAreNoDelayAreKept) {
    Document document = smallScene();
    ElementaryStream& stream = descriptorsOf(document)[0].streams[0];
    stream.edits = {1000, {{250, -1, 0x10000}, {333, 100, 0x10000}, {400, 0, 0x8000}}};
    const Document read = throughMp4(document);
    const EditList edits = streamsOf(read).at(0).edits;
    ASSERT_EQ(edits.edits.size(), 3u);
    EXPECT_EQ(static_cast<double>(edits.edits[1].duration) / edits.timescale, 0.333);
    EXPECT_EQ(edits.edits[0].mediaTime, -1);
    EXPECT_EQ(edits.edits[1].mediaTime, 100);
    EXPECT_EQ(edits.edits[2].rate, 0x8000u);
    expectStreamsKept(read);
}

TEST(Streams, EditsOfTheSceneAreInTheTimesOfItsCommands) {
    Document document = smallScene();
    const NodePtr root = std::get<ReplaceScene>(document.frames[0].commands[0]).root;
    for (const std::uint64_t time : {1000u, 2000u})
        document.frames.push_back({time, {InsertNode{root, {}, makeNode("Viewpoint")}}});
    document.odFrames.push_back({1000, {RemoveObjectDescriptors{{21}}}});
    const auto timesWith = [&](const std::vector<Edit>& edits, std::size_t notes) {
        document.sceneStream.edits = document.odStream.edits = {1000, edits};
        Job job;
        const auto bytes = writeMp4(document, job, {});
        EXPECT_TRUE(bytes) << bytes.error().text();
        const auto read = readMp4(ByteSource::fromBytes(*bytes), job);
        EXPECT_TRUE(read) << read.error().text();
        std::vector<std::uint64_t> times;
        for (const CommandFrame& frame : read->frames) times.push_back(frame.time);
        for (const OdFrame& frame : read->odFrames) times.push_back(frame.time);
        EXPECT_EQ(read->sceneStream.edits.edits.empty(), notes == 0);
        const auto said = job.takeNotes();
        EXPECT_EQ(said.size(), notes) << fmt::format("{}", fmt::join(said, "\n"));
        return times;
    };
    using Times = std::vector<std::uint64_t>;
    const Times plain = {0, 1000, 2000, 0, 1000};
    EXPECT_EQ(timesWith({{500, -1, 0x10000}, {9000, 0, 0x10000}}, 0),
              (Times{500, 1500, 2500, 500, 1500}));
    // What comes before an edit has happened when it begins.
    EXPECT_EQ(timesWith({{9000, 1000, 0x10000}}, 0), (Times{0, 0, 1000, 0, 0}));
    EXPECT_EQ(timesWith({{0, 1000, 0x10000}}, 0), (Times{0, 0, 1000, 0, 0}));
    EXPECT_EQ(timesWith({{500, -1, 0x10000}, {9000, 1000, 0x10000}}, 0),
              (Times{500, 500, 1500, 500, 500}));
    // In another order, at another speed, or without a command.
    EXPECT_EQ(timesWith({{1000, 2000, 0x10000}, {9000, 0, 0x10000}}, 2), plain);
    EXPECT_EQ(timesWith({{9000, 0, 0x8000}}, 2), plain);
    EXPECT_EQ(timesWith({{600, 0, 0x10000}}, 2), plain);
}

TEST(Streams, OnlyPlacesToBeginAreSyncSamples) {
    Document document = smallScene();
    const NodePtr root = std::get<ReplaceScene>(document.frames[0].commands[0]).root;
    for (int i = 1; i < 4; ++i) {
        document.frames.push_back(
            {500ull * static_cast<unsigned>(i), {InsertNode{root, {}, makeNode("Viewpoint")}}});
        document.odFrames.push_back(
            {500ull * static_cast<unsigned>(i), {RemoveObjectDescriptors{{20 + i}}}});
    }
    document.frames[2].randomAccess = true;
    document.odFrames[3].randomAccess = true;
    const Document read = throughMp4(document);
    ASSERT_EQ(read.sceneStream.samples.size(), 4u);
    ASSERT_EQ(read.odStream.samples.size(), 4u);
    for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_EQ(read.sceneStream.samples[i].sync, i == 0 || i == 2);
        EXPECT_EQ(read.odStream.samples[i].sync, i == 0 || i == 3);
        EXPECT_EQ(read.frames[i].randomAccess, i == 2);
        EXPECT_EQ(read.odFrames[i].randomAccess, i == 3);
    }
    expectStreamsKept(read);
}

}  // namespace
}  // namespace stx::mpeg4

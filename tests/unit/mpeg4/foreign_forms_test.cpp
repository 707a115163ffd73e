// What other programs write and this one does not: nothing of it loses a file.

#include <algorithm>
#include <span>

#include <gtest/gtest.h>

#include "formats/files/files.hpp"
#include "tests/same_scenes.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/mpeg4/round_trips.hpp"

namespace stx::mpeg4 {
namespace {

bool holdsText(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

Document readForeignXmt(const std::string& scene) {
    Job job;
    auto document = readXmt(
        "<XMT-A><Header/><Body><Replace><Scene>" + scene + "</Scene></Replace></Body></XMT-A>",
        "a.xmt", job);
    if (!document) ADD_FAILURE() << document.error().text();
    return document ? std::move(*document) : Document();
}

std::string foreignXmtOf(const Document& document) {
    Job job;
    auto text = writeXmt(document, job);
    if (!text) ADD_FAILURE() << text.error().text();
    return text.value_or("");
}

TEST(SecondSceneStream, IsReadWithTheFirst) {
    Document document = mustReadBt(R"(
Group { children [ DEF N0 PointLight { } ] }
AT 0 { UPDATE OD [ ObjectDescriptor { objectDescriptorID 5 } ] }
)");
    // As a stream of an object descriptor; then the IOD names it in place of the descriptors'.
    const NodeIds ids = assignNodeIds(document.frames);
    const BifsConfig config = fitBifsConfig(document.bifsConfig, ids);
    const NodePtr light =
        std::get<ReplaceScene>(document.frames[0].commands[0]).root->get<NodeList>("children")[0];
    BifsEncoder encoder(config, {}, ids);
    ASSERT_TRUE(encoder.encode(document.frames[0].commands));
    auto bytes = encoder.encode({ReplaceField{light, light->info->find("on"), false}});
    ASSERT_TRUE(bytes) << bytes.error().text();
    ElementaryStream stream;
    stream.esId = 77;
    stream.streamType = StreamType::sceneDescription;
    stream.objectTypeIndication = oti::kSystemsV1;
    stream.decoderSpecificInfo = encodeBifsConfig(config);
    stream.timescale = 500;
    Sample sample;
    sample.data = ByteRange::of(std::move(*bytes));
    sample.time = 750;
    stream.samples = {sample};
    std::get<UpdateObjectDescriptors>(document.odFrames[0].commands[0]).descriptors[0].streams = {
        stream};
    Job job;
    auto file = writeMp4(document, job, {});
    ASSERT_TRUE(file) << file.error().text();
    std::string all(reinterpret_cast<const char*>(file->data()), file->size());
    const auto iods = all.find("iods");
    const auto entry = all.rfind(std::string("\x0e\x04\0\0", 4), iods + 40);
    ASSERT_NE(entry, std::string::npos);
    all[entry + 4] = 0;
    all[entry + 5] = 77;
    const auto* first = reinterpret_cast<const std::byte*>(all.data());
    const auto back = readMp4(ByteSource::fromBytes(Bytes(first, first + all.size())), job);
    ASSERT_TRUE(back) << back.error().text();
    ASSERT_EQ(back->frames.size(), 2u);
    EXPECT_EQ(back->frames[1].time, 1500u);
    EXPECT_TRUE(std::holds_alternative<ReplaceField>(back->frames[1].commands.at(0)));
    const auto notes = job.takeNotes();
    EXPECT_TRUE(std::ranges::any_of(
        notes, [](const std::string& note) { return holdsText(note, "is read with track"); }));
}

TEST(Scripts, WithNamesThatNoneCanHaveAreReadWithOthers) {
    Document document = mustReadBt("Group { children [ DEF N0 Script { } ] }");
    const NodePtr script =
        std::get<ReplaceScene>(document.frames[0].commands[0]).root->get<NodeList>("children")[0];
    FieldInfo field;
    field.kind = FieldKind::eventIn;
    field.name = "odd name!";
    field.type = FieldType::SFBool;
    ASSERT_TRUE(addScriptField(*script, field, std::nullopt));
    script->set("url", std::vector{ScriptText{"javascript: function f(v) { g(v); }"}});
    Job job;
    const auto bytes = writeMp4(document, job, {});
    ASSERT_TRUE(bytes) << bytes.error().text();
    const auto back = readMp4(ByteSource::fromBytes(*bytes), job);
    ASSERT_TRUE(back) << back.error().text();
    const NodePtr read =
        std::get<ReplaceScene>(back->frames[0].commands[0]).root->get<NodeList>("children")[0];
    EXPECT_GE(read->info->find("odd_name_"), 0);
    EXPECT_EQ(job.takeNotes().size(), 1u);
    EXPECT_TRUE(holdsText(btOf(*back), "odd_name_"));
}

TEST(Scripts, StandInXmtWithoutQuotes) {
    const Document document = readForeignXmt(
        "<Group><children><Script url=\"javascript: function f(v) { return 1; }\"/>"
        "</children></Group>");
    const NodePtr script =
        std::get<ReplaceScene>(document.frames[0].commands[0]).root->get<NodeList>("children")[0];
    ASSERT_EQ(script->get<std::vector<ScriptText>>("url").size(), 1u);
    EXPECT_TRUE(holdsText(script->get<std::vector<ScriptText>>("url")[0].text, "return 1; }"));
}

TEST(BitWrapper, BuffersAreBase64InTexts) {
    Document document = mustReadBt("Group { children [ BitWrapper { } ] }");
    const NodePtr wrapper =
        std::get<ReplaceScene>(document.frames[0].commands[0]).root->get<NodeList>("children")[0];
    std::string bytes;
    for (int i = 0; i < 256; ++i) bytes += static_cast<char>(i);
    wrapper->set("buffer", bytes);
    EXPECT_TRUE(holdsText(btOf(document), "\"data:application/octet-string;base64,AAECAw"));
    EXPECT_TRUE(holdsText(foreignXmtOf(document), "\"data:application/octet-string;base64,AAECAw"));
    EXPECT_TRUE(sameFrames(document.frames, mustReadBt(btOf(document)).frames, {.ids = false}));
    EXPECT_TRUE(sameFrames(document.frames, throughXmt(document).frames, {.ids = false}));
    EXPECT_TRUE(
        holdsText(btErrorOf("Group { children [ BitWrapper { buffer \"data:a;base64,?\" } ] }"),
                  "expected base64"));
}

TEST(XmtProtos, HaveElementsForNodesThatAreNone) {
    const Document document = mustReadBt(
        "PROTO P [ field SFNode one NULL field MFNode more [] ] { Group { } }"
        " Group { children [ P { } ] }");
    const std::string text = foreignXmtOf(document);
    EXPECT_TRUE(holdsText(text, "<NULL/>")) << text;
    EXPECT_TRUE(holdsText(text, "<nodes>")) << text;
    EXPECT_TRUE(sameFrames(document.frames, throughXmt(document).frames, {.ids = false}));
}

TEST(XmtDescriptors, OfTheStartAreAPlaceToBegin) {
    const Document document =
        mustReadBt("Group { } AT 0 { UPDATE OD [ ObjectDescriptor { objectDescriptorID 5 } ] }");
    EXPECT_TRUE(holdsText(foreignXmtOf(document), "<par begin=\"0\" isRAP=\"yes\">"));
    const Document back = throughXmt(document);
    ASSERT_EQ(back.odFrames.size(), 1u);
    EXPECT_FALSE(back.odFrames[0].randomAccess);
}

Result<Document> readXmtBody(const std::string& commands) {
    Job job;
    return readXmt(
        "<XMT-A><Header/><Body><Replace><Scene><Group DEF=\"G\"><children><PointLight "
        "DEF=\"L\"/></children></Group></Scene></Replace>" +
            commands + "</Body></XMT-A>",
        "a.xmt", job);
}

TEST(XmtCommands, MayHaveATimeOfTheirOwn) {
    const auto document = readXmtBody(R"(
<Replace begin="7" isRAP="yes" atNode="L" atField="on" value="false"/>
<par begin="1"><Replace atNode="L" atField="on" value="true"/>
 <Delete begin="2.5" atNode="L"/><Insert begin="0.5" atNode="G"><Group/></Insert>
 <par begin="3"><ObjectDescriptorRemove begin="6" objectDescriptorId="10"/></par></par>
)");
    ASSERT_TRUE(document) << document.error().text();
    std::vector<std::uint64_t> times;
    for (const CommandFrame& frame : document->frames) times.push_back(frame.time);
    std::ranges::sort(times);
    EXPECT_EQ(times, (std::vector<std::uint64_t>{0, 500, 1000, 2500, 7000}));
    for (const CommandFrame& frame : document->frames)
        EXPECT_EQ(frame.randomAccess, frame.time == 7000) << frame.time;
    ASSERT_EQ(document->odFrames.size(), 1u);
    EXPECT_EQ(document->odFrames[0].time, 6000u);
}

TEST(XmtCommands, RefuseWhatTheyDoNotHave) {
    const auto errorOfBody = [](const std::string& commands) {
        const auto document = readXmtBody(commands);
        return document ? std::string("no error") : document.error().text();
    };
    const std::string light = R"(<Replace atNode="L" atField="on" value="false")";
    EXPECT_TRUE(holdsText(errorOfBody(light + R"( begin="-1"/>)"),
                          "begin is '-1', expected a time of 0 or more seconds"));
    EXPECT_TRUE(holdsText(errorOfBody(light + R"( begin="2000000000"/>)"),
                          "begin is '2000000000', expected a time of 0 or more seconds"));
    EXPECT_TRUE(holdsText(errorOfBody(light + R"( begn="1"/>)"),
                          "<Replace> has no attribute 'begn'; it has begin, isRAP, atES_ID, "
                          "atNode, atField, atRoute, position, value"));
    EXPECT_TRUE(holdsText(errorOfBody("<par begn=\"1\">" + light + "/></par>"),
                          "<par> has no attribute 'begn'; it has begin, isRAP, atES_ID"));
    EXPECT_TRUE(holdsText(errorOfBody(R"(<ObjectDescriptorRemove id="1"/>)"),
                          "<ObjectDescriptorRemove> has no attribute 'id'"));
    // Those of other schemas are left alone.
    EXPECT_EQ(errorOfBody(light + R"( xmlns:a="u" a:note="x"/>)"), "no error");
}

TEST(LaterTimes, CountFromTheirAccessUnit) {
    const Document document = mustReadBt(R"(
DEF A Group { children [ DEF T TimeSensor { startTime 1 stopTime 3 cycleInterval 4 } ] }
AT 2000 { APPEND TO A.children DEF U TimeSensor { startTime 1 cycleInterval 4 } }
AT 5000 { REPLACE T.stopTime BY 3 }
)");
    const auto timesOf = [&](std::uint32_t timescale) {
        SceneInTime moments(document.frames, timescale);
        const auto scene = moments.at(9000);
        EXPECT_TRUE(scene);
        std::vector<double> times;
        for (const NodePtr& node : (*scene)->root->get<NodeList>("children"))
            for (const char* field : {"startTime", "stopTime", "cycleInterval"})
                times.push_back(node->get<double>(field));
        return times;
    };
    // A time that is not written is 0, which counts as one that is.
    EXPECT_EQ(timesOf(1000), (std::vector<double>{1, 8, 4, 3, 2, 4}));
    EXPECT_EQ(timesOf(0), (std::vector<double>{1, 3, 4, 1, 0, 4}));
}

/// A film of three pictures, as a track of an .mp4 without a scene.
ElementaryStream filmStream() {
    ElementaryStream film;
    film.streamType = StreamType::visual;
    film.objectTypeIndication = 0x20;
    film.timescale = 25000;
    film.width = film.height = 16;
    for (int i = 0; i < 3; ++i) {
        Sample sample;
        sample.data = ByteRange::of(Bytes(5, static_cast<std::byte>(i)));
        sample.time = static_cast<std::uint64_t>(i) * 1000;
        film.samples.push_back(sample);
    }
    return film;
}

Result<Document> readWithMuxInfo(const TemporaryFolder& folder, const std::string& file) {
    const std::string text =
        "Group { } AT 0 { UPDATE OD [ ObjectDescriptor { objectDescriptorID 5 esDescr [ "
        "ES_Descriptor { ES_ID 9 decConfigDescr DecoderConfigDescriptor { streamType 4 } muxInfo "
        "MuxInfo { fileName \"" +
        file + "\" } } ] } ] }";
    EXPECT_TRUE(writeFile(folder / "a.bt", std::as_bytes(std::span(text.data(), text.size()))));
    Job job;
    return readMpeg4(folder / "a.bt", job);
}

TEST(MuxInfo, TakesTracksOfFilmsApart) {
    const TemporaryFolder folder("mux-info");
    auto out = OutputFile::create(folder / "film.mp4");
    ASSERT_TRUE(out);
    Job job;
    ASSERT_TRUE(writeMp4Stream(filmStream(), *out, job));
    ASSERT_TRUE(out->commit());
    for (const char* name : {"film.mp4", "film.mp4#video", "film.mp4#trackID=1", "film.mp4#1"}) {
        const auto document = readWithMuxInfo(folder, name);
        ASSERT_TRUE(document) << document.error().text();
        const ElementaryStream& stream = document->findObjectDescriptor(5)->streams.at(0);
        ASSERT_EQ(stream.samples.size(), 3u) << name;
        EXPECT_EQ(stream.samples[1].time, 1000u);
        EXPECT_EQ(stream.timescale, 25000u);
        EXPECT_EQ(stream.objectTypeIndication, 0x20);
    }
    for (const char* name : {"film.mp4#audio", "film.mp4#2", "film.mp4#other"}) {
        const auto document = readWithMuxInfo(folder, name);
        ASSERT_FALSE(document) << name;
        EXPECT_EQ(document.error().code, ErrorCode::invalidInput);
    }
}

TEST(MuxInfo, RefusesOtherFilesOfManyPictures) {
    const TemporaryFolder folder("mux-info");
    ASSERT_TRUE(writeFile(folder / "film.264", Bytes(100, std::byte{0})));
    const auto document = readWithMuxInfo(folder, "film.264");
    ASSERT_FALSE(document);
    EXPECT_EQ(document.error().code, ErrorCode::unsupported);
    EXPECT_TRUE(holdsText(document.error().text(), "ffmpeg -i film.264"))
        << document.error().text();
}

TEST(Descriptions, LeaveOutWhatCannotBeReadAndSayIt) {
    const auto describe = [](const std::string& nodes, std::size_t views) {
        Job job;
        const auto document = readBt("Group { children [ " + nodes + " ] }", "test.bt", job);
        ASSERT_TRUE(document);
        SceneReadOptions options;
        options.pixels = false;
        options.mayBeEmpty = true;
        const auto bundle = bundleFromScene(*document, options, job);
        ASSERT_TRUE(bundle) << bundle.error().text();
        EXPECT_EQ(bundle->views.size(), views);
        EXPECT_EQ(job.takeNotes().size(), 1u);
        // With pixels it is an error.
        EXPECT_FALSE(bundleFromScene(*document, {}, job));
    };
    describe(
        "DepthImage { diTexture SimpleTexture { texture ImageTexture { url od:7 } depth "
        "ImageTexture { url od:8 } } }",
        0);
    describe(
        "Transform { scale 1 2 3 children DepthImage { nearPlane 1 farPlane 9 diTexture "
        "SimpleTexture { depth PixelTexture { image 1 1 1 9 } texture PixelTexture { image 1 1 1 9 "
        "} "
        "} } }",
        1);
}

}  // namespace
}  // namespace stx::mpeg4

#include "formats/validate/validate_mpeg4.hpp"

#include <fstream>
#include <map>
#include <set>

#include "formats/files/base64.hpp"
#include "formats/mpeg4/container/isobmff.hpp"
#include "formats/mpeg4/text/bt.hpp"
#include "tests/shared_data.hpp"
#include "tests/unit/mpeg4/mapping_fixtures.hpp"
#include "tests/unit/validate/numbers.hpp"

namespace stx::mpeg4 {
namespace {

/// A sound V2 scene of two views, and one of V1.
Document sound(bool v2 = true) {
    Bundle bundle;
    bundle.views = {makeView(8, 6, 16, 1), makeView(8, 6, 8, 2)};
    for (ReferenceView& view : bundle.views) {
        if (!v2) continue;
        addVectors(view);
        // Towards the camera, as baking makes them.
        for (auto& n : view.normal.pixels())
            if (n != glm::vec3(0)) n = glm::vec3(-view.camera.forward());
    }
    return sceneOf(bundle);
}
NodePtr rootOf(Document& document) {
    return std::get<ReplaceScene>(document.frames[0].commands[0]).root;
}
NodePtr viewOf(Document& document, std::size_t i = 0) {
    return rootOf(document)->get<NodeList>("children").at(i + 1);
}
NodePtr textureOf(Document& document, std::size_t i = 0) {
    return viewOf(document, i)->get<NodePtr>("diTexture");
}
std::vector<ObjectDescriptor>& odsOf(Document& document) {
    return std::get<UpdateObjectDescriptors>(document.odFrames[0].commands[0]).descriptors;
}
/// The stream behind a field of a view's texture.
ElementaryStream& streamOf(Document& document, const char* field, std::size_t i = 0) {
    const int id = textureOf(document, i)
                       ->get<NodePtr>(field)
                       ->get<std::vector<Url>>("url")
                       .at(0)
                       .objectDescriptorId;
    for (ObjectDescriptor& od : odsOf(document))
        if (od.id == id) return od.streams.at(0);
    throw std::runtime_error("no stream");
}
void putPng(Document& document, const char* field, int width, int height, int channels, int bits,
            int value) {
    const std::size_t count = static_cast<std::size_t>(width) * height * channels;
    Result<Bytes> png;
    if (bits == 8) {
        const std::vector<std::uint8_t> values(count, static_cast<std::uint8_t>(value));
        png = encodePng(width, height, channels, 8, values.data(), false);
    } else {
        const std::vector<std::uint16_t> values(count, static_cast<std::uint16_t>(value));
        png = encodePng(width, height, channels, 16, values.data(), false);
    }
    ASSERT_TRUE(png) << png.error().text();
    streamOf(document, field).samples[0].data = ByteRange::of(std::move(*png));
}
Document fromText(const std::string& nodes) {
    Job job;
    auto document = readBt("Group { children [ " + nodes + " ] }", "test.bt", job);
    if (!document) ADD_FAILURE() << document.error().text();
    return document ? std::move(*document) : Document();
}
std::string pixels(int depth = 200) {
    return "SimpleTexture { texture PixelTexture { image 1 1 3 0xFFFFFF } depth PixelTexture { "
           "image 1 1 1 " +
           std::to_string(depth) + " } }";
}
std::string camera(const std::string& fields, int depth = 200) {
    return "DepthImage { orthographic FALSE " + fields + " diTexture " + pixels(depth) + " }";
}

/// A document that breaks a rule, by the rule's number.
std::map<int, std::function<Document()>> brokenDocuments() {
    std::map<int, std::function<Document()>> broken;
    const auto deviation = [](Mp4Deviation::Kind kind) {
        return [kind] {
            Document d = sound();
            d.mp4.emplace();
            d.mp4->deviations.push_back({kind, "what was found", "moov"});
            return d;
        };
    };
    using Kind = Mp4Deviation::Kind;
    int rule = 2001;
    for (const Kind kind :
         {Kind::noIods, Kind::sceneNotInIods, Kind::imageInSystemsEntry, Kind::imageInNativeEntry,
          Kind::fullEsdInOd, Kind::mpodMissing, Kind::streamNotFound, Kind::streamOdTag,
          Kind::noOdTrack, Kind::esIdNotZero, Kind::trailingBytes, Kind::other})
        broken[rule++] = deviation(kind);
    const auto changed = [&broken](int number, std::function<void(Document&)> change,
                                   bool v2 = true) {
        broken[number] = [change, v2] {
            Document d = sound(v2);
            change(d);
            return d;
        };
    };
    changed(2020, [](Document& d) { odsOf(d).pop_back(); });
    changed(2021, [](Document& d) { odsOf(d)[0].id = 1023; });
    changed(2022, [](Document& d) { odsOf(d).push_back(odsOf(d)[0]); });
    changed(2023, [](Document& d) { streamOf(d, "depth").samples[0].data = ByteRange(); });
    changed(2024, [](Document& d) {
        odsOf(d).push_back(odsOf(d)[0]);
        odsOf(d).back().id = 900;
        odsOf(d).back().streams[0].esId = 901;
    });
    changed(2025, [](Document& d) { streamOf(d, "texture").objectTypeIndication = oti::kJpeg; });
    changed(2026, [](Document& d) { streamOf(d, "texture").objectTypeIndication = 0x20; });
    changed(2027, [](Document& d) { d.sceneStream.objectTypeIndication = 2; });
    changed(2028, [](Document& d) { streamOf(d, "texture").esId = d.sceneStream.esId; });
    changed(2030, [](Document& d) { d.frames.clear(); });
    changed(2031, [](Document& d) {
        const NodePtr info = rootOf(d)->get<NodeList>("children").at(0);
        d.frames.push_back(
            {1, {DeleteIndexed{rootOf(d), rootOf(d)->info->find("children"), Position{77}}}});
    });
    broken[2033] = [] {
        Document document = sound();
        const NodePtr interpolator = makeNode("ScalarInterpolator");
        interpolator->set("key", std::vector<float>{0, 1});
        std::get<ReplaceScene>(document.frames[0].commands[0])
            .root->edit<NodeList>("children")
            .push_back(interpolator);
        return document;
    };
    broken[2032] = [] {
        Job job;
        auto document = readBt(
            "Group { children [ DepthImage { orthographic FALSE diTexture SimpleTexture { texture "
            "DEF "
            "P PixelTexture { image 1 1 3 0xFFFFFF } depth PixelTexture { image 1 1 1 200 } } } ] "
            "} "
            "AT 100 { REPLACE P.image BY 2 1 3 0 0 }",
            "test.bt", job);
        if (!document) ADD_FAILURE() << document.error().text();
        return document ? std::move(*document) : Document();
    };
    const auto text = [&broken](int number, const std::string& nodes) {
        broken[number] = [nodes] { return fromText(nodes); };
    };
    text(8002, camera("") + " Background { frontUrl [10] }");
    text(8003, camera("") + " Background { skyColor [1 0 0] skyAngle [1] }");
    broken[8001] = [] {
        Bundle bundle;
        bundle.views = {makeView(4, 4, 8)};
        Environment e;
        e.pictures.assign(6, Texture(Rgba8Image(4, 4, glm::u8vec4(255))));
        e.pictures[2] = Rgba8Image(4, 3, glm::u8vec4(255));
        bundle.environment = std::make_shared<const Environment>(e);
        Job job;
        return *sceneFromBundle(bundle, {}, job);
    };
    text(3001, camera("nearPlane 5 farPlane 5"));
    text(3002, camera("nearPlane -1"));
    text(3003, camera("fieldOfView 7 7"));
    text(3004, camera("orientation 0 2 0 1"));
    text(3005, camera("position inf 0 0"));
    text(3006, "Transform { scale 1 2 1 children " + camera("") + " }");
    text(3007, camera("nearPlane 0"));
    text(3008, "DepthImage { diTexture " + pixels() + " }");
    changed(4001, [](Document& d) { putPng(d, "texture", 4, 4, 3, 8, 1); });
    changed(4002, [](Document& d) { putPng(d, "depth", 8, 6, 3, 8, 9); });
    text(4003,
         "DepthImage { orthographic FALSE diTexture SimpleTexture { texture PixelTexture { image 1 "
         "1 3 1 } } }");
    changed(4004, [](Document& d) {
        const std::vector<std::uint8_t> grey(48, 100);
        streamOf(d, "depth").samples[0].data = ByteRange::of(*encodeJpeg(8, 6, 1, grey.data(), 90));
        streamOf(d, "depth").objectTypeIndication = oti::kJpeg;
    });
    changed(4005, [](Document& d) {
        Bytes bytes = *streamOf(d, "texture").samples[0].data.load(Limits());
        bytes.resize(60);
        streamOf(d, "texture").samples[0].data = ByteRange::of(std::move(bytes));
    });
    text(4006, camera("", 0) + camera(""));
    text(4007, camera("", 0));
    changed(4008, [](Document& d) { putPng(d, "depth", 8, 6, 2, 8, 9); });
    text(4009, camera("") + "DepthImage { orthographic FALSE }");
    changed(4010, [](Document& d) { putPng(d, "depth", 8, 6, 1, 16, 255); });
    changed(4011, [](Document& d) {
        // A JPEG header that says 12 bits.
        const std::vector<std::uint8_t> grey(48, 100);
        Bytes bytes = *encodeJpeg(8, 6, 1, grey.data(), 90);
        for (std::size_t i = 0; i + 4 < bytes.size(); ++i)
            if (bytes[i] == std::byte{0xFF} && bytes[i + 1] == std::byte{0xC0})
                bytes[i + 4] = std::byte{12};
        streamOf(d, "depth").samples[0].data = ByteRange::of(std::move(bytes));
        streamOf(d, "depth").objectTypeIndication = oti::kJpeg;
    });
    text(4012,
         "DepthImage { orthographic FALSE diTexture PointTexture { width 1 height 1 depth [1 5] } "
         "}");
    text(4013, "OctreeImage { octreeResolution 4 octree [255 1] }");
    text(4014, "WorldInfo { }");
    text(4020, "Transform { translation 1 0 0 children " + camera("") + " } Transform { children " +
                   camera("") + " }");
    text(4021, "DEF A " + camera("") + " USE A");
    changed(6001, [](Document& d) { putPng(d, "normal", 4, 4, 3, 8, 128); });
    changed(6002, [](Document& d) { putPng(d, "splatU", 8, 6, 1, 8, 128); });
    changed(6003, [](Document& d) { textureOf(d)->clear(textureOf(d)->info->find("splatV")); });
    changed(6004, [](Document& d) { viewOf(d)->clear(viewOf(d)->info->find("splatMinMax")); });
    changed(6005, [](Document& d) { viewOf(d)->set("splatMinMax", glm::vec2(1, 1)); });
    changed(6006, [](Document& d) {
        const NodePtr v2 = viewOf(d), v1 = makeNode("DepthImage");
        for (const Node::SetField& field : v2->setFields)
            v1->set(v2->info->fields[field.index].name, field.value);
        rootOf(d)->edit<NodeList>("children")[1] = v1;
    });
    changed(6007, [](Document& d) { putPng(d, "normal", 8, 6, 3, 8, 140); });
    changed(6008, [](Document& d) { viewOf(d)->set("orientation", Rotation{{0, 1, 0}, 3.4f}); });
    return broken;
}

TEST(Validate, IsSilentWhenNoRuleIsBroken) {
    for (const bool v2 : {false, true}) {
        Job job;
        const auto findings = validate(sound(v2), {}, {}, job);
        EXPECT_TRUE(findings.empty()) << textOf(findings);
    }
    // Through a file, too.
    const TemporaryFolder folder("silent");
    Job job;
    for (const char* name : {"a.mp4", "a.bt", "a.xmt"}) {
        ASSERT_TRUE(writeMpeg4(sound(), folder / name, job));
        const auto findings = validateFile(folder / name, {}, job);
        ASSERT_TRUE(findings);
        EXPECT_TRUE(findings->empty()) << name << "\n" << textOf(*findings);
    }
}

TEST(Validate, EveryRuleHasASampleThatBreaksIt) {
    const auto broken = brokenDocuments();
    for (const auto& [number, make] : broken) {
        Job job;
        ASSERT_NE(findRule(number), nullptr) << number;
        const auto findings = validate(make(), {}, {}, job);
        EXPECT_TRUE(numbersOf(findings).contains(number)) << number << " is not found in\n"
                                                          << textOf(findings);
        for (const Finding& f : findings) {
            EXPECT_FALSE(f.found.empty()) << number;
            EXPECT_FALSE(f.expected.empty()) << number;
        }
    }
    // Rules that other tests break: below, and in the other files of this folder.
    const Numbers elsewhere = {1001, 1002, 1003, 3009, 4030, 5001, 5002, 5003, 5004,
                               5005, 7001, 7002, 7003, 7004, 7005, 7006, 7007, 7008};
    for (const Rule& rule : ruleCatalogue())
        EXPECT_TRUE(broken.contains(rule.number) || elsewhere.contains(rule.number))
            << rule.number << " has no sample";
}

TEST(Validate, ABrokenRuleBringsNoOthersThatHaveNothingToDoWithIt) {
    const auto broken = brokenDocuments();
    const std::map<int, Numbers> company = {
        {4007, {4006}},                        // no point in the only view
        {4013, {4014}},                        // an OctreeImage without images
        {2022, {2028}},       {6003, {2024}},  // the other's image is left over
        {2021, {2020, 2024}},                  // the scene still names the old id
        {2023, {}},
    };
    for (const int number : {2001, 2020, 2021, 2022, 2023, 2024, 2027, 2028, 3001, 3002, 3003,
                             3004, 3005, 3006, 3007, 3008, 4003, 4004, 4006, 4007, 4008, 4009,
                             4010, 4012, 4013, 4014, 4020, 4021, 6003, 6004, 6005, 6006, 6008}) {
        Job job;
        Numbers found = numbersOf(validate(broken.at(number)(), {}, {}, job));
        found.erase(number);
        if (const auto allowed = company.find(number); allowed != company.end())
            for (const int other : allowed->second) found.erase(other);
        EXPECT_TRUE(found.empty())
            << number << " came with " << (found.empty() ? 0 : *found.begin());
    }
}

TEST(Validate, StructureIsCheckedWithoutDecoding) {
    ValidateOptions options;
    options.pixels = false;
    PresentationImages images;
    images.decode = [](ByteSpan, std::string_view, const Limits&) -> Result<DecodedImage> {
        ADD_FAILURE() << "an image was decoded";
        return fail(ErrorCode::failed, "no");
    };
    Job job;
    EXPECT_TRUE(validate(sound(), options, images, job).empty());
    EXPECT_TRUE(
        numbersOf(validate(brokenDocuments().at(4001)(), options, images, job)).contains(4001));
}

/// Cuts a PNG behind its header, so that it is probed and does not decode.
void cutPicture(ElementaryStream& stream) {
    Bytes bytes = *stream.samples[0].data.load(Limits());
    bytes.resize(60);
    stream.samples[0].data = ByteRange::of(std::move(bytes));
}
Numbers numbersWith(const Document& document, bool pixels) {
    ValidateOptions options;
    options.pixels = pixels;
    Job job;
    return numbersOf(validate(document, options, {}, job));
}

TEST(Validate, EachImageOfAViewIsDecoded) {
    for (const char* field : {"texture", "depth", "normal", "splatU", "splatV"}) {
        Document document = sound();
        cutPicture(streamOf(document, field, 1));
        EXPECT_EQ(numbersWith(document, true), Numbers{4005}) << field;
        EXPECT_EQ(numbersWith(document, false), Numbers{}) << field;
    }
}

TEST(Validate, ImagesOfAnOctreeImageAreDecoded) {
    Document document = sound(false);
    const NodePtr octree = makeNode("OctreeImage"), view = viewOf(document);
    octree->set("octreeResolution", std::int32_t{2});
    octree->set("octree", std::vector<std::int32_t>{255});
    view->set("orthographic", true);
    view->set("fieldOfView", glm::vec2(1.0f, 1.0f));
    octree->set("images", NodeList{view});
    rootOf(document)->edit<NodeList>("children")[1] = octree;
    EXPECT_EQ(numbersWith(document, true), Numbers{});
    cutPicture(streamOf(document, "texture", 1));
    EXPECT_EQ(numbersWith(document, true), Numbers{4005});
    document = sound(false);
    cutPicture(streamOf(document, "texture"));
    view->set("diTexture", textureOf(document));
    rootOf(document)->edit<NodeList>("children")[1] = octree;
    EXPECT_EQ(numbersWith(document, true), Numbers{4005});
    EXPECT_EQ(numbersWith(document, false), Numbers{});
}

TEST(Validate, ImagesOfAnOctreeImageHaveATexture) {
    const auto octree = [](const std::string& fields, const std::string& images) {
        return numbersWith(
            fromText("OctreeImage { octreeResolution 2 octree [255] images [ DepthImage { "
                     "orthographic TRUE fieldOfView 1 1 position 0 0 2 " +
                     fields + " diTexture SimpleTexture { " + images + " } } ] }"),
            true);
    };
    const std::string texture = "texture PixelTexture { image 1 1 3 1 } ",
                      depth = "depth PixelTexture { image 1 1 1 9 }";
    EXPECT_EQ(octree("", depth), Numbers{4013});
    EXPECT_EQ(octree("", texture + depth), Numbers{});
    EXPECT_EQ(octree("nearPlane 5 farPlane 5", texture), Numbers{});
}

TEST(Validate, WhatClocksMoveIsReadAtEachMoment) {
    const auto moved = [](const std::string& scales) {
        Job job;
        auto document =
            readBt("Group { children [ DEF T Transform { children " + camera("") +
                       " } DEF C TimeSensor { cycleInterval 0.08 } DEF P PositionInterpolator { "
                       "key [0 1] keyValue [" +
                       scales +
                       "] } ] } ROUTE C.fraction_changed TO P.set_fraction ROUTE P.value_changed "
                       "TO T.scale",
                   "test.bt", job);
        if (!document) ADD_FAILURE() << document.error().text();
        return document ? std::move(*document) : Document();
    };
    EXPECT_EQ(numbersWith(moved("1 1 1 2 2 2"), true), Numbers{});
    EXPECT_EQ(numbersWith(moved("1 1 1 1 2 1"), true), Numbers{2032});
    // The first moment is as clocks have it, too.
    EXPECT_EQ(numbersWith(moved("1 2 1 1 1 1"), true), Numbers{3006});
}

TEST(Validate, PicturesOfABackgroundAreDecoded) {
    Bundle bundle;
    bundle.views = {makeView(4, 4, 8)};
    Environment e;
    e.pictures.assign(6, Texture(Rgba8Image(4, 4, glm::u8vec4(255))));
    bundle.environment = std::make_shared<const Environment>(e);
    Document document = sceneOf(bundle);
    EXPECT_EQ(numbersWith(document, true), Numbers{});
    int cut = 0;
    for (const NodePtr& node : rootOf(document)->get<NodeList>("children"))
        if (node->is("Background"))
            for (ObjectDescriptor& od : odsOf(document))
                if (od.id == node->get<std::vector<Url>>("leftUrl").at(0).objectDescriptorId) {
                    cutPicture(od.streams.at(0));
                    ++cut;
                }
    ASSERT_EQ(cut, 1);
    EXPECT_EQ(numbersWith(document, true), Numbers{4005});
    EXPECT_EQ(numbersWith(document, false), Numbers{});
}

TEST(Validate, ADescriptorOfAnImageHasAStream) {
    for (const char* field : {"texture", "depth", "splatV"}) {
        Document document = sound();
        const int id = textureOf(document)
                           ->get<NodePtr>(field)
                           ->get<std::vector<Url>>("url")
                           .at(0)
                           .objectDescriptorId;
        for (ObjectDescriptor& od : odsOf(document))
            if (od.id == id) od.streams.clear();
        EXPECT_EQ(numbersWith(document, true), Numbers{2023}) << field;
        EXPECT_EQ(numbersWith(document, false), Numbers{2023}) << field;
    }
    // A stream that is not a picture: the rules of descriptors do not cover it.
    Document document = sound();
    streamOf(document, "texture").streamType = StreamType::audio;
    streamOf(document, "texture").samples.clear();
    EXPECT_EQ(numbersWith(document, true), Numbers{4005});
    // A stream that is elsewhere.
    document = sound();
    streamOf(document, "texture").url = "http://localhost/a.png";
    streamOf(document, "texture").samples.clear();
    EXPECT_EQ(numbersWith(document, true), Numbers{4005});
    // Of a Background.
    document = fromText(camera("") +
                        " Background { frontUrl [od:10] backUrl [od:10] leftUrl "
                        "[od:10] rightUrl [od:10] topUrl [od:10] bottomUrl [od:10] }");
    ObjectDescriptor od;
    od.id = 10;
    document.odFrames = {{0, {UpdateObjectDescriptors{{od}}}}};
    EXPECT_EQ(numbersWith(document, true), Numbers{2023});
}

TEST(Validate, MasksInWorldInfoAreDecoded) {
    const std::vector<std::uint8_t> grey(48, 0);
    const Bytes png = *encodePng(8, 6, 1, 8, grey.data(), false);
    const auto noted = [](const std::string& mask) {
        Document document = sound(false);
        rootOf(document)
            ->get<NodeList>("children")
            .at(0)
            ->set("info", std::vector<std::string>{mpeg4::kMadeByUs, "unknown #0 0 " + mask});
        return document;
    };
    EXPECT_EQ(numbersWith(noted("alpha"), true), Numbers{});
    EXPECT_EQ(numbersWith(noted(encodeBase64(png)), true), Numbers{});
    const std::string cut = encodeBase64(ByteSpan(png).first(48));
    EXPECT_EQ(numbersWith(noted(cut), true), Numbers{4005});
    EXPECT_EQ(numbersWith(noted("no+base64="), true), Numbers{4005});
    EXPECT_EQ(numbersWith(noted(cut), false), Numbers{});
}

TEST(Validate, FilesThatCannotBeReadBreakRule1001) {
    const TemporaryFolder folder("unreadable");
    Job job;
    std::ofstream(folder / "a.bt") << "Group { children [ Depth { } ] }";
    const auto findings = validateFile(folder / "a.bt", {}, job);
    ASSERT_TRUE(findings);
    EXPECT_EQ(numbersOf(*findings), Numbers{1001}) << textOf(*findings);
    EXPECT_NE(findings->at(0).text().find("'Depth'"), std::string::npos);
    const auto missing = validateFile(folder / "b.bt", {}, job);
    ASSERT_FALSE(missing);
    EXPECT_EQ(missing.error().code, ErrorCode::io);

    ASSERT_TRUE(writeMpeg4(sound(), folder / "a.mp4", job));
    std::filesystem::rename(folder / "a.mp4", folder / "c.bt");
    const auto renamed = validateFile(folder / "c.bt", {}, job);
    ASSERT_TRUE(renamed);
    EXPECT_EQ(numbersOf(*renamed), Numbers{1002}) << textOf(*renamed);
}

TEST(Validate, NumbersAscendAndBelongToTheirRange) {
    int last = 1000;
    for (const Rule& rule : ruleCatalogue()) {
        EXPECT_GT(rule.number, last);
        EXPECT_LT(rule.number, 9000);
        EXPECT_EQ(findRule(rule.number), &rule);
        last = rule.number;
    }
    EXPECT_EQ(findRule(9999), nullptr);
}

TEST(Validate, ReferenceFilesBreakWhatTheyAreKnownToBreak) {
    REQUIRE_SHARED(folder, "reference");
    Job job;
    const auto rules = [&](const char* name) {
        const auto findings = validateFile(folder / name, {}, job);
        return findings ? numbersOf(*findings) : Numbers{-1};
    };
    EXPECT_TRUE(rules("handmade/d_no_iods.mp4").contains(2001));
    EXPECT_TRUE(rules("handmade/f_img_mp4s.mp4").contains(2003));
    EXPECT_TRUE(rules("handmade/l_esid_nonzero.mp4").contains(2010));
    EXPECT_TRUE(rules("mp4/06_multiview_transform_hierarchy.mp4").contains(3006));
    EXPECT_TRUE(rules("mp4/02_all_defaults.mp4").contains(4009));
    EXPECT_TRUE(rules("mp4/07_url_strings.mp4").contains(4005));
    EXPECT_EQ(rules("mp4/01_depthimage_simpletexture.mp4"), Numbers{});
}

}  // namespace
}  // namespace stx::mpeg4

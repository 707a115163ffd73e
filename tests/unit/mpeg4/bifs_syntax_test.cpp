// BIFS bit by bit: every kind of command, and what is refused.

#include <gtest/gtest.h>

#include "formats/mpeg4/bifs/bit_stream.hpp"
#include "tests/same_scenes.hpp"
#include "tests/unit/mpeg4/round_trips.hpp"

namespace stx::mpeg4 {
namespace {

BifsConfig configOf(int nodeIdBits, int routeIdBits = 0) {
    BifsConfig config;
    config.nodeIdBits = nodeIdBits;
    config.routeIdBits = routeIdBits;
    return config;
}

/// "11 000000 0 0": bits with blanks between them.
Bytes bits(std::string_view text) {
    BitWriter out;
    for (const char c : text)
        if (c == '0' || c == '1') out.flag(c == '1');
    return out.finish();
}

std::string syntaxErrorOf(std::string_view text, const BifsConfig& config = configOf(3),
                          const Limits& limits = {}) {
    BifsDecoder decoder(config, limits);
    const auto commands = decoder.decode(bits(text));
    return commands ? "decoded" : commands.error().text();
}

constexpr std::string_view kGroup = "11 000000 0 0  0 001 ";  // scene, then a new Group

TEST(BifsSyntax, TheWorkedExampleDecodes) {
    // ISO/IEC 14496-11, 8.6: BIFS-Command
    const Bytes unit = unhex("c005a0000364cda81726d40a80800000000000000020000000 40");
    BifsDecoder decoder(configOf(1), Limits());
    const auto commands = decoder.decode(unit);
    ASSERT_TRUE(commands) << commands.error().text();
    ASSERT_EQ(commands->size(), 1u);
    EXPECT_EQ(decoder.bitsLeft(), 4u);
    const auto& scene = std::get<ReplaceScene>(commands->at(0));
    const NodePtr view = scene.root->get<NodeList>("children").at(0);
    EXPECT_TRUE(view->is("DepthImage"));
    EXPECT_EQ(view->get<glm::vec3>("position"), glm::vec3(0, 0, 2));
    const NodePtr texture = view->get<NodePtr>("diTexture");
    EXPECT_EQ(texture->get<NodePtr>("depth")->get<std::vector<Url>>("url").at(0).objectDescriptorId,
              11);
    EXPECT_EQ(
        texture->get<NodePtr>("texture")->get<std::vector<Url>>("url").at(0).objectDescriptorId,
        10);
}

TEST(BifsSyntax, ConfigsOfBothVersionsAreRead) {
    const auto one = decodeBifsConfig(unhex("0820"), oti::kSystemsV1);
    ASSERT_TRUE(one);
    EXPECT_EQ(one->nodeIdBits, 1);
    EXPECT_FALSE(one->hasSize);
    const auto sized = decodeBifsConfig(unhex("18280a000780"), oti::kSystemsV1);
    ASSERT_TRUE(sized);
    EXPECT_EQ(sized->nodeIdBits, 3);
    EXPECT_EQ(sized->pixelWidth, 320);
    EXPECT_EQ(sized->pixelHeight, 240);
    EXPECT_EQ(hex(encodeBifsConfig(*sized)), "18 28 0a 00 07 80");
    BifsConfig two = *sized;
    two.version = 2;
    const Bytes bytes = encodeBifsConfig(two);
    EXPECT_EQ(bytes.size(), 7u);
    EXPECT_EQ(decodeBifsConfig(bytes, oti::kSystemsV2).value_or(BifsConfig()), two);
    EXPECT_EQ(decodeBifsConfig(bytes, oti::kSystemsV1).value_or(BifsConfig()), two)
        << "whatever the OTI says";
    EXPECT_FALSE(decodeBifsConfig({}, oti::kSystemsV1));
    EXPECT_FALSE(decodeBifsConfig(Bytes(20), oti::kSystemsV1));
}

TEST(BifsSyntax, EveryKindOfCommandComesBack) {
    const NodePtr root = makeNode("Group");
    const NodePtr group = makeNode("OrderedGroup");
    const NodePtr clock = makeNode("TimeSensor");
    const NodePtr transform = makeNode("Transform");
    const NodePtr path = makeNode("PositionInterpolator");
    root->set("children", NodeList{group, clock, transform, path});
    const int children = group->info->find("children");
    const int order = group->info->find("order");
    const auto route = [](std::uint32_t id, const NodePtr& a, const char* out, const NodePtr& b,
                          const char* in) {
        return Route{id, "", a, a->info->find(out), b, b->info->find(in)};
    };
    std::vector<CommandFrame> frames(2);
    frames[0].commands.push_back(
        ReplaceScene{false, root, {route(1, clock, "fraction_changed", path, "set_fraction")}});
    auto& commands = frames[1].commands;
    commands.push_back(InsertNode{group, {0}, makeNode("Viewpoint")});
    commands.push_back(InsertNode{group, {200}, makeNode("WorldInfo")});
    commands.push_back(InsertNode{group, {}, makeNode("DepthImage")});
    commands.push_back(InsertIndexed{group, order, {5000}, FieldValue(2.5f)});
    commands.push_back(InsertRoute{route(2, path, "value_changed", transform, "translation")});
    commands.push_back(ReplaceField{group, order, std::vector<float>{1, 2, 3}});
    commands.push_back(
        ReplaceField{group, group->info->find("addChildren"), NodeList{makeNode("Group")}});
    commands.push_back(ReplaceIndexed{group, children, {}, FieldValue(makeNode("DepthImageV2"))});
    commands.push_back(ReplaceRoute{1, route(1, clock, "time", clock, "startTime")});
    commands.push_back(ReplaceNode{transform, makeNode("SimpleTexture")});
    commands.push_back(DeleteIndexed{group, children, {1}});
    commands.push_back(DeleteRoute{2});
    commands.push_back(DeleteNode{group});
    const NodeIds ids = assignNodeIds(frames);
    for (const BifsStyle style : {BifsStyle::maskAndVector(), BifsStyle::shortest()}) {
        const BifsConfig config = fitBifsConfig({}, ids);
        BifsEncoder encoder(config, style, ids);
        BifsDecoder decoder(config, Limits());
        std::vector<CommandFrame> again;
        for (const CommandFrame& frame : frames) {
            const auto bytes = encoder.encode(frame.commands);
            ASSERT_TRUE(bytes) << bytes.error().text();
            auto decoded = decoder.decode(*bytes);
            ASSERT_TRUE(decoded) << decoded.error().text();
            again.push_back({frame.time, std::move(*decoded)});
        }
        EXPECT_TRUE(sameFrames(frames, again, {.ids = false}));
    }
}

TEST(BifsSyntax, WhatCannotBeReadIsToldWithItsBit) {
    EXPECT_NE(syntaxErrorOf("").find("bit 0: the access unit ends"), std::string::npos)
        << syntaxErrorOf("");
    EXPECT_NE(syntaxErrorOf("11 000000 0 1").find("the access unit ends"), std::string::npos);
    EXPECT_NE(syntaxErrorOf("11 000000 0 0 0 111").find("node code 7 of SFTopNode version 1"),
              std::string::npos);
    // Code 0 in all ten versions: 3 + 1 bits, then nothing.
    EXPECT_NE(syntaxErrorOf("11 000000 0 0 0 000 0").find("0 in every version"), std::string::npos);
    EXPECT_NE(syntaxErrorOf("11 000000 0 0 0 000 1").find("PROTO"), std::string::npos);
    EXPECT_NE(syntaxErrorOf("11 000000 0 0 1 010").find("bit 14: USE of node id 3"),
              std::string::npos);
    EXPECT_NE(syntaxErrorOf("10 01 010").find("names node id 3"), std::string::npos);
    EXPECT_NE(syntaxErrorOf("00 01 00001001").find("extended"), std::string::npos);
    const std::string group(kGroup);
    // DEF 1 Group { children [ USE 1 ] } as a mask and a vector of one.
    EXPECT_NE(syntaxErrorOf(group + "1 000 1 1 0 0 00001 1  1 000").find("used inside itself"),
              std::string::npos);
    // Two children with the id of the first.
    EXPECT_NE(syntaxErrorOf(group + "0 1 1 0 0 00010 10  0 010001 1 000 0 1  0 010001 1 000")
                  .find("defined twice"),
              std::string::npos);
    // USE of a Group as diTexture: children [DEF 1 Group, DepthImage { diTexture USE 1 }].
    EXPECT_NE(
        syntaxErrorOf(
            group + "0 1 1 0 0 00010 10  0 010001 1 000 0 1  0 000000 000 00 000 00011 0 1 1 1 000")
            .find("a Group, where SFDepthTextureNode"),
        std::string::npos);
    // A vector of 2^31 - 1 children, and a string of as many bytes.
    EXPECT_NE(syntaxErrorOf(group + "0 1 1 0 0 11111 1111111111111111111111111111111")
                  .find("Group.children has 2147483647 items"),
              std::string::npos);
    EXPECT_NE(
        syntaxErrorOf(group +
                      "0 1 1 0 0 00001 1 0 110100 0 1 0 1 11111 1111111111111111111111111111111")
            .find("a string of 2147483647 bytes"),
        std::string::npos);
    // NULL among the children.
    EXPECT_NE(syntaxErrorOf(group + "0 1 1 0 0 00001 1  1 111").find("NULL among its nodes"),
              std::string::npos);
    BifsConfig predictive = configOf(3);
    predictive.version = 2;
    predictive.usePredictiveMFField = true;
    EXPECT_NE(syntaxErrorOf(group + "0 1 1 1", predictive).find("predictive"), std::string::npos);
}

TEST(BifsSyntax, NestingAndMemoryAreBounded) {
    // Groups in groups, 5 bits of head each, for ever.
    std::string deep(kGroup);
    for (int i = 0; i < 2000; ++i) deep += "0 1 1 0 1 0  0 010001 ";
    EXPECT_NE(syntaxErrorOf(deep).find("nested more than 256 deep"), std::string::npos)
        << syntaxErrorOf(deep);

    // The same by USE: each child holds the one before it.
    NodePtr inner = makeNode("Group");
    const NodePtr root = makeNode("Group");
    for (int i = 0; i < 400; ++i) {
        const NodePtr outer = makeNode("Group");
        outer->edit<NodeList>("children").push_back(inner);
        root->edit<NodeList>("children").push_back(inner);
        inner = outer;
    }
    std::vector<CommandFrame> frames{{0, {ReplaceScene{false, root, {}}}}};
    const NodeIds ids = assignNodeIds(frames);
    const BifsConfig config = fitBifsConfig({}, ids);
    BifsEncoder encoder(config, {}, ids);
    const auto bytes = encoder.encode(frames[0].commands);
    ASSERT_TRUE(bytes) << bytes.error().text();
    BifsDecoder decoder(config, Limits());
    const auto decoded = decoder.decode(*bytes);
    ASSERT_FALSE(decoded);
    EXPECT_NE(decoded.error().text().find("nested more than 256 deep"), std::string::npos);

    // Few bits, many nodes: 100,000 empty groups in 5 KB would take 16 MB.
    std::string many = std::string(kGroup) + "0 1 1 0 0 10001 11000011010100000 ";
    for (int i = 0; i < 100'000; ++i) many += "0010001001";
    Limits limits;
    limits.maxMemoryBytes = 1 << 20;
    EXPECT_NE(syntaxErrorOf(many, configOf(3), limits).find("needs more than the 1048576 bytes"),
              std::string::npos)
        << syntaxErrorOf(many, configOf(3), limits);
}

TEST(BifsSyntax, WhatHasNoCodeIsNotWritten) {
    const auto error = [](const Command& command) {
        const std::vector<CommandFrame> frames{{0, {command}}};
        const NodeIds ids = assignNodeIds(frames);
        const auto bytes = BifsEncoder(fitBifsConfig({}, ids), {}, ids).encode(frames[0].commands);
        return bytes ? "written" : bytes.error().text();
    };
    const auto sceneWith = [](const NodePtr& child) {
        const NodePtr root = makeNode("Group");
        root->edit<NodeList>("children").push_back(child);
        return ReplaceScene{false, root, {}};
    };
    EXPECT_EQ(error(sceneWith(makeNode("DepthImage"))), "written");
    EXPECT_NE(error(sceneWith(makeNode("SimpleTexture")))
                  .find("SimpleTexture may not stand where SF3DNode"),
              std::string::npos);
    EXPECT_NE(error(sceneWith(nullptr)).find("NULL"), std::string::npos);
    EXPECT_NE(error(ReplaceScene{false, makeNode("Transform"), {}}).find("Transform"),
              std::string::npos);
    const NodePtr view = makeNode("DepthImage");
    const NodePtr texture = makeNode("SimpleTexture");
    const NodePtr image = makeNode("ImageTexture");
    image->set("url", std::vector<Url>{Url{1024, ""}});
    texture->set("texture", image);
    view->set("diTexture", texture);
    EXPECT_NE(error(sceneWith(view)).find("od:1024"), std::string::npos);
    const NodePtr pixels = makeNode("PixelTexture");
    pixels->set("image", PixelImage{4096, 1, 1, std::vector<std::uint8_t>(4096)});
    texture->set("texture", pixels);
    EXPECT_NE(error(sceneWith(view)).find("4096x1"), std::string::npos);

    // The fields of DepthImage and its textures are not eventIns, so they have no IN id.
    const NodePtr root = makeNode("Group");
    const NodePtr plain = makeNode("DepthImage");
    root->set("children", NodeList{plain});
    const std::vector<CommandFrame> frames{
        {0,
         {ReplaceScene{false, root, {}},
          ReplaceField{plain, plain->info->find("position"), glm::vec3(1)}}}};
    const NodeIds ids = assignNodeIds(frames);
    const auto bytes = BifsEncoder(fitBifsConfig({}, ids), {}, ids).encode(frames[0].commands);
    ASSERT_FALSE(bytes);
    EXPECT_NE(bytes.error().text().find("replace the node instead"), std::string::npos)
        << bytes.error().text();
}

/// What is said when a scene with a QuantizationParameter and a Transform is written.
std::string roundingOf(const std::string& parameter, const std::string& transform) {
    const Document document =
        mustReadBt("Group { children [ QuantizationParameter { isLocal FALSE " + parameter +
                   " } Transform { " + transform + " } ] }");
    Job job;
    EXPECT_TRUE(writeMp4(document, job));
    const std::string notes = fmt::format("{}", fmt::join(job.takeNotes(), "|"));
    // What was read back is on the codes.
    EXPECT_TRUE(writeMp4(throughMp4(document), job));
    EXPECT_TRUE(job.takeNotes().empty());
    return notes;
}

TEST(Quantisation, SaysByHowMuchItRounds) {
    const auto off = [](const char* most) {
        return fmt::format("a QuantizationParameter rounds values of the scene: at most {} off",
                           most);
    };
    const std::string places =
        "position3DQuant TRUE position3DMin -10 -10 -10 position3DMax 10 10 10 position3DNbBits 4";
    EXPECT_EQ(roundingOf(places, "translation 1.25 -10 10"), off("0.5833"));
    EXPECT_EQ(roundingOf(places, "translation 10 -10 10"), "");
    EXPECT_EQ(roundingOf("useEfficientCoding TRUE", "translation 1.25 0 -3"), "");
    EXPECT_EQ(roundingOf("useEfficientCoding TRUE", "translation 1.0001 0 0"), off("3.898e-05"));
    const std::string turns = "normalQuant TRUE normalNbBits 4";
    EXPECT_EQ(roundingOf(turns, "rotation 0 1 0 1.5707964"), "");
    EXPECT_EQ(roundingOf(turns, "rotation 0 1 0 0.1"), off("0.1"));
}

}  // namespace
}  // namespace stx::mpeg4

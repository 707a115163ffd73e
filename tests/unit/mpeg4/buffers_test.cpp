// Commands in the buffers of Conditional and InputSensor, in every form.

#include <gtest/gtest.h>

#include "tests/same_scenes.hpp"
#include "tests/unit/mpeg4/round_trips.hpp"

namespace stx::mpeg4 {
namespace {

/// The buffers of a document, in the order of its nodes and commands.
std::vector<CommandBuffer> buffersOf(const Document& document) {
    std::vector<CommandBuffer> buffers;
    for (const CommandFrame& frame : document.frames)
        for (const Command& command : frame.commands) {
            if (const auto* replace = std::get_if<ReplaceField>(&command))
                if (const auto* buffer = std::get_if<CommandBuffer>(&replace->value))
                    buffers.push_back(*buffer);
            forEachNode(command, [&](const NodePtr& node) {
                for (const Node::SetField& field : node->setFields)
                    if (const auto* buffer = std::get_if<CommandBuffer>(&field.value))
                        buffers.push_back(*buffer);
            });
        }
    return buffers;
}

/// Through .mp4, .bt and .xmt and all ways between them nothing changes, not a bit of a buffer.
void expectTheSameEverywhere(const Document& document, std::size_t count) {
    const auto buffers = buffersOf(document);
    ASSERT_EQ(buffers.size(), count);
    const Document mp4 = throughMp4(document);
    const Document bt = throughMp4(mustReadBt(btOf(mp4)));
    const Document xmt = throughMp4(throughXmt(mp4));
    const Document both = throughMp4(throughXmt(mustReadBt(btOf(mp4))));
    for (const Document* other : {&mp4, &bt, &xmt, &both}) {
        EXPECT_TRUE(sameFrames(document.frames, other->frames)) << btOf(document) << btOf(*other);
        EXPECT_EQ(buffersOf(*other), buffers) << btOf(document) << btOf(*other);
        EXPECT_EQ(btOf(*other), btOf(mp4));
    }
    Job job;
    const auto once = writeMp4(mp4, job), again = writeMp4(bt, job), third = writeMp4(xmt, job);
    ASSERT_TRUE(once && again && third);
    EXPECT_EQ(*once, *again);
    EXPECT_EQ(*once, *third);
}

/// What a buffer says, with the scene around it.
std::vector<Command> commandsOf(const Document& document, std::size_t number) {
    BufferScene scene;
    for (const CommandFrame& frame : document.frames)
        for (const Command& command : frame.commands)
            forEachNode(command, [&](const NodePtr& node) {
                if (node->defId != 0) scene.nodes.try_emplace(node->defId, node);
            });
    auto commands = BifsDecoder::decodeBuffer(buffersOf(document).at(number), scene, Limits());
    if (!commands) ADD_FAILURE() << commands.error().text();
    return commands ? std::move(*commands) : std::vector<Command>();
}

/// All commands, on nodes before, behind, around and of the buffer.
const char* const kAllCommands = R"(
DEF N0 Group {
  children [
    DEF N1 Transform { translation 1 0 0 }
    DEF N2 Conditional {
      buffer {
        REPLACE N1.translation BY 1 2 3
        REPLACE N4.whichChoice BY 1
        INSERT AT N0.children[1] DEF N7 Transform { children [ USE N1 DEF N8 Shape { } USE N8 ] }
        REPLACE N7.scale BY 2 2 2
        APPEND TO N0.children Group { children [ USE N7 ] }
        REPLACE N5.key[2] BY 0.5
        APPEND TO N5.key 0.75
        DELETE N5.key[0]
        INSERT DEF R3 ROUTE N5.value_changed TO N1.translation
        DELETE ROUTE R3
        REPLACE N1 BY NULL
        DELETE N0
      }
    }
    InputSensor { enabled FALSE buffer { DELETE N6 } url [10] }
    DEF N4 Switch { choice [ Group { } ] }
    DEF N5 PositionInterpolator { key [0 1 2] }
    DEF N6 Group { }
  ]
}
)";

TEST(Buffers, HoldAllCommands) {
    const Document document = mustReadBt(kAllCommands);
    expectTheSameEverywhere(document, 2);
    const auto commands = commandsOf(document, 0);
    ASSERT_EQ(commands.size(), 12u);
    const auto& first = std::get<ReplaceField>(commands[0]);
    EXPECT_TRUE(first.target->is("Transform"));
    EXPECT_EQ(std::get<glm::vec3>(first.value), glm::vec3(1, 2, 3));
    // A node of the scene is named, not brought once more; what is brought is shared.
    const auto& children = std::get<InsertNode>(commands[2]).node->get<NodeList>("children");
    ASSERT_EQ(children.size(), 3u);
    EXPECT_EQ(children[0], first.target);
    EXPECT_EQ(children[1], children[2]);
    EXPECT_EQ(std::get<ReplaceField>(commands[3]).target, std::get<InsertNode>(commands[2]).node);
    EXPECT_EQ(std::get<DeleteNode>(commands[11]).target,
              std::get<ReplaceScene>(document.frames[0].commands[0]).root);
}

TEST(Buffers, OfScenesWithNames) {
    const Document document = mustReadBt(R"(
DEF Root Group { children [
  DEF First Conditional { buffer {
    REPLACE Lamp.on BY FALSE
    APPEND TO Root.children DEF New Transform { children [ USE Lamp ] }
    REPLACE New.scale BY 2 2 2
    INSERT DEF Way ROUTE Touch.isOver TO Lamp.on
  } }
  DEF Second Conditional { buffer { APPEND TO Root.children DEF New Group { } DELETE New } }
  DEF Lamp PointLight { }
  DEF Touch TouchSensor { }
] })");
    expectTheSameEverywhere(document, 2);
    EXPECT_EQ(std::get<InsertRoute>(commandsOf(document, 0).at(3)).route.name, "Way");
}

TEST(Buffers, AsValuesOfCommandsAndInEachOther) {
    const Document document = mustReadBt(R"(
DEF N0 Group { children [
  DEF N1 Conditional { }
  DEF N2 Conditional { buffer {
    APPEND TO N0.children DEF N3 Conditional { buffer { DELETE N1 } }
    REPLACE N1.buffer BY { DELETE N2 }
    REPLACE N1.buffer BY { }
  } }
] }
AT 1000 { REPLACE N1.buffer BY { DELETE N0 } REPLACE N2.buffer BY { } }
)");
    expectTheSameEverywhere(document, 4);
    const auto& later = std::get<ReplaceField>(document.frames.at(1).commands.at(0));
    EXPECT_FALSE(std::get<CommandBuffer>(later.value).bytes.empty());
    const auto commands = commandsOf(document, 0);
    ASSERT_EQ(commands.size(), 3u);
    const auto& inner = std::get<InsertNode>(commands[0]).node->get<CommandBuffer>("buffer");
    EXPECT_EQ(inner.bytes.size(), 1u);
}

TEST(Buffers, InTheBodiesOfProtos) {
    const Document document = mustReadBt(R"(
PROTO Lit [ ] { DEF L PointLight { } DEF C Conditional { buffer { REPLACE L.on BY FALSE } } }
DEF A Group { children [ Lit { } DEF B Conditional { buffer { REPLACE A.children[0] BY Lit { } } } ] }
)");
    expectTheSameEverywhere(document, 1);
    const auto& scene = std::get<ReplaceScene>(document.frames[0].commands[0]);
    EXPECT_FALSE(scene.protos.at(0)->body.at(1)->get<CommandBuffer>("buffer").bytes.empty());
}

TEST(Buffers, MayReplaceTheScene) {
    const Document document = mustReadBt(R"(
DEF N0 Group { children [ DEF N1 Conditional { buffer {
  REPLACE SCENE BY DEF N0 Group { children [ DEF N1 PointLight { } USE N1 ] }
} } ] }
)");
    expectTheSameEverywhere(document, 1);
}

TEST(Buffers, OfOtherReadersAndWritersStayAsTheyAre) {
    // Bytes that say nothing pass from .mp4 to .mp4; a text has no form for them.
    const NodePtr root = makeNode("Group");
    const NodePtr conditional = makeNode("Conditional");
    conditional->set("buffer", CommandBuffer{{0x45, 0x05, 0xA0}, CommandCoding{.nodeIdBits = 3}});
    root->set("children", NodeList{conditional});
    Document document;
    document.bifsConfig.nodeIdBits = 3;
    document.frames = {{0, {ReplaceScene{false, root, {}}}}};
    EXPECT_EQ(buffersOf(throughMp4(document)), buffersOf(document));
    Job job;
    for (const auto& text : {writeBt(document, job), writeXmt(document, job)}) {
        ASSERT_FALSE(text);
        EXPECT_EQ(text.error().code, ErrorCode::unsupported);
        EXPECT_NE(text.error().message.find("which is not defined"), std::string::npos);
        EXPECT_NE(text.error().message.find("keep this presentation as .mp4"), std::string::npos);
    }
    // Wider ids than those that the commands are coded with would change what they say.
    document.bifsConfig.nodeIdBits = 4;
    const auto mp4 = writeMp4(document, job);
    ASSERT_FALSE(mp4);
    EXPECT_NE(mp4.error().message.find("ids of 3, 0 and 0 bits"), std::string::npos)
        << mp4.error().text();
}

TEST(Buffers, RefuseWhatTheyCannotHold) {
    const auto errorOf = [](const std::string& commands) {
        return btErrorOf("DEF N0 Group { children [ Conditional { buffer {" + commands + "} } ] }");
    };
    EXPECT_NE(errorOf(" DELETE N9 ").find("1:57: no node has the DEF name 'N9'"), std::string::npos)
        << errorOf(" DELETE N9 ");
    EXPECT_NE(errorOf("UPDATE OD [ ]").find("a buffer has commands of the scene only"),
              std::string::npos);
    EXPECT_NE(errorOf("REPLACE N0").find("expected BY"), std::string::npos);
    EXPECT_NE(btErrorOf("DEF N0 Group { children [ Conditional { buffer { DELETE N0")
                  .find("for the buffer that begins at 'test.bt':1:48"),
              std::string::npos);
    std::string deep = "DELETE N0";
    for (int i = 0; i < 5; ++i)
        deep = "APPEND TO N0.children Conditional { buffer { " + deep + " } }";
    EXPECT_NE(errorOf(deep).find("are nested more than 4 deep"), std::string::npos);
    EXPECT_NE(btErrorOf("PROTO P [ field SFBool b TRUE ] { DEF A Group { } Conditional { buffer { "
                        "APPEND TO A.children PointLight { on IS b } } } } Group { }")
                  .find("has no such links in BIFS"),
              std::string::npos);
    EXPECT_NE(btErrorOf("Group { children [ Conditional { buffer \"x\" } ] }")
                  .find("expected commands: { ... }"),
              std::string::npos);
    // A name in a buffer is of this buffer.
    EXPECT_NE(btErrorOf("DEF A Group { children [ Conditional { buffer { APPEND TO A.children DEF "
                        "B Group { } } } Conditional { buffer { DELETE B } } ] }")
                  .find("no node has the DEF name 'B'"),
              std::string::npos);
    Job job;
    const auto xmt = readXmt(
        "<XMT-A><Body><Replace><Scene><Group DEF=\"A\"><children><Conditional><buffer><par/>"
        "</buffer></Conditional></children></Group></Scene></Replace></Body></XMT-A>",
        "test.xmt", job);
    ASSERT_FALSE(xmt);
    EXPECT_NE(xmt.error().message.find("Replace, Insert or Delete in a buffer"), std::string::npos);
}

}  // namespace
}  // namespace stx::mpeg4

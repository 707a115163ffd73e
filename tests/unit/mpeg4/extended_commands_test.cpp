// Extended commands (ISO/IEC 14496-11, 8.6): read as plain ones that do the same, or carried.

#include <bit>

#include <gtest/gtest.h>

#include "formats/mpeg4/bifs/bit_stream.hpp"
#include "tests/same_scenes.hpp"
#include "tests/unit/mpeg4/round_trips.hpp"

namespace stx::mpeg4 {
namespace {

constexpr const char* kLight = R"(
Group { children [ DEF N0 PointLight { } ] }
AT 2000 { REPLACE N0.on BY FALSE }
)";

/// At 1000, between the two of kLight: an insert of kind 1, which is an extended command.
Document withExtendedCommand() {
    Document document = mustReadBt(kLight);
    document.bifsConfig = fitBifsConfig(document.bifsConfig, assignNodeIds(document.frames));
    CommandFrame frame;
    frame.time = 1000;
    frame.coded = CommandBuffer{{0x1F, 0x55, 0xAA}, codingOf(document.bifsConfig, false)};
    document.frames.insert(document.frames.begin() + 1, frame);
    return document;
}

TEST(ExtendedCommands, StayAsTheyAreAndLoseNothingElse) {
    const Document document = withExtendedCommand();
    const Document back = throughMp4(document);
    ASSERT_EQ(back.frames.size(), 3u);
    ASSERT_TRUE(back.frames[1].coded);
    EXPECT_EQ(back.frames[1].coded->bytes, document.frames[1].coded->bytes);
    EXPECT_EQ(back.frames[2].commands.size(), 1u);
    EXPECT_TRUE(sameFrames(back.frames, throughMp4(back).frames));
    const auto scene = composeScene(back.frames);
    ASSERT_TRUE(scene) << scene.error().text();
    // Texts have the rest.
    EXPECT_EQ(mustReadBt(btOf(back)).frames.size(), 2u);
    EXPECT_EQ(throughXmt(back).frames.size(), 2u);
}

TEST(ExtendedCommands, AreRefusedWhereIdsGetWider) {
    Document document = withExtendedCommand();
    document.bifsConfig.nodeIdBits = 9;
    Job job;
    const auto bytes = writeMp4(document, job, {});
    ASSERT_FALSE(bytes);
    EXPECT_EQ(bytes.error().code, ErrorCode::unsupported);
    EXPECT_TRUE(bytes.error().text().find("not known here") != std::string::npos)
        << bytes.error().text();
}

TEST(ExtendedCommands, InTheFirstAccessUnitAreAnError) {
    Document document = withExtendedCommand();
    document.frames.erase(document.frames.begin());
    Job job;
    const auto bytes = writeMp4(document, job, {});
    EXPECT_TRUE(!bytes || !readMp4(ByteSource::fromBytes(*bytes), job));
}

/// The numbers of the extended commands.
enum CommandKind {
    insertProto,
    deleteProto,
    deleteAllProtos,
    manyItems,
    manyFields,
    globalQp,
    xDelete
};

/// An access unit of one extended command and what `more` writes, for the scene of a document.
class ExtendedUnit {
  public:
    ExtendedUnit(const Document& document, CommandKind kind)
        : document_(document), ids_(assignNodeIds(document.frames)) {
        out.write(1, 4);  // insert, extended
        out.write(kind, 8);
    }
    void target(const std::string& name) {
        out.write(ids_.nodes.at(find(name).get()) - 1, document_.bifsConfig.nodeIdBits);
    }
    NodePtr find(const std::string& name) const {
        NodePtr found;
        const auto& scene = std::get<ReplaceScene>(document_.frames.at(0).commands.at(0));
        forEachNode(scene.root, [&](const NodePtr& node) {
            if (node->defName == name) found = node;
        });
        return found;
    }
    void number(float value) { out.write(std::bit_cast<std::uint32_t>(value), 32); }
    /// `field` of `node`, as one of a list of fields.
    void listed(const Node& node, const std::string& field) {
        out.flag(false);
        const auto& fields = node.info->fields;
        out.write(static_cast<std::uint32_t>(
                      fields[static_cast<std::size_t>(node.info->find(field))].defId),
                  node.info->defBits);
    }
    /// A node of a type where any may be, up to its DEF, which it does not have.
    void beginNode(const Node& node) {
        const NodeCode* code = node.info->codeIn(Ndt::SFWorldNode);
        out.flag(false);
        for (int version = 1; version < code->version; ++version)
            out.write(0, *codeBits(Ndt::SFWorldNode, version));
        out.write(static_cast<std::uint32_t>(code->code),
                  *codeBits(Ndt::SFWorldNode, code->version));
        out.flag(false);
    }
    /// `document` with this unit at 1000.
    Document in() {
        out.flag(false);  // no more commands
        const Bytes bytes = out.finish();
        const auto* first = reinterpret_cast<const std::uint8_t*>(bytes.data());
        Document with = document_;
        CommandFrame frame;
        frame.time = 1000;
        frame.coded =
            CommandBuffer{{first, first + bytes.size()}, codingOf(document_.bifsConfig, false)};
        with.frames.insert(with.frames.begin() + 1, frame);
        return with;
    }
    BitWriter out;

  private:
    Document document_;
    NodeIds ids_;
};

Document fitted(const std::string& bt) {
    Document document = mustReadBt(bt);
    document.bifsConfig = fitBifsConfig(document.bifsConfig, assignNodeIds(document.frames));
    std::get<ReplaceScene>(document.frames.at(0).commands.at(0)).useNames = false;
    return document;
}

/// What a document shows at a time, when it was written as .mp4 and read; and again as .mp4, .bt
/// and .xmt, which must show the same. Nothing is carried as bytes.
NodePtr shown(const Document& document, std::uint64_t until) {
    const Document back = throughMp4(document);
    NodePtr root;
    for (const Document& form :
         {back, throughMp4(back), mustReadBt(btOf(back)), throughXmt(back)}) {
        for (const CommandFrame& frame : form.frames) EXPECT_FALSE(frame.coded);
        const auto scene = composeScene(form.frames, until);
        if (!scene) {
            ADD_FAILURE() << scene.error().text();
            continue;
        }
        if (!root) root = scene->root;
        EXPECT_TRUE(sameNode(root, scene->root, {.ids = false, .names = false}));
    }
    return root ? root : makeNode("Group");
}

const NodePtr& child(const NodePtr& node, std::size_t index) {
    return node->get<NodeList>("children").at(index);
}

TEST(ExtendedCommands, ReplaceManyFieldsAsAMaskOrAList) {
    const Document document = fitted("Group { children [ DEF L PointLight { } ] }");
    for (const bool mask : {true, false}) {
        ExtendedUnit unit(document, manyFields);
        const NodePtr light = unit.find("L");
        unit.target("L");
        unit.out.flag(mask);
        for (const int index : light->info->defFields) {
            const std::string& name = light->info->fields[static_cast<std::size_t>(index)].name;
            const bool replaced = name == "intensity" || name == "location";
            if (mask) unit.out.flag(replaced);
            if (!replaced) continue;
            if (!mask) unit.listed(*light, name);
            unit.number(0.25f);
            if (name == "intensity") continue;
            unit.number(2);
            unit.number(3);
        }
        if (!mask) unit.out.flag(true);
        const Document changed = unit.in();
        const NodePtr now = child(shown(changed, 1000), 0);
        EXPECT_EQ(now->get<float>("intensity"), 0.25f);
        EXPECT_EQ(now->get<glm::vec3>("location"), glm::vec3(0.25f, 2, 3));
        EXPECT_EQ(child(shown(changed, 999), 0)->get<float>("intensity"), 1);
    }
}

TEST(ExtendedCommands, ReplaceManyFieldsThatNoPlainCommandReaches) {
    const Document document = fitted(
        "Group { children [ DEF V DepthImage { nearPlane 2 diTexture SimpleTexture { depth "
        "PixelTexture { image 1 1 1 9 } texture PixelTexture { image 1 1 1 9 } } } ] }");
    ExtendedUnit unit(document, manyFields);
    unit.target("V");
    unit.out.flag(false);
    unit.listed(*unit.find("V"), "position");
    for (int i = 0; i < 3; ++i) unit.number(static_cast<float>(i));
    unit.out.flag(true);
    unit.out.flag(true);   // another command, for what is there by now:
    unit.out.write(1, 4);  // an extended one,
    unit.out.write(manyFields, 8);
    unit.target("V");
    unit.out.flag(false);
    unit.listed(*unit.find("V"), "farPlane");
    unit.number(8);
    unit.out.flag(true);
    const NodePtr view = child(shown(unit.in(), 1000), 0);
    EXPECT_EQ(view->get<glm::vec3>("position"), glm::vec3(0, 1, 2));
    EXPECT_EQ(view->get<float>("nearPlane"), 2);
    EXPECT_EQ(view->get<float>("farPlane"), 8);
    EXPECT_TRUE(view->get<NodePtr>("diTexture"));
}

TEST(ExtendedCommands, ReplaceManyItems) {
    const Document document = fitted(
        "Group { children [ DEF K ScalarInterpolator { key [0 0.5 1] keyValue [1 2 3] } ] }");
    ExtendedUnit unit(document, manyItems);
    const NodePtr node = unit.find("K");
    unit.target("K");
    const auto field = static_cast<std::size_t>(node->info->find("keyValue"));
    unit.out.write(static_cast<std::uint32_t>(node->info->fields[field].inId), node->info->inBits);
    unit.out.write(2, 5);  // bits of a position
    unit.out.write(2, 5);  // bits of their number
    unit.out.write(2, 2);
    for (const std::uint32_t index : {2u, 0u}) {
        unit.out.write(index, 2);
        unit.number(7 + static_cast<float>(index));
    }
    EXPECT_EQ(child(shown(unit.in(), 1000), 0)->get<std::vector<float>>("keyValue"),
              (std::vector<float>{7, 2, 9}));
}

TEST(ExtendedCommands, QuantiseWhatComesLater) {
    const Document document = fitted("Group { children [ DEF L PointLight { } ] }");
    ExtendedUnit unit(document, globalQp);
    const NodePtr light = unit.find("L");
    const NodePtr quantised = makeNode("QuantizationParameter");
    unit.beginNode(*quantised);
    unit.out.flag(false);  // a list of fields
    unit.listed(*quantised, "position3DQuant");
    unit.out.flag(true);
    unit.listed(*quantised, "position3DMin");
    for (int i = 0; i < 3; ++i) unit.number(0);
    unit.listed(*quantised, "position3DMax");
    for (int i = 0; i < 3; ++i) unit.number(255);
    unit.listed(*quantised, "position3DNbBits");
    unit.out.write(8, 32);
    unit.out.flag(true);
    unit.out.flag(true);   // another command:
    unit.out.write(9, 4);  // replace a field
    unit.target("L");
    const auto field = static_cast<std::size_t>(light->info->find("location"));
    unit.out.write(static_cast<std::uint32_t>(light->info->fields[field].inId),
                   light->info->inBits);
    for (const std::uint32_t value : {10u, 20u, 30u}) unit.out.write(value, 8);
    EXPECT_EQ(child(shown(unit.in(), 1000), 0)->get<glm::vec3>("location"), glm::vec3(10, 20, 30));
}

TEST(ExtendedCommands, DeleteNodes) {
    ExtendedUnit unit(fitted("Group { children [ DEF L PointLight { } Group { } ] }"), xDelete);
    unit.target("L");
    EXPECT_TRUE(child(shown(unit.in(), 1000), 0)->is("Group"));
}

TEST(ExtendedCommands, DeclareProtosForLaterOnes) {
    Document document = fitted("DEF G Group { children [ Group { } ] }");
    document.bifsConfig.version = 2;
    document.bifsConfig.protoIdBits = 1;
    ExtendedUnit unit(document, insertProto);
    const NodePtr light = makeNode("PointLight");
    unit.out.flag(true);
    unit.out.write(0, 1);  // its id
    unit.out.write(0, 3);  // no interface; not extern; no PROTOs
    unit.beginNode(*light);
    unit.out.flag(false);  // a list of fields
    unit.out.write(0, 2);  // one; it has a value
    const auto field = static_cast<std::size_t>(light->info->find("intensity"));
    unit.out.write(static_cast<std::uint32_t>(light->info->fields[field].defId),
                   light->info->defBits);
    unit.number(0.5f);
    unit.out.flag(true);
    unit.out.write(0, 2);  // the body ends; no ROUTEs
    unit.out.write(0, 2);  // neither quantised nor animated
    unit.out.flag(false);  // no more PROTOs
    unit.out.flag(true);   // another command:
    unit.out.write(0, 4);  // insert a node
    unit.target("G");
    unit.out.write(3, 2);  // at the end
    unit.out.flag(false);
    unit.out.write(0, *codeBits(Ndt::SF3DNode, 1));
    unit.out.write(1, *codeBits(Ndt::SF3DNode, 2));
    unit.out.write(0, 1);  // the PROTO's id
    unit.out.write(1, 3);  // no DEF, an empty list
    const NodePtr instance = child(shown(unit.in(), 1000), 1);
    ASSERT_TRUE(instance->proto);
    std::size_t copied = 0;
    EXPECT_EQ(bodyOf(*instance, copied).front()->get<float>("intensity"), 0.5f);
}

TEST(ExtendedCommands, ThatAreBrokenAreCarried) {
    const Document document = fitted("Group { children [ DEF L PointLight { } ] }");
    ExtendedUnit unit(document, manyFields);
    unit.target("L");
    const Document back = throughMp4(unit.in());
    ASSERT_EQ(back.frames.size(), 2u);
    EXPECT_TRUE(back.frames[1].coded);
    EXPECT_TRUE(back.frames[1].commands.empty());
}

TEST(ExtendedCommands, InTheSceneItselfLeaveTheScene) {
    Document document = fitted("Group { children [ DEF L PointLight { } ] }");
    const Bytes all = [&] {
        BifsEncoder encoder(document.bifsConfig, {}, assignNodeIds(document.frames));
        return *encoder.encode(document.frames[0].commands);
    }();
    // The bit that ends the access unit is the last one that is not padding: all that follow the
    // scene are zero, so a scene with one more command has it set.
    BifsDecoder decoder(document.bifsConfig, Limits());
    ASSERT_TRUE(decoder.decode(all));
    BitReader in(all);
    BitWriter out;
    for (std::uint64_t left = in.left() - decoder.bitsLeft(); left > 1; --left) out.flag(in.flag());
    out.flag(true);
    out.write(1, 4);
    out.write(99, 8);
    const Bytes bytes = out.finish();
    const auto* first = reinterpret_cast<const std::uint8_t*>(bytes.data());
    document.frames[0].coded =
        CommandBuffer{{first, first + bytes.size()}, codingOf(document.bifsConfig, false)};
    const Document back = throughMp4(document);
    ASSERT_EQ(back.frames.size(), 1u);
    EXPECT_TRUE(back.frames[0].coded);
    const auto scene = composeScene(back.frames);
    ASSERT_TRUE(scene) << scene.error().text();
    EXPECT_TRUE(child(scene->root, 0)->is("PointLight"));
    EXPECT_EQ(mustReadBt(btOf(back)).frames.size(), 1u);
}

TEST(ExtendedCommands, OfProtosThatAreDeletedChangeNothing) {
    for (const CommandKind kind : {deleteProto, deleteAllProtos}) {
        ExtendedUnit unit(fitted("PROTO P [ ] { Group { } } DEF G Group { children [ P { } ] }"),
                          kind);
        if (kind == deleteProto) {
            unit.out.flag(false);
            unit.out.write(1, 5);
            unit.out.write(1, 1);
            unit.out.write(0, fitted("PROTO P [ ] { Group { } } Group { children [ P { } ] }")
                                  .bifsConfig.protoIdBits);
        }
        EXPECT_TRUE(child(shown(unit.in(), 1000), 0)->proto);
    }
}

}  // namespace
}  // namespace stx::mpeg4

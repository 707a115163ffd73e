// Commands in text on what has a name, ROUTEs and nodes, as this program and others write them.

#include <bitset>

#include <gtest/gtest.h>

#include "formats/mpeg4/text/bt.hpp"
#include "formats/mpeg4/text/xmt.hpp"
#include "tests/same_scenes.hpp"
#include "tests/unit/mpeg4/round_trips.hpp"

namespace stx::mpeg4 {
namespace {

constexpr const char* kScene = R"(
DEF N0 Group { children [ DEF N1 PointLight { } DEF N2 TouchSensor { } ] }
AT 1000 { INSERT ROUTE DEF R2 N2.isOver TO N1.on }
AT 2000 { REPLACE ROUTE R2 BY N2.isActive TO N1.on DELETE ROUTE R2 }
)";

TEST(RouteCommands, NamesStandBehindTheWord) {
    const Document document = mustReadBt(kScene);
    EXPECT_EQ(std::get<InsertRoute>(document.frames.at(1).commands.at(0)).route.id, 3u);
    Job job;
    const auto text = writeBt(document, job);
    ASSERT_TRUE(text) << text.error().text();
    EXPECT_NE(text->find("INSERT ROUTE DEF R2 N2.isOver TO N1.on"), std::string::npos) << *text;
}

TEST(RouteCommands, ReachRoutesThatHaveAnotherName) {
    Document document = mustReadBt(kScene);
    // As of a presentation whose names are kept (USENAMES).
    std::get<InsertRoute>(document.frames.at(1).commands.at(0)).route.name = "R1";
    Job job;
    const auto text = writeBt(document, job);
    ASSERT_TRUE(text) << text.error().text();
    const Document back = mustReadBt(*text);
    EXPECT_EQ(std::get<InsertRoute>(back.frames.at(1).commands.at(0)).route.id,
              std::get<ReplaceRoute>(back.frames.at(2).commands.at(0)).routeId);
}

constexpr const char* kNamed = R"(
DEF A Group { children [ DEF B PointLight { } DEF C TouchSensor { } ] }
DEF First ROUTE C.isOver TO B.on
AT 1000 { INSERT ROUTE DEF R0 C.isOver TO B.on INSERT ROUTE DEF Other C.isOver TO B.on }
AT 2000 { REPLACE ROUTE First BY C.isActive TO B.on DELETE ROUTE Other }
)";

/// The ids of the ROUTEs that the commands of kNamed mean: First, Other.
void expectReached(const Document& document) {
    ASSERT_EQ(document.frames.size(), 3u);
    const auto& scene = std::get<ReplaceScene>(document.frames[0].commands.at(0));
    const auto& other = std::get<InsertRoute>(document.frames[1].commands.at(1));
    const auto& replace = std::get<ReplaceRoute>(document.frames[2].commands.at(0));
    const auto& erase = std::get<DeleteRoute>(document.frames[2].commands.at(1));
    EXPECT_EQ(scene.routes.at(0).name, "First");
    EXPECT_NE(scene.routes.at(0).id, 0u);
    EXPECT_EQ(scene.routes.at(0).id, replace.routeId);
    EXPECT_EQ(other.route.name, "Other");
    EXPECT_NE(other.route.id, 0u);
    EXPECT_EQ(other.route.id, erase.routeId);
    EXPECT_NE(replace.routeId, erase.routeId);
    // R0 keeps its number.
    EXPECT_EQ(std::get<InsertRoute>(document.frames[1].commands.at(0)).route.id, 1u);
}

TEST(RouteCommands, ReachRoutesByAnyName) {
    const Document document = mustReadBt(kNamed);
    expectReached(document);
    expectReached(throughMp4(document));
    const std::string text = btOf(throughMp4(document));
    EXPECT_NE(text.find("REPLACE ROUTE First BY"), std::string::npos) << text;
    EXPECT_NE(text.find("DELETE ROUTE Other"), std::string::npos) << text;
    expectReached(mustReadBt(text));
    expectReached(throughXmt(document));
}

TEST(RouteCommands, FindARouteThatWasReplaced) {
    const Document document = mustReadBt(R"(
DEF A Group { children [ DEF B PointLight { } DEF C TouchSensor { } ] }
DEF R ROUTE C.isOver TO B.on
AT 1000 { REPLACE ROUTE R BY C.isActive TO B.on }
AT 2000 { REPLACE ROUTE R BY C.isOver TO B.on }
AT 3000 { DELETE ROUTE R }
)");
    for (const Document& form : {document, throughXmt(document), throughMp4(document)}) {
        const auto between = composeScene(form.frames, 2000), end = composeScene(form.frames);
        ASSERT_TRUE(between && end);
        ASSERT_EQ(between->routes.size(), 1u);
        const Route& route = between->routes[0];
        EXPECT_EQ(route.from->info->fields[route.fromField].name, "isOver");
        EXPECT_TRUE(end->routes.empty());
    }
}

TEST(RouteCommands, NameRoutesThatAreThere) {
    EXPECT_NE(
        btErrorOf("Group { } AT 1 { DELETE ROUTE Nowhere }").find("no ROUTE has the DEF name"),
        std::string::npos);
}

TEST(RouteCommands, NumberedRoutesAndNodesHaveNamesWhereNamesAreCoded) {
    const Document document = mustReadBt(
        "DEF A Group { children [ DEF N3 PointLight { } DEF N7 TouchSensor { } ] }"
        " DEF R1 ROUTE N7.isOver TO N3.on");
    Job job;
    const auto bytes =
        BifsEncoder(fitBifsConfig(document.bifsConfig, assignNodeIds(document.frames)), {},
                    assignNodeIds(document.frames))
            .encode(document.frames.at(0).commands);
    ASSERT_TRUE(bytes) << bytes.error().text();
    // Names are at any bit.
    const auto holds = [&](const std::string& name) {
        std::string bits, wanted;
        for (const std::byte b : *bytes)
            bits += std::bitset<8>(std::to_integer<unsigned>(b)).to_string();
        for (const char c : name + '\0')
            wanted += std::bitset<8>(static_cast<unsigned char>(c)).to_string();
        return bits.find(wanted) != std::string::npos;
    };
    EXPECT_TRUE(holds("N3"));
    EXPECT_TRUE(holds("R1"));
    EXPECT_TRUE(sameFrames(document.frames, throughMp4(document).frames, {.ids = false}));
}

constexpr const char* kMoving = R"(
DEF A Group { children [ DEF m0 Viewpoint { } DEF N5 PointLight { } ] }
AT 1000 { REPLACE m0 BY DEF m0 Viewpoint { position 1 0 0 } REPLACE N5 BY DEF N5 PointLight { } }
AT 2000 { REPLACE m0 BY DEF m0 Viewpoint { position 2 0 0 } REPLACE N5 BY DEF N5 PointLight { } }
)";

TEST(ReplacedNodes, HaveNamesInTextThatNoOtherNodeHas) {
    // A second DEF of one name gets another id from other programs, which then miss the first.
    const Document document = mustReadBt(kMoving);
    const std::string text = btOf(document);
    for (const char* line : {"REPLACE m0 BY DEF m0_2 ", "REPLACE m0_2 BY DEF m0_3 ",
                             "REPLACE N5 BY DEF N5_2 ", "REPLACE N5_2 BY DEF N5_3 "})
        EXPECT_NE(text.find(line), std::string::npos) << line << text;
    // Read again they are one name and one id.
    EXPECT_TRUE(sameFrames(document.frames, mustReadBt(text).frames)) << text;
    EXPECT_TRUE(sameFrames(document.frames, throughXmt(document).frames));
}

TEST(ReplacedNodes, KeepTheirNameWhereTheOtherIsInThem) {
    const Document document = mustReadBt(
        "Group { children [ DEF a Group { } ] }"
        " AT 1 { REPLACE a BY DEF a_2 Group { children [ USE a ] } }");
    const auto& replace = std::get<ReplaceNode>(document.frames.at(1).commands.at(0));
    EXPECT_EQ(replace.replacement->defName, "a_2");
}

TEST(ObjectDescriptorRemove, IsReadInEitherSpelling) {
    const auto read = [](const std::string& attribute) {
        Job job;
        return readXmt(
            "<XMT-A><Header/><Body><Replace><Scene><Group/></Scene></Replace>"
            "<par begin=\"1\"><ObjectDescriptorRemove " +
                attribute + "/></par></Body></XMT-A>",
            "a.xmt", job);
    };
    for (const char* attribute : {"objectDescriptorID=\"od11\"", "objectDescriptorId=\"od11\""}) {
        const auto document = read(attribute);
        ASSERT_TRUE(document) << document.error().text();
        const auto& command = document->odFrames.back().commands.back();
        EXPECT_EQ(std::get<RemoveObjectDescriptors>(command).ids, std::vector<int>{11});
    }
    EXPECT_FALSE(read("other=\"od11\""));
}

}  // namespace
}  // namespace stx::mpeg4

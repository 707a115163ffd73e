// Commands on ROUTEs in text, as this program and others write them.

#include <gtest/gtest.h>

#include "formats/mpeg4/text/bt.hpp"
#include "formats/mpeg4/text/xmt.hpp"
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

// How BT texts may begin, and how their lines may end.

#include "tests/unit/mpeg4/round_trips.hpp"

namespace stx::mpeg4 {
namespace {

std::optional<Mpeg4Container> containerOf(std::string_view text) {
    return mpeg4ContainerOf(std::as_bytes(std::span(text)));
}

}  // namespace

TEST(BtBeginnings, AreRecognised) {
    for (const char* text :
         {"InitialObjectDescriptor {", "InitialObjectDescriptor{", "Group { children [] }",
          "Group{ children [] }", "OrderedGroup\n{", "Layer2D {", "Layer3D {", "DEF R Group {",
          "PROTO P [] { Group {} }", "EXTERNPROTO P [] \"u\"", "AT 0 { }", "RAP AT 0 { }",
          "# by hand\nGroup {", "\n # a\r\n# b\rGroup {", "# a\n\n\t, DEF R Group {"})
        EXPECT_EQ(containerOf(text), Mpeg4Container::bt) << text;
}

TEST(BtBeginnings, OfOtherTextsAreNot) {
    for (const char* text :
         {"", "# Group {", "#VRML V2.0 utf8\nGroup {", "#X3D V3.0 utf8\nGroup {", "Groups {",
          "ATTRIBUTES", "# timestamp x\n1 2 3", "{\"Group\": 1}", "ply\nDEF", "v 0 0 0\nGroup {"})
        EXPECT_FALSE(containerOf(text)) << text;
}

TEST(BtLines, EndInAnyWay) {
    for (const char* end : {"\n", "\r\n", "\r"}) {
        SCOPED_TRACE(end[0] == '\n' ? "LF" : end[1] == '\n' ? "CR LF" : "CR");
        std::string text;
        for (const char* line : {"# by hand", "Group { # a scene", " children [", "  Depth { }"})
            text += std::string(line) + end;
        EXPECT_EQ(btErrorOf(text),
                  "'test.bt':4:3: found 'Depth', expected a node such as DepthImage, or a PROTO "
                  "declared before it");
        text.replace(text.find("Depth {"), 5, "Group");
        EXPECT_EQ(btErrorOf(text + "] }"), "no error");
    }
}

}  // namespace stx::mpeg4

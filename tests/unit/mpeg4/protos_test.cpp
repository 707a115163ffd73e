// PROTOs and Scripts: declared fields, bodies, instances and programs in every form.

#include <gtest/gtest.h>

#include "formats/mpeg4/bifs/script_code.hpp"
#include "formats/mpeg4/text/bt.hpp"
#include "formats/mpeg4/text/xmt.hpp"
#include "tests/same_scenes.hpp"
#include "tests/unit/mpeg4/core_fixtures.hpp"
#include "tests/unit/mpeg4/mapping_fixtures.hpp"
#include "tests/unit/mpeg4/round_trips.hpp"

namespace stx::mpeg4 {
namespace {

void expectKeptEverywhere(const Document& document) {
    for (const BifsStyle style : {BifsStyle::maskAndVector(), BifsStyle::shortest()}) {
        const Document mp4 = throughMp4(document, style);
        EXPECT_TRUE(sameFrames(document.frames, mp4.frames, {.ids = false}))
            << btOf(document) << "\n"
            << btOf(mp4);
    }
    const Document bt = mustReadBt(btOf(document));
    EXPECT_TRUE(sameFrames(document.frames, bt.frames, {.ids = false})) << btOf(document);
    const Document xmt = throughXmt(document);
    EXPECT_TRUE(sameFrames(document.frames, xmt.frames, {.ids = false})) << btOf(xmt);
}

// ---- programs

/// The source that the code of a program gives.
Result<std::string> throughCode(std::string_view source, std::vector<std::string> names = {}) {
    BitWriter out;
    STX_CHECK(writeScript(out, source, names, 200));
    const Bytes bytes = out.finish();
    BitReader in(bytes);
    return readScript(in, names, 250, 1 << 20);
}

TEST(ScriptCode, ProgramsComeBackAsTheyMean) {
    const auto once = throughCode(R"(javascript:
// a remark
function start(value, time) {
    var a, b = 2, c = [0].length;
})");
    EXPECT_FALSE(once) << "an array literal has no form";
    const auto text = throughCode(R"(javascript:
// a remark
function start(value, time) {
    var a = 1, b = 2.5e-3;   /* two */
    if (value && !(a + b) * 2 - -b > 0x10) { out = new SFVec3f(a, b, 0); } else if (a) b++;
    else { --a; }
    for (var i = 0; i < 10; i++) total += list[i].x << 1;
    while (a != b) { a = a > b ? a - b : b - a; continue; }
    switch (a) { case 1: b = 'one'; break; case 2: { b = "it's"; } default: f(a)(); }
    return true, false;
})");
    EXPECT_FALSE(text) << "a call of a call has no form";
    const std::string source = R"(javascript:
function start(value, time) {
    var a = 1, b = 2.5e-3;
    if (value && !(a + b) * 2 - -b > 0x10) { out = new SFVec3f(a, b, 0); } else if (a) b++;
    else { --a; }
    for (var i = 0; i < 10; i++) total += list[i].x << 1;
    while (a != b) { a = a > b ? a - b : b - a; continue; }
    switch (a) { case 1: b = 'one'; break; case 2: { b = "it's"; } default: f(a); }
    done = function (x) { return x; };
    obj.call(1, 2).next[3, 4] = 0.5;
    return true, false;
}
function empty() { ; })";
    const auto first = throughCode(source, {"value", "out", "list"});
    ASSERT_TRUE(first) << first.error().text();
    EXPECT_EQ(*first, R"(javascript:
function start(value, time) {
 var a = 1, b = 2.5E-3;
 if (value && !(a + b) * 2 - -b > 16) {
  out = new SFVec3f(a, b, 0);
 } else {
  if (a) b++; else {
   --a;
  }
 }
 for (var i = 0; i < 10; i++) total += list[i].x << 1;
 while (a != b) {
  a = a > b ? a - b : b - a;
  continue;
 }
 switch (a) {
 case 1: {
  b = 'one';
  break;
 }
 case 2: {
  b = "it's";
 }
 default: {
  f(a);
 }
 }
 done = function (x) {
  return x;
 };
 obj.call(1, 2).next[3, 4] = 0.5;
 return true, false;
}
function empty() {
}
)");
    const auto second = throughCode(*first, {"value", "out", "list"});
    ASSERT_TRUE(second) << second.error().text();
    EXPECT_EQ(*second, *first);
}

TEST(ScriptCode, WhatHasNoFormIsSaidWithItsLine) {
    const auto errorOf = [](std::string_view source) {
        const auto text = throughCode(source);
        return text ? "coded" : text.error().text();
    };
    EXPECT_EQ(errorOf(""), "coded");
    EXPECT_NE(errorOf("http://example.org/a.js").find("javascript:"), std::string::npos);
    EXPECT_NE(errorOf("javascript: function f() {\n a === b; }").find("'===' "), std::string::npos)
        << errorOf("javascript: function f() {\n a === b; }");
    EXPECT_NE(errorOf("javascript:\nvar a;").find("'var' outside of functions in line 2"),
              std::string::npos)
        << errorOf("javascript:\nvar a;");
    EXPECT_NE(errorOf("javascript: function f() { a = 'x").find("string without an end"),
              std::string::npos);
    std::string deep = "javascript: function f() { a = ";
    for (int i = 0; i < 1000; ++i) deep += '(';
    EXPECT_NE(errorOf(deep).find("nests deeper"), std::string::npos) << errorOf(deep);
    std::string sum = "javascript: function f() { a = 1";
    for (int i = 0; i < 1000; ++i) sum += " + 1";
    EXPECT_NE(errorOf(sum + "; }").find("nests deeper"), std::string::npos);
}

constexpr const char* kScript = R"(Group { children [
  DEF T Transform { }
  DEF S Script {
    eventIn SFBool start
    eventOut SFVec3f moved
    field SFInt32 count 3
    field MFString names ["a" "b"]
    field SFNode target USE T
    field MFNode all [ USE T WorldInfo { title "x" } ]
    field MFBool marks [TRUE FALSE TRUE]
    field MFImage tiles [1 1 1 0xFF 2 1 3 0x102030 0x405060]
    directOutput TRUE
    url "javascript: function start(value) { count++; moved = new SFVec3f(count, 0, 0); }"
  }
  DEF TOUCH TouchSensor { }
  DEF EMPTY Script { eventIn SFTime tick }
] }
ROUTE TOUCH.isActive TO S.start
ROUTE S.moved TO T.translation
)";

TEST(Script, FieldsAndProgramAreKeptInEveryForm) {
    const Document read = mustReadBt(kScript);
    // The source of the program once becomes that of its code.
    const Document document = throughMp4(read);
    ASSERT_EQ(document.frames.size(), 1u);
    const auto& scene = std::get<ReplaceScene>(document.frames[0].commands.at(0));
    const NodePtr script = scene.root->get<NodeList>("children").at(1);
    ASSERT_EQ(ownFieldCount(*script), 8);
    EXPECT_EQ(script->get<std::int32_t>("count"), 3);
    EXPECT_EQ(script->get<NodePtr>("target"), scene.root->get<NodeList>("children").at(0));
    EXPECT_TRUE(script->get<bool>("directOutput"));
    EXPECT_EQ(script->get<std::vector<bool>>("marks"), (std::vector<bool>{true, false, true}));
    ASSERT_EQ(script->get<std::vector<PixelImage>>("tiles").size(), 2u);
    EXPECT_EQ(script->get<std::vector<PixelImage>>("tiles")[1].pixels.at(3), 0x40);
    EXPECT_EQ(script->get<std::vector<ScriptText>>("url").at(0).text,
              "javascript:\nfunction start(value) {\n count++;\n moved = new SFVec3f(count, 0, "
              "0);\n}\n");
    ASSERT_EQ(scene.routes.size(), 2u);
    EXPECT_EQ(scene.routes[1].from, script);
    EXPECT_EQ(script->info->fields.at(static_cast<std::size_t>(scene.routes[1].fromField)).name,
              "moved");
    expectKeptEverywhere(document);
    // Commands work on copies.
    EXPECT_TRUE(composeScene(document.frames));
}

TEST(Script, ErrorsNameWhatIsWrong) {
    EXPECT_NE(btErrorOf("Group { children Script { field SFInt32 url 3 } }").find("name is taken"),
              std::string::npos);
    EXPECT_NE(btErrorOf("Group { children Script { exposedField SFInt32 a 3 } }").find("the kind"),
              std::string::npos);
    EXPECT_NE(btErrorOf("Group { children Script { field SFFoo a 3 } }").find("'SFFoo'"),
              std::string::npos);
    EXPECT_NE(btErrorOf("Group { children Script { eventIn SFInt32 a 3 } }").find("'3'"),
              std::string::npos);
}

// ---- PROTOs

constexpr const char* kProto = R"(
EXTERNPROTO Far [ field SFColor c 1 0 0  eventIn SFTime go ] ["far.mp4#Far"]
PROTO View [
  field SFVec3f place 0 0 10
  exposedField SFVec3f shift 0 0 0
  field SFNode picture NULL
  eventIn SFBool touched
  field MFNode more []
  field MFBool flags [FALSE TRUE]
  exposedField MFImage tiles []
] {
  PROTO Inner [ field SFNode content NULL ] { Group { children [ Inner2 { } ] } }
  DEF T Transform {
    translation IS shift
    children [
      DepthImage { position IS place nearPlane 1 farPlane 20 diTexture SimpleTexture { depth IS picture } }
      Group { children IS more }
    ]
  }
  DEF S Script { eventIn SFBool hit IS touched eventOut SFVec3f out url "javascript:
" }
  ROUTE S.out TO T.translation
}
Group { children [
  DEF A View { place 1 2 3 picture ImageTexture { url [od:10] } }
  View { shift 5 0 0 flags [TRUE] tiles [2 2 1 1 2 3 4 1 1 4 0x11223344] picture ImageTexture { url [od:10] } more [ WorldInfo { title "more" } ] }
  Far { c 0 1 0 }
  USE A
] }
)";

std::string protoText() {
    std::string text = kProto;
    const std::string inner = "Inner2 { }";
    text.replace(text.find(inner), inner.size(), "WorldInfo { }");
    return text;
}

TEST(Proto, IsKeptInEveryForm) {
    const Document document = mustReadBt(protoText());
    ASSERT_FALSE(document.frames.empty());
    const auto& scene = std::get<ReplaceScene>(document.frames[0].commands.at(0));
    ASSERT_EQ(scene.protos.size(), 2u);
    EXPECT_TRUE(scene.protos[0]->isExtern);
    EXPECT_EQ(scene.protos[1]->links.size(), 5u);
    EXPECT_EQ(scene.protos[1]->protos.size(), 1u);
    expectKeptEverywhere(document);
    expectKeptEverywhere(throughMp4(document));
    // PROTOs came with version 2 of BIFS.
    EXPECT_EQ(throughMp4(document).bifsConfig.version, 2);
}

TEST(Proto, InstancesShowTheirDepthImages) {
    Document document = mustReadBt(protoText());
    ASSERT_FALSE(document.frames.empty());
    Bundle one;
    one.views = {makeView(8, 6, 8, 1)};
    Document images = sceneOf(one);
    document.odFrames = images.odFrames;
    auto& ods = std::get<UpdateObjectDescriptors>(document.odFrames[0].commands[0]).descriptors;
    ASSERT_EQ(ods.size(), 2u);
    ods[0].id = 11;
    ods[1].id = 10;  // the depth
    const Document mp4 = throughMp4(document);
    Job job;
    const auto shown = bundleFromScene(mp4, {}, job);
    ASSERT_TRUE(shown) << shown.error().text();
    ASSERT_EQ(shown->views.size(), 3u);
    EXPECT_LT(glm::length(shown->views[0].camera.position - glm::dvec3(1, 2, 3)), 1e-6);
    EXPECT_LT(glm::length(shown->views[1].camera.position - glm::dvec3(5, 0, 10)), 1e-6);
    EXPECT_LT(glm::length(shown->views[2].camera.position - glm::dvec3(1, 2, 3)), 1e-6);
    EXPECT_EQ(shown->title, "more");
    const auto notes = job.takeNotes();
    ASSERT_FALSE(notes.empty());
    EXPECT_EQ(notes[0], "the scene has nodes that are no views; they are left out: Far");
}

TEST(Proto, ErrorsNameWhatIsWrong) {
    EXPECT_NE(btErrorOf("PROTO A [ ] { Group { } } PROTO B [ ] { A { x 1 } } Group { }")
                  .find("A has no field 'x'"),
              std::string::npos);
    EXPECT_NE(
        btErrorOf("Group { children Transform { translation IS a } }").find("outside of a PROTO"),
        std::string::npos);
    EXPECT_NE(
        btErrorOf("PROTO A [ field SFInt32 a 1 ] { Transform { translation IS a } } Group { }")
            .find("SFVec3f and IS a, which is SFInt32"),
        std::string::npos);
    EXPECT_NE(btErrorOf("PROTO Group [ ] { } Group { }").find("not a name for a PROTO"),
              std::string::npos);
    EXPECT_NE(btErrorOf("PROTO A [ ] { A { } } Group { }").find("found 'A', expected a node"),
              std::string::npos);
    std::string many;
    for (int i = 0; i < 1100; ++i) many += fmt::format("PROTO P{} [ ] {{ Group {{ }} }} ", i);
    EXPECT_NE(btErrorOf(many + "Group { }").find("more than 1000 PROTOs"), std::string::npos);
    // Each shows the one before twice: 2^40 nodes.
    std::string doubled = "PROTO P0 [ ] { Group { } } ";
    for (int i = 1; i < 40; ++i)
        doubled += fmt::format("PROTO P{} [ ] {{ Group {{ children [ P{} {{ }} P{} {{ }} ] }} }} ",
                               i, i - 1, i - 1);
    const Document bomb = mustReadBt(doubled + "Group { children P39 { } }");
    Job job;
    const auto shown = bundleFromScene(bomb, {}, job);
    ASSERT_FALSE(shown);
    EXPECT_NE(shown.error().text().find("counting each USE"), std::string::npos)
        << shown.error().text();
}

}  // namespace
}  // namespace stx::mpeg4

// What commands change in large scenes, and what that costs.

#include <gtest/gtest.h>

#include "formats/mpeg4/mapping/scene_sequence.hpp"
#include "formats/mpeg4/scene/scene_walk.hpp"
#include "tests/unit/mpeg4/mapping_fixtures.hpp"
#include "tests/unit/mpeg4/round_trips.hpp"

namespace stx::mpeg4 {
namespace {

constexpr const char* kView =
    "DepthImage { orthographic FALSE position 0 0 0 diTexture SimpleTexture { depth PixelTexture { "
    "image 1 1 1 200 } } }";

/// A scene, and at each second after its start a command.
Document sceneWith(const std::string& children, const std::vector<std::string>& commands,
                   const std::string& protos = "") {
    std::string text = fmt::format("{}\nDEF ALL Group {{ children [ {} ] }}\n", protos, children);
    for (std::size_t i = 0; i < commands.size(); ++i)
        text += fmt::format("AT {} {{ {} }}\n", 1000 * (i + 1), commands[i]);
    return mustReadBt(text);
}

/// Whether what a scene shows is the same after each command as before it.
std::vector<bool> stillTheSame(const Document& document) {
    SceneInTime moments(document.frames);
    std::optional<ShownScene> shown;
    std::vector<bool> same;
    for (const CommandFrame& frame : document.frames) {
        const auto scene = moments.at(frame.time);
        EXPECT_TRUE(scene) << scene.error().text();
        if (!scene) return same;
        if (shown) same.push_back(shown->isStillOf(**scene));
        auto now = shownScene((*scene)->root, Limits());
        EXPECT_TRUE(now) << now.error().text();
        if (!now) return same;
        shown = std::move(*now);
        (*scene)->restructured = false;
        (*scene)->changed.clear();
    }
    return same;
}

std::string numbered(int count, const char* form) {
    std::string all;
    for (int i = 0; i < count; ++i) all += fmt::format(fmt::runtime(form), i);
    return all;
}

TEST(SceneChanges, WhatIsShownIsKeptWhereNothingOfItChanges) {
    const Document document = sceneWith(
        fmt::format("DEF TR Transform {{ children DEF V {} }} DEF OTHER Transform {{ }} DEF SW "
                    "Switch {{ whichChoice 0 choice [ Group {{ }} {} ] }} DEF INFO WorldInfo {{ }} "
                    "DEF BT Transform {{ children DEF B Background {{ }} }} DEF P Q {{ }}",
                    kView, kView),
        {"REPLACE OTHER.translation BY 1 0 0", "REPLACE TR.translation BY 1 0 0",
         "REPLACE OTHER.scale BY 2 1 1", "REPLACE SW.whichChoice BY 1",
         "REPLACE INFO BY WorldInfo { title \"T\" }", "REPLACE BT.rotation BY 0 0 1 1",
         "REPLACE P.t BY 0 0 3", "APPEND TO OTHER.children Transform { }", "DELETE OTHER",
         "DELETE ALL.children[0]", "REPLACE ALL.children[0] BY Group { }"},
        fmt::format("PROTO Q [ exposedField SFVec3f t 0 0 1 ] {{ Transform {{ translation IS t "
                    "children {} }} }}",
                    kView));
    EXPECT_EQ(stillTheSame(document), (std::vector<bool>{true, false, true, false, false, false,
                                                         false, false, false, false, false}));
}

// The film is the same, frame by frame, as scenes that are read by themselves.
TEST(SceneChanges, FramesAreThoseOfTheirScenes) {
    const Document document = sceneWith(
        fmt::format("DEF TR Transform {{ children DEF V {} }} DEF OTHER Transform {{ }} "
                    "DEF SW Switch {{ whichChoice -1 choice USE V }}",
                    kView),
        {"REPLACE OTHER.translation BY 1 0 0", "REPLACE TR.translation BY 1 0 0",
         "REPLACE OTHER.translation BY 2 0 0", "REPLACE SW.whichChoice BY 0",
         "REPLACE V BY DepthImage { orthographic FALSE position 0 2 0 diTexture SimpleTexture { "
         "depth PixelTexture { image 1 1 1 200 } } }",
         "DELETE TR"});
    Job job;
    const auto film = sequenceFromScene(document, {}, job);
    ASSERT_TRUE(film) << film.error().text();
    ASSERT_EQ((*film)->timeline().count(), 7u);
    const std::vector<std::vector<glm::dvec3>> expected = {{{0, 0, 0}},
                                                           {{0, 0, 0}},
                                                           {{1, 0, 0}},
                                                           {{1, 0, 0}},
                                                           {{1, 0, 0}, {0, 0, 0}},
                                                           {{1, 2, 0}, {0, 2, 0}},
                                                           {{0, 2, 0}}};
    for (const std::size_t i : {0, 1, 2, 3, 4, 5, 6, 3, 6, 0}) {
        const auto frame = (*film)->frame(i, job);
        ASSERT_TRUE(frame) << frame.error().text();
        std::vector<glm::dvec3> places;
        for (const ReferenceView& view : frame->views) places.push_back(view.camera.position);
        EXPECT_EQ(places, expected[i]) << i;
    }
}

// Walking the scene for each would be 64 million nodes, which was refused.
TEST(SceneChanges, ManyNodesAreDeletedOneByOne) {
    constexpr int kCount = 8000;
    std::vector<std::string> commands;
    for (int i = 0; i < kCount; ++i) commands.push_back(fmt::format("DELETE M{0} DELETE N{0}", i));
    const Document document = sceneWith(
        kView + numbered(kCount, " DEF N{0} Transform {{ children DEF M{0} Group {{ }} }}"),
        commands);
    const auto last = composeScene(document.frames);
    ASSERT_TRUE(last) << last.error().text();
    EXPECT_EQ(last->root->get<NodeList>("children").size(), 1u);
    Job job;
    const auto film = sequenceFromScene(document, {}, job);
    ASSERT_TRUE(film) << film.error().text();
    EXPECT_EQ((*film)->timeline().count(), kCount + 1u);
}

// Each command used to walk all that is below its target: 400 million nodes.
TEST(SceneChanges, ManyCommandsForTheNodeThatHoldsAll) {
    constexpr int kCount = 20'000;
    Document document =
        sceneWith(kView + numbered(kCount, " Transform {{ translation {} 0 0 }}"), {});
    const NodePtr all = std::get<ReplaceScene>(document.frames[0].commands[0]).root;
    for (std::uint64_t i = 1; i <= kCount; ++i)
        document.frames.push_back({i, {Command(InsertNode{all, {}, makeNode("Transform")})}});
    const auto last = composeScene(document.frames);
    ASSERT_TRUE(last) << last.error().text();
    EXPECT_EQ(last->root->get<NodeList>("children").size(), 2u * kCount + 1);
}

TEST(SceneChanges, NodesAreExchangedWhereverTheSceneHasThem) {
    const Document document =
        sceneWith(fmt::format("{} DEF T1 Transform {{ children DEF A Group {{ }} }} DEF T2 "
                              "Transform {{ children [ USE A USE A ] }}",
                              kView),
                  {"REPLACE A BY DEF B Transform { }", "DELETE T1", "DELETE B"});
    const auto childrenAt = [&](std::uint64_t seconds) {
        std::vector<std::string> types;
        const auto scene = composeScene(document.frames, 1000 * seconds);
        EXPECT_TRUE(scene) << scene.error().text();
        if (!scene) return types;
        const NodeList& all = scene->root->get<NodeList>("children");
        for (std::size_t i = 1; i < all.size(); ++i)
            for (const NodePtr& child : all[i]->get<NodeList>("children"))
                types.push_back(child->info->name);
        return types;
    };
    using Types = std::vector<std::string>;
    EXPECT_EQ(childrenAt(0), (Types{"Group", "Group", "Group"}));
    EXPECT_EQ(childrenAt(1), (Types{"Transform", "Transform", "Transform"}));
    EXPECT_EQ(childrenAt(2), (Types{"Transform", "Transform"}));
    EXPECT_EQ(childrenAt(3), Types{});
    // What is only in nodes that went is not in the scene.
    const Document gone =
        sceneWith(fmt::format("{} DEF T1 Transform {{ children DEF A Group {{ }} }}", kView),
                  {"DELETE T1", "DELETE A"});
    const auto scene = composeScene(gone.frames);
    ASSERT_FALSE(scene);
    EXPECT_NE(scene.error().text().find("which is not in the scene"), std::string::npos);
}

// Which routes there are decides what clocks move, also after one of their ends went.
TEST(SceneChanges, RoutesOfWhatGoesGo) {
    const Document document = mustReadBt(fmt::format(
        "DEF ALL Group {{ children [ DEF TR Transform {{ children {} }} DEF TS TimeSensor {{ loop "
        "TRUE cycleInterval 4 }} DEF PI PositionInterpolator {{ key [0 1] keyValue [0 0 0, 4 0 0] "
        "}} ] }}\nROUTE TS.fraction_changed TO PI.set_fraction\nROUTE PI.value_changed TO "
        "TR.translation\nAT 1000 {{ DELETE PI }}\nAT 2000 {{ REPLACE TS BY TimeSensor {{ }} }}\n",
        kView));
    SceneInTime moments(document.frames);
    std::vector<std::size_t> routes;
    std::vector<std::uint64_t> counted;
    for (const std::uint64_t time : {0, 1000, 2000}) {
        const auto scene = moments.at(time);
        ASSERT_TRUE(scene) << scene.error().text();
        routes.push_back((*scene)->routes.size());
        counted.push_back(moments.structure().routes);
    }
    EXPECT_EQ(routes, (std::vector<std::size_t>{2, 0, 0}));
    EXPECT_LT(counted[0], counted[1]);
}

}  // namespace
}  // namespace stx::mpeg4

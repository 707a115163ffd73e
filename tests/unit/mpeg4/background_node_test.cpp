// Background nodes: what is read of them, where they stand, what is written.
#include <gtest/gtest.h>

#include "formats/images/images.hpp"
#include "formats/mpeg4/mapping/background.hpp"
#include "formats/mpeg4/mapping/scene_sequence.hpp"
#include "formats/mpeg4/mapping/sequence_write.hpp"
#include "lib/environment/environment_map.hpp"
#include "tests/painted_environment.hpp"
#include "tests/unit/mpeg4/mapping_fixtures.hpp"

namespace stx::mpeg4 {
namespace {

std::shared_ptr<const Environment> environmentOfText(const std::string& nodes, Job& job) {
    const auto document = readBt("Group { children [ " + nodes + " ] }", "test.bt", job);
    if (!document) {
        ADD_FAILURE() << document.error().text();
        return nullptr;
    }
    const auto environment = environmentFromScene(*document, {}, job);
    if (!environment) {
        ADD_FAILURE() << environment.error().text();
        return nullptr;
    }
    return *environment;
}

Bundle viewWith(Environment environment) {
    Bundle bundle;
    bundle.views = {makeView(12, 9, 16)};
    bundle.environment = std::make_shared<const Environment>(std::move(environment));
    return bundle;
}

TEST(BackgroundNode, TheFirstIsBoundAndOnlyRotationsAboveItCount) {
    Job job;
    const auto e = environmentOfText(
        "Transform { translation 5 6 7 scale 2 3 4 rotation 0 1 0 0.5 children ["
        " Transform { rotation 1 0 0 0.25 center 9 9 9 children ["
        "  Background { skyColor [0.25 0.5 1, 1 1 1] skyAngle [1.5] groundColor [0 0.5 0, 0 1 0]"
        "   groundAngle [1.25] } ] } ] }"
        "Background { skyColor [1 0 0] }",
        job);
    ASSERT_TRUE(e);
    const glm::dquat expected =
        glm::angleAxis(0.5, glm::dvec3(0, 1, 0)) * glm::angleAxis(0.25, glm::dvec3(1, 0, 0));
    EXPECT_GT(std::abs(glm::dot(e->orientation, expected)), 1 - 1e-9);
    EXPECT_EQ(e->skyColours, (std::vector<glm::vec3>{{0.25, 0.5, 1}, {1, 1, 1}}));
    EXPECT_EQ(e->skyAngles, (std::vector<double>{1.5}));
    EXPECT_EQ(e->groundColours.size(), 2u);
    EXPECT_EQ(e->groundAngles, (std::vector<double>{1.25}));
    EXPECT_EQ(e->pictureCount(), 0);
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_EQ(notes[0], "the scene has 2 Backgrounds; the first is shown");
}

TEST(BackgroundNode, OfASwitchOnlyTheChosenOneIsThere) {
    Job job;
    const std::string red = "Background { skyColor [1 0 0] }",
                      blue = "Background { skyColor [0 0 1] }";
    const auto e =
        environmentOfText("Switch { whichChoice 1 choice [ " + red + " " + blue + " ] }", job);
    ASSERT_TRUE(e);
    EXPECT_EQ(e->skyColours[0], glm::vec3(0, 0, 1));
    EXPECT_FALSE(environmentOfText("Switch { choice [ " + red + " ] }", job));
    // By default a Background is black.
    const auto black = environmentOfText("Background { }", job);
    ASSERT_TRUE(black);
    EXPECT_EQ(black->skyColours, (std::vector<glm::vec3>{{0, 0, 0}}));
}

TEST(BackgroundNode, WhatCannotBeReadIsLeftOutWithANote) {
    Job job;
    const auto e = environmentOfText(
        "Background { frontUrl [77] skyColor [1 0 0, 0 1 0, 0 0 1] skyAngle [2 1] }", job);
    ASSERT_TRUE(e);
    EXPECT_EQ(e->pictureCount(), 0);
    EXPECT_EQ(e->skyColours.size(), 2u);
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 2u);
    EXPECT_NE(notes[0].find("skyColor and skyAngle of the Background do not belong together"),
              std::string::npos)
        << notes[0];
    EXPECT_NE(notes[1].find("the frontUrl of the Background cannot be read"), std::string::npos)
        << notes[1];
}

TEST(BackgroundNode, ComesBackFromEveryContainer) {
    Environment e = paintedCube(16);
    e.orientation = quatFromAxisAngle({0, 1, 0, 0.75});
    e.pictures[4].rgba8()->at(3, 3) = {9, 8, 7, 100};
    e.skyColours = {{0.25, 0.5, 1}};
    const Bundle bundle = viewWith(e);
    const TemporaryFolder folder, again;
    for (const char* name : {"a.mp4", "a.bt", "a.xmt"}) {
        SCOPED_TRACE(name);
        Job job;
        const auto written = writeMpeg4Views(*viewsOf(bundle), folder / name, job);
        ASSERT_TRUE(written) << written.error().text();
        const auto back = readMpeg4Bundle(folder / name, job);
        ASSERT_TRUE(back) << back.error().text();
        ASSERT_TRUE(back->environment);
        EXPECT_EQ(back->views.size(), 1u);
        EXPECT_EQ(back->environment->pictures, e.pictures);
        EXPECT_EQ(back->environment->skyColours, e.skyColours);
        EXPECT_LT(std::abs(1 - glm::dot(back->environment->orientation, e.orientation)), 1e-12);
        // Written again, it has the same bytes.
        ASSERT_TRUE(writeMpeg4Views(*viewsOf(*back), again / name, job));
        EXPECT_TRUE(*readFile(folder / name, {}) == *readFile(again / name, {}));
    }
    // A file beside a text is named after what it is for.
    EXPECT_TRUE(std::filesystem::exists(folder / "a_images/environment_top.png"));
}

TEST(BackgroundNode, APictureAllAroundBecomesSixFaces) {
    Job job;
    const auto document = sceneFromBundle(viewWith(paintedAround(128)), {}, job);
    ASSERT_TRUE(document) << document.error().text();
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_EQ(notes[0],
              "the environment of 128x64 becomes the six faces of a Background, 42x42 each");
    const auto e = environmentFromScene(*document, {}, job);
    ASSERT_TRUE(e && *e);
    const auto map = EnvironmentMap::make(**e, Limits());
    for (const glm::dvec3 d : {glm::dvec3(0, 0, -1), {1, 0.1, 0.2}, {0.1, 1, 0.3}, {0.2, -1, 0.4}})
        EXPECT_LT(
            glm::distance(glm::dvec3((*map)->sample(glm::vec3(d), 0, false)), paintedColour(d)),
            0.01);
}

TEST(BackgroundNode, ATranslucentEnvironmentHasItsMeanColoursBehindIt) {
    for (const std::uint8_t alpha : {13, 64, 127, 128, 254}) {
        SCOPED_TRACE(alpha);
        Environment e;
        e.layout = Environment::Layout::equirectangular;
        e.pictures.emplace_back(Rgba8Image(64, 32, glm::u8vec4(124, 60, 200, alpha)));
        Job job;
        const auto document = sceneFromBundle(viewWith(e), {}, job);
        ASSERT_TRUE(document) << document.error().text();
        const auto back = environmentFromScene(*document, {}, job);
        ASSERT_TRUE(back && *back);
        ASSERT_EQ((*back)->skyColours.size(), 1u);
        ASSERT_EQ((*back)->groundColours.size(), 2u);
        for (const glm::vec3 colour : {(*back)->skyColours[0], (*back)->groundColours[1]})
            EXPECT_LT(glm::distance(colour, glm::vec3(124, 60, 200) / 255.0f), 0.002f);
    }
}

TEST(BackgroundNode, FilmsHaveOneForAllFrames) {
    Job job;
    const TemporaryFolder folder;
    Bundle first = viewWith(paintedCube(8));
    struct Two : Sequence {
        Bundle bundle;
        explicit Two(Bundle b) : bundle(std::move(b)) { timeline_ = steadyTimeline(2, 25); }
        Result<Bundle> frame(std::size_t i, Job&) override {
            Bundle out = bundle;
            out.views[0].texture.rgba8()->at(1, 0).r = static_cast<std::uint8_t>(10 + i);
            return out;
        }
    } frames(first);
    auto spool = PictureSpool::create(folder.path());
    ASSERT_TRUE(spool);
    auto document = sceneFromSequence(frames, {}, *spool, job);
    ASSERT_TRUE(document) << document.error().text();
    auto sequence = sequenceFromScene(std::move(*document), {}, job);
    ASSERT_TRUE(sequence) << sequence.error().text();
    ASSERT_EQ((*sequence)->timeline().count(), 2u);
    const auto one = (*sequence)->frame(0, job), two = (*sequence)->frame(1, job);
    ASSERT_TRUE(one && two);
    ASSERT_TRUE(one->environment);
    EXPECT_EQ(one->environment->pictures, first.environment->pictures);
    EXPECT_EQ(one->environment, two->environment);
}

}  // namespace
}  // namespace stx::mpeg4

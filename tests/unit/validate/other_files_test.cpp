// Files that are no bundles of ours: one kind of answer for them, too.
#include <fstream>

#include <gtest/gtest.h>

#include "formats/any/save.hpp"
#include "formats/any/sequences.hpp"
#include "formats/atlas/atlas_files.hpp"
#include "formats/imagesets/export.hpp"
#include "formats/validate/validate.hpp"
#include "lib/packing/packing.hpp"
#include "tests/small_bundle.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/validate/numbers.hpp"

namespace stx {
namespace {

Numbers rulesOf(const std::filesystem::path& path) {
    Job job;
    const auto findings = validateFile(path, {}, job);
    if (!findings) ADD_FAILURE() << findings.error().text();
    return findings ? numbersOf(*findings) : Numbers{-1};
}

TEST(ValidateScenes, WithoutDescriptorsNeedNoObjectDescriptorTrack) {
    const TemporaryFolder folder;
    Job job;
    SaveOptions points;
    points.pointTexture = true;
    ASSERT_TRUE(saveBundle(smallBundle(2, 16, false, false), folder / "a.mp4", points, job));
    EXPECT_EQ(rulesOf(folder / "a.mp4"), Numbers{});
}

TEST(ValidateImageSets, MissingFilesAreFindingsAndAllOfThem) {
    const TemporaryFolder folder;
    Job job;
    for (const auto kind : {ExportOptions::Kind::transforms, ExportOptions::Kind::miv}) {
        const bool miv = kind == ExportOptions::Kind::miv;
        const auto set = folder / (miv ? "miv" : "transforms");
        ExportOptions options;
        options.kind = kind;
        ASSERT_TRUE(exportViews(*viewsOf(smallBundle(3, 16, false, false)), set, options, job));
        EXPECT_EQ(rulesOf(set), Numbers{});
        for (const char* name : {"view_0", "view_2"})
            ASSERT_TRUE(
                std::filesystem::remove(set / (miv ? name + std::string("_depth.exr")
                                                   : "depth/" + std::string(name) + ".exr")));
        const auto findings = validateFile(set, {}, job);
        ASSERT_TRUE(findings) << findings.error().text();
        ASSERT_EQ(findings->size(), 2u);
        EXPECT_EQ(numbersOf(*findings), Numbers{1003});
        EXPECT_NE(findings->at(1).text().find("view 2 'view 2'"), std::string::npos)
            << findings->at(1).text();
    }
}

TEST(ValidateImageSets, WhatCannotBeReadBreaksRule1001) {
    const TemporaryFolder folder;
    Job job;
    ASSERT_TRUE(exportViews(*viewsOf(smallBundle(1, 16, false, false)), folder / "set", {}, job));
    std::filesystem::resize_file(folder / "set/depth/view_0.exr", 200);
    EXPECT_EQ(rulesOf(folder / "set"), Numbers{1001});
    std::ofstream(folder / "set/transforms.json") << "{";
    EXPECT_EQ(rulesOf(folder / "set"), Numbers{1001});
}

TEST(ValidateImageSets, EachDamagedPictureIsNamed) {
    const TemporaryFolder folder;
    Job job;
    ASSERT_TRUE(exportViews(*viewsOf(smallBundle(4, 16, false, false)), folder / "set", {}, job));
    std::ofstream(folder / "set/images/view_1.png") << "not a picture";
    std::filesystem::resize_file(folder / "set/depth/view_3.exr", 200);
    const auto findings = validateFile(folder / "set", {}, job);
    ASSERT_TRUE(findings) << findings.error().text();
    EXPECT_EQ(numbersOf(*findings), Numbers{1001});
    ASSERT_EQ(findings->size(), 2u) << textOf(*findings);
    EXPECT_NE(findings->at(0).text().find("view_1.png"), std::string::npos) << textOf(*findings);
    EXPECT_NE(findings->at(1).text().find("view_3.exr"), std::string::npos) << textOf(*findings);
}

/// A set of two cameras at three moments. The second sees nothing at the second one.
void writeMovingSet(const TemporaryFolder& folder) {
    Job job;
    for (int k = 0; k < 3; ++k) {
        Bundle bundle = smallBundle(2, 16, false, false);
        // Frames that repeat the one before have no files of their own.
        for (ReferenceView& view : bundle.views)
            for (glm::u8vec4& colour : view.texture.rgba8()->pixels())
                if (colour.a > 0) colour.r = static_cast<std::uint8_t>(60 * k);
        if (k == 1) {
            ReferenceView& empty = bundle.views[1];
            for (float& d : empty.depth.pixels()) d = kNoDepth;
            for (glm::u8vec4& colour : empty.texture.rgba8()->pixels()) colour = {};
        }
        const auto file = folder / fmt::format("f_{}.exr", k);
        const auto saved = saveBundle(bundle, file, {}, job);
        ASSERT_TRUE(saved) << saved.error().text();
    }
    const auto film = openSequence(folder / "f_%d.exr", {}, job);
    ASSERT_TRUE(film) << film.error().text();
    const auto written = exportFrames(**film, folder / "set", {}, job);
    ASSERT_TRUE(written) << written.error().text();
}

TEST(ValidateImageSets, EachFrameOfOneThatMovesIsRead) {
    const TemporaryFolder folder;
    Job job;
    ASSERT_NO_FATAL_FAILURE(writeMovingSet(folder));
    const auto sound = validateFile(folder / "set", {}, job);
    EXPECT_EQ(numbersOf(sound), Numbers{}) << textOf(sound);
    for (const char* name : {"view_0_0000.png", "view_1_0002.png"}) {
        const auto picture = folder / "set/images" / name;
        ASSERT_TRUE(std::filesystem::exists(picture)) << name;
        std::ofstream(picture) << "not a picture";
    }
    const auto findings = validateFile(folder / "set", {}, job);
    ASSERT_TRUE(findings) << findings.error().text();
    EXPECT_EQ(numbersOf(*findings), Numbers{1001}) << textOf(*findings);
    ASSERT_EQ(findings->size(), 2u) << textOf(*findings);
    EXPECT_TRUE(findings->at(0).where.starts_with("frame 0 (0 s)")) << textOf(*findings);
    EXPECT_TRUE(findings->at(1).where.starts_with("frame 2 (0.08 s)")) << textOf(*findings);
    EXPECT_NE(textOf(*findings).find("view_1_0002.png"), std::string::npos) << textOf(*findings);
}

TEST(ValidateImageSets, EachDamagedPictureOfAFrameIsNamedOnce) {
    const TemporaryFolder folder;
    Job job;
    ASSERT_NO_FATAL_FAILURE(writeMovingSet(folder));
    for (const char* name : {"view_0_0002.png", "view_1_0002.png"}) {
        ASSERT_TRUE(std::filesystem::exists(folder / "set/images" / name)) << name;
        std::ofstream(folder / "set/images" / name) << "not a picture";
    }
    const auto findings = validateFile(folder / "set", {}, job);
    ASSERT_TRUE(findings) << findings.error().text();
    ASSERT_EQ(findings->size(), 2u) << textOf(*findings);
    EXPECT_NE(findings->at(0).text().find("view_0_0002.png"), std::string::npos);
    EXPECT_NE(findings->at(1).text().find("view_1_0002.png"), std::string::npos);
}

TEST(ValidateMeshes, AreReadOrBreakRule1001) {
    const TemporaryFolder folder;
    std::ofstream(folder / "a.obj") << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    EXPECT_EQ(rulesOf(folder / "a.obj"), Numbers{});
    std::ofstream(folder / "a.ply") << "ply\nformat ascii 1.0\nelement vertex 3\n";
    EXPECT_EQ(rulesOf(folder / "a.ply"), Numbers{1001});
}

TEST(ValidateEnvironments, OfBundlesAndAtlasesAreDecoded) {
    const TemporaryFolder folder;
    Bundle bundle = smallBundle(1, 16, false, false);
    Environment environment;
    environment.pictures.assign(6, Texture(Rgba8Image(4, 4, glm::u8vec4(255))));
    bundle.environment = std::make_shared<const Environment>(environment);
    Job job;
    ASSERT_TRUE(saveBundle(bundle, folder / "bundle.exr", {}, job));
    const auto atlas = pack(bundle, {}, job);
    ASSERT_TRUE(atlas) << atlas.error().text();
    ASSERT_TRUE(writeAtlas(*atlas, folder / "atlas.exr", job));
    ASSERT_TRUE(writeAtlas(*atlas, folder / "atlas", job));
    for (const char* name : {"bundle.exr", "atlas.exr", "atlas"}) {
        EXPECT_EQ(rulesOf(folder / name), Numbers{}) << name;
        const bool inFolder = std::string_view(name) == "atlas";
        const auto file = inFolder ? folder / "atlas/environment.exr" : folder / name;
        // The environment is the last part, and its last byte is one of a picture.
        std::fstream(file, std::ios::in | std::ios::out | std::ios::binary)
            .seekp(-1, std::ios::end)
            .put('!');
        EXPECT_EQ(rulesOf(folder / name), Numbers{4005}) << name;
        ValidateOptions headers;
        headers.pixels = false;
        EXPECT_EQ(numbersOf(validateFile(folder / name, headers, job)), Numbers{}) << name;
    }
}

TEST(ValidateExr, EmptyAndCutFilesBreakRule1001) {
    const TemporaryFolder folder;
    Job job;
    ASSERT_TRUE(saveBundle(smallBundle(1, 16, false, false), folder / "a.exr", {}, job));
    for (const int size : {0, 3, 8, 100}) {
        std::filesystem::resize_file(folder / "a.exr", size);
        EXPECT_EQ(rulesOf(folder / "a.exr"), Numbers{1001}) << size;
    }
}

}  // namespace
}  // namespace stx

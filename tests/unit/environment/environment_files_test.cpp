// Environments in files of every kind, and against OpenEXR's own exrenvmap.
#include <cstdlib>
#include <fstream>
#include <limits>
#include <tuple>

#include <gtest/gtest.h>

#include "formats/environment/environment_files.hpp"
#include "formats/exr/environment_exr.hpp"
#include "formats/images/images.hpp"
#include "lib/environment/environment_map.hpp"
#include "tests/painted_environment.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

/// Six colours that are nowhere near each other, and a mark in the upper left quarter of each face.
Environment markedFaces(int size) {
    Environment e;
    for (int f = 0; f < 6; ++f)
        e.pictures.push_back(paintedTexture(size, size, [f](glm::dvec2 p) {
            const bool mark = p.x < 0.5 && p.y < 0.5;
            return glm::dvec3(f & 1 ? 0.8 : 0.2, f & 2 ? 0.8 : 0.2, f & 4 ? 0.8 : 0.2) +
                   glm::dvec3(mark ? 0.15 : 0.0);
        }));
    return e;
}

/// The mean difference of what both show, over the middles of the faces' quarters.
double differenceOf(const Environment& a, const Environment& b) {
    const auto ma = EnvironmentMap::make(a, Limits()), mb = EnvironmentMap::make(b, Limits());
    if (!ma || !mb) return 1e9;
    double sum = 0;
    for (int f = 0; f < 6; ++f)
        for (const double u : {0.25, 0.75})
            for (const double v : {0.25, 0.75}) {
                const glm::vec3 d(faceDirection(static_cast<CubeFace>(f), {u, v}));
                sum += glm::distance((*ma)->sample(d, 0, false), (*mb)->sample(d, 0, false));
            }
    return sum / 24;
}

TEST(EnvironmentFiles, ComeBackFromEveryKind) {
    const TemporaryFolder folder("environment");
    Environment turned = markedFaces(32);
    turned.orientation = glm::angleAxis(0.8, glm::dvec3(0, 1, 0));
    turned.skyColours = {{0.1, 0.2, 0.3}};
    turned.groundColours = {{0.5, 0.4, 0.3}, {0.2, 0.1, 0.0}};
    turned.groundAngles = {1.25};
    for (const char* name : {"a.exr", "a.mp4", "a.bt", "a.xmt", "faces", "a.png", "a.jpg"}) {
        SCOPED_TRACE(name);
        for (const Environment& e : {markedFaces(32), turned}) {
            Job job;
            const auto saved = saveEnvironment(e, folder / name, {}, job);
            ASSERT_TRUE(saved) << saved.error().text();
            const auto back = openEnvironment(folder / name, job);
            ASSERT_TRUE(back) << back.error().text();
            EXPECT_LT(differenceOf(e, **back), 0.03);
            const std::string ending = std::filesystem::path(name).extension().string();
            if (ending == ".exr") {
                EXPECT_EQ(**back, e);
            }
            if (ending == ".mp4" || ending == ".bt" || ending == ".xmt") {
                EXPECT_EQ((*back)->pictures, e.pictures);
            }
        }
    }
}

TEST(EnvironmentFiles, PicturesAllAroundAreKeptToTheBit) {
    const TemporaryFolder folder("environment");
    const Environment e = paintedAround(64);
    for (const char* name : {"a.png", "a.exr"}) {
        SCOPED_TRACE(name);
        Job job;
        ASSERT_TRUE(saveEnvironment(e, folder / name, {}, job));
        const auto back = openEnvironment(folder / name, job);
        ASSERT_TRUE(back) << back.error().text();
        EXPECT_EQ(**back, e);
    }
    Environment bright;
    bright.layout = Environment::Layout::equirectangular;
    RgbaFloatImage light(16, 8);
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 16; ++x) light.at(x, y) = {x * 3.7, y * 0.1, 1e-4 * x, 1};
    bright.pictures.emplace_back(light);
    Job job;
    ASSERT_TRUE(saveEnvironment(bright, folder / "bright.exr", {}, job));
    EXPECT_EQ(**openEnvironment(folder / "bright.exr", job), bright);
}

TEST(EnvironmentFiles, MissingFacesStayMissing) {
    const TemporaryFolder folder("environment");
    Environment e = markedFaces(16);
    e.pictures[4] = Texture();
    e.pictures[1] = Texture();
    e.skyColours = {{0, 0, 1}};
    for (const char* name : {"a.exr", "a.mp4"}) {
        Job job;
        ASSERT_TRUE(saveEnvironment(e, folder / name, {}, job));
        const auto back = openEnvironment(folder / name, job);
        ASSERT_TRUE(back) << back.error().text();
        EXPECT_EQ(**back, e) << name;
    }
}

TEST(EnvironmentFiles, SkyAloneIsAnEnvironment) {
    const TemporaryFolder folder("environment");
    Environment e;
    e.skyColours = {{0, 0, 0.5}, {0.5, 0.5, 1}};
    e.skyAngles = {1.5};
    for (const char* name : {"a.exr", "a.mp4", "a.bt"}) {
        Job job;
        ASSERT_TRUE(saveEnvironment(e, folder / name, {}, job));
        const auto back = openEnvironment(folder / name, job);
        ASSERT_TRUE(back) << back.error().text();
        EXPECT_EQ(**back, e) << name;
    }
    Job job;
    ASSERT_TRUE(saveEnvironment(e, folder / "a.png", {}, job));
    EXPECT_LT(differenceOf(**openEnvironment(folder / "a.png", job), e), 0.02);
}

TEST(EnvironmentFiles, HolesGetTheColoursAroundThePolesInAScene) {
    const TemporaryFolder folder("environment");
    Environment e;
    e.layout = Environment::Layout::equirectangular;
    Rgba8Image image(64, 32, glm::u8vec4(0));
    for (int y = 8; y < 24; ++y)
        for (int x = 0; x < 64; ++x)
            image.at(x, y) =
                y < 16 ? glm::u8vec4(20, 40, 200, 255) : glm::u8vec4(200, 150, 20, 255);
    e.pictures.emplace_back(image);
    Job job;
    ASSERT_TRUE(saveEnvironment(e, folder / "a.mp4", {}, job));
    const auto back = openEnvironment(folder / "a.mp4", job);
    ASSERT_TRUE(back) << back.error().text();
    const auto map = EnvironmentMap::make(**back, Limits());
    EXPECT_LT(
        glm::distance((*map)->sample({0, 1, 0}, 0, false), glm::vec4(20, 40, 200, 255) / 255.0f),
        0.02);
    EXPECT_LT(
        glm::distance((*map)->sample({0, -1, 0}, 0, false), glm::vec4(200, 150, 20, 255) / 255.0f),
        0.02);
}

TEST(EnvironmentFiles, SayWhatIsWrong) {
    const TemporaryFolder folder("environment");
    Job job;
    const auto errorOf = [&](const std::string& name) {
        const auto opened = openEnvironment(folder / name, job);
        return opened ? std::string() : opened.error().text();
    };
    EXPECT_NE(errorOf("nothing.png").find("does not exist"), std::string::npos);
    std::filesystem::create_directory(folder / "empty");
    EXPECT_NE(errorOf("empty").find("front, back, left, right, top and bottom"), std::string::npos);
    const std::vector<std::uint8_t> grey(40 * 30, 7);
    const auto png = encodePng(40, 30, 1, 8, grey.data(), true);
    ASSERT_TRUE(png);
    ASSERT_TRUE(writeFile(folder / "square.png", *png));
    EXPECT_NE(errorOf("square.png").find("40x30 pixels; a picture all around is twice as wide"),
              std::string::npos);
    ASSERT_TRUE(writeFile(folder / "empty/front.png", *png));
    EXPECT_NE(errorOf("empty").find("a face of an environment is square"), std::string::npos);
    // A picture that is cut off is named once.
    ASSERT_TRUE(writeFile(folder / "half.png", ByteSpan(*png).first(40)));
    const std::string half = errorOf("half.png");
    EXPECT_NE(half.find("cut off"), std::string::npos) << half;
    EXPECT_EQ(half.find("half.png"), half.rfind("half.png")) << half;
    // Faces of two sizes are a note.
    std::filesystem::create_directory(folder / "mixed");
    for (const auto& [name, size] : {std::pair{"front.png", 30}, {"back.png", 20}}) {
        const auto face = encodePng(size, size, 1, 8, grey.data(), true);
        ASSERT_TRUE(face);
        ASSERT_TRUE(writeFile(folder / "mixed" / name, *face));
    }
    std::ignore = job.takeNotes();
    EXPECT_EQ(errorOf("mixed"), "");
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 2u);
    EXPECT_NE(notes[0].find("left, right, top, bottom"), std::string::npos) << notes[0];
    EXPECT_NE(notes[1].find("from 20 to 30 pixels"), std::string::npos) << notes[1];
    const auto unknown = saveEnvironment(paintedCube(4), folder / "a.gif", {}, job);
    ASSERT_FALSE(unknown);
    EXPECT_EQ(unknown.error().code, ErrorCode::usage);
    // Half a file.
    ASSERT_TRUE(saveEnvironment(paintedCube(16), folder / "a.exr", {}, job));
    std::filesystem::resize_file(folder / "a.exr", 700);
    EXPECT_NE(errorOf("a.exr"), "");
}

TEST(EnvironmentFiles, WhatIsNotFiniteCountsAsTheLargestHalfOrNothing) {
    const TemporaryFolder folder("environment");
    std::vector<float> values(4 * 2 * 3, 0.5f);
    values[0] = std::numeric_limits<float>::infinity();
    values[4] = std::numeric_limits<float>::quiet_NaN();
    values[5] = -std::numeric_limits<float>::infinity();
    std::ofstream file(folder / "sun.pfm", std::ios::binary);
    file << "PF\n4 2\n-1.0\n";
    file.write(reinterpret_cast<const char*>(values.data()),
               static_cast<std::streamsize>(values.size() * sizeof(float)));
    file.close();
    Job job;
    const auto opened = openEnvironment(folder / "sun.pfm", job);
    ASSERT_TRUE(opened) << opened.error().text();
    // Its rows begin at the bottom.
    const auto* light = (*opened)->pictures.at(0).rgbaFloat();
    ASSERT_TRUE(light);
    EXPECT_EQ(light->at(0, 1), glm::vec4(65504.0f, 0.5f, 0.5f, 1));
    EXPECT_EQ(light->at(1, 1), glm::vec4(0.5f, 0, 0, 1));
    const std::string where = fmt::format("'{}'", (folder / "sun.pfm").string());
    EXPECT_EQ(job.takeNotes(),
              (std::vector<std::string>{
                  where + ": 1 values of the environment are infinite: they count as 65504",
                  where + ": 2 values of the environment are no numbers: they count as 0"}));
}

/// OpenEXR's own converter; its samples are on the very edges of faces and pictures.
bool exrenvmap(const std::string& options, const std::filesystem::path& in,
               const std::filesystem::path& out) {
    return std::system(fmt::format("exrenvmap {} '{}' '{}' >/dev/null 2>&1", options, in.string(),
                                   out.string())
                           .c_str()) == 0;
}

TEST(EnvironmentFiles, AgreeWithExrenvmap) {
    if (std::system("which exrenvmap >/dev/null 2>&1") != 0)
        GTEST_SKIP() << "needs exrenvmap, of Debian's package openexr";
    const TemporaryFolder folder("environment");
    Job job;
    // Ours all around, its six faces: each marker where it belongs.
    const Environment faces = markedFaces(32);
    const auto around = asEquirectangular(faces, 256, 128, Limits());
    ASSERT_TRUE(around);
    ASSERT_TRUE(saveEnvironment(*around, folder / "latlong.exr", {}, job));
    ASSERT_TRUE(exrenvmap("-c", folder / "latlong.exr", folder / "cube.exr"));
    const auto theirs = openEnvironment(folder / "cube.exr", job);
    ASSERT_TRUE(theirs) << theirs.error().text();
    ASSERT_EQ((*theirs)->layout, Environment::Layout::cube);
    EXPECT_LT(differenceOf(**theirs, faces), 0.02);
    // Our six faces, its picture all around.
    ASSERT_TRUE(saveEnvironment(faces, folder / "ours.exr", {}, job));
    ASSERT_TRUE(exrenvmap("-l", folder / "ours.exr", folder / "back.exr"));
    const auto back = openEnvironment(folder / "back.exr", job);
    ASSERT_TRUE(back) << back.error().text();
    ASSERT_EQ((*back)->layout, Environment::Layout::equirectangular);
    EXPECT_LT(differenceOf(**back, faces), 0.02);
}

}  // namespace
}  // namespace stx

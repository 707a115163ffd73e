// The rules on atlases: in memory, in folders, and in OpenEXR files whose index is changed.
#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <sstream>

#include <nlohmann/json.hpp>

#include "formats/atlas/atlas_files.hpp"
#include "formats/images/images.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/atlas/small_atlas.hpp"
#include "tests/unit/validate/numbers.hpp"

namespace stx {
namespace {

namespace fs = std::filesystem;

/// Two views on one page, with the same planes so that one fits the other's points.
Atlas goodAtlas() {
    Atlas atlas = smallAtlas(2, 32, false, false);
    for (ReferenceView& view : atlas.views) {
        view.nearPlane = 0.0625;
        view.farPlane = 5.5;
    }
    return atlas;
}

TEST(ValidateAtlas, AtlasesInMemoryKeepTheRules) {
    const Atlas good = goodAtlas();
    EXPECT_TRUE(validate(good).empty()) << textOf(validate(good));
    Atlas atlas = good;
    atlas.rectangles[1].atlasX = atlas.rectangles[0].atlasX;
    EXPECT_EQ(numbersOf(validate(atlas)), Numbers{5002});
    atlas = good;
    atlas.rectangles[1].atlasX = atlas.width();
    EXPECT_EQ(numbersOf(validate(atlas)), Numbers{5001});
    atlas = good;
    atlas.pages[0].texture = Texture(Rgba8Image(10, 10));
    EXPECT_EQ(numbersOf(validate(atlas)), Numbers{5004});
    atlas = good;
    atlas.pages.resize(3, atlas.pages[0]);
    EXPECT_EQ(numbersOf(validate(atlas)), Numbers{5003}) << textOf(validate(atlas));
    atlas = good;
    atlas.views[0].farPlane = -1;
    atlas.views[1].nearPlane = -1;
    EXPECT_EQ(numbersOf(validate(atlas)), (Numbers{3001, 3002, 4030})) << textOf(validate(atlas));
    atlas = good;
    for (float& d : atlas.pages[0].depth.pixels()) d = kNoDepth;
    EXPECT_EQ(numbersOf(validate(atlas)), (Numbers{4006, 4007}));
    atlas = good;
    atlas.objects.resize(2);
    atlas.objects[0] = {"cup", "", 0, 1, {}, {}, 1, 1};
    atlas.objects[1] = {"jug", "", 1, 1, {}, {}, 1, 1};
    EXPECT_TRUE(validate(atlas).empty());
    atlas.objects[1].name = "cup";
    EXPECT_EQ(numbersOf(validate(atlas)), Numbers{5005});
    atlas.objects.pop_back();
    EXPECT_EQ(numbersOf(validate(atlas)), Numbers{5005});
}

std::string textOfFile(const fs::path& path) {
    std::ostringstream text;
    text << std::ifstream(path, std::ios::binary).rdbuf();
    return text.str();
}

/// The text with the first `from` replaced.
std::string replaced(std::string text, const std::string& from, const std::string& to) {
    const auto at = text.find(from);
    if (at == std::string::npos) ADD_FAILURE() << from << " is not in\n" << text;
    return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

TEST(ValidateAtlas, ObjectsOfAFileHaveAllViews) {
    const TemporaryFolder folder;
    Job job;
    Atlas good = goodAtlas();
    good.objects.resize(2);
    good.objects[0] = {"cup", "", 0, 1, {}, {}, 1, 1};
    good.objects[1] = {"jug", "", 1, 1, Bounds{{0, 0, 0}, {1, 2, 3}}, {4, 5, 6}, 9, 8};
    ASSERT_TRUE(writeAtlas(good, folder / "a", job));
    EXPECT_EQ(numbersOf(validateFile(folder / "a", {}, job)), Numbers{});
    const auto read = readAtlas(folder / "a", job);
    ASSERT_TRUE(read);
    EXPECT_EQ(read->objects[1].name, "jug");
    EXPECT_EQ(read->objects[1].bounds->max, glm::dvec3(1, 2, 3));
    EXPECT_EQ(read->objects[1].origin, glm::dvec3(4, 5, 6));
    EXPECT_EQ(read->objects[1].keptPixels, 8);
    const std::string index = textOfFile(folder / "a/atlas.json");
    for (const auto& [from, to] : {std::pair("\"name\":\"jug\"", "\"name\":\"cup\""),
                                   std::pair("\"firstView\":1", "\"firstView\":0"),
                                   std::pair("\"name\":\"cup\"", "\"name\":\"\""),
                                   std::pair("\"views\":1", "\"views\":0")}) {
        std::ofstream(folder / "a/atlas.json", std::ios::binary) << replaced(index, from, to);
        EXPECT_EQ(numbersOf(validateFile(folder / "a", {}, job)), Numbers{5005}) << to;
        EXPECT_FALSE(readAtlas(folder / "a", job)) << to;
    }
}

/// The same, with normals that point to the viewer.
Atlas facingAtlas() {
    Atlas atlas = goodAtlas();
    AtlasPage& page = atlas.pages[0];
    page.normal = Image<glm::vec3>(page.depth.width(), page.depth.height());
    for (const AtlasRectangle& r : atlas.rectangles)
        for (int y = r.viewY; y < r.viewY + r.height; ++y)
            for (int x = r.viewX; x < r.viewX + r.width; ++x) {
                const glm::ivec2 at = r.atlasFromView(x, y);
                if (hasPoint(page.depth.at(at.x, at.y)))
                    page.normal.at(at.x, at.y) =
                        glm::vec3(-atlas.views[r.view].camera.viewDirection(x + 0.5, y + 0.5));
            }
    return atlas;
}

/// The pixels of the second view, which is turned, one by one.
void forSecondView(Atlas& atlas,
                   const std::function<void(float& depth, glm::vec3& normal)>& change) {
    const AtlasRectangle& r = atlas.rectangles[1];
    AtlasPage& page = atlas.pages[0];
    for (int y = r.atlasY; y < r.atlasY + r.atlasHeight(); ++y)
        for (int x = r.atlasX; x < r.atlasX + r.atlasWidth(); ++x)
            change(page.depth.at(x, y), page.normal.at(x, y));
}

TEST(ValidateAtlas, EachViewHasPointsAndNormalsThatPointToTheViewer) {
    const TemporaryFolder folder;
    Job job;
    const auto lookAt = [&](const Atlas& atlas, const Numbers& numbers) {
        EXPECT_EQ(numbersOf(validate(atlas)), numbers) << textOf(validate(atlas));
        Atlas codes = atlas;
        for (ReferenceView& view : codes.views) view.depthBits = 16;
        int n = 0;
        const std::initializer_list<std::pair<const Atlas*, const char*>> files = {
            {&atlas, "a.exr"}, {&atlas, "a"}, {&codes, "codes"}};
        for (const auto& [written, name] : files) {
            const auto path = folder / fmt::format("{}_{}", n++, name);
            const auto saved = writeAtlas(*written, path, job);
            ASSERT_TRUE(saved) << saved.error().text();
            const auto found = validateFile(path, {}, job);
            EXPECT_EQ(numbersOf(found), numbers) << name << "\n" << textOf(found);
            EXPECT_EQ(numbersOf(validateFile(path, {false}, job)), Numbers{}) << name;
        }
    };
    const Atlas good = facingAtlas();
    lookAt(good, {});
    Atlas atlas = good;
    forSecondView(atlas, [](float&, glm::vec3& n) { n = -n; });
    lookAt(atlas, {6008});
    // The index may name them in any order.
    const std::string index = textOfFile(folder / "2_codes/atlas.json");
    const auto lineOf = [&](const std::string& attribute) {
        const auto at = index.find("{\"attribute\":\"" + attribute);
        return index.substr(at, index.find('}', at) + 1 - at);
    };
    const std::string depth = lineOf("depth"), normal = lineOf("normal");
    std::ofstream(folder / "2_codes/atlas.json", std::ios::binary)
        << replaced(replaced(replaced(index, depth, "@"), normal, depth), "@", normal);
    EXPECT_EQ(numbersOf(validateFile(folder / "2_codes", {}, job)), Numbers{6008});
    atlas = good;
    forSecondView(atlas, [](float&, glm::vec3& n) { n *= 0.5f; });
    lookAt(atlas, {6007});
    atlas = good;
    forSecondView(atlas, [](float& d, glm::vec3& n) {
        d = kNoDepth;
        n = glm::vec3(0);
    });
    lookAt(atlas, {4006});
    // Others show what was pruned.
    atlas.views[1].pruned = true;
    lookAt(atlas, {});
}

TEST(ValidateAtlas, AViewOfAFilmHasAPointInOneOfItsAtlases) {
    const TemporaryFolder folder;
    Job job;
    Atlas atlas = facingAtlas();
    atlas.time = 0;
    ASSERT_TRUE(writeAtlas(atlas, folder / "f_0", job));
    forSecondView(atlas, [](float& d, glm::vec3& n) {
        d = kNoDepth;
        n = glm::vec3(0);
    });
    atlas.time = 1;
    ASSERT_TRUE(writeAtlas(atlas, folder / "f_1", job));
    EXPECT_EQ(numbersOf(validateFile(folder / "f_1", {}, job)), Numbers{4006});
    EXPECT_EQ(numbersOf(validateFile(folder / "f_%d", {}, job)), Numbers{});
    fs::remove_all(folder / "f_0");
    EXPECT_EQ(numbersOf(validateFile(folder / "f_%d", {}, job)), Numbers{4006});
}

/// What the index of an atlas of two views and one page says after a change.
struct Sample {
    Numbers numbers;
    std::string from, to;
};
const std::vector<Sample>& samples() {
    static const std::vector<Sample> all = {
        {{3002}, "\"nearPlane\":", "\"nearPlane\":-"},
        {{3003}, "\"fx\":", "\"fx\":-"},
        {{3009}, "\"name\":\"view 1\"", "\"name\":\"view 0\""},
        {{3005}, "\"quaternion\":[-0.", "\"quaternion\":[-5."},
        // What is said twice is said alike: the first view has angles, the second a window.
        {{3003}, "\"fieldOfView\":[", "\"fieldOfView\":[9"},
        {{3005}, "\"orientation\":[-0.", "\"orientation\":[0."},
        {{5001}, "\"atlasX\":", "\"atlasX\":99999"},
        {{5001}, "\"viewX\":", "\"viewX\":-7"},
        {{5001}, "\"view\":1", "\"view\":2"},
        {{5001}, "\"page\":0,\"viewX\"", "\"page\":1,\"viewX\""},
    };
    return all;
}

TEST(ValidateAtlas, EveryRuleIsReportedOfAFolder) {
    const TemporaryFolder folder;
    const auto path = folder / "atlas";
    Job job;
    const Atlas good = goodAtlas();
    ASSERT_TRUE(writeAtlas(good, path, job));
    const std::string index = textOfFile(path / "atlas.json");
    const auto numbersWith = [&](const std::string& text, const ValidateOptions& options = {}) {
        std::ofstream(path / "atlas.json", std::ios::binary) << text;
        const auto findings = validateFile(path, options, job);
        EXPECT_TRUE(findings) << findings.error().text();
        return numbersOf(findings);
    };
    EXPECT_EQ(numbersWith(index), Numbers{});
    for (const Sample& s : samples()) {
        EXPECT_EQ(numbersWith(replaced(index, s.from, s.to)), s.numbers) << s.to;
        EXPECT_EQ(numbersWith(replaced(index, s.from, s.to), {false}), s.numbers) << s.to;
    }
    // The second rectangle over the first one.
    const auto x = [&](int i) { return fmt::format("\"atlasX\":{},", good.rectangles[i].atlasX); };
    EXPECT_EQ(numbersWith(replaced(index, x(1), x(0))), Numbers{5002});
    // farPlane before nearPlane, and so before the points.
    EXPECT_EQ(numbersWith(replaced(index, "\"farPlane\":5.5", "\"farPlane\":0.03125")),
              (Numbers{3001, 4030}));
    EXPECT_EQ(numbersWith(replaced(index, "\"depthBits\":32", "\"depthBits\":12")), Numbers{4011});
    // Several at once.
    EXPECT_EQ(numbersWith(replaced(replaced(index, "\"fx\":", "\"fx\":-"), x(1), x(0))),
              (Numbers{3003, 5002}));
    EXPECT_EQ(numbersWith("{ \"version\": 1 }"), Numbers{1001});
}

TEST(ValidateAtlas, FiveTexturesOnTwoPagesAreTooMany) {
    const TemporaryFolder folder;
    const auto path = folder / "atlas";
    Job job;
    ASSERT_TRUE(writeAtlas(smallAtlas(2, 16, true, false), path, job));
    std::string index = textOfFile(path / "atlas.json");
    // Colour and depth of page 1 are those of page 0 again.
    const auto lineOf = [&](const std::string& attribute) {
        const auto at = index.find("{\"attribute\":\"" + attribute);
        return index.substr(at, index.find('}', at) + 1 - at);
    };
    const auto onPage1 = [](const std::string& line) {
        return replaced(line, "\"page\":0", "\"page\":1");
    };
    const std::string colour = lineOf("colour"), depth = lineOf("depth");
    index = replaced(index, colour, colour + "," + onPage1(colour) + "," + onPage1(depth));
    index = replaced(index, "\"pages\": 1", "\"pages\": 2");
    std::ofstream(path / "atlas.json", std::ios::binary) << index;
    const auto findings = validateFile(path, {}, job);
    Numbers numbers = numbersOf(findings);
    numbers.erase(6008);  // the normals are random
    EXPECT_EQ(numbers, Numbers{5003}) << textOf(findings);
    EXPECT_NE(textOf(findings).find("6 textures"), std::string::npos);
}

TEST(ValidateAtlas, ImagesOfAFolderHaveTheSizeOfThePage) {
    const TemporaryFolder folder;
    const auto path = folder / "atlas";
    Job job;
    ASSERT_TRUE(writeAtlas(smallAtlas(2, 16, false, false), path, job));
    const std::vector<std::uint8_t> small(4 * 3 * 4, 9);
    ASSERT_TRUE(writeFile(path / "colour.png", *encodePng(4, 3, 4, 8, small.data(), true)));
    EXPECT_EQ(numbersOf(validateFile(path, {}, job)), Numbers{5004});
    EXPECT_EQ(numbersOf(validateFile(path, {false}, job)), Numbers{5004});
    EXPECT_EQ(numbersOf(validateFile(path / "atlas.json", {}, job)), Numbers{5004});
    fs::remove(path / "depth.png");
    EXPECT_EQ(numbersOf(validateFile(path, {}, job)), (Numbers{4005, 5004}));
    std::ofstream(path / "depth.png") << "no image";
    EXPECT_EQ(numbersOf(validateFile(path, {}, job)), (Numbers{4005, 5004}));
}

TEST(ValidateAtlas, CamerasAreSaidAlikeTwice) {
    const TemporaryFolder folder;
    Job job;
    const Atlas good = goodAtlas();
    ASSERT_TRUE(writeAtlas(good, folder / "a", job));
    const auto index = nlohmann::ordered_json::parse(textOfFile(folder / "a/atlas.json"));
    const auto numbersWith = [&](int view, const char* key, const std::vector<double>& said) {
        auto changed = index;
        changed["views"][view][key] = said;
        std::ofstream(folder / "a/atlas.json", std::ios::binary) << changed.dump();
        // Neither is read where the atlas is drawn.
        EXPECT_TRUE(readAtlas(folder / "a", job));
        return numbersOf(validateFile(folder / "a", {}, job));
    };
    for (int i = 0; i < 2; ++i) {
        const Camera& camera = good.views[i].camera;
        const glm::dvec2 fov = camera.fieldOfView();
        EXPECT_EQ(numbersWith(i, "fieldOfView", {fov.x, fov.y * 1.00001}), Numbers{}) << i;
        EXPECT_EQ(numbersWith(i, "fieldOfView", {fov.x, fov.y * 1.1}), Numbers{3003}) << i;
        EXPECT_EQ(numbersWith(i, "fieldOfView", {-fov.x, fov.y}), Numbers{3003}) << i;
        const glm::dvec4 turn = axisAngleFromQuat(camera.orientation);
        // The same rotation the other way round, and as floats have it.
        EXPECT_EQ(numbersWith(i, "orientation", {-turn.x, -turn.y, -turn.z, -turn.w}), Numbers{});
        EXPECT_EQ(numbersWith(i, "orientation", {turn.x, turn.y, turn.z, turn.w + 1e-6}),
                  Numbers{});
        EXPECT_EQ(numbersWith(i, "orientation", {turn.x, turn.y, turn.z, turn.w + 0.01}),
                  Numbers{3005});
    }
    EXPECT_EQ(numbersWith(0, "fieldOfView", {1}), Numbers{1001});
}

TEST(ValidateAtlas, AnIndexThatContradictsItselfIsRefused) {
    const TemporaryFolder folder;
    Job job;
    ASSERT_TRUE(writeAtlas(smallAtlas(2, 16, true, false), folder / "a", job));
    const auto index = nlohmann::ordered_json::parse(textOfFile(folder / "a/atlas.json"));
    const auto refused = [&](const std::function<void(nlohmann::ordered_json&)>& change,
                             const std::string& expected) {
        auto changed = index;
        change(changed);
        std::ofstream(folder / "a/atlas.json", std::ios::binary) << changed.dump();
        const auto findings = validateFile(folder / "a", {}, job);
        EXPECT_EQ(numbersOf(findings), Numbers{1001}) << expected;
        EXPECT_NE(textOf(findings).find(expected), std::string::npos) << textOf(findings);
    };
    refused([](auto& json) { json["textures"][2]["scale"] = 0; },
            "textures[2].scale is 0; it must be above 0");
    refused([](auto& json) { json["duration"] = 0; }, "duration is 0; it must be above 0");
    refused([](auto& json) { json["linear"] = true; },
            "textures[0].coding is sRGB8, but linear is true; float goes with true, all others "
            "with false");
    refused([](auto& json) { json["textures"][0]["coding"] = "float"; },
            "textures[0].coding is float, but linear is false");
    refused(
        [](auto& json) {
            json["bounds"]["min"] = {0, 2, 0};
            json["bounds"]["max"] = {1, 1, 1};
        },
        "bounds have a min of 2 above their max of 1; min must not be above max");
    // Limits of pixels are whole numbers.
    refused([](auto& json) { json["rectangles"][0]["atlasX"] = 2147483647; },
            "rectangles[0].atlasX is 2147483647; -536870911 to 536870911 is possible");
}

/// An atlas of one part with that index and depth.
void writeExrAtlas(const fs::path& path, const std::string& index, const Image<float>& depth) {
    ExrPart part;
    part.width = part.displayWidth = depth.width();
    part.height = part.displayHeight = depth.height();
    part.attributes["stx:kind"] = std::string("atlas");
    part.attributes["stx:atlas"] = index;
    const std::vector<float> ones(depth.count(), 1.0f);
    std::vector<ExrConstPixels> pixels;
    for (const std::string name : {"R", "G", "B", "A", "Z"}) {
        part.channels.push_back({name});
        pixels.push_back({name, name == "Z" ? depth.data() : ones.data()});
    }
    auto file = OutputFile::create(path);
    ASSERT_TRUE(file);
    auto writer = ExrWriter::create(*file, {part});
    ASSERT_TRUE(writer) << writer.error().text();
    ASSERT_TRUE(writer->writePart(0, pixels));
    ASSERT_TRUE(writer->finish());
    ASSERT_TRUE(file->commit());
}

TEST(ValidateAtlas, EveryRuleIsReportedOfAnExrFile) {
    const TemporaryFolder folder;
    const auto path = folder / "atlas.exr";
    Job job;
    const Atlas good = goodAtlas();
    ASSERT_TRUE(writeAtlas(good, path, job));
    EXPECT_EQ(numbersOf(validateFile(path, {}, job)), Numbers{});
    std::string index;
    {
        const auto reader = ExrReader::open(path, job.limits);
        ASSERT_TRUE(reader);
        index = *reader->parts()[0].attribute<std::string>("stx:atlas");
    }
    const Image<float>& depth = good.pages[0].depth;
    for (const Sample& s : samples()) {
        writeExrAtlas(path, replaced(index, s.from, s.to), depth);
        const auto findings = validateFile(path, {}, job);
        EXPECT_EQ(numbersOf(findings), s.numbers) << s.to << "\n" << textOf(findings);
    }
    Image<float> nan = depth;
    const AtlasRectangle& r = good.rectangles[0];
    nan.at(r.atlasX, r.atlasY) = std::numeric_limits<float>::quiet_NaN();
    writeExrAtlas(path, index, nan);
    EXPECT_EQ(numbersOf(validateFile(path, {}, job)), Numbers{4030});
    EXPECT_FALSE(readAtlas(path, job));  // opening still refuses it
    writeExrAtlas(path, index, Image<float>(7, 5, 1.0f));
    EXPECT_EQ(numbersOf(validateFile(path, {}, job)), Numbers{5004});
}

}  // namespace
}  // namespace stx

// The rules on bundles: in memory, and in OpenEXR files that are written without any check.
#include <cstring>
#include <fstream>
#include <functional>
#include <limits>

#include "formats/exr/bundle_exr.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/mpeg4/mapping_fixtures.hpp"
#include "tests/unit/validate/numbers.hpp"

namespace stx {
namespace {

constexpr int kWidth = 8, kHeight = 6;

/// A view that breaks no rule.
ReferenceView goodView(int seed = 1) {
    ReferenceView view = mpeg4::makeView(kWidth, kHeight, 16, seed);
    mpeg4::addVectors(view);
    for (auto& n : view.normal.pixels())
        if (n != glm::vec3(0)) n = glm::vec3(-view.camera.forward());
    return view;
}

std::vector<std::string> vectorChannels(const std::string& name) {
    return {name + ".X", name + ".Y", name + ".Z"};
}

/// Writes views as they are, whatever rules they break, without the channels of `left out`.
void writeUnchecked(const std::filesystem::path& path, const std::vector<ReferenceView>& views,
                    const std::vector<std::string>& leftOut = {}) {
    std::vector<ExrPart> parts;
    for (const ReferenceView& view : views) {
        ExrPart part;
        part.name = view.name;
        part.width = part.displayWidth = kWidth;
        part.height = part.displayHeight = kHeight;
        setExrCamera(part, view);
        // OpenEXR refuses what a broken camera makes of its own attributes.
        part.screenWindowWidth = 1;
        part.screenWindowCenter = {0, 0};
        std::vector<std::string> names = {"R", "G", "B", "A", "Z"};
        for (const auto& [name, image] :
             {std::pair("N", &view.normal), std::pair("splatU", &view.splatU),
              std::pair("splatV", &view.splatV)}) {
            if (image->empty()) continue;
            for (const auto& channel : vectorChannels(name)) names.push_back(channel);
        }
        for (const std::string& name : names)
            if (std::find(leftOut.begin(), leftOut.end(), name) == leftOut.end())
                part.channels.push_back({name});
        parts.push_back(std::move(part));
    }
    parts[0].attributes["stx:kind"] = std::string("bundle");
    auto file = OutputFile::create(path);
    ASSERT_TRUE(file);
    auto writer = ExrWriter::create(*file, parts);
    ASSERT_TRUE(writer) << writer.error().text();
    const std::vector<float> ones(kWidth * kHeight, 1.0f);
    for (std::size_t i = 0; i < views.size(); ++i) {
        std::vector<ExrConstPixels> pixels;
        for (const ExrChannel& c : parts[i].channels) {
            const ReferenceView& view = views[i];
            if (c.name.size() == 1) {
                pixels.push_back({c.name, c.name == "Z" ? view.depth.data() : ones.data()});
                continue;
            }
            const auto& image = c.name[0] == 'N'                  ? view.normal
                                : c.name.substr(0, 6) == "splatU" ? view.splatU
                                                                  : view.splatV;
            pixels.push_back({c.name, &image.data()->x + (c.name.back() - 'X'), 3});
        }
        ASSERT_TRUE(writer->writePart(static_cast<int>(i), pixels));
    }
    ASSERT_TRUE(writer->finish());
    ASSERT_TRUE(file->commit());
}

/// Sets a channel's sampling to 2 by 2 in the bytes of a header.
void halveChannel(const std::filesystem::path& path, const std::string& channel) {
    auto bytes = readFile(path, Limits());
    ASSERT_TRUE(bytes);
    // name, 0, type (4 bytes), linear and reserved (4), xSampling, ySampling
    const std::string key = '\0' + channel + '\0';
    std::string text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
    const auto at = text.find(key);
    ASSERT_NE(at, std::string::npos);
    text[at + key.size() + 8] = 2;
    text[at + key.size() + 12] = 2;
    std::ofstream(path, std::ios::binary) << text;
}

TEST(ValidateBundle, BundlesInMemoryKeepTheRules) {
    Bundle bundle;
    bundle.views = {goodView()};
    EXPECT_TRUE(validate(bundle).empty()) << textOf(validate(bundle));
    bundle.views[0].texture = Texture(Rgba8Image(3, 3));
    EXPECT_EQ(numbersOf(validate(bundle)), (Numbers{4001, 4007}));
    bundle.views[0] = goodView();
    bundle.views[0].normal = Image<glm::vec3>(3, 3);
    EXPECT_EQ(numbersOf(validate(bundle)), Numbers{6001});
    bundle.views[0] = goodView();
    bundle.views[0].splatV = {};
    EXPECT_EQ(numbersOf(validate(bundle)), Numbers{6003});
}

using Change = std::function<void(ReferenceView&)>;

TEST(ValidateBundle, EveryRuleIsReportedOfAnExrFile) {
    const float inf = std::numeric_limits<float>::infinity();
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const std::vector<std::pair<Numbers, Change>> samples = {
        {{}, [](ReferenceView&) {}},
        {{3001, 4030}, [](ReferenceView& v) { std::swap(v.nearPlane, v.farPlane); }},
        {{3002}, [](ReferenceView& v) { v.nearPlane = -1; }},
        {{3003}, [](ReferenceView& v) { v.camera.fx = -3; }},
        {{3005}, [](ReferenceView& v) { v.camera.orientation *= 2.0; }},
        {{3005}, [nan](ReferenceView& v) { v.camera.position.x = nan; }},
        {{4006},
         [inf](ReferenceView& v) {
             for (float& d : v.depth.pixels()) d = inf;
         }},
        {{4011}, [](ReferenceView& v) { v.depthBits = 12; }},
        {{4030}, [](ReferenceView& v) { v.depth.at(1, 0) = 99; }},
        {{4030}, [](ReferenceView& v) { v.depth.at(1, 0) = -1; }},
        {{4030}, [nan](ReferenceView& v) { v.depth.at(1, 0) = nan; }},
        {{6003}, [](ReferenceView& v) { v.splatV = {}; }},
        {{6007},
         [](ReferenceView& v) {
             for (auto& n : v.normal.pixels()) n *= 0.5f;
         }},
        {{6007}, [nan](ReferenceView& v) { v.normal.at(1, 0).y = nan; }},
        {{6007}, [inf](ReferenceView& v) { v.normal.at(1, 0).y = inf; }},
        {{6008},
         [](ReferenceView& v) {
             for (auto& n : v.normal.pixels()) n = -n;
         }},
    };
    const TemporaryFolder folder;
    Job job;
    for (const auto& [numbers, change] : samples) {
        ReferenceView broken = goodView(2);
        change(broken);
        writeUnchecked(folder / "a.exr", {goodView(1), broken});
        const auto findings = validateFile(folder / "a.exr", {}, job);
        EXPECT_EQ(numbersOf(findings), numbers) << textOf(findings);
        if (!findings) continue;
        for (const Finding& f : *findings) {
            EXPECT_EQ(f.where, "view 1 'view2'");
            EXPECT_FALSE(f.found.empty());
            EXPECT_FALSE(f.expected.empty());
        }
    }
}

TEST(ValidateBundle, AllFindingsOfAllViewsComeAtOnce) {
    ReferenceView first = goodView(1), second = goodView(2);
    first.nearPlane = -1;
    first.depthBits = 12;
    second.camera.fx = 0;
    second.depth.at(1, 0) = -5;
    const TemporaryFolder folder;
    writeUnchecked(folder / "a.exr", {first, second});
    Job job;
    const auto all = validateFile(folder / "a.exr", {}, job);
    EXPECT_EQ(numbersOf(all), (Numbers{3002, 3003, 4011, 4030})) << textOf(all);
    ValidateOptions headers;
    headers.pixels = false;
    const auto without = validateFile(folder / "a.exr", headers, job);
    EXPECT_EQ(numbersOf(without), (Numbers{3002, 3003, 4011})) << textOf(without);
}

TEST(ValidateBundle, ChannelsOfAnExrFileHaveOneSizeAndComeTogether) {
    const TemporaryFolder folder;
    const auto path = folder / "a.exr";
    Job job;
    ValidateOptions headers;
    headers.pixels = false;
    for (const auto& [number, channel] :
         {std::pair(4001, "Z"), std::pair(6001, "N.X"), std::pair(6001, "splatU.Y")}) {
        writeUnchecked(path, {goodView()});
        halveChannel(path, channel);
        EXPECT_EQ(numbersOf(validateFile(path, headers, job)), Numbers{number}) << channel;
        const auto findings = validateFile(path, {}, job);
        EXPECT_TRUE(numbersOf(findings).contains(number)) << textOf(findings);
    }
    writeUnchecked(path, {goodView()}, {"N.Y"});
    EXPECT_EQ(numbersOf(validateFile(path, {}, job)), Numbers{6002});
    writeUnchecked(path, {goodView()}, {"Z"});
    EXPECT_EQ(numbersOf(validateFile(path, {}, job)), Numbers{4003});
}

TEST(ValidateBundle, AViewOfAFilmMayBeWithoutAPointForAWhile) {
    const TemporaryFolder folder;
    Job job;
    ReferenceView empty = goodView(2);
    for (float& d : empty.depth.pixels()) d = kNoDepth;
    writeUnchecked(folder / "f_0.exr", {goodView(1), empty});
    writeUnchecked(folder / "f_1.exr", {goodView(1), goodView(2)});
    const auto film = validateFile(folder / "f_%d.exr", {}, job);
    EXPECT_EQ(numbersOf(film), Numbers{}) << textOf(film);
    EXPECT_EQ(numbersOf(validateFile(folder / "f_0.exr", {}, job)), Numbers{4006});
    writeUnchecked(folder / "f_1.exr", {goodView(1), empty});
    const auto never = validateFile(folder / "f_%d.exr", {}, job);
    EXPECT_EQ(numbersOf(never), Numbers{4006}) << textOf(never);
}

TEST(ValidateBundle, EmptyObjectsAndDamagedFilesAreFindings) {
    const TemporaryFolder folder;
    const auto path = folder / "a.exr";
    Job job;
    ReferenceView empty = goodView();
    for (float& d : empty.depth.pixels()) d = kNoDepth;
    writeUnchecked(path, {empty});
    EXPECT_EQ(numbersOf(validateFile(path, {}, job)), (Numbers{4006, 4007}));

    writeUnchecked(path, {goodView()});
    auto bytes = readFile(path, Limits());
    ASSERT_TRUE(bytes);
    // The pixels are the end of the file.
    std::fill(bytes->end() - 60, bytes->end(), std::byte{0x5a});
    ASSERT_TRUE(writeFile(path, *bytes));
    EXPECT_EQ(numbersOf(validateFile(path, {}, job)), Numbers{4005});
    bytes->resize(100);
    ASSERT_TRUE(writeFile(path, *bytes));
    EXPECT_EQ(numbersOf(validateFile(path, {}, job)), Numbers{1001});
    const auto missing = validateFile(folder / "none.exr", {}, job);
    ASSERT_FALSE(missing);
    EXPECT_EQ(missing.error().code, ErrorCode::io);
}

}  // namespace
}  // namespace stx

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "formats/atlas/atlas_files.hpp"
#include "formats/exr/bundle_exr.hpp"
#include "formats/images/images.hpp"
#include "formats/validate/validate.hpp"
#include "lib/model/srgb8.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/atlas/small_atlas.hpp"

namespace stx {
namespace {

namespace fs = std::filesystem;

/// Values that 8 bits hold: metallic and roughness n / 255, light of sRGB codes times `brightest`.
template <class Holder>
void addMaterial(Holder& to, float brightest) {
    const glm::ivec2 size = to.depth.size();
    to.metallicRoughness = Image<glm::vec2>(size.x, size.y, glm::vec2(0));
    to.emissive = Image<glm::vec3>(size.x, size.y, glm::vec3(0));
    for (int y = 0; y < size.y; ++y) {
        for (int x = 0; x < size.x; ++x) {
            if (!hasPoint(to.depth.at(x, y))) continue;
            to.metallicRoughness.at(x, y) = {(7 * x % 256) / 255.0f, (11 * y % 256) / 255.0f};
            to.emissive.at(x, y) =
                brightest * glm::vec3(linearFromSrgb8(static_cast<std::uint8_t>(3 * x)), 0,
                                      linearFromSrgb8(static_cast<std::uint8_t>(y % 7 * 40)));
        }
    }
    to.emissive.at(1, 1) = {brightest, 0, 0};
}

Atlas materialAtlas(int bits, int pages, float brightest) {
    Atlas atlas = smallAtlas(4, bits, pages == 1, false, pages);
    for (auto& page : atlas.pages) addMaterial(page, brightest);
    return atlas;
}

Atlas thereAndBack(const Atlas& atlas, const fs::path& path) {
    Job job;
    const auto written = writeAtlas(atlas, path, job);
    EXPECT_TRUE(written) << written.error().text();
    auto back = readAtlas(path, job);
    EXPECT_TRUE(back) << back.error().text();
    const auto findings = validateFile(path, {}, job);
    EXPECT_TRUE(findings);
    if (findings) {
        for (const auto& f : *findings) EXPECT_NE(f.rule->number, 5003) << f.text();
        for (const auto& f : *findings) EXPECT_NE(f.rule->number, 5004) << f.text();
    }
    return back ? *back : Atlas();
}

template <class T>
double largestDifference(const Image<T>& a, const Image<T>& b) {
    if (a.size() != b.size()) return 1e9;
    double largest = 0;
    for (std::size_t i = 0; i < a.count(); ++i)
        largest = std::max<double>(largest, glm::length(a.pixels()[i] - b.pixels()[i]));
    return largest;
}

TEST(MaterialTextures, FolderComesBackToTheCode) {
    for (const int pages : {1, 2}) {
        const TemporaryFolder folder;
        const Atlas atlas = materialAtlas(16, pages, 3.0f);
        const Atlas back = thereAndBack(atlas, folder / "set");
        ASSERT_EQ(back.pages.size(), atlas.pages.size());
        for (std::size_t i = 0; i < atlas.pages.size(); ++i) {
            EXPECT_LT(largestDifference(atlas.pages[i].metallicRoughness,
                                        back.pages[i].metallicRoughness),
                      1e-6);
            EXPECT_LT(largestDifference(atlas.pages[i].emissive, back.pages[i].emissive), 1e-5);
        }
        EXPECT_EQ(back.textureCount(), 4);
        EXPECT_EQ(back.materialTextureCount(), 2 * pages);
    }
}

TEST(MaterialTextures, FloatsComeBackToTheBit) {
    const TemporaryFolder folder;
    for (const char* name : {"set", "set.exr"}) {
        const Atlas atlas = materialAtlas(32, 1, 2.5f);
        const Atlas back = thereAndBack(atlas, folder / name);
        ASSERT_EQ(back.pages.size(), 1u);
        EXPECT_EQ(atlas.pages[0].metallicRoughness, back.pages[0].metallicRoughness);
        EXPECT_EQ(atlas.pages[0].emissive, back.pages[0].emissive);
    }
}

/// The images are what an engine takes them for: glTF's channels, sRGB light and its strength.
TEST(MaterialTextures, ImagesAreThoseOfGltf) {
    const TemporaryFolder folder;
    Atlas atlas = materialAtlas(16, 1, 4.0f);
    atlas.pages[0].metallicRoughness.at(9, 9) = {1.0f, 0.2f};
    Job job;
    ASSERT_TRUE(writeAtlas(atlas, folder / "set", job));
    const auto picture = [&](const char* name) {
        const auto bytes = readFile(folder / "set" / name, Limits());
        auto image = decodeImage(*bytes, name, Limits());
        EXPECT_TRUE(image);
        EXPECT_EQ(image->channels, 3);
        EXPECT_EQ(image->bits(), 8);
        const std::size_t at = (9u * static_cast<std::size_t>(image->width) + 9u) * 3;
        const auto& v = std::get<0>(image->values);
        return std::make_pair(glm::ivec3(v[at], v[at + 1], v[at + 2]),
                              glm::ivec3(v[static_cast<std::size_t>(image->width + 1) * 3]));
    };
    EXPECT_EQ(picture("metallic_roughness.png").first, glm::ivec3(255, 51, 255));
    EXPECT_EQ(picture("emissive.png").second.x, 255) << "the brightest has the largest code";
    const auto bytes = readFile(folder / "set" / "atlas.json", Limits());
    const auto json =
        nlohmann::json::parse(reinterpret_cast<const char*>(bytes->data()),
                              reinterpret_cast<const char*>(bytes->data()) + bytes->size());
    EXPECT_EQ(json["textures"].size(), 6u);
    EXPECT_EQ(json["textures"][4]["coding"], "unorm8");
    EXPECT_EQ(json["textures"][5]["file"], "emissive.png");
    EXPECT_EQ(json["textures"][5]["scale"], 4.0);
}

TEST(MaterialTextures, OtherImagesThanTheIndexSaysAreErrors) {
    const TemporaryFolder folder;
    Job job;
    ASSERT_TRUE(writeAtlas(materialAtlas(16, 1, 1.0f), folder / "set", job));
    fs::copy_file(folder / "set/normal.png", folder / "set/emissive.png",
                  fs::copy_options::overwrite_existing);
    const auto back = readAtlas(folder / "set", job);
    ASSERT_FALSE(back);
    EXPECT_NE(back.error().text().find("of 3 channels with 16 bits"), std::string::npos)
        << back.error().text();
}

TEST(MaterialTextures, BundlesInOpenExrComeBackToTheBit) {
    Bundle bundle = smallBundle(3, 16, false, false);
    addMaterial(bundle.views[0], 2.0f);
    addMaterial(bundle.views[2], 1.0f);
    bundle.views[2].emissive = {};
    const TemporaryFolder folder;
    Job job;
    ASSERT_TRUE(writeExrViews(*viewsOf(bundle), folder / "a.exr", job));
    const auto back = readExrBundle(folder / "a.exr", job);
    ASSERT_TRUE(back) << back.error().text();
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(back->views[i].metallicRoughness, bundle.views[i].metallicRoughness);
        EXPECT_EQ(back->views[i].emissive, bundle.views[i].emissive);
    }
    const auto header = readExrBundleHeader(folder / "a.exr", Limits());
    ASSERT_TRUE(header);
    EXPECT_TRUE(header->views[0].emissive);
    EXPECT_FALSE(header->views[2].emissive);
    EXPECT_TRUE(header->views[2].metallicRoughness);
    EXPECT_FALSE(header->views[1].metallicRoughness);
}

}  // namespace
}  // namespace stx

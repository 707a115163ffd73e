#include <gtest/gtest.h>

#include "lib/capture/capture.hpp"
#include "lib/model/srgb8.hpp"
#include "lib/packing/packing.hpp"
#include "lib/packing/prune.hpp"

namespace stx {
namespace {

/// A square of 2 x 2 around the origin that faces +Z, of one material, with texture coordinates
/// from (0, 0) at its top left to (1, 1).
Mesh square(Material material, std::vector<MeshTexture> textures) {
    Mesh mesh;
    mesh.positions = {{-1, 1, 0}, {1, 1, 0}, {1, -1, 0}, {-1, -1, 0}};
    mesh.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    mesh.triangles = {{0, 2, 1}, {0, 3, 2}};
    mesh.triangleMaterial = {0, 0};
    mesh.materials = {std::move(material)};
    mesh.textures = std::move(textures);
    return mesh;
}

/// Left half `left`, right half `right`, without interpolation.
MeshTexture halves(glm::u8vec4 left, glm::u8vec4 right) {
    MeshTexture texture;
    texture.pixels = Rgba8Image(2, 1, left);
    texture.pixels.at(1, 0) = right;
    texture.nearest = true;
    return texture;
}

/// Looks at the square from +Z; it fills the picture but for a border.
Camera before(double x = 0.0) {
    Camera camera;
    camera.width = camera.height = 16;
    camera.position = {x, 0, 4};
    camera.orthographic = true;
    camera.fx = camera.fy = 6;
    camera.cx = camera.cy = 8;
    return camera;
}

Material glowing() {
    Material m;
    m.baseColour = {0.25f, 0.25f, 0.25f, 1};
    m.metallic = 0.5f;
    m.roughness = 0.8f;
    m.metallicRoughnessTexture = 0;
    m.hasMetallicRoughness = true;
    m.emissive = {2, 1, 0};
    m.emissiveTexture = 1;
    return m;
}

std::vector<MeshTexture> maps() {
    // Red and alpha must not count; green is roughness, blue metallic (glTF 2.0, 3.9.2).
    return {halves({7, 255, 51, 9}, {200, 102, 255, 3}),
            halves({255, 255, 255, 255}, {0, 0, 0, 1})};
}

CaptureSettings withMaterials() {
    CaptureSettings settings;
    settings.materials = true;
    return settings;
}

Bundle captured(const CaptureSettings& settings, std::vector<Camera> cameras = {before()}) {
    Job job;
    auto bundle = captureBundle(square(glowing(), maps()), cameras, settings, job);
    EXPECT_TRUE(bundle) << bundle.error().text();
    return bundle ? std::move(*bundle) : Bundle();
}

TEST(CapturedMaterials, FactorsMultiplyTheMaps) {
    const Bundle bundle = captured(withMaterials());
    const ReferenceView& view = bundle.views.at(0);
    ASSERT_EQ(view.metallicRoughness.size(), view.depth.size());
    ASSERT_EQ(view.emissive.size(), view.depth.size());
    const glm::vec2 left = view.metallicRoughness.at(4, 8),
                    right = view.metallicRoughness.at(11, 8);
    EXPECT_NEAR(left.x, 0.5 * 51 / 255, 1e-6);
    EXPECT_NEAR(left.y, 0.8, 1e-6);
    EXPECT_NEAR(right.x, 0.5, 1e-6);
    EXPECT_NEAR(right.y, 0.8 * 102 / 255, 1e-6);
    EXPECT_LT(glm::length(view.emissive.at(4, 8) - glm::vec3(2, 1, 0)), 1e-5f);
    EXPECT_EQ(view.emissive.at(11, 8), glm::vec3(0));
    // Pixels without a point have no material.
    ASSERT_FALSE(hasPoint(view.depth.at(0, 0)));
    EXPECT_EQ(view.metallicRoughness.at(0, 0), glm::vec2(0));
    EXPECT_EQ(view.emissive.at(0, 0), glm::vec3(0));
}

TEST(CapturedMaterials, MapsAreWhereTheirOwnCoordinatesSay) {
    Mesh mesh = square(glowing(), maps());
    mesh.emissiveUvs = {{1, 0}, {0, 0}, {0, 1}, {1, 1}};  // mirrored
    const auto read = [](const Mesh& from) {
        Job job;
        auto bundle = captureBundle(from, {before()}, withMaterials(), job);
        EXPECT_TRUE(bundle) << bundle.error().text();
        return std::move(bundle->views.at(0));
    };
    const ReferenceView light = read(mesh);
    EXPECT_EQ(light.emissive.at(4, 8), glm::vec3(0));
    EXPECT_LT(glm::length(light.emissive.at(11, 8) - glm::vec3(2, 1, 0)), 1e-5f);
    EXPECT_NEAR(light.metallicRoughness.at(4, 8).y, 0.8, 1e-6);
    std::swap(mesh.emissiveUvs, mesh.metallicRoughnessUvs);
    const ReferenceView surface = read(mesh);
    EXPECT_EQ(surface.emissive.at(11, 8), glm::vec3(0));
    EXPECT_NEAR(surface.metallicRoughness.at(4, 8).y, 0.8 * 102 / 255, 1e-6);
    EXPECT_NEAR(surface.metallicRoughness.at(11, 8).y, 0.8, 1e-6);
    // The mesh needs no others then.
    mesh.uvs.clear();
    mesh.emissiveUvs = mesh.metallicRoughnessUvs;
    EXPECT_TRUE(mesh.check());
    mesh.emissiveUvs.clear();
    EXPECT_FALSE(mesh.check());
}

TEST(CapturedMaterials, LightIsInTheColourOrApart) {
    const std::uint8_t base = srgb8FromLinear(0.25f);
    const auto apart = captured(withMaterials()).views.at(0).texture.rgba8()->at(4, 8);
    EXPECT_NEAR(apart.r, base, 1);
    EXPECT_NEAR(apart.b, base, 1);
    const Bundle plain = captured({});
    EXPECT_FALSE(plain.hasMaterial());
    Job job;
    ASSERT_TRUE(captureBundle(square(Material(), {}), {before()}, {}, job));
    EXPECT_TRUE(job.takeNotes().empty());
    Material glows;
    glows.baseColour = glm::vec4(glm::vec3(0.25f), 1.0f);
    glows.emissive = glm::vec3(0.5f);
    ASSERT_TRUE(captureBundle(square(glows, {}), {before()}, {}, job));
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_EQ(notes[0],
              "what gives off light has it in its colour, which --light of stx render dims like "
              "paint; drawn from the model itself it shines");
    glows.emissive = glm::vec3(1.5f);
    ASSERT_TRUE(captureBundle(square(glows, {}), {before()}, {}, job));
    EXPECT_EQ(job.takeNotes().back(),
              "what gives off more light than white is white in views, which have 8 bits");
    const auto together = plain.views.at(0).texture.rgba8()->at(4, 8);
    EXPECT_EQ(together.r, 255);
    EXPECT_NEAR(together.b, base, 1);
}

TEST(CapturedMaterials, AModelWithoutThemIsSaidToHaveNone) {
    Job job;
    const auto bundle = captureBundle(square(Material(), {}), {before()}, withMaterials(), job);
    ASSERT_TRUE(bundle);
    EXPECT_FALSE(bundle->hasMaterial());
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("has nothing to keep"), std::string::npos);
}

TEST(CapturedMaterials, TravelThroughAnAtlas) {
    const Bundle bundle = captured(withMaterials(), {before(), before(0.1)});
    for (const auto layout : {PackSettings::Layout::grid, PackSettings::Layout::tight}) {
        Job job;
        PackSettings settings;
        settings.layout = layout;
        const auto atlas = pack(bundle, settings, job);
        ASSERT_TRUE(atlas) << atlas.error().text();
        EXPECT_EQ(atlas->textureCount(), 2);
        EXPECT_EQ(atlas->materialTextureCount(), 2);
        const auto back = unpack(*atlas, job);
        ASSERT_TRUE(back) << back.error().text();
        for (std::size_t i = 0; i < bundle.views.size(); ++i) {
            EXPECT_EQ(back->views[i].metallicRoughness, bundle.views[i].metallicRoughness);
            EXPECT_EQ(back->views[i].emissive, bundle.views[i].emissive);
        }
    }
}

// Filters mix them with kept ones.
TEST(CapturedMaterials, PrunedPixelsKeepThemAndNormalsAsFarAsColours) {
    CaptureSettings settings = withMaterials();
    settings.meshNormals = true;
    const Bundle bundle = captured(settings);
    const ReferenceView& whole = bundle.views.at(0);
    ReferenceView view = whole;
    // Of the square, which is at 2 to 13.
    constexpr int kKept = 4, kBand = 4;
    Image<std::uint8_t> kept(16, 16, std::uint8_t{0});
    for (int y = 0; y < 16; ++y)
        for (int x = 0; x < kKept; ++x) kept.at(x, y) = 1;
    keepOnly(kept, view);
    for (int x = 2; x < 14; ++x) {
        EXPECT_EQ(hasPoint(view.depth.at(x, 8)), x < kKept) << x;
        const bool near = x < kKept + kBand;
        EXPECT_EQ(view.normal.at(x, 8), near ? whole.normal.at(x, 8) : glm::vec3(0)) << x;
        EXPECT_EQ(view.metallicRoughness.at(x, 8),
                  near ? whole.metallicRoughness.at(x, 8) : glm::vec2(0))
            << x;
        EXPECT_EQ(view.emissive.at(x, 8), near ? whole.emissive.at(x, 8) : glm::vec3(0)) << x;
    }
    EXPECT_NE(view.normal.at(6, 8), glm::vec3(0));
    EXPECT_NE(view.metallicRoughness.at(6, 8), glm::vec2(0));
    EXPECT_NE(view.emissive.at(6, 8), glm::vec3(0));
}

TEST(CapturedMaterials, AnotherSizeIsRefused) {
    Bundle bundle = captured(withMaterials());
    bundle.views[0].emissive = Image<glm::vec3>(3, 3);
    const auto ok = bundle.check();
    ASSERT_FALSE(ok);
    EXPECT_NE(ok.error().text().find("emissive 3x3"), std::string::npos) << ok.error().text();
}

TEST(Materials, SmoothPlasticComesBackFromAnAtlas) {
    Material smooth;
    smooth.metallic = smooth.roughness = 0;
    smooth.hasMetallicRoughness = true;
    CaptureSettings settings;
    settings.materials = true;
    Job job;
    const auto bundle = captureBundle(square(smooth, {}), {before()}, settings, job);
    ASSERT_TRUE(bundle);
    ASSERT_FALSE(bundle->views[0].metallicRoughness.empty());
    const auto atlas = pack(*bundle, {}, job);
    ASSERT_TRUE(atlas);
    const auto unpacked = unpack(*atlas, job);
    ASSERT_TRUE(unpacked);
    EXPECT_EQ(unpacked->views[0].metallicRoughness, bundle->views[0].metallicRoughness);
}

}  // namespace
}  // namespace stx

#include <gtest/gtest.h>

#include "lib/capture/capture.hpp"
#include "lib/capture/rasterizer.hpp"

namespace stx {
namespace {

/// Squares of 8 x 8 that face +Z, each with a material of its own; materials[0] is the first's.
Mesh squares(const std::vector<std::pair<float, glm::vec4>>& heightAndColour) {
    Mesh mesh;
    for (const auto& [z, colour] : heightAndColour) {
        const auto base = static_cast<std::uint32_t>(mesh.positions.size());
        const auto material = static_cast<std::uint32_t>(mesh.materials.size());
        mesh.positions.insert(mesh.positions.end(),
                              {{-4, -4, z}, {4, -4, z}, {4, 4, z}, {-4, 4, z}});
        mesh.triangles.insert(mesh.triangles.end(),
                              {{base, base + 1, base + 2}, {base, base + 2, base + 3}});
        mesh.triangleMaterial.insert(mesh.triangleMaterial.end(), {material, material});
        Material m;
        m.name = fmt::format("m{}", material);
        m.baseColour = colour;
        m.alpha = colour.a < 1 ? Material::Alpha::blend : Material::Alpha::opaque;
        mesh.materials.push_back(m);
    }
    return mesh;
}

constexpr glm::vec4 kRed{1, 0, 0, 1}, kBlue{0, 0, 1, 1};
glm::vec4 withAlpha(glm::vec4 colour, float alpha) {
    return {glm::vec3(colour), alpha};
}

/// From z = 5, one unit a pixel: the squares fill the frame.
Camera above() {
    return Camera::fromFieldOfView({0, 0, 5}, {1, 0, 0, 0}, {8, 8}, true, 8, 8);
}

void expectAll(const RasterImage& image, glm::vec4 colour, float depth) {
    for (int y = 0; y < 8; ++y) {
        for (int x = 0; x < 8; ++x) {
            for (int k = 0; k < 4; ++k)
                EXPECT_NEAR(image.colour.at(x, y)[k], colour[k], 1e-4f)
                    << x << ' ' << y << ' ' << k;
            EXPECT_FLOAT_EQ(image.depth.at(x, y), depth) << x << ' ' << y;
        }
    }
}

TEST(Translucent, AloneKeepsItsShareOfCoverageAndItsDepth) {
    Job job;
    for (const float alpha : {0.05f, 0.3f, 0.5f, 0.7f, 0.95f}) {
        for (const int samples : {1, 2, 4}) {
            RasterSettings settings;
            settings.supersampling = samples;
            const auto image =
                rasterise(squares({{0, withAlpha(kRed, alpha)}}), above(), settings, job);
            ASSERT_TRUE(image);
            expectAll(*image, kRed * alpha, 5);
        }
    }
}

TEST(Translucent, InFrontOfOpaqueMixesAndTheDepthIsWhatShowsMost) {
    Job job;
    for (const float alpha : {0.3f, 0.5f, 0.7f}) {
        const auto mesh = squares({{0, kBlue}, {1, withAlpha(kRed, alpha)}});
        const auto image = rasterise(mesh, above(), {}, job);
        ASSERT_TRUE(image);
        expectAll(*image, kRed * alpha + kBlue * (1 - alpha), alpha < 0.5f ? 5 : 4);
    }
    // Behind opaque it does not show.
    const auto hidden =
        rasterise(squares({{0, withAlpha(kRed, 0.5f)}, {1, kBlue}}), above(), {}, job);
    expectAll(*hidden, kBlue, 4);
}

TEST(Translucent, LayersAddUpInAnyOrder) {
    Job job;
    const auto a = withAlpha(kRed, 0.3f), b = withAlpha(kBlue, 0.4f);
    const auto expected = kBlue * 0.4f + kRed * 0.3f * 0.6f;
    for (const auto& mesh : {squares({{0, a}, {2, b}}), squares({{2, b}, {0, a}})}) {
        const auto image = rasterise(mesh, above(), {}, job);
        ASSERT_TRUE(image);
        expectAll(*image, expected, 5);
    }
    // More than anybody looks through.
    Mesh many;
    for (int i = 0; i < 50; ++i) {
        auto one = squares({{i * 0.01f, a}});
        const auto base = static_cast<std::uint32_t>(many.positions.size());
        many.positions.insert(many.positions.end(), one.positions.begin(), one.positions.end());
        for (const auto& t : one.triangles) many.triangles.push_back(t + base);
        many.triangleMaterial.resize(many.triangles.size(), 0);
        many.materials = one.materials;
    }
    const auto image = rasterise(many, above(), {}, job);
    ASSERT_TRUE(image);
    EXPECT_GT(image->colour.at(3, 3).w, 0.94f);
}

TEST(Translucent, OneHalfDoesNotSpeckleBesideVertexColours) {
    Job job;
    auto mesh = squares({{0, kBlue}, {1, withAlpha(kRed, 0.5f)}});
    // Another part has colours, so that all vertices get white ones.
    mesh.colours.assign(mesh.positions.size(), glm::vec4(1));
    const auto camera = Camera::fromFieldOfView({0.1, 0.2, 5}, *lookAt({0.1, 0.2, 5}, {0, 0, 1}),
                                                {4, 4}, true, 64, 64);
    const auto image = rasterise(mesh, camera, {}, job);
    ASSERT_TRUE(image);
    for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 64; ++x) {
            EXPECT_NEAR(image->colour.at(x, y).w, 1.0f, 1e-4f);
            EXPECT_NEAR(image->colour.at(x, y).r, 0.5f, 1e-3f) << x << ' ' << y;
            EXPECT_LT(image->depth.at(x, y), 4.5f) << "the front surface at " << x << ' ' << y;
        }
    }
}

TEST(Translucent, MoreLayersThanAreHeldAreSaidOnceWhereTheyWouldShow) {
    const auto notesOf = [](int count, float alpha) {
        std::vector<std::pair<float, glm::vec4>> sheets;
        for (int i = 0; i < count; ++i)
            sheets.emplace_back(0.01f * static_cast<float>(i), withAlpha(kRed, alpha));
        Job job;
        for (int picture = 0; picture < 2; ++picture)
            EXPECT_TRUE(rasterise(squares(sheets), above(), {}, job));
        return job.takeNotes();
    };
    EXPECT_TRUE(notesOf(64, 0.01f).empty());
    EXPECT_TRUE(notesOf(100, 0.3f).empty()) << "the 64 nearest hide what is behind";
    const auto notes = notesOf(65, 0.01f);
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_EQ(notes[0],
              "a pixel shows the nearest 64 translucent surfaces; more lie behind each other in "
              "the model, and those behind are left out");
}

/// Glass, leaves or smoke of many sheets, in any order of the file.
TEST(Translucent, ManyLayersHideWhatTheyDoTogether) {
    Job job;
    for (const int count : {8, 9, 20, 60}) {
        std::vector<std::pair<float, glm::vec4>> sheets{{-1.0f, withAlpha(kBlue, 0.95f)}};
        for (int i = 0; i < count; ++i)
            sheets.emplace_back(0.01f * static_cast<float>(i * 7 % count), withAlpha(kRed, 0.02f));
        const auto image = rasterise(squares(sheets), above(), {}, job);
        ASSERT_TRUE(image);
        const double through = std::pow(0.98, count), red = 1 - through, blue = through * 0.95;
        // Half is hidden by 35 sheets, else by what is behind them.
        expectAll(*image, glm::vec4(red, 0, blue, red + blue), count > 35 ? 4.75f : 6.0f);
    }
}

TEST(Translucent, ReferenceViewsKeepAlphaAndTheNoteSaysSo) {
    Job job;
    const auto bundle = captureBundle(squares({{0, withAlpha(kRed, 0.3f)}}), {above()}, {}, job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    const auto* colour = bundle->views[0].texture.rgba8();
    ASSERT_TRUE(colour);
    EXPECT_EQ(bundle->views[0].pointCount(), 64);
    EXPECT_EQ(colour->at(3, 3), glm::u8vec4(255, 0, 0, 77));
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_TRUE(notes[0].starts_with("material 'm0' is translucent")) << notes[0];
}

TEST(Translucent, TheNoteSaysSoOfTexturesAndVertexColours) {
    const auto notesOf = [](const Mesh& mesh) {
        Job job;
        const auto bundle = captureBundle(mesh, {above()}, {}, job);
        EXPECT_TRUE(bundle) << bundle.error().text();
        return job.takeNotes();
    };
    auto mesh = squares({{0, withAlpha(kRed, 1.0f)}});
    mesh.materials[0].alpha = Material::Alpha::blend;
    mesh.uvs.assign(mesh.positions.size(), glm::vec2(0.5f));
    mesh.materials[0].baseColourTexture = 0;
    for (const int alpha : {0, 255, 128}) {
        MeshTexture texture;
        texture.pixels = Rgba8Image(2, 2, {255, 255, 255, 255});
        texture.pixels.at(1, 0).a = static_cast<std::uint8_t>(alpha);
        mesh.textures = {texture};
        EXPECT_EQ(notesOf(mesh).size(), alpha == 128 ? 1u : 0u) << alpha;
    }
    mesh.materials[0].baseColourTexture = -1;
    mesh.colours.assign(mesh.positions.size(), glm::vec4(1));
    EXPECT_TRUE(notesOf(mesh).empty());
    mesh.colours[1].a = 0.5f;
    const auto notes = notesOf(mesh);
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_TRUE(notes[0].starts_with("material 'm0' is translucent")) << notes[0];
}

TEST(Translucent, TheNoteCountsMaterialsThatShareATexture) {
    auto mesh = squares({{0, kRed}, {1, kRed}, {2, kRed}, {3, kRed}});
    mesh.uvs.assign(mesh.positions.size(), glm::vec2(0.5f));
    MeshTexture glass, holes;
    glass.pixels = Rgba8Image(2, 2, {255, 255, 255, 128});
    holes.pixels = Rgba8Image(2, 2, {255, 255, 255, 0});
    mesh.textures = {holes, glass};
    for (Material& m : mesh.materials) m.alpha = Material::Alpha::blend;
    mesh.materials[0].baseColourTexture = 0;
    mesh.materials[1].baseColourTexture = mesh.materials[2].baseColourTexture = 1;
    // Of the last its colours tell; the first has none of them.
    mesh.colours.assign(mesh.positions.size(), glm::vec4(1));
    mesh.colours[13].a = 0.5f;
    Job job;
    ASSERT_TRUE(captureBundle(mesh, {above()}, {}, job));
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_TRUE(notes[0].starts_with("material 'm1' and 2 more are translucent")) << notes[0];
}

}  // namespace
}  // namespace stx

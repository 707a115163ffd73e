#include <algorithm>
#include <fstream>

#include "formats/images/images.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/meshes/models.hpp"

namespace stx {
namespace {

/// A model that was made on another machine: its textures are named as they were there.
class MovedModel : public testing::Test {
  protected:
    MovedModel() {
        std::filesystem::create_directories(folder_ / "home/model/textures");
        std::filesystem::create_directories(folder_ / "home/other");
        for (const char* name :
             {"home/model/beside.png", "home/model/textures/below.png", "home/other/outside.png"})
            writePicture(name, {200, 100, 50, 255});
    }

    void writePicture(const std::string& name, glm::u8vec4 colour) {
        const Rgba8Image image(2, 2, colour);
        const auto png = encodePng(2, 2, 4, 8, image.data(), true);
        ASSERT_TRUE(png);
        ASSERT_TRUE(writeFile(folder_ / name, *png));
    }

    [[nodiscard]] std::filesystem::path obj(const std::string& texture) const {
        std::ofstream(folder_ / "home/model/a.mtl")
            << "newmtl paint\nKd 1 1 1\nmap_Kd " << texture << "\n";
        const auto file = folder_ / "home/model/a.obj";
        std::ofstream(file) << "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
                               "usemtl paint\nf 1/1 2/2 3/3\n";
        return file;
    }
    [[nodiscard]] std::filesystem::path gltf(const std::string& texture) const {
        GltfText text;
        text.addQuad();
        text.root["images"] = {{{"uri", texture}}};
        text.root["textures"] = {{{"source", 0}}};
        text.root["materials"] = {
            {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
        text.primitive()["material"] = 0;
        const auto file = folder_ / "home/model/a.gltf";
        std::ofstream(file) << text.text();
        return file;
    }
    /// Red of the first material's texture, or -1 when it has none.
    static int red(const Mesh& mesh) {
        for (const auto& m : mesh.materials) {
            if (m.baseColourTexture >= 0)
                return mesh.textures[static_cast<std::size_t>(m.baseColourTexture)]
                    .pixels.at(0, 0)
                    .r;
        }
        return -1;
    }

    TemporaryFolder folder_;
};

TEST_F(MovedModel, TexturesAreFoundBesideItAndInTextures) {
    for (const char* name :
         {"D:\\work\\beside.png", "/home/x/beside.png", "../maps/beside.png", "gone/beside.png",
          "D:\\work\\below.png", "/home/x/below.png", "../textures/below.png", "below.png"}) {
        SCOPED_TRACE(name);
        for (const auto& file : {obj(name), gltf(name)}) {
            const auto model = readGood(file);
            EXPECT_EQ(red(model.mesh), 200) << file;
            EXPECT_TRUE(model.hasNote(fmt::format("'{}' is not there", name))) << file;
        }
    }
}

TEST_F(MovedModel, WhatIsElsewhereGivesThePlainColourAndANote) {
    for (const char* name : {"D:\\work\\gone.png", "../other/outside.png", "/none/gone.png"}) {
        SCOPED_TRACE(name);
        for (const auto& file : {obj(name), gltf(name)}) {
            const auto model = readGood(file);
            EXPECT_EQ(red(model.mesh), -1) << file;
            EXPECT_TRUE(model.hasNote("--allow-outside")) << file;
        }
    }
    Job job;
    job.limits.allowOutside = true;
    const auto mesh = readMesh(obj("../other/outside.png"), job);
    ASSERT_TRUE(mesh) << mesh.error().text();
    EXPECT_EQ(red(*mesh), 200);
}

TEST_F(MovedModel, TheCallersTextureWins) {
    writePicture("mine.png", {7, 8, 9, 255});
    for (const auto& file : {obj("beside.png"), gltf("beside.png"), obj("D:\\work\\gone.png")}) {
        const auto model = readGood(file, {folder_ / "mine.png"});
        EXPECT_EQ(red(model.mesh), 7) << file;
        EXPECT_TRUE(model.notes.empty()) << model.notes[0];
    }
}

TEST_F(MovedModel, TheCallersTextureIsSampledAsTheOneThatItReplaces) {
    using Wrap = MeshTexture::Wrap;
    writePicture("mine.png", {7, 8, 9, 255});
    GltfText text;
    text.addQuad();
    text.addTexture();
    text.root["samplers"] = {{{"wrapS", 33648}, {"wrapT", 33071}, {"magFilter", 9728}}};
    text.root["textures"][0]["sampler"] = 0;
    text.primitive()["attributes"]["TEXCOORD_1"] =
        text.accessor(std::vector<float>{0, 0, 0, 0, 4, 8, 0, 0}, 5126, "VEC2", 4);
    text.root["materials"] = {
        {{"pbrMetallicRoughness",
          {{"baseColorTexture",
            {{"index", 0},
             {"texCoord", 1},
             {"extensions", {{"KHR_texture_transform", {{"scale", {0.25, 0.5}}}}}}}}}},
         {"emissiveFactor", {1, 1, 1}},
         {"emissiveTexture", {{"index", 0}}}},
        // Without a texture of its own, with a map that has other coordinates.
        {{"emissiveFactor", {1, 1, 1}}, {"emissiveTexture", {{"index", 0}, {"texCoord", 1}}}}};
    for (int i = 1; i < 4; ++i) {
        auto more = text.primitive();
        text.root["meshes"][0]["primitives"].push_back(std::move(more));
    }
    auto& primitives = text.root["meshes"][0]["primitives"];
    primitives[0]["material"] = 0;
    primitives[1]["material"] = 1;
    primitives[2]["attributes"].erase("TEXCOORD_0");
    const auto file = folder_ / "home/model/a.gltf";
    std::ofstream(file) << text.text();

    const auto [mesh, notes] = readGood(file, {folder_ / "mine.png"});
    ASSERT_EQ(mesh.triangles.size(), 8u);
    const auto materialOf = [&](std::size_t primitive) {
        return mesh.materials.at(mesh.triangleMaterial[primitive * 2]);
    };
    const auto textureOf = [&](std::size_t primitive) {
        return mesh.textures.at(static_cast<std::size_t>(materialOf(primitive).baseColourTexture));
    };
    for (const std::size_t primitive : {0, 1, 3})
        EXPECT_EQ(textureOf(primitive).pixels.at(0, 0), glm::u8vec4(7, 8, 9, 255)) << primitive;
    expectNear(mesh.uvs[2], {1, 4});
    expectNear(mesh.emissiveUvs[2], {1, 1});
    EXPECT_EQ(textureOf(0).wrapU, Wrap::mirror);
    EXPECT_EQ(textureOf(0).wrapV, Wrap::clamp);
    EXPECT_TRUE(textureOf(0).nearest);
    expectNear(mesh.uvs[6], {1, 1});
    expectNear(mesh.emissiveUvs[6], {4, 8});
    EXPECT_EQ(textureOf(1).wrapU, Wrap::repeat);
    EXPECT_EQ(materialOf(2).baseColourTexture, -1) << "it has no coordinates";
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("primitives[2] has a textured material but no"), std::string::npos);
}

/// The texture of the triangle in this plane, -1: none.
int textureAt(const Mesh& mesh, float z) {
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
        if (mesh.positions[mesh.triangles[i].x].z == z)
            return mesh.materials[mesh.triangleMaterial[i]].baseColourTexture;
    ADD_FAILURE() << "no triangle in " << z;
    return -1;
}

TEST_F(MovedModel, ObjectsWithoutCoordinatesAreNotPainted) {
    writePicture("mine.png", {7, 8, 9, 255});
    writePicture("home/model/spot_map.png", {3, 4, 5, 255});
    const std::string objects =
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nvt 0 0\nvt 1 0\nvt 0 1\n"
        "o painted\nf 1/1 2/2 3/3\no bare\nf 4 5 6\n";
    const auto file = folder_ / "home/model/spot.obj";
    write(file, objects);
    for (const bool given : {false, true}) {
        const auto model = readGood(file, {given ? folder_ / "mine.png" : std::filesystem::path()});
        ASSERT_EQ(model.mesh.triangles.size(), 2u);
        const int painted = textureAt(model.mesh, 0);
        ASSERT_GE(painted, 0);
        EXPECT_EQ(model.mesh.textures.at(static_cast<std::size_t>(painted)).pixels.at(0, 0).r,
                  given ? 7 : 3);
        EXPECT_EQ(textureAt(model.mesh, 1), -1);
        EXPECT_TRUE(model.hasNote("mesh 'bare' has the textured material")) << given;
        EXPECT_EQ(model.hasNote("'spot_map.png' beside it"), !given);
    }
    // A picture that cannot be read is none.
    write(folder_ / "home/model/spot_map.png", "no picture");
    const auto grey = readGood(file);
    EXPECT_EQ(grey.notes.size(), 1u) << "the model has no colour";
    EXPECT_TRUE(grey.mesh.textures.empty());
    // Nor do they have the normal map of others.
    write(folder_ / "home/model/spot.mtl", "newmtl bumpy\nKd 1 0 0\nnorm beside.png\n");
    write(file, "mtllib spot.mtl\nusemtl bumpy\n" + objects);
    const auto bumpy = readGood(file);
    EXPECT_TRUE(bumpy.hasNote("mesh 'bare' has the textured material 'bumpy' but no texture"));
    const auto maps = [&](std::size_t i) {
        return bumpy.mesh.materials.at(bumpy.mesh.triangleMaterial.at(i)).normalTexture;
    };
    EXPECT_EQ(std::min(maps(0), maps(1)), -1);
    EXPECT_EQ(std::max(maps(0), maps(1)), 0);
}

TEST_F(MovedModel, PlyFacesWithoutATextureAreNotPainted) {
    writePicture("mine.png", {7, 8, 9, 255});
    const std::string head =
        "ply\nformat ascii 1.0\ncomment TextureFile beside.png\nelement vertex 4\n"
        "property float x\nproperty float y\nproperty float z\nelement face 2\n"
        "property list uchar int vertex_indices\nproperty list uchar float texcoord\n";
    const std::string vertices = "end_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
    // MeshLab's -1, a list without coordinates, and a last face like the first.
    const std::string painted = "3 0 1 2 6 0 0 1 0 1 1";
    for (const auto& [property, first, second] :
         {std::tuple{"property int texnumber\n", painted + " 0\n", "3 0 2 3 6 0 0 0 0 0 0 -1\n"},
          std::tuple{"", painted + "\n", "3 0 2 3 0\n"}}) {
        const auto file = folder_ / "home/model/a.ply";
        std::ofstream(file) << head << property << vertices << first << second;
        for (const bool replaced : {false, true}) {
            const auto [mesh, notes] =
                readGood(file, {replaced ? folder_ / "mine.png" : std::filesystem::path()});
            ASSERT_EQ(mesh.triangles.size(), 2u);
            const auto textureOf = [&](std::size_t triangle) {
                return mesh.materials.at(mesh.triangleMaterial[triangle]).baseColourTexture;
            };
            ASSERT_GE(textureOf(0), 0);
            EXPECT_EQ(mesh.textures.at(static_cast<std::size_t>(textureOf(0))).pixels.at(0, 0).r,
                      replaced ? 7 : 200);
            EXPECT_EQ(textureOf(1), -1);
            EXPECT_TRUE(notes.empty());
        }
    }
}

TEST_F(MovedModel, PlyFacesWithoutCoordinatesOfTheirCornersHaveThoseOfTheirVertices) {
    const auto file = folder_ / "home/model/a.ply";
    std::ofstream(file)
        << "ply\nformat ascii 1.0\ncomment TextureFile beside.png\nelement vertex 4\n"
           "property float x\nproperty float y\nproperty float z\nproperty float u\n"
           "property float v\nelement face 2\nproperty list uchar int vertex_indices\n"
           "property list uchar float texcoord\nend_header\n"
           "0 0 0 0.5 0.75\n1 0 0 0.5 0.75\n1 1 0 0.5 0.75\n0 1 0 0.5 0.75\n"
           "3 0 1 2 6 0 0 1 0 1 1\n3 0 2 3 0\n";
    const auto [mesh, notes] = readGood(file);
    ASSERT_EQ(mesh.triangles.size(), 2u);
    expectNear(mesh.uvs.at(mesh.triangles[1].z), {0.5, 0.25});
    EXPECT_GE(mesh.materials.at(mesh.triangleMaterial[1]).baseColourTexture, 0);
}

}  // namespace
}  // namespace stx

#include <cmath>
#include <fstream>

#include "tests/temporary_folder.hpp"
#include "tests/unit/meshes/models.hpp"

// Features of glTF that the shared models lack, in files built here.

namespace stx {
namespace {

using nlohmann::json;

glm::vec3 faceNormal(const Mesh& mesh, std::size_t triangle) {
    const auto t = mesh.triangles.at(triangle);
    return glm::normalize(glm::cross(mesh.positions[t.y] - mesh.positions[t.x],
                                     mesh.positions[t.z] - mesh.positions[t.x]));
}

GltfText texturedQuad() {
    GltfText gltf;
    gltf.addQuad();
    gltf.addTexture();
    gltf.root["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
    gltf.primitive()["material"] = 0;
    return gltf;
}

TEST(Gltf, TextureFactorAndMaskArrive) {
    auto gltf = texturedQuad();
    gltf.root["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = {0.25, 0.5, 0.75, 0.5};
    gltf.root["materials"][0]["alphaMode"] = "MASK";
    gltf.root["materials"][0]["alphaCutoff"] = 0.3;
    gltf.root["samplers"] = {{{"wrapS", 33071}, {"wrapT", 33648}, {"magFilter", 9728}}};
    gltf.root["textures"][0]["sampler"] = 0;
    const auto [mesh, notes] = readGoodText(gltf.text(), "a.gltf");
    ASSERT_EQ(mesh.materials.size(), 1u);
    const auto& m = mesh.materials[0];
    EXPECT_EQ(m.baseColour, glm::vec4(0.25f, 0.5f, 0.75f, 0.5f));
    EXPECT_EQ(m.alpha, Material::Alpha::mask);
    EXPECT_FLOAT_EQ(m.alphaCutoff, 0.3f);
    EXPECT_FALSE(m.doubleSided);
    ASSERT_EQ(mesh.textures.size(), 1u);
    const auto& texture = mesh.textures[0];
    ASSERT_EQ(texture.pixels.size(), glm::ivec2(2, 1));
    EXPECT_EQ(texture.pixels.at(0, 0), glm::u8vec4(255, 0, 0, 255));
    EXPECT_EQ(texture.pixels.at(1, 0), glm::u8vec4(0, 255, 0, 128));
    EXPECT_EQ(texture.wrapU, MeshTexture::Wrap::clamp);
    EXPECT_EQ(texture.wrapV, MeshTexture::Wrap::mirror);
    EXPECT_TRUE(texture.nearest);
    expectNear(mesh.uvs[2], {1, 1});
}

TEST(Gltf, TextureTransformTurnsCounterClockwise) {
    auto gltf = texturedQuad();
    // The extension's own example: the lower left quadrant of the image, turned by 90 degrees.
    auto& info = gltf.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
    info["extensions"]["KHR_texture_transform"] = {
        {"offset", {0, 1}}, {"rotation", std::acos(-1.0) / 2}, {"scale", {0.5, 0.5}}};
    gltf.root["extensionsRequired"] = {"KHR_texture_transform"};
    const auto [mesh, notes] = readGoodText(gltf.text(), "a.gltf");
    ASSERT_EQ(mesh.uvs.size(), 4u);
    expectNear(mesh.uvs[0], {0, 1});
    expectNear(mesh.uvs[1], {0, 0.5});
    expectNear(mesh.uvs[2], {0.5, 0.5});
    expectNear(mesh.uvs[3], {0.5, 1});
}

TEST(Gltf, SecondUvSetAndItsOverride) {
    auto gltf = texturedQuad();
    const auto uv1 = gltf.accessor(std::vector<std::uint16_t>{0, 65535, 65535, 0, 13107, 0, 0, 0},
                                   5123, "VEC2", 4, true);
    gltf.primitive()["attributes"]["TEXCOORD_1"] = uv1;
    auto& info = gltf.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
    info["texCoord"] = 1;
    const auto first = readGoodText(gltf.text(), "a.gltf");
    expectNear(first.mesh.uvs[0], {0, 1});
    expectNear(first.mesh.uvs[2], {0.2f, 0});
    info["texCoord"] = 0;
    info["extensions"]["KHR_texture_transform"] = {{"texCoord", 1}};
    EXPECT_EQ(readGoodText(gltf.text(), "a.gltf").mesh.uvs, first.mesh.uvs);
}

TEST(Gltf, NormalMapHasItsOwnUvs) {
    auto gltf = texturedQuad();
    gltf.root["materials"][0]["normalTexture"] = {
        {"index", 0},
        {"scale", 0.5},
        {"extensions", {{"KHR_texture_transform", {{"scale", {2, 3}}}}}}};
    const auto [mesh, notes] = readGoodText(gltf.text(), "a.gltf");
    ASSERT_EQ(mesh.normalUvs.size(), 4u);
    expectNear(mesh.normalUvs[2], {2, 3});
    expectNear(mesh.uvs[2], {1, 1});
    EXPECT_FLOAT_EQ(mesh.materials[0].normalScale, 0.5f);
    // No normals and tangents in the file: the triangles' own. u runs along +x, v along +y, and a
    // normal map's green points against v: the handedness is negative.
    expectNear(mesh.normals.at(0), {0, 0, 1});
    EXPECT_EQ(mesh.tangents.at(0), glm::vec4(1, 0, 0, -1));
    EXPECT_EQ(mesh.textures.size(), 1u);
}

TEST(Gltf, TangentsDoNotMixAcrossMirroredCoordinates) {
    // Two quads with a common edge at x = 0, u = |x|, and shared vertices there.
    GltfText gltf;
    gltf.addTexture();
    const int position =
        gltf.accessor(std::vector<float>{-1, -1, 0, 0, -1, 0, 1, -1, 0, -1, 1, 0, 0, 1, 0, 1, 1, 0},
                      5126, "VEC3", 6);
    const int uv =
        gltf.accessor(std::vector<float>{1, 1, 0, 1, 1, 1, 1, 0, 0, 0, 1, 0}, 5126, "VEC2", 6);
    const int normal = gltf.accessor(
        std::vector<float>{0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}, 5126, "VEC3", 6);
    const int index = gltf.accessor(std::vector<std::uint16_t>{0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4},
                                    5123, "SCALAR", 12);
    gltf.root["meshes"][0]["primitives"].push_back(
        {{"attributes", {{"POSITION", position}, {"TEXCOORD_0", uv}, {"NORMAL", normal}}},
         {"indices", index},
         {"material", 0}});
    gltf.root["materials"] = {{{"normalTexture", {{"index", 0}}}}};
    const auto [mesh, notes] = readGoodText(gltf.text(), "a.gltf");
    ASSERT_EQ(mesh.triangles.size(), 4u);
    EXPECT_EQ(mesh.positions.size(), 8u);
    for (std::size_t i = 0; i < 4; ++i) {
        const float side = i < 2 ? -1.0f : 1.0f;
        for (int k = 0; k < 3; ++k) {
            const auto v = mesh.triangles[i][k];
            EXPECT_LT(glm::length(mesh.tangents.at(v) - glm::vec4(side, 0, 0, side)), 1e-6f);
            EXPECT_GE(mesh.positions[v].x * side, 0.0f);
            EXPECT_EQ(mesh.uvs[v].x, std::abs(mesh.positions[v].x));
        }
    }
}

TEST(Gltf, VertexColoursOfAllTypesAreTheSame) {
    const auto coloursWith = [](int type) {
        GltfText gltf;
        gltf.addQuad();
        int accessor = -1;
        if (type == 0)
            accessor =
                gltf.accessor(std::vector<float>{1, 0, 0.2f, 1, 0, 1, 0, 1, 0, 0, 1, 1, 1, 1, 1, 1},
                              5126, "VEC4", 4);
        if (type == 1)
            accessor = gltf.accessor(std::vector<std::uint8_t>{255, 0, 51, 255, 0, 255, 0, 255, 0,
                                                               0, 255, 255, 255, 255, 255, 255},
                                     5121, "VEC4", 4, true);
        if (type == 2)
            accessor = gltf.accessor(std::vector<std::uint16_t>{65535, 0, 13107, 0, 65535, 0, 0, 0,
                                                                65535, 65535, 65535, 65535},
                                     5123, "VEC3", 4, true);
        gltf.primitive()["attributes"]["COLOR_0"] = accessor;
        return readGoodText(gltf.text(), "a.gltf").mesh.colours;
    };
    const auto floats = coloursWith(0);
    ASSERT_EQ(floats.size(), 4u);
    EXPECT_EQ(floats[0], glm::vec4(1, 0, 0.2f, 1));
    for (const int type : {1, 2}) {
        const auto other = coloursWith(type);
        ASSERT_EQ(other.size(), 4u);
        for (int i = 0; i < 4; ++i) EXPECT_LT(glm::length(other[i] - floats[i]), 1e-6f);
    }
}

TEST(Gltf, MirroringNodesTurnTheTrianglesAround) {
    GltfText gltf;
    gltf.addQuad();
    gltf.root["nodes"] = json::parse(R"([
        {"mesh": 0, "scale": [-1, 1, 1], "translation": [5, 0, 0]},
        {"children": [2], "rotation": [0, 0.70710678, 0, 0.70710678]},
        {"mesh": 0, "matrix": [2,0,0,0, 0,2,0,0, 0,0,2,0, 1,2,3,1]}])");
    gltf.root["scenes"][0]["nodes"] = {0, 1};
    const auto [mesh, notes] = readGoodText(gltf.text(), "a.gltf");
    ASSERT_EQ(mesh.triangles.size(), 4u);
    expectNear(mesh.positions[1], {4, 0, 0});
    // Mirrored in x, the quad still shows its front to +z.
    expectNear(faceNormal(mesh, 0), {0, 0, 1});
    // Turned by 90 degrees about y: (x, y, z) of the inner node becomes (z, y, -x).
    expectNear(mesh.positions[4], {3, 2, -1});
    expectNear(mesh.positions[5], {3, 2, -3});
    expectNear(faceNormal(mesh, 2), {1, 0, 0});
}

TEST(Gltf, QuantisedStridedAndSparseAccessors) {
    GltfText gltf;
    // KHR_mesh_quantization: positions as shorts, 8 bytes apart; a sparse part lifts vertex 2.
    const int view = gltf.view(
        std::vector<std::int16_t>{0, 0, 0, 99, 10, 0, 0, 99, 10, 10, 0, 99, 0, 10, 0, 99}, 8);
    const int indices = gltf.view(std::vector<std::uint8_t>{2});
    const int values = gltf.view(std::vector<std::int16_t>{10, 10, 7});
    const int position =
        gltf.accessor({{"bufferView", view},
                       {"componentType", 5122},
                       {"type", "VEC3"},
                       {"count", 4},
                       {"sparse",
                        {{"count", 1},
                         {"indices", {{"bufferView", indices}, {"componentType", 5121}}},
                         {"values", {{"bufferView", values}}}}}});
    const int normal = gltf.accessor(
        std::vector<std::int8_t>{0, 0, 127, 0, 0, 0, 127, 0, 0, 0, 127, 0, 0, 0, 127, 0}, 5120,
        "VEC3", 4, true);
    gltf.root["bufferViews"][3]["byteStride"] = 4;
    gltf.root["meshes"][0]["primitives"] = {
        {{"attributes", {{"POSITION", position}, {"NORMAL", normal}}}, {"mode", 5}}};
    gltf.root["extensionsRequired"] = {"KHR_mesh_quantization"};
    gltf.root["nodes"][0]["scale"] = {0.1, 0.1, 0.1};
    const auto [mesh, notes] = readGoodText(gltf.text(), "a.gltf");
    ASSERT_EQ(mesh.positions.size(), 4u);
    expectNear(mesh.positions[1], {1, 0, 0});
    expectNear(mesh.positions[2], {1, 1, 0.7f});
    expectNear(mesh.normals[3], {0, 0, 1});
}

TEST(Gltf, StripsFansListsAndPoints) {
    const auto trianglesOf = [](int mode) {
        GltfText gltf;
        const int position =
            gltf.accessor(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0}, 5126, "VEC3", 4);
        gltf.root["meshes"][0]["primitives"] = {
            {{"attributes", {{"POSITION", position}}}, {"mode", mode}}};
        return readGoodText(gltf.text(), "a.gltf").mesh;
    };
    const auto strip = trianglesOf(5);
    ASSERT_EQ(strip.triangles.size(), 2u);
    // All triangles of a strip face the same way.
    expectNear(faceNormal(strip, 0), {0, 0, 1});
    expectNear(faceNormal(strip, 1), {0, 0, 1});
    const auto fan = trianglesOf(6);
    ASSERT_EQ(fan.triangles.size(), 2u);
    for (const auto& t : fan.triangles) EXPECT_TRUE(t.x == 0 || t.y == 0 || t.z == 0);
    EXPECT_EQ(trianglesOf(4).triangles.size(), 1u);
    const auto points = trianglesOf(0);
    EXPECT_EQ(points.points.size(), 4u);
    EXPECT_TRUE(points.triangles.empty());
}

TEST(Gltf, MorphTargetsStandAtTheirDefaultWeights) {
    GltfText gltf;
    gltf.addQuad();
    const int target =
        gltf.accessor(std::vector<float>{0, 0, 0, 0, 0, 0, 0, 0, 4, 0, 0, 0}, 5126, "VEC3", 4);
    gltf.primitive()["targets"] = {{{"POSITION", target}}};
    gltf.root["meshes"][0]["weights"] = {0.5};
    expectNear(readGoodText(gltf.text(), "a.gltf").mesh.positions[2], {1, 1, 2});
    gltf.root["nodes"][0]["weights"] = {0.25};
    expectNear(readGoodText(gltf.text(), "a.gltf").mesh.positions[2], {1, 1, 1});
}

TEST(Gltf, SkinIgnoresItsNodeAndFollowsItsJoints) {
    GltfText gltf;
    gltf.addQuad();
    const int joints = gltf.accessor(
        std::vector<std::uint8_t>{0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0}, 5121, "VEC4", 4);
    const int weights = gltf.accessor(
        std::vector<float>{1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0.5f, 0.5f, 0, 0}, 5126, "VEC4", 4);
    const int inverse =
        gltf.accessor(std::vector<float>{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0,  1,
                                         1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, -1, 1},
                      5126, "MAT4", 2);
    gltf.primitive()["attributes"]["JOINTS_0"] = joints;
    gltf.primitive()["attributes"]["WEIGHTS_0"] = weights;
    gltf.root["skins"] = {{{"joints", {1, 2}}, {"inverseBindMatrices", inverse}}};
    gltf.root["nodes"] = json::parse(R"([
        {"mesh": 0, "skin": 0, "translation": [100, 0, 0]},
        {"translation": [0, 0, 0], "children": [2]},
        {"translation": [0, 0, 5]}])");
    gltf.root["scenes"][0]["nodes"] = {0, 1};
    const auto [mesh, notes] = readGoodText(gltf.text(), "a.gltf");
    expectNear(mesh.positions.at(0), {0, 0, 0});
    expectNear(mesh.positions.at(2), {1, 1, 4});  // joint 1: +5 after -1
    expectNear(mesh.positions.at(3), {0, 1, 2});  // half of both
    // So do the points that indices name.
    gltf.primitive()["mode"] = 0;
    gltf.primitive()["indices"] =
        gltf.accessor(std::vector<std::uint16_t>{3, 2}, 5123, "SCALAR", 2);
    const auto points = readGoodText(gltf.text(), "a.gltf").mesh;
    ASSERT_EQ(points.points.size(), 2u);
    expectNear(points.positions.at(points.points[0]), {1, 1, 4});
    expectNear(points.positions.at(points.points[1]), {0, 1, 2});
}

TEST(Gltf, GpuInstancesAreExpanded) {
    GltfText gltf;
    gltf.addQuad();
    const int translation = gltf.accessor(std::vector<float>{0, 0, 0, 0, 0, 3}, 5126, "VEC3", 2);
    gltf.root["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"] = {
        {"attributes", {{"TRANSLATION", translation}}}};
    gltf.root["extensionsRequired"] = {"EXT_mesh_gpu_instancing"};
    const auto [mesh, notes] = readGoodText(gltf.text(), "a.gltf");
    EXPECT_EQ(mesh.triangles.size(), 4u);
    EXPECT_DOUBLE_EQ(mesh.bounds().max.z, 3.0);
}

TEST(Gltf, SpecularGlossinessGivesItsDiffuseColour) {
    auto gltf = texturedQuad();
    gltf.root["materials"][0] = {
        {"extensions",
         {{"KHR_materials_pbrSpecularGlossiness",
           {{"diffuseFactor", {0.1, 0.2, 0.3, 1}}, {"diffuseTexture", {{"index", 0}}}}}}}};
    const auto [mesh, notes] = readGoodText(gltf.text(), "a.gltf");
    EXPECT_FLOAT_EQ(mesh.materials[0].baseColour.g, 0.2f);
    EXPECT_EQ(mesh.materials[0].baseColourTexture, 0);
}

/// A textured quad whose metallic-roughness map is at `uv` of it.
GltfText metallicQuad(nlohmann::json uv = nlohmann::json::object()) {
    auto gltf = texturedQuad();
    uv["index"] = 0;
    auto& pbr = gltf.root["materials"][0]["pbrMetallicRoughness"];
    pbr["metallicRoughnessTexture"] = std::move(uv);
    pbr["metallicFactor"] = 0.25;
    return gltf;
}

ReadModel readMaterials(const GltfText& gltf, bool materials = true) {
    TemporaryFolder folder;
    std::ofstream(folder / "a.gltf") << gltf.text();
    MeshOptions options;
    options.materials = materials;
    return readGood(folder / "a.gltf", options);
}

TEST(Gltf, MetallicRoughnessIsReadWhereItIsAskedFor) {
    const auto asked = readMaterials(metallicQuad());
    const Material& m = asked.mesh.materials.at(0);
    EXPECT_TRUE(m.hasMetallicRoughness);
    EXPECT_FLOAT_EQ(m.metallic, 0.25f);
    EXPECT_FLOAT_EQ(m.roughness, 1.0f);
    EXPECT_EQ(m.metallicRoughnessTexture, 0);
    EXPECT_TRUE(asked.notes.empty());

    const auto plain = readMaterials(metallicQuad(), false);
    EXPECT_FALSE(plain.mesh.materials.at(0).hasMetallicRoughness);
    EXPECT_EQ(plain.mesh.materials.at(0).metallicRoughnessTexture, -1);
    EXPECT_TRUE(plain.hasNote("dropped: metallic-roughness maps (1)"));
    EXPECT_TRUE(asked.mesh.metallicRoughnessUvs.empty());
}

TEST(Gltf, MapsHaveTheirOwnUvs) {
    // Colour as it is, metallic-roughness moved, light in a set of its own that is scaled.
    auto gltf = metallicQuad({{"extensions", {{"KHR_texture_transform", {{"offset", {0.5, 0}}}}}}});
    gltf.primitive()["attributes"]["TEXCOORD_1"] =
        gltf.accessor(std::vector<float>{0, 0, 0, 0, 0.25f, 0.75f, 0, 0}, 5126, "VEC2", 4);
    auto& material = gltf.root["materials"][0];
    material["emissiveFactor"] = {1, 1, 1};
    material["emissiveTexture"] = {
        {"index", 0},
        {"texCoord", 1},
        {"extensions", {{"KHR_texture_transform", {{"scale", {2, 1}}}}}}};
    // One more part has the colour's coordinates for all, and one has none for its light.
    gltf.addQuad();
    auto& parts = gltf.root["meshes"][0]["primitives"];
    gltf.root["materials"].push_back(
        {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}});
    parts[1]["material"] = 1;
    gltf.addQuad();
    parts[2]["material"] = 0;

    const auto [mesh, notes] = readMaterials(gltf);
    ASSERT_EQ(mesh.uvs.size(), 12u);
    ASSERT_EQ(mesh.metallicRoughnessUvs.size(), 12u);
    ASSERT_EQ(mesh.emissiveUvs.size(), 12u);
    expectNear(mesh.uvs[2], {1, 1});
    expectNear(mesh.metallicRoughnessUvs[2], {1.5, 1});
    expectNear(mesh.emissiveUvs[2], {0.5, 0.75});
    EXPECT_TRUE(mesh.normalUvs.empty());
    for (std::size_t i = 4; i < 8; ++i) {
        EXPECT_EQ(mesh.metallicRoughnessUvs[i], mesh.uvs[i]);
        EXPECT_EQ(mesh.emissiveUvs[i], mesh.uvs[i]);
    }
    expectNear(mesh.metallicRoughnessUvs[10], {1.5, 1});
    const Material& all = mesh.materials.at(mesh.triangleMaterial.at(0));
    EXPECT_EQ(all.metallicRoughnessTexture, 0);
    EXPECT_EQ(all.emissiveTexture, 0);
    const Material& dark = mesh.materials.at(mesh.triangleMaterial.at(4));
    EXPECT_EQ(dark.baseColourTexture, 0);
    EXPECT_EQ(dark.metallicRoughnessTexture, 0);
    EXPECT_EQ(dark.emissiveTexture, -1);
    EXPECT_EQ(dark.emissive, glm::vec3(0));
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("primitives[2] has a textured material but no texture coordinates"),
              std::string::npos)
        << notes[0];
}

TEST(Gltf, UnlitMaterialsDoNotEmit) {
    auto gltf = texturedQuad();
    auto& material = gltf.root["materials"][0];
    material["emissiveFactor"] = {1, 0, 0};
    material["emissiveTexture"] = {{"index", 0}};
    EXPECT_EQ(readGoodText(gltf.text(), "a.gltf").mesh.materials[0].emissive, glm::vec3(1, 0, 0));
    material["extensions"]["KHR_materials_unlit"] = json::object();
    const auto [mesh, notes] = readGoodText(gltf.text(), "a.gltf");
    EXPECT_TRUE(mesh.materials[0].unlit);
    EXPECT_EQ(mesh.materials[0].emissive, glm::vec3(0));
    EXPECT_EQ(mesh.materials[0].emissiveTexture, -1);
}

TEST(Gltf, TexturesWithoutAnyCoordinatesGiveThePlainColour) {
    auto gltf = texturedQuad();
    gltf.primitive()["attributes"].erase("TEXCOORD_0");
    const auto model = readGoodText(gltf.text(), "a.gltf");
    ASSERT_EQ(model.mesh.triangles.size(), 2u);
    EXPECT_EQ(model.mesh.materials.at(model.mesh.triangleMaterial[0]).baseColourTexture, -1);
    ASSERT_EQ(model.notes.size(), 2u);
    EXPECT_NE(model.notes[0].find("no texture coordinates for it"), std::string::npos);
    EXPECT_NE(model.notes[1].find("no colour"), std::string::npos);
}

TEST(Gltf, WhatIsDroppedIsSaidInOneLine) {
    auto gltf = texturedQuad();
    gltf.root["animations"] = {{{"channels", json::array()}, {"samplers", json::array()}}};
    gltf.root["nodes"][0]["camera"] = 0;
    gltf.root["materials"][0]["emissiveTexture"] = {{"index", 0}};
    gltf.root["meshes"][0]["primitives"].push_back(
        {{"attributes", {{"POSITION", 0}}}, {"mode", 1}});
    const auto model = readGoodText(gltf.text(), "a.gltf");
    ASSERT_EQ(model.notes.size(), 1u);
    EXPECT_EQ(model.notes[0], "dropped: animations (1), cameras (1), line primitives (1)");
}

TEST(Gltf, TransmissionAndMorphedColoursAreSaidToBeDropped) {
    auto gltf = texturedQuad();
    auto& glass = gltf.root["materials"][0]["extensions"]["KHR_materials_transmission"];
    glass["transmissionFactor"] = 0.0;
    gltf.root["extensionsRequired"] = {"KHR_materials_transmission"};
    EXPECT_TRUE(readGoodText(gltf.text(), "a.gltf").notes.empty());
    glass["transmissionFactor"] = 0.5;
    const auto error = readBadText(gltf.text(), "a.gltf");
    EXPECT_EQ(error.code, ErrorCode::unsupported);
    EXPECT_EQ(error.message,
              "materials[0] needs the glTF extension KHR_materials_transmission, which the file "
              "requires and which is not drawn here; export it without");
    gltf.root.erase("extensionsRequired");
    const int accessor = gltf.primitive()["attributes"]["POSITION"];
    gltf.primitive()["targets"] = {{{"COLOR_0", accessor}, {"TEXCOORD_0", accessor}},
                                   {{"TEXCOORD_1", accessor}}};
    gltf.root["meshes"][0]["weights"] = {1, 0};
    const auto model = readGoodText(gltf.text(), "a.gltf");
    ASSERT_EQ(model.notes.size(), 1u);
    EXPECT_EQ(model.notes[0],
              "dropped: morphs of texture coordinates (1), morphs of vertex colours (1), "
              "transmission of materials (1)");
}

TEST(Gltf, IndicesInListsMayBeWrittenAsOthers) {
    GltfText gltf;
    gltf.addQuad();
    gltf.root["nodes"][0]["mesh"] = 0.0;
    gltf.root["scenes"][0]["nodes"] = {0.0};
    EXPECT_EQ(readGoodText(gltf.text(), "a.gltf").mesh.triangles.size(), 2u);
    gltf.root["scenes"][0]["nodes"] = {0.5};
    EXPECT_NE(readBadText(gltf.text(), "a.gltf").message.find("scenes[0].nodes[0]"),
              std::string::npos);
}

TEST(Gltf, HiddenNodesAreLeftOut) {
    GltfText gltf;
    gltf.addQuad();
    gltf.root["extensionsRequired"] = {"KHR_node_visibility"};
    gltf.root["nodes"] = json::parse(R"([
        {"mesh": 0, "extensions": {"KHR_node_visibility": {"visible": true}}},
        {"mesh": 0, "children": [2], "extensions": {"KHR_node_visibility": {"visible": false}}},
        {"mesh": 0}])");
    gltf.root["scenes"][0]["nodes"] = {0, 1};
    EXPECT_EQ(readGoodText(gltf.text(), "a.gltf").mesh.triangles.size(), 2u);
}

TEST(Gltf, PrimitivesWithAndWithoutNormalsAndColoursMix) {
    GltfText gltf;
    gltf.addQuad();
    gltf.addQuad();
    const int normal =
        gltf.accessor(std::vector<float>{1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0}, 5126, "VEC3", 4);
    const int colour =
        gltf.accessor(std::vector<float>{0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}, 5126, "VEC3", 4);
    gltf.root["meshes"][0]["primitives"][1]["attributes"]["NORMAL"] = normal;
    gltf.root["meshes"][0]["primitives"][1]["attributes"]["COLOR_0"] = colour;
    const auto [mesh, notes] = readGoodText(gltf.text(), "a.gltf");
    ASSERT_EQ(mesh.normals.size(), 8u);
    expectNear(mesh.normals[0], {0, 0, 1});  // the first quad's own
    expectNear(mesh.normals[5], {1, 0, 0});
    EXPECT_EQ(mesh.colours[0], glm::vec4(1));
    EXPECT_EQ(mesh.colours[5], glm::vec4(0, 0, 1, 1));
}

TEST(Gltf, TexturesResolveInsideTheFolderOnly) {
    TemporaryFolder folder;
    std::filesystem::create_directory(folder / "model");
    std::filesystem::create_directory(folder / "model/my maps");
    const auto write = [](const std::filesystem::path& path, const std::string& text) {
        std::ofstream(path, std::ios::binary) << text;
    };
    auto gltf = texturedQuad();
    const auto read = [&](const char* uri) {
        gltf.root["images"][0] = {{"uri", uri}};
        write(folder / "model/m.gltf", gltf.text());
        Job job;
        auto mesh = readMesh(folder / "model/m.gltf", job);
        return std::pair(std::move(mesh), job.takeNotes());
    };
    {
        const auto [mesh, notes] = read("none.png");
        ASSERT_TRUE(mesh) << mesh.error().text();
        EXPECT_EQ(mesh->materials[0].baseColourTexture, -1);
        ASSERT_EQ(notes.size(), 2u) << "and that the model has no colour then";
        EXPECT_NE(notes[0].find("none.png"), std::string::npos);
    }
    {
        write(folder / "model/my maps/broken.png", "no image");
        const auto [mesh, notes] = read("my%20maps/broken.png");
        ASSERT_TRUE(mesh) << mesh.error().text();
        ASSERT_EQ(notes.size(), 2u) << "and that the model has no colour then";
        EXPECT_NE(notes[0].find("cannot be decoded"), std::string::npos);
    }
    write(folder / "outside.png", "secret");
    for (const char* uri : {"../outside.png", "https://example.org/a.png", "file:///etc/hosts",
                            "/etc/hosts", "%2e%2e/outside.png"}) {
        SCOPED_TRACE(uri);
        const auto [mesh, notes] = read(uri);
        ASSERT_TRUE(mesh) << mesh.error().text();
        EXPECT_EQ(mesh->materials[0].baseColourTexture, -1);
        ASSERT_EQ(notes.size(), 2u) << "and that the model has no colour then";
        EXPECT_NE(notes[0].find("--allow-outside"), std::string::npos) << notes[0];
    }
}

}  // namespace
}  // namespace stx

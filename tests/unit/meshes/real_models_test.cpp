#include <fstream>

#include "tests/unit/meshes/models.hpp"

// What arrives from files that others made. The counts come from the files' own headers (accessors,
// PLY and STL headers) or from Debian's draco_decoder.

namespace stx {
namespace {

bool hasColour(const Mesh& mesh, glm::vec3 colour) {
    for (const auto& c : mesh.colours) {
        if (glm::length(glm::vec3(c) - colour) < 1e-4f) return true;
    }
    return false;
}

TEST(RealGltf, CesiumMilkTruckHasItsWheelsTwiceAndItsColours) {
    REQUIRE_SHARED(path, "data/meshes/gltf/draco-repo/CesiumMilkTruck/glTF/CesiumMilkTruck.gltf");
    const auto [mesh, notes] = readGood(path);
    EXPECT_EQ(mesh.triangles.size(), (5232u + 168 + 864 + 2 * 2304) / 3);
    EXPECT_EQ(mesh.positions.size(), 1856u + 72 + 464 + 2 * 586);
    ASSERT_EQ(mesh.textures.size(), 1u);
    EXPECT_EQ(mesh.textures[0].pixels.size(), glm::ivec2(2048, 2048));
    ASSERT_EQ(mesh.materials.size(), 4u);
    EXPECT_EQ(mesh.materials[1].name, "glass");
    EXPECT_NEAR(mesh.materials[1].baseColour.g, 0.0405062996f, 1e-6f);
    EXPECT_FALSE(mesh.materials[1].doubleSided);
    // The last node turns wheels by 190 degrees about z and moves them to x = -1.3523.
    Bounds wheels;
    for (std::size_t i = mesh.positions.size() - 586; i < mesh.positions.size(); ++i)
        wheels.add(mesh.positions[i]);
    EXPECT_NEAR(wheels.centre().x, -1.35233, 1e-3);
    EXPECT_NEAR(wheels.centre().y, 0.42772, 1e-3);
}

TEST(RealGltf, VertexColoursArriveLinear) {
    REQUIRE_SHARED(path, "data/meshes/gltf/draco-repo/VertexColorTest/glTF/VertexColorTest.gltf");
    const auto [mesh, notes] = readGood(path);
    EXPECT_EQ(mesh.triangles.size(), 36u);
    ASSERT_EQ(mesh.colours.size(), 72u);
    // The first primitive has none, so it is white; the second is stored as read.
    expectNear(glm::vec3(mesh.colours[0]), glm::vec3(1));
    expectNear(glm::vec3(mesh.colours[24]), glm::vec3(0.501960814f));
    expectNear(glm::vec3(mesh.colours[24 + 24]), glm::vec3(0, 1, 0));
    expectNear(glm::vec3(mesh.colours[24 + 28]), glm::vec3(0, 0, 1));
    EXPECT_EQ(mesh.textures.size(), 2u);
    // Node scale (1, 1, 0.0741) of the second mesh; its first vertex is at z = -0.17187.
    expectNear(mesh.positions[24], {0.99999994f, -1.0f, -0.17186648f * 0.07413393f});
}

TEST(RealGltf, CubeScaledInstancesShowsOneNodeBelowFourParents) {
    REQUIRE_SHARED(path, "data/meshes/gltf/draco-repo/CubeScaledInstances/glTF/cube_att.gltf");
    const auto [mesh, notes] = readGood(path);
    EXPECT_EQ(mesh.triangles.size(), 4u * 12);
    const auto bounds = mesh.bounds();
    expectNear(glm::vec3(bounds.min), {-2, 0, 0});
    expectNear(glm::vec3(bounds.max), {4, 6, 4});
}

TEST(RealGltf, SparseAccessorMovesThreeVertices) {
    REQUIRE_SHARED(path,
                   "data/meshes/gltf/draco-repo/KhronosSampleModels/SimpleSparseAccessor/glTF/"
                   "SimpleSparseAccessor.gltf");
    const auto [mesh, notes] = readGood(path);
    EXPECT_EQ(mesh.triangles.size(), 12u);
    // max of the accessor says 4; without the sparse part it would be 1.
    EXPECT_DOUBLE_EQ(mesh.bounds().max.y, 4.0);
    EXPECT_DOUBLE_EQ(mesh.bounds().max.x, 6.0);
}

TEST(RealGltf, FoxIsPosedByItsSkin) {
    REQUIRE_SHARED(path, "data/meshes/gltf/draco-repo/Fox/glTF/Fox.gltf");
    const auto model = readGood(path);
    EXPECT_EQ(model.mesh.triangles.size(), 1728u / 3);
    ASSERT_EQ(model.mesh.textures.size(), 1u);
    EXPECT_EQ(model.mesh.textures[0].pixels.size(), glm::ivec2(1024, 1024));
    EXPECT_TRUE(model.mesh.normals.empty());
    EXPECT_TRUE(model.hasNote("animations (3)"));
    // The rest pose is the bind pose but for rounding.
    expectNear(model.mesh.positions[0], {2.0563729f, 35.2144203f, -23.0451183f}, 0.05f);
    expectNear(model.mesh.uvs[0], {0.528711975f, 0.678551972f});
}

TEST(RealGltf, CesiumManStandsUpright) {
    REQUIRE_SHARED(path, "data/meshes/gltf/draco-repo/CesiumMan/glTF_Binary/CesiumMan.glb");
    const auto model = readGood(path);
    EXPECT_EQ(model.mesh.triangles.size(), 14016u / 3);
    EXPECT_EQ(model.mesh.textures.size(), 1u);
    const auto size = model.mesh.bounds().max - model.mesh.bounds().min;
    EXPECT_NEAR(size.y, 1.507, 0.001);  // joints alone know that y is up
    EXPECT_GT(size.y, size.z);
}

TEST(RealGltf, BoxTexturedHasItsTexture) {
    REQUIRE_SHARED(path, "data/meshes/gltf/trimesh/BoxTextured.glb");
    const auto [mesh, notes] = readGood(path);
    EXPECT_EQ(mesh.triangles.size(), 12u);
    ASSERT_EQ(mesh.textures.size(), 1u);
    EXPECT_EQ(mesh.textures[0].pixels.size(), glm::ivec2(256, 256));
    EXPECT_EQ(mesh.uvs.size(), mesh.positions.size());
}

TEST(RealGltf, InterleavedBoxIsTheSameBox) {
    REQUIRE_SHARED(path, "data/meshes/gltf/trimesh/BoxInterleaved.glb");
    const auto [mesh, notes] = readGood(path);
    EXPECT_EQ(mesh.triangles.size(), 12u);
    expectNear(glm::vec3(mesh.bounds().min), glm::vec3(-0.5f));
    expectNear(glm::vec3(mesh.bounds().max), glm::vec3(0.5f));
    for (const auto& n : mesh.normals) EXPECT_NEAR(glm::length(n), 1.0f, 1e-6f);
    EXPECT_NEAR(mesh.materials[0].baseColour.r, 0.8f, 1e-5f);
}

TEST(RealGltf, NestedNodesAreWalkedToTheLeaves) {
    REQUIRE_SHARED(path, "data/meshes/gltf/trimesh/nested.glb");
    EXPECT_EQ(readGood(path).mesh.triangles.size(), 3u * 12);
}

TEST(RealGltf, TwoSidedPlaneHasItsNormalMap) {
    REQUIRE_SHARED(path, "data/meshes/gltf/draco-repo/TwoSidedPlane/glTF/TwoSidedPlane.gltf");
    const auto model = readGood(path);
    ASSERT_EQ(model.mesh.materials.size(), 1u);
    EXPECT_TRUE(model.mesh.materials[0].doubleSided);
    EXPECT_GE(model.mesh.materials[0].normalTexture, 0);
    EXPECT_EQ(model.mesh.tangents.size(), model.mesh.positions.size());
    EXPECT_TRUE(model.hasNote("metallic-roughness maps (1)"));
}

TEST(RealGltf, TwoCylinderEngineComesOutOfDraco) {
    REQUIRE_SHARED(path, "data/meshes/gltf-draco/2CylinderEngine/2CylinderEngine.gltf");
    const auto model = readGood(path);
    // Sum of index counts over the scene's nodes / 3, less the triangles without area.
    EXPECT_EQ(model.mesh.triangles.size(), 110336u - 15);
    EXPECT_TRUE(model.hasNote("15 triangles have no area"));
    EXPECT_EQ(model.mesh.materials.size(), 34u);
    EXPECT_EQ(model.mesh.normals.size(), model.mesh.positions.size());
}

TEST(RealGltf, DracoAndPlainAccessorsInOnePrimitive) {
    REQUIRE_SHARED(path, "data/meshes/gltf-draco/glTF-Transform/DracoSparseMesh.gltf");
    const auto [mesh, notes] = readGood(path);
    EXPECT_EQ(mesh.triangles.size(), 306u / 3);
    EXPECT_EQ(mesh.positions.size(), 62u);
}

TEST(RealObj, SpotFindsItsTextureBesideIt) {
    REQUIRE_SHARED(path, "data/meshes/obj/spot/spot_triangulated.obj");
    const auto model = readGood(path);
    EXPECT_EQ(model.mesh.triangles.size(), 5856u);
    ASSERT_EQ(model.mesh.textures.size(), 1u);
    EXPECT_EQ(model.mesh.textures[0].pixels.size(), glm::ivec2(1024, 1024));
    EXPECT_EQ(model.mesh.materials.at(0).baseColourTexture, 0);
    EXPECT_TRUE(model.hasNote("spot_texture.png"));
    // Before corners are merged there were 3 x 5856.
    EXPECT_LT(model.mesh.positions.size(), 4000u);
    REQUIRE_SHARED(quads, "data/meshes/obj/spot/spot_quadrangulated.obj");
    EXPECT_EQ(readGood(quads).mesh.triangles.size(), 5856u);
}

TEST(RealObj, TextureOptionWinsOverTheSearch) {
    REQUIRE_SHARED(path, "data/meshes/obj/spot/spot_triangulated.obj");
    REQUIRE_SHARED(texture, "data/meshes/obj/fuze/fuze uv.jpg");
    const auto model = readGood(path, {.texture = texture});
    EXPECT_EQ(model.mesh.textures.size(), 1u);
    EXPECT_FALSE(model.hasNote("spot_texture.png"));
    Job job;
    const auto missing = readMesh(path, job, {.texture = path.parent_path() / "none.png"});
    ASSERT_FALSE(missing);
    EXPECT_EQ(missing.error().code, ErrorCode::io);
}

TEST(RealObj, FuzeHasABlankInItsTexturesName) {
    REQUIRE_SHARED(path, "data/meshes/obj/fuze/fuze.obj");
    const auto model = readGood(path);
    EXPECT_EQ(model.mesh.triangles.size(), 1000u);
    ASSERT_EQ(model.mesh.textures.size(), 1u);
    EXPECT_EQ(model.mesh.textures[0].pixels.size(), glm::ivec2(1024, 1024));
    // MeshLab writes "Tr 1.0" for an opaque material.
    for (const auto& m : model.mesh.materials) EXPECT_EQ(m.baseColour.a, 1.0f);
    EXPECT_TRUE(model.hasNote("taken as opaque"));
}

TEST(RealObj, SpiderHasFiveTexturesWithBackslashes) {
    REQUIRE_SHARED(path, "data/meshes/obj/assimp-spider/spider.obj");
    const auto [mesh, notes] = readGood(path);
    EXPECT_EQ(mesh.textures.size(), 5u);
    EXPECT_EQ(mesh.triangles.size(), 1368u - 56);
    for (const auto& m : mesh.materials) {
        if (m.name != "Skin") continue;
        // Kd 0.827451 is 211 in sRGB.
        EXPECT_NEAR(m.baseColour.r, 0.651406f, 1e-4f);
        EXPECT_GE(m.baseColourTexture, 0);
    }
}

TEST(RealObj, Utf16IsReadAsTheSameBox) {
    REQUIRE_SHARED(path, "data/meshes/obj/assimp-misc/box_UTF16BE.obj");
    EXPECT_EQ(readGood(path).mesh.triangles.size(), 12u);
}

TEST(RealObj, ConcavePolygonIsCutWithoutCrossingItsOutline) {
    REQUIRE_SHARED(path, "data/meshes/obj/assimp-misc/concave_polygon.obj");
    const auto [mesh, notes] = readGood(path);
    EXPECT_EQ(mesh.triangles.size(), 64u);
    // Shoelace area of the outline is the sum of the triangles' only when none lies outside.
    double sum = 0;
    glm::dvec3 whole(0.0);
    for (const auto& t : mesh.triangles) {
        const glm::dvec3 a(mesh.positions[t.x]), b(mesh.positions[t.y]), c(mesh.positions[t.z]);
        const auto area = glm::cross(b - a, c - a) * 0.5;
        sum += glm::length(area);
        whole += area;
    }
    EXPECT_NEAR(sum, glm::length(whole), 1e-6);
    // The material's Kd, through sRGB.
    EXPECT_NEAR(mesh.materials[mesh.triangleMaterial[0]].baseColour.b, 0.1413f, 1e-3f);
}

TEST(RealObj, CornellBoxHasItsMaterials) {
    REQUIRE_SHARED(path, "data/meshes/obj/tinyobj/cornell_box.obj");
    const auto [mesh, notes] = readGood(path);
    EXPECT_EQ(mesh.triangles.size(), 36u);
    int red = 0;
    for (const auto& m : mesh.materials) red += m.baseColour.r > 2 * m.baseColour.g;
    EXPECT_GE(red, 1);
}

TEST(RealObj, VertexColoursAreTakenAsSrgb) {
    REQUIRE_SHARED(path, "data/meshes/obj/assimp-misc/cube_with_vertexcolors.obj");
    const auto [mesh, notes] = readGood(path);
    EXPECT_EQ(mesh.triangles.size(), 12u);
    ASSERT_FALSE(mesh.colours.empty());
    EXPECT_TRUE(hasColour(mesh, {0.2016f, 0.1560f, 0.1878f}));  // 0.48627 0.43137 0.47059 in sRGB
}

TEST(RealObj, PointCloudHasNoTriangles) {
    REQUIRE_SHARED(path, "data/meshes/obj/assimp-misc/point_cloud.obj");
    const auto [mesh, notes] = readGood(path);
    EXPECT_EQ(mesh.points.size(), 3u);
    EXPECT_TRUE(mesh.triangles.empty());
}

TEST(RealPly, CubeUvHasItsTextureCoordinates) {
    REQUIRE_SHARED(path, "data/meshes/ply/assimp/cube_uv.ply");
    const auto [mesh, notes] = readGood(path);
    EXPECT_EQ(mesh.triangles.size(), 12u);
    ASSERT_EQ(mesh.uvs.size(), 24u);
    expectNear(mesh.uvs[0], {0, 1});  // s 0, t 0: t runs up
    expectNear(mesh.uvs[1], {1, 1});
    expectNear(mesh.uvs[2], {1, 0});
    expectNear(mesh.normals[0], {0, 0, -1});
}

TEST(RealPly, CornerTextureCoordinatesSplitVertices) {
    REQUIRE_SHARED(ascii, "data/meshes/ply/trimesh/fuze_ascii.ply");
    REQUIRE_SHARED(binary, "data/meshes/ply/trimesh/fuze.ply");
    REQUIRE_SHARED(obj, "data/meshes/obj/fuze/fuze.obj");
    const auto a = readGood(ascii), b = readGood(binary), o = readGood(obj);
    EXPECT_EQ(a.mesh.triangles.size(), 1000u);
    // 502 places, 664 pairs of place and texture coordinate; the OBJ says so, too.
    EXPECT_EQ(a.mesh.positions.size(), 664u);
    EXPECT_EQ(b.mesh.positions.size(), 664u);
    EXPECT_EQ(o.mesh.positions.size(), 664u);
    EXPECT_EQ(b.mesh.colours.size(), 664u);
    EXPECT_TRUE(hasColour(b.mesh, glm::vec3(0.52712f)));  // 192 in sRGB
    EXPECT_TRUE(a.hasNote("fuze uv.jpg"));
}

TEST(RealPly, ColoursOfAnyTypeArrive) {
    REQUIRE_SHARED(bytes, "data/meshes/ply/draco/test_pos_color.ply");
    EXPECT_TRUE(hasColour(readGood(bytes).mesh, {0.63760f, 0.0f, 0.19462f}));  // 209 0 122
    REQUIRE_SHARED(floats, "data/meshes/ply/assimp/float-color.ply");
    EXPECT_TRUE(hasColour(readGood(floats).mesh, {0, 0, 1}));
    REQUIRE_SHARED(blanks, "data/meshes/ply/draco/test_extra_whitespace.ply");
    EXPECT_TRUE(hasColour(readGood(blanks).mesh, {0.63760f, 0.0f, 0.19462f}));
    REQUIRE_SHARED(points, "data/meshes/ply/assimp/points.ply");
    EXPECT_EQ(readGood(points).mesh.points.size(), 4u);
}

TEST(RealPly, SuzannesQuadsBecomeTriangles) {
    REQUIRE_SHARED(path, "data/meshes/ply/trimesh/suzanne.ply");
    EXPECT_EQ(readGood(path).mesh.triangles.size(), 968u);
}

TEST(RealStl, AsciiAndBinaryAreTheSameSpider) {
    REQUIRE_SHARED(ascii, "data/meshes/stl/assimp/Spider_ascii.stl");
    REQUIRE_SHARED(binary, "data/meshes/stl/assimp/Spider_binary.stl");
    const auto a = readGood(ascii), b = readGood(binary);
    EXPECT_EQ(a.mesh.triangles.size(), 1368u - 56);
    EXPECT_EQ(b.mesh.triangles.size(), 1368u - 56);
    EXPECT_EQ(b.mesh.positions.size(), 722u);
}

TEST(RealStl, UpperCaseEndingAndSeveralSolids) {
    REQUIRE_SHARED(upper, "data/meshes/stl/trimesh/unit_sphere.STL");
    EXPECT_EQ(readGood(upper).mesh.triangles.size(), 1280u);
    REQUIRE_SHARED(two, "data/meshes/stl/assimp/triangle_with_two_solids.stl");
    EXPECT_EQ(readGood(two).mesh.triangles.size(), 2u);
}

struct DrcCase {
    const char* name;
    std::size_t triangles, vertices;
};

TEST(RealDraco, EachBitstreamVersionIsDecoded) {
    REQUIRE_SHARED(folder, "data/meshes/drc");
    for (const auto& [name, triangles, vertices] :
         {DrcCase{"test_nm_quant.0.9.0.drc", 170, 99},
          {"test_nm.obj.edgebreaker.0.9.1.drc", 170, 99},
          {"test_nm.obj.edgebreaker.0.10.0.drc", 170, 99},
          {"test_nm.obj.edgebreaker.1.0.0.drc", 170, 99},
          {"test_nm.obj.edgebreaker.1.1.0.drc", 170, 99},
          {"test_nm.obj.edgebreaker.cl4.2.2.drc", 170, 99},
          {"test_nm.obj.edgebreaker.cl10.2.2.drc", 170, 99},
          {"test_nm.obj.sequential.0.9.1.drc", 170, 97},
          {"test_nm.obj.sequential.0.10.0.drc", 170, 97},
          {"test_nm.obj.sequential.1.0.0.drc", 170, 97},
          {"test_nm.obj.sequential.1.1.0.drc", 170, 97},
          {"test_nm.obj.sequential.cl3.2.2.drc", 170, 97},
          {"car.drc", 1744, 1856},
          {"cube_att.drc", 12, 24},
          {"octagon_preserved.drc", 6, 16},
          {"cube_pc.drc", 0, 24},
          {"pc_kd_color.drc", 0, 7733},
          {"point_cloud_no_qp.drc", 0, 21}}) {
        SCOPED_TRACE(name);
        const auto [mesh, notes] = readGood(folder / name);
        EXPECT_EQ(mesh.triangles.size(), triangles);
        EXPECT_EQ(mesh.positions.size(), vertices);
        EXPECT_EQ(mesh.points.size(), triangles == 0 ? vertices : 0);
    }
}

TEST(RealDraco, AttributesArrive) {
    REQUIRE_SHARED(cube, "data/meshes/drc/cube_att.drc");
    const auto c = readGood(cube);
    ASSERT_EQ(c.mesh.normals.size(), 24u);
    // Each corner of the cube has one normal along each axis.
    for (const auto& n : c.mesh.normals)
        EXPECT_NEAR(std::max({std::abs(n.x), std::abs(n.y), std::abs(n.z)}), 1.0f, 1e-4f);
    EXPECT_EQ(c.mesh.uvs.size(), 24u);
    EXPECT_TRUE(c.notes.empty());
    REQUIRE_SHARED(cloud, "data/meshes/drc/pc_kd_color.drc");
    const auto p = readGood(cloud);
    ASSERT_EQ(p.mesh.colours.size(), 7733u);
    for (const auto& colour : p.mesh.colours) EXPECT_LE(colour.r, 1.0f);
}

}  // namespace
}  // namespace stx

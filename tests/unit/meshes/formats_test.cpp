#include <array>
#include <cmath>
#include <fstream>
#include <limits>

#include "formats/files/text_encoding.hpp"
#include "formats/meshes/triangulate.hpp"
#include "lib/capture/material_sampler.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/meshes/models.hpp"

namespace stx {
namespace {

ByteSpan bytesOf(const std::string& text) {
    return {reinterpret_cast<const std::byte*>(text.data()), text.size()};
}

TEST(IsMesh, ByBytesThenByEnding) {
    EXPECT_TRUE(isMesh("a.glb"));
    EXPECT_TRUE(isMesh("a.STL"));
    EXPECT_TRUE(isMesh("folder/a.obj"));
    EXPECT_FALSE(isMesh("a.png"));
    EXPECT_FALSE(isMesh("transforms.json", bytesOf("{\"frames\": []}")));
    EXPECT_TRUE(isMesh("-", bytesOf("glTF\2\0\0\0")));
    EXPECT_TRUE(isMesh("scan", bytesOf("ply\nformat ascii 1.0\n")));
    EXPECT_TRUE(isMesh("scan", bytesOf("DRACO\2\2")));
    EXPECT_TRUE(isMesh("-", bytesOf("{\"asset\": {\"version\": \"2.0\"}}")));
    EXPECT_FALSE(isMesh("-", bytesOf("plywood")));
}

void expectTriangulated(const std::vector<glm::dvec2>& outline) {
    for (const bool reversed : {false, true}) {
        std::vector<glm::dvec3> corners;
        for (const auto& p : outline) corners.emplace_back(p.x, p.y * 0.5, p.y + p.x);
        if (reversed) std::reverse(corners.begin(), corners.end());
        std::vector<glm::uvec3> triangles;
        triangulate(corners, triangles);
        ASSERT_EQ(triangles.size(), outline.size() - 2);
        double sum = 0;
        glm::dvec3 whole(0.0);
        for (const auto& t : triangles) {
            const auto area = glm::cross(corners[t.y] - corners[t.x], corners[t.z] - corners[t.x]);
            sum += glm::length(area);
            whole += area;
        }
        EXPECT_NEAR(sum, glm::length(whole), 1e-6);
    }
}

TEST(Triangulate, ConcavePolygonsKeepTheirArea) {
    // A comb with three teeth, drawn in a slanted plane.
    expectTriangulated({{0, 0}, {6, 0}, {6, 4}, {5, 1}, {4, 4}, {3, 1}, {2, 4}, {1, 1}, {0, 4}});
}

TEST(Triangulate, SoDoThoseOfManyCorners) {
    std::vector<glm::dvec2> comb = {{0, 0}, {1, 0}}, arc;
    constexpr int kTeeth = 10000, kSteps = 3000;
    for (int i = kTeeth; i >= 0; --i) {
        comb.emplace_back((i + 0.5) / (kTeeth + 1), 1);
        if (i > 0) comb.emplace_back(i / (kTeeth + 1.0), 0.25);
    }
    expectTriangulated(comb);
    // The letter C.
    for (int i = 0; i < 2 * kSteps; ++i) {
        const bool outer = i < kSteps;
        const double angle = (outer ? i : 2 * kSteps - 1 - i) * 5.0 / kSteps;
        arc.push_back(glm::dvec2(std::cos(angle), std::sin(angle)) * (outer ? 1.5 : 0.9));
    }
    expectTriangulated(arc);
}

TEST(Triangulate, CornersThatAreThereTwiceChangeNothing) {
    const std::vector<glm::dvec3> notched = {
        {1, 1, 0}, {0, 0, 0}, {-1, 1, 0}, {-1, -1, 0}, {1, -1, 0}};
    std::vector<glm::uvec3> plain;
    triangulate(notched, plain);
    ASSERT_EQ(plain.size(), 3u);
    for (std::size_t k = 0; k <= notched.size(); ++k) {
        auto corners = notched;
        corners.insert(corners.begin() + static_cast<std::ptrdiff_t>(k), 2,
                       notched[k % notched.size()]);
        std::vector<glm::uvec3> triangles;
        triangulate(corners, triangles);
        ASSERT_EQ(triangles.size(), plain.size()) << k;
        for (std::size_t i = 0; i < plain.size(); ++i)
            for (int c = 0; c < 3; ++c)
                EXPECT_EQ(corners[triangles[i][c]], notched[plain[i][c]]) << k;
    }
}

TEST(Triangulate, NonsenseStillEnds) {
    std::vector<glm::dvec3> corners(50, glm::dvec3(1));
    std::vector<glm::uvec3> triangles;
    triangulate(corners, triangles);
    EXPECT_EQ(triangles.size(), 48u);
    triangles.clear();
    corners = {{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}};  // a bow tie
    triangulate(corners, triangles);
    EXPECT_EQ(triangles.size(), 2u);
    triangles.clear();
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN(), kFar = HUGE_VAL;
    corners = {{0, 0, 0}, {1, kNone, 0}, {kFar, 0, 0}, {0, -kFar, 0}, {0.5, 0, 1e308}};
    triangulate(corners, triangles);
    EXPECT_EQ(triangles.size(), 3u);
}

TEST(TextEncoding, MarkedTextBecomesUtf8) {
    const auto text = [](std::string bytes) {
        const auto utf8 = utf8FromMarked(bytesOf(bytes));
        return utf8 ? std::string(reinterpret_cast<const char*>(utf8->data()), utf8->size())
                    : "none";
    };
    EXPECT_EQ(text("v 0"), "none");
    EXPECT_EQ(text("\xef\xbb\xbfv"), "v");
    EXPECT_EQ(text(std::string("\xfe\xff\0v\x20\xac", 6)), "v\xe2\x82\xac");
    EXPECT_EQ(text(std::string("\xff\xfev\0\x3d\xd8\x00\xde", 8)), "v\xf0\x9f\x98\x80");
    EXPECT_EQ(text(std::string("\xff\xfe\x3d\xd8", 4)), "\xef\xbf\xbd");  // half a pair
}

/// A binary STL with a triangle for each attribute; the colours in sRGB bytes.
std::vector<glm::ivec3> stlColours(const std::string& header,
                                   const std::vector<std::uint16_t>& attributes) {
    std::string text = header;
    text.resize(80, ' ');
    const auto append = [&](const auto& value) {
        text.append(reinterpret_cast<const char*>(&value), sizeof(value));
    };
    append(static_cast<std::uint32_t>(attributes.size()));
    float z = 0;
    for (const auto attribute : attributes) {
        append(std::array<float, 12>{0, 0, 1, 0, 0, z, 1, 0, z, 0, 1, z});
        append(attribute);
        z += 1;
    }
    const auto model = readGoodText(text, "a.stl");
    EXPECT_EQ(model.mesh.triangles.size(), attributes.size());
    std::vector<glm::ivec3> colours(attributes.size());
    for (std::uint32_t i = 0; i < colours.size(); ++i) {
        const auto c = MaterialSampler(model.mesh).colour(i, glm::vec3(1.0f / 3.0f));
        for (int k = 0; k < 3; ++k) colours[i][k] = static_cast<int>(std::lround(255 * c[k]));
    }
    return colours;
}

// Colours of facets (Wikipedia, "STL (file format)"). Magics: an object's colour in the header; bit
// 15 clear for a facet's own, red lowest. VisCAM: bit 15 set for a facet's own, blue lowest.
TEST(Stl, ColoursOfFacets) {
    const std::string magics("x COLOR=\0\xff\0\xff,MATERIAL=", 22);
    using Colours = std::vector<glm::ivec3>;
    const glm::ivec3 red(255, 0, 0), green(0, 255, 0), blue(0, 0, 255), plain(188);
    EXPECT_EQ(stlColours(magics, {0x1f, 0x7c00, 0x8000, 0xffff}),
              (Colours{red, blue, green, green}));
    EXPECT_EQ(stlColours(magics, {0xffff, 0x8000}), (Colours{green, green}));
    EXPECT_EQ(stlColours(magics, {0, 8 | 16 << 5 | 24 << 10}),
              (Colours{glm::ivec3(0), glm::ivec3(66, 132, 197)}))
        << "all five bits of each";
    EXPECT_EQ(stlColours(magics, {0x801f, 0xfc00}), (Colours{red, blue})) << "as MeshLab writes";
    EXPECT_EQ(stlColours(magics, {0, 0}), (Colours{green, green}));
    EXPECT_EQ(stlColours("viscam", {0xfc00, 0x801f, 0x8000 | 8 | 16 << 5 | 24 << 10}),
              (Colours{red, blue, glm::ivec3(197, 132, 66)}));
    EXPECT_EQ(stlColours("viscam", {0xfc00, 0}), (Colours{red, plain}));
    EXPECT_EQ(stlColours("plain", {0, 0x7fff}), (Colours{plain, plain}));
}

TEST(Stl, BytesBehindTheLastFacetAreSaidToBeDropped) {
    std::string stl(80 + 4 + 50, '\0');
    stl[80] = 1;
    const float corners[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    std::memcpy(stl.data() + 84 + 12, corners, sizeof(corners));
    EXPECT_FALSE(readGoodText(stl, "a.stl").hasNote("facet"));
    const auto more = readGoodText(stl + "xy", "a.stl");
    EXPECT_EQ(more.mesh.triangles.size(), 1u);
    EXPECT_TRUE(more.hasNote("dropped: what is behind the last facet (2 bytes)"));
}

TEST(Stl, KeywordsMayBeInUpperCase) {
    const std::string text =
        "SOLID X\nFACET NORMAL 0 0 1\n OUTER LOOP\n  VERTEX -.5 -.5 0\n  VERTEX 5E-1 -.5 0\n  "
        "VERTEX .5 .5 0\n ENDLOOP\nENDFACET\nENDSOLID X\n";
    EXPECT_EQ(readGoodText(text, "a.stl").mesh.triangles.size(), 1u);
    EXPECT_EQ(readGoodText(text, "-").mesh.bounds().max, glm::dvec3(0.5, 0.5, 0));
}

TEST(Obj, VRunsDownInMeshAndKdIsSrgb) {
    TemporaryFolder folder;
    std::ofstream(folder / "a.mtl") << "newmtl half\nKd 0.5 1 0\nd 0.25\n";
    std::ofstream(folder / "a.obj")
        << "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 0.75\n"
           "usemtl half\nf 1/1 2/2 3/3\n";
    const auto [mesh, notes] = readGood(folder / "a.obj");
    ASSERT_EQ(mesh.uvs.size(), 3u);
    EXPECT_FLOAT_EQ(mesh.uvs[0].y, 1.0f);
    EXPECT_FLOAT_EQ(mesh.uvs[2].y, 0.25f);
    const auto& m = mesh.materials.at(mesh.triangleMaterial[0]);
    EXPECT_NEAR(m.baseColour.r, 0.2140411f, 1e-5f);
    EXPECT_FLOAT_EQ(m.baseColour.a, 0.25f);
    EXPECT_EQ(m.alpha, Material::Alpha::blend);
    EXPECT_TRUE(m.doubleSided);
}

TEST(Obj, MissingMaterialFileIsSaid) {
    const auto model =
        readGoodText("mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n", "a.obj");
    EXPECT_TRUE(model.hasNote("gone.mtl"));
    EXPECT_FALSE(model.mesh.materials.at(model.mesh.triangleMaterial[0]).hasColour);
}

TEST(Ply, BigEndianIsRead) {
    std::string text =
        "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        "property short z\nelement face 1\nproperty list uchar ushort vertex_index\nend_header\n";
    const auto put = [&](std::initializer_list<int> bytes) {
        for (const int b : bytes) text += static_cast<char>(b);
    };
    put({0, 0, 0, 0, 0, 0, 0, 0, 1, 2});           // 0 0 258
    put({0x3f, 0x80, 0, 0, 0, 0, 0, 0, 0, 0});     // 1 0 0
    put({0, 0, 0, 0, 0xc0, 0, 0, 0, 0xff, 0xff});  // 0 -2 -1
    put({3, 0, 0, 0, 1, 0, 2});
    const auto [mesh, notes] = readGoodText(text, "a.ply");
    ASSERT_EQ(mesh.triangles.size(), 1u);
    EXPECT_EQ(mesh.positions[0], glm::vec3(0, 0, 258));
    EXPECT_EQ(mesh.positions[2], glm::vec3(0, -2, -1));
}

TEST(Ply, AlphaOfFacesIsSaidToBeDropped) {
    const auto model = readGoodText(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
        "float z\nelement face 1\nproperty list uchar int vertex_indices\nproperty uchar red\n"
        "property uchar green\nproperty uchar blue\nproperty uchar alpha\nend_header\n"
        "0 0 0\n1 0 0\n1 1 0\n3 0 1 2 10 200 30 40\n",
        "a.ply");
    EXPECT_EQ(model.notes,
              std::vector<std::string>{"dropped: the alpha of PLY colours; all is opaque"});
}

TEST(Ply, FaceColoursAndStrips) {
    const auto coloured = readGoodText(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty "
        "float z\n"
        "element face 2\nproperty list uchar int vertex_indices\nproperty uchar red\nproperty "
        "uchar green\n"
        "property uchar blue\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 255 0 0\n3 0 2 3 0 0 "
        "255\n",
        "a.ply");
    ASSERT_EQ(coloured.mesh.colours.size(), 6u);
    EXPECT_EQ(coloured.mesh.colours[0], glm::vec4(1, 0, 0, 1));
    EXPECT_EQ(coloured.mesh.colours[5], glm::vec4(0, 0, 1, 1));
    const auto strips = readGoodText(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty "
        "float z\n"
        "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
        "0 0 0\n1 0 0\n0 1 0\n1 1 0\n8 0 1 2 3 -1 0 1 2\n",
        "a.ply");
    ASSERT_EQ(strips.mesh.triangles.size(), 3u);
    for (const auto& t : strips.mesh.triangles) {
        const auto& p = strips.mesh.positions;
        EXPECT_GT(glm::cross(p[t.y] - p[t.x], p[t.z] - p[t.x]).z, 0.0f);
    }
}

TEST(Ply, FacesMayComeBeforeTheirVertices) {
    const std::string faces =
        "ply\nformat ascii 1.0\nelement face 2\nproperty list uchar int vertex_indices\nelement "
        "vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty float s\n"
        "property float t\nend_header\n";
    const std::string vertices = "0 0 0 0 0\n1 0 0 0.5 0\n1 1 0 1 1\n0 1 0 0 1\n";
    const auto model = readGoodText(faces + "3 0 1 2\n3 0 2 3\n" + vertices, "a.ply").mesh;
    ASSERT_EQ(model.triangles.size(), 2u);
    EXPECT_EQ(model.positions[model.triangles[1].z], glm::vec3(0, 1, 0));
    EXPECT_EQ(model.uvs.at(model.triangles[0].y), glm::vec2(0.5f, 1));
    EXPECT_NE(readBadText(faces + "3 0 1 4\n3 0 2 3\n" + vertices, "a.ply")
                  .text()
                  .find("uses vertex 4, but there are only 4 vertices"),
              std::string::npos);
}

TEST(Ply, ColoursOfFacesBesideThoseOfVerticesAreSaidToBeDropped) {
    const auto model = readGoodText(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
        "float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n"
        "property list uchar int vertex_indices\nproperty uchar red\nproperty uchar green\n"
        "property uchar blue\nend_header\n0 0 0 0 0 255\n1 0 0 0 0 255\n1 1 0 0 0 255\n"
        "3 0 1 2 255 0 0\n",
        "a.ply");
    EXPECT_EQ(model.mesh.colours.at(0), glm::vec4(0, 0, 1, 1));
    EXPECT_TRUE(
        model.hasNote("dropped: the colours of PLY faces; those of the vertices are drawn"));
}

TEST(Clouds, PointsThatAreNowhereAreSkippedAndCounted) {
    const std::string header =
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty "
        "float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
    const auto cloud = readGoodText(
        header + "0 0 0 255 0 0\nnan nan nan 0 0 0\n1 0 0 0 0 255\n0 inf 0 9 9 9\n", "a.ply");
    ASSERT_EQ(cloud.mesh.points.size(), 2u);
    EXPECT_EQ(cloud.mesh.positions[1], glm::vec3(1, 0, 0));
    EXPECT_EQ(cloud.mesh.colours[1], glm::vec4(0, 0, 1, 1));
    EXPECT_TRUE(cloud.hasNote("2 of 4 points are at no finite place and are skipped"));
    std::string none = header;
    for (int i = 0; i < 4; ++i) none += "nan 0 0 0 0 0\n";
    EXPECT_NE(readBadText(none, "a.ply").text().find("none of the model's 4 points"),
              std::string::npos);

    GltfText gltf;
    const auto nan = std::numeric_limits<float>::quiet_NaN();
    const int position =
        gltf.accessor(std::vector<float>{0, 0, 0, nan, 0, 0, 1, 1, 0}, 5126, "VEC3", 3);
    gltf.root["meshes"][0]["primitives"].push_back(
        {{"attributes", {{"POSITION", position}}}, {"mode", 0}});
    EXPECT_EQ(readGoodText(gltf.text(), "a.gltf").mesh.points.size(), 2u);
}

TEST(Clouds, VerticesThatAreNotNamedAreNoPoints) {
    const std::string obj = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nv 0 1 0 1 1 1\n";
    const auto one = readGoodText(obj + "p 3\nl 1 2 4\n", "a.obj");
    ASSERT_EQ(one.mesh.points.size(), 1u);
    EXPECT_EQ(one.mesh.positions[one.mesh.points[0]], glm::vec3(1, 1, 0));
    EXPECT_EQ(one.mesh.colours[one.mesh.points[0]], glm::vec4(0, 0, 1, 1));
    EXPECT_EQ(readGoodText(obj + "p 1 2\n", "a.obj").mesh.points.size(), 2u);
    EXPECT_EQ(readGoodText(obj, "a.obj").mesh.points.size(), 4u) << "a cloud";

    const std::string off = "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
    const auto named = readGoodText(off + "1 2\n2 0 1\n", "a.off");
    ASSERT_EQ(named.mesh.points.size(), 1u);
    EXPECT_EQ(named.mesh.positions[named.mesh.points[0]], glm::vec3(1, 1, 0));

    GltfText gltf;
    gltf.addQuad();
    gltf.primitive()["mode"] = 0;
    gltf.primitive()["indices"] =
        gltf.accessor(std::vector<std::uint16_t>{3, 1, 3}, 5123, "SCALAR", 3);
    const auto two = readGoodText(gltf.text(), "a.gltf");
    ASSERT_EQ(two.mesh.points.size(), 2u);
    EXPECT_EQ(two.mesh.positions[two.mesh.points[0]], glm::vec3(1, 0, 0));
    EXPECT_EQ(two.mesh.positions[two.mesh.points[1]], glm::vec3(0, 1, 0));
    gltf.primitive()["indices"] = gltf.accessor(std::vector<std::uint16_t>{4}, 5123, "SCALAR", 1);
    EXPECT_NE(readBadText(gltf.text(), "a.gltf").text().find("index 0 is vertex 4"),
              std::string::npos);
}

TEST(Clouds, NormalsThatPointsDoNotHaveAreNotInvented) {
    const std::string header =
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty "
        "float z\nproperty float nx\nproperty float ny\nproperty float nz\nend_header\n";
    const auto some = readGoodText(header + "0 0 0 nan nan nan\n1 0 0 0 2 0\n", "a.ply");
    ASSERT_EQ(some.mesh.normals.size(), 2u);
    EXPECT_EQ(some.mesh.normals[0], glm::vec3(0));
    EXPECT_EQ(some.mesh.normals[1], glm::vec3(0, 1, 0));
    EXPECT_TRUE(some.hasNote("PLY: 1 normals are no directions; these points have none"));
    const auto none = readGoodText(header + "0 0 0 0 0 0\n1 0 0 0 0 0\n", "a.ply");
    EXPECT_TRUE(none.mesh.normals.empty());
    EXPECT_TRUE(none.hasNote("PLY: 2 normals are no directions; these points have none"));

    GltfText gltf;
    gltf.addQuad();
    gltf.addQuad();
    auto& primitives = gltf.root["meshes"][0]["primitives"];
    primitives[0]["attributes"]["NORMAL"] =
        gltf.accessor(std::vector<float>{1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0}, 5126, "VEC3", 4);
    primitives[1]["mode"] = 0;
    const auto beside = readGoodText(gltf.text(), "a.gltf");
    ASSERT_EQ(beside.mesh.points.size(), 4u);
    EXPECT_EQ(beside.mesh.normals.at(beside.mesh.triangles.at(0).x), glm::vec3(1, 0, 0));
    for (const auto p : beside.mesh.points) EXPECT_EQ(beside.mesh.normals.at(p), glm::vec3(0));
}

/// The colour of each point, as sRGB.
std::vector<glm::ivec3> pointColours(const ReadModel& model) {
    std::vector<glm::ivec3> out;
    for (const auto p : model.mesh.points) {
        glm::ivec3 c(255);
        if (!model.mesh.colours.empty())
            for (int k = 0; k < 3; ++k)
                c[k] =
                    static_cast<int>(std::lround(srgbFromLinear(model.mesh.colours[p][k]) * 255));
        out.push_back(c);
    }
    return out;
}

TEST(Clouds, PointsHaveTheColourOfTheirMaterial) {
    using Colours = std::vector<glm::ivec3>;
    const glm::ivec3 red(255, 0, 0), grey(188);
    TemporaryFolder folder;
    write(folder / "a.mtl", "newmtl red\nKd 1 0 0\n");
    write(folder / "a.obj", "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nusemtl red\np 1 2\n");
    EXPECT_EQ(pointColours(readGood(folder / "a.obj")), (Colours{red, red}));

    GltfText gltf;
    const int position = gltf.accessor(std::vector<float>{0, 0, 0, 1, 0, 0}, 5126, "VEC3", 2);
    const int colour = gltf.accessor(std::vector<float>{1, 1, 1, 0, 1, 1}, 5126, "VEC3", 2);
    gltf.root["materials"] = {{{"pbrMetallicRoughness", {{"baseColorFactor", {1, 0, 0, 1}}}}},
                              {{"pbrMetallicRoughness", {{"baseColorFactor", {0, 0, 0, 1}}}},
                               {"emissiveFactor", {1, 0, 0}}}};
    auto& primitives = gltf.root["meshes"][0]["primitives"];
    primitives.push_back({{"attributes", {{"POSITION", position}, {"COLOR_0", colour}}},
                          {"mode", 0},
                          {"material", 0}});
    primitives.push_back({{"attributes", {{"POSITION", position}}}, {"mode", 0}, {"material", 1}});
    EXPECT_EQ(pointColours(readGoodText(gltf.text(), "a.gltf")),
              (Colours{red, glm::ivec3(0), red, red}));

    const auto plain = readGoodText(
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty "
        "float z\nend_header\n0 0 0\n",
        "a.ply");
    EXPECT_EQ(pointColours(plain), Colours{grey});
    EXPECT_TRUE(plain.hasNote("it is drawn in plain grey"));
    EXPECT_EQ(pointColours(readGoodText("v 0 0 0\nv 1 0 0\n", "a.obj")), (Colours{grey, grey}));
}

TEST(Clouds, ATextureOfPointsIsSaidToBeDropped) {
    GltfText gltf;
    gltf.addQuad();
    gltf.addTexture();
    gltf.root["materials"] = {
        {{"name", "a"}, {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
    gltf.primitive()["material"] = 0;
    gltf.primitive()["mode"] = 0;
    EXPECT_TRUE(readGoodText(gltf.text(), "a.gltf")
                    .hasNote("the texture of material 'a' is not drawn on points"));
}

class WritePoints : public testing::Test {
  protected:
    WritePoints() {
        for (int i = 0; i < 500; ++i) {
            const float a = static_cast<float>(i) * 0.1f;
            positions_.emplace_back(std::cos(a), std::sin(a), static_cast<float>(i) * 0.004f);
            normals_.emplace_back(std::cos(a), std::sin(a), 0.0f);
            colours_.emplace_back(i % 256, i / 2, 255 - i % 256, 255 - i / 4);
        }
    }
    [[nodiscard]] PointCloud cloud() const { return {positions_, colours_, normals_, true}; }

    Result<ReadModel> roundTrip(const std::string& name, const PointWriteOptions& options = {}) {
        Job job;
        STX_CHECK(writePoints(folder_ / name, cloud(), job, options));
        return readGood(folder_ / name);
    }
    /// Largest distance of a written point to the read one that is nearest, with its colour alike.
    [[nodiscard]] double worst(const Mesh& mesh) const {
        double result = 0;
        for (std::size_t i = 0; i < positions_.size(); ++i) {
            double nearest = 1e9;
            for (std::size_t k = 0; k < mesh.positions.size(); ++k) {
                if (std::abs(mesh.colours[k].a * 255 - colours_[i].a) > 0.01f) continue;
                nearest = std::min(
                    nearest, static_cast<double>(glm::distance(mesh.positions[k], positions_[i])));
            }
            result = std::max(result, nearest);
        }
        return result;
    }

    TemporaryFolder folder_;
    std::vector<glm::vec3> positions_, normals_;
    std::vector<glm::u8vec4> colours_;
};

TEST_F(WritePoints, PlyIsExact) {
    const auto model = roundTrip("p.ply");
    ASSERT_TRUE(model);
    EXPECT_EQ(model->mesh.positions, positions_);
    ASSERT_EQ(model->mesh.colours.size(), 500u);
    EXPECT_NEAR(model->mesh.colours[300].r, 0.02518686f, 1e-6f);  // 44 in sRGB
    EXPECT_LT(glm::distance(model->mesh.normals[7], normals_[7]), 1e-6f);
}

TEST_F(WritePoints, DracoExactAndRounded) {
    const auto exact = roundTrip("e.drc", {.positionBits = 0, .normalBits = 0});
    ASSERT_TRUE(exact);
    EXPECT_EQ(exact->mesh.positions, positions_);
    const auto rounded = roundTrip("r.drc");
    ASSERT_TRUE(rounded);
    ASSERT_EQ(rounded->mesh.positions.size(), 500u);
    ASSERT_EQ(rounded->mesh.normals.size(), 500u);
    // 16 bits of an extent of 2, in each of three axes.
    EXPECT_LT(worst(rounded->mesh), 2.0 / 65535 / 2 * std::sqrt(3.0) * 1.01);
    EXPECT_LT(std::filesystem::file_size(folder_ / "r.drc"),
              std::filesystem::file_size(folder_ / "e.drc"));
}

TEST_F(WritePoints, SameInputSameBytes) {
    for (const char* ending : {"ply", "drc"}) {
        Job job;
        const auto a = folder_ / fmt::format("a.{}", ending),
                   b = folder_ / fmt::format("b.{}", ending);
        ASSERT_TRUE(writePoints(a, cloud(), job));
        ASSERT_TRUE(writePoints(b, cloud(), job));
        EXPECT_EQ(*readFile(a, job.limits), *readFile(b, job.limits));
    }
}

TEST_F(WritePoints, PlyInPartsIsThePlyOfAll) {
    Job job;
    for (const glm::dvec3 origin : {glm::dvec3(0), glm::dvec3(4e6, 1, -2)}) {
        PointCloud all = cloud();
        all.origin = origin;
        ASSERT_TRUE(writePoints(folder_ / "all.ply", all, job));
        auto file = PlyInParts::create(folder_ / "parts.ply", {500, true, true, true, origin}, {});
        ASSERT_TRUE(file) << file.error().text();
        for (const auto& [first, count] : {std::pair(0, 199), {199, 0}, {199, 301}}) {
            const PointCloud part = {all.positions.subspan(first, count),
                                     all.colours.subspan(first, count),
                                     all.normals.subspan(first, count), true, origin};
            const auto rows = file->encode(part);
            ASSERT_TRUE(rows) << rows.error().text();
            ASSERT_TRUE(file->add(*rows));
        }
        ASSERT_TRUE(file->commit());
        EXPECT_EQ(*readFile(folder_ / "all.ply", job.limits),
                  *readFile(folder_ / "parts.ply", job.limits));
    }
    // Other points than were said leave no file.
    auto file = PlyInParts::create(folder_ / "few.ply", {499, true, true, true, {}}, {});
    ASSERT_TRUE(file);
    ASSERT_TRUE(file->add(*file->encode(cloud())));
    EXPECT_EQ(file->commit().error().code, ErrorCode::invalidInput);
    PointCloud bare = cloud();
    bare.normals = {};
    EXPECT_EQ(file->encode(bare).error().code, ErrorCode::invalidInput);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "few.ply"));
}

TEST_F(WritePoints, DebiansDecoderReadsIt) {
    if (std::system("command -v draco_decoder > /dev/null") != 0)
        GTEST_SKIP() << "no draco_decoder here";
    Job job;
    ASSERT_TRUE(writePoints(folder_ / "p.drc", cloud(), job));
    const auto out = folder_ / "out.ply";
    ASSERT_EQ(std::system(fmt::format("draco_decoder -i '{}' -o '{}' > /dev/null",
                                      (folder_ / "p.drc").string(), out.string())
                              .c_str()),
              0);
    const auto model = readGood(out);
    EXPECT_EQ(model.mesh.points.size(), 500u);
    EXPECT_EQ(model.mesh.normals.size(), 500u);
    EXPECT_LT(worst(model.mesh), 3e-5);
}

TEST_F(WritePoints, BadRequests) {
    Job job;
    EXPECT_EQ(writePoints(folder_ / "p.xyz", cloud(), job).error().code, ErrorCode::usage);
    EXPECT_EQ(writePoints(folder_ / "p.ply", {}, job).error().code, ErrorCode::invalidInput);
    const auto messageOf = [&](const PointWriteOptions& options) {
        const auto written = writePoints(folder_ / "p.drc", cloud(), job, options);
        if (written || written.error().code != ErrorCode::usage) return std::string("taken");
        return written.error().message;
    };
    // The field that is wrong, and no other.
    EXPECT_EQ(messageOf({.positionBits = 31}),
              "positionBits is 31; Draco codes with 1 to 30 bits, and 0 keeps floats exact");
    EXPECT_EQ(messageOf({.normalBits = 1}),
              "normalBits is 1; Draco codes with 2 to 30 bits, and 0 keeps floats exact");
    colours_.pop_back();
    EXPECT_EQ(writePoints(folder_ / "p.ply", cloud(), job).error().code, ErrorCode::invalidInput);
    colours_.emplace_back();
    positions_[3].y = std::numeric_limits<float>::quiet_NaN();
    EXPECT_EQ(writePoints(folder_ / "p.drc", cloud(), job).error().code, ErrorCode::invalidInput);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "p.drc"));
}

}  // namespace
}  // namespace stx

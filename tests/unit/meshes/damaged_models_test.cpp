// Models that are cut off, or claim what they do not hold: nothing of them passes for whole.

#include <cmath>
#include <fstream>

#include "tests/temporary_folder.hpp"
#include "tests/unit/limits/peak_memory.hpp"
#include "tests/unit/meshes/models.hpp"

namespace stx {
namespace {

void expectInvalid(const Error& error, const std::string& words) {
    EXPECT_EQ(error.code, ErrorCode::invalidInput) << error.text();
    EXPECT_NE(error.text().find(words), std::string::npos) << error.text();
}

const std::string kQuad = "OFF\n4 1 0\n0 0 0\n2 0 0\n2 2 0\n0 2 0\n";

TEST(DamagedOff, ErrorsNameTheLine) {
    expectInvalid(readBadText(kQuad + "3 0 1 4\n", "a.off"),
                  "line 7: the face names vertex 4; there are 4, counted from 0");
    expectInvalid(readBadText(kQuad + "300000000 0 1 2\n", "a.off"),
                  "line 7: the face claims 300000000 corners, more than its line holds");
    expectInvalid(readBadText(kQuad + "4 0 1 2\n", "a.off"), "the face has 3 of 4 corners");
    expectInvalid(readBadText(kQuad, "a.off"), "the file ends after 0 of 1 faces; it is cut off");
    expectInvalid(readBadText("OFF\n4 1 0\n0 0 0\n2 0 0\n", "a.off"),
                  "the file ends after 2 of 4 vertices");
    expectInvalid(readBadText("OFF\n2 1 0\n0 0 0\n1 x 0\n2 0 1\n", "a.off"),
                  "line 4: a vertex of 3 numbers is expected");
    expectInvalid(readBadText("OFF\n", "a.off"), "ends before its counts");
    expectInvalid(readBadText("4OFF\n1 0 0\n1 2 3 0\n", "a.off"), "at a finite place");
    // 44 bytes.
    expectInvalid(readBadText("OFF\n200000000 200000000 0\n0 0 0\n1 0 0\n3 0 1 2\n", "a.off"),
                  "it claims 200000000 vertices");
}

TEST(Off, AllThatTheFormatHas) {
    // A polygon of twelve corners, comments, counts on the first line, Windows' ends of lines.
    std::string ring = "# a ring\r\nOFF 12 1 0\r\n\r\n";
    for (int i = 0; i < 12; ++i)
        ring +=
            fmt::format("{} {} 1e0 # corner {}\r\n", std::cos(i * 0.5236), std::sin(i * 0.5236), i);
    ring += "12 0 1 2 3 4 5 6 7 8 9 10 11 0.5 0.5 0.5\r\n";
    const auto polygon = readGoodText(ring, "a.off");
    EXPECT_EQ(polygon.mesh.triangles.size(), 10u);
    EXPECT_TRUE(polygon.hasNote("dropped: colours of faces (1)"));

    const auto coloured = readGoodText(
        "STCNOFF\n3 2 0\n0 0 0 0 0 1 255 0 0 0.25 0.25\n1 0 0 0 0 1 0 255 0 1 0\n"
        "0 1 0 0 0 1 0 0 255 0 1\n3 0 1 2\n2 0 1\n",
        "a.off");
    ASSERT_EQ(coloured.mesh.colours.size(), 3u);
    EXPECT_EQ(coloured.mesh.colours[0], glm::vec4(1, 0, 0, 1));
    ASSERT_EQ(coloured.mesh.uvs.size(), 3u);
    EXPECT_EQ(coloured.mesh.uvs[0], glm::vec2(0.25f, 0.75f));
    EXPECT_TRUE(coloured.hasNote("dropped: lines (1)"));
    const std::string vertices =
        "3 1 0\n0 0 0 255 0 0 255\n1 0 0 9 9 9\n0 1 0 0 0 255 51\n3 0 1 2\n";
    const auto alphas = readGoodText("COFF\n" + vertices, "a.off").mesh.colours;
    ASSERT_EQ(alphas.size(), 3u);
    expectNear(glm::vec3(alphas[0].a, alphas[1].a, alphas[2].a), {1, 1, 0.2f});
    EXPECT_TRUE(readGoodText("OFF\n" + vertices, "a.off")
                    .hasNote("dropped: numbers behind the coordinates of vertices (3); where they "
                             "are colours the first line says COFF"));

    EXPECT_EQ(readGoodText("4OFF\n3 1 0\n0 0 0 2\n2 0 0 2\n0 2 0 2\n3 0 1 2\n", "a.off")
                  .mesh.bounds()
                  .max,
              glm::dvec3(1, 1, 0));
    EXPECT_EQ(readGoodText("3 1 0\n0 0 0\n2 0 0\n0 2 0\n3 0 1 2\n", "a.off").mesh.triangles.size(),
              1u);
    expectInvalid(readBadText("nOFF\n5\n3 1 0\n", "a.off"), "only three dimensions are read");
}

const std::string kStl =
    "solid a\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n"
    "   vertex 0 1 0\n  endloop\n endfacet\n";

TEST(DamagedStl, ATextWithoutItsEndIsCutOff) {
    EXPECT_EQ(readGoodText(kStl + "endsolid a\n", "a.stl").mesh.triangles.size(), 1u);
    EXPECT_EQ(readGoodText(kStl + "ENDSOLID", "a.stl").mesh.triangles.size(), 1u);
    for (const auto& text :
         {kStl, kStl + kStl.substr(8, 60), kStl + "endsolid a\n" + kStl.substr(0, 100)})
        expectInvalid(readBadText(text, "a.stl"), "ends without 'endsolid'");
}

TEST(DamagedPly, ATextThatEndsWithALineIsCutOff) {
    const std::string head =
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty "
        "float z\nelement face 2\nproperty list uchar int vertex_indices\nproperty list uchar "
        "float texcoord\nend_header\n0.000000 0 0\n1 0 0\n1 1 0\n0 1 0\n";
    // Lists that are left out at the end of a line are empty, of the last line, too.
    EXPECT_EQ(readGoodText(head + "3 0 1 2\n3 0 2 3", "a.ply").mesh.triangles.size(), 2u);
    for (const std::string end : {"3 0 1 2\n", "3 0 1 2", "3 0 1 2\n \r\n"})
        expectInvalid(readBadText(head + end, "a.ply"),
                      "face 1 of 2: the file ends; it is cut off");
    expectInvalid(readBadText(head, "a.ply"), "face 0 of 2: the file ends; it is cut off");
    expectInvalid(readBadText(head.substr(0, head.size() - 6), "a.ply"),
                  "vertex 3 of 4: the file ends; it is cut off");
}

/// Twenty thousand times the same name: the file is read once.
TEST(DamagedObj, NamesOfMaterialFilesAreReadOnce) {
    const TemporaryFolder folder;
    std::string mtl = "newmtl paint\nKd 1 0 0\n", obj;
    for (int i = 0; i < 20000; ++i) mtl += "# a long file, so that reading it takes its time\n";
    for (int i = 0; i < 20000; ++i) obj += "mtllib a.mtl\n";
    obj += "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl paint\nf 1 2 3\n";
    std::ofstream(folder / "a.mtl") << mtl;
    std::ofstream(folder / "a.obj") << obj;
    const auto model = readGood(folder / "a.obj");
    ASSERT_FALSE(model.mesh.materials.empty());
    EXPECT_EQ(glm::vec3(model.mesh.materials.back().baseColour), glm::vec3(1, 0, 0));
}

/// A triangle in nodes each of which holds the one before twice: 2^levels of them in 2 kB.
std::string collada(int levels) {
    std::string nodes = "<node id=\"n0\"><instance_geometry url=\"#g\"/></node>";
    for (int i = 1; i <= levels; ++i)
        nodes += fmt::format(
            "<node id=\"n{0}\"><instance_node url=\"#n{1}\"/><instance_node url=\"#n{1}\"/></node>",
            i, i - 1);
    return "<?xml version=\"1.0\"?><COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" "
           "version=\"1.4.1\"><library_geometries><geometry id=\"g\"><mesh><source id=\"s\">"
           "<float_array id=\"f\" count=\"9\">0 0 0 1 0 0 0 1 0</float_array><technique_common>"
           "<accessor source=\"#f\" count=\"3\" stride=\"3\"><param name=\"X\" type=\"float\"/>"
           "<param name=\"Y\" type=\"float\"/><param name=\"Z\" type=\"float\"/></accessor>"
           "</technique_common></source><vertices id=\"v\"><input semantic=\"POSITION\" "
           "source=\"#s\"/></vertices><triangles count=\"1\"><input semantic=\"VERTEX\" "
           "source=\"#v\" offset=\"0\"/><p>0 1 2</p></triangles></mesh></geometry>"
           "</library_geometries><library_nodes>" +
           nodes +
           fmt::format(
               "</library_nodes><library_visual_scenes><visual_scene id=\"w\"><node>"
               "<instance_node url=\"#n{}\"/></node></visual_scene></library_visual_scenes>"
               "<scene><instance_visual_scene url=\"#w\"/></scene></COLLADA>",
               levels);
}

/// Assimp catches what the allocation throws; the process without a limit must not try again.
TEST(DamagedCollada, WhatFailsUnderTheLimitIsNotRepeatedWithoutIt) {
#ifdef __SANITIZE_ADDRESS__
    GTEST_SKIP() << "without a limit of the address space";
#endif
    EXPECT_EQ(readGoodText(collada(2), "a.dae").mesh.triangles.size(), 4u);
    Limits limits;
    limits.maxMemoryBytes = 256 << 20;
    const long before = peakMiB();
    expectInvalid(readBadText(collada(18), "a.dae", limits),
                  "the model needs more than the memory");
    EXPECT_LT(peakMiB() - before, 200);
    // What is wrong is said in Assimp's words, by way of the process that met it.
    expectInvalid(readBadText(collada(2).substr(0, 400), "a.dae"), "Assimp cannot read this dae");
}

}  // namespace
}  // namespace stx

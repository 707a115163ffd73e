#include <array>
#include <cmath>
#include <ctime>

#include "formats/meshes/text_coordinates.hpp"
#include "formats/meshes/vertex_colours.hpp"
#include "lib/capture/material_sampler.hpp"
#include "tests/unit/meshes/models.hpp"

namespace stx {
namespace {

TEST(Mtl, AlphaMapIsTheAlphaOfTheTexture) {
    TemporaryFolder folder;
    writePair(folder / "colour.png", {255, 0, 0, 255}, {0, 255, 0, 255});
    writePair(folder / "mask.png", {0, 0, 0, 255}, {128, 128, 128, 255});
    const auto both = objWith(folder, "map_Kd colour.png\nmap_d mask.png\n");
    const auto& m = both.mesh.materials.at(both.mesh.triangleMaterial[0]);
    EXPECT_EQ(m.alpha, Material::Alpha::blend);
    const auto& pixels = both.mesh.textures.at(m.baseColourTexture).pixels;
    EXPECT_EQ(pixels.at(0, 0), glm::u8vec4(255, 0, 0, 0));
    EXPECT_EQ(pixels.at(1, 0), glm::u8vec4(0, 255, 0, 128));
    EXPECT_TRUE(both.notes.empty()) << both.notes[0];
    const auto alone = objWith(folder, "Kd 0 0 1\nmap_d mask.png\n");
    const auto& plain = alone.mesh.materials.at(alone.mesh.triangleMaterial[0]);
    EXPECT_EQ(alone.mesh.textures.at(plain.baseColourTexture).pixels.at(1, 0),
              glm::u8vec4(255, 255, 255, 128));
    EXPECT_EQ(plain.baseColour, glm::vec4(0, 0, 1, 1));
}

/// A triangle of three corners with `first`, then one with `second` behind the coordinates; and
/// `more` lines.
std::array<glm::vec4, 2> coloursOfTwo(const std::string& first, const std::string& second,
                                      const std::string& more = "") {
    std::string text;
    for (int i = 0; i < 6; ++i)
        text += fmt::format("v {} {} {} {}\n", i % 3 / 2, i % 3 % 2, i / 3, i < 3 ? first : second);
    const auto model = readGoodText(text + more + "f 1 2 3\nf 4 5 6\n", "a.obj");
    EXPECT_TRUE(model.notes.empty()) << model.notes[0];
    EXPECT_EQ(model.mesh.triangles.size(), 2u);
    const MaterialSampler sampler(model.mesh);
    return {sampler.colour(0, glm::vec3(1.0f / 3.0f)), sampler.colour(1, glm::vec3(1.0f / 3.0f))};
}

TEST(Obj, VerticesWithoutAColourAreWhiteBesideColoured) {
    const glm::vec4 white(1), green(0, 1, 0, 1), blue(0, 0, 1, 1);
    using Two = std::array<glm::vec4, 2>;
    EXPECT_EQ(coloursOfTwo("", "0 1 0"), (Two{white, green}));
    EXPECT_EQ(coloursOfTwo("0 1 0", ""), (Two{green, white}));
    EXPECT_EQ(coloursOfTwo("1", "0 0 1"), (Two{white, blue})) << "a w";
    EXPECT_EQ(coloursOfTwo("0 0 255", ""), (Two{blue, white})) << "bytes";
    EXPECT_EQ(coloursOfTwo("0 0 1", "0 1 0"), (Two{blue, green}));
    EXPECT_EQ(coloursOfTwo("# plain", "0 1 0"), (Two{white, green})) << "a comment";
    for (const std::string line : {"v nan nan nan", "v 1e999 -inf 1e-999", "v 1 \\\n 2 \\\r\n3"})
        EXPECT_EQ(coloursOfTwo("", "0 1 0", line + "\n"), (Two{white, green})) << line;
}

TEST(Obj, AlphaBehindColoursIsLeftOut) {
    const glm::vec4 white(1), red(1, 0, 0, 1), green(0, 1, 0, 1), blue(0, 0, 1, 1);
    using Two = std::array<glm::vec4, 2>;
    EXPECT_EQ(coloursOfTwo("1 0 0 1", "0 1 0 1.0"), (Two{red, green})) << "full: no note";
    EXPECT_EQ(coloursOfTwo("1 0 0 1", "0 1 0"), (Two{red, green}));
    EXPECT_EQ(coloursOfTwo("", "1 0 0 1"), (Two{white, red}));
    EXPECT_EQ(coloursOfTwo("0 0 255 255", "255 0 0 255"), (Two{blue, red})) << "bytes";
    for (const std::string colour : {"1 0 0 .5", "255 0 0 128"}) {
        std::string text;
        for (int i = 0; i < 3; ++i) text += fmt::format("v {} {} 0 {}\n", i / 2, i % 2, colour);
        const auto model = readGoodText(text + "f 1 2 3\n", "a.obj");
        ASSERT_EQ(model.mesh.colours.size(), 3u) << colour;
        EXPECT_EQ(model.mesh.colours[0], red) << colour;
        EXPECT_TRUE(model.hasNote("the alpha of vertex colours (v X Y Z R G B A) is not used"));
        EXPECT_EQ(model.notes.size(), 1u);
    }
}

TEST(Obj, ColoursALittleAbove1AreNoBytes) {
    const auto isBytes = [](std::initializer_list<glm::vec3> colours) {
        ColourRange range;
        for (const auto& colour : colours) range.add(colour);
        return range.isBytes();
    };
    EXPECT_FALSE(isBytes({{1, 0, 1}, {0, 0, 0}}));
    EXPECT_FALSE(isBytes({{1, 0, 1}, {1.000001f, 0.5f, 0.25f}}));
    EXPECT_FALSE(isBytes({{4.5f, 0.5f, 3}})) << "light";
    EXPECT_FALSE(isBytes({{HUGE_VALF, NAN, 1}}));
    EXPECT_TRUE(isBytes({{2, 0, 1}})) << "dark ones";
    EXPECT_TRUE(isBytes({{127.5f, 0.25f, 1}}));
    const auto model = readGoodText(
        "v 0 0 0 1 .5 .2\nv 1 0 0 1.000001 .5 .2\nv 0 1 0 1 .5 .2\nf 1 2 3\n", "a.obj");
    expectNear(glm::vec3(colourOf(model.mesh)), {1, 0.5f, 0.2f}, 1e-3f);
}

/// A triangle in coordinates of a map, and a line more.
ReadModel mapWith(const std::string& line) {
    return readGoodText(
        "v 500000.25 4600000.5 0\nv 500001.25 4600000.5 0\nv 500000.25 4600001.5 "
        "0\n" +
            line + "\nf 1 2 3\n",
        "a.obj");
}

TEST(Obj, VerticesThatAreNowhereDoNotRoundTheOthers) {
    for (const std::string line : {"v nan nan nan", "v 1e999 0 0", "v 5e5 \\\n4600000 0"}) {
        const auto model = mapWith(line);
        ASSERT_EQ(model.mesh.positions.size(), 3u) << line;
        EXPECT_NE(model.mesh.origin, glm::dvec3(0)) << line;
        EXPECT_EQ(model.mesh.origin + glm::dvec3(model.mesh.positions[1]),
                  glm::dvec3(500001.25, 4600000.5, 0))
            << line;
        EXPECT_FALSE(model.hasNote("the reader of this format rounds")) << line;
    }
    EXPECT_EQ(readGoodText("v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan nan nan\ns 1\nf 1 2 3\n", "a.obj")
                  .mesh.normals.size(),
              3u);
}

TEST(Obj, VerticesThatAreNotUnderstoodAreSaid) {
    const auto model = mapWith(" v 1 2 ");
    EXPECT_TRUE(
        model.hasNote("found 'v 1 2', expected 'v X Y Z': vertices are as Assimp takes them, their "
                      "coordinates rounded "
                      "to 32-bit floats"));
    EXPECT_TRUE(model.hasNote("to which the reader of this format rounds them"));
}

TEST(Obj, CommentsEndWithTheirLines) {
    const std::string square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    for (const std::string comment :
         {"# from C:\\models\\\n", "\t#\\\r\n", "# a \\ \n", "g a # b\\\n"}) {
        const auto model =
            readGoodText(comment + square + comment + "s 1\n" + comment + "f 1 2 3 4\n", "a.obj");
        EXPECT_EQ(model.mesh.positions.size(), 4u) << comment;
        EXPECT_EQ(model.mesh.normals.size(), 4u) << comment << "its smoothing group";
    }
}

TEST(Obj, NumbersThatBeginWithAPoint) {
    using Two = std::array<glm::vec4, 2>;
    const glm::vec4 white(1), red(1, 0, 0, 1);
    EXPECT_EQ(coloursOfTwo("1 1 1.", "1 .0 .0"), (Two{white, red}));
    EXPECT_EQ(coloursOfTwo("", "\t1. .0 .0"), (Two{white, red}));
    const auto half = readGoodText(
        "# .5 is a half\nv -.5 -.5 .25\nv .5 \\\n.5 .25\nv 0 .5 .25\nvt .5 .25\nf 1/1 2/1 3/1\n",
        "a.obj");
    ASSERT_EQ(half.mesh.positions.size(), 3u);
    EXPECT_EQ(half.mesh.bounds().min, glm::dvec3(-0.5f, -0.5f, 0.25f));
    EXPECT_EQ(half.mesh.bounds().max, glm::dvec3(0.5f, 0.5f, 0.25f));
    ASSERT_EQ(half.mesh.uvs.size(), 3u);
    EXPECT_EQ(half.mesh.uvs[0], glm::vec2(0.5f, 0.75f));
}

TEST(Obj, NumbersWithoutPointsTakeNoLongerThanOthers) {
    std::string text;
    for (int i = 0; i < 200000; ++i) text += "v 1 2 3\n";
    const auto before = std::clock();
    EXPECT_FALSE(plainObj(std::as_bytes(std::span(text))));
    EXPECT_LT(static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC, 1.0);
}

TEST(Obj, LinesMayEndInAComment) {
    const std::string plain = "v 0 0 0\nv 1 0 0\nv 0 .5 0\nvt 0 0\nvt 1 0\nvt 0 1\n";
    const auto without = readGoodText(plain + "f 1/1 2/2 3/3\nf 3/3 2/2 1/1\n", "a.obj");
    const auto with = readGoodText(
        "v 0 0 0 # 1.5\nv 1 0 0\t#\r\nv 0 .5 0# .5 \nvt 0 0#\nvt 1 0 # 1\nvt 0 1 # .5 .5\n"
        "usemtl a#b\nf 1/1 2/2 \\\n3/3 # base \\\nf 3/3 2/2 1/1#4/4\n#f 1 2 3",
        "a.obj");
    ASSERT_EQ(with.mesh.triangles.size(), 2u);
    EXPECT_EQ(with.mesh.triangles, without.mesh.triangles);
    EXPECT_EQ(with.mesh.positions, without.mesh.positions);
    EXPECT_EQ(with.mesh.uvs, without.mesh.uvs);
    EXPECT_TRUE(with.hasNote("material 'a#b'"));
}

TEST(Mtl, LinesOfNoUseAreLeftOut) {
    TemporaryFolder folder;
    for (const std::string line :
         {"aniso 0.0", "anisor 0", "dissolve 1", "illum 2", "Tf xyz 1 1 1", "Ns nothing"}) {
        const auto model = objWith(folder, line + "\nKd 1 0 0\n");
        EXPECT_EQ(colourOf(model.mesh), glm::vec4(1, 0, 0, 1)) << line;
        EXPECT_TRUE(model.notes.empty()) << line << ": " << model.notes[0];
    }
    EXPECT_TRUE(objWith(folder, "Kd 1 0 0\ndecal quad.png\n")
                    .hasNote("material 'paint': decal is dropped"));
}

TEST(Mtl, LinesThatCannotBeReadAreSaid) {
    TemporaryFolder folder;
    EXPECT_EQ(objWith(folder, "Kd spectral a.rfl 1\n").notes.at(0),
              "material file 'a.mtl', line 2: 'Kd spectral a.rfl 1', expected 'Kd R G B': the line "
              "is left out");
    const auto several = objWith(folder, "Kd 0 1 0\nKe xyz .5 .5 .5\nd full\nmap_Kd -clamp on\n");
    EXPECT_EQ(several.notes.at(0),
              "material file 'a.mtl', line 3: 'Ke xyz .5 .5 .5', expected 'Ke R G B': the line is "
              "left out, and 2 like it");
    EXPECT_EQ(several.notes.size(), 1u);
    EXPECT_EQ(colourOf(several.mesh), glm::vec4(0, 1, 0, 1));
}

TEST(Mtl, KeywordsMayBeInLowerCase) {
    TemporaryFolder folder;
    writePair(folder / "t.png", {255, 0, 0, 255}, {0, 255, 0, 255});
    expectNear(objWith(folder, "map_kd -s 2 3 1 t.png\n").mesh.uvs.at(1), glm::vec2(2, 1));
    EXPECT_EQ(colourOf(objWith(folder, "kd 1 0 0\n").mesh), glm::vec4(1, 0, 0, 1));
    EXPECT_FLOAT_EQ(colourOf(objWith(folder, "Kd 1 0 0\ntr 0.25\n").mesh).a, 0.75f);
}

TEST(Mtl, AnAlphaMapMayBeAChannel) {
    TemporaryFolder folder;
    writePair(folder / "t.png", {255, 10, 20, 40}, {0, 255, 30, 50});
    const auto alphas = [&](const std::string& map) {
        const auto model = objWith(folder, map);
        EXPECT_TRUE(model.notes.empty()) << model.notes[0];
        const auto& m = model.mesh.materials.at(model.mesh.triangleMaterial[0]);
        const auto& pixels = model.mesh.textures.at(m.baseColourTexture).pixels;
        return glm::ivec2(pixels.at(0, 0).a, pixels.at(1, 0).a);
    };
    EXPECT_EQ(alphas("map_d t.png\n"), glm::ivec2(40, 50));
    EXPECT_EQ(alphas("map_d -imfchan r t.png\n"), glm::ivec2(255, 0));
    EXPECT_EQ(alphas("map_d -imfchan g -clamp on t.png\n"), glm::ivec2(10, 255));
    EXPECT_EQ(alphas("map_d -imfchan m t.png\n"), glm::ivec2(40, 50));
    EXPECT_EQ(alphas("map_d -imfchan l t.png\n"), glm::ivec2(63, 185));
    EXPECT_EQ(alphas("map_Kd t.png\nmap_d -imfchan b t.png\n"), glm::ivec2(20, 30));
    EXPECT_EQ(alphas("map_Kd t.png\nmap_d t.png\n"), glm::ivec2(40, 50));
}

/// The normals at a place of a folded sheet, two faces along x = 0, after these lines.
std::vector<glm::vec3> normalsOfFold(const std::string& first, const std::string& second,
                                     glm::vec3 at) {
    const auto model =
        readGoodText("v -1 0 -1\nv 0 0 0\nv 0 1 0\nv -1 1 -1\nv 1 0 -1\nv 1 1 -1\nvt 0 0\n" +
                         first + "f 1 2 \\\n3/1 4\n" + second + "f -5 -2/1 -1 -4\n",
                     "a.obj");
    EXPECT_EQ(model.notes.size(), 1u) << "the model has no colour";
    std::vector<glm::vec3> normals;
    for (std::size_t i = 0; i < model.mesh.normals.size(); ++i)
        if (model.mesh.positions[i] == at) normals.push_back(model.mesh.normals[i]);
    return normals;
}

TEST(Obj, SmoothingGroupsHaveNormals) {
    const glm::vec3 fold(0, 0, 0), outside(1, 0, -1), front(0, 0, 1);
    const auto right = glm::normalize(glm::vec3(1, 0, 1)), left = right * glm::vec3(-1, 1, 1);
    const auto all = [&](const std::string& first, const std::string& second) {
        return normalsOfFold(first, second, fold);
    };
    const auto both = all("s 1\n", "");
    ASSERT_EQ(both.size(), 1u);
    expectNear(both[0], front);
    expectNear(normalsOfFold("s 1\n", "", outside).at(0), right);
    for (const std::string second : {"s off\n", "s 0\n", "s 2\n"}) {
        const auto apart = all("s 1\n", second);
        ASSERT_EQ(apart.size(), 2u) << second;
        expectNear(apart[0], left);
        expectNear(apart[1], right);
    }
    EXPECT_TRUE(all("s off\n", "s 0\n").empty());
    EXPECT_TRUE(all("", "").empty());
    EXPECT_EQ(all("s 1\nvn 0 1 0\n", "").size(), 0u) << "a file that has its own";
    // The two sides of a sheet.
    const auto sides =
        readGoodText("v 0 0 0\nv 1 0 0\nv 0 1 0\ns 1\nusemtl a#b\nf 1 2 3\nf 3 2 1\n", "a.obj");
    ASSERT_EQ(sides.mesh.normals.size(), 6u);
    expectNear(sides.mesh.normals[0], front);
    expectNear(sides.mesh.normals[5], -front);
    EXPECT_TRUE(sides.hasNote("material 'a#b'"));
}

TEST(Obj, FacesWithoutTextureCoordinatesBesideOthersAreSaid) {
    TemporaryFolder folder;
    writePair(folder / "t.png", {255, 0, 0, 255}, {0, 255, 0, 255});
    write(folder / "a.mtl", "newmtl a\nmap_Kd t.png\nnewmtl b\nKd 1 0 0\n");
    const auto notes = [&](const std::string& faces) {
        write(
            folder / "a.obj",
            "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl a\n" + faces);
        return readGood(folder / "a.obj").notes;
    };
    const auto mixed = notes("f 1/1 2/2 3/3\nf 1// 2// 3//\n");
    ASSERT_EQ(mixed.size(), 1u);
    EXPECT_EQ(mixed[0],
              "material 'a': some of its faces have no texture coordinates; they have the colour "
              "of its texture at 0 0");
    EXPECT_EQ(notes("f 1 2 3\nf 1/1 2/2 3/3\n").size(), 1u);
    EXPECT_TRUE(notes("f 1/1 2/2 3/3\nusemtl b\nf 1 2 3\nf 1/1 2/2 3/3\n").empty());
}

TEST(Mtl, OneValueIsAllThree) {
    TemporaryFolder folder;
    const auto grey = objWith(folder, "Kd 0.5\n");
    expectNear(glm::vec3(colourOf(grey.mesh)), glm::vec3(0.5f), 1e-4f);
    expectNear(glm::vec3(colourOf(objWith(folder, "Kd 0\nKe 0.25 # dim\n").mesh)), glm::vec3(0.25f),
               1e-4f);
    expectNear(glm::vec3(colourOf(objWith(folder, "Kd 0 1 0\r\n").mesh)), glm::vec3(0, 1, 0),
               1e-4f);
}

TEST(Mtl, HaloIsLeftOut) {
    TemporaryFolder folder;
    const auto model = objWith(folder, "Kd 1 0 0\nd -halo 0.25\n");
    EXPECT_TRUE(model.hasNote("material 'paint': option -halo of d is dropped"));
    EXPECT_FLOAT_EQ(colourOf(model.mesh).a, 0.25f);
    EXPECT_EQ(objWith(folder, "Kd 1 0 0\nd 0.5\n").notes.size(), 0u);
}

TEST(Mtl, SeveralFilesOnALine) {
    TemporaryFolder folder;
    write(folder / "one.mtl", "newmtl red\nKd 1 0 0");
    write(folder / "two b.mtl", "newmtl green\nKd 0 1 0\n");
    write(folder / "all of it.mtl x.mtl", "newmtl red\nKd 0 0 1\nnewmtl green\nKd 0 0 1\n");
    const auto coloursWith = [&](const std::string& names) {
        write(folder / "a.obj", "mtllib " + names +
                                    "\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n"
                                    "v 0 0 1\nv 1 0 1\nv 0 1 1\nusemtl green\nf 4 5 6\n");
        const auto model = readGood(folder / "a.obj");
        std::string colours;
        for (std::uint32_t i = 0; i < 2; ++i) {
            const auto c = MaterialSampler(model.mesh).colour(i, glm::vec3(1.0f / 3.0f));
            const bool grey = c.r > 0 && c.r < 1;
            colours += grey ? "grey " : fmt::format("{}{}{} ", c.r, c.g, c.b);
        }
        return colours + (model.notes.empty() ? "" : model.notes[0]);
    };
    EXPECT_EQ(coloursWith("one.mtl two b.mtl"), "100 010 ");
    EXPECT_EQ(coloursWith("two b.mtl  \tone.mtl"), "100 010 ");
    EXPECT_EQ(coloursWith("all of it.mtl x.mtl"), "001 001 ") << "one name that is there";
    EXPECT_EQ(coloursWith("one.mtl"),
              "100 111 material 'green' is in no material file; it has no colour");
    EXPECT_EQ(coloursWith("gone.mtl one.mtl"),
              "100 111 material 'green' is in no material file; it has no colour");
    EXPECT_EQ(coloursWith("gone.mtl lost.mtl"),
              "grey grey material file 'gone.mtl lost.mtl' cannot be read; its materials have no "
              "colour");
}

TEST(Mtl, TexturesAreThoseBesideTheirMaterialFile) {
    TemporaryFolder folder;
    for (const char* name : {"a", "b"}) {
        std::filesystem::create_directories(folder / name);
        write(folder / fmt::format("{0}/{0}.mtl", name),
              fmt::format("newmtl {}\nmap_Kd tex.png\n", name));
    }
    writePair(folder / "a/tex.png", {255, 0, 0, 255}, {255, 0, 0, 255});
    writePair(folder / "b/tex.png", {0, 0, 255, 255}, {0, 0, 255, 255});
    write(folder / "m.obj",
          "mtllib a/a.mtl\nmtllib b/b.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
          "usemtl a\nf 1/1 2/2 3/3\nusemtl b\nf 3/3 2/2 1/1\n");
    const auto model = readGood(folder / "m.obj");
    ASSERT_EQ(model.mesh.triangles.size(), 2u);
    EXPECT_TRUE(model.notes.empty()) << model.notes[0];
    const MaterialSampler sampler(model.mesh);
    EXPECT_EQ(sampler.colour(0, glm::vec3(1.0f / 3.0f)), glm::vec4(1, 0, 0, 1));
    EXPECT_EQ(sampler.colour(1, glm::vec3(1.0f / 3.0f)), glm::vec4(0, 0, 1, 1));
    // One that both name is opened once.
    writePair(folder / "tex.png", {0, 255, 0, 255}, {0, 255, 0, 255});
    EXPECT_EQ(readGood(folder / "m.obj").mesh.textures.size(), 1u);
}

TEST(Obj, MaterialsThatNoFileHasAreSaidOnce) {
    const std::string triangles =
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\nusemtl a\nf 3 2 1\n";
    const auto notes = readGoodText(triangles, "a.obj").notes;
    ASSERT_EQ(notes.size(), 2u) << "and that the model has no colour";
    EXPECT_EQ(notes[0], "2 materials, 'a' the first, are in no material file; they have no colour");
}

TEST(Mtl, ScaleAndOffsetOfATextureMoveItsCoordinates) {
    TemporaryFolder folder;
    writePair(folder / "t.png", {255, 0, 0, 255}, {0, 255, 0, 255});
    const auto model = objWith(folder, "map_Kd -s 2 3 1 -o 0.5 0.25 0 t.png\n");
    ASSERT_EQ(model.mesh.uvs.size(), 3u);
    expectNear(model.mesh.uvs[0], glm::vec2(0.5f, 0.75f));
    expectNear(model.mesh.uvs[1], glm::vec2(2.5f, 0.75f));
    expectNear(model.mesh.uvs[2], glm::vec2(0.5f, -2.25f));
    EXPECT_TRUE(model.notes.empty()) << model.notes[0];
}

TEST(Mtl, VAndWOfAnOptionMayBeLeftOut) {
    TemporaryFolder folder;
    writePair(folder / "a.png", {255, 0, 0, 255}, {0, 255, 0, 255});
    writePair(folder / "my -s 2 b.png", {255, 0, 0, 255}, {0, 255, 0, 255});
    const auto corner = [&](const std::string& map) {
        const auto model = objWith(folder, "map_Kd " + map + "\n");
        EXPECT_EQ(model.mesh.textures.size(), 1u) << map;
        EXPECT_TRUE(model.notes.empty()) << map << ": " << model.notes[0];
        for (const auto& uv : model.mesh.uvs)
            if (uv.x != model.mesh.uvs[0].x && uv.y == model.mesh.uvs[0].y) return uv;
        return glm::vec2(-1);
    };
    EXPECT_EQ(corner("a.png"), glm::vec2(1, 1));
    EXPECT_EQ(corner("-s 2 a.png"), glm::vec2(2, 1));
    EXPECT_EQ(corner("-s 2 3 a.png"), glm::vec2(2, 1));
    EXPECT_EQ(corner("-o .25 a.png"), glm::vec2(1.25, 1));
    EXPECT_EQ(corner("-o 0.25 -0.5 a.png"), glm::vec2(1.25, 1.5));
    EXPECT_EQ(corner("-clamp off -s 2 -o\t0.25  0.5 -bm 1 a.png"), glm::vec2(2.25, 0.5));
    EXPECT_EQ(corner("-s 2 2 2 -o 1 1 1 a.png"), glm::vec2(3, 0));
    EXPECT_EQ(corner("-s +2 a.png"), glm::vec2(2, 1));
    EXPECT_EQ(corner("-cc on -s 2 -texres 64 -blendu on a.png"), glm::vec2(2, 1));
    EXPECT_EQ(corner("-s 2 my -s 2 b.png"), glm::vec2(2, 1));
}

TEST(Mtl, EmissionShines) {
    TemporaryFolder folder;
    expectNear(glm::vec3(colourOf(objWith(folder, "Kd 0 0 0\nKe 1 0.5 0\n").mesh)),
               glm::vec3(1, 0.5f, 0), 1e-3f);
    writePair(folder / "glow.png", {0, 0, 255, 255}, {0, 0, 255, 255});
    expectNear(glm::vec3(colourOf(objWith(folder, "Kd 0 1 0\nmap_Ke glow.png\n").mesh)),
               glm::vec3(0, 1, 1), 1e-3f);
}

}  // namespace
}  // namespace stx

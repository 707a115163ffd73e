#include <array>
#include <cmath>
#include <cstdlib>

#include <meshoptimizer.h>

#include "formats/images/images.hpp"
#include "lib/capture/material_sampler.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/meshes/models.hpp"

namespace stx {
namespace {

TEST(GltfUnlit, IsSaidByTheMaterial) {
    GltfText gltf;
    gltf.addQuad();
    gltf.root["extensionsUsed"] = {"KHR_materials_unlit"};
    gltf.root["materials"] = {
        {{"extensions", {{"KHR_materials_unlit", nlohmann::json::object()}}}}};
    gltf.primitive()["material"] = 0;
    EXPECT_TRUE(readGoodText(gltf.text(), "a.gltf").mesh.materials.at(0).unlit);
    gltf.root["materials"][0].erase("extensions");
    EXPECT_FALSE(readGoodText(gltf.text(), "a.gltf").mesh.materials.at(0).unlit);
}

TEST(GltfEmission, IsAddedWithItsMapAndStrength) {
    GltfText gltf;
    gltf.addQuad();
    gltf.root["materials"] = {
        {{"pbrMetallicRoughness", {{"baseColorFactor", {0, 0, 0, 1}}}},
         {"emissiveFactor", {0.25, 0.0, 0.0}},
         {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 2.0}}}}}}};
    gltf.primitive()["material"] = 0;
    const auto plain = readGoodText(gltf.text(), "a.gltf");
    EXPECT_NEAR(colourOf(plain.mesh).r, srgbFromLinear(0.5f), 1e-3f);
    EXPECT_TRUE(plain.notes.empty()) << plain.notes[0];
    gltf.addTexture();
    gltf.root["materials"][0]["emissiveFactor"] = {1, 1, 1};
    gltf.root["materials"][0].erase("extensions");
    gltf.root["materials"][0]["emissiveTexture"] = {{"index", 0}};
    const auto mapped = readGoodText(gltf.text(), "a.gltf");
    const MaterialSampler sampler(mapped.mesh);
    // u = 1/4 is the middle of the left of its two texels, which is red.
    expectNear(glm::vec3(sampler.colour(0, {0.75f, 0.125f, 0.125f})), glm::vec3(1, 0, 0), 1e-3f);
}

TEST(GltfMeshopt, AttributesAndIndicesAreUnpacked) {
    GltfText gltf;
    gltf.addQuad();
    const auto plain = readGoodText(gltf.text(), "a.gltf");
    const std::vector<float> positions = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
    const std::vector<unsigned> indices = {0, 1, 2, 0, 2, 3};
    std::vector<unsigned char> vertexBytes(meshopt_encodeVertexBufferBound(4, 12));
    vertexBytes.resize(meshopt_encodeVertexBuffer(vertexBytes.data(), vertexBytes.size(),
                                                  positions.data(), 4, 12));
    std::vector<unsigned char> indexBytes(meshopt_encodeIndexBufferBound(6, 4));
    indexBytes.resize(
        meshopt_encodeIndexBuffer(indexBytes.data(), indexBytes.size(), indices.data(), 6));
    std::vector<unsigned char> listBytes(meshopt_encodeIndexSequenceBound(6, 4));
    listBytes.resize(
        meshopt_encodeIndexSequence(listBytes.data(), listBytes.size(), indices.data(), 6));
    for (const bool triangles : {true, false}) {
        GltfText packed;
        const auto add = [&](const std::vector<unsigned char>& bytes, int count, int stride,
                             const char* mode) {
            const int from = packed.view(bytes);
            auto view = packed.root["bufferViews"][static_cast<std::size_t>(from)];
            view["count"] = count;
            view["byteStride"] = stride;
            view["mode"] = mode;
            packed.root["bufferViews"].push_back(
                {{"buffer", 1},
                 {"byteLength", count * stride},
                 {"extensions", {{"EXT_meshopt_compression", view}}}});
            return static_cast<int>(packed.root["bufferViews"].size()) - 1;
        };
        const int v = add(vertexBytes, 4, 12, "ATTRIBUTES");
        const int i =
            triangles ? add(indexBytes, 6, 2, "TRIANGLES") : add(listBytes, 6, 2, "INDICES");
        const int p = packed.accessor(
            {{"bufferView", v}, {"componentType", 5126}, {"type", "VEC3"}, {"count", 4}});
        const int x = packed.accessor(
            {{"bufferView", i}, {"componentType", 5123}, {"type", "SCALAR"}, {"count", 6}});
        packed.root["meshes"][0]["primitives"].push_back(
            {{"attributes", {{"POSITION", p}}}, {"indices", x}});
        packed.root["extensionsRequired"] = {"EXT_meshopt_compression"};
        const auto model = readGoodText(packed.text(), "a.gltf");
        EXPECT_EQ(model.mesh.positions, plain.mesh.positions);
        EXPECT_EQ(model.mesh.triangles.size(), 2u);
        // Claims are held against the data.
        for (const auto& [key, value] : {std::pair{"count", nlohmann::json(4000000000u)},
                                         {"byteStride", 3},
                                         {"mode", "X"},
                                         {"filter", "OCTAHEDRAL"},
                                         {"byteLength", 5}}) {
            auto broken = packed;
            broken.root["bufferViews"][static_cast<std::size_t>(v)]["extensions"]
                       ["EXT_meshopt_compression"][key] = value;
            EXPECT_NE(readBadText(broken.text(), "a.gltf").text().find("EXT_meshopt_compression"),
                      std::string::npos)
                << key;
        }
    }
}

TEST(GltfBasis, IsSaidAndGivesThePlainColour) {
    GltfText gltf;
    gltf.addQuad();
    gltf.root["images"] = {{{"uri", "t.ktx2"}, {"mimeType", "image/ktx2"}}};
    gltf.root["textures"] = {{{"extensions", {{"KHR_texture_basisu", {{"source", 0}}}}}}};
    gltf.root["materials"] = {
        {{"pbrMetallicRoughness",
          {{"baseColorFactor", {1, 0, 0, 1}}, {"baseColorTexture", {{"index", 0}}}}}}};
    gltf.root["extensionsUsed"] = {"KHR_texture_basisu"};
    gltf.primitive()["material"] = 0;
    const auto model = readGoodText(gltf.text(), "a.gltf");
    EXPECT_TRUE(model.hasNote("Basis Universal"));
    expectNear(glm::vec3(colourOf(model.mesh)), glm::vec3(1, 0, 0), 1e-3f);
    // What requires it must not be shown without (glTF 2.0, 3.12).
    gltf.root["extensionsRequired"] = {"KHR_texture_basisu"};
    const auto error = readBadText(gltf.text(), "a.gltf");
    EXPECT_EQ(error.code, ErrorCode::unsupported);
    EXPECT_EQ(error.message,
              "textures[0] needs the glTF extension KHR_texture_basisu, which the file requires "
              "and which is not drawn here; export PNG or JPEG textures, or give one with "
              "--texture");
}

TEST(MoreFormats, OffColladaAndFbx) {
    const auto off =
        readGoodText("OFF\n4 2 0\n0 0 0\n2 0 0\n2 2 0\n0 2 0\n3 0 1 2\n3 0 2 3\n", "a.off");
    EXPECT_EQ(off.mesh.triangles.size(), 2u);
    EXPECT_EQ(off.mesh.bounds().max, glm::dvec3(2, 2, 0));
    if (std::system("command -v assimp > /dev/null") != 0) GTEST_SKIP() << "no assimp program here";
    TemporaryFolder folder;
    objWith(folder, "Kd 1 0 0\n");
    // Its binary FBX is not what it can read itself, so text.
    for (const auto& [ending, format] : {std::pair{"dae", "collada"}, {"fbx", "fbxa"}}) {
        const auto file = folder / fmt::format("a.{}", ending);
        ASSERT_EQ(std::system(fmt::format("assimp export '{}' '{}' -f{} > /dev/null 2>&1",
                                          (folder / "a.obj").string(), file.string(), format)
                                  .c_str()),
                  0);
        const auto model = readGood(file);
        EXPECT_EQ(model.mesh.triangles.size(), 1u) << ending;
        // Assimp writes no unit into FBX, where that is a centimetre.
        const double unit = std::string_view(ending) == "fbx" ? 0.01 : 1.0;
        EXPECT_NEAR(model.mesh.bounds().radius() / unit, std::sqrt(2.0) / 2, 1e-5) << ending;
        expectNear(glm::vec3(colourOf(model.mesh)), glm::vec3(1, 0, 0), 1e-2f);
    }
}

/// A quad of COLLADA with `transparency` in its effect.
ReadModel daeWith(const std::string& transparency) {
    return readGoodText(
        R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset/>
<library_effects><effect id="e"><profile_COMMON><technique sid="c"><lambert>
<diffuse><color>0.2 0.5 0.8 1</color></diffuse>)" +
            transparency + R"(</lambert></technique></profile_COMMON></effect></library_effects>
<library_materials><material id="m" name="glass"><instance_effect url="#e"/></material>
</library_materials><library_geometries><geometry id="g"><mesh><source id="p">
<float_array id="a" count="9">0 0 0 1 0 0 0 1 0</float_array><technique_common>
<accessor source="#a" count="3" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices><triangles material="mm"
count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles></mesh>
</geometry></library_geometries><library_visual_scenes><visual_scene id="s"><node>
<instance_geometry url="#g"><bind_material><technique_common><instance_material symbol="mm"
target="#m"/></technique_common></bind_material></instance_geometry></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>)",
        "a.dae");
}

TEST(Collada, TranslucencyIsAlpha) {
    const auto alpha = [](const std::string& mode, const std::string& colour,
                          const std::string& transparency) {
        const auto model = daeWith("<transparent" + mode + "><color>" + colour +
                                   "</color></transparent><transparency><float>" + transparency +
                                   "</float></transparency>");
        EXPECT_TRUE(model.notes.empty()) << model.notes[0];
        return colourOf(model.mesh).a;
    };
    EXPECT_FLOAT_EQ(alpha("", "1 1 1 1", "0.5"), 0.5f);
    EXPECT_FLOAT_EQ(alpha(" opaque=\"A_ONE\"", "0 0 0 0.5", "1"), 0.5f);
    EXPECT_FLOAT_EQ(alpha(" opaque=\"RGB_ZERO\"", "1 1 1 1", "0.25"), 0.75f);
    EXPECT_FLOAT_EQ(alpha(" opaque=\"RGB_ZERO\"", "0 0 0 1", "1"), 1.0f);
    const auto unseen = daeWith("<transparency><float>0</float></transparency>");
    EXPECT_TRUE(unseen.hasNote("material 'glass' would be invisible; it is taken as opaque"));
    const auto picture = daeWith(
        "<transparent opaque=\"RGB_ZERO\"><texture texture=\"t.png\" texcoord=\"x\"/>"
        "</transparent><transparency><float>1</float></transparency>");
    ASSERT_EQ(picture.notes.size(), 1u);
    EXPECT_EQ(picture.notes[0], "material 'glass': its opacity map is dropped");
    EXPECT_FLOAT_EQ(colourOf(picture.mesh).a, 1.0f);
}

/// A triangle of FBX, as text, with `properties` in its material.
ReadModel fbxWith(const std::string& properties) {
    return readGoodText(
        R"(; FBX 7.4.0 project file
FBXHeaderExtension:  {
	FBXVersion: 7400
}
Objects:  {
	Geometry: 10, "Geometry::g", "Mesh" {
		Vertices: *9 {
			a: 0,0,0,1,0,0,0,1,0
		}
		PolygonVertexIndex: *3 {
			a: 0,1,-3
		}
		LayerElementMaterial: 0 {
			MappingInformationType: "AllSame"
			ReferenceInformationType: "IndexToDirect"
			Materials: *1 {
				a: 0
			}
		}
		Layer: 0 {
			LayerElement:  {
				Type: "LayerElementMaterial"
				TypedIndex: 0
			}
		}
	}
	Model: 20, "Model::q", "Mesh" {
		Version: 232
	}
	Material: 30, "Material::m", "" {
		ShadingModel: "phong"
		Properties70:  {
			P: "DiffuseColor", "Color", "", "A",0.2,0.5,0.8
)" + properties +
            R"(
		}
	}
}
Connections:  {
	C: "OO",20,0
	C: "OO",10,20
	C: "OO",30,20
}
)",
        "a.fbx");
}

TEST(Fbx, TranslucencyIsAlpha) {
    const std::string factor = R"(P: "TransparencyFactor", "Number", "", "A",)";
    const std::string colour = R"(P: "TransparentColor", "Color", "", "A",)";
    const std::string opacity = R"(P: "Opacity", "double", "Number", "",)";
    EXPECT_FLOAT_EQ(colourOf(fbxWith("").mesh).a, 1.0f);
    const auto maya = fbxWith(colour + "0.25,0.25,0.25\n" + factor + "1\n" + opacity + "0.75");
    EXPECT_FLOAT_EQ(colourOf(maya.mesh).a, 0.75f);
    EXPECT_FLOAT_EQ(colourOf(fbxWith(colour + "1,1,1\n" + factor + "0.25").mesh).a, 0.75f);
    EXPECT_FLOAT_EQ(colourOf(fbxWith(colour + "1,1,1\n" + factor + "0").mesh).a, 1.0f);
}

TEST(MoreFormats, DeepNestingAndLargeClaimsAreRefused) {
    std::string deep = "<?xml version=\"1.0\"?><COLLADA>";
    for (int i = 0; i < 100000; ++i) deep += "<node>";
    EXPECT_NE(readBadText(deep, "a.dae").text().find("nested deeper than 256"), std::string::npos);
    std::string braces = "; FBX 7.3.0 project file\n";
    for (int i = 0; i < 100000; ++i) braces += "A: {\n";
    EXPECT_NE(readBadText(braces, "a.fbx").text().find("nested deeper"), std::string::npos);
    const auto number = [](std::uint32_t value) {
        return std::string(reinterpret_cast<const char*>(&value), 4);
    };
    const std::string header = std::string("Kaydara FBX Binary  \0\x1a\0", 23) + number(7400);
    // Records inside of records: end, no properties, no name.
    std::string nested = header;
    for (int i = 0; i < 1000; ++i) nested += number(27 + 13 * 1000) + number(0) + number(0) + '\0';
    EXPECT_NE(readBadText(nested, "a.fbx").text().find("nested deeper"), std::string::npos);
    // An array of 2^31 doubles in 4 packed bytes.
    const std::string array = "d" + number(1u << 31) + number(1) + number(4) + "abcd";
    const std::string record = number(27 + 13 + static_cast<std::uint32_t>(array.size())) +
                               number(1) + number(static_cast<std::uint32_t>(array.size())) + '\0' +
                               array;
    EXPECT_NE(readBadText(header + record, "a.fbx").text().find("memory limit"), std::string::npos);
}

TEST(MoreFormats, WhatCrashesAReaderIsAnError) {
    // Assimp 5.2.5 does not check the indices of COLLADA's triangles.
    const std::string collada =
        "<?xml version=\"1.0\"?><COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" "
        "version=\"1.4.1\"><library_geometries><geometry id=\"g\"><mesh><source id=\"p\">"
        "<float_array id=\"a\" count=\"9\">0 0 0 1 0 0 0 1 0</float_array><technique_common>"
        "<accessor source=\"#a\" count=\"900000000\" stride=\"3\"><param name=\"X\" "
        "type=\"float\"/><param name=\"Y\" type=\"float\"/><param name=\"Z\" type=\"float\"/>"
        "</accessor></technique_common></source><vertices id=\"v\"><input semantic=\"POSITION\" "
        "source=\"#p\"/></vertices><triangles count=\"1\"><input semantic=\"VERTEX\" "
        "source=\"#v\" offset=\"0\"/><p>0 1 800000000</p></triangles></mesh></geometry>"
        "</library_geometries><library_visual_scenes><visual_scene id=\"s\"><node>"
        "<instance_geometry url=\"#g\"/></node></visual_scene></library_visual_scenes><scene>"
        "<instance_visual_scene url=\"#s\"/></scene></COLLADA>";
    EXPECT_NE(readBadText(collada, "a.dae").text().find("'a.dae'"), std::string::npos);
    EXPECT_NE(readBadText(collada.substr(0, 900), "a.dae").text().find("'a.dae'"),
              std::string::npos);
}

TEST(Colourless, ModelsAreGreyWithANote) {
    const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    const auto grey = readGoodText(triangle, "a.obj");
    EXPECT_NEAR(colourOf(grey.mesh).r, 188.0 / 255, 2e-3);
    EXPECT_TRUE(grey.hasNote("the model has no colour"));
    const auto coloured =
        readGoodText("v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\nf 1 2 3\n", "a.obj");
    expectNear(glm::vec3(colourOf(coloured.mesh)), glm::vec3(1, 0, 0), 1e-3f);
    EXPECT_FALSE(coloured.hasNote("colour"));
    TemporaryFolder folder;
    const auto white = objWith(folder, "Kd 1 1 1\n");
    EXPECT_NEAR(colourOf(white.mesh).r, 1.0, 1e-3) << "white is a colour when it is given";
    writePair(folder / "mine.png", {9, 9, 9, 255}, {9, 9, 9, 255});
    const auto textured = readGood(folder / "a.obj", {folder / "mine.png"});
    EXPECT_NEAR(colourOf(textured.mesh).r, 9.0 / 255, 1e-3);
}

std::string plyOf(const std::string& properties, const std::string& values) {
    return "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty "
           "float z\n" +
           properties + "end_header\n0 0 0 " + values + "\n1 0 0 " + values + "\n";
}

TEST(Ply, WhatIsDroppedIsSaid) {
    const auto scan = readGoodText(
        plyOf("property float intensity\nproperty uchar red\nproperty uchar green\nproperty uchar "
              "blue\nproperty uchar alpha\nproperty float quality\n",
              "0.5 255 0 0 128 1"),
        "a.ply");
    EXPECT_TRUE(scan.hasNote("dropped: PLY properties of vertices (intensity, quality)"));
    EXPECT_TRUE(scan.hasNote("dropped: the alpha of PLY colours"));
    const auto splats = readGoodText(
        plyOf("property float f_dc_0\nproperty float f_dc_1\nproperty float f_dc_2\nproperty float "
              "opacity\nproperty float scale_0\n",
              "1.7724539 0 -1.7724539 2 0.1"),
        "a.ply");
    EXPECT_TRUE(splats.hasNote("Gaussian splats"));
    EXPECT_FALSE(splats.hasNote("scale_0"));
    ASSERT_EQ(splats.mesh.colours.size(), 2u);
    EXPECT_NEAR(splats.mesh.colours[0].r, 1.0f, 1e-4f);
    EXPECT_NEAR(splats.mesh.colours[0].g, linearFromSrgb(0.5f), 1e-4f);
    EXPECT_NEAR(splats.mesh.colours[0].b, 0.0f, 1e-4f);
}

TEST(Ply, ColoursOf16BitsThatAreBytesAreTakenForThem) {
    const auto greyOf = [](const std::string& values) {
        return readGoodText(plyOf("property ushort red\nproperty ushort green\nproperty ushort "
                                  "blue\nproperty ushort alpha\n",
                                  values),
                            "a.ply");
    };
    const auto bytes = greyOf("0 128 255 255");
    ASSERT_EQ(bytes.mesh.colours.size(), 2u);
    EXPECT_NEAR(bytes.mesh.colours[0].g, linearFromSrgb(128 / 255.0f), 1e-4f);
    EXPECT_NEAR(bytes.mesh.colours[0].b, 1.0f, 1e-4f);
    // Their alpha is full.
    EXPECT_EQ(bytes.notes, std::vector<std::string>{
                               "the 16-bit colours of the PLY file reach 255 of 65535 only: they "
                               "are taken for 8 bits, 0 to 255"});
    const auto deep = greyOf("0 128 32768 65535");
    ASSERT_EQ(deep.mesh.colours.size(), 2u);
    EXPECT_NEAR(deep.mesh.colours[0].g, linearFromSrgb(128 / 65535.0f), 1e-5f);
    EXPECT_NEAR(deep.mesh.colours[0].b, linearFromSrgb(32768 / 65535.0f), 1e-4f);
    EXPECT_TRUE(deep.notes.empty()) << deep.notes[0];
    const auto faces = readGoodText(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
        "float z\nelement face 1\nproperty list uchar int vertex_indices\nproperty ushort red\n"
        "property ushort green\nproperty ushort blue\nend_header\n"
        "0 0 0\n1 0 0\n1 1 0\n3 0 1 2 0 200 100\n",
        "a.ply");
    ASSERT_FALSE(faces.mesh.colours.empty());
    EXPECT_NEAR(faces.mesh.colours[0].g, linearFromSrgb(200 / 255.0f), 1e-4f);
    EXPECT_TRUE(faces.hasNote("reach 200 of 65535 only"));
}

// Two faces of a roof share two vertices, whose normals are no directions.
TEST(BrokenNormals, OfVerticesThatFacesShareAreThoseOfEachFace) {
    const float h = std::sqrt(0.5f);
    const auto roof = readGoodText(
        fmt::format("ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
                    "property float z\nproperty float nx\nproperty float ny\nproperty float nz\n"
                    "property uchar red\nproperty uchar green\nproperty uchar blue\n"
                    "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
                    "-1 0 0 {0} 0 {1} 255 0 0\n0 -1 1 0 0 0 0 255 0\n0 1 1 0 0 0 0 0 255\n"
                    "1 0 0 {1} 0 {1} 255 255 255\n3 0 1 2\n3 3 2 1\n",
                    -h, h),
        "a.ply");
    EXPECT_TRUE(roof.hasNote("PLY: 2 normals are no directions; those of the triangles are used"));
    const Mesh& mesh = roof.mesh;
    ASSERT_EQ(mesh.triangles.size(), 2u);
    ASSERT_EQ(mesh.positions.size(), 6u);
    ASSERT_EQ(mesh.colours.size(), 6u);
    for (const auto& t : mesh.triangles) {
        const float side = mesh.positions[t[0]].x;
        for (int k = 0; k < 3; ++k) {
            EXPECT_LT(glm::length(mesh.normals[t[k]] - glm::vec3(side * h, 0, h)), 1e-5f);
            const glm::vec3 at = mesh.positions[t[k]];
            if (at.x == 0) {
                EXPECT_EQ(mesh.colours[t[k]].g, at.y < 0 ? 1.0f : 0.0f);
            }
        }
    }
}

}  // namespace
}  // namespace stx

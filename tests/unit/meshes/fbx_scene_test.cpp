#include "formats/meshes/fbx_elements.hpp"
#include "tests/unit/meshes/models.hpp"

namespace stx {
namespace {

// Pictures of one pixel.
constexpr const char* kRed =
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP4z8AAAAMBAQDJ/pLvAAAAAElFTkSuQmCC";
constexpr const char* kBlue =
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGNgYPgPAAEDAQAIicLsAAAAAElFTkSuQmCC";

/// Assimp takes values by the names of their types.
std::string property(const std::string& name, const std::string& values) {
    const auto type = name.starts_with("Lcl ")                   ? name
                      : values.find(',') != std::string::npos    ? "Vector3D"
                      : name.find("Factor") != std::string::npos ? "Number"
                                                                 : "enum";
    return fmt::format("\t\t\tP: \"{}\", \"{}\", \"\", \"A\",{}\n", name, type, values);
}

std::string objectOf(const std::string& kind, int id, const std::string& name,
                     const std::string& what, const std::string& properties = "",
                     const std::string& content = "") {
    return fmt::format(
        "\t{0}: {1}, \"{0}::{2}\", \"{3}\" {{\n\t\tVersion: 100\n\t\tProperties70:  {{\n{4}"
        "\t\t}}\n{5}\t}}\n",
        kind, id, name, what, properties, content);
}

std::string modelOf(int id, const std::string& name, const std::string& properties = "",
                    const std::string& what = "Mesh") {
    return objectOf("Model", id, name, what, properties);
}

std::string at(int x) {
    return property("Lcl Translation", fmt::format("{},0,0", x));
}

/// A triangle (0, 0, 0), (1, 0, 0), (0, 1, 0) with these as texture coordinates, too.
std::string geometryOf(int id, const std::string& content = "") {
    return fmt::format(
        R"(	Geometry: {0}, "Geometry::g{0}", "Mesh" {{
		Vertices: *9 {{
			a: 0,0,0,1,0,0,0,1,0
		}}
		PolygonVertexIndex: *3 {{
			a: 0,1,-3
		}}
		GeometryVersion: 124
		LayerElementUV: 0 {{
			Version: 101
			Name: "uv"
			MappingInformationType: "ByPolygonVertex"
			ReferenceInformationType: "Direct"
			UV: *6 {{
				a: 0,0,1,0,0,1
			}}
		}}
		LayerElementMaterial: 0 {{
			Version: 101
			Name: ""
			MappingInformationType: "AllSame"
			ReferenceInformationType: "IndexToDirect"
			Materials: *1 {{
				a: 0
			}}
		}}
{1}		Layer: 0 {{
			Version: 100
			LayerElement:  {{
				Type: "LayerElementMaterial"
				TypedIndex: 0
			}}
			LayerElement:  {{
				Type: "LayerElementUV"
				TypedIndex: 0
			}}
		}}
	}}
)",
        id, content);
}

/// A skin `id` with a cluster `id` + 1, whose bone has all of a geometry's vertices.
std::string skinOf(int id) {
    const std::string identity = "*16 {\n\t\t\ta: 1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1\n\t\t}\n";
    return objectOf("Deformer", id, "s", "Skin") +
           fmt::format(
               "\tDeformer: {}, \"SubDeformer::c\", \"Cluster\" {{\n\t\tVersion: 100\n"
               "\t\tIndexes: *3 {{\n\t\t\ta: 0,1,2\n\t\t}}\n\t\tWeights: *3 {{\n\t\t\ta: 1,1,1\n"
               "\t\t}}\n\t\tTransform: {}\t\tTransformLink: {}\t}}\n",
               id + 1, identity, identity);
}

std::string textureOf(int id, const std::string& relative, const std::string& properties = "",
                      const std::string& full = "") {
    return objectOf("Texture", id, "t", "", properties,
                    fmt::format("\t\tFileName: \"{}\"\n\t\tRelativeFilename: \"{}\"\n",
                                full.empty() ? relative : full, relative));
}

std::string videoOf(int id, const std::string& name, const std::string& picture) {
    return fmt::format(
        "\tVideo: {}, \"Video::v\", \"Clip\" {{\n\t\tType: \"Clip\"\n\t\tFileName: \"{}\"\n"
        "\t\tRelativeFilename: \"{}\"\n\t\tContent: , \"{}\"\n\t}}\n",
        id, name, name, picture);
}

struct Connection {
    int from = 0, to = 0;
    std::string property{};
};

std::string fbxText(const std::string& objects, const std::vector<Connection>& connections) {
    std::string text =
        "; FBX 7.4.0 project file\nFBXHeaderExtension:  {\n\tFBXVersion: 7400\n}\n"
        "GlobalSettings:  {\n\tVersion: 1000\n\tProperties70:  {\n" +
        property("UnitScaleFactor", "100") + "\t}\n}\nObjects:  {\n" + objects +
        "}\nConnections:  {\n";
    for (const auto& [from, to, name] : connections)
        text += fmt::format("\tC: \"{}\",{},{}{}\n", name.empty() ? "OO" : "OP", from, to,
                            name.empty() ? "" : fmt::format(", \"{}\"", name));
    return text + "}\n";
}

ReadModel readFbx(const std::string& objects, const std::vector<Connection>& connections) {
    return readGoodText(fbxText(objects, connections), "a.fbx");
}

std::vector<float> xsOf(const Mesh& mesh) {
    std::vector<float> xs;
    for (const auto& p : mesh.positions) xs.push_back(p.x);
    return xs;
}

TEST(FbxScene, BonesAreThoseOfTheirSkinWhateverTheirNames) {
    const auto two = readFbx(geometryOf(10) + geometryOf(11) + modelOf(20, "a") + modelOf(22, "b") +
                                 skinOf(70) + skinOf(75) + modelOf(21, "Hips", at(5), "LimbNode") +
                                 modelOf(23, "Hips", at(7), "LimbNode"),
                             {{20, 0},
                              {22, 0},
                              {21, 0},
                              {23, 0},
                              {10, 20},
                              {11, 22},
                              {70, 10},
                              {75, 11},
                              {71, 70},
                              {76, 75},
                              {21, 71},
                              {23, 76}});
    EXPECT_EQ(xsOf(two.mesh), std::vector<float>({5, 6, 5, 7, 8, 7}));
    EXPECT_TRUE(two.notes.empty() || !two.hasNote("bone"));
    const auto asMesh = readFbx(
        geometryOf(10) + modelOf(20, "Head") + skinOf(70) + modelOf(21, "Head", at(5), "LimbNode"),
        {{20, 0}, {21, 0}, {10, 20}, {70, 10}, {71, 70}, {21, 71}});
    EXPECT_EQ(xsOf(asMesh.mesh), std::vector<float>({5, 6, 5}));
}

TEST(FbxScene, GeometricTransformsMoveSkins) {
    const auto model =
        readFbx(geometryOf(10) + modelOf(20, "a", property("GeometricTranslation", "3,0,0")) +
                    skinOf(70) + modelOf(21, "bone", at(5), "LimbNode"),
                {{20, 0}, {21, 0}, {10, 20}, {70, 10}, {71, 70}, {21, 71}});
    EXPECT_EQ(xsOf(model.mesh), std::vector<float>({8, 9, 8}));
}

TEST(FbxScene, HiddenObjectsAndLowerLevelsAreLeftOut) {
    const auto with = [](const std::string& hides, const std::string& own = "") {
        return readFbx(geometryOf(10) + geometryOf(11) + modelOf(20, "a") +
                           modelOf(21, "group", hides, "Null") + modelOf(22, "b", at(5) + own),
                       {{20, 0}, {21, 0}, {22, 21}, {10, 20}, {11, 22}});
    };
    const std::vector<float> first = {0, 1, 0}, both = {0, 1, 0, 5, 6, 5};
    const char* note = "dropped: hidden meshes and lower levels of detail (1)";
    EXPECT_EQ(xsOf(with("").mesh), both);
    EXPECT_EQ(xsOf(with("", property("Visibility", "0")).mesh), first);
    EXPECT_EQ(xsOf(with("", property("Show", "0")).mesh), first);
    EXPECT_TRUE(with("", property("Show", "0")).hasNote(note));
    // Visibility is inherited, but for where a model says that it does not; Show is not.
    EXPECT_EQ(xsOf(with(property("Visibility", "0")).mesh), first);
    EXPECT_EQ(xsOf(with(property("Visibility", "0"), property("Visibility Inheritance", "0")).mesh),
              both);
    EXPECT_EQ(xsOf(with(property("Show", "0")).mesh), both);

    const auto levels =
        readFbx(geometryOf(10) + geometryOf(11) + modelOf(19, "levels", "", "LodGroup") +
                    modelOf(20, "a") + modelOf(21, "b", at(5)),
                {{19, 0}, {20, 19}, {21, 19}, {10, 20}, {11, 21}});
    EXPECT_EQ(xsOf(levels.mesh), first);
    EXPECT_TRUE(levels.hasNote(note));

    EXPECT_EQ(readBadText(fbxText(geometryOf(10) + modelOf(20, "a", property("Visibility", "0")),
                                  {{20, 0}, {10, 20}}),
                          "a.fbx")
                  .text(),
              "'a.fbx': all meshes of the model are hidden (Visibility or Show is 0); show what is "
              "wanted before the file is saved");
}

TEST(FbxScene, PicturesInsideAreTheirTexturesOwn) {
    // Two triangles with a material, a texture and a picture inside each.
    const auto read = [](const std::string& second, const std::string& videos,
                         const std::vector<Connection>& ofVideos) {
        std::vector<Connection> all = {{20, 0},
                                       {21, 0},
                                       {10, 20},
                                       {11, 21},
                                       {30, 20},
                                       {31, 21},
                                       {40, 30, "DiffuseColor"},
                                       {41, 31, "DiffuseColor"}};
        all.insert(all.end(), ofVideos.begin(), ofVideos.end());
        return readFbx(geometryOf(10) + geometryOf(11) + modelOf(20, "a") + modelOf(21, "b") +
                           objectOf("Material", 30, "m", "") + objectOf("Material", 31, "n", "") +
                           textureOf(40, "C:/head/t.png") + textureOf(41, second) + videos,
                       all);
    };
    const std::string head = videoOf(50, "C:/head/t.png", kRed);
    const auto model =
        read("C:/body/t.png", head + videoOf(51, "C:/body/t.png", kBlue), {{50, 40}, {51, 41}});
    ASSERT_EQ(model.mesh.textures.size(), 2u);
    EXPECT_EQ(model.mesh.textures[0].pixels.at(0, 0), glm::u8vec4(255, 0, 0, 255));
    EXPECT_EQ(model.mesh.textures[1].pixels.at(0, 0), glm::u8vec4(0, 0, 255, 255));
    // A file of the same name outside stays one.
    const auto outside = read("body/t.png", head, {{50, 40}});
    EXPECT_EQ(outside.mesh.textures.size(), 1u);
    EXPECT_TRUE(outside.hasNote("texture 'body/t.png'"));
}

/// A triangle whose material has a texture by this property.
ReadModel textured(const std::string& property, const std::string& ofTexture = "",
                   const std::string& ofMaterial = "") {
    return readFbx(geometryOf(10) + modelOf(20, "a") +
                       objectOf("Material", 30, "m", "", ofMaterial) +
                       textureOf(40, "t.png", ofTexture) + videoOf(50, "t.png", kRed),
                   {{20, 0}, {10, 20}, {30, 20}, {40, 30, property}, {50, 40}});
}

TEST(FbxScene, TexturesOfPhysicalMaterialsAreRead) {
    for (const char* name : {"DiffuseColor", "3dsMax|Parameters|base_color_map",
                             "Maya|baseColor|file", "Maya|TEX_color_map|file"}) {
        const auto model = textured(name);
        ASSERT_EQ(model.mesh.materials.size(), 1u);
        EXPECT_EQ(model.mesh.materials[0].baseColourTexture, 0) << name;
    }
}

TEST(FbxScene, TexturesAreMovedAndClamp) {
    const auto model =
        textured("DiffuseColor", property("Translation", "0.25,0.5,0") +
                                     property("Scaling", "2,0.5,1") + property("WrapModeU", "1"));
    ASSERT_EQ(model.mesh.uvs.size(), 3u);
    // v runs down here.
    expectNear(model.mesh.uvs[0], glm::vec2(0.25f, 0.5f));
    expectNear(model.mesh.uvs[1], glm::vec2(2.25f, 0.5f));
    expectNear(model.mesh.uvs[2], glm::vec2(0.25f, 0.0f));
    ASSERT_EQ(model.mesh.textures.size(), 1u);
    EXPECT_EQ(model.mesh.textures[0].wrapU, MeshTexture::Wrap::clamp);
    EXPECT_EQ(model.mesh.textures[0].wrapV, MeshTexture::Wrap::repeat);
}

TEST(FbxScene, TexturesWithoutRelativeNameHaveTheirFullOne) {
    const auto model =
        readFbx(geometryOf(10) + modelOf(20, "a") + objectOf("Material", 30, "m", "") +
                    textureOf(40, "", "", "C:/nowhere/full.png"),
                {{20, 0}, {10, 20}, {30, 20}, {40, 30, "DiffuseColor"}});
    EXPECT_TRUE(model.hasNote("texture 'C:/nowhere/full.png'"));
}

TEST(FbxScene, EmissionHasItsStrength) {
    const auto with = [](const std::string& factor) {
        const auto model = textured("EmissiveColor", "",
                                    property("EmissiveColor", "0,0,0") +
                                        (factor.empty() ? "" : property("EmissiveFactor", factor)));
        const auto& material = model.mesh.materials.at(0);
        return std::pair(material.emissiveTexture, material.emissive.x);
    };
    EXPECT_EQ(with(""), std::pair(0, 1.0f));
    EXPECT_EQ(with("1"), std::pair(0, 1.0f));
    EXPECT_EQ(with("0"), std::pair(-1, 0.0f));
    EXPECT_NEAR(with("0.5").second, 0.214f, 1e-3f);  // 0.5 of sRGB
}

TEST(FbxScene, WhatHasNoMaterialHasNoColour) {
    EXPECT_TRUE(readFbx(geometryOf(10) + modelOf(20, "a"), {{20, 0}, {10, 20}})
                    .hasNote("the model has no colour: it is drawn in plain grey"));
}

TEST(FbxScene, WhatIsLostIsSaid) {
    const std::string plain = geometryOf(10) + modelOf(20, "a");
    const std::vector<Connection> connected = {{20, 0}, {10, 20}};
    const auto with = [&](const std::string& objects, const std::vector<Connection>& more = {}) {
        auto all = connected;
        all.insert(all.end(), more.begin(), more.end());
        return readFbx(plain + objects, all);
    };
    EXPECT_TRUE(with(objectOf("Geometry", 12, "n", "NurbsSurface"))
                    .hasNote("dropped: NURBS and patches (1)"));
    const std::string channel =
        objectOf("Deformer", 51, "b", "BlendShape") +
        objectOf("Deformer", 52, "c", "BlendShapeChannel", property("DeformPercent", "50"));
    EXPECT_TRUE(with(channel, {{51, 10}, {52, 51}}).hasNote("dropped: blend shapes in effect (1)"));
    EXPECT_TRUE(with(objectOf("Material", 30, "m", "") + objectOf("Material", 31, "n", "") +
                         modelOf(21, "b"),
                     {{21, 0}, {10, 21}, {30, 20}, {31, 21}})
                    .hasNote("geometry 'g10' has other materials in other models; all have those "
                             "of the first"));
    const std::string colours =
        "\t\tLayerElementColor: 0 {\n\t\t\tMappingInformationType: \"AllSame\"\n\t\t}\n";
    EXPECT_TRUE(readFbx(geometryOf(10, colours) + modelOf(20, "a"), connected)
                    .hasNote("geometry 'g10': its vertex colours are mapped AllSame and not read; "
                             "expected ByPolygonVertex or ByVertice"));
    EXPECT_TRUE(with(objectOf("NodeAttribute", 60, "", "Camera") +
                         objectOf("NodeAttribute", 61, "", "Light") +
                         modelOf(21, "c", "", "Camera") + modelOf(22, "l", "", "Light"),
                     {{21, 0}, {22, 0}, {60, 21}, {61, 22}})
                    .hasNote("dropped: cameras (1)"));
}

TEST(FbxScene, OtherInheritanceOfScaleIsSaid) {
    const auto with = [](const std::string& scale, const std::string& type) {
        return readFbx(geometryOf(10) + modelOf(19, "p", property("Lcl Scaling", scale), "Null") +
                           modelOf(20, "a", property("InheritType", type)),
                       {{19, 0}, {20, 19}, {10, 20}})
            .hasNote(
                "models that take over scale in another way (InheritType 0 or 2) are drawn as all "
                "others: 1");
    };
    EXPECT_TRUE(with("2,1,1", "0"));
    EXPECT_TRUE(with("2,2,2", "2"));
    EXPECT_FALSE(with("2,2,2", "0"));
    EXPECT_FALSE(with("1,1,1", "2"));
    EXPECT_FALSE(with("2,1,1", "1"));
}

/// Names of elements with those that they are in, and their values.
std::vector<std::string> elementsOf(const std::string& bytes) {
    std::vector<std::string> found;
    eachFbxElement(std::as_bytes(std::span(bytes)), [&](const FbxElement& element) {
        std::string line;
        for (const auto name : element.inside) line += fmt::format("{}/", name);
        line += element.name;
        for (const auto& value : element.values)
            line += value.text.empty() ? fmt::format(" {}", value.number)
                                       : fmt::format(" '{}'", value.text);
        found.push_back(line);
    });
    return found;
}

TEST(FbxElements, OfText) {
    EXPECT_EQ(
        elementsOf("; comment: {\nA: 1, \"b\" {\n\tC: \"x;y\", 2.5,\n 3\n\tD: *2 {\n\t\ta: "
                   "1,2\n\t}\n}\nE: , 4\n"),
        std::vector<std::string>({"A 1 'b'", "A/C 'x;y' 2.5 3", "A/D 0", "A/D/a 1 2", "E 4"}));
    EXPECT_EQ(elementsOf("}}A: \"not closed"), std::vector<std::string>({"A 'not closed'"}));
    EXPECT_TRUE(elementsOf("").empty());
}

TEST(FbxElements, OfBinaryFiles) {
    const auto put = [](std::string& to, const auto value) {
        to.append(reinterpret_cast<const char*>(&value), sizeof(value));
    };
    const auto record = [&](std::size_t at, const std::string& name, std::uint32_t count,
                            const std::string& values, const std::string& inside) {
        std::string all;
        put(all, static_cast<std::uint32_t>(at + 13 + name.size() + values.size() + inside.size()));
        put(all, count);
        put(all, static_cast<std::uint32_t>(values.size()));
        put(all, static_cast<std::uint8_t>(name.size()));
        return all + name + values + inside;
    };
    std::string header = "Kaydara FBX Binary  ";
    header += std::string("\0\x1a\0", 3);
    put(header, std::uint32_t{7400});
    std::string values = "L";
    put(values, std::int64_t{5000000000});
    values += "S";
    put(values, std::uint32_t{3});
    values += "abc";
    std::string inside = "D";
    put(inside, 0.5);
    const std::size_t outer = 13 + 1 + values.size();
    const std::string child = record(header.size() + outer, "P", 1, inside, "");
    const std::string bytes = header +
                              record(header.size(), "A", 2, values, child + std::string(13, '\0')) +
                              std::string(13, '\0');
    EXPECT_EQ(elementsOf(bytes), std::vector<std::string>({"A 5000000000 'abc'", "A/P 0.5"}));
    for (std::size_t size = 0; size < bytes.size(); ++size) elementsOf(bytes.substr(0, size));
}

}  // namespace
}  // namespace stx

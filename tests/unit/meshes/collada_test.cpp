#include <array>
#include <cmath>

#include "formats/images/images.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/meshes/models.hpp"

namespace stx {
namespace {

/// A triangle (0, 0, 0), (1, 0, 0), (0, 1, 0) of COLLADA in nodes as given; `%` in them is its
/// instance.
std::string colladaOf(std::string nodes) {
    nodes.replace(nodes.find('%'), 1, R"(<instance_geometry url="#g"/>)");
    return R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset/>
<library_geometries><geometry id="g"><mesh><source id="p">
<float_array id="a" count="9">0 0 0 1 0 0 0 1 0</float_array><technique_common>
<accessor source="#a" count="3" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices><triangles count="1">
<input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles></mesh></geometry>
</library_geometries><library_visual_scenes><visual_scene id="s">)" +
           nodes + R"(</visual_scene></library_visual_scenes><scene>
<instance_visual_scene url="#s"/></scene></COLLADA>)";
}

/// Where the triangle's corners are with this in its node.
std::vector<glm::dvec3> cornersWith(const std::string& transform) {
    const auto model = readGoodText(colladaOf("<node>" + transform + "%</node>"), "a.dae");
    if (model.mesh.positions.size() != 3) {
        ADD_FAILURE() << model.mesh.positions.size() << " positions";
        return std::vector<glm::dvec3>(3);
    }
    return {model.mesh.positions.begin(), model.mesh.positions.end()};
}

void expectCorners(const std::string& transform, const std::array<glm::dvec3, 3>& expected) {
    const auto corners = cornersWith(transform);
    for (int k = 0; k < 3; ++k)
        EXPECT_LT(glm::distance(corners[k], expected[k]), 1e-6) << transform << ": corner " << k;
}

TEST(Collada, LookatIsRigid) {
    // From (1, 2, 3) along -x: right is -z, up is y. The up leans by 45 degrees.
    const std::array<glm::dvec3, 3> expected = {glm::dvec3(1, 2, 3), {1, 2, 2}, {1, 3, 3}};
    expectCorners("<lookat>1 2 3 0 2 3 0 1 0</lookat>", expected);
    expectCorners("<lookat>1 2 3 0 2 3 1 1 0</lookat>", expected);
    expectCorners("<!-- <lookat> --><lookat sid=\"l\">\n 1 2 +3\t-4 2 3e0\r\n -7 7 0 </lookat>",
                  expected);
    expectCorners("<translate>1 2 2</translate><lookat>0 0 1 0 0 0 0 5 3</lookat>",
                  {glm::dvec3(1, 2, 3), {2, 2, 3}, {1, 3, 3}});
}

TEST(Collada, SkewMovesAlongItsSecondAxis) {
    const glm::dvec3 origin(0), x(1, 0, 0);
    const double third = std::sqrt(1.0 / 3.0);
    expectCorners("<skew>30 0 1 0 1 0 0</skew>", {origin, x, glm::dvec3(third, 1, 0)});
    expectCorners("<skew>-45 0 2 0 0 0 3</skew>", {origin, x, glm::dvec3(0, 1, -1)});
    // 45 degrees from x become 30.
    expectCorners("<skew>15 1 1 0 1 0 0</skew>", {origin, x, glm::dvec3(std::sqrt(3.0) - 1, 1, 0)});
    const auto error = readBadText(colladaOf("<node><skew>90 0 1 0 1 0 0</skew>%</node>"), "a.dae");
    EXPECT_EQ(error.text(),
              "'a.dae': skew '90 0 1 0 1 0 0' has no meaning: its first axis cannot turn by the "
              "angle towards the second; expected two axes with an angle between them that is "
              "larger");
}

/// A textured triangle with two sets of texture coordinates, (0.25, 0.5) and (0.75, 0.5) all over.
std::string colladaWithSets(int first, int second, const std::string& bind,
                            const std::string& sampler = "", const std::string& name = "UVMap") {
    const auto replaced = [](std::string text, const std::string& what, const std::string& with) {
        return text.replace(text.find(what), what.size(), with);
    };
    const auto source = [](const std::string& id, const std::string& u) {
        return fmt::format(
            R"(<source id="{0}"><float_array id="{0}a" count="2">{1} 0.5</float_array>
<technique_common><accessor source="#{0}a" count="1" stride="2"><param name="S" type="float"/>
<param name="T" type="float"/></accessor></technique_common></source>)",
            id, u);
    };
    const std::string effect = R"(<library_images><image id="i"><init_from>t.png</init_from></image>
</library_images><library_effects><effect id="e"><profile_COMMON><newparam sid="f">
<surface type="2D"><init_from>i</init_from></surface></newparam><newparam sid="s"><sampler2D>
<source>f</source>)" + sampler +
                               R"(</sampler2D></newparam><technique sid="c"><lambert><diffuse>
<texture texture="s" texcoord=")" +
                               name +
                               R"("/></diffuse></lambert></technique></profile_COMMON></effect>
</library_effects><library_materials><material id="m"><instance_effect url="#e"/></material>
</library_materials><library_geometries>)";
    auto text = colladaOf("<node>%</node>");
    text = replaced(text, R"(<instance_geometry url="#g"/>)",
                    R"(<instance_geometry url="#g"><bind_material><technique_common>
<instance_material symbol="mm" target="#m">)" +
                        bind + R"(</instance_material></technique_common></bind_material>
</instance_geometry>)");
    text = replaced(text, "<library_geometries>", effect);
    text = replaced(text, "<vertices", source("u0", "0.25") + source("u1", "0.75") + "<vertices");
    text = replaced(text, R"(<triangles)", R"(<triangles material="mm")");
    return replaced(text, "<p>0 1 2</p>",
                    fmt::format(R"(<input semantic="TEXCOORD" source="#u0" offset="1" set="{}"/>
<input semantic="TEXCOORD" source="#u1" offset="1" set="{}"/><p>0 0 1 0 2 0</p>)",
                                first, second));
}

TEST(Collada, TexturesHaveTheSetOfCoordinatesThatIsBound) {
    const auto u = [](int first, int second, int bound) {
        const auto bind = fmt::format(
            R"(<bind_vertex_input semantic="UVMap" input_semantic="TEXCOORD" input_set="{}"/>)",
            bound);
        const auto model = readGoodText(colladaWithSets(first, second, bind), "a.dae");
        if (model.mesh.uvs.empty()) return -1.0f;
        return model.mesh.uvs[0].x;
    };
    EXPECT_EQ(u(0, 1, 0), 0.25f);
    EXPECT_EQ(u(0, 1, 1), 0.75f);
    EXPECT_EQ(u(1, 2, 1), 0.25f) << "3ds Max counts from 1";
    EXPECT_EQ(u(1, 2, 2), 0.75f);
    EXPECT_EQ(u(0, 3, 3), 0.75f);
    EXPECT_EQ(u(1, 0, 0), 0.75f);
    EXPECT_EQ(u(0, 1, 7), 0.25f) << "no such set";
    for (const char* name : {"UVMap", "CHANNEL1"})
        EXPECT_EQ(readGoodText(colladaWithSets(0, 1, "", "", name), "a.dae").mesh.uvs.at(0).x,
                  0.25f);
}

/// Two geometries that share a material with one texture, 'UV', each with the sets and the binding
/// as given; (0.25, 0.5) and (0.75, 0.5) all over the first and the second set.
std::string colladaOfTwo(std::array<int, 2> setsOfFirst, int boundInFirst,
                         std::array<int, 2> setsOfSecond, int boundInSecond) {
    const auto bind = [](int set) {
        return fmt::format(
            R"(<bind_vertex_input semantic="UV" input_semantic="TEXCOORD" input_set="{}"/>)", set);
    };
    std::string text =
        colladaWithSets(setsOfFirst[0], setsOfFirst[1], bind(boundInFirst), "", "UV");
    const std::string other =
        colladaWithSets(setsOfSecond[0], setsOfSecond[1], bind(boundInSecond), "", "UV");
    const auto part = [](const std::string& of, const std::string& from, const std::string& to) {
        const auto at = of.find(from);
        return of.substr(at, of.find(to, at) + to.size() - at);
    };
    std::string geometry = part(other, "<geometry", "</geometry>");
    for (const char* id : {"g", "p", "v", "u0", "u1", "a", "u0a", "u1a"}) {
        for (const auto& [before, after] : {std::pair{"\"", "\""}, {"#", "\""}}) {
            const auto from = before + std::string(id) + after;
            for (auto at = geometry.find(from); at != std::string::npos;
                 at = geometry.find(from, at + 1))
                geometry.replace(at, from.size(), before + (std::string("h") + id) + after);
        }
    }
    std::string instance = part(other, "<node>", "</node>");
    instance.replace(instance.find("#g"), 2, "#hg");
    text.insert(text.find("</library_geometries>"), geometry);
    text.insert(text.find("</visual_scene>"), instance);
    return text;
}

TEST(Collada, SetsAreThoseOfEachMesh) {
    // The u of the first mesh, then that of the second.
    const auto u = [](const std::string& text) {
        const auto model = readGoodText(text, "a.dae");
        EXPECT_FALSE(model.hasNote("bound to several sets"));
        if (model.mesh.uvs.size() != 6) return glm::vec2(-1.0f);
        return glm::vec2(model.mesh.uvs[0].x, model.mesh.uvs[3].x);
    };
    EXPECT_EQ(u(colladaOfTwo({0, 1}, 0, {0, 1}, 0)), glm::vec2(0.25f, 0.25f));
    EXPECT_EQ(u(colladaOfTwo({0, 1}, 1, {1, 2}, 1)), glm::vec2(0.75f, 0.25f)) << "other sets";
    EXPECT_EQ(u(colladaOfTwo({0, 1}, 0, {0, 1}, 1)), glm::vec2(0.25f, 0.75f)) << "other bindings";
    EXPECT_EQ(u(colladaOfTwo({3, 5}, 5, {0, 1}, 0)), glm::vec2(0.75f, 0.25f));
    // One geometry that is bound in two ways has the first, and that is said.
    auto twice = colladaOfTwo({0, 1}, 1, {0, 1}, 0);
    twice.replace(twice.find("#hg"), 3, "#g");
    const auto model = readGoodText(twice, "a.dae");
    EXPECT_TRUE(model.hasNote("'UV' is bound to several sets of texture coordinates"));
    EXPECT_EQ(model.mesh.uvs.at(0).x, 0.75f);
}

TEST(Collada, SamplersWrap) {
    TemporaryFolder folder;
    const std::vector<std::uint8_t> grey(4, 128);
    const auto png = encodePng(1, 1, 4, 8, grey.data(), true);
    ASSERT_TRUE(png && writeFile(folder / "t.png", *png));
    using Wrap = MeshTexture::Wrap;
    const auto with = [&](const std::string& sampler, Wrap u, Wrap v) {
        const auto text = colladaWithSets(0, 1, "", sampler);
        EXPECT_TRUE(writeFile(folder / "a.dae", std::as_bytes(std::span(text))));
        auto model = readGood(folder / "a.dae");
        EXPECT_EQ(model.mesh.textures.size(), 1u);
        if (model.mesh.textures.empty()) return model;
        EXPECT_EQ(model.mesh.textures[0].wrapU, u) << sampler;
        EXPECT_EQ(model.mesh.textures[0].wrapV, v) << sampler;
        return model;
    };
    with("", Wrap::repeat, Wrap::repeat);
    with("<wrap_s>WRAP</wrap_s><wrap_t> CLAMP </wrap_t>", Wrap::repeat, Wrap::clamp);
    with("<wrap_s>CLAMP</wrap_s>", Wrap::clamp, Wrap::repeat);
    const auto mirror =
        with("<wrap_s>MIRROR</wrap_s><wrap_t>MIRROR</wrap_t>", Wrap::mirror, Wrap::mirror);
    EXPECT_TRUE(mirror.notes.empty()) << mirror.notes[0];
    EXPECT_TRUE(with("<wrap_s>BORDER</wrap_s>", Wrap::repeat, Wrap::repeat)
                    .hasNote("wrap 'BORDER' of samplers is not read, only WRAP, CLAMP and MIRROR: "
                             "textures repeat"));
}

TEST(Collada, SkinsAreInThePoseOfTheirBones) {
    // The bind shape doubles. The bones were at (0, 0, 0) and (1, 0, 0) as the mesh was bound.
    // Corner 0 follows the first bone, 1 the second, 2 both by halves.
    const std::string controller = R"(<library_controllers><controller id="k"><skin source="#g">
<bind_shape_matrix>2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1</bind_shape_matrix><source id="kj">
<Name_array id="kja" count="2">A B</Name_array><technique_common><accessor source="#kja" count="2"
stride="1"><param name="JOINT" type="name"/></accessor></technique_common></source><source id="kb">
<float_array id="kba" count="32">1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1
1 0 0 -1 0 1 0 0 0 0 1 0 0 0 0 1</float_array><technique_common><accessor source="#kba" count="2"
stride="16"><param name="TRANSFORM" type="float4x4"/></accessor></technique_common></source>
<source id="kw"><float_array id="kwa" count="2">1 0.5</float_array><technique_common>
<accessor source="#kwa" count="2" stride="1"><param name="WEIGHT" type="float"/></accessor>
</technique_common></source><joints><input semantic="JOINT" source="#kj"/>
<input semantic="INV_BIND_MATRIX" source="#kb"/></joints><vertex_weights count="3">
<input semantic="JOINT" source="#kj" offset="0"/><input semantic="WEIGHT" source="#kw" offset="1"/>
<vcount>1 1 2</vcount><v>0 0 1 0 0 1 1 1</v></vertex_weights></skin></controller>
</library_controllers><library_visual_scenes>)";
    const auto read = [&](const std::string& bones) {
        auto text = colladaOf(bones + "<node><translate>9 9 9</translate>%</node>");
        const std::string instance = R"(<instance_geometry url="#g"/>)";
        text.replace(text.find(instance), instance.size(), R"(<instance_controller url="#k">
<skeleton>#A</skeleton></instance_controller>)");
        const std::string scenes = "<library_visual_scenes>";
        return readGoodText(text.replace(text.find(scenes), scenes.size(), controller), "a.dae");
    };
    const auto bones = [](const std::string& first, const std::string& second) {
        return R"(<node id="A" sid="A" name="A" type="JOINT">)" + first +
               R"(<node id="B" sid="B" name="B" type="JOINT">)" + second + "</node></node>";
    };
    // The first bone is at (0, 0, 5), the second above it, turned by 90 degrees about x.
    const auto model = read(bones("<translate>0 0 5</translate>",
                                  "<translate>0 0 1</translate><rotate>1 0 0 90</rotate>"));
    ASSERT_EQ(model.mesh.positions.size(), 3u);
    EXPECT_TRUE(model.notes.empty()) << model.notes[0];
    const std::array<glm::dvec3, 3> expected = {glm::dvec3(0, 0, 5), {1, 0, 6}, {-0.5, 1, 6.5}};
    for (int k = 0; k < 3; ++k)
        EXPECT_LT(glm::distance(glm::dvec3(model.mesh.positions[k]), expected[k]), 1e-6) << k;
    const auto facing = [](const ReadModel& of) {
        const auto t = of.mesh.triangles.at(0);
        const auto& p = of.mesh.positions;
        return glm::cross(p[t.y] - p[t.x], p[t.z] - p[t.x]).z;
    };
    EXPECT_GT(facing(model), 0);
    EXPECT_GT(facing(read(bones("<scale>-1 1 1</scale>", ""))), 0) << "mirrored";
}

/// The triangle with a material whose effect has this in its profile.
std::string colladaWithEffect(const std::string& profile) {
    auto text = colladaOf("<node>%</node>");
    const auto replace = [&](const std::string& what, const std::string& with) {
        text.replace(text.find(what), what.size(), with);
    };
    replace("<library_geometries>",
            R"(<library_effects><effect id="e"><profile_COMMON>)" + profile +
                R"(</profile_COMMON></effect></library_effects><library_materials>
<material id="m" name="m"><instance_effect url="#e"/></material></library_materials>
<library_geometries>)");
    replace("<triangles", R"(<triangles material="mm")");
    replace(R"(<instance_geometry url="#g"/>)", R"(<instance_geometry url="#g"><bind_material>
<technique_common><instance_material symbol="mm" target="#m"/></technique_common></bind_material>
</instance_geometry>)");
    return text;
}

Material materialOfEffect(const std::string& shader, const std::string& parameters = "") {
    const auto model = readGoodText(
        colladaWithEffect(parameters + "<technique sid=\"c\">" + shader + "</technique>"), "a.dae");
    if (model.mesh.materials.size() != 1) {
        ADD_FAILURE() << model.mesh.materials.size() << " materials";
        return {};
    }
    return model.mesh.materials[0];
}

TEST(Collada, ColoursAreThoseOfTheFile) {
    const glm::vec4 red(1, 0, 0, 1), black(0, 0, 0, 1);
    EXPECT_EQ(
        materialOfEffect("<phong><diffuse><color>1 0 0 1</color></diffuse></phong>").baseColour,
        red);
    // Parameters are values elsewhere.
    for (const char* value : {"<float4>1 0 0 1</float4>", "<float3>1 0 0</float3>"})
        EXPECT_EQ(materialOfEffect(R"(<lambert><diffuse><param ref="c"/></diffuse></lambert>)",
                                   fmt::format(R"(<newparam sid="c">{}</newparam>)", value))
                      .baseColour,
                  red)
            << value;
    // Without a colour there is none; constant shading is what it emits.
    for (const char* shader :
         {"<lambert></lambert>", "<lambert/>", "<constant></constant>",
          R"(<blinn><diffuse><param ref="nowhere"></param></diffuse></blinn>)"})
        EXPECT_FALSE(materialOfEffect(shader).hasColour) << shader;
    const auto constant =
        materialOfEffect("<constant><emission><color>0 1 0 1</color></emission></constant>");
    EXPECT_EQ(constant.baseColour, black);
    EXPECT_EQ(constant.emissive, glm::vec3(0, 1, 0));
}

TEST(Collada, NamesMayHaveAPrefix) {
    std::string text = colladaOf("<node><translate>0 0 2</translate>%</node>");
    for (auto at = text.find('<'); at != std::string::npos; at = text.find('<', at + 1))
        if (text[at + 1] != '?') text.insert(at + (text[at + 1] == '/' ? 2 : 1), "c:");
    text.replace(text.find("xmlns"), 5, "xmlns:c");
    EXPECT_EQ(readGoodText(text, "a.dae").mesh.positions.at(1), glm::vec3(1, 0, 2));
}

TEST(Collada, MorphsHaveTheirBaseShape) {
    std::string text = colladaOf("<node>%</node>");
    const auto replace = [&](const std::string& what, const std::string& with) {
        text.replace(text.find(what), what.size(), with);
    };
    replace("<library_visual_scenes>", R"(<library_controllers><controller id="k">
<morph source="#g" method="NORMALIZED"><source id="kt"><IDREF_array id="kta" count="1">g</IDREF_array>
<technique_common><accessor source="#kta" count="1" stride="1"><param name="IDREF" type="IDREF"/>
</accessor></technique_common></source><source id="kw"><float_array id="kwa" count="1">1</float_array>
<technique_common><accessor source="#kwa" count="1" stride="1"><param name="MORPH_WEIGHT"
type="float"/></accessor></technique_common></source><targets><input semantic="MORPH_TARGET"
source="#kt"/><input semantic="MORPH_WEIGHT" source="#kw"/></targets></morph></controller>
</library_controllers><library_visual_scenes>)");
    for (const char* instance : {R"(<instance_controller url="#k"/>)",
                                 R"(<instance_controller url="#k"></instance_controller>)"}) {
        const auto before = text;
        replace(R"(<instance_geometry url="#g"/>)", instance);
        const auto model = readGoodText(text, "a.dae");
        EXPECT_EQ(model.mesh.triangles.size(), 1u) << instance;
        EXPECT_TRUE(model.hasNote("dropped: morphs (1); what they morph has its base shape"));
        text = before;
    }
}

TEST(Collada, HolesOfPolygonsAreFilled) {
    std::string text = colladaOf("<node>%</node>");
    const auto replace = [&](const std::string& what, const std::string& with) {
        text.replace(text.find(what), what.size(), with);
    };
    replace("<triangles", "<polygons");
    replace("</triangles", "</polygons");
    replace("<p>0 1 2</p>", "<ph><p>0 1 2</p><h>0 1 2</h><h>2 1 0</h></ph>");
    const auto model = readGoodText(text, "a.dae");
    EXPECT_EQ(model.mesh.triangles.size(), 1u);
    EXPECT_TRUE(model.hasNote("holes of polygons are not read: 2 are filled"));
}

TEST(Collada, TexturesAreMovedAsMayaSays) {
    auto text = colladaWithSets(0, 1, "");
    const std::string end = R"(UVMap"/>)";
    text.replace(text.find(end), end.size(), R"(UVMap"><extra><technique profile="MAYA">
<repeatU>2</repeatU><repeatV>1</repeatV><offsetU>0.125</offsetU><offsetV>0.25</offsetV></technique>
</extra></texture>)");
    const auto model = readGoodText(text, "a.dae");
    ASSERT_FALSE(model.mesh.uvs.empty());
    expectNear(model.mesh.uvs[0], glm::vec2(0.625f, 0.25f));
}

/// A skin of the triangle `g`, all of whose vertices follow the joint 'b'.
std::string skinOfOneJoint(const std::string& id) {
    const auto source = [&](const std::string& name, const std::string& array,
                            const std::string& accessor) {
        return fmt::format(
            R"(<source id="{0}{1}">{2}<technique_common><accessor source="#{0}{1}a" {3}</accessor>
</technique_common></source>)",
            id, name, array, accessor);
    };
    return fmt::format(R"(<controller id="{}"><skin source="#g">)", id) +
           source("j", fmt::format(R"(<Name_array id="{}ja" count="1">b</Name_array>)", id),
                  R"(count="1" stride="1"><param name="JOINT" type="name"/>)") +
           source("b",
                  fmt::format(R"(<float_array id="{}ba" count="16">1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1
</float_array>)",
                              id),
                  R"(count="1" stride="16"><param name="TRANSFORM" type="float4x4"/>)") +
           source("w", fmt::format(R"(<float_array id="{}wa" count="1">1</float_array>)", id),
                  R"(count="1" stride="1"><param name="WEIGHT" type="float"/>)") +
           fmt::format(R"(<joints><input semantic="JOINT" source="#{0}j"/>
<input semantic="INV_BIND_MATRIX" source="#{0}b"/></joints><vertex_weights count="3">
<input semantic="JOINT" source="#{0}j" offset="0"/><input semantic="WEIGHT" source="#{0}w" offset="1"/>
<vcount>1 1 1</vcount><v>0 0 0 0 0 0</v></vertex_weights></skin></controller>)",
                       id);
}

TEST(Collada, JointsAreThoseOfTheSkinsSkeleton) {
    const auto read = [](const std::string& instances) {
        std::string nodes;
        for (int i = 1; i <= 2; ++i)
            nodes += fmt::format(R"(<node id="root{0}" type="JOINT"><node id="b{0}" sid="b"
type="JOINT"><translate>{1} 0 0</translate></node></node>)",
                                 i, 10 * i);
        auto text = colladaOf(nodes + "<node>%</node>");
        const std::string instance = R"(<instance_geometry url="#g"/>)";
        text.replace(text.find(instance), instance.size(), instances);
        const std::string scenes = "<library_visual_scenes>";
        text.replace(text.find(scenes), 0,
                     "<library_controllers>" + skinOfOneJoint("k1") + skinOfOneJoint("k2") +
                         "</library_controllers>");
        return readGoodText(text, "a.dae");
    };
    const auto instance = [](int skin, int skeleton) {
        return fmt::format(R"(<instance_controller url="#k{}"><skeleton>#root{}</skeleton>
</instance_controller>)",
                           skin, skeleton);
    };
    const auto model = read(instance(1, 2) + instance(2, 1));
    ASSERT_EQ(model.mesh.positions.size(), 6u);
    EXPECT_EQ(model.mesh.positions[0].x, 20.0f);
    EXPECT_EQ(model.mesh.positions[3].x, 10.0f);
    EXPECT_TRUE(read(instance(1, 2) + instance(1, 1))
                    .hasNote("skin 'k1' is shown with several skeletons; all have the pose of the "
                             "first"));
}

TEST(Collada, BonesAloneAreNoModel) {
    std::string text = colladaOf("<node id=\"a\" type=\"JOINT\"/>%");
    text.replace(text.find(R"(<instance_geometry url="#g"/>)"), 29, "");
    EXPECT_EQ(readBadText(text, "a.dae").text(),
              "'a.dae': the model has neither triangles nor points; export its faces or its "
              "vertices with it");
}

TEST(Collada, CoordinatesAreRoundedWhereTheyAreLarge) {
    EXPECT_TRUE(
        readGoodText(colladaOf("<node><translate>10000000 0 0</translate>%</node>"), "a.dae")
            .hasNote("to which the reader of this format rounds them, in steps of up to 1: "
                     "where that shows, move the model to the origin or save it as OBJ; "
                     "the origin 1000000"));
    std::string text = colladaOf("<node>%</node>");
    text.replace(text.find("0 0 0 1 0 0 0 1 0"), 17, "44000000 0 0 44000001 0 0 44000000 1 0");
    EXPECT_EQ(readBadText(text, "a.dae").text(),
              "'a.dae': the model has 1 triangles, but none with an area, and no points; the "
              "reader of this format rounds coordinates to 32-bit floats, here in steps of up to "
              "4: move the model to the origin or save it as OBJ");
}

}  // namespace
}  // namespace stx

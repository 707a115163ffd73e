#include <array>

#include "tests/unit/meshes/models.hpp"

namespace stx {
namespace {

std::string unitOf(double centimetres) {
    return fmt::format("\t\tP: \"UnitScaleFactor\", \"double\", \"Number\", \"\",{}\n",
                       centimetres);
}

/// A triangle (0, 0, 0), (1, 0, 0), (0, 1, 0) of FBX, as text, whose node is at (0, 0, 2).
ReadModel fbxOf(const std::string& globals, const std::string& objects = "",
                const std::string& connections = "", const std::string& unit = unitOf(100)) {
    return readGoodText(
        R"(; FBX 7.4.0 project file
FBXHeaderExtension:  {
	FBXVersion: 7400
}
GlobalSettings:  {
	Version: 1000
	Properties70:  {
)" + globals +
            unit +
            R"(
	}
}
Objects:  {
	Geometry: 10, "Geometry::g", "Mesh" {
		Vertices: *9 {
			a: 0,0,0,1,0,0,0,1,0
		}
		PolygonVertexIndex: *3 {
			a: 0,1,-3
		}
	}
	Model: 20, "Model::q", "Mesh" {
		Version: 232
		Properties70:  {
			P: "Lcl Translation", "Lcl Translation", "", "A",0,0,2
		}
	}
)" + objects +
            R"(
}
Connections:  {
	C: "OO",20,0
	C: "OO",10,20
)" + connections +
            R"(
}
)",
        "a.fbx");
}

void expectCornersAt(const ReadModel& model, const std::array<glm::dvec3, 3>& expected) {
    ASSERT_EQ(model.mesh.positions.size(), 3u);
    for (int k = 0; k < 3; ++k)
        EXPECT_LT(glm::distance(glm::dvec3(model.mesh.positions[k]), expected[k]), 1e-6) << k;
}

TEST(Fbx, SkinsAreInThePoseOfTheirBones) {
    // The bone was at (0, 0, 1) as the mesh was bound, and is at (0, 3, 1). Corner 1 has no bone.
    const auto model = fbxOf("", R"(
	Model: 40, "Model::bone", "LimbNode" {
		Version: 232
		Properties70:  {
			P: "Lcl Translation", "Lcl Translation", "", "A",0,3,1
		}
	}
	Deformer: 50, "Deformer::skin", "Skin" {
		Version: 101
	}
	Deformer: 60, "SubDeformer::bone", "Cluster" {
		Version: 100
		Indexes: *2 {
			a: 0,2
		}
		Weights: *2 {
			a: 1,0.5
		}
		Transform: *16 {
			a: 1,0,0,0,0,1,0,0,0,0,1,0,0,0,1,1
		}
		TransformLink: *16 {
			a: 1,0,0,0,0,1,0,0,0,0,1,0,0,0,1,1
		}
	})",
                             R"(	C: "OO",40,0
	C: "OO",50,10
	C: "OO",60,50
	C: "OO",40,60)");
    expectCornersAt(model, {glm::dvec3(0, 3, 2), {1, 0, 2}, {0, 4, 2}});
}

TEST(Fbx, UnitsBecomeMetres) {
    const auto with = [](const std::string& unit, const std::string& axes = "") {
        return fbxOf(axes, "", "", unit);
    };
    expectCornersAt(with(unitOf(1)), {glm::dvec3(0, 0, 0.02), {0.01, 0, 0.02}, {0, 0.01, 0.02}});
    expectCornersAt(with(unitOf(100)), {glm::dvec3(0, 0, 2), {1, 0, 2}, {0, 1, 2}});
    expectCornersAt(with(unitOf(2.54)),
                    {glm::dvec3(0, 0, 0.0508), {0.0254, 0, 0.0508}, {0, 0.0254, 0.0508}});
    // FBX's own unit is the centimetre.
    expectCornersAt(with(""), {glm::dvec3(0, 0, 0.02), {0.01, 0, 0.02}, {0, 0.01, 0.02}});
    std::string zUp;
    for (const auto& [name, value] : {std::pair{"UpAxis", 2},
                                      {"UpAxisSign", 1},
                                      {"FrontAxis", 1},
                                      {"FrontAxisSign", -1},
                                      {"CoordAxis", 0},
                                      {"CoordAxisSign", 1}})
        zUp += fmt::format("\t\tP: \"{}\", \"int\", \"Integer\", \"\",{}\n", name, value);
    expectCornersAt(with(unitOf(1), zUp),
                    {glm::dvec3(0, 0.02, 0), {0.01, 0.02, 0}, {0, 0.02, -0.01}});
}

TEST(Fbx, TheUpAxisIsUp) {
    const auto with = [](int up, int front, int frontSign, int right, int rightSign) {
        const auto number = [](const char* name, int value) {
            return fmt::format("\t\tP: \"{}\", \"int\", \"Integer\", \"\",{}\n", name, value);
        };
        return fbxOf(number("UpAxis", up) + number("UpAxisSign", 1) + number("FrontAxis", front) +
                     number("FrontAxisSign", frontSign) + number("CoordAxis", right) +
                     number("CoordAxisSign", rightSign));
    };
    const std::array<glm::dvec3, 3> asWritten = {glm::dvec3(0, 0, 2), {1, 0, 2}, {0, 1, 2}};
    expectCornersAt(with(1, 2, 1, 0, 1), asWritten);
    // As 3ds Max writes it; then the x axis up.
    expectCornersAt(with(2, 1, -1, 0, 1), {glm::dvec3(0, 2, 0), {1, 2, 0}, {0, 2, -1}});
    expectCornersAt(with(0, 2, 1, 1, -1), {glm::dvec3(0, 0, 2), {0, 1, 2}, {-1, 0, 2}});
    // Axes that are no rotation are not believed.
    expectCornersAt(with(2, 2, 1, 0, 1), asWritten);
    expectCornersAt(with(1, 2, -1, 0, 1), asWritten);
    expectCornersAt(with(1, 70, 1, -5, 1), asWritten);
}

}  // namespace
}  // namespace stx

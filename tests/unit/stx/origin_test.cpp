#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "formats/any/info.hpp"
#include "formats/atlas/atlas_files.hpp"
#include "formats/imagesets/camera_file.hpp"
#include "formats/imagesets/export.hpp"
#include "formats/stx/stx.hpp"
#include "lib/geometry/origin.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/meshes/models.hpp"

namespace stx {
namespace {

/// A place on a map in metres, where a float has steps of 0.25.
constexpr glm::dvec3 kUtm{500000, 4000000, 100};

/// A bumpy sheet of 2 x 2 units of 17 x 17 vertices whose coordinates are exact in binary.
std::vector<glm::dvec3> sheet() {
    std::vector<glm::dvec3> vertices;
    for (int j = 0; j <= 16; ++j) {
        for (int i = 0; i <= 16; ++i)
            vertices.emplace_back(i / 8.0 - 1, j / 8.0 - 1, ((i * 5 + j * 3) % 8) / 32.0);
    }
    return vertices;
}

std::vector<glm::uvec3> sheetTriangles() {
    std::vector<glm::uvec3> triangles;
    for (unsigned j = 0; j < 16; ++j) {
        for (unsigned i = 0; i < 16; ++i) {
            const unsigned a = j * 17 + i;
            triangles.emplace_back(a, a + 1, a + 17);
            triangles.emplace_back(a + 1, a + 18, a + 17);
        }
    }
    return triangles;
}

void write(const std::filesystem::path& file, const std::string& text) {
    std::ofstream(file, std::ios::binary) << text;
}

std::string objText(glm::dvec3 at) {
    std::string text;
    for (std::size_t k = 0; const auto v : sheet()) {
        const auto p = v + at;
        const auto colour = static_cast<double>(k++ % 7) / 8;
        text += fmt::format("v {} {} {} {} 0.5 0.25\n", p.x, p.y, p.z, colour);
    }
    for (const auto& t : sheetTriangles())
        text += fmt::format("f {} {} {}\n", t.x + 1, t.y + 1, t.z + 1);
    return text;
}

/// The same as a cloud without `faces`.
std::string plyText(glm::dvec3 at, bool faces) {
    const auto vertices = sheet();
    const auto triangles = sheetTriangles();
    std::string text = fmt::format(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty "
        "double z\n",
        vertices.size());
    if (faces)
        text += fmt::format("element face {}\nproperty list uchar int vertex_indices\n",
                            triangles.size());
    text += "end_header\n";
    for (const auto& v : vertices)
        text += fmt::format("{} {} {}\n", v.x + at.x, v.y + at.y, v.z + at.z);
    for (const auto& t : triangles) {
        if (faces) text += fmt::format("3 {} {} {}\n", t.x, t.y, t.z);
    }
    return text;
}

std::string stlText(glm::dvec3 at) {
    const auto vertices = sheet();
    std::string text = "solid sheet\n";
    for (const auto& t : sheetTriangles()) {
        text += "facet normal 0 0 1\nouter loop\n";
        for (int k = 0; k < 3; ++k) {
            const auto p = vertices[t[k]] + at;
            text += fmt::format("vertex {} {} {}\n", p.x, p.y, p.z);
        }
        text += "endloop\nendfacet\n";
    }
    return text + "endsolid sheet\n";
}

std::string gltfText(glm::dvec3 at) {
    GltfText text;
    std::vector<float> positions;
    std::vector<std::uint16_t> indices;
    for (const auto& v : sheet()) {
        for (int k = 0; k < 3; ++k) positions.push_back(static_cast<float>(v[k]));
    }
    for (const auto& t : sheetTriangles()) {
        for (int k = 0; k < 3; ++k) indices.push_back(static_cast<std::uint16_t>(t[k]));
    }
    const int p = text.accessor(positions, 5126, "VEC3", static_cast<int>(positions.size() / 3));
    const int i = text.accessor(indices, 5123, "SCALAR", static_cast<int>(indices.size()));
    text.root["meshes"][0]["primitives"].push_back(
        {{"attributes", {{"POSITION", p}}}, {"indices", i}});
    text.root["nodes"][0]["translation"] = {at.x, at.y, at.z};
    return text.text();
}

TEST(OriginFor, IsZeroWhileFloatsAreFine) {
    Bounds b;
    b.add({-1, -1, -1});
    b.add({1, 1, 1});
    EXPECT_EQ(originFor(b), glm::dvec3(0));
    EXPECT_EQ(originFor({b.min + 100.0, b.max + 100.0}), glm::dvec3(0));
    EXPECT_EQ(originFor({b.min + kUtm, b.max + kUtm}), kUtm);
    // A city: whole kilometres; heights stay as they are.
    EXPECT_EQ(originFor({{480000, 4000000, 0}, {480950, 4000950, 80}}),
              glm::dvec3(480000, 4000000, 0));
    EXPECT_EQ(originFor({}), glm::dvec3(0));
    EXPECT_EQ(originFor({kUtm, kUtm}), glm::dvec3(0));
}

class Origin : public testing::Test {
  protected:
    Model opened(const std::string& name, const std::string& text) {
        write(folder_ / name, text);
        auto model = open(folder_ / name, {}, job_);
        EXPECT_TRUE(model) << model.error().text();
        return std::move(*model);
    }
    /// The same model at 0 and far off gives the same pictures, drawn itself and from views.
    void expectAlike(const std::string& ending, const std::string& near, const std::string& far) {
        const Model a = opened("near." + ending, near), b = opened("far." + ending, far);
        EXPECT_EQ(originOf(a), glm::dvec3(0)) << ending;
        EXPECT_EQ(originOf(b), kUtm) << ending;
        EXPECT_EQ(boundsOf(a), boundsOf(b)) << ending;
        CameraSettings lens;
        lens.width = lens.height = 48;
        const auto eye = glm::dvec3(0.5, 1, 3);
        const auto camera = cameraAt(eye, {0, 0, 0}, lens);
        // As somebody gives it who knows the world only.
        auto world = cameraAt(eye + kUtm, kUtm, lens);
        ASSERT_TRUE(camera && world);
        world->position -= originOf(b);
        const auto picture = [&](const Model& model, const Camera& c) {
            auto frame = render(model, c, {}, job_);
            EXPECT_TRUE(frame) << frame.error().text();
            return pictureOf(*frame).coded;
        };
        EXPECT_EQ(picture(a, *camera), picture(b, *world)) << ending;
        ConvertSettings views;
        views.views = "ring:4";
        views.width = views.height = 48;
        const auto viewsA = convert(a, views, job_), viewsB = convert(b, views, job_);
        ASSERT_TRUE(viewsA && viewsB);
        EXPECT_EQ(viewsB->origin, kUtm);
        EXPECT_EQ(picture(*viewsA, *camera), picture(*viewsB, *world)) << ending;
    }

    TemporaryFolder folder_;
    Job job_;
};

TEST_F(Origin, LargeCoordinatesGiveTheSamePictures) {
    expectAlike("obj", objText({}), objText(kUtm));
    expectAlike("ply", plyText({}, true), plyText(kUtm, true));
    expectAlike("ply", plyText({}, false), plyText(kUtm, false));
    expectAlike("stl", stlText({}), stlText(kUtm));
    expectAlike("gltf", gltfText({}), gltfText(kUtm));
    const auto notes = job_.takeNotes();
    EXPECT_TRUE(std::any_of(notes.begin(), notes.end(), [](const std::string& n) {
        return n.find("the origin 500000 4000000 100 is subtracted") != std::string::npos;
    }));
}

TEST_F(Origin, EveryContainerKeepsIt) {
    ConvertSettings views;
    views.views = "ring:3";
    views.width = views.height = 32;
    const auto bundle = convert(opened("far.obj", objText(kUtm)), views, job_);
    ASSERT_TRUE(bundle) << bundle.error().text();
    for (const char* name : {"b.exr", "b.mp4", "b.xmt", "b.bt"}) {
        ASSERT_TRUE(save(*bundle, folder_ / name, {}, job_)) << name;
        const auto back = open(folder_ / name, {}, job_);
        ASSERT_TRUE(back) << name << ": " << back.error().text();
        EXPECT_EQ(originOf(*back), kUtm) << name;
        EXPECT_EQ(std::get<Bundle>(*back).bounds, bundle->bounds) << name;
        const auto info = describe(folder_ / name, {}, job_);
        ASSERT_TRUE(info) << name;
        EXPECT_EQ((*info)["origin"], nlohmann::ordered_json({500000.0, 4000000.0, 100.0})) << name;
        EXPECT_NEAR((*info)["bounds"]["min"][1].get<double>(), 3999999, 1e-6) << name;
        EXPECT_NEAR((*info)["views"][0]["position"][1].get<double>(), 4000000, 100) << name;
    }
    const auto atlas = pack(*bundle, {}, job_);
    ASSERT_TRUE(atlas) << atlas.error().text();
    for (const char* name : {"atlas", "atlas.exr"}) {
        ASSERT_TRUE(save(*atlas, folder_ / name, {}, job_)) << name;
        const auto back = open(folder_ / name, {}, job_);
        ASSERT_TRUE(back) << name << ": " << back.error().text();
        EXPECT_EQ(originOf(*back), kUtm) << name;
        const auto again = convert(*back, {}, job_);
        ASSERT_TRUE(again);
        EXPECT_EQ(again->origin, kUtm) << name;
    }
}

TEST_F(Origin, ExportsAreInTheWorldAndComeBackToTheBit) {
    ConvertSettings views;
    views.views = "ring:3";
    views.width = views.height = 32;
    const auto bundle = convert(opened("far.obj", objText(kUtm)), views, job_);
    ASSERT_TRUE(bundle) << bundle.error().text();
    for (const auto kind : {ExportOptions::Kind::transforms, ExportOptions::Kind::miv}) {
        const bool miv = kind == ExportOptions::Kind::miv;
        const auto folder = folder_ / (miv ? "miv" : "nerf");
        ASSERT_TRUE(exportViews(*viewsOf(*bundle), folder, {.kind = kind}, job_));
        const auto back = open(folder, {}, job_);
        ASSERT_TRUE(back) << back.error().text();
        const auto& read = std::get<Bundle>(*back).views;
        EXPECT_EQ(originOf(*back), kUtm);
        for (std::size_t i = 0; i < read.size(); ++i)
            EXPECT_EQ(read[i].camera, bundle->views[i].camera) << i;
        const auto cameras =
            readCameraFile(folder / (miv ? "cameras.json" : "transforms.json"), job_);
        ASSERT_TRUE(cameras) << cameras.error().text();
        EXPECT_LT(
            glm::distance((*cameras)[1].camera.position, bundle->views[1].camera.position + kUtm),
            1e-6);
    }
}

TEST_F(Origin, PointsAreWrittenInTheWorld) {
    const std::vector<glm::vec3> positions = {{0.125f, 0, 0}, {2, 0.25f, 0}, {0, 1, 0.5f}};
    PointCloud cloud;
    cloud.positions = positions;
    cloud.origin = kUtm;
    ASSERT_TRUE(writePoints(folder_ / "p.ply", cloud, job_));
    const auto back = readGood(folder_ / "p.ply");
    EXPECT_EQ(back.mesh.origin, kUtm);
    EXPECT_EQ(back.mesh.positions, positions);
    ASSERT_TRUE(writePoints(folder_ / "p.drc", cloud, job_));
    const auto notes = job_.takeNotes();
    EXPECT_TRUE(std::any_of(notes.begin(), notes.end(), [](const std::string& n) {
        return n.find("without the origin 500000 4000000 100") != std::string::npos;
    }));
}

TEST_F(Origin, ImageSetsFarOffGetOne) {
    ConvertSettings views;
    views.views = "ring:3";
    views.width = views.height = 32;
    auto bundle = convert(opened("near.obj", objText({})), views, job_);
    ASSERT_TRUE(bundle);
    const auto local = bundle->views[0].camera.position;
    for (auto& view : bundle->views) view.camera.position += kUtm;
    ASSERT_TRUE(exportViews(*viewsOf(*bundle), folder_ / "set", {}, job_));
    const auto back = open(folder_ / "set", {}, job_);
    ASSERT_TRUE(back) << back.error().text();
    EXPECT_EQ(originOf(*back), kUtm);
    EXPECT_LT(glm::distance(std::get<Bundle>(*back).views[0].camera.position, local), 1e-6);
}

}  // namespace
}  // namespace stx

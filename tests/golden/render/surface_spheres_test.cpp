// Surface mode against the ray-cast ground truth of spheres-miv, four sources in.

#include <array>
#include <cmath>
#include <fstream>
#include <map>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "formats/files/files.hpp"
#include "formats/images/images.hpp"
#include "lib/render/surface/cpu/cpu_surface.hpp"
#include "tests/shared_data.hpp"

namespace stx {
namespace {

DecodedImage load(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    const std::string text((std::istreambuf_iterator<char>(file)), {});
    auto image = decodeImage(std::as_bytes(std::span(text)), path.string(), Limits{});
    if (!image) throw std::runtime_error(image.error().text());
    return std::move(*image);
}

/// A camera of MIV's JSON: x forward, y left, z up; yaw, pitch, roll in degrees.
Camera cameraFromMiv(const nlohmann::json& json) {
    const auto p = json["Position"].get<std::array<double, 3>>();
    const auto r = json["Rotation"].get<std::array<double, 3>>();
    const auto focal = json["Focal"].get<std::array<double, 2>>();
    const auto principal = json["Principle_point"].get<std::array<double, 2>>();
    const auto size = json["Resolution"].get<std::array<int, 2>>();
    const double degree = std::acos(-1.0) / 180.0;
    Camera c;
    c.position = {-p[1], p[2], -p[0]};
    c.orientation = glm::normalize(quatFromAxisAngle({0, 1, 0, r[0] * degree}) *
                                   quatFromAxisAngle({1, 0, 0, -r[1] * degree}) *
                                   quatFromAxisAngle({0, 0, 1, -r[2] * degree}));
    c.width = size[0];
    c.height = size[1];
    c.fx = focal[0];
    c.fy = focal[1];
    c.cx = principal[0];
    c.cy = principal[1];
    return c;
}

struct Spheres {
    std::filesystem::path folder;
    std::map<std::string, Camera> cameras;
    Bundle bundle;

    explicit Spheres(const std::filesystem::path& dir) : folder(dir) {
        const auto json = nlohmann::json::parse(std::ifstream(dir / "cameras.json"));
        for (const auto& camera : json["cameras"]) cameras[camera["Name"]] = cameraFromMiv(camera);
        for (const std::string name : {"v0", "v1", "v2", "v3"}) {
            ReferenceView view;
            view.name = name;
            view.camera = cameras[name];
            view.nearPlane = 1;
            view.farPlane = 20;
            view.texture = Texture(rgba8From(load(dir / (name + "_color.png"))));
            const auto depth = load(dir / (name + "_depth16.png"));
            const auto& codes = std::get<std::vector<std::uint16_t>>(depth.values);
            view.depth = Image<float>(depth.width, depth.height);
            for (std::size_t i = 0; i < codes.size(); ++i)
                view.depth.data()[i] = static_cast<float>(20.0 / (1.0 + codes[i] / 65535.0 * 19.0));
            bundle.views.push_back(std::move(view));
        }
    }
};

struct Figures {
    double all = 0, covered = 0, uncovered = 0;
};

/// Full-range BT.709 luma PSNR, over all pixels and on either side of the mask.
Figures measure(const Frame& frame, const Spheres& set, const std::string& name) {
    const auto truth = rgba8From(load(set.folder / (name + "_color.png")));
    const auto mask = rgba8From(load(set.folder / (name + "_covered.png")));
    double error[2] = {0, 0};
    double count[2] = {0, 0};
    for (std::size_t i = 0; i < truth.count(); ++i) {
        const glm::dvec3 weights(0.2126, 0.7152, 0.0722);
        const glm::dvec3 ours =
            glm::round(glm::clamp(glm::dvec3(frame.colour.data()[i]), 0.0, 1.0) * 255.0);
        const double difference = glm::dot(weights, ours - glm::dvec3(truth.data()[i]));
        const int side = mask.data()[i].r > 127 ? 0 : 1;
        error[side] += difference * difference;
        count[side] += 1;
    }
    const auto psnr = [](double e, double n) { return 10 * std::log10(255.0 * 255.0 * n / e); };
    return {psnr(error[0] + error[1], count[0] + count[1]), psnr(error[0], count[0]),
            psnr(error[1], count[1])};
}

struct Expected {
    Quality quality;
    double center, near, covered, uncovered;
};

void hold(const Expected& expected) {
    REQUIRE_SHARED(folder, "data/imagesets/spheres-miv");
    const Spheres set(folder);
    RenderSettings settings;
    settings.quality = expected.quality;
    Job job;
    const auto renderer = makeCpuSurfaceRenderer(set.bundle, settings, job);
    const std::pair<const char*, double> whole[] = {{"gt_center", expected.center},
                                                    {"gt_near", expected.near}};
    for (const auto& [name, least] : whole) {
        const auto frame = renderer->render(set.cameras.at(name));
        ASSERT_TRUE(frame);
        EXPECT_GT(measure(*frame, set, name).all, least - 0.2) << name;
    }
    const auto outside = renderer->render(set.cameras.at("gt_outside"));
    ASSERT_TRUE(outside);
    const Figures figures = measure(*outside, set, "gt_outside");
    EXPECT_GT(figures.covered, expected.covered - 0.2);
    EXPECT_GT(figures.uncovered, expected.uncovered - 0.2);
}

TEST(SurfaceSpheres, Normal) {
    hold({Quality::normal, 50.15, 50.0, 47.4, 24.1});
}
TEST(SurfaceSpheres, Best) {
    hold({Quality::best, 50.3, 50.15, 47.5, 24.1});
}

TEST(SurfaceSpheres, ASourcesOwnPoseComesBackExactly) {
    REQUIRE_SHARED(folder, "data/imagesets/spheres-miv");
    const Spheres set(folder);
    Job job;
    const auto renderer = makeCpuSurfaceRenderer(set.bundle, {}, job);
    const auto frame = renderer->render(set.cameras.at("v2"));
    ASSERT_TRUE(frame);
    const Rgba8Image& source = *set.bundle.views[2].texture.rgba8();
    std::size_t differing = 0;
    for (std::size_t i = 0; i < source.count(); ++i)
        differing += glm::u8vec4(glm::round(frame->colour.data()[i] * 255.0f)) != source.data()[i];
    EXPECT_EQ(differing, 0u);
}

}  // namespace
}  // namespace stx

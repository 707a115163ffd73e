#pragma once

#include <cmath>
#include <filesystem>
#include <string>

#include <unistd.h>

#include <gtest/gtest.h>

#include "formats/mpeg4/mpeg4.hpp"
#include "formats/mpeg4/text/bt.hpp"
#include "tests/temporary_folder.hpp"

namespace stx::mpeg4 {

/// A view with a slanted depth, a hole, colours that tell pixels apart, and soft coverage.
inline ReferenceView makeView(int width, int height, int depthBits, int seed = 1) {
    ReferenceView view;
    view.name = "view" + std::to_string(seed);
    view.camera =
        Camera::fromFieldOfView({1.5, -0.25, 7.0 + seed}, quatFromAxisAngle({0, 1, 0, 0.3 * seed}),
                                {0.75, 0.5}, false, width, height);
    view.nearPlane = 2.0;
    view.farPlane = 12.5;
    view.depthBits = depthBits;
    const DepthCode code{view.nearPlane, view.farPlane, depthBits == 8 ? 255u : 65535u};
    view.depth = Image<float>(width, height, kNoDepth);
    Rgba8Image texture(width, height);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            texture.at(x, y) = {static_cast<unsigned char>(x * 9 + seed),
                                static_cast<unsigned char>(y * 11),
                                static_cast<unsigned char>((x * y) % 251), 255};
            if ((x + y) % 5 == 0) {
                texture.at(x, y).a = 0;
                continue;
            }
            const auto d = static_cast<std::uint32_t>(1 + (x * 977 + y * 3571 + seed) % code.dmax);
            view.depth.at(x, y) = static_cast<float>(code.decode(d));
        }
    }
    view.texture = Texture(std::move(texture));
    return view;
}

inline void addVectors(ReferenceView& view) {
    view.normal = Image<glm::vec3>(view.depth.width(), view.depth.height());
    view.splatU = view.normal;
    view.splatV = view.normal;
    for (int y = 0; y < view.depth.height(); ++y) {
        for (int x = 0; x < view.depth.width(); ++x) {
            if (!hasPoint(view.depth.at(x, y))) continue;
            view.normal.at(x, y) = glm::normalize(glm::vec3(0.02f * x, 0.03f * y - 0.2f, 1.0f));
            view.splatU.at(x, y) = glm::vec3(0.01f + 0.001f * x, -0.002f * y, 0.0f);
            view.splatV.at(x, y) = glm::vec3(-0.003f, 0.02f, 0.0005f * x);
        }
    }
}

inline Document sceneOf(const Bundle& bundle, const SceneWriteOptions& options = {}) {
    Job job;
    auto document = sceneFromBundle(bundle, options, job);
    if (!document) ADD_FAILURE() << document.error().text();
    return document ? std::move(*document) : Document();
}
inline Bundle bundleOf(const Document& document) {
    Job job;
    auto bundle = bundleFromScene(document, {}, job);
    if (!bundle) ADD_FAILURE() << bundle.error().text();
    return bundle ? std::move(*bundle) : Bundle();
}
/// Cameras that see the same to float precision.
inline void expectSameCamera(const Camera& a, const Camera& b, double tolerance = 1e-6) {
    EXPECT_EQ(a.width, b.width);
    EXPECT_EQ(a.height, b.height);
    EXPECT_EQ(a.orthographic, b.orthographic);
    EXPECT_NEAR(a.fx / b.fx, 1.0, tolerance);
    EXPECT_NEAR(a.fy / b.fy, 1.0, tolerance);
    EXPECT_NEAR(a.cx, b.cx, tolerance * a.width);
    EXPECT_NEAR(a.cy, b.cy, tolerance * a.height);
    EXPECT_LT(glm::length(a.position - b.position), tolerance * (1 + glm::length(a.position)));
    EXPECT_GT(std::abs(glm::dot(a.orientation, b.orientation)), 1 - tolerance);
}

inline Bytes bytesOfFile(const std::filesystem::path& path) {
    auto bytes = readFile(path, Limits());
    if (!bytes) ADD_FAILURE() << bytes.error().text();
    return bytes ? std::move(*bytes) : Bytes();
}

/// What is read from BT nodes under one Group.
inline Result<Bundle> bundleFromText(const std::string& nodes) {
    Job job;
    auto document = readBt("Group { children [ " + nodes + " ] }", "test.bt", job);
    if (!document) return propagate(document);
    return bundleFromScene(*document, {}, job);
}
inline Bundle mustRead(const std::string& nodes) {
    auto bundle = bundleFromText(nodes);
    if (!bundle) ADD_FAILURE() << bundle.error().text() << "\n" << nodes;
    return bundle ? std::move(*bundle) : Bundle();
}
inline std::string errorOf(const std::string& nodes) {
    auto bundle = bundleFromText(nodes);
    return bundle ? "no error" : bundle.error().text();
}

/// 2x2 pixels: lower left 0, lower right 64, upper left 128, upper right 255.
inline constexpr const char* kPixels =
    "SimpleTexture { texture PixelTexture { image 2 2 3 0xFF0000 0x00FF00 0x0000FF 0xFFFFFF } "
    "depth PixelTexture { image 2 2 1 0 64 128 255 } }";

inline std::string depthImage(const std::string& fields = "") {
    return "DepthImage { nearPlane 1 farPlane 9 orthographic FALSE fieldOfView 0.5 0.5 " + fields +
           " diTexture " + kPixels + " }";
}

}  // namespace stx::mpeg4

#pragma once

#include <gtest/gtest.h>

#include "lib/capture/capture.hpp"
#include "lib/geometry/view_layout.hpp"

/// A torus from 14 sides, its colour changing from place to place; `shift` moves it, not the
/// cameras.
inline stx::Bundle torusViews(int side = 192, glm::dvec3 shift = glm::dvec3(0.0),
                              stx::ViewLayout layout = {stx::ViewLayout::Kind::sphere, 14, 0}) {
    using namespace stx;
    Mesh mesh;
    mesh.materials.emplace_back();
    constexpr int kAround = 96, kAcross = 48;
    for (int i = 0; i < kAround; ++i) {
        for (int j = 0; j < kAcross; ++j) {
            const double a = i * 6.283185307179586 / kAround, b = j * 6.283185307179586 / kAcross;
            const double r = 0.75 + 0.3 * std::cos(b);
            mesh.positions.emplace_back(r * std::cos(a), 0.3 * std::sin(b), r * std::sin(a));
            mesh.colours.emplace_back(0.5 + 0.4 * std::sin(3 * a), 0.5 + 0.4 * std::cos(b),
                                      0.5 + 0.4 * std::sin(a + 2 * b), 1);
            const auto at = [](int k, int l) { return (k % kAround) * kAcross + l % kAcross; };
            mesh.triangles.emplace_back(at(i, j), at(i, j + 1), at(i + 1, j + 1));
            mesh.triangles.emplace_back(at(i, j), at(i + 1, j + 1), at(i + 1, j));
        }
    }
    mesh.triangleMaterial.assign(mesh.triangles.size(), 0);
    ViewFraming framing;
    framing.width = framing.height = side;
    Job job;
    const auto cameras = layoutCameras(layout, framing, mesh.positions);
    EXPECT_TRUE(cameras);
    for (auto& position : mesh.positions) position += shift;
    auto bundle = captureBundle(mesh, *cameras, {}, job);
    EXPECT_TRUE(bundle);
    return std::move(*bundle);
}

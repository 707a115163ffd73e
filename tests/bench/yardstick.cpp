#include "tests/bench/yardstick.hpp"

#include <chrono>
#include <cstring>
#include <limits>
#include <utility>

#include "lib/base/parallel.hpp"
#include "lib/render/bench/analytic_scene.hpp"

namespace stx::bench {
namespace {

constexpr int kReferences = 4;

}  // namespace

Yardstick::Yardstick()
    : bundle_(analyticBundle(AnalyticScene::room, kReferences)),
      novel_(analyticCamera(AnalyticScene::room, 1.5, kReferences)) {}

void NearestPoints::clear(std::size_t pixels) {
    depth.assign(pixels, std::numeric_limits<float>::infinity());
    colour.resize(pixels);
}

double Yardstick::points() const {
    return static_cast<double>(bundle_.pointCount());
}

double Yardstick::draw() {
    const auto start = std::chrono::steady_clock::now();
    nearest_.clear(static_cast<std::size_t>(novel_.width) * novel_.height);
    for (const auto& view : bundle_.views) splat(view);
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double Yardstick::drawInVectors() {
    const auto start = std::chrono::steady_clock::now();
    const auto pixels = static_cast<std::size_t>(novel_.width) * novel_.height;
    const auto threads = static_cast<std::size_t>(threadCount());
    ofThreads_.resize(threads);
    parallelFor(0, static_cast<std::int64_t>(threads), [&](std::int64_t i) {
        NearestPoints& own = ofThreads_[static_cast<std::size_t>(i)];
        own.clear(pixels);
        for (const auto& view : bundle_.views) {
            const auto row = [&](std::int64_t n) {
                return static_cast<int>(view.camera.height * n / static_cast<int>(threads));
            };
            splatRows(view, novel_, row(i), row(i + 1), own);
        }
    });
    parallelForBlocks(
        0, static_cast<std::int64_t>(pixels), 1 << 16, [&](std::int64_t from, std::int64_t to) {
            keepNearest(ofThreads_, static_cast<std::size_t>(from), static_cast<std::size_t>(to));
        });
    std::swap(nearest_, ofThreads_.front());
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void Yardstick::splat(const ReferenceView& view) {
    const Camera& c = view.camera;
    const glm::mat4 m(novel_.cameraFromWorld() * c.worldFromCamera());
    const auto fx = static_cast<float>(novel_.fx), fy = static_cast<float>(novel_.fy);
    const auto cx = static_cast<float>(novel_.cx), cy = static_cast<float>(novel_.cy);
    const auto sourceFx = static_cast<float>(c.fx), sourceFy = static_cast<float>(c.fy);
    const auto sourceCx = static_cast<float>(c.cx), sourceCy = static_cast<float>(c.cy);
    const auto* colours = view.texture.rgba8()->data();
    for (int y = 0; y < c.height; ++y) {
        for (int x = 0; x < c.width; ++x) {
            const float z = view.depth.at(x, y);
            if (!hasPoint(z)) continue;
            const float px = (x + 0.5f - sourceCx) / sourceFx * z;
            const float py = -(y + 0.5f - sourceCy) / sourceFy * z;
            const float qx = m[0][0] * px + m[1][0] * py - m[2][0] * z + m[3][0];
            const float qy = m[0][1] * px + m[1][1] * py - m[2][1] * z + m[3][1];
            const float depth = -(m[0][2] * px + m[1][2] * py - m[2][2] * z + m[3][2]);
            if (!(depth > 0)) continue;
            const float u = cx + fx * qx / depth, v = cy - fy * qy / depth;
            if (u < 0 || v < 0) continue;
            const int i = static_cast<int>(u), j = static_cast<int>(v);
            if (i >= novel_.width || j >= novel_.height) continue;
            const auto at = static_cast<std::size_t>(j) * novel_.width + i;
            if (depth >= nearest_.depth[at]) continue;
            nearest_.depth[at] = depth;
            std::memcpy(&nearest_.colour[at], &colours[static_cast<std::size_t>(y) * c.width + x],
                        4);
        }
    }
}

}  // namespace stx::bench

#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "lib/render/bench/analytic_scene.hpp"
#include "lib/render/device/egl_context.hpp"
#include "lib/render/factory.hpp"
#include "tests/unit/render_gpu/gpu_driver.hpp"

namespace stx::test {

inline double psnr(const Image<glm::vec4>& a, const Image<glm::vec4>& b) {
    if (a.size() != b.size()) return 0;
    double sum = 0;
    for (std::size_t i = 0; i < a.count(); ++i) {
        const glm::vec4 d = a.pixels()[i] - b.pixels()[i];
        sum += double(d.r) * d.r + double(d.g) * d.g + double(d.b) * d.b;
    }
    if (sum == 0) return std::numeric_limits<double>::infinity();
    return 10 * std::log10(3.0 * static_cast<double>(a.count()) / sum);
}

/// Premultiplied picture of a view.
inline Image<glm::vec4> pictureOf(const ReferenceView& view) {
    Image<glm::vec4> out(view.camera.width, view.camera.height);
    for (int y = 0; y < out.height(); ++y)
        for (int x = 0; x < out.width(); ++x) {
            const glm::vec4 c = view.texture.at(x, y);
            out.at(x, y) = {glm::vec3(c) * c.a, c.a};
        }
    return out;
}

/// Pixels of one image that are points where the other has none.
inline int coverageDifference(const Image<float>& a, const Image<float>& b) {
    int n = 0;
    for (std::size_t i = 0; i < a.count(); ++i)
        n += hasPoint(a.pixels()[i]) != hasPoint(b.pixels()[i]) ? 1 : 0;
    return n;
}

inline RenderSettings splatSettings(SplatRule rule = SplatRule::data) {
    RenderSettings s;
    s.mode = RenderMode::splat;
    s.splat = rule;
    return s;
}

/// One frame, of a bundle or an atlas, of a renderer made for it.
template <class Model>
Result<Frame> drawOn(Backend backend, const Model& model, const RenderSettings& settings,
                     const Camera& camera) {
    Job job;
    STX_TRY(auto renderer, makeRenderer(backend, model, settings, -1, job));
    return renderer->render(camera);
}

/// What the processor draws.
inline Frame drawOnCpu(const Bundle& bundle, const RenderSettings& settings, const Camera& camera) {
    auto frame = drawOn(Backend::cpu, bundle, settings, camera);
    EXPECT_TRUE(frame) << (frame ? "" : frame.error().text());
    return frame ? std::move(*frame) : Frame{};
}

/// Holds what a GPU drew against what the processor draws: colours to 45 dB, and which pixels are
/// covered but for one in 2,000, or `strays`.
inline void expectAgreement(const Result<Frame>& frame, const Frame& expected,
                            const std::string& what, int strays = 0) {
    ASSERT_TRUE(frame) << frame.error().text();
    ASSERT_EQ(frame->colour.size(), expected.colour.size());
    const double agreement = psnr(frame->colour, expected.colour);
    testing::Test::RecordProperty(what, fmt::format("{:.1f} dB", agreement));
    EXPECT_GT(agreement, 45.0) << what;
    EXPECT_LE(coverageDifference(frame->depth, expected.depth),
              std::max(strays, static_cast<int>(frame->depth.count() / 2000)))
        << what;
    int drawn = 0;
    for (const float d : frame->depth.pixels()) drawn += hasPoint(d) ? 1 : 0;
    EXPECT_GT(drawn, 100) << what;
}

/// Puts faults into every context made while it lives.
struct WithFaults {
    explicit WithFaults(const gpu::Faults& faults) { gpu::setFaultsForTests(faults); }
    ~WithFaults() { gpu::setFaultsForTests({}); }
};

/// A camera smaller than the scene's own, so that tests stay quick.
inline Camera small(Camera camera, int width) {
    return camera.resized(width, width * camera.height / camera.width);
}

inline Bundle smallRoom(int references, int width = 256) {
    Bundle bundle;
    for (int i = 0; i < references; ++i) {
        bundle.views.push_back(viewOfAnalyticScene(
            AnalyticScene::room, small(analyticCamera(AnalyticScene::room, i, references), width),
            2));
        bundle.views.back().name = fmt::format("view{}", i);
    }
    return bundle;
}

}  // namespace stx::test

#include "lib/refine/plane_samples.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <hwy/targets.h>

namespace stx {
namespace {

constexpr int kAcross = 19, kDown = 13;

/// The definition, of one sample.
float differenceOf(const PixelPlane& plane, float x, float y, const PlaneSamples& samples,
                   std::size_t k, const OtherView& other) {
    const float dx = samples.dx[k], dy = samples.dy[k];
    const float q = plane.q + plane.gx * dx + plane.gy * dy;
    if (!(q > 0.0f)) return kMostDifferent;
    const glm::vec4 h = other.warp.homogeneous(x + dx, y + dy, q);
    if (!(h.w > 0.0f)) return -1.0f;
    const float u = h.x / h.w, v = h.y / h.w, there = h.z / h.w;
    if (!(u >= 0.0f && v >= 0.0f && u < kAcross && v < kDown)) return -1.0f;
    const float shown = other.q->at(static_cast<int>(u), static_cast<int>(v));
    if (shown > 0.0f && shown > there * (1.0f + kSamePlaceThere)) return -1.0f;
    if (shown > 0.0f && shown < there * (1.0f - kSamePlaceThere)) return kMostDifferent;
    const float px = std::clamp(u - 0.5f, 0.0f, kAcross - 1.0f),
                py = std::clamp(v - 0.5f, 0.0f, kDown - 1.0f);
    const int x0 = static_cast<int>(px), y0 = static_cast<int>(py);
    const float tx = px - static_cast<float>(x0), ty = py - static_cast<float>(y0);
    const glm::vec3 own(samples.red[k], samples.green[k], samples.blue[k]);
    float sum = 0;
    for (int c = 0; c < 3; ++c) {
        const auto at = [&](int i, int j) {
            return static_cast<float>(
                       other.colours->at(std::min(i, kAcross - 1), std::min(j, kDown - 1))[c]) /
                   255.0f;
        };
        const float above = at(x0, y0) * (1 - tx) + at(x0 + 1, y0) * tx;
        const float below = at(x0, y0 + 1) * (1 - tx) + at(x0 + 1, y0 + 1) * tx;
        sum += std::abs(own[c] - (above * (1 - ty) + below * ty));
    }
    return std::min(sum / 3.0f, kMostDifferent);
}

/// Views of random colours and depth, some of it missing, beside each other.
TEST(PlaneSamples, DifferencesAreThoseOfTheDefinition) {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> share(0.0f, 1.0f);
    Rgba8Image colours(kAcross, kDown);
    Image<float> q(kAcross, kDown, 0.0f);
    for (std::size_t i = 0; i < q.count(); ++i) {
        for (int c = 0; c < 3; ++c)
            colours.data()[i][c] = static_cast<std::uint8_t>(random() & 255);
        q.data()[i] = share(random) < 0.3f ? 0.0f : 0.49f + 0.02f * share(random);
    }
    glm::dmat4 m(1.0);
    m[2][0] = 3.0;   // nearer places are farther to the right
    m[0][3] = 0.01;  // and the views are turned a little
    const OtherView other{&colours, &q, warpFrom(m)};
    int absent = 0, most = 0, alike = 0;
    for (int n = 0; n < 2000; ++n) {
        PlaneSamples samples;
        for (std::size_t k = 0; k < PlaneSamples::kCount; ++k) {
            samples.red[k] = share(random);
            samples.green[k] = share(random);
            samples.blue[k] = share(random);
        }
        const float x = kAcross * share(random), y = kDown * share(random);
        const PixelPlane plane{0.5f * share(random) + 0.1f, 0.1f * (share(random) - 0.5f),
                               0.1f * (share(random) - 0.5f)};
        alignas(64) PlaneSamples::Floats found;
        for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
            hwy::SetSupportedTargetsForTest(target);
            hwy::GetChosenTarget().DeInit();
            differencesOn(plane, x, y, samples, other, found);
            hwy::SetSupportedTargetsForTest(0);
            hwy::GetChosenTarget().DeInit();
            for (std::size_t k = 0; k < PlaneSamples::kCount; ++k) {
                const float expected = differenceOf(plane, x, y, samples, k, other);
                ASSERT_NEAR(found[k], expected, 1e-4f)
                    << n << ", sample " << k << ", target " << target;
                absent += expected < 0;
                most += expected == kMostDifferent;
                alike += expected >= 0 && expected < kMostDifferent;
            }
        }
    }
    EXPECT_GT(absent, 1000);
    EXPECT_GT(most, 1000);
    EXPECT_GT(alike, 100);
}

}  // namespace
}  // namespace stx

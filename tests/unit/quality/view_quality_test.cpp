#include "lib/quality/view_quality.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace stx {
namespace {

/// Frames of one colour; the second camera's may differ.
class Plain : public Renderer {
  public:
    Plain(glm::vec4 first, glm::vec4 second, bool linear = false)
        : colours_{first, second}, linear_(linear) {}
    Result<Frame> render(const Camera& camera) override {
        Frame frame;
        const int which = camera.position.x > 0 ? 1 : 0;
        frame.colour = Image<glm::vec4>(camera.width, camera.height, colours_[which]);
        frame.linear = linear_;
        return frame;
    }
    [[nodiscard]] std::string backend() const override { return "cpu"; }
    [[nodiscard]] std::string device() const override { return "test"; }

  private:
    glm::vec4 colours_[2];
    bool linear_;
};

std::vector<Camera> twoCameras() {
    std::vector<Camera> cameras(2);
    for (auto& c : cameras) c.width = c.height = 16;
    cameras[1].position.x = 1;
    return cameras;
}

constexpr float kHalf = 128.0f / 255.0f, kHalfLinear = 0.21586f;
constexpr glm::vec4 kGrey(kHalf, kHalf, kHalf, 1.0f);

TEST(ViewQuality, IdenticalViewsHaveInfinitePsnr) {
    Plain truth(kGrey, kGrey);
    const Job job;
    const auto quality = ViewQuality::against(truth, twoCameras(), job);
    ASSERT_TRUE(quality) << quality.error().text();
    const auto psnr = quality->measure(truth, job);
    ASSERT_TRUE(psnr);
    EXPECT_TRUE(std::isinf(psnr->all));
    EXPECT_TRUE(std::isinf(psnr->worst));
}

TEST(ViewQuality, TheWorstViewAndAllTogether) {
    Plain truth(kGrey, kGrey),
        other(kGrey, kGrey + glm::vec4(1.0f / 255, 1.0f / 255, 1.0f / 255, 0));
    const Job job;
    const auto quality = ViewQuality::against(truth, twoCameras(), job);
    ASSERT_TRUE(quality);
    const auto psnr = quality->measure(other, job);
    ASSERT_TRUE(psnr);
    EXPECT_NEAR(psnr->worst, 20 * std::log10(255.0), 1e-9);
    EXPECT_NEAR(psnr->all, psnr->worst + 10 * std::log10(2.0), 1e-9);
}

TEST(ViewQuality, LinearLightIsComparedAsItIsSeenOnBlack) {
    const glm::vec3 light(kHalfLinear);
    Plain linear(glm::vec4(light, 0.5f), glm::vec4(light, 1.0f), true);
    Plain coded(glm::vec4(glm::vec3(kGrey), 0.75f), kGrey);
    const Job job;
    const auto quality = ViewQuality::against(linear, twoCameras(), job);
    ASSERT_TRUE(quality);
    EXPECT_TRUE(std::isinf(quality->measure(coded, job)->worst));
}

TEST(ViewQuality, StopsWhenCancelled) {
    Plain truth(kGrey, kGrey);
    Job job;
    job.cancelled = true;
    EXPECT_FALSE(ViewQuality::against(truth, twoCameras(), job));
}

}  // namespace
}  // namespace stx

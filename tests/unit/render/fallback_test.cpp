#include "lib/render/compose/fallback.hpp"

#include <gtest/gtest.h>

namespace stx {
namespace {

/// Draws so many frames, then fails for good.
class Failing final : public Renderer {
  public:
    Failing(int frames, ErrorCode code) : left_(frames), code_(code) {}
    Result<Frame> render(const Camera&) override {
        if (left_-- > 0) return Frame{};
        return fail(code_, "the device was lost");
    }
    std::string backend() const override { return "first"; }
    std::string device() const override { return "fragile"; }

  private:
    int left_;
    ErrorCode code_;
};

class Steady final : public Renderer {
  public:
    /// Its time says from which camera it was lit.
    Result<Frame> render(const Camera& camera) override {
        Frame frame;
        frame.milliseconds = lightPose(camera).position.x;
        return frame;
    }
    std::string backend() const override { return "second"; }
    std::string device() const override { return "steady"; }
};

std::function<Result<std::unique_ptr<Renderer>>()> steady(int& made) {
    return [&made]() -> Result<std::unique_ptr<Renderer>> {
        ++made;
        return std::make_unique<Steady>();
    };
}

TEST(Fallback, DrawsOnWithTheSecondAndSaysWhy) {
    Job job;
    int made = 0;
    const auto renderer =
        withFallback(std::make_unique<Failing>(2, ErrorCode::failed), steady(made), job);
    for (int i = 0; i < 5; ++i) {
        EXPECT_TRUE(renderer->render({})) << i;
        EXPECT_EQ(renderer->backend(), i < 2 ? "first" : "second");
    }
    EXPECT_EQ(made, 1);
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("the device was lost"), std::string::npos);
}

TEST(Fallback, DrawsOnInTheSameLight) {
    Job job;
    int made = 0;
    const auto renderer =
        withFallback(std::make_unique<Failing>(0, ErrorCode::failed), steady(made), job);
    Camera pose;
    pose.position.x = 7;
    renderer->lightFrom(pose);
    EXPECT_EQ(renderer->render({})->milliseconds, 7);
    renderer->lightFrom(std::nullopt);
    EXPECT_EQ(renderer->render({})->milliseconds, 0);
}

TEST(Fallback, PassesOtherErrorsOn) {
    Job job;
    int made = 0;
    const auto renderer =
        withFallback(std::make_unique<Failing>(0, ErrorCode::invalidInput), steady(made), job);
    const auto frame = renderer->render({});
    ASSERT_FALSE(frame);
    EXPECT_EQ(frame.error().code, ErrorCode::invalidInput);
    EXPECT_EQ(made, 0);
}

TEST(Fallback, TellsWhenTheSecondCannotBeMadeEither) {
    Job job;
    const auto renderer = withFallback(
        std::make_unique<Failing>(0, ErrorCode::failed),
        []() -> Result<std::unique_ptr<Renderer>> { return fail(ErrorCode::failed, "no memory"); },
        job);
    const auto frame = renderer->render({});
    ASSERT_FALSE(frame);
    EXPECT_EQ(frame.error().message, "no memory");
}

}  // namespace
}  // namespace stx

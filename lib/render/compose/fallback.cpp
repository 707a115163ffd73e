#include "lib/render/compose/fallback.hpp"

#include <utility>

namespace stx {
namespace {

class FallbackRenderer final : public Renderer {
  public:
    FallbackRenderer(std::unique_ptr<Renderer> first,
                     std::function<Result<std::unique_ptr<Renderer>>()> makeSecond, Job& job)
        : current_(std::move(first)), makeSecond_(std::move(makeSecond)), job_(job) {}

    Result<Frame> render(const Camera& camera) override {
        auto frame = current_->render(camera);
        if (frame || frame.error().code != ErrorCode::failed || !makeSecond_ || job_.cancelled)
            return frame;
        STX_TRY(auto second, std::exchange(makeSecond_, nullptr)());
        job_.note(fmt::format("the {} backend failed ({}); the {} backend draws from here on",
                              current_->backend(), frame.error().text(), second->backend()));
        current_ = std::move(second);
        current_->averagedBy(factor_);
        current_->lightFrom(lights_);
        return current_->render(camera);
    }
    void expect(const Camera& next) override { current_->expect(next); }
    void averagedBy(int factor) override {
        factor_ = factor;
        current_->averagedBy(factor);
    }
    void lightFrom(const std::optional<Camera>& pose) override {
        lights_ = pose;
        current_->lightFrom(pose);
    }
    void reuse(Frame&& frame) override { current_->reuse(std::move(frame)); }
    std::string backend() const override { return current_->backend(); }
    std::string device() const override { return current_->device(); }

  private:
    std::unique_ptr<Renderer> current_;
    std::function<Result<std::unique_ptr<Renderer>>()> makeSecond_;
    Job& job_;
    int factor_ = 1;                ///< see averagedBy()
    std::optional<Camera> lights_;  ///< see lightFrom()
};

}  // namespace

std::unique_ptr<Renderer> withFallback(
    std::unique_ptr<Renderer> first, std::function<Result<std::unique_ptr<Renderer>>()> makeSecond,
    Job& job) {
    return std::make_unique<FallbackRenderer>(std::move(first), std::move(makeSecond), job);
}

}  // namespace stx

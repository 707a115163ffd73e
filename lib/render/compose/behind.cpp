#include "lib/render/compose/behind.hpp"

#include <utility>

#include "lib/base/parallel.hpp"

namespace stx {
namespace {

/// A background nearer than this share of the surface before it is something else, that is not
/// there now; the same surface may be as near.
constexpr float kClearlyInFront = 0.97f;
/// A pixel open by more than this share shows the background in the first place.
constexpr float kOpen = 0.5f;

class BackgroundRenderer final : public Renderer {
  public:
    BackgroundRenderer(std::unique_ptr<Renderer> front, std::unique_ptr<Renderer> background,
                       double farAway)
        : front_(std::move(front)), background_(std::move(background)), farAway_(farAway) {}

    Result<Frame> render(const Camera& camera) override {
        STX_TRY(Frame frame, front_->render(camera));
        STX_TRY(Frame background, background_->render(camera));
        putBehind(frame, background, [](int, int, float) { return false; });
        forgetFar(frame.depth, farAway_);
        frame.milliseconds += background.milliseconds;
        background_->reuse(std::move(background));
        return frame;
    }
    void expect(const Camera& next) override {
        front_->expect(next);
        background_->expect(next);
    }
    void lightFrom(const std::optional<Camera>& pose) override {
        front_->lightFrom(pose);
        background_->lightFrom(pose);
    }
    void reuse(Frame&& frame) override { front_->reuse(std::move(frame)); }
    std::string backend() const override { return front_->backend(); }
    std::string device() const override { return front_->device(); }

  private:
    std::unique_ptr<Renderer> front_, background_;
    double farAway_;
};

}  // namespace

void putBehind(Frame& front, const Frame& background, const MayStand& mayStand) {
    const int width = front.colour.width(), height = front.colour.height();
    parallelForBlocks(0, height, 16, [&](std::int64_t from, std::int64_t to) {
        for (std::size_t i = static_cast<std::size_t>(from) * width;
             i < static_cast<std::size_t>(to) * width; ++i) {
            glm::vec4& colour = front.colour.data()[i];
            const glm::vec4 behind = background.colour.data()[i];
            if (!(behind.a > 0.0f)) continue;
            float& depth = front.depth.data()[i];
            const float there = background.depth.data()[i];
            const bool hides =
                hasPoint(depth) && hasPoint(there) && there < kClearlyInFront * depth;
            if (hides) {
                const auto at = static_cast<int>(i);
                if (!mayStand(at % width, at / width, there)) continue;
                colour *= 1.0f - behind.a;
            } else if (colour.a >= kCoveredInFull) {
                continue;
            }
            const float open = 1.0f - colour.a;
            colour += behind * (hides ? 1.0f : open);
            if (!front.albedo.empty() && !background.albedo.empty()) {
                glm::vec4& albedo = front.albedo.data()[i];
                const glm::vec4 other = background.albedo.data()[i];
                albedo =
                    hides ? albedo * (1.0f - other.a) + other : albedo + other * (1.0f - albedo.a);
            }
            if (hasPoint(depth) && open <= kOpen) continue;
            depth = there;
            if (!front.normal.empty() && !background.normal.empty())
                front.normal.data()[i] = background.normal.data()[i];
        }
    });
}

void forgetFar(Image<float>& depth, double farAway) {
    if (!(farAway > 0)) return;
    const auto limit = static_cast<float>(0.5 * farAway);
    parallelFor(0, depth.count(), 1 << 16, [&](std::int64_t i) {
        if (depth.data()[i] > limit) depth.data()[i] = kNoDepth;
    });
}

std::unique_ptr<Renderer> withBackground(std::unique_ptr<Renderer> front,
                                         std::unique_ptr<Renderer> background, double farAway) {
    return std::make_unique<BackgroundRenderer>(std::move(front), std::move(background), farAway);
}

}  // namespace stx

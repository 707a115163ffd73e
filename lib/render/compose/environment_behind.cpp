#include "lib/render/compose/environment_behind.hpp"

#include <utility>

#include "lib/base/parallel.hpp"
#include "lib/base/stopwatch.hpp"
#include "lib/render/compose/behind.hpp"

namespace stx {
namespace {

class EnvironmentRenderer final : public Renderer {
  public:
    EnvironmentRenderer(std::unique_ptr<Renderer> inner,
                        std::shared_ptr<const EnvironmentMap> environment)
        : inner_(std::move(inner)), environment_(std::move(environment)) {}

    Result<Frame> render(const Camera& camera) override {
        STX_TRY(Frame frame, inner_->render(camera));
        const Stopwatch watch;
        putEnvironmentBehind(frame, camera, *environment_);
        frame.milliseconds += watch.milliseconds();
        return frame;
    }
    void expect(const Camera& next) override { inner_->expect(next); }
    void lightFrom(const std::optional<Camera>& pose) override { inner_->lightFrom(pose); }
    void reuse(Frame&& frame) override { inner_->reuse(std::move(frame)); }
    std::string backend() const override { return inner_->backend(); }
    std::string device() const override { return inner_->device(); }

  private:
    std::unique_ptr<Renderer> inner_;
    std::shared_ptr<const EnvironmentMap> environment_;
};

}  // namespace

void putEnvironmentBehind(Frame& frame, const Camera& camera, const EnvironmentMap& environment) {
    const glm::mat3 fromCamera =
        environment.environmentFromWorld() * glm::mat3(glm::mat3_cast(camera.orientation));
    const glm::vec3 right = fromCamera[0], up = fromCamera[1], forward = -fromCamera[2];
    const bool linear = frame.linear;
    const auto spacing = static_cast<float>(std::max(1.0 / camera.fx, 1.0 / camera.fy));
    const glm::vec4 all =
        camera.orthographic ? environment.sampleTurned(forward, 0, linear) : glm::vec4(0.0f);
    const int width = frame.colour.width();
    parallelFor(0, frame.colour.height(), 4, [&](int y) {
        const auto row = frame.colour.row(y);
        const glm::vec3 begin =
            forward - up * static_cast<float>((y + 0.5 - camera.cy) / camera.fy);
        for (int x = 0; x < width; ++x) {
            glm::vec4& colour = row[x];
            if (colour.a >= kCoveredInFull) {
                colour /= colour.a;
                continue;
            }
            const glm::vec4 behind =
                camera.orthographic
                    ? all
                    : environment.sampleTurned(
                          begin + right * static_cast<float>((x + 0.5 - camera.cx) / camera.fx),
                          spacing, linear);
            colour += behind * (1.0f - std::max(colour.a, 0.0f));
            if (behind.a >= 1.0f) colour.a = 1.0f;  // but for rounding
        }
    });
}

std::unique_ptr<Renderer> withEnvironment(std::unique_ptr<Renderer> inner,
                                          std::shared_ptr<const EnvironmentMap> environment) {
    return std::make_unique<EnvironmentRenderer>(std::move(inner), std::move(environment));
}

}  // namespace stx

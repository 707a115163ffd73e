#include "lib/render/compose/footprint.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "lib/base/parallel.hpp"

namespace stx {
namespace {

/// Points that are looked at in each view, along a side: enough for a median.
constexpr int kGrid = 24;
/// Samples to a pixel, along a side, up to which renderers do well by themselves; chosen by trial
/// on the project's image sets.
constexpr double kEnough = 1.5;
/// A larger picture has at most this many times the width.
constexpr int kMostFactor = 16;
/// Pixels of the larger picture.
constexpr double kMostPixels = 16e6;
/// Bytes of one of its pixels: colour, albedo, normal, depth, and what surface mode keeps beside.
constexpr std::uint64_t kBytesEach = 64;

class FootprintRenderer final : public Renderer {
  public:
    FootprintRenderer(std::unique_ptr<Renderer> inner, const PageSet& set,
                      const RenderSettings& settings, Job& job)
        : inner_(std::move(inner)),
          set_(set),
          footprint_(set),
          lit_(settings.lighting.on()),
          log_(settings.log),
          job_(job) {}

    Result<Frame> render(const Camera& camera) override {
        STX_CHECK(camera.check());
        const int factor = factorOf(camera);
        large_ = factor > 1;
        inner_->averagedBy(factor);
        if (!large_) return inner_->render(camera);
        STX_TRY(Frame large, inner_->render(enlarged(camera, factor)));
        StageTimer timer(log_.get(), "footprint");
        if (!radius_) radius_ = set_.bounds().radius();
        Frame out = minified(large, factor, ShareLength(camera, *radius_));
        timer.changed(static_cast<std::int64_t>(out.depth.count()));
        inner_->reuse(std::move(large));
        return out;
    }
    void expect(const Camera& next) override {
        if (next.check()) inner_->expect(enlarged(next, factorOf(next)));
    }
    void lightFrom(const std::optional<Camera>& pose) override { inner_->lightFrom(pose); }
    void reuse(Frame&& frame) override {
        // Beside a larger one, which is kept already, it is of no use.
        if (!large_) inner_->reuse(std::move(frame));
    }
    std::string backend() const override { return inner_->backend(); }
    std::string device() const override { return inner_->device(); }

  private:
    static Camera enlarged(const Camera& camera, int factor) {
        return factor == 1 ? camera : camera.resized(camera.width * factor, camera.height * factor);
    }
    [[nodiscard]] int factorOf(const Camera& camera) const {
        // In sets of mixed resolution a small view's own pose looks like a reduced picture of the
        // large ones; renderers return it exactly, but for its light.
        if (!lit_ && std::any_of(set_.views().begin(), set_.views().end(),
                                 [&](const PageView& v) { return sameCamera(v.camera, camera); }))
            return 1;
        int factor = footprint_.factor(camera);
        const double pixels = static_cast<double>(camera.width) * camera.height;
        const auto largeOf = [&](int times) { return pixels * times * times; };
        while (factor > 1 && largeOf(factor) > kMostPixels) --factor;
        const int wanted = factor;
        const auto holds = [&](int times) {
            return job_.limits
                .checkAllocation(static_cast<std::uint64_t>(largeOf(times)), kBytesEach, "")
                .has_value();
        };
        while (factor > 1 && !holds(factor)) --factor;
        if (factor < wanted)
            job_.noteOnce(fmt::format(
                "pictures are the mean of {0}x{0} smaller pixels, not of {1}x{1} as these views "
                "need: the memory limit holds no more; --max-memory {2} would do",
                factor, wanted,
                static_cast<std::uint64_t>(largeOf(wanted)) * kBytesEach / (1 << 20) + 1));
        return factor;
    }

    std::unique_ptr<Renderer> inner_;
    PageSet set_;
    Footprint footprint_;
    std::optional<double> radius_;  ///< of the scene, once it was needed
    bool lit_;
    std::shared_ptr<StageLog> log_;
    Job& job_;
    bool large_ = false;  ///< the last frame came from a larger one
};

}  // namespace

Footprint::Footprint(const PageSet& set) {
    for (std::size_t v = 0; v < set.views().size(); ++v) {
        const Camera& c = set.views()[v].camera;
        if (set.views()[v].unread) continue;  // no point of it is in a picture
        for (int j = 0; j < kGrid; ++j) {
            for (int i = 0; i < kGrid; ++i) {
                const int x = (2 * i + 1) * c.width / (2 * kGrid);
                const int y = (2 * j + 1) * c.height / (2 * kGrid);
                const float depth = set.depth(v, x, y);
                if (!hasPoint(depth)) continue;
                const glm::dvec2 spacing = c.sampleSpacing(depth);
                points_.push_back(
                    {c.position + c.orientation * c.unproject(x + 0.5, y + 0.5, depth),
                     0.5 * (spacing.x + spacing.y)});
            }
        }
    }
}

double Footprint::samplesPerPixel(const Camera& camera) const {
    const glm::dmat4 cameraFromWorld = camera.cameraFromWorld();
    std::vector<double> ratios;
    for (const SampledPoint& p : points_) {
        const glm::dvec3 at(cameraFromWorld * glm::dvec4(p.world, 1.0));
        const double dist = -at.z;
        if (!(dist > 0)) continue;
        const double scale = camera.orthographic ? 1.0 : 1.0 / dist;
        const double x = camera.cx + camera.fx * at.x * scale;
        const double y = camera.cy - camera.fy * at.y * scale;
        if (!(x >= 0 && y >= 0 && x < camera.width && y < camera.height)) continue;
        const glm::dvec2 spacing = camera.sampleSpacing(dist);
        ratios.push_back(0.5 * (spacing.x + spacing.y) / p.spacing);
    }
    if (ratios.empty()) return 1.0;
    const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
    std::nth_element(ratios.begin(), middle, ratios.end());
    return *middle;
}

int Footprint::factor(const Camera& camera) const {
    const double ratio = samplesPerPixel(camera);
    if (!(ratio > kEnough)) return 1;
    return static_cast<int>(std::lround(std::min(ratio, double{kMostFactor})));
}

namespace {

/// The middle four of the pixels that become one are one surface within this share of the
/// ShareLength at their depth, as samples of a pixel are within one of q (kOneSurface of
/// shaders/shared/surface_constants.glsl).
constexpr double kOneDepth = 0.01;

/// Depth where four pixels meet: their mean where they are one surface, else the first of them that
/// has a point.
float depthAmid(const std::array<float, 4>& d, const ShareLength& shares) {
    const auto [least, most] = std::minmax_element(d.begin(), d.end());
    if (*least > 0.0f && hasPoint(*most) && *most - *least <= kOneDepth * shares.at(*least))
        return 0.25f * ((d[0] + d[3]) + (d[1] + d[2]));
    const auto first = std::find_if(d.begin(), d.end(), hasPoint);
    return first == d.end() ? kNoDepth : *first;
}

/// A row of minified() by 2 of colour and depth alone, which is what most pictures are.
void halveRow(const Frame& large, int y, const ShareLength& shares, Frame& out) {
    const float* above = &large.colour.row(2 * y).data()->x;
    const float* below = &large.colour.row(2 * y + 1).data()->x;
    const float* depthAbove = large.depth.row(2 * y).data();
    const float* depthBelow = large.depth.row(2 * y + 1).data();
    float* colour = &out.colour.row(y).data()->x;
    float* depth = out.depth.row(y).data();
    for (int x = 0; x < out.depth.width(); ++x, above += 8, below += 8, colour += 4) {
        float sum[4];
        for (int c = 0; c < 4; ++c) sum[c] = above[c] + above[4 + c];
        for (int c = 0; c < 4; ++c) sum[c] += below[c];
        for (int c = 0; c < 4; ++c) sum[c] += below[4 + c];
        for (int c = 0; c < 4; ++c) colour[c] = sum[c] * 0.25f;
        const std::array<float, 4> d{depthAbove[2 * x], depthAbove[2 * x + 1], depthBelow[2 * x],
                                     depthBelow[2 * x + 1]};
        depth[x] = std::ranges::count_if(d, hasPoint) >= 2 ? depthAmid(d, shares) : kNoDepth;
    }
}

}  // namespace

Frame minified(const Frame& large, int factor, const ShareLength& shares) {
    const int width = large.colour.width() / factor, height = large.colour.height() / factor;
    Frame out;
    out.linear = large.linear;
    out.milliseconds = large.milliseconds;
    out.colour = Image<glm::vec4>(width, height);
    out.depth = Image<float>(width, height, kNoDepth);
    if (!large.albedo.empty()) out.albedo = Image<glm::vec4>(width, height);
    if (!large.normal.empty()) out.normal = Image<glm::vec3>(width, height);
    const float share = 1.0f / static_cast<float>(factor * factor);
    const auto pixel = [&](int x, int y) {
        glm::vec4 colour(0.0f), albedo(0.0f);
        glm::vec3 normal(0.0f);
        float depth = kNoDepth;
        int covered = 0, nearest = 4 * factor * factor;
        for (int j = 0; j < factor; ++j) {
            for (int i = 0; i < factor; ++i) {
                const int sx = x * factor + i, sy = y * factor + j;
                colour += large.colour.at(sx, sy);
                if (!large.albedo.empty()) albedo += large.albedo.at(sx, sy);
                if (!large.normal.empty()) normal += large.normal.at(sx, sy);
                const float d = large.depth.at(sx, sy);
                if (!hasPoint(d)) continue;
                ++covered;
                // Twice the offset from the centre, squared.
                const int dx = 2 * i + 1 - factor, dy = 2 * j + 1 - factor;
                if (const int at = dx * dx + dy * dy; at < nearest) {
                    nearest = at;
                    depth = d;
                }
            }
        }
        // Of an even number none is in the middle.
        if (const int middle = factor / 2; factor % 2 == 0) {
            const auto at = [&](int i, int j) {
                return large.depth.at(x * factor + middle - 1 + i, y * factor + middle - 1 + j);
            };
            const float amid = depthAmid({at(0, 0), at(1, 0), at(0, 1), at(1, 1)}, shares);
            if (hasPoint(amid)) depth = amid;
        }
        out.colour.at(x, y) = colour * share;
        if (2 * covered >= factor * factor) out.depth.at(x, y) = depth;
        if (!out.albedo.empty()) out.albedo.at(x, y) = albedo * share;
        if (const float length = glm::length(normal); !out.normal.empty() && length > 1e-6f)
            out.normal.at(x, y) = normal / length;
    };
    const bool plain = factor == 2 && large.albedo.empty() && large.normal.empty();
    parallelFor(0, height, 16, [&](int y) {
        if (plain) {
            halveRow(large, y, shares, out);
            return;
        }
        for (int x = 0; x < width; ++x) pixel(x, y);
    });
    return out;
}

std::unique_ptr<Renderer> withFootprint(std::unique_ptr<Renderer> inner, const PageSet& set,
                                        const RenderSettings& settings, Job& job) {
    return std::make_unique<FootprintRenderer>(std::move(inner), set, settings, job);
}

}  // namespace stx

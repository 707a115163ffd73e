#include "lib/refine/gaps.hpp"

#include <algorithm>
#include <cmath>
#include <queue>
#include <tuple>
#include <utility>
#include <vector>

#include <glm/glm.hpp>

#include "lib/geometry/depth_code.hpp"

namespace stx {
namespace {

// Chosen by trial on Middlebury 2006, Aloe (tests/bench/pictures.md).
/// Gaps are closed up to the longer side divided by this.
constexpr int kReachDivisor = 50;
/// A path costs this much a pixel ...
constexpr float kStep = 0.002f;
/// ... and the change of colour (0..1 a channel) beyond what a camera's noise may be.
constexpr float kNoise = 0.02f;
/// Paths that cost more lead over an edge of the picture.
constexpr float kMost = 0.4f;
/// A jump of this share of the nearer distance is an edge of the depth.
constexpr float kJump = 0.01f;
/// The plane is fitted to pixels within this many of where the path begins ...
constexpr int kFitReach = 4;
/// ... and leads this share of the distance away at most.
constexpr float kFarthest = 0.03f;

constexpr std::pair<int, int> kNeighbours[4] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};

/// 1 / distance of the plane that fits the surface at (x0, y0), continued to (x, y): planes are
/// flat in it for perspective cameras.
float continued(const Image<float>& distances, int x0, int y0, int x, int y) {
    const float own = 1.0f / distances.at(x0, y0);
    float count = 0, sx = 0, sy = 0, sq = 0, xx = 1, xy = 0, yy = 1, xq = 0, yq = 0;
    for (int j = -kFitReach; j <= kFitReach; ++j) {
        for (int i = -kFitReach; i <= kFitReach; ++i) {
            if (!distances.contains(x0 + i, y0 + j)) continue;
            const float d = distances.at(x0 + i, y0 + j);
            if (!hasPoint(d)) continue;
            const float q = 1.0f / d - own;
            if (std::abs(q) > kJump * std::max(own, own + q)) continue;
            const auto u = static_cast<float>(i), v = static_cast<float>(j);
            count += 1;
            sx += u, sy += v, sq += q;
            xx += u * u, xy += u * v, yy += v * v;
            xq += u * q, yq += v * q;
        }
    }
    xx -= sx * sx / count, xy -= sx * sy / count, yy -= sy * sy / count;
    xq -= sx * sq / count, yq -= sy * sq / count;
    const float determinant = xx * yy - xy * xy;
    const float slopeX = (yy * xq - xy * yq) / determinant;
    const float slopeY = (xx * yq - xy * xq) / determinant;
    const float moved = slopeX * static_cast<float>(x - x0) + slopeY * static_cast<float>(y - y0);
    return own + std::clamp(moved, -kFarthest * own, kFarthest * own);
}

/// A path to the unknown pixel `at` from the known pixel `from`, as indices of pixels.
struct Path {
    float cost;
    std::int32_t at, from;
    /// The cheapest first; then in a fixed order.
    bool operator<(const Path& b) const {
        return std::tie(cost, at, from) > std::tie(b.cost, b.at, b.from);
    }
};

class Gaps {
  public:
    Gaps(const Image<float>& distances, const Texture& texture)
        : distances_(distances),
          texture_(texture),
          width_(distances.width()),
          reach_(std::max(distances.width(), distances.height()) / kReachDivisor),
          from_(distances.count(), kOpen) {}

    /// For each pixel the known one that it goes to, or kOpen.
    [[nodiscard]] const std::vector<std::int32_t>& close() {
        for (int y = 0; y < distances_.height(); ++y)
            for (int x = 0; x < width_; ++x)
                if (hasPoint(distances_.at(x, y))) goOn({0, y * width_ + x, y * width_ + x});
        while (!paths_.empty()) {
            const Path path = paths_.top();
            paths_.pop();
            if (from_[path.at] != kOpen) continue;
            from_[path.at] = path.from;
            goOn(path);
        }
        return from_;
    }

    static constexpr std::int32_t kOpen = -1;

  private:
    void goOn(const Path& path) {
        const int x = path.at % width_, y = path.at / width_;
        for (const auto& [i, j] : kNeighbours) {
            const int u = x + i, v = y + j;
            if (!distances_.contains(u, v) || hasPoint(distances_.at(u, v)) ||
                from_[v * width_ + u] != kOpen)
                continue;
            const glm::vec4 colour = texture_.at(u, v);
            const int away =
                std::max(std::abs(u - path.from % width_), std::abs(v - path.from / width_));
            if (colour.a < 1 || away > reach_) continue;
            const float change = glm::distance(glm::vec3(colour), glm::vec3(texture_.at(x, y)));
            const float cost = path.cost + kStep + std::max(0.0f, change - kNoise);
            if (cost <= kMost) paths_.push({cost, v * width_ + u, path.from});
        }
    }

    const Image<float>& distances_;
    const Texture& texture_;
    int width_, reach_;
    std::vector<std::int32_t> from_;
    std::priority_queue<Path> paths_;
};

}  // namespace

std::int64_t closeDepthGaps(Image<float>& distances, const Texture& texture) {
    const Image<float> before = distances;
    Gaps gaps(before, texture);
    const auto& from = gaps.close();
    const int width = before.width();
    std::int64_t closed = 0;
    for (std::int32_t i = 0; i < static_cast<std::int32_t>(from.size()); ++i) {
        if (from[i] == Gaps::kOpen) continue;
        distances.data()[i] =
            1.0f / continued(before, from[i] % width, from[i] / width, i % width, i / width);
        ++closed;
    }
    return closed;
}

}  // namespace stx

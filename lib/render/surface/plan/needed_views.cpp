#include "lib/render/surface/plan/needed_views.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "lib/base/parallel.hpp"
#include "lib/render/scene/coarse_pages.hpp"
#include "lib/render/scene/page_set.hpp"
#include "lib/render/surface/prepare/constants.hpp"

namespace stx::surface {
namespace {

constexpr int kCells = ViewSummary::kCells;
/// A picture is taken for larger by so much on each side, pixels: tiles reach beyond it by less
/// than kTile, and the boxes that blocks are placed by beyond these by half a pixel and rounding.
constexpr double kAroundPicture = kTile + 4;
/// Splats reach farther, and quarters of blocks are left out where others show all of their points:
/// this share of the picture, too.
constexpr double kAroundSplats = 0.25;
/// So is a view: by what filling takes for seen beside its picture (share of its size; see
/// LookedAt::hides()), and each cell by what filters, votes and boxes of blocks reach, pixels.
constexpr double kBesideView = 0.05, kAroundCell = 8;
/// Filling takes what is behind a view's far plane by no more than this share for seen.
constexpr double kBehindFarPlane = 0.06;

/// What a camera's picture shows: where four functions are above 0, and a fifth of perspective
/// ones.
class Frustum {
  public:
    /// `around`: share of the picture's size by which it is taken for larger.
    Frustum(const Camera& camera, double around)
        : camera_(camera),
          around_(std::max(kAroundPicture, around * std::max(camera.width, camera.height))) {}

    /// Of a point (w = 1) or a direction (w = 0) of the world.
    [[nodiscard]] std::array<double, 5> at(glm::dvec4 world) const {
        const Camera& c = camera_;
        const glm::dvec3 p =
            glm::conjugate(c.orientation) * (glm::dvec3(world) - world.w * c.position);
        const double w = c.orthographic ? world.w : -p.z;
        const double x = c.fx * p.x + c.cx * w, y = -c.fy * p.y + c.cy * w;
        return {x + around_ * w, (c.width + around_) * w - x, y + around_ * w,
                (c.height + around_) * w - y, c.orthographic ? 1.0 : w};
    }
    /// Whether some points and directions, and all between them, may be in it: not where they are
    /// all on the other side of one plane.
    [[nodiscard]] bool mayHold(std::span<const glm::dvec4> corners) const {
        std::array<bool, 5> outside{true, true, true, true, true};
        for (const glm::dvec4& corner : corners) {
            const auto values = at(corner);
            for (std::size_t k = 0; k < values.size(); ++k)
                outside[k] = outside[k] && values[k] <= 0;
        }
        return std::ranges::none_of(outside, [](bool o) { return o; });
    }

  private:
    Camera camera_;
    double around_;
};

/// Where a view sees in one of its cells: its own place and four corners, or four directions.
std::array<glm::dvec4, 5> seenIn(const Camera& c, int column, int row, double farthest) {
    const auto edge = [](int cell, int size) {
        const double around =
            kAroundCell + (cell == 0 || cell == kCells ? kBesideView * size : 0.0);
        return std::pair(static_cast<double>(cell) * size / kCells, around);
    };
    const auto [left, aroundLeft] = edge(column, c.width);
    const auto [right, aroundRight] = edge(column + 1, c.width);
    const auto [top, aroundTop] = edge(row, c.height);
    const auto [bottom, aroundBottom] = edge(row + 1, c.height);
    std::array<glm::dvec4, 5> out;
    out[0] = glm::dvec4(c.position, 1.0);
    for (std::size_t k = 0; k < 4; ++k) {
        const double x = k & 1 ? right + aroundRight : left - aroundLeft;
        const double y = k & 2 ? bottom + aroundBottom : top - aroundTop;
        const glm::dvec3 ray = c.orientation * c.unproject(x, y, 1.0);
        out[k + 1] = std::isfinite(farthest) ? glm::dvec4(c.position + farthest * ray, 1.0)
                                             : glm::dvec4(ray, 0.0);
    }
    return out;
}

bool sees(const ReferenceView& view, const ViewSummary& summary, double least,
          std::span<const Frustum> pictures) {
    for (int row = 0; row < kCells; ++row) {
        for (int column = 0; column < kCells; ++column) {
            const auto cell = static_cast<std::size_t>(row * kCells + column);
            const double farthest =
                std::max<double>(static_cast<double>(summary.farthest[cell]), least);
            const auto corners = seenIn(view.camera, column, row, farthest);
            if (std::ranges::any_of(pictures, [&](const Frustum& f) { return f.mayHold(corners); }))
                return true;
        }
    }
    return false;
}

/// Whether there are views that may be left out for others (stages `twins` and `coarse`).
bool anyForOthers(const std::vector<ReferenceView>& views, bool splats) {
    for (std::size_t i = 0; i < views.size(); ++i)
        for (std::size_t k = 0; k < i; ++k)
            if (sameCamera(views[i].camera, views[k].camera) ||
                (splats &&
                 (isClearlyFiner(views[i], views[k]) || isClearlyFiner(views[k], views[i]))))
                return true;
    return false;
}

}  // namespace

bool tellsWithoutPixels(const ReferenceView& view) {
    return !view.camera.orthographic && !view.pruned && !view.background &&
           !(view.refined.doubt > 0) && view.noDepth == NoDepth::empty;
}

std::vector<bool> neededViews(const std::vector<ReferenceView>& views,
                              std::span<const ViewSummary> summaries,
                              const RenderSettings& settings, std::span<const Camera> pictures) {
    std::vector<bool> needed(views.size(), true);
    const bool splats = settings.mode == RenderMode::splat;
    // The paper's rule is fitted to all views, and points know each other by their number.
    if ((splats && settings.splat != SplatRule::data) || summaries.size() != views.size() ||
        anyForOthers(views, splats))
        return needed;
    for (std::size_t i = 0; i < views.size(); ++i)
        if (!tellsWithoutPixels(views[i]) || summaries[i].translucent) return needed;
    std::vector<Frustum> frustums;
    for (const Camera& picture : pictures)
        frustums.emplace_back(picture, splats ? kAroundSplats : 0.0);
    std::vector<char> found(views.size());
    parallelFor(0, static_cast<std::int64_t>(views.size()), [&](std::int64_t i) {
        const auto k = static_cast<std::size_t>(i);
        const double least = (1 + kBehindFarPlane) * views[k].farPlane;
        found[k] = sees(views[k], summaries[k], least, frustums);
    });
    for (std::size_t i = 0; i < views.size(); ++i) needed[i] = found[i] != 0;
    // Something must say what colours are.
    if (std::ranges::find(needed, true) == needed.end()) needed[0] = true;
    return needed;
}

}  // namespace stx::surface

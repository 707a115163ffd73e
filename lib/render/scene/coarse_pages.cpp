#include "lib/render/scene/coarse_pages.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "lib/base/parallel.hpp"
#include "lib/render/scene/page_set.hpp"

namespace stx {
namespace {

/// A view shows a point as well as another where its samples lie this much closer together: each of
/// the other's splats is larger than 2x2 of its own.
constexpr double kFiner = 2;
/// Depths of one surface differ by no more than this share, one sample spacing of the finer view
/// and what its surface climbs in one: the point of a coarse view is that of its pixel's centre.
constexpr double kShownDepth = 0.002;

/// How far apart the samples of a camera are at a distance, scene units.
double spacingAt(const Camera& camera, double distance) {
    return (camera.orthographic ? 1.0 : distance) / std::min(camera.fx, camera.fy);
}

/// Unit, from a camera to a point.
glm::dvec3 sightOf(const Camera& camera, glm::dvec3 point) {
    return camera.orthographic ? camera.forward() : glm::normalize(point - camera.position);
}

/// How far apart the samples of a view are on the surface that it sees at a pixel, which it may see
/// from aside; infinity where no neighbour is on that surface.
double stepAt(const PageSet& set, std::size_t view, int u, int v) {
    const Camera& camera = set.views()[view].camera;
    const double found = set.depth(view, u, v);
    const auto riseTo = [&](int x, int y) {
        const bool inside = x >= 0 && y >= 0 && x < camera.width && y < camera.height;
        return std::abs((inside ? set.depth(view, x, y) : kNoDepth) - found);
    };
    // Of the two sides of an axis one may be beyond an edge, or beyond the view.
    const auto rise = [&](int i, int j) {
        return std::min(riseTo(u + i, v + j), riseTo(u - i, v - j));
    };
    return spacingAt(camera, found) + std::max(rise(1, 0), rise(0, 1));
}

/// A pixel of a coarse view.
struct CoarsePixel {
    const Camera& camera;
    glm::dvec3 centre;  // of what it shows
    double step;        // from there to its neighbours, scene units

    [[nodiscard]] glm::dvec2 place(glm::dvec3 point) const {
        return camera.project(glm::conjugate(camera.orientation) * (point - camera.position));
    }
    [[nodiscard]] bool holds(glm::dvec3 point) const {
        return glm::all(
            glm::lessThanEqual(glm::abs(place(point) - place(centre)), glm::dvec2(0.5)));
    }
};

/// Whether a view shows the surface of a pixel as finely in every direction.
bool showsFinely(const PageSet& set, std::size_t view, const CoarsePixel& coarse) {
    const Camera& camera = set.views()[view].camera;
    const glm::dvec3 inCamera =
        glm::conjugate(camera.orientation) * (coarse.centre - camera.position);
    // From the other side a thin sheet looks otherwise.
    if (!(inCamera.z < 0) ||
        !(glm::dot(sightOf(camera, coarse.centre), sightOf(coarse.camera, coarse.centre)) > 0))
        return false;
    const glm::dvec3 pixel = camera.project(inCamera);
    const int u = static_cast<int>(std::floor(pixel.x)), v = static_cast<int>(std::floor(pixel.y));
    if (!(u >= 0 && v >= 0 && u < camera.width && v < camera.height)) return false;
    // The pixel itself, or one beside it that shows a place in the coarse one: at an outline the
    // pixel is covered in part, or beyond it.
    for (int y = std::max(v - 1, 1); y <= std::min(v + 1, camera.height - 2); ++y) {
        for (int x = std::max(u - 1, 1); x <= std::min(u + 1, camera.width - 2); ++x) {
            const PageRectangle* r = set.find(view, x, y);
            if (!r || set.pages()[r->page].texture->alpha(r->texel(x, y)) < 1.0f) continue;
            const double found = set.depth(view, x, y), own = stepAt(set, view, x, y);
            if (std::abs(found - pixel.z) <= kShownDepth * pixel.z + own && own <= coarse.step &&
                coarse.holds(camera.position +
                             camera.orientation * camera.unproject(x + 0.5, y + 0.5, found)))
                return true;
        }
    }
    return false;
}

}  // namespace

bool isClearlyFiner(const ViewHeader& view, const ViewHeader& than) {
    const Camera &fine = view.camera, &coarse = than.camera;
    // From the same place it is as many times as fine, near and far.
    const bool alike = fine.orthographic == coarse.orthographic &&
                       kFiner * spacingAt(fine, 1.0) <= spacingAt(coarse, 1.0);
    return alike || kFiner * spacingAt(fine, view.farPlane) <= spacingAt(coarse, than.nearPlane);
}

Image<std::uint8_t> coarsePoints(const PageSet& set, std::size_t view) {
    const auto views = set.views();
    std::vector<std::size_t> finer;
    for (std::size_t k = 0; k < views.size(); ++k)
        if (!views[k].unread && !views[view].unread &&
            views[k].background == views[view].background && isClearlyFiner(views[k], views[view]))
            finer.push_back(k);
    if (finer.empty()) return {};
    const Camera& camera = views[view].camera;
    Image<std::uint8_t> coarse(camera.width, camera.height, std::uint8_t{0});
    parallelForBlocks(0, camera.height, 16, [&](std::int64_t from, std::int64_t to) {
        for (int y = static_cast<int>(from); y < to; ++y) {
            for (int x = 0; x < camera.width; ++x) {
                const float z = set.depth(view, x, y);
                if (!hasPoint(z)) continue;
                const glm::dvec3 point =
                    camera.position + camera.orientation * camera.unproject(x + 0.5, y + 0.5, z);
                const double climbs = stepAt(set, view, x, y);
                const CoarsePixel pixel{camera, point,
                                        std::isfinite(climbs) ? climbs : spacingAt(camera, z)};
                coarse.at(x, y) = std::ranges::any_of(
                    finer, [&](std::size_t k) { return showsFinely(set, k, pixel); });
            }
        }
    });
    return coarse;
}

PageSet PageSet::withoutCoarse(std::int64_t& points) const {
    points = 0;
    std::vector<std::shared_ptr<Image<float>>> depths(data_->pages.size());
    std::vector<bool> kept(views().size(), true);
    for (std::size_t view = 0; view < views().size(); ++view) {
        settle();
        const Image<std::uint8_t> coarse = coarsePoints(*this, view);
        if (coarse.empty()) continue;
        const auto count = std::ranges::count(coarse.pixels(), 1);
        points += count;
        const Camera& camera = views()[view].camera;
        bool all = true;
        for (int y = 0; y < camera.height && all; ++y)
            for (int x = 0; x < camera.width && all; ++x)
                all = coarse.at(x, y) != 0 || !hasPoint(depth(view, x, y));
        kept[view] = !all;
        if (all || count == 0) continue;
        for (const PageRectangle& r : rectanglesOf(view)) {
            auto& image = depths[r.page];
            if (!image) image = std::make_shared<Image<float>>(*pages()[r.page].depth);
            for (int y = std::max(r.y0 - kPadding, 0); y < std::min(r.y1 + kPadding, camera.height);
                 ++y)
                for (int x = std::max(r.x0 - kPadding, 0);
                     x < std::min(r.x1 + kPadding, camera.width); ++x)
                    if (coarse.at(x, y)) image->data()[r.texel(x, y)] = kNoDepth;
        }
    }
    const bool complete = std::ranges::all_of(kept, std::identity());
    if (points == 0 && complete) return *this;
    PageSet set = withDepths(std::make_shared<Data>(*data_), std::move(depths));
    // Nor do outlines of nothing but coarse pixels tell anything.
    if (!complete) set = set.only(kept);
    set.behind_ = behind_;
    return set;
}

}  // namespace stx

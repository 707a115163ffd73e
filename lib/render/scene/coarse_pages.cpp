#include "lib/render/scene/coarse_pages.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>

#include "lib/base/parallel.hpp"
#include "lib/geometry/pixel_map.hpp"
#include "lib/render/scene/page_set.hpp"

namespace stx {
namespace {

/// A view shows a point as well as another where its samples lie this much closer together: each of
/// the other's splats is larger than 2x2 of its own.
constexpr double kFiner = 2;
/// Depths of one surface differ by no more than this share and so many sample spacings of the
/// coarser view, whose point is one of all that its pixel covers.
constexpr float kShownDepth = 0.002f, kShownSpacings = 1.0f;

/// A view is left out when it alone shows no more than this share of its points, which are those at
/// edges: its alpha blurs outlines. Of 60 random sets with such a view (seed 7701 of the sweep's
/// rule `coarser`) two lose 3.8 and 0.8 dB where it has to be none, with 0.05 or 0.1 only the
/// first.
constexpr double kRest = 0.05;

/// Of a camera, over depth unless it is orthographic.
float spacingOf(const Camera& camera) {
    return static_cast<float>(1.0 / std::min(camera.fx, camera.fy));
}
float spacingAt(const Camera& camera, float depth) {
    return spacingOf(camera) * (camera.orthographic ? 1.0f : depth);
}

/// Another view that may show points of one.
class Finer {
  public:
    Finer(const PageSet& set, std::size_t view, const Camera& coarse)
        : set_(set),
          view_(view),
          camera_(set.views()[view].camera),
          map_(pixelMap(coarse, camera_)) {}

    [[nodiscard]] bool shows(int x, int y, float depth, float spacing) const {
        const glm::dvec3 h = (map_.a0 + map_.au * double(x) + map_.av * double(y)) * double(depth) +
                             map_.b0 + map_.bu * double(x) + map_.bv * double(y);
        const double scale = camera_.orthographic ? 1.0 : 1.0 / h.z;
        const double atX = h.x * scale, atY = h.y * scale;
        // False for what is not a number.
        if (!(h.z > 0 && atX >= 1 && atY >= 1 && atX < camera_.width - 2 &&
              atY < camera_.height - 2))
            return false;
        const int u = static_cast<int>(atX + 0.5), v = static_cast<int>(atY + 0.5);
        const PageRectangle* r = set_.find(view_, u, v);
        if (!r || set_.pages()[r->page].texture->alpha(r->texel(u, v)) < 1.0f) return false;
        const float found = set_.depth(view_, u, v);
        if (!(std::abs(found - h.z) <= kShownDepth * h.z + kShownSpacings * spacing)) return false;
        // A surface that it sees at a slant is not sampled more finely. Of the two sides of an axis
        // one may be beyond an edge.
        const auto rise = [&](int i, int j) {
            return std::min(std::abs(set_.depth(view_, u + i, v + j) - found),
                            std::abs(set_.depth(view_, u - i, v - j) - found));
        };
        return spacingAt(camera_, found) + std::max(rise(1, 0), rise(0, 1)) <= spacing;
    }

  private:
    const PageSet& set_;
    std::size_t view_;
    const Camera& camera_;
    PixelMap map_;
};

}  // namespace

bool isClearlyFiner(const ViewHeader& view, const ViewHeader& than) {
    const auto spacing = [](const ViewHeader& v, double distance) {
        return (v.camera.orthographic ? 1.0 : distance) / std::min(v.camera.fx, v.camera.fy);
    };
    return kFiner * spacing(view, view.farPlane) <= spacing(than, than.nearPlane);
}

PageSet PageSet::withoutCoarse(std::int64_t& points) const {
    points = 0;
    std::shared_ptr<Data> data;
    std::vector<std::shared_ptr<Image<float>>> depths(data_->pages.size());
    std::vector<bool> kept(views().size(), true);
    for (std::size_t view = 0; view < views().size(); ++view) {
        if (views()[view].unread) continue;
        std::vector<Finer> finer;
        for (std::size_t k = 0; k < views().size(); ++k)
            if (!views()[k].unread && views()[k].background == views()[view].background &&
                isClearlyFiner(views()[k], views()[view]))
                finer.emplace_back(*this, k, views()[view].camera);
        if (finer.empty()) continue;
        settle();
        const Camera& camera = views()[view].camera;
        Image<std::uint8_t> needless(camera.width, camera.height, std::uint8_t{0});
        std::atomic<std::int64_t> others = 0;  // points that only this view shows
        parallelForBlocks(0, camera.height, 16, [&](std::int64_t from, std::int64_t to) {
            for (int y = static_cast<int>(from); y < to; ++y) {
                for (int x = 0; x < camera.width; ++x) {
                    const float z = depth(view, x, y);
                    if (!hasPoint(z)) continue;
                    needless.at(x, y) = std::ranges::any_of(finer, [&](const Finer& f) {
                        return f.shows(x, y, z, spacingAt(camera, z));
                    });
                    if (!needless.at(x, y)) ++others;
                }
            }
        });
        const std::int64_t count = std::ranges::count(needless.pixels(), 1);
        kept[view] = static_cast<double>(others) > kRest * static_cast<double>(count + others);
        if (kept[view] && count == 0) continue;
        points += count;
        if (!data) data = std::make_shared<Data>(*data_);
        for (const PageRectangle& r : rectanglesOf(view)) {
            auto& image = depths[r.page];
            if (!image) image = std::make_shared<Image<float>>(*pages()[r.page].depth);
            for (int y = std::max(r.y0 - kPadding, 0); y < std::min(r.y1 + kPadding, camera.height);
                 ++y)
                for (int x = std::max(r.x0 - kPadding, 0);
                     x < std::min(r.x1 + kPadding, camera.width); ++x)
                    if (needless.at(x, y)) image->data()[r.texel(x, y)] = kNoDepth;
        }
    }
    if (!data) return *this;
    for (std::size_t i = 0; i < depths.size(); ++i) {
        if (!depths[i]) continue;
        depths[i]->moveTo(spool());
        data->pages[i].depth = depths[i].get();
        data->refined.push_back(std::move(depths[i]));
    }
    PageSet set(std::move(data));
    // Nor do outlines of nothing but coarse pixels tell anything.
    if (!std::ranges::all_of(kept, std::identity())) set = set.only(kept);
    set.behind_ = behind_;
    return set;
}

}  // namespace stx

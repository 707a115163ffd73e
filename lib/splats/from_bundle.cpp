#include "lib/splats/from_bundle.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include <glm/gtc/quaternion.hpp>

#include "lib/base/parallel.hpp"
#include "lib/geometry/view_layout.hpp"
#include "lib/model/peak_memory.hpp"
#include "lib/model/some_views.hpp"
#include "lib/splats/finest.hpp"
#include "lib/splats/merge.hpp"
#include "lib/surface/normals.hpp"

namespace stx {
namespace {

using splats::Disc;

constexpr float kMostOpacity = 0.99f;  ///< its logit is finite
/// Thickness as a share of a splat's shorter axis: a disc, for those who invert its covariance.
constexpr float kThickness = 0.05f;
/// Pixels by which outlines grow where splats are drawn by the published rules (+ 0.3 square
/// pixels): 1.3 on a ball of any size. What lies inside an outline moves with the splats, too:
/// pictures of the amphora are best at 1.0 to 1.2, of spot at 1.2 to 1.4.
constexpr double kOutlinesGrowBy = 1.2;

/// From a point towards where a camera sees it from; not of length 1.
glm::vec3 towardsCamera(const Camera& camera, const glm::vec3& point) {
    return glm::vec3(camera.orthographic ? camera.orientation * glm::dvec3(0, 0, 1)
                                         : camera.position - glm::dvec3(point));
}

/// The texels of a view as discs, counted from the bundle's origin; axes turn counterclockwise for
/// its camera.
Image<Disc> discsOf(const ReferenceView& view) {
    Image<Disc> discs(view.depth.width(), view.depth.height());
    for (int y = 0; y < discs.height(); ++y) {
        for (int x = 0; x < discs.width(); ++x) {
            const float depth = view.depth.at(x, y);
            if (!hasPoint(depth)) continue;
            glm::vec4 colour = view.texture.at(x, y);
            if (view.texture.isLinear())
                for (int k = 0; k < 3; ++k)
                    colour[k] = std::clamp(srgbFromLinear(colour[k]), 0.0f, 1.0f);
            Disc& d = discs.at(x, y);
            d.centre = glm::vec3(view.worldPoint(x, y));
            d.u = view.splatU.at(x, y);
            d.v = view.splatV.at(x, y);
            d.colour = colour;
            if (!(glm::length(glm::cross(d.u, d.v)) > 0.0f)) {
                // A file may have points without axes: they face the camera.
                const glm::dvec2 half =
                    view.camera.sampleSpacing(static_cast<double>(depth)) * std::sqrt(0.5);
                d.u = glm::vec3(view.camera.orientation * glm::dvec3(half.x, 0, 0));
                d.v = glm::vec3(view.camera.orientation * glm::dvec3(0, half.y, 0));
            }
            if (glm::dot(glm::cross(d.u, d.v), towardsCamera(view.camera, d.centre)) < 0)
                d.v = -d.v;
        }
    }
    return discs;
}

struct Axes {
    glm::dvec3 longer, shorter;
};

/// Half axes of a disc: { a u + b v : a^2 + b^2 <= 1 } has the axes that u u^T + v v^T has, turned
/// within (u, v).
Axes axesOf(const Disc& d) {
    const double uu = glm::dot(d.u, d.u), uv = glm::dot(d.u, d.v), vv = glm::dot(d.v, d.v);
    const double angle = 0.5 * std::atan2(2 * uv, uu - vv), c = std::cos(angle),
                 s = std::sin(angle);
    const glm::dvec3 u(d.u), v(d.v);
    return {c * u + s * v, c * v - s * u};
}

/// Moves discs, whose axes turn counterclockwise for their view, below the surface. A texel's
/// shorter half axis is sqrt(1/2) of its side, as it is seen from in front.
void putBelowSurface(Image<Disc>& discs, double pixelsPerTexel) {
    for (Disc& d : discs.pixels()) {
        if (!(d.colour.w > 0.0f)) continue;
        const double side = glm::length(axesOf(d).shorter) * std::sqrt(2.0);
        const glm::vec3 normal = glm::normalize(glm::cross(d.u, d.v));
        d.centre -= static_cast<float>(side * kOutlinesGrowBy / pixelsPerTexel) * normal;
    }
}

void setSplat(SplatCloud& cloud, std::size_t i, const Disc& d, glm::dvec3 origin, float size) {
    const Axes axes = axesOf(d);
    const double longer = glm::length(axes.longer), shorter = glm::length(axes.shorter);
    const glm::dvec3 x = axes.longer / longer, y = axes.shorter / shorter;
    const glm::dquat q = glm::normalize(glm::quat_cast(glm::dmat3(x, y, glm::cross(x, y))));
    cloud.positions[i] = glm::vec3(glm::dvec3(d.centre) + origin);
    cloud.scales[i] = size * glm::vec3(static_cast<float>(longer), static_cast<float>(shorter),
                                       kThickness * static_cast<float>(std::min(longer, shorter)));
    cloud.rotations[i] = glm::vec4(q.x, q.y, q.z, q.w);
    cloud.opacities[i] = kMostOpacity * d.colour.w;
    cloud.colours[i] = glm::vec3(d.colour);
}

/// Views of the background come first.
std::vector<std::size_t> orderOf(const Bundle& about) {
    std::vector<std::size_t> order(about.views.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_partition(order.begin(), order.end(),
                          [&](std::size_t i) { return about.views[i].background; });
    return order;
}

/// The table with axes in each view, if some view has none at all.
Result<std::unique_ptr<ViewTable>> withAxes(std::unique_ptr<ViewTable> table) {
    if (std::ranges::all_of(table->kinds(), &ViewImageKinds::hasSplats)) return table;
    BakeSettings axes;
    axes.keepNormals = true;
    STX_TRY(auto bake, bakeOfViews(axes));
    return changedViews(std::move(table), std::move(bake));
}

/// The discs of each view that no other shows finer, below the surface.
Result<std::vector<Image<Disc>>> finestDiscs(const ViewTable& table, const SplatSettings& settings,
                                             PixelSpool* spool, Job& job) {
    std::vector<Image<Disc>> images(table.count());
    std::atomic<bool> beyondWhite = false;
    STX_CHECK(forEachView(table, {peak::kSplats.what, sizeof(Disc)}, job,
                          [&](std::size_t i, auto view) -> Result<void> {
                              images[i] = discsOf(*view);
                              if (isBeyondWhite(view->texture)) beyondWhite = true;
                              images[i].moveTo(spool);
                              return {};
                          }));
    if (beyondWhite) job.noteOnce("linear colour becomes sRGB; values above 1 are clipped");
    splats::keepFinest(std::as_const(table).about(), images, spool);
    parallelFor(0, images.size(), [&](std::size_t i) {
        if (spool) spool->settle();
        putBelowSurface(images[i], settings.pixelsPerTexel);
    });
    STX_CHECK(job.checkCancelled());
    return images;
}

/// Where the splats of each row begin among those of its image, and at last how many there are.
std::vector<std::size_t> rowsOf(const Image<Disc>& image) {
    std::vector<std::size_t> begin{0};
    for (int y = 0; y < image.height(); ++y)
        begin.push_back(begin.back() +
                        static_cast<std::size_t>(std::ranges::count_if(
                            image.row(y), [](const Disc& d) { return d.colour.w > 0.0f; })));
    return begin;
}

/// Discs of one image after the other as splats.
class CloudMaker {
  public:
    CloudMaker(glm::dvec3 origin, double size) : origin_(origin), size_(size) {}

    [[nodiscard]] Result<void> begin(std::size_t count, Job& job) {
        if (count == 0)
            return fail(ErrorCode::invalidInput, "the bundle has no points to make splats of");
        if (count > std::numeric_limits<std::uint32_t>::max())
            return fail(ErrorCode::invalidInput,
                        "{} points are more splats than files hold (2^32 - 1)", count);
        STX_CHECK(cloud.resize(count, 0, job.limits));
        if (origin_ != glm::dvec3(0.0))
            job.note(fmt::format(
                "splats are floats in the world: coordinates near {} {} {} are rounded to them",
                origin_.x, origin_.y, origin_.z));
        return {};
    }
    void add(const std::vector<Disc>& list) {
        const std::size_t first = at_;
        at_ += list.size();
        parallelFor(0, list.size(), 4096, [&](std::size_t i) {
            setSplat(cloud, first + i, list[i], origin_, static_cast<float>(size_));
        });
    }

    void add(const Image<Disc>& image) {
        const std::vector<std::size_t> rows = rowsOf(image);
        const std::size_t first = at_;
        at_ += rows.back();
        parallelFor(0, image.height(), [&](std::int64_t y) {
            std::size_t i = first + rows[y];
            for (const Disc& d : image.row(static_cast<int>(y)))
                if (d.colour.w > 0.0f) setSplat(cloud, i++, d, origin_, static_cast<float>(size_));
        });
    }

    SplatCloud cloud;

  private:
    glm::dvec3 origin_;
    double size_;
    std::size_t at_ = 0;
};

Result<SplatCloud> cloudOf(std::vector<Image<Disc>> images, glm::dvec3 origin,
                           const SplatSettings& settings, PixelSpool* spool, Job& job) {
    CloudMaker maker(origin, settings.size);
    if (settings.most == 0) {
        std::size_t count = 0;
        for (const Image<Disc>& image : images) count += rowsOf(image).back();
        STX_CHECK(maker.begin(count, job));
        for (Image<Disc>& image : images) {
            maker.add(image);
            image = {};
        }
        return std::move(maker.cloud);
    }
    const splats::DiscMerging merging(images, settings.most, spool);
    if (merging.count() > settings.most)
        return fail(ErrorCode::failed,
                    "flat pieces of one colour merge into {} splats at the least, not into {}; "
                    "smaller or pruned views have fewer",
                    merging.count(), settings.most);
    STX_CHECK(maker.begin(merging.count(), job));
    for (Image<Disc>& image : images) {
        STX_CHECK(job.checkCancelled());
        merging.left(image, [&](const std::vector<Disc>& row) { maker.add(row); });
        image = {};
    }
    return std::move(maker.cloud);
}

}  // namespace

Result<SplatCloud> splatsOfViews(const ViewTable& table, const SplatSettings& settings,
                                 PixelSpool* spool, Job& job) {
    STX_TRY(const auto ordered, withAxes(someViewsOf(table, orderOf(table.about()))));
    STX_TRY(auto images, finestDiscs(*ordered, settings, spool, job));
    STX_TRY(auto cloud, cloudOf(std::move(images), table.about().origin, settings, spool, job));
    std::vector<Camera> cameras;
    for (const ViewHeader& view : table.about().views) cameras.push_back(view.camera);
    cloud.up = glm::vec3(upOfCameras(cameras));
    return cloud;
}

std::uint64_t memoryOfSpooledSplats(const ViewTable& table, const Limits& limits,
                                    std::size_t most) {
    // Of one view its axes and discs, or its discs and what they merge into; at most all pixels are
    // splats, and written ones are a copy.
    constexpr PeakMemory kOfOne = {peak::kSplats.what, 2 * sizeof(Disc) + 40};
    std::uint64_t pixels = 0;
    for (std::size_t i = 0; i < table.count(); ++i) pixels += table.pixelsOf(i);
    if (most > 0) pixels = std::min<std::uint64_t>(pixels, most);
    return std::max(memoryFromSpool(table, kOfOne, limits),
                    limits.maxMemoryBytes / kSpoolPart + pixels * SplatCloud::bytesEach(0));
}

}  // namespace stx

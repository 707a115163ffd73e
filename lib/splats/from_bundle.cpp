#include "lib/splats/from_bundle.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/gtc/quaternion.hpp>

#include "lib/base/parallel.hpp"
#include "lib/model/peak_memory.hpp"
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

/// Some view has no axes at all.
bool lacksAxes(const Bundle& bundle) {
    return std::ranges::any_of(bundle.views, [](const auto& v) { return !v.hasSplats(); });
}

}  // namespace

Result<SplatCloud> splatsOfBundle(Bundle bundle, const SplatSettings& settings, Job& job) {
    std::stable_partition(bundle.views.begin(), bundle.views.end(),
                          [](const auto& v) { return v.background; });
    STX_CHECK(checkPeak(settings.most > 0 ? peak::kFewerSplats : peak::kSplats, bundle.views,
                        job.limits));
    if (lacksAxes(bundle)) {
        BakeSettings axes;
        axes.keepNormals = true;
        STX_CHECK(bake(bundle, axes, job));
    }
    std::vector<Image<Disc>> images(bundle.views.size());
    parallelFor(0, static_cast<std::int64_t>(images.size()), [&](std::int64_t i) {
        const auto n = static_cast<std::size_t>(i);
        images[n] = discsOf(bundle.views[n]);
    });
    splats::keepFinest(bundle, images);
    bundle.views.clear();
    parallelFor(0, static_cast<std::int64_t>(images.size()), [&](std::int64_t i) {
        putBelowSurface(images[static_cast<std::size_t>(i)], settings.pixelsPerTexel);
    });
    STX_CHECK(job.checkCancelled());
    std::vector<std::vector<Disc>> lists;
    if (settings.most > 0) {
        lists = splats::mergeDiscs(std::move(images), settings.most);
    } else {
        for (Image<Disc>& image : images) {
            auto& list = lists.emplace_back();
            std::ranges::copy_if(image.pixels(), std::back_inserter(list),
                                 [](const Disc& d) { return d.colour.w > 0.0f; });
            image = {};
        }
    }
    std::size_t count = 0;
    for (const auto& list : lists) count += list.size();
    if (count == 0)
        return fail(ErrorCode::invalidInput, "the bundle has no points to make splats of");
    if (count > std::numeric_limits<std::uint32_t>::max())
        return fail(ErrorCode::invalidInput, "{} points are more splats than files hold (2^32 - 1)",
                    count);
    if (settings.most > 0 && count > settings.most)
        return fail(ErrorCode::failed,
                    "flat pieces of one colour merge into {} splats at the least, not into {}; "
                    "smaller or pruned views have fewer",
                    count, settings.most);
    SplatCloud cloud;
    STX_CHECK(cloud.resize(count, 0, job.limits));
    if (bundle.origin != glm::dvec3(0.0))
        job.note(fmt::format(
            "splats are floats in the world: coordinates near {} {} {} are rounded to them",
            bundle.origin.x, bundle.origin.y, bundle.origin.z));
    std::size_t at = 0;
    for (const auto& list : lists) {
        const std::size_t first = at;
        at += list.size();
        parallelForBlocks(0, static_cast<std::int64_t>(list.size()), 4096,
                          [&](std::int64_t from, std::int64_t to) {
                              for (auto i = static_cast<std::size_t>(from);
                                   i < static_cast<std::size_t>(to); ++i)
                                  setSplat(cloud, first + i, list[i], bundle.origin,
                                           static_cast<float>(settings.size));
                          });
    }
    return cloud;
}

}  // namespace stx

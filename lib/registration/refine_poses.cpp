#include "lib/registration/refine_poses.hpp"

#include <algorithm>
#include <cmath>

#include "lib/base/median.hpp"
#include "lib/base/parallel.hpp"
#include "lib/registration/overlap.hpp"
#include "lib/registration/pose_system.hpp"

namespace stx {
namespace {

using namespace registration;

/// Resolutions that colours are compared at, halved each time: the coarsest lets poses be off by
/// some ten pixels.
constexpr int kLevels = 3;
/// Points of a view compared with each of its partners, at the coarsest resolution; twice as many
/// at each finer one.
constexpr double kPointsPerPair = 4000;
/// Tukey's biweight at 95 % efficiency.
constexpr double kTukey = 4.685;
/// Spread of a normal distribution from its median absolute deviation.
constexpr double kSpread = 1.4826;
/// Least spreads that residuals are weighed with: half a step of 8 bits; the depth's resolution.
constexpr double kLeastColour = 0.5 / 255, kLeastDepth = 1e-4;
/// Corrections below this (radians, and share of the scene's size) end a resolution.
constexpr double kConverged = 1e-5;

/// Grey values, half the size for each level.
using Pyramid = std::vector<Image<float>>;

Pyramid greyPyramid(const Texture& texture) {
    Pyramid levels;
    Image<float> grey(texture.width(), texture.height());
    for (int y = 0; y < grey.height(); ++y) {
        for (int x = 0; x < grey.width(); ++x) {
            const glm::vec4 c = texture.at(x, y);
            const float mean = (c.r + c.g + c.b) / 3;
            grey.at(x, y) =
                texture.isLinear() ? srgbFromLinear(std::clamp(mean, 0.0f, 1.0f)) : mean;
        }
    }
    levels.push_back(std::move(grey));
    while (static_cast<int>(levels.size()) < kLevels) {
        const Image<float>& fine = levels.back();
        if (fine.width() < 32 || fine.height() < 32) break;
        Image<float> coarse(fine.width() / 2, fine.height() / 2);
        for (int y = 0; y < coarse.height(); ++y)
            for (int x = 0; x < coarse.width(); ++x)
                coarse.at(x, y) = (fine.at(2 * x, 2 * y) + fine.at(2 * x + 1, 2 * y) +
                                   fine.at(2 * x, 2 * y + 1) + fine.at(2 * x + 1, 2 * y + 1)) /
                                  4;
        levels.push_back(std::move(coarse));
    }
    return levels;
}

struct GreySample {
    double value;
    glm::dvec2 gradient;  ///< per pixel of the full size
};

/// Bilinear at a pixel position of the full size; nothing outside.
std::optional<GreySample> sampleGrey(const Pyramid& pyramid, int level, double x, double y) {
    const auto at = std::min(static_cast<std::size_t>(level), pyramid.size() - 1);
    const Image<float>& image = pyramid[at];
    const double scale = 1.0 / (1 << at);
    const double px = x * scale - 0.5, py = y * scale - 0.5;
    const double left = std::floor(px), top = std::floor(py);
    if (!(left >= 0 && top >= 0 && left < image.width() - 1 && top < image.height() - 1)) return {};
    const int ix = static_cast<int>(left), iy = static_cast<int>(top);
    const double a = image.at(ix, iy), b = image.at(ix + 1, iy);
    const double c = image.at(ix, iy + 1), d = image.at(ix + 1, iy + 1);
    const double u = px - left, v = py - top;
    const double upper = a + (b - a) * u, lower = c + (d - c) * u;
    return GreySample{upper + (lower - upper) * v,
                      glm::dvec2((b - a) * (1 - v) + (d - c) * v, lower - upper) * scale};
}

/// How one difference changes when its point moves in the world.
struct Residual {
    double value;
    glm::dvec3 gradient;
};

struct PointResiduals {
    glm::dvec3 point;  ///< in the world
    Residual depth, colour;
};

/// The points of pair.from that pair.to sees, too, with both differences there.
std::vector<PointResiduals> compare(const Bundle& bundle, const std::vector<Pyramid>& greys,
                                    const Pair& pair, int level, double tolerance) {
    const ReferenceView& from = bundle.views[static_cast<std::size_t>(pair.from)];
    const ReferenceView& to = bundle.views[static_cast<std::size_t>(pair.to)];
    const Pyramid& fromGrey = greys[static_cast<std::size_t>(pair.from)];
    const Pyramid& toGrey = greys[static_cast<std::size_t>(pair.to)];
    const Camera& camera = to.camera;
    const Pose target(camera);
    const double pixels = static_cast<double>(from.camera.width) * from.camera.height;
    const double wanted = kPointsPerPair * (1 << (kLevels - 1 - level));
    const int step = std::max(1, static_cast<int>(std::sqrt(pixels / wanted)));

    std::vector<PointResiduals> all;
    for (int y = step / 2; y < from.camera.height; y += step) {
        for (int x = step / 2; x < from.camera.width; x += step) {
            if (!hasPoint(from.depth.at(x, y))) continue;
            const glm::dvec3 world = from.worldPoint(x, y);
            const glm::dvec3 p = target.toCamera(world);
            if (!(p.z < 0)) continue;
            const glm::dvec3 at = camera.project(p);
            const auto surface = sampleDepth(to.depth, at.x, at.y);
            if (!surface) continue;
            const double dist = at.z;
            const double difference = (dist - surface->distance) / dist;
            if (std::abs(difference) > tolerance) continue;
            const auto there = sampleGrey(toGrey, level, at.x, at.y);
            const auto here = sampleGrey(fromGrey, level, x + 0.5, y + 0.5);
            if (!there || !here) continue;
            // Rows of the derivative of Camera::project.
            glm::dvec3 du(camera.fx, 0, 0), dv(0, -camera.fy, 0);
            if (!camera.orthographic) {
                du = glm::dvec3(camera.fx / dist, 0, camera.fx * p.x / (dist * dist));
                dv = glm::dvec3(0, -camera.fy / dist, -camera.fy * p.y / (dist * dist));
            }
            const glm::dvec3 depthChange =
                (glm::dvec3(0, 0, -1) - surface->gradient.x * du - surface->gradient.y * dv) / dist;
            const glm::dvec3 colourChange = there->gradient.x * du + there->gradient.y * dv;
            all.push_back({world,
                           {difference, target.worldFromCamera * depthChange},
                           {there->value - here->value, target.worldFromCamera * colourChange}});
        }
    }
    return all;
}

/// Adds one kind of difference to a pair's equations, weighed by its robust spread.
void accumulate(const std::vector<PointResiduals>& points, Residual PointResiduals::*kind,
                double bias, double leastSpread, const PoseSystem& system,
                PairEquations& equations) {
    std::vector<double> sizes(points.size());
    for (std::size_t i = 0; i < points.size(); ++i)
        sizes[i] = std::abs((points[i].*kind).value - bias);
    const double spread = std::max(leastSpread, kSpread * medianOf(sizes));
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double t = sizes[i] / (kTukey * spread);
        if (t >= 1) continue;
        const double weight = (1 - t * t) * (1 - t * t) / (spread * spread);
        const Residual& r = points[i].*kind;
        equations.add(system.jacobian(points[i].point, r.gradient), r.value - bias, weight);
    }
}

/// One step; gives the largest correction.
double step(Bundle& bundle, const std::vector<Pyramid>& greys, const std::vector<Pair>& pairs,
            int level, double tolerance, PoseSystem& system) {
    std::vector<PairEquations> equations(pairs.size());
    parallelFor(0, static_cast<std::int64_t>(pairs.size()), [&](std::int64_t i) {
        const auto at = static_cast<std::size_t>(i);
        const auto points = compare(bundle, greys, pairs[at], level, tolerance);
        std::vector<double> colours(points.size());
        for (std::size_t k = 0; k < points.size(); ++k) colours[k] = points[k].colour.value;
        // Cameras expose each picture for itself: a common difference says nothing of poses.
        const double exposure = medianOf(std::move(colours));
        accumulate(points, &PointResiduals::depth, 0, kLeastDepth, system, equations[at]);
        accumulate(points, &PointResiduals::colour, exposure, kLeastColour, system, equations[at]);
    });
    return system.solveAndMove(pairs, equations, bundle);
}

}  // namespace

Result<PoseRefinement> refinePoses(Bundle& bundle, const PoseRefinementSettings& settings, Job& job,
                                   PixelSpool* spool) {
    PoseRefinement result;
    const auto views = depthViewsOf(bundle);
    const auto pairs = overlappingPairs(views, settings);
    result.before = result.after = disagreement(views, pairs, settings);
    if (result.before.pairs == 0) return result;

    std::vector<Camera> given;
    for (const ReferenceView& view : bundle.views) given.push_back(view.camera);
    std::vector<Pyramid> greys(bundle.views.size());
    parallelFor(0, static_cast<std::int64_t>(greys.size()), [&](std::int64_t i) {
        const auto at = static_cast<std::size_t>(i);
        greys[at] = greyPyramid(bundle.views[at].texture);
        for (Image<float>& level : greys[at]) level.moveTo(spool);
    });
    PoseSystem system(bundle, pairs);
    for (int level = kLevels - 1; level >= 0; --level) {
        for (int i = 0; i < settings.iterations; ++i) {
            STX_CHECK(job.checkCancelled());
            job.progress((kLevels - 1 - level) * settings.iterations + i,
                         kLevels * settings.iterations, "refining poses");
            if (step(bundle, greys, pairs, level, settings.overlapTolerance, system) < kConverged)
                break;
        }
    }
    result.after = disagreement(views, pairs, settings);
    // Colours that do not fit the depth can draw the poses away from where the depth agrees.
    result.kept = !(result.after.relative > result.before.relative);
    if (!result.kept) {
        for (std::size_t i = 0; i < given.size(); ++i) bundle.views[i].camera = given[i];
        return result;
    }
    for (std::size_t i = 0; i < given.size(); ++i) {
        const Camera& now = bundle.views[i].camera;
        result.maxShift = std::max(result.maxShift, glm::length(now.position - given[i].position));
        result.maxTurn = std::max(
            result.maxTurn,
            glm::angle(glm::normalize(now.orientation * glm::conjugate(given[i].orientation))));
    }
    bundle.bounds = bundle.computeBounds();
    return result;
}

}  // namespace stx

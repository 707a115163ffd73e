#include "lib/registration/refine_poses.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "lib/base/median.hpp"
#include "lib/base/parallel.hpp"
#include "lib/registration/camera_moves.hpp"
#include "lib/registration/overlap.hpp"
#include "lib/registration/pose_system.hpp"

namespace stx {
namespace {

using namespace registration;

/// Points of a view compared with each of its partners, at the coarsest resolution; twice as many
/// at each finer one.
constexpr double kPointsPerPair = 4000;
/// Tukey's biweight at 95 % efficiency.
constexpr double kTukey = 4.685;
/// Spread of a normal distribution from its median absolute deviation.
constexpr double kSpread = 1.4826;
/// Least spreads that residuals are weighed with: half a step of 8 bits; the depth's resolution.
constexpr double kLeastColour = 0.5 / 255, kLeastDepth = 1e-4;
/// Corrections below this (radians, and share of the scene's size) end the whole size; four times
/// as much each coarser one.
constexpr double kConverged = 1e-5;

/// Colours tell where their difference falls below this share of what it was (see coloursTell())
/// and by half a step of 8 bits, and depth's does not rise above that share of it: of the kitchen
/// of 7-Scenes it rises by 7 %.
constexpr double kColoursTell = 0.85, kLeastTold = 0.5 / 255, kDepthStays = 1.25;
/// What so many steps at the coarsest resolution must leave of the difference of colours at most,
/// or no more are made: of the kitchen they leave 0.65 to 0.88, of ICL-NUIM 0.35, of Open3D's
/// recording 1.00.
constexpr int kTrialSteps = 4;
constexpr double kTrialTells = 0.95;
/// Trackers are off by a degree, and by a hundredth of the distance. What turns views by more
/// (radians), or moves them by a larger share of it, has found something else: views that show the
/// same picture, or hardly anything.
constexpr double kMostTurn = 0.05, kMostShift = 0.03;
/// Views whose depth is apart by a smaller share of the distance are exact, and so are their poses:
/// programs' sets of tests/bench/pictures.md come to 0.002 %, recordings to 0.12 % and more.
constexpr double kExact = 2e-4;

struct GreySample {
    double value;
    glm::dvec2 gradient;  ///< per pixel of the full size
};

/// Bilinear at a pixel position of the full size; nothing outside.
std::optional<GreySample> sampleGrey(const PoseSample& view, int level, double x, double y) {
    const auto at = std::min(static_cast<std::size_t>(level), view.grey.size() - 1);
    const Image<float>& image = view.grey[at];
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
std::vector<PointResiduals> compare(const std::vector<PoseSample>& views, const Pair& pair,
                                    int level, double tolerance) {
    const PoseSample& from = views[pair.from];
    const PoseSample& to = views[pair.to];
    const Camera& own = from.header.camera;
    const Camera& camera = to.header.camera;
    const Pose target(camera);
    const double pixels = static_cast<double>(own.width) * own.height;
    const double wanted = kPointsPerPair * (1 << (kPoseLevels - 1 - level));
    const int step = std::max(1, static_cast<int>(std::sqrt(pixels / wanted)));

    std::vector<PointResiduals> all;
    for (int y = step / 2; y < own.height; y += step) {
        for (int x = step / 2; x < own.width; x += step) {
            if (!hasPoint(from.depth.at(x, y))) continue;
            const glm::dvec3 world =
                own.position +
                own.orientation * own.unproject(x + 0.5, y + 0.5, from.depth.at(x, y));
            const glm::dvec3 p = target.toCamera(world);
            if (!(p.z < 0)) continue;
            const glm::dvec3 at = camera.project(p);
            const auto surface = sampleDepth(to.depth, at.x, at.y);
            if (!surface) continue;
            const double dist = at.z;
            const double difference = (dist - surface->distance) / dist;
            if (std::abs(difference) > tolerance) continue;
            const auto there = sampleGrey(to, level, at.x, at.y);
            const auto here = sampleGrey(from, level, x + 0.5, y + 0.5);
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

/// Of points that both show; cameras expose each picture for itself: a common difference says
/// nothing of poses.
double exposureBetween(const std::vector<PointResiduals>& points) {
    std::vector<double> colours(points.size());
    for (std::size_t k = 0; k < points.size(); ++k) colours[k] = points[k].colour.value;
    return medianOf(std::move(colours));
}

/// One step; gives the largest correction.
double step(std::vector<PoseSample>& views, const std::vector<Pair>& pairs, int level,
            double tolerance, PoseSystem& system) {
    std::vector<PairEquations> equations(pairs.size());
    parallelFor(0, pairs.size(), [&](std::size_t at) {
        const auto points = compare(views, pairs[at], level, tolerance);
        const double exposure = exposureBetween(points);
        accumulate(points, &PointResiduals::depth, 0, kLeastDepth, system, equations[at]);
        accumulate(points, &PointResiduals::colour, exposure, kLeastColour, system, equations[at]);
    });
    return system.solveAndMove(pairs, equations, views);
}

/// PoseRefinement::coloursBefore, or coloursAfter.
double coloursApart(const std::vector<PoseSample>& views, const std::vector<Pair>& pairs, int level,
                    double tolerance) {
    std::vector<std::optional<double>> ofPair(pairs.size());
    parallelFor(0, pairs.size(), [&](std::size_t at) {
        const auto points = compare(views, pairs[at], level, tolerance);
        if (points.empty()) return;
        const double exposure = exposureBetween(points);
        std::vector<double> apart;
        for (const PointResiduals& p : points) apart.push_back(std::abs(p.colour.value - exposure));
        ofPair[at] = medianOf(std::move(apart));
    });
    std::vector<double> all;
    for (const auto& one : ofPair)
        if (one) all.push_back(*one);
    return medianOf(std::move(all));
}

std::vector<DepthView> depthViewsOf(const std::vector<PoseSample>& views) {
    std::vector<DepthView> out;
    for (const PoseSample& view : views) out.push_back({&view.header, &view.depth});
    return out;
}

/// Moves the cameras of samples as far as their differences tell. False: a trial was asked for, and
/// tells that they need not be moved.
Result<bool> moveCameras(std::vector<PoseSample>& views, const std::vector<Pair>& pairs,
                         const PoseRefinementSettings& settings, Job& job) {
    PoseSystem system(views, pairs);
    const int coarsest = kPoseLevels - 1;
    const auto apart = [&] {
        return coloursApart(views, pairs, coarsest, settings.overlapTolerance);
    };
    const double before = settings.onlyIfColoursTell ? apart() : 0;
    for (int level = coarsest; level >= settings.finest; --level) {
        for (int i = 0; i < settings.iterations; ++i) {
            STX_CHECK(job.checkCancelled());
            job.progress((coarsest - level) * settings.iterations + i,
                         kPoseLevels * settings.iterations, "refining poses");
            if (step(views, pairs, level, settings.overlapTolerance, system) <
                kConverged * (1 << (2 * level)))
                break;
            if (settings.onlyIfColoursTell && level == coarsest && i + 1 == kTrialSteps &&
                apart() > kTrialTells * before)
                return false;
        }
    }
    return true;
}

/// The cameras as they were given.
PoseRefinement stay(PoseRefinement result, const std::vector<Camera>& given,
                    std::vector<PoseSample>& views) {
    for (std::size_t i = 0; i < given.size(); ++i) views[i].header.camera = given[i];
    result.kept = false;
    result.maxShift = result.maxShiftShare = result.maxTurn = 0;
    return result;
}

}  // namespace

bool PoseRefinement::coloursTell() const {
    return coloursAfter < kColoursTell * coloursBefore &&
           coloursBefore - coloursAfter > kLeastTold && maxTurn < kMostTurn &&
           maxShiftShare < kMostShift &&
           after.relative < kDepthStays * std::max(before.relative, kExact);
}

Result<PoseRefinement> refinePoses(std::vector<PoseSample>& views,
                                   const PoseRefinementSettings& settings, Job& job) {
    PoseRefinement result;
    const auto depths = depthViewsOf(views);
    const auto pairs = overlappingPairs(depths, settings);
    result.before = result.after = disagreement(depths, pairs, settings);
    if (result.before.pairs == 0) return result;
    if (settings.onlyIfColoursTell && result.before.relative < kExact) {
        result.kept = false;
        return result;
    }
    std::vector<Camera> given;
    for (const PoseSample& view : views) given.push_back(view.header.camera);
    const auto coloursNow = [&] {
        return coloursApart(views, pairs, settings.finest, settings.overlapTolerance);
    };
    result.coloursBefore = coloursNow();
    STX_TRY(const bool moved, moveCameras(views, pairs, settings, job));
    if (!moved) return stay(result, given, views);
    result.after = disagreement(depths, pairs, settings);
    result.coloursAfter = coloursNow();
    for (std::size_t i = 0; i < given.size(); ++i) {
        const CameraMove move = moveBetween(given[i], views[i].header.camera);
        result.maxShift = std::max(result.maxShift, glm::length(move.shift));
        result.maxShiftShare =
            std::max(result.maxShiftShare,
                     glm::length(move.shift) / MovedCamera::of(views[i].header).distance);
        result.maxTurn = std::max(result.maxTurn, glm::angle(move.turn));
    }
    // Colours that do not fit the depth can draw the poses away from where the depth agrees.
    result.kept = result.coloursTell() || (!settings.onlyIfColoursTell &&
                                           !(result.after.relative > result.before.relative));
    return result.kept ? result : stay(result, given, views);
}

Result<PoseRefinement> refinePoses(Bundle& bundle, const PoseRefinementSettings& settings,
                                   Job& job) {
    std::vector<PoseSample> samples = poseSamplesOf(bundle.views);
    STX_TRY(PoseRefinement result, refinePoses(samples, settings, job));
    if (!result.kept || result.before.pairs == 0) return result;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        ReferenceView& view = bundle.views[i];
        const Camera& now = samples[i].header.camera;
        if (now != view.camera) moveCamera(view, moveBetween(view.camera, now));
    }
    bundle.bounds = bundle.computeBounds();
    return result;
}

}  // namespace stx

#include "lib/selection/coverage.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "lib/base/parallel.hpp"
#include "lib/model/peak_memory.hpp"
#include "lib/refine/noise.hpp"
#include "lib/surface/depth_gradient.hpp"

namespace stx {
namespace {

/// The fractional part of i times the golden ratio and of i times another badly approximable
/// number: even spread without a random generator.
double spread(std::int64_t i, double step) {
    const double x = (static_cast<double>(i) + 0.5) * step;
    return x - std::floor(x);
}

/// The least cosine between the normals of a sample and of what is seen in its place. Beside a
/// right angle the inside of one side is 0 from the outside of the other, which is as far away.
constexpr double kSameSide = 0.1;

/// Of noisy views only points that are sure are samples, where they are so large a part: leaves and
/// what else is small have few.
constexpr double kSureShare = 0.5;

/// What seeing a piece of surface is worth, by how finely it is sampled (1 = as wanted, head-on).
float worthOf(double sampling) {
    constexpr double kEnough = 0.4, kFiner = 0.1;
    return static_cast<float>((1 - kFiner) * std::min(1.0, sampling / kEnough) + kFiner * sampling);
}

}  // namespace

std::vector<SurfaceSample> sampleMesh(const Mesh& mesh, int count) {
    std::vector<SurfaceSample> samples;
    std::vector<double> areas(mesh.triangles.size());
    double total = 0;
    for (std::size_t t = 0; t < areas.size(); ++t) {
        const auto& tri = mesh.triangles[t];
        const glm::dvec3 a(mesh.positions[tri.x]), b(mesh.positions[tri.y]),
            c(mesh.positions[tri.z]);
        areas[t] = 0.5 * glm::length(glm::cross(b - a, c - a));
        total += areas[t];
    }
    if (total > 0) {
        const double each = total / count;
        double until = 0.5 * each, done = 0;
        int places = 0;
        for (std::size_t t = 0; t < areas.size(); ++t) {
            done += areas[t];
            const auto& tri = mesh.triangles[t];
            const glm::dvec3 a(mesh.positions[tri.x]), b(mesh.positions[tri.y]),
                c(mesh.positions[tri.z]);
            const auto material = mesh.triangleMaterial.empty() ? 0u : mesh.triangleMaterial[t];
            const bool twoSided =
                material >= mesh.materials.size() || mesh.materials[material].doubleSided;
            for (; until < done && places < count; until += each) {
                const std::int64_t i = places++;
                double u = spread(i, 0.7548776662466927), v = spread(i, 0.5698402909980532);
                if (u + v > 1) {
                    u = 1 - u;
                    v = 1 - v;
                }
                samples.push_back({a + (b - a) * u + (c - a) * v,
                                   glm::normalize(glm::cross(b - a, c - a)), each});
                if (!twoSided) continue;
                samples.push_back(samples.back());
                samples.back().normal = -samples.back().normal;
                samples.back().otherSide = true;
            }
        }
    }
    if (!mesh.points.empty()) {
        const auto points = static_cast<std::int64_t>(mesh.points.size());
        const std::int64_t stride = std::max<std::int64_t>(1, points / std::max(count, 1));
        for (std::int64_t i = 0; i < points; i += stride) {
            const auto vertex = mesh.points[i];
            const glm::dvec3 normal =
                mesh.normals.empty() ? glm::dvec3(0) : glm::dvec3(mesh.normals[vertex]);
            samples.push_back({glm::dvec3(mesh.positions[vertex]), normal,
                               total > 0 ? total / count : 1.0, true});
        }
    }
    return samples;
}

Sighting sightingOf(const CandidateView& view, const SurfaceSample& sample) {
    Sighting s;
    const Camera& camera = view.depthCamera;
    const glm::dvec3 inCamera =
        glm::inverse(camera.orientation) * (sample.position - camera.position);
    if (!camera.orthographic && !(inCamera.z < 0)) return s;
    const glm::dvec3 pixel = camera.project(inCamera);
    if (!(pixel.x >= 0 && pixel.y >= 0 && pixel.x < camera.width && pixel.y < camera.height))
        return s;
    const glm::dvec3 toCamera =
        camera.orthographic ? -camera.forward() : glm::normalize(camera.position - sample.position);
    s.cosine = sample.normal == glm::dvec3(0) ? 1.0 : glm::dot(sample.normal, toCamera);
    if (sample.twoSided) s.cosine = std::abs(s.cosine);
    if (!(s.cosine > 0)) return s;
    // A depth image tells the distance at pixel centres only: a tilted surface may differ from the
    // nearest ones by what it climbs in a pixel.
    const glm::dvec2 spacing = camera.sampleSpacing(pixel.z);
    const double tangent =
        std::sqrt(std::max(0.0, 1 - s.cosine * s.cosine)) / std::max(s.cosine, 0.1);
    const double tolerance = std::max(spacing.x, spacing.y) * (0.3 + tangent) + view.step +
                             kDoubt * view.noise * (camera.orthographic ? 1.0 : pixel.z);
    const int x0 = static_cast<int>(std::floor(pixel.x - 0.5)),
              y0 = static_cast<int>(std::floor(pixel.y - 0.5));
    for (int k = 0; k < 4 && !s.visible; ++k) {
        const int x = x0 + (k & 1), y = y0 + (k >> 1);
        if (!view.depth->contains(x, y)) continue;
        const float z = view.depth->at(x, y);
        s.visible = hasPoint(z) && std::abs(z - pixel.z) <= tolerance &&
                    (!view.normal || sample.normal == glm::dvec3(0) ||
                     glm::dot(glm::dvec3(view.normal->at(x, y)), sample.normal) > kSameSide);
    }
    if (!s.visible) return s;
    const glm::dvec2 fine = view.camera.sampleSpacing(pixel.z);
    s.density = 1.0 / std::sqrt(fine.x * fine.y);
    return s;
}

CandidateView candidateOf(const ReferenceView& view, double noise) {
    return {view.camera, view.camera,
            &view.depth, view.depthBits == 32 ? 0.0 : view.depthCode().step(),
            nullptr,     noise};
}

ViewSamples samplesOfView(const ReferenceView& view, std::size_t number, std::int64_t stride,
                          const SurfaceAt& surface) {
    ViewSamples out;
    std::vector<bool> sure;
    std::int64_t seen = static_cast<std::int64_t>(number) * 7919 % stride;
    for (int y = 0; y < view.depth.height(); ++y) {
        for (int x = 0; x < view.depth.width(); ++x) {
            if (!hasPoint(view.depth.at(x, y)) || seen++ % stride != 0) continue;
            const SurfacePoint point = surface(x, y);
            SurfaceSample s;
            s.position =
                view.camera.position +
                view.camera.orientation * view.camera.unproject(x + 0.5, y + 0.5, point.dist);
            s.normal =
                view.camera.orientation * planeNormal(view.camera, x, y, point.w, point.gradient);
            const glm::dvec2 spacing = view.camera.sampleSpacing(point.dist);
            out.samples.push_back(s);
            out.ownDensity.push_back(1 / (spacing.x * spacing.y));
            sure.push_back(point.sure);
        }
    }
    // What is off by much is seen by no other view, and would weigh as much as all that it hides.
    const auto count = static_cast<std::size_t>(std::ranges::count(sure, true));
    if (count == sure.size() || count < kSureShare * static_cast<double>(sure.size())) return out;
    for (std::size_t i = 0, to = 0; i < sure.size(); ++i) {
        if (!sure[i]) continue;
        out.samples[to] = out.samples[i];
        out.ownDensity[to++] = out.ownDensity[i];
    }
    out.samples.resize(count);
    out.ownDensity.resize(count);
    return out;
}

namespace {

/// With which a view samples the place of a sample that it sees, or that is its own.
double densityOf(const Sighting& s, double ownDensity) {
    return std::max(s.cosine, 0.05) * (s.visible ? s.density * s.density : ownDensity);
}

/// Of a sample of view `own`, which samples it with density `ownDensity` (squared): by the density
/// with which all views sample its place. `by`: how view k sees it.
template <class SightingBy>
double areaOf(std::size_t own, double ownDensity, std::size_t views, std::int64_t stride,
              const SightingBy& by) {
    double density = 0;  // samples of all views per unit of area
    for (std::size_t k = 0; k < views; ++k) {
        const Sighting s = by(k);
        if (s.visible || own == k) density += densityOf(s, ownDensity);
    }
    return static_cast<double>(stride) / density;
}

/// What a candidate sees of samples; `sighting`: how it sees sample i.
template <class SightingOfSample>
std::vector<SeenSample> seenOf(std::size_t samples, const SightingOfSample& sighting) {
    std::vector<SeenSample> seen;
    for (std::size_t i = 0; i < samples; ++i) {
        const Sighting s = sighting(i);
        if (s.visible)
            seen.push_back({static_cast<std::uint32_t>(i), static_cast<float>(s.cosine),
                            static_cast<float>(s.density)});
    }
    seen.shrink_to_fit();
    return seen;
}

}  // namespace

std::vector<SeenSample> seenBy(const CandidateView& view,
                               const std::vector<SurfaceSample>& samples) {
    return seenOf(samples.size(), [&](std::size_t i) { return sightingOf(view, samples[i]); });
}

CoverProblem coverProblem(const std::vector<SurfaceSample>& samples,
                          std::vector<std::vector<SeenSample>> seen, double targetDensity) {
    CoverProblem problem;
    for (const auto& s : samples) problem.weights.push_back(s.area);
    double target = targetDensity;
    if (!(target > 0)) {
        std::vector<float> best(samples.size(), 0.0f);
        for (const auto& view : seen) {
            for (const auto& s : view) best[s.sample] = std::max(best[s.sample], s.density);
        }
        std::erase(best, 0.0f);
        if (!best.empty()) {
            const auto middle = best.begin() + static_cast<std::ptrdiff_t>(best.size() / 2);
            std::nth_element(best.begin(), middle, best.end());
            target = *middle;
        }
    }
    problem.views.resize(seen.size());
    for (std::size_t v = 0; v < seen.size(); ++v) {
        const std::vector<SeenSample> of = std::exchange(seen[v], {});
        problem.views[v].reserve(of.size());
        for (const auto& s : of) {
            const double rate = target > 0 ? std::min(1.0, s.density / target) : 1.0;
            problem.views[v].push_back({s.sample, worthOf(s.cosine * rate)});
        }
    }
    return problem;
}

std::vector<SurfaceSample> setAreas(const std::vector<ViewSamples>& ofViews,
                                    std::span<const std::vector<Sighting>> seen,
                                    std::int64_t stride) {
    std::vector<SurfaceSample> out;
    for (std::size_t i = 0; i < ofViews.size(); ++i) {
        for (std::size_t n = 0; n < ofViews[i].samples.size(); ++n) {
            SurfaceSample s = ofViews[i].samples[n];
            s.area = areaOf(i, ofViews[i].ownDensity[n], seen.size(), stride,
                            [&](std::size_t k) { return seen[k][out.size()]; });
            out.push_back(s);
        }
    }
    return out;
}

std::vector<SurfaceSample> sampleBundle(const Bundle& bundle, int count,
                                        std::vector<CandidateView>* candidates) {
    // Every stride-th point of each view, from normals as robust as can be.
    const std::int64_t stride = std::max<std::int64_t>(1, bundle.pointCount() / std::max(count, 1));
    std::vector<CandidateView> views(bundle.views.size());
    std::vector<ViewSamples> ofViews(bundle.views.size());
    parallelFor(0, views.size(), [&](std::int64_t i) {
        const ReferenceView& v = bundle.views[i];
        const ViewSurface surface(v);
        views[i] = candidateOf(v, surface.noise());
        ofViews[i] = samplesOfView(v, static_cast<std::size_t>(i), stride,
                                   [&](int x, int y) { return surface.at(x, y); });
    });
    parallelFor(0, views.size(), [&](std::int64_t i) {
        ViewSamples& of = ofViews[i];
        for (std::size_t n = 0; n < of.samples.size(); ++n)
            of.samples[n].area =
                areaOf(static_cast<std::size_t>(i), of.ownDensity[n], views.size(), stride,
                       [&](std::size_t k) { return sightingOf(views[k], of.samples[n]); });
    });
    std::vector<SurfaceSample> samples;
    for (const ViewSamples& of : ofViews)
        samples.insert(samples.end(), of.samples.begin(), of.samples.end());
    if (candidates) *candidates = std::move(views);
    return samples;
}

void weighSides(const std::vector<SurfaceSample>& samples, CoverProblem& problem) {
    std::vector<int> views(samples.size(), 0);
    for (const auto& view : problem.views)
        for (const CoverItem& item : view) ++views[item.sample];
    for (std::size_t i = 1; i < samples.size(); ++i) {
        if (!samples[i].otherSide) continue;
        const int most = std::max(views[i - 1], views[i]);
        if (most > 0) problem.weights[i - 1] *= static_cast<double>(views[i - 1]) / most;
        problem.weights[i] *= most > 0 ? static_cast<double>(views[i]) / most : 0.0;
    }
}

CoverProblem coverProblem(const std::vector<SurfaceSample>& samples,
                          const std::vector<CandidateView>& candidates, double targetDensity) {
    std::vector<std::vector<SeenSample>> seen(candidates.size());
    parallelFor(0, candidates.size(),
                [&](std::int64_t v) { seen[v] = seenBy(candidates[v], samples); });
    return coverProblem(samples, std::move(seen), targetDensity);
}

CoverProblem coverProblem(const std::vector<SurfaceSample>& samples,
                          std::span<const std::vector<Sighting>> sightings, double targetDensity) {
    std::vector<std::vector<SeenSample>> seen;
    for (const std::vector<Sighting>& of : sightings)
        seen.push_back(seenOf(samples.size(), [&](std::size_t i) { return of[i]; }));
    return coverProblem(samples, std::move(seen), targetDensity);
}

Result<CoverProblem> coverProblem(const ViewTable& table, std::int64_t points, int count,
                                  double targetDensity, Job& job) {
    const std::int64_t stride = std::max<std::int64_t>(1, points / std::max(count, 1));
    const std::size_t views = table.count();
    std::vector<ViewSamples> ofViews(views);
    std::vector<double> noise(views);
    const auto sample = [&](std::size_t i,
                            const std::shared_ptr<const ReferenceView>& view) -> Result<void> {
        const ViewSurface surface(*view);
        noise[i] = surface.noise();
        ofViews[i] =
            samplesOfView(*view, i, stride, [&](int x, int y) { return surface.at(x, y); });
        return {};
    };
    STX_CHECK(forEachView(table, peak::kSelect, job, sample));
    std::vector<SurfaceSample> samples;
    std::vector<double> ownDensity;
    std::vector<std::size_t> own;  // whose sample it is
    for (std::size_t i = 0; i < views; ++i) {
        const ViewSamples of = std::exchange(ofViews[i], {});
        samples.insert(samples.end(), of.samples.begin(), of.samples.end());
        ownDensity.insert(ownDensity.end(), of.ownDensity.begin(), of.ownDensity.end());
        own.resize(samples.size(), i);
    }
    // Sums as of areaOf(): in the order of the views.
    std::vector<double> density(samples.size(), 0.0);
    std::vector<std::vector<double>> added(views);
    std::vector<std::vector<SeenSample>> seen(views);
    const auto look = [&](std::size_t k,
                          const std::shared_ptr<const ReferenceView>& view) -> Result<void> {
        const CandidateView candidate = candidateOf(*view, noise[k]);
        added[k].resize(samples.size(), 0.0);
        seen[k] = seenOf(samples.size(), [&](std::size_t i) {
            const Sighting s = sightingOf(candidate, samples[i]);
            if (s.visible || own[i] == k) added[k][i] = densityOf(s, ownDensity[i]);
            return s;
        });
        return {};
    };
    const auto add = [&](std::size_t k) -> Result<void> {
        const std::vector<double> of = std::exchange(added[k], {});
        for (std::size_t i = 0; i < of.size(); ++i) density[i] += of[i];
        job.progress(static_cast<std::int64_t>(k) + 1, static_cast<std::int64_t>(views),
                     "looking at what views see");
        return {};
    };
    STX_CHECK(forEachView(table, peak::kSelect, job, look, add));
    for (std::size_t i = 0; i < samples.size(); ++i)
        samples[i].area = static_cast<double>(stride) / density[i];
    return coverProblem(samples, std::move(seen), targetDensity);
}

}  // namespace stx

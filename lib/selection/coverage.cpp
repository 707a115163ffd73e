#include "lib/selection/coverage.hpp"

#include <algorithm>
#include <cmath>

#include "lib/base/parallel.hpp"

namespace stx {
namespace {

/// The fractional part of i times the golden ratio and of i times another badly approximable
/// number: even spread without a random generator.
double spread(std::int64_t i, double step) {
    const double x = (static_cast<double>(i) + 0.5) * step;
    return x - std::floor(x);
}

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
        for (std::size_t t = 0; t < areas.size(); ++t) {
            done += areas[t];
            const auto& tri = mesh.triangles[t];
            const glm::dvec3 a(mesh.positions[tri.x]), b(mesh.positions[tri.y]),
                c(mesh.positions[tri.z]);
            const auto material = mesh.triangleMaterial.empty() ? 0u : mesh.triangleMaterial[t];
            const bool twoSided =
                material >= mesh.materials.size() || mesh.materials[material].doubleSided;
            for (; until < done && static_cast<int>(samples.size()) < count; until += each) {
                const auto i = static_cast<std::int64_t>(samples.size());
                double u = spread(i, 0.7548776662466927), v = spread(i, 0.5698402909980532);
                if (u + v > 1) {
                    u = 1 - u;
                    v = 1 - v;
                }
                samples.push_back({a + (b - a) * u + (c - a) * v,
                                   glm::normalize(glm::cross(b - a, c - a)), each, twoSided});
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
    const double tolerance = std::max(spacing.x, spacing.y) * (0.3 + tangent) + view.step;
    const int x0 = static_cast<int>(std::floor(pixel.x - 0.5)),
              y0 = static_cast<int>(std::floor(pixel.y - 0.5));
    for (int k = 0; k < 4 && !s.visible; ++k) {
        const int x = x0 + (k & 1), y = y0 + (k >> 1);
        if (!view.depth->contains(x, y)) continue;
        const float z = view.depth->at(x, y);
        s.visible = hasPoint(z) && std::abs(z - pixel.z) <= tolerance;
    }
    if (!s.visible) return s;
    const glm::dvec2 fine = view.camera.sampleSpacing(pixel.z);
    s.density = 1.0 / std::sqrt(fine.x * fine.y);
    return s;
}

std::vector<SurfaceSample> sampleBundle(const Bundle& bundle, int count,
                                        std::span<const DepthSurface> surfaces) {
    std::vector<CandidateView> views;
    std::int64_t points = 0;
    for (const auto& v : bundle.views) {
        views.push_back(
            {v.camera, v.camera, &v.depth, v.depthBits == 32 ? 0.0 : v.depthCode().step()});
        points += v.pointCount();
    }
    // Every stride-th point of each view, from normals as robust as can be.
    const std::int64_t stride = std::max<std::int64_t>(1, points / std::max(count, 1));
    std::vector<std::vector<SurfaceSample>> perView(bundle.views.size());
    parallelFor(0, static_cast<std::int64_t>(perView.size()), [&](std::int64_t i) {
        const ReferenceView& v = bundle.views[i];
        DepthSurface made;
        if (surfaces.empty()) made = depthSurface(v, {});
        const DepthSurface& surface = surfaces.empty() ? made : surfaces[i];
        std::int64_t seen = i * 7919 % stride;
        for (int y = 0; y < v.depth.height(); ++y) {
            for (int x = 0; x < v.depth.width(); ++x) {
                if (std::isnan(surface.w.at(x, y)) || seen++ % stride != 0) continue;
                SurfaceSample s;
                s.position = v.worldPoint(x, y);
                s.normal = v.camera.orientation * planeNormal(v.camera, x, y, surface.w.at(x, y),
                                                              surface.gradient.at(x, y));
                double density = 0;  // samples of all views per unit of area
                for (std::size_t k = 0; k < views.size(); ++k) {
                    const Sighting by = sightingOf(views[k], s);
                    if (by.visible || static_cast<std::size_t>(i) == k)
                        density += std::max(by.cosine, 0.05) *
                                   (by.visible ? by.density * by.density
                                               : 1 / (v.camera.sampleSpacing(v.depth.at(x, y)).x *
                                                      v.camera.sampleSpacing(v.depth.at(x, y)).y));
                }
                s.area = static_cast<double>(stride) / density;
                perView[i].push_back(s);
            }
        }
    });
    std::vector<SurfaceSample> samples;
    for (const auto& some : perView) samples.insert(samples.end(), some.begin(), some.end());
    return samples;
}

CoverProblem coverProblem(const std::vector<SurfaceSample>& samples,
                          const std::vector<CandidateView>& candidates, double targetDensity) {
    CoverProblem problem;
    for (const auto& s : samples) problem.weights.push_back(s.area);
    struct Seen {
        std::uint32_t sample;
        float cosine, density;
    };
    std::vector<std::vector<Seen>> seen(candidates.size());
    parallelFor(0, static_cast<std::int64_t>(candidates.size()), [&](std::int64_t v) {
        for (std::size_t i = 0; i < samples.size(); ++i) {
            const Sighting s = sightingOf(candidates[v], samples[i]);
            if (s.visible)
                seen[v].push_back({static_cast<std::uint32_t>(i), static_cast<float>(s.cosine),
                                   static_cast<float>(s.density)});
        }
    });
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
    problem.views.resize(candidates.size());
    for (std::size_t v = 0; v < seen.size(); ++v) {
        for (const auto& s : seen[v]) {
            const double rate = target > 0 ? std::min(1.0, s.density / target) : 1.0;
            problem.views[v].push_back({s.sample, worthOf(s.cosine * rate)});
        }
    }
    return problem;
}

}  // namespace stx

#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "lib/model/bundle.hpp"
#include "lib/model/mesh.hpp"
#include "lib/model/view_table.hpp"
#include "lib/selection/cover.hpp"
#include "lib/selection/view_surface.hpp"

namespace stx {

/// A piece of surface.
struct SurfaceSample {
    glm::dvec3 position{0.0};  ///< world
    glm::dvec3 normal{0.0};    ///< unit, world
    double area = 0;           ///< scene units squared
    bool twoSided = false;     ///< of a point, which is seen from any side
    bool otherSide = false;    ///< of the piece before, seen from behind
};

/// A view that might be chosen: where its camera would be and what it would see.
struct CandidateView {
    Camera camera;                        ///< at its full resolution: gives the sampling density
    Camera depthCamera;                   ///< the same view at the resolution of `depth`
    const Image<float>* depth = nullptr;  ///< planar distances, kNoDepth where nothing
    double step = 0;                      ///< of the depth code, scene units; 0 = exact
    /// Unit, world, towards the camera, where `depth` has a point; may be left out. With them the
    /// inside of a surface is not seen where its outside is.
    const Image<glm::vec3>* normal = nullptr;
    double noise = 0;  ///< of `depth`: see ViewSurface::noise()
};

/// About `count` places, evenly spread over a mesh's triangles (points of a cloud count as
/// two-sided pieces of equal area that face every way). A triangle that is seen from behind as well
/// has two samples in each place, one for each side. Deterministic.
[[nodiscard]] std::vector<SurfaceSample> sampleMesh(const Mesh& mesh, int count);

/// About `count` samples of all that the views of a bundle show, by the noise of each view. A
/// surface seen by many views counts once: each sample's area is the inverse of the density with
/// which all views sample its place. `candidates`, if any, gets the views as candidates.
[[nodiscard]] std::vector<SurfaceSample> sampleBundle(
    const Bundle& bundle, int count, std::vector<CandidateView>* candidates = nullptr);

/// How often and how well a candidate samples a piece of surface.
struct Sighting {
    bool visible = false;
    double cosine = 0;   ///< of the angle between normal and line of sight
    double density = 0;  ///< samples per scene unit on a surface that faces the camera
};
[[nodiscard]] Sighting sightingOf(const CandidateView& view, const SurfaceSample& sample);

/// What a candidate sees of one sample.
struct SeenSample {
    std::uint32_t sample;
    float cosine, density;  ///< see Sighting
};
/// What a candidate sees of samples.
[[nodiscard]] std::vector<SeenSample> seenBy(const CandidateView& view,
                                             const std::vector<SurfaceSample>& samples);

/// A view of a bundle as a candidate; its depth must outlive it. `noise`: see ViewSurface::noise().
[[nodiscard]] CandidateView candidateOf(const ReferenceView& view, double noise = 0);

/// sampleBundle() for views that are looked at one by one: first samplesOfView() of each, then how
/// each sees the samples of all, then setAreas().
struct ViewSamples {
    std::vector<SurfaceSample> samples;  ///< without their areas
    std::vector<double> ownDensity;      ///< of each: with which its view samples it, squared
};
/// At a pixel with a point.
using SurfaceAt = std::function<SurfacePoint(int x, int y)>;
/// Every `stride`-th point of view `number` of a bundle; without those that are not sure, if they
/// are few.
[[nodiscard]] ViewSamples samplesOfView(const ReferenceView& view, std::size_t number,
                                        std::int64_t stride, const SurfaceAt& surface);
/// All samples, in the order of the views, with their areas; `seen`: for each view a sighting of
/// each of them.
[[nodiscard]] std::vector<SurfaceSample> setAreas(const std::vector<ViewSamples>& ofViews,
                                                  std::span<const std::vector<Sighting>> seen,
                                                  std::int64_t stride);

/// Weighs the two sides of pieces by how many views see each, the one that more see in full: the
/// inside of what is closed is not a surface to look for, and what shows through a narrow gap
/// little (a teapot whose lid does not close: 44.2 dB by twelve views when it counts in full, 49.5
/// so). Of pieces that no view sees, one side counts.
void weighSides(const std::vector<SurfaceSample>& samples, CoverProblem& problem);

/// The problem of choosing among candidates. How finely a view samples a piece of surface is
/// s = visible * cosine * min(1, density / target), and its quality 0.9 * min(1, s / 0.4) + 0.1 *
/// s: a novel view loses little to a surface sampled at a slant and much to one that nobody saw, so
/// most of the worth is in seeing it well enough (up to 66 degrees at the wanted density), the rest
/// in seeing it better. With s itself, views face the large surfaces and leave the narrow ones
/// open: around a fox, eight views by s rendered 1.2 dB worse (mean over 40 random novel views)
/// than these. `targetDensity` 0 = the median, over the surface seen, of the best density any
/// candidate has.
[[nodiscard]] CoverProblem coverProblem(const std::vector<SurfaceSample>& samples,
                                        const std::vector<CandidateView>& candidates,
                                        double targetDensity);
/// The same; `seen`: by candidate. Takes less memory than their images.
[[nodiscard]] CoverProblem coverProblem(const std::vector<SurfaceSample>& samples,
                                        std::vector<std::vector<SeenSample>> seen,
                                        double targetDensity);
/// The same; `seen`: for each candidate a sighting of each sample.
[[nodiscard]] CoverProblem coverProblem(const std::vector<SurfaceSample>& samples,
                                        std::span<const std::vector<Sighting>> seen,
                                        double targetDensity);

/// coverProblem() of sampleBundle() for a table, whose views are read twice, one by one. `points`:
/// of all views. Errors: those of the views, memory, cancelled.
[[nodiscard]] Result<CoverProblem> coverProblem(const ViewTable& table, std::int64_t points,
                                                int count, double targetDensity, Job& job);

}  // namespace stx

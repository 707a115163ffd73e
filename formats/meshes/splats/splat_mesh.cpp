#include <algorithm>

#include "formats/meshes/mesh_builder.hpp"
#include "formats/meshes/readers.hpp"
#include "lib/geometry/origin.hpp"
#include "lib/model/strays.hpp"

namespace stx {
namespace {

/// The splats that tell where the object is: what lets most light through tells nothing of that,
/// unless all do.
std::vector<std::uint32_t> framing(const SplatCloud& cloud) {
    constexpr float kSeen = 0.5f;
    const float most = *std::ranges::max_element(cloud.opacities);
    const float least = most < kSeen ? most * kSeen : kSeen;
    std::vector<std::uint32_t> out;
    for (std::uint32_t i = 0; i < cloud.opacities.size(); ++i)
        if (cloud.opacities[i] >= least) out.push_back(i);
    return out;
}

std::vector<glm::vec3> from(glm::dvec3 origin, const std::vector<glm::dvec3>& centres) {
    std::vector<glm::vec3> out;
    out.reserve(centres.size());
    for (const glm::dvec3 centre : centres) out.emplace_back(centre - origin);
    return out;
}

}  // namespace

Result<void> FileSplats::resize(std::size_t count, int degree, const Limits& limits) {
    STX_CHECK(limits.checkAllocation(count, sizeof(glm::dvec3), "the centres of the splats"));
    STX_CHECK(cloud.resize(count, degree, limits));
    centres.resize(count);
    return {};
}

Result<Mesh> meshOfSplats(FileSplats splats, Job& job) {
    auto& centres = splats.centres;
    splats.cloud.positions = from(glm::dvec3(0.0), centres);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < centres.size(); ++i)
        if (splats.cloud.isSound(i)) centres[kept++] = centres[i];
    centres.resize(kept);
    STX_CHECK(splats.cloud.dropBroken(job));
    STX_CHECK(job.limits.checkAllocation(kept, 16, "the centres of the splats"));
    const auto cloud = std::make_shared<SplatCloud>(std::move(splats.cloud));
    Mesh mesh;
    mesh.splats = cloud;
    mesh.points = framing(*cloud);
    // The bounds count from a splat, so that floats round them as little as the object.
    const glm::dvec3 near = centres[mesh.points.front()];
    mesh.positions = from(near, centres);
    const Strays strays = findStrays(mesh);
    noteStrays(strays, mesh.points.size(), "splats", near, job);
    Bounds bounds = strays.bounds;
    bounds.min += near;
    bounds.max += near;
    mesh.origin = originFor(bounds);
    noteOrigin(mesh.origin, job);
    mesh.positions = from(mesh.origin, centres);
    cloud->positions = mesh.positions;
    STX_CHECK(mesh.check());
    return mesh;
}

}  // namespace stx

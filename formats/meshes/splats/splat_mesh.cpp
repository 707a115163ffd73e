#include "formats/meshes/readers.hpp"

#include <numeric>

namespace stx {

Result<Mesh> meshOfSplats(SplatCloud cloud, Job& job) {
    STX_CHECK(cloud.dropBroken(job));
    Mesh mesh;
    mesh.splats = std::make_shared<const SplatCloud>(std::move(cloud));
    return mesh;
}

Result<void> placeSplats(Mesh& mesh, Job& job) {
    const SplatCloud& cloud = *mesh.splats;
    // What lets most light through tells nothing of where the object is.
    constexpr float kSeen = 0.5f;
    STX_CHECK(job.limits.checkAllocation(cloud.positions.size(), 16, "the centres of the splats"));
    mesh.positions = cloud.positions;
    for (std::uint32_t i = 0; i < cloud.positions.size(); ++i)
        if (cloud.opacities[i] >= kSeen) mesh.points.push_back(i);
    if (mesh.points.empty()) {
        mesh.points.resize(cloud.positions.size());
        std::iota(mesh.points.begin(), mesh.points.end(), 0u);
    }
    return {};
}

}  // namespace stx

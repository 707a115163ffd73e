// Clouds of splats: PLY, SPZ, glTF and SPZ without gzip, the first byte chooses. SPZ in gzip is
// given as what that holds, so that changed bytes reach the reader. What is read is drawn, from two
// sides.

#include <cmath>
#include <cstdlib>

#include "formats/files/deflate.hpp"
#include "formats/meshes/meshes.hpp"
#include "lib/splats/draw.hpp"

using namespace stx;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size < 1) return 0;
    const auto* from = reinterpret_cast<const std::byte*>(data) + 1;
    static constexpr const char* kNames[] = {"s.ply", "s.spz", "s.glb", "s.spz"};
    const int kind = data[0] % 4;
    Bytes bytes(from, from + size - 1);
    if (kind == 1) bytes = compressGzip(bytes, 1);
    Job job;
    job.limits.maxMemoryBytes = 64u << 20;
    job.limits.maxImageSide = 0;
    const auto path = std::filesystem::path("/proc/no/such/folder") / kNames[kind];
    const auto mesh = readMesh(std::move(bytes), path, job);
    if (!mesh) {
        if (mesh.error().message.empty()) std::abort();
        return 0;
    }
    if (!mesh->splats) return 0;
    if (!mesh->check()) std::abort();
    Camera camera = Camera::fromFieldOfView({0, 0, 3}, {1, 0, 0, 0}, {1, 1}, false, 40, 24);
    for (int side = 0; side < 2; ++side) {
        const auto drawn = drawSplats(*mesh->splats, camera, true, job);
        if (!drawn) continue;
        for (const glm::vec4 c : drawn->colour.pixels())
            for (int k = 0; k < 4; ++k)
                if (!(c[k] >= 0.0f && std::isfinite(c[k]) && c.a <= 1.0f)) std::abort();
        for (const float depth : drawn->depth.pixels())
            if (!(depth > 0.0f)) std::abort();
        camera.orthographic = true;
        camera.position = mesh->splats->positions[0];
        camera.position.z += 1;
    }
    return 0;
}

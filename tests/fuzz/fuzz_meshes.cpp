// Models: our readers of glTF, GLB and PLY, and what we make of Assimp's and Draco's results. The
// first byte chooses the format. No other file can be opened, and no picture is decoded: each is
// larger than the limit.

#include <cstdlib>
#include <map>

#include "formats/meshes/meshes.hpp"
#include "formats/meshes/mtl_notes.hpp"

using namespace stx;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size < 1) return 0;
    const auto* from = reinterpret_cast<const std::byte*>(data) + 1;
    static constexpr const char* kNames[] = {"m.gltf", "m.glb", "m.ply", "m.obj", "m.stl",
                                             "m.drc",  "",      "m.off", "m.dae", "m.fbx"};
    const int kind = data[0] % 10;
    if (kind == 6) {
        std::map<std::string, MtlMaterial> materials;
        (void)plainMtl({reinterpret_cast<const char*>(from), size - 1}, "", materials);
        return 0;
    }
    Job job;
    job.limits.maxMemoryBytes = 64u << 20;
    job.limits.maxImageSide = 0;
    const auto path = std::filesystem::path("/proc/no/such/folder") / kNames[kind];
    const auto mesh = readMesh(Bytes(from, from + size - 1), path, job);
    if (!mesh) {
        const std::string text = mesh.error().text();
        if (mesh.error().message.empty() || text.find('\n') != std::string::npos) std::abort();
        return 0;
    }
    if (!mesh->check()) std::abort();
    if (!mesh->triangles.empty() && mesh->materials.empty()) std::abort();
    for (const Material& material : mesh->materials)
        for (const int texture :
             {material.baseColourTexture, material.normalTexture, material.emissiveTexture})
            if (texture >= static_cast<int>(mesh->textures.size())) std::abort();
    return 0;
}

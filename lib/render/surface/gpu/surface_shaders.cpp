#include "lib/render/surface/gpu/surface_shaders.hpp"

#include "embedded_shaders.hpp"

namespace stx::gpu {

std::string surfaceHeader(const SurfaceVariant& v, SurfaceProgram program) {
    // NVIDIA's compiler copies the bodies of loops, and takes twice as long for these shaders,
    // which are not faster for it; others ignore its pragma.
    return fmt::format(
        "#version 450 core\n#pragma optionNV(unroll none)\n#define S {}\n#define FREE_LEVEL "
        "{:.9e}\n#define MOST {}\n"
        "#define EXTEND {}\n#define ORIGIN {}\n",
        v.samplesPerPixel, v.freeLevel, v.mostSources,
        program == SurfaceProgram::extensions ? 1 : 0,
        program == SurfaceProgram::resolveWithOrigin ? 1 : 0);
}

ShaderStage surfaceStage(SurfaceProgram program) {
    using namespace shaders;
    switch (program) {
        case SurfaceProgram::mesh:
        case SurfaceProgram::extensions:
            return {GL_COMPUTE_SHADER, "surface_raster.comp", {surface_raster_comp}};
        case SurfaceProgram::fuse:
            return {GL_COMPUTE_SHADER, "surface_fuse.comp", {surface_fuse_comp}};
        case SurfaceProgram::shade:
            return {GL_COMPUTE_SHADER, "surface_shade.comp", {surface_shade_comp}};
        case SurfaceProgram::resolve:
        case SurfaceProgram::resolveWithOrigin:
            break;
    }
    return {GL_COMPUTE_SHADER, "surface_resolve.comp", {surface_resolve_comp}};
}

std::vector<ShaderText> allSurfaceShaders() {
    std::vector<ShaderText> out;
    for (const SurfaceVariant v : {SurfaceVariant{3, 4}, SurfaceVariant{4, 4}})
        for (const auto program :
             {SurfaceProgram::mesh, SurfaceProgram::extensions, SurfaceProgram::fuse,
              SurfaceProgram::shade, SurfaceProgram::resolve, SurfaceProgram::resolveWithOrigin}) {
            const ShaderStage stage = surfaceStage(program);
            out.push_back(shaderText(fmt::format("{} program {} S {}", stage.name,
                                                 static_cast<int>(program), v.samplesPerPixel),
                                     surfaceHeader(v, program), stage));
        }
    return out;
}

}  // namespace stx::gpu

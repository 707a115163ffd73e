#include "lib/render/surface/gpu/surface_shaders.hpp"

#include <array>

#include "embedded_shaders.hpp"
#include "lib/render/surface/constants.hpp"
#include "lib/render/surface/cpu/fuse.hpp"

namespace stx::gpu {

std::string surfaceHeader(const SurfaceVariant& v, SurfaceProgram program) {
    using namespace surface;
    const std::array constants{ShaderConstant{"kCrack", kCrack},
                               ShaderConstant{"kLeafGrow", kLeafGrow},
                               ShaderConstant{"kHalfBesideBackground", kHalfBesideBackground},
                               ShaderConstant{"kHalfInside", kHalfInside},
                               ShaderConstant{"kExtensionReach", kExtensionReach},
                               ShaderConstant{"kSame", kSame},
                               ShaderConstant{"kJump", kJump},
                               ShaderConstant{"kOneSurface", kOneSurface},
                               ShaderConstant{"kLinkedSamples", kLinkedSamples},
                               ShaderConstant{"kExtensionWeight", kExtensionWeight},
                               ShaderConstant{"kFreeAlpha", v.freeAlpha},
                               ShaderConstant{"kSlopeDoubt", kSlopeDoubt},
                               ShaderConstant{"kAngleFalloff", kAngleFalloff},
                               ShaderConstant{"kEdgeFade", kEdgeFade},
                               ShaderConstant{"kEdgeWeight", kEdgeWeight},
                               ShaderConstant{"kOwn", kOwn},
                               ShaderConstant{"kOnSurface", kOnSurface},
                               ShaderConstant{"kOnSlope", kOnSlope},
                               ShaderConstant{"kSteepestTap", kSteepestTap},
                               ShaderConstant{"kFarthestTap", kFarthestTap}};
    return fmt::format(
               "#version 450 core\n#define S {}\n#define TILE {}\n#define MOST {}\n"
               "#define EXTEND {}\n#define ORIGIN {}\n",
               v.samplesPerPixel, kTile, v.mostSources,
               program == SurfaceProgram::extensions ? 1 : 0,
               program == SurfaceProgram::resolveWithOrigin ? 1 : 0) +
           shaderConstants(constants);
}

ShaderStage surfaceStage(SurfaceProgram program) {
    using namespace shaders;
    const auto stage = [](std::string_view name, std::string_view body) {
        return ShaderStage{
            GL_COMPUTE_SHADER, name, {surface_common_glsl, surface_tiles_glsl, body}};
    };
    switch (program) {
        case SurfaceProgram::mesh:
        case SurfaceProgram::extensions:
            return stage("surface_raster.comp", surface_raster_comp);
        case SurfaceProgram::fuse:
            return stage("surface_fuse.comp", surface_fuse_comp);
        case SurfaceProgram::shade:
            return stage("surface_shade.comp", surface_shade_comp);
        case SurfaceProgram::resolve:
        case SurfaceProgram::resolveWithOrigin:
            break;
    }
    return stage("surface_resolve.comp", surface_resolve_comp);
}

std::vector<ShaderText> allSurfaceShaders() {
    std::vector<ShaderText> out;
    for (const SurfaceVariant v :
         {SurfaceVariant{1, 2}, SurfaceVariant{3, 4}, SurfaceVariant{4, 4}})
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

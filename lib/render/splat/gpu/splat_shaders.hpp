#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "lib/render/api/renderer.hpp"
#include "lib/render/device/shader_program.hpp"
#include "lib/render/splat/gpu/gpu_scene.hpp"

namespace stx::gpu {

/// How the compute pipeline adds up (ACCUMULATE of the shaders).
enum class Sums {
    integers = 0,  ///< a 32-bit atomic for each channel
    floats = 1,    ///< GL_NV_shader_atomic_float: linear colours
    pairs = 2,     ///< two channels to a 64-bit atomic: GL_NV_shader_atomic_int64
};
/// How splats get their shape (RULE of the shaders).
enum class SplatShape { point = 0, uniform = 1, ellipse = 2, paper = 3, small = 4 };

/// Tiles of the frame that hidden tasks are looked for in, pixels a side.
inline constexpr int kCullTile = 16;

/// What is the same for all shaders of a renderer.
struct SplatVariant {
    bool raster = false;
    Sums sums = Sums::integers;
    bool translucent = false;  ///< some point is not fully covered
    bool normals = false;      ///< frames carry them
    bool lit = false;          ///< needs normals
    bool sizes = false;        ///< the slope texture holds sizes
    bool linear = false;       ///< colours are linear light
    bool cull = false;         ///< hidden tasks are left out of the second pass (compute)
};

/// #version, extensions, #defines and constants of a shader; `pass` 1 = visibility, 2 = blending.
[[nodiscard]] std::string splatHeader(const SplatVariant& variant, int pass, SplatShape rule);

enum class SplatProgram { splats, resolve, tiles, cull };
/// The stages of a program, without their header.
[[nodiscard]] std::vector<ShaderStage> splatStages(bool raster, SplatProgram program);

/// The shape of splats of a frame's first tasks, which share one (SplatFrame::uniformTasks).
[[nodiscard]] SplatShape uniformShape(SplatRule rule);

/// The programs of a pipeline, built when they are first asked for.
class SplatPrograms {
  public:
    SplatVariant variant;

    /// `onBuilt` gets each new program.
    SplatPrograms(bool raster, const GpuScene& scene, const RenderSettings& settings,
                  std::function<void(GLuint)> onBuilt = {});
    /// A program; `pass` and `shape` are of SplatProgram::splats. Errors: the driver's.
    [[nodiscard]] Result<GLuint> get(SplatProgram kind, int pass = 0,
                                     SplatShape shape = SplatShape::point);
    /// Builds all that frames will need. Errors: the driver's.
    [[nodiscard]] Result<void> build();
    void clear() { built_.clear(); }
    [[nodiscard]] SplatRule rule() const { return rule_; }

  private:
    SplatRule rule_;
    std::function<void(GLuint)> onBuilt_;
    std::map<std::string, GlProgram> built_;
};

/// Every shader of splat mode in every variant.
[[nodiscard]] std::vector<ShaderText> allSplatShaders();

}  // namespace stx::gpu

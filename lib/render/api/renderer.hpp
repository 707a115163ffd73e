#pragma once

#include <cmath>
#include <memory>
#include <optional>
#include <string>

#include "lib/base/job.hpp"
#include "lib/environment/environment_map.hpp"
#include "lib/light/lighting.hpp"
#include "lib/model/atlas.hpp"
#include "lib/model/bundle.hpp"
#include "lib/refine/refine.hpp"
#include "lib/render/api/frame.hpp"
#include "lib/render/api/stage_log.hpp"
#include "lib/render/api/stages.hpp"

namespace stx {

enum class Backend { automatic, gpu, gl, cpu };
enum class RenderMode { splat, surface };
enum class Quality { normal, best };
/// Splat mode's rule of size and shape.
enum class SplatRule {
    data,   ///< ellipses from splatU/splatV, normals or neighbours: nothing by hand
    paper,  ///< round, diameter in pixels = splatCoefficient / distance (Lee & Park, section 3)
    point,  ///< one pixel, nearest wins
};
/// How Backend::gpu gets splats into the frame.
enum class GpuPipeline {
    /// By what the device has, see gpu::choosePipeline().
    automatic,
    raster,   ///< Lee & Park's: points drawn with vertex texture fetch; OpenGL 3.3 will do
    compute,  ///< atomic depth minimum, then weighted accumulation; needs OpenGL 4.5
};
/// What is put where no reference view shows a surface.
enum class Fill {
    background,  ///< the bundle's background views, and what is around where these have nothing
    spatial,  ///< what is around only (surface mode, in scenes that fill the frame), where a view
              ///< looked at but something hid
    none,
};

struct RenderSettings {
    RenderMode mode = RenderMode::surface;
    Quality quality = Quality::normal;
    SplatRule splat = SplatRule::data;
    double splatCoefficient = 0.0;  ///< for SplatRule::paper; 0 = fitted to the nearest view
    GpuPipeline pipeline = GpuPipeline::automatic;  ///< of splat mode
    /// Frames carry albedo and normals without lights, too. Not on Backend::gl.
    bool normals = false;
    Fill fill = Fill::background;
    /// Stages that are left out.
    StageSet without;
    /// Captured depth is repaired before it is drawn; exact depth is drawn as it is.
    RefineSettings refine;
    /// What is seen where nothing covers a pixel in full, in place of what is around it; null: the
    /// environment that a bundle or an atlas has, if `ownEnvironment`. Frames are opaque then as
    /// far as the environment is; their depth and albedo are the object's alone.
    std::shared_ptr<const EnvironmentMap> environment;
    bool ownEnvironment = true;
    Lighting lighting;

    /// Told what each stage takes and changes; null: nobody asks.
    std::shared_ptr<StageLog> log;

    /// Errors (usage): those of Lighting::check(), a coefficient that is not 0 or more.
    [[nodiscard]] Result<void> check() const {
        STX_CHECK(lighting.check());
        if (splatCoefficient >= 0 && std::isfinite(splatCoefficient)) return {};
        return fail(ErrorCode::usage, "splatCoefficient is {:g}; 0 or more is expected",
                    splatCoefficient);
    }
    [[nodiscard]] bool does(Stage stage) const { return !without.has(stage); }
    [[nodiscard]] bool wantNormals() const { return normals || lighting.on(); }
};

/// Draws novel views of one bundle or atlas. Made once (uploads, per-view preparation), then asked
/// for frames.
class Renderer {
  public:
    virtual ~Renderer() = default;
    /// One frame of camera.width x camera.height. A camera that sees nothing gives an empty frame.
    /// Errors: a camera that fails check(), a lost device, memory.
    [[nodiscard]] virtual Result<Frame> render(const Camera& camera) = 0;
    /// Says which camera render() will be asked for after its next call, so that a backend may draw
    /// that frame while it reads back and finishes the one before. Only a hint: frames are the same
    /// without it.
    virtual void expect(const Camera& next) { (void)next; }
    /// Says that frames are averaged by so much along each side from now on (1 = not at all), and
    /// that what is finer need not be guessed.
    virtual void averagedBy(int factor) { (void)factor; }
    /// Says that lights that move with the camera (Light::inCameraSpace) are where this pose has
    /// them from now on, whichever camera is drawn; nullopt: where each camera has them.
    virtual void lightFrom(const std::optional<Camera>& pose) { lightPose_ = pose; }
    /// Takes a frame that is not needed any more; its memory may serve for the next one.
    virtual void reuse(Frame&& frame) { (void)frame; }
    /// "cpu", "gpu" or "gl".
    [[nodiscard]] virtual std::string backend() const = 0;
    /// GL_RENDERER, or the processor's name and the SIMD target in use.
    [[nodiscard]] virtual std::string device() const = 0;

  protected:
    /// The pose whose lights a camera's picture has.
    [[nodiscard]] const Camera& lightPose(const Camera& camera) const {
        return lightPose_ ? *lightPose_ : camera;
    }

  private:
    std::optional<Camera> lightPose_;
};

/// A device that Backend::gpu and gl can use.
struct Device {
    int index = 0;
    std::string name;       ///< GL_RENDERER
    std::string platform;   ///< "EGL_EXT_platform_device" or "EGL_MESA_platform_surfaceless"
    std::string version;    ///< GL_VERSION
    bool software = false;  ///< llvmpipe, softpipe, swrast
    int maxTextureSize = 0;
};

}  // namespace stx

#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "formats/files/file_spool.hpp"
#include "formats/stx/stx.hpp"
#include "tools/camera_options.hpp"
#include "tools/environment_options.hpp"
#include "tools/picture_times.hpp"
#include "tools/shard.hpp"

namespace stx::tools {

/// What `stx render` was asked for.
struct RenderOptions {
    std::string input, output;
    CameraOptions camera;
    TimeOptions time;
    Backend backend = Backend::automatic;
    RenderSettings settings;  ///< without the lighting
    std::string background;   ///< empty: not given
    EnvironmentOptions environment;
    bool around = false;  ///< equirectangular pictures
    std::vector<std::string> lights;
    std::string ambient = "0.2", specular = "0";
    std::string refine = "auto", without;
    bool matchColours = true, explain = false;
    double shininess = 32;
    std::string fileFormat;
    std::string framesPerSecond;  ///< empty: that of the input, else 25
    int compression = 1;
    bool skipExisting = false, listDevices = false;
    Shard shard;
    int device = -1;
    OpenOptions open;
};

/// The word for --light that is not a Light.
inline constexpr const char* kEnvironmentLight = "environment";
[[nodiscard]] inline bool lightsByEnvironment(const RenderOptions& o) {
    return std::ranges::find(o.lights, kEnvironmentLight) != o.lights.end();
}

/// What is drawn.
struct DrawnScene {
    std::unique_ptr<FileSpool> spool;  ///< of a model that takes much memory; else null
    Model model;                       ///< of what stands still
    /// Of a model whose views are read when the pictures are known, else null: until then `model`
    /// is a bundle of their headers. See makeStill().
    std::unique_ptr<ViewTable> table;
    std::vector<ViewSummary> summaries;  ///< of its views, where not all of them are read
    bool exact = false;                  ///< the file has summaries: there is nothing to refine
    std::unique_ptr<Renderer> still;
    std::unique_ptr<MovingPictures> moving;
    CameraContext context;
    std::int64_t points = 0;
    bool environment = false;  ///< pixels without the object show one
};

/// Opens the input: as a sequence when times are asked for. Notes options that do not matter to it.
/// Puts the lights of `settings` to where they are from the input's origin.
[[nodiscard]] Result<DrawnScene> openScene(const RenderOptions& o, RenderSettings& settings,
                                           const Command& command, Program& program);

/// Errors: Camera::check(); (usage) a film of two sizes; (invalidInput) a picture takes more than
/// the limit. Where drawing it takes even more, as far as that is known, the error says so.
[[nodiscard]] Result<void> checkPictures(const RenderOptions& o, const RenderSettings& settings,
                                         const std::vector<NovelCamera>& pictures,
                                         const DrawnScene& scene, const Limits& limits);

/// Reads the views that pictures are drawn from, and makes the renderer of a scene that stands
/// still. Errors: those of the views; (invalidInput) a summary that is not that of its pixels.
[[nodiscard]] Result<void> makeStill(const RenderOptions& o, const RenderSettings& settings,
                                     const std::vector<NovelCamera>& pictures, DrawnScene& scene,
                                     Job& job);

/// A picture for each camera, for each time, or for each pair of them.
[[nodiscard]] Result<std::vector<NovelCamera>> picturesOf(const RenderOptions& o,
                                                          const DrawnScene& scene,
                                                          Program& program);

/// The times of pictures as a clock; nothing where they do not ascend.
[[nodiscard]] std::optional<Timeline> clockOf(const std::vector<NovelCamera>& pictures);

/// Lights by an environment: the one that is shown, else the model's own.
[[nodiscard]] Result<void> lightBy(const Model& model, RenderSettings& settings, Job& job);

}  // namespace stx::tools

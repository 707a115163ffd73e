#pragma once

#include <optional>
#include <string>
#include <vector>

#include "lib/base/result.hpp"
#include "lib/geometry/bounds.hpp"
#include "lib/geometry/camera.hpp"
#include "lib/model/reference_view.hpp"
#include "lib/registration/camera_moves.hpp"
#include "tools/command_line.hpp"
#include "tools/program.hpp"

namespace stx::tools {

/// The novel cameras of `stx render`, as the command line gives them.
struct CameraOptions {
    std::string eye, target, up;  ///< "X,Y,Z", empty = not given
    std::optional<double> fovDeg;
    std::optional<double> orthoHeight;  ///< orthographic novel camera: window height in scene units
    int view = -1;
    int orbit = 0;
    double elevationDeg = 15.0, startDeg = 0.0, arcDeg = 360.0;
    double orbitRadius = 0;  ///< 0 = the object fills the picture
    double swayPercent = 0;  ///< of the median distance; 0 = not given
    int swayFrames = 0;      ///< 0 = not given
    std::string cameraFile;
    std::string dataparser;  ///< of a camera_path.json; empty: one beside it
    bool aligned = false;    ///< its cameras are where refining moved those of the views
    std::string size;
};

/// The camera's view in a picture of another size, when one is given. Its pixels keep their shape
/// and nothing of the view is cut: a picture of another shape shows more on its longer side.
[[nodiscard]] Camera inPicture(const Camera& camera, const std::optional<glm::ivec2>& size);

void addCameraOptions(const Command& command, CameraOptions& options);

/// The number of cameras asked for. Errors (usage, io) that need no input to be seen: so they come
/// before an hour of loading.
[[nodiscard]] Result<int> checkCameraOptions(const CameraOptions& options, const Command& command,
                                             Program& program);

/// The pose that --sway is around.
struct SwayPose {
    Camera camera;
    double distance = 0;  ///< median of what the view shows there, scene units
};
/// The number of the view that --view names; where that is below 0, which it is when it is not
/// given, of the first that is not a background view. Errors (usage): none of that number.
[[nodiscard]] Result<std::size_t> namedView(int view, const std::vector<ReferenceView>& views);

/// What the cameras are made for: the object and its reference views.
struct CameraContext {
    Bounds bounds;                 ///< of the object
    glm::dvec3 origin{0.0};        ///< what bounds and views count from; options are in the world
    std::vector<Camera> views;     ///< of the reference views; empty for a mesh
    MovesOfNeighbours moved = {};  ///< how refining moved them
    std::optional<glm::dvec3> up = {};  ///< of a cloud of splats: SplatCloud::up
    std::optional<SwayPose> sway = {};  ///< where --sway is given
};

/// The cameras of views, without those of the background, and how they got where they are.
[[nodiscard]] std::vector<MovedCamera> movedCameras(const std::vector<ReferenceView>& views);

/// Notes that a cloud of splats is not taken to stand on +Y.
void noteSplatsUp(glm::dvec3 up, Job& job);

/// A camera of a picture, and when it is taken, in seconds, where its file says so.
struct NovelCamera {
    Camera camera;
    std::optional<double> time = {};
    std::string name = {};  ///< that a file of cameras has for it; empty: none
};

/// The cameras asked for, in order, counted from the context's origin. Without any camera option:
/// one from the front, slightly above. Errors (usage) on contradicting options and on views that do
/// not exist.
[[nodiscard]] Result<std::vector<NovelCamera>> makeCameras(const CameraOptions& options,
                                                           const CameraContext& context,
                                                           Program& program);

}  // namespace stx::tools

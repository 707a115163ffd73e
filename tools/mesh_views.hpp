#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "lib/geometry/view_layout.hpp"
#include "lib/model/view_table.hpp"
#include "lib/selection/selection.hpp"
#include "tools/command_line.hpp"
#include "tools/program.hpp"

namespace stx::tools {

/// How a mesh becomes reference views, as the command line says it.
struct MeshViewOptions {
    std::string views = "sphere:16";
    std::string size;        ///< empty: 512x512, or what a camera file says
    std::string projection;  ///< empty: perspective, except the faces of a cube
    std::optional<double> elevationDeg;
    double fovDeg = 35.0;
    std::optional<int> depthBits;      ///< nothing: 16, or what an image set has
    std::optional<int> supersampling;  ///< nothing: 4
    std::string normals = "none";
    bool materials = false;
    std::string up;    ///< empty: Y, except of clouds of splats, see SplatCloud::up
    std::string plot;  ///< SVG of quality against the number of views, of --views auto
    /// Heading of the help that they are under.
    static constexpr const char* kHeading = "Views of a mesh";
};

void addMeshViewOptions(const Command& command, const std::shared_ptr<MeshViewOptions>& options);

/// Errors (usage) that are found before a mesh is read.
[[nodiscard]] Result<void> checkMeshViewOptions(const MeshViewOptions& options,
                                                const Command& command, Program& program);

/// Captures a mesh by a layout, a camera file, or the best views (auto:N, auto:DBdB), of which
/// `selection` gets how good the choice is.
[[nodiscard]] Result<Bundle> captureMesh(const Mesh& mesh, const MeshViewOptions& options,
                                         Program& program, Selection* selection = nullptr);

/// The same views, captured when they are asked for; see withCapturedViews().
[[nodiscard]] Result<void> withMeshViews(
    const Mesh& mesh, const MeshViewOptions& options, Program& program,
    const std::function<Result<void>(std::unique_ptr<ViewTable> table, Job& job)>& use);

}  // namespace stx::tools

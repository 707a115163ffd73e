#include "formats/any/info.hpp"
#include "formats/any/open.hpp"
#include "formats/images/images.hpp"
#include "lib/sheet/camera_plot.hpp"
#include "tools/commands.hpp"

namespace stx::tools {
namespace {

struct InfoCommandOptions {
    std::string input, plot;
    InfoOptions info;
};

glm::dvec3 vectorOf(const nlohmann::ordered_json& json) {
    return {json[0].get<double>(), json[1].get<double>(), json[2].get<double>()};
}

Camera cameraOf(const nlohmann::ordered_json& view) {
    const auto& turn = view["orientation"];
    const auto& fov = view["fieldOfView"];
    Camera camera = Camera::fromFieldOfView(
        vectorOf(view["position"]), quatFromAxisAngle({vectorOf(turn), turn[3].get<double>()}),
        {fov[0].get<double>(), fov[1].get<double>()}, view["orthographic"].get<bool>(),
        view["width"].get<int>(), view["height"].get<int>());
    if (view.contains("intrinsics")) {
        camera.fx = view["intrinsics"]["fx"].get<double>();
        camera.fy = view["intrinsics"]["fy"].get<double>();
        camera.cx = view["intrinsics"]["cx"].get<double>();
        camera.cy = view["intrinsics"]["cy"].get<double>();
    }
    return camera;
}

/// The plot of the cameras that `found` tells of; of an image set, whose cameras it does not have,
/// of those of its views.
Result<std::string> plotOf(const nlohmann::ordered_json& found, const InfoCommandOptions& o,
                           Program& program) {
    std::vector<PlottedCamera> cameras;
    Bounds bounds;
    if (found.value("container", "") == "imageset") {
        preloadCodecs(o.input);
        STX_TRY(const auto bundle, openBundle(o.input, {}, program.job));
        for (const auto& view : bundle.views) {
            cameras.push_back({view.name, view.camera});
            cameras.back().camera.position += bundle.origin;
        }
        bounds = bundle.computeBounds();
        bounds.min += bundle.origin;
        bounds.max += bundle.origin;
    } else if (found.contains("views")) {
        if (found.contains("objects"))
            return fail(ErrorCode::usage,
                        "'{}' has several objects, and their cameras are not in one place; give "
                        "--object NAME",
                        o.input);
        for (const auto& view : found["views"])
            cameras.push_back({view["name"].get<std::string>(), cameraOf(view)});
        if (found.contains("bounds")) {
            bounds.min = vectorOf(found["bounds"]["min"]);
            bounds.max = vectorOf(found["bounds"]["max"]);
        } else {
            program.job.note("the file does not tell the object's bounds; --bounds computes them");
        }
    }
    if (cameras.empty())
        return fail(ErrorCode::invalidInput, "'{}' has no views, so there are no cameras to draw",
                    o.input);
    return cameraPlot(cameras, bounds,
                      fmt::format("{}: {}", std::filesystem::path(o.input).filename().string(),
                                  counted(cameras.size(), "camera")));
}

Result<int> info(const InfoCommandOptions& o, Program& program) {
    STX_CHECK(checkPlotTarget("--cameras", o.plot, program));
    STX_TRY(const auto found, describe(o.input, o.info, program.job));
    if (!o.plot.empty()) {
        STX_TRY(const auto svg, plotOf(found, o, program));
        STX_CHECK(writeFile(o.plot, std::as_bytes(std::span(svg)), program.outputOptions()));
    }
    if (program.common.format == "json")
        program.printJson(found);
    else
        program.print(describeAsText(found));
    return 0;
}

}  // namespace

void addInfo(CommandLine& line, Program& program) {
    Command c = line.add("info",
                         "What is in a file: container, nodes, views, cameras, bytes\n\n"
                         "  stx info model.mp4\n"
                         "  stx info model.exr --format json --bounds\n"
                         "  stx info capture.exr --agreement\n"
                         "  stx info capture.exr --memory\n"
                         "  stx info model.mp4 --cameras cameras.svg");
    auto o = std::make_shared<InfoCommandOptions>();
    c.option("FILE", o->input, "Bundle, atlas, mesh or image set").required();
    c.flag("--bounds", o->info.bounds,
           "Compute the bounds and point counts from the pixels where the file does not hold them");
    c.flag("--agreement", o->info.agreement,
           "Compare the views: by how much each differs in depth from those that overlap it, as a "
           "table; a note names views that are off, by their cameras or their depth");
    c.flag("--memory", o->info.memory,
           "How much memory each command takes at most on these views, as a table; views are read "
           "once to find whether they would be refined");
    c.option("--cameras", o->plot,
             "Draw the cameras around the object, from above and from the side, as an SVG picture")
        .writes("FILE.svg");
    c.objectOption(o->info.object);
    c.sharedOptions(program.common, kFormat | kOutside);
    c.runs([o](Program& p) { return info(*o, p); });
}

}  // namespace stx::tools

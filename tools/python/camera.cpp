
#include <pybind11/operators.h>
#include <pybind11/stl.h>

#include "tools/python/arrays.hpp"
#include "tools/python/handles.hpp"
#include "tools/python/keywords.hpp"

namespace stx::python {
namespace {

/// Columns of a pose whose camera looks along +Z with Y down, as ours; and back.
void turnAxes(glm::dmat4& pose) {
    pose[1] = -pose[1];
    pose[2] = -pose[2];
}

bool looksAlongPlusZ(const std::string& axes) {
    if (axes != "opengl" && axes != "opencv")
        refuse(
            "axes is '{}'; opengl (looks along -Z, Y up) or opencv (along +Z, Y down) is "
            "expected",
            axes);
    return axes == "opencv";
}

Camera makeCamera(const py::object& size, double fx, std::optional<double> fy,
                  std::optional<double> cx, std::optional<double> cy, const py::object& pose,
                  const std::string& axes, bool orthographic) {
    const glm::ivec2 pixels = sizeFrom(size, "size");
    Camera camera;
    camera.width = pixels.x;
    camera.height = pixels.y;
    camera.fx = fx;
    camera.fy = fy.value_or(fx);
    camera.cx = cx.value_or(pixels.x * 0.5);
    camera.cy = cy.value_or(pixels.y * 0.5);
    camera.orthographic = orthographic;
    glm::dmat4 worldFromCamera =
        pose.is_none() ? glm::dmat4(1.0) : poseFrom(pose, "world_from_camera");
    if (looksAlongPlusZ(axes)) turnAxes(worldFromCamera);
    camera.orientation = glm::normalize(glm::quat_cast(glm::dmat3(worldFromCamera)));
    camera.position = worldFromCamera[3];
    valueOf(camera.check());
    return camera;
}

CameraSettings lensFrom(const Keywords& given) {
    CameraSettings lens;
    if (const auto size = given.find("size")) {
        const glm::ivec2 pixels = sizeFrom(*size, "size");
        lens.width = pixels.x;
        lens.height = pixels.y;
    }
    given.takeDegrees("fov", lens.fovRad);
    given.take("ortho", lens.orthoHeight);
    if (const auto up = given.find("up")) lens.up = vectorFrom(*up, "up");
    return lens;
}

std::vector<Camera> orbitOf(const AnyModel& model, const py::dict& keywords) {
    const Keywords given(keywords);
    CameraSettings lens = lensFrom(given);
    if (!given.find("up")) lens.up = upOf(*model.model);
    OrbitSettings orbit;
    given.take("count", orbit.count);
    given.takeDegrees("elevation", orbit.elevationRad);
    given.takeDegrees("start", orbit.startRad);
    given.takeDegrees("arc", orbit.arcRad);
    given.take("radius", orbit.distance);
    const Bounds bounds = boundsOf(*model.model);
    glm::dvec3 target = bounds.empty() ? glm::dvec3(0) : bounds.centre();
    if (const auto to = given.find("target")) target = vectorFrom(*to, "target");
    return valueOf(orbitCameras(target, bounds.radius(), orbit, lens));
}

std::string textOf(const Camera& c) {
    return fmt::format("<stx.Camera {}x{} at {:.6g},{:.6g},{:.6g}{}>", c.width, c.height,
                       c.position.x, c.position.y, c.position.z,
                       c.orthographic ? ", orthographic" : "");
}

}  // namespace

void bindCamera(py::module_& module) {
    py::class_<Camera> camera(module, "Camera",
                              R"(Where a camera is and how it maps the scene to pixels.

size: (width, height), pixels. fx, fy: focal lengths in pixels, above 0 (fy: as fx); orthographic:
pixels per scene unit. cx, cy: image point of the viewing axis in pixels (the middle); the first
pixel's centre is (0.5, 0.5), y runs down. world_from_camera: (4, 4) or (3, 4), rotation and position
in scene units (the identity). axes: of that matrix, also of the identity, 'opengl' (+X right, +Y up, looks along -Z) or
'opencv' (+Y down, looks along +Z). Raises stx.Error (usage, invalidInput) for what is no camera.)");
    camera
        .def(py::init(&makeCamera), py::arg("size"), py::arg("fx"), py::kw_only(),
             py::arg("fy") = py::none(), py::arg("cx") = py::none(), py::arg("cy") = py::none(),
             py::arg("world_from_camera") = py::none(), py::arg("axes") = "opengl",
             py::arg("orthographic") = false)
        .def_static(
            "look_at",
            [](const py::object& eye, const py::object& target, const py::kwargs& keywords) {
                for (const auto& [name, value] : keywords) {
                    const std::string word = py::str(name);
                    if (word != "up" && word != "size" && word != "fov" && word != "ortho")
                        throw py::type_error("look_at() has no keyword '" + word +
                                             "'; it has up, size, fov and ortho");
                }
                return valueOf(cameraAt(vectorFrom(eye, "eye"), vectorFrom(target, "target"),
                                        lensFrom(Keywords(keywords))));
            },
            py::arg("eye"), py::arg("target"),
            R"(A camera at `eye` that looks at `target`, both (3,) in scene units.

Keywords: up: (3,), what is up in the picture (0, 1, 0). size: (width, height) in pixels (512, 512).
fov: vertical, degrees above 0 and below 180 (40). ortho: above 0: orthographic, with a window of this
height in scene units.)")
        .def(
            "resized",
            [](const Camera& c, const py::object& size) {
                const glm::ivec2 pixels = sizeFrom(size, "size");
                return c.resized(pixels.x, pixels.y);
            },
            py::arg("size"), "The same view in a picture of (width, height) pixels.");
    camera.def_readonly("width", &Camera::width, "Pixels.")
        .def_readonly("height", &Camera::height, "Pixels.")
        .def_property_readonly(
            "size", [](const Camera& c) { return py::make_tuple(c.width, c.height); },
            "(width, height), pixels.")
        .def_readonly("fx", &Camera::fx, "Focal length in pixels; orthographic: pixels per unit.")
        .def_readonly("fy", &Camera::fy, "As fx, of the vertical.")
        .def_readonly("cx", &Camera::cx, "Image point of the viewing axis, pixels from the left.")
        .def_readonly("cy", &Camera::cy, "The same, pixels from the top.")
        .def_readonly("orthographic", &Camera::orthographic, "No perspective.")
        .def_property_readonly(
            "position", [](const Camera& c) { return arrayOf(c.position); },
            "(3,) float64, scene units.")
        .def_property_readonly(
            "orientation",
            [](const Camera& c) {
                const auto& q = c.orientation;
                const double values[] = {q.w, q.x, q.y, q.z};
                return py::array_t<double>(4, values);
            },
            "(4,) float64: unit quaternion w, x, y, z that turns the camera's axes into the "
            "world's.")
        .def_property_readonly(
            "world_from_camera", [](const Camera& c) { return arrayOf(c.worldFromCamera()); },
            "(4, 4) float64: +X right, +Y up, looks along -Z.")
        .def_property_readonly(
            "camera_from_world", [](const Camera& c) { return arrayOf(c.cameraFromWorld()); },
            "(4, 4) float64, the inverse of world_from_camera.")
        .def_property_readonly(
            "intrinsics",
            [](const Camera& c) {
                const double rows[] = {c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1};
                return py::array_t<double>({3, 3}, rows);
            },
            "(3, 3) float64: fx 0 cx, 0 fy cy, 0 0 1, of axes as OpenCV's.")
        .def(py::self == py::self)
        .def("__repr__", &textOf);
    camera.attr("__hash__") = py::none();
    module.def("orbit", &orbitOf);
}

}  // namespace stx::python

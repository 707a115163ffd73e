#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "tools/python/arrays.hpp"
#include "tools/python/handles.hpp"
#include "tools/python/keywords.hpp"
#include "tools/python/settings.hpp"

namespace stx::python {
namespace {

using Path = std::filesystem::path;

/// A renderer and what must outlive it, for one call at a time.
struct Drawer {
    Job job;
    std::mutex mutex;
    std::unique_ptr<Renderer> renderer;
    glm::dvec3 origin{0.0};  ///< the model's
};
using DrawerPointer = std::shared_ptr<Drawer>;

DrawerPointer makeDrawer(const AnyModel& model, const py::dict& keywords, JobHandle* handle) {
    const Keywords given(keywords);
    RenderSettings settings = renderSettingsFrom(given);
    const Backend backend = backendFrom(given);
    int device = -1;
    given.take("device", device);
    std::optional<Path> environment;
    if (const auto file = given.find("environment"); file && !py::isinstance<py::bool_>(*file))
        given.take("environment", environment);
    auto drawer = std::make_shared<Drawer>();
    drawer->origin = originOf(*model.model);
    if (handle) drawer->job.limits = handle->job.limits;
    drawer->renderer = runFor(drawer->job, handle, [&]() -> Result<std::unique_ptr<Renderer>> {
        Job& job = drawer->job;
        if (environment) {
            STX_TRY(const auto around, openEnvironment(*environment, job));
            STX_TRY(settings.environment, EnvironmentMap::make(*around, job.limits));
        }
        return rendererOf(model.model, settings, job, backend, device);
    });
    return drawer;
}

DrawnFrame draw(const DrawerPointer& drawer, const Camera& camera,
                const std::optional<Camera>& next, JobHandle* handle) {
    valueOf(camera.check());
    valueOf(drawer->job.limits.checkAllocation(
        static_cast<std::uint64_t>(camera.width) * camera.height, 64, "the picture"));
    auto frame = runFor(drawer->job, handle, [&]() -> Result<Frame> {
        const std::lock_guard lock(drawer->mutex);
        STX_CHECK(drawer->job.checkCancelled());
        if (next) drawer->renderer->expect(*next);
        return drawer->renderer->render(camera);
    });
    return {std::make_shared<const Frame>(std::move(frame)), camera, drawer->origin};
}

std::optional<glm::vec3> behind(const py::object& background) {
    if (background.is_none()) return std::nullopt;
    const glm::vec3 colour = colourFrom(background, "background");
    if (glm::any(glm::lessThan(colour, glm::vec3(0))) ||
        glm::any(glm::greaterThan(colour, glm::vec3(1))))
        refuse("background is {}; values of 0 to 1 are expected", std::string(py::str(background)));
    return colour;
}

void saveFrame(const DrawnFrame& drawn, const Path& path, const py::object& background, int quality,
               bool noClobber, JobHandle* job) {
    PictureOptions options;
    options.background = behind(background);
    options.jpegQuality = quality;
    options.noClobber = noClobber;
    options.camera = drawn.camera;
    options.origin = drawn.origin;
    if (quality < 1 || quality > 100) refuse("quality is {}; 1 to 100 is expected", quality);
    run(job, [&](Job& part) { return save(*drawn.frame, path, options, part); });
}

/// A file, a drawn frame (as its PNG) or an array.
Picture pictureFrom(const py::object& value, const char* name, JobHandle* job) {
    if (py::isinstance<DrawnFrame>(value))
        return stx::pictureOf(*value.cast<const DrawnFrame&>().frame);
    if (py::isinstance<py::str>(value) || py::hasattr(value, "__fspath__")) {
        const auto path = value.cast<Path>();
        return run(job, [&](Job& part) { return openPicture(path, part); });
    }
    const Texture texture = textureFrom(value, name);
    Picture picture;
    if (texture.rgba8()) picture.coded = *texture.rgba8();
    if (!texture.rgbaFloat()) return picture;
    picture.linear = *texture.rgbaFloat();
    // What is compared with pictures of 8 bits.
    picture.coded = Rgba8Image(picture.linear.width(), picture.linear.height());
    const auto coded = [](float v) {
        return static_cast<std::uint8_t>(std::lround(255 * std::clamp(v, 0.0f, 1.0f)));
    };
    for (std::size_t i = 0; i < picture.coded.count(); ++i) {
        const glm::vec4 c = picture.linear.data()[i];
        picture.coded.data()[i] = {coded(srgbFromLinear(c.r)), coded(srgbFromLinear(c.g)),
                                   coded(srgbFromLinear(c.b)), coded(c.a)};
    }
    return picture;
}

Comparison comparePictures(const py::object& a, const py::object& b, const py::object& mask,
                           const py::object& background, JobHandle* job) {
    const Picture first = pictureFrom(a, "a", job), second = pictureFrom(b, "b", job);
    CompareSettings settings;
    Image<std::uint8_t> counts;
    if (!mask.is_none()) {
        counts = maskFrom(mask, "mask");
        settings.mask = &counts;
    }
    settings.background = behind(background).value_or(glm::vec3(0));
    return run(job, [&](Job& part) { return compare(first, second, settings, part); });
}

void bindFrame(py::module_& module) {
    const auto image = [](auto Frame::*member) {
        return [member](const DrawnFrame& d) { return arrayOf((*d.frame).*member, d.frame); };
    };
    py::class_<DrawnFrame>(module, "Frame",
                           "A picture that stx.render() drew. Arrays are read-only and keep its "
                           "memory alive; row 0 is on top.")
        .def_property_readonly(
            "colour", image(&Frame::colour),
            "(height, width, 4) float32, premultiplied by alpha, lit: sRGB-coded 0..1 (above it "
            "where beyond_one lets it or splats are brighter than white), or linear light where "
            "`linear`.")
        .def_property_readonly(
            "alpha",
            [image](const DrawnFrame& d) {
                const py::object colour = image(&Frame::colour)(d);
                return colour[py::make_tuple(py::ellipsis(), 3)].cast<py::object>();
            },
            "(height, width) float32, 0..1: how far a pixel is covered.")
        .def_property_readonly("depth", image(&Frame::depth),
                               "(height, width) float32, scene units, planar; inf where nothing "
                               "was drawn.")
        .def_property_readonly("normals", image(&Frame::normal),
                               "(height, width, 3) float32, unit, world axes, 0 where unknown; "
                               "None unless asked for.")
        .def_property_readonly("albedo", image(&Frame::albedo),
                               "As colour, before lighting; None unless normals or lights are.")
        .def_property_readonly(
            "linear", [](const DrawnFrame& d) { return d.frame->linear; },
            "Colour is linear light, not sRGB-coded.")
        .def_property_readonly(
            "milliseconds", [](const DrawnFrame& d) { return d.frame->milliseconds; },
            "What drawing took.")
        .def_readonly("camera", &DrawnFrame::camera, "The camera that it was drawn for.")
        .def(
            "picture",
            [](const DrawnFrame& d, const py::object& background) {
                const auto picture =
                    std::make_shared<Picture>(stx::pictureOf(*d.frame, behind(background)));
                return arrayOf(picture->coded, picture);
            },
            py::arg("background") = py::none(),
            "(height, width, 4) uint8, sRGB, straight alpha: the pixels of its PNG. background: "
            "grey or (r, g, b), sRGB-coded 0..1, put behind it.")
        .def("save", &saveFrame, py::arg("path"), py::kw_only(), py::arg("background") = py::none(),
             py::arg("quality") = 92, py::arg("no_clobber") = false, py::arg("job") = py::none(),
             "Writes it, whole or not at all, by the ending: .png, .jpg (quality 1..100), .tif or "
             ".webp (8-bit sRGB), .exr (linear, with depth; drawn with normals=True also normals "
             "and albedo, and with beyond_one=True lit colours above 1, as 'stx render' writes "
             "them). background: grey or (r, g, b), sRGB-coded "
             "0..1, put behind it. no_clobber: a target that exists is an error. Raises stx.Error "
             "(usage, io).")
        .def("__repr__", [](const DrawnFrame& d) {
            return fmt::format("<stx.Frame {}x{}>", d.camera.width, d.camera.height);
        });
}

void bindLight(py::module_& module) {
    py::class_<Light>(module, "Light",
                      R"(A light of the Phong model.

kind: 'directional' (vector: the way it travels) or 'point' (vector: its position, scene units). colour:
grey or (r, g, b), linear, from 0. in_camera_space: it moves with the camera.)")
        .def(py::init([](const std::string& kind, const py::object& vector,
                         const py::object& colour, bool inCameraSpace) {
                 Light light;
                 py::dict word;
                 word["kind"] = kind;
                 Keywords(word).choose(
                     "kind", light.kind,
                     {{"directional", Light::Kind::directional}, {"point", Light::Kind::point}});
                 light.vector = glm::vec3(vectorFrom(vector, "vector"));
                 if (light.kind == Light::Kind::directional && light.vector == glm::vec3(0))
                     refuse("vector is 0, 0, 0; a directional light must point somewhere");
                 light.colour = colourFrom(colour, "colour");
                 if (glm::any(glm::lessThan(light.colour, glm::vec3(0))))
                     refuse("colour is negative; light is 0 or more");
                 light.inCameraSpace = inCameraSpace;
                 return light;
             }),
             py::arg("kind"), py::arg("vector"), py::kw_only(), py::arg("colour") = 1.0,
             py::arg("in_camera_space") = false);
}

void bindComparison(py::module_& module) {
    py::class_<Comparison>(module, "Comparison", "What stx.compare() found.")
        .def_readonly("psnr_rgb", &Comparison::psnrRgb,
                      "dB over R, G and B together; None of equal pictures.")
        .def_readonly("psnr_y", &Comparison::psnrY, "dB of luma (BT.709); None of equal ones.")
        .def_readonly("ssim_y", &Comparison::ssimY, "Mean structural similarity of luma, to 1.")
        .def_property_readonly(
            "worst",
            [](const Comparison& c) {
                return py::make_tuple(c.worst.x, c.worst.y, c.worst.difference);
            },
            "(x, y, difference) of the worst pixel; 8-bit pictures differ by 0..255.")
        .def_readonly("pixels", &Comparison::pixels, "That counted.")
        .def_readonly("different_pixels", &Comparison::differentPixels, "With any difference.")
        .def_property_readonly("identical", &Comparison::identical, "No pixel differs.")
        .def("__repr__", [](const Comparison& c) {
            return c.identical() ? std::string("<stx.Comparison identical>")
                                 : fmt::format("<stx.Comparison {:.2f} dB, {} pixels differ>",
                                               c.psnrRgb.value_or(0), c.differentPixels);
        });
}

}  // namespace

void bindPictures(py::module_& module) {
    bindFrame(module);
    bindLight(module);
    bindComparison(module);
    py::class_<Drawer, DrawerPointer>(module, "Renderer")
        .def(py::init(&makeDrawer))
        .def("render", &draw)
        .def_property_readonly("backend",
                               [](const DrawerPointer& d) { return d->renderer->backend(); })
        .def_property_readonly("device",
                               [](const DrawerPointer& d) { return d->renderer->device(); });
    module.def("compare", &comparePictures);
}

}  // namespace stx::python

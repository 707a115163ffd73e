#include <algorithm>
#include <optional>
#include <set>

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "tools/python/arrays.hpp"
#include "tools/python/handles.hpp"
#include "tools/python/keywords.hpp"
#include "tools/python/settings.hpp"

namespace stx::python {
namespace {

/// A view. Of one that was taken from a model also what the camera counts from, and what stands
/// behind all views of the model (null: nothing).
struct HeldView {
    std::shared_ptr<const ReferenceView> view;
    std::optional<glm::dvec3> origin;
    std::shared_ptr<const Environment> environment;
};

/// A part of a model that keeps the model. pybind11 knows no const; nothing here changes it.
template <class T>
std::shared_ptr<T> partOf(const AnyModel& whole, const T& part) {
    return std::const_pointer_cast<T>(std::shared_ptr<const T>(whole.model, &part));
}

/// A property that is an array of a member.
template <class T, class I>
auto member(I T::*image) {
    return [image](const std::shared_ptr<T>& t) { return arrayOf((*t).*image, t); };
}
template <class I>
auto ofView(I ReferenceView::*image) {
    return [image](const HeldView& v) { return arrayOf((*v.view).*image, v.view); };
}
/// A property that is the value of a member.
template <class T, class C>
auto valueOfView(T C::*value) {
    return [value](const HeldView& v) { return (*v.view).*value; };
}

/// Pixels of a picture without alpha are background where there is no depth.
void clearBackground(ReferenceView& view) {
    const auto clear = [&](auto& image, auto zero) {
        for (std::size_t i = 0; i < image.count(); ++i)
            if (!hasPoint(view.depth.data()[i])) image.data()[i].a = zero;
    };
    if (auto* coded = view.texture.rgba8()) clear(*coded, std::uint8_t{0});
    if (auto* linear = view.texture.rgbaFloat()) clear(*linear, 0.0f);
}

/// Normals where the view has a surface are unit, or 0.
void checkNormals(const ReferenceView& view) {
    for (int y = 0; y < view.normal.height(); ++y) {
        for (int x = 0; x < view.normal.width(); ++x) {
            const glm::vec3 n = view.normal.at(x, y);
            if (!hasPoint(view.depth.at(x, y)) || n == glm::vec3(0) || hasNormalLength(n)) continue;
            refuse(
                "normals has a length of {:.3g} at pixel ({}, {}); 1, or 0 where there is none, is "
                "expected",
                glm::length(n), x, y);
        }
    }
}

HeldView makeView(const py::object& colour, const py::object& depth, const Camera& camera,
                  std::string name, int depthBits, const std::string& noDepth,
                  const py::object& normals) {
    Bundle one;
    ReferenceView& view = one.views.emplace_back();
    bool hasAlpha = false;
    view.texture = textureFrom(colour, "colour", &hasAlpha);
    if (const auto* linear = view.texture.rgbaFloat())
        for (const glm::vec4 c : linear->pixels())
            if (c.a < 0.0f || c.a > 1.0f)
                refuse("colour has an alpha of {:g}; 0 to 1 is expected", c.a);
    view.depth = depthFrom(depth, "depth");
    // As sensors and image sets have it: a surface at the viewpoint would have no size.
    std::ranges::replace(view.depth.pixels(), 0.0f, kNoDepth);
    view.camera = camera;
    view.name = std::move(name);
    const auto missing = noDepthNamed(noDepth);
    if (!missing) refuse("no_depth is '{}'; empty or unknown is expected", noDepth);
    view.noDepth = *missing;
    if (!normals.is_none()) view.normal = vectorsFrom(normals, "normals");
    // convert() checks it, and fits the planes to the depth of what gets other bits than it had.
    view.depthBits = depthBits == 32 ? 16 : 32;
    ConvertSettings settings;
    settings.depthBits = depthBits;
    auto bundle = run(nullptr, [&](Job& job) { return convert(std::move(one), settings, job); });
    auto made = std::make_shared<ReferenceView>(std::move(bundle.views[0]));
    if (made->hasNormals()) checkNormals(*made);
    if (!hasAlpha && made->noDepth == NoDepth::empty) clearBackground(*made);
    bleedColour(made->texture);
    return {std::move(made), {}, {}};
}

/// Names that were given are unique; views without one get that of their number, or the next one
/// that is free.
void nameViews(std::vector<ReferenceView>& views) {
    std::set<std::string> names;
    for (const ReferenceView& view : views)
        if (!view.name.empty() && !names.insert(view.name).second)
            refuse("two views have the name '{}'; names are unique in a bundle", view.name);
    for (std::size_t i = 0; i < views.size(); ++i) {
        if (!views[i].name.empty()) continue;
        std::size_t number = i;
        do {
            views[i].name = fmt::format("view{:03}", number++);
        } while (!names.insert(views[i].name).second);
    }
}

py::object makeBundle(const std::vector<HeldView>& views, std::string title,
                      const py::object& origin) {
    Bundle bundle;
    if (!origin.is_none()) {
        bundle.origin = vectorFrom(origin, "origin");
    } else if (const auto placed = std::ranges::find_if(
                   views, [](const HeldView& held) { return held.origin.has_value(); });
               placed != views.end()) {
        bundle.origin = *placed->origin;
    }
    for (const HeldView& held : views) {
        bundle.views.push_back(*held.view);
        bundle.views.back().camera.position += held.origin.value_or(bundle.origin) - bundle.origin;
        if (!bundle.environment) bundle.environment = held.environment;
    }
    nameViews(bundle.views);
    bundle.title = std::move(title);
    valueOf(bundle.check());
    return modelObject(std::move(bundle));
}

template <class M>
py::list viewsOf(const M& model) {
    py::list views;
    for (const ReferenceView& view : model.get().views)
        views.append(
            HeldView{{model.model, &view}, originOf(*model.model), model.get().environment});
    return views;
}

template <class M>
void saveModel(const M& model, const std::filesystem::path& path, int jpegQuality, bool noClobber,
               JobHandle* job) {
    const SaveOptions options = saveOptionsFrom(jpegQuality, {}, noClobber);
    run(job, [&](Job& part) { return save(model.get(), path, options, part); });
}

/// The method save of a class.
template <class M, class C>
void bindSave(C& type, const char* sentence) {
    type.def("save", &saveModel<M>, py::arg("path"), py::kw_only(), py::arg("jpeg_quality") = 0,
             py::arg("no_clobber") = false, py::arg("job") = py::none(), sentence);
}

py::object boundsArray(const Bounds& bounds) {
    if (bounds.empty()) return py::none();
    const double corners[] = {bounds.min.x, bounds.min.y, bounds.min.z,
                              bounds.max.x, bounds.max.y, bounds.max.z};
    return py::array_t<double>({2, 3}, corners);
}

void bindView(py::module_& module) {
    using V = ReferenceView;
    py::class_<HeldView>(module, "View",
                         R"(A reference view: colour, depth and the camera that saw them.

colour: (height, width, 3 or 4), uint8 (sRGB) or float32 (linear light), straight alpha. depth:
(height, width) floats, scene units to the plane through the viewpoint (not along the ray), infinite
or 0 where there is none. Both are as large as the camera's picture; they are copied. name: unique in its
bundle (view000, ..., or the next that is free). depth_bits: 8, 16 or 32 (floats, which only .exr holds): depth is rounded to what
files hold. no_depth: what pixels without a depth are: 'empty' (nothing is there) or 'unknown' (not
measured). normals: (height, width, 3), unit (within 0.05), world axes; 0 where there is none. Raises stx.Error (usage, invalidInput).)")
        .def(py::init(&makeView), py::arg("colour"), py::arg("depth"), py::arg("camera"),
             py::kw_only(), py::arg("name") = "", py::arg("depth_bits") = 16,
             py::arg("no_depth") = "empty", py::arg("normals") = py::none())
        .def_property_readonly(
            "colour", ofView(&V::texture),
            "(height, width, 4), straight alpha: uint8 (sRGB) or float32 (linear light); of an "
            "atlas None.")
        .def_property_readonly("depth", ofView(&V::depth),
                               "(height, width) float32, scene units, planar; inf: none.")
        .def_property_readonly(
            "normals", ofView(&V::normal),
            "(height, width, 3) float32, unit, world axes; 0 where there is none; or None.")
        .def_property_readonly("splat_u", ofView(&V::splatU),
                               "(height, width, 3) float32: half axis of the splat, or None.")
        .def_property_readonly("splat_v", ofView(&V::splatV), "The other half axis, or None.")
        .def_property_readonly("metallic_roughness", ofView(&V::metallicRoughness),
                               "(height, width, 2) float32, 0..1, or None.")
        .def_property_readonly("emissive", ofView(&V::emissive),
                               "(height, width, 3) float32, linear light, or None.")
        .def_property_readonly(
            "name", [](const HeldView& v) { return textFrom(v.view->name); },
            "Unique in its bundle. Bytes of a file's that are not UTF-8 are \\xff here.")
        .def_property_readonly("camera", valueOfView(&V::camera), "The camera that saw it.")
        .def_property_readonly("near_plane", valueOfView(&V::nearPlane),
                               "Least distance of its depth, scene units.")
        .def_property_readonly("far_plane", valueOfView(&V::farPlane),
                               "Greatest distance of its depth, scene units.")
        .def_property_readonly("depth_bits", valueOfView(&V::depthBits), "8, 16 or 32, of files.")
        .def_property_readonly("background", valueOfView(&V::background),
                               "What is behind all that moves.")
        .def_property_readonly(
            "no_depth", [](const HeldView& v) { return nameOf(v.view->noDepth); },
            "'empty' or 'unknown'.")
        .def("__repr__", [](const HeldView& v) {
            const Camera& camera = v.view->camera;
            return textFrom(
                fmt::format("<stx.View '{}' {}x{}>", v.view->name, camera.width, camera.height));
        });
}

void bindMesh(py::module_& module) {
    const auto vertices = [](auto Mesh::*values) {
        return [values](const MeshModel& m) { return arrayOf(m.get().*values, m.model); };
    };
    py::class_<MeshModel, AnyModel>(module, "Mesh",
                                    "Triangles, points or a cloud of Gaussians, as stx.open() "
                                    "gives them. Arrays are read-only.")
        .def_property_readonly("positions", vertices(&Mesh::positions),
                               "(n, 3) float32, scene units, +Y up.")
        .def_property_readonly("normals", vertices(&Mesh::normals), "(n, 3) float32, or None.")
        .def_property_readonly("uvs", vertices(&Mesh::uvs), "(n, 2) float32, v down, or None.")
        .def_property_readonly("colours", vertices(&Mesh::colours),
                               "(n, 4) float32, linear, or None.")
        .def_property_readonly("triangles", vertices(&Mesh::triangles),
                               "(m, 3) uint32, indices of vertices, or None.")
        .def("__repr__", [](const MeshModel& m) {
            return fmt::format("<stx.Mesh {} vertices, {} triangles>", m.get().positions.size(),
                               m.get().triangles.size());
        });
}

void bindBundle(py::module_& module) {
    py::class_<BundleModel, AnyModel> type(
        module, "Bundle",
        R"(An object as reference views: what a SimpleTexture file holds.

views: at least one stx.View, all of one kind of colour. title: of the file. origin: (3,), what cameras
and positions count from; None: what those of the first view that was taken from a model count from, else 0.
Views that were taken from models of other origins are moved to it. What is shown behind everything is that
of the first view that was taken from a model which has it. The arrays of its views are read-only and show its
memory; they keep it alive.)");
    bindSave<BundleModel>(
        type,
        R"(Writes it, whole or not at all, by the ending: .exr (exact, but for colours under alpha 0,
which OpenEXR's premultiplied pixels do not hold), .mp4, .xmt or .bt.

jpeg_quality: of colours in .mp4, .xmt and .bt, 1..100; 0: PNG, exact. no_clobber: a target that exists
is an error. Raises stx.Error (usage, invalidInput, io).)");
    type.def(py::init([](const std::vector<HeldView>& views, std::string title,
                         const py::object& origin) {
                 return makeBundle(views, std::move(title), origin).cast<BundleModel>();
             }),
             py::arg("views"), py::kw_only(), py::arg("title") = "", py::arg("origin") = py::none())
        .def_property_readonly("views", &viewsOf<BundleModel>, "A list of stx.View.")
        .def_property_readonly(
            "time", [](const BundleModel& b) { return b.get().time; },
            "Of a frame of a film: when it is shown, seconds by the film's clock; or None.")
        .def_property_readonly(
            "duration", [](const BundleModel& b) { return b.get().duration; },
            "Of a frame of a film: how long it is shown, seconds; or None.")
        .def("__len__", [](const BundleModel& b) { return b.get().views.size(); })
        .def("__repr__", [](const BundleModel& b) {
            return textFrom(
                fmt::format("<stx.Bundle '{}', {} views>", b.get().title, b.get().views.size()));
        });
}

void bindAtlas(py::module_& module) {
    PYBIND11_NUMPY_DTYPE_EX(AtlasRectangle, view, "view", page, "page", viewX, "view_x", viewY,
                            "view_y", width, "width", height, "height", atlasX, "atlas_x", atlasY,
                            "atlas_y", turned, "turned");
    using Page = std::shared_ptr<AtlasPage>;
    py::class_<AtlasPage, Page>(module, "AtlasPage",
                                "One page of an atlas; all its textures have one size.")
        .def_property_readonly(
            "colour", [](const Page& p) { return arrayOf(p->texture, p); },
            "(height, width, 4) uint8 (sRGB) or float32 (linear light), straight alpha.")
        .def_property_readonly("depth", member(&AtlasPage::depth),
                               "(height, width) float32, scene units; inf: none.")
        .def_property_readonly("normals", member(&AtlasPage::normal),
                               "(height, width, 3) float32, or None.")
        .def_property_readonly("splat_u", member(&AtlasPage::splatU),
                               "(height, width, 3) float32, or None.")
        .def_property_readonly("splat_v", member(&AtlasPage::splatV),
                               "(height, width, 3) float32, or None.");
    py::class_<AtlasModel, AnyModel> type(module, "Atlas",
                                          "Reference views merged into at most four textures, as "
                                          "stx.pack() makes it. Arrays are read-only.");
    bindSave<AtlasModel>(
        type, R"(Writes it, whole or not at all: one file when the name ends in .exr, else a folder.

jpeg_quality: of colours in a folder, 1..100; 0: PNG, exact. no_clobber: a target that exists is an
error. Raises stx.Error (invalidInput, unsupported, io).)");
    type.def_property_readonly(
            "pages",
            [](const AtlasModel& a) {
                py::list pages;
                for (const AtlasPage& page : a.get().pages) pages.append(partOf(a, page));
                return pages;
            },
            "A list of stx.AtlasPage, one or two.")
        .def_property_readonly("views", &viewsOf<AtlasModel>,
                               "A list of stx.View whose images are None.")
        .def_property_readonly(
            "rectangles", [](const AtlasModel& a) { return arrayOf(a.get().rectangles, a.model); },
            "(n,) of fields view, page, view_x, view_y, width, height (pixels, in the view), "
            "atlas_x, atlas_y (in the page), turned (a quarter clockwise).")
        .def_property_readonly(
            "layout", [](const AtlasModel& a) { return a.get().layout; }, "'grid' or 'tight'.")
        .def_property_readonly(
            "used", [](const AtlasModel& a) { return a.get().used(); },
            "Share of the pages that rectangles cover, 0..1.")
        .def_property_readonly(
            "texture_count", [](const AtlasModel& a) { return a.get().textureCount(); },
            "Textures of all pages, at most 4, without those of materials.")
        .def("__repr__", [](const AtlasModel& a) {
            return fmt::format("<stx.Atlas {}x{}, {} views>", a.get().width(), a.get().height(),
                               a.get().views.size());
        });
}

}  // namespace

py::object modelObject(Model model, std::string title) {
    const auto shared = std::make_shared<const Model>(std::move(model));
    if (std::holds_alternative<Mesh>(*shared)) return py::cast(MeshModel{{shared, title}});
    if (std::holds_alternative<Atlas>(*shared)) return py::cast(AtlasModel{{shared, title}});
    return py::cast(BundleModel{{shared, title}});
}

void bindModels(py::module_& module) {
    bindView(module);
    py::class_<AnyModel>(module, "Model", "What stx.render() draws: a mesh, a bundle or an atlas.")
        .def_property_readonly(
            "title",
            [](const AnyModel& m) {
                if (const auto* bundle = std::get_if<Bundle>(&*m.model))
                    return textFrom(bundle->title);
                if (const auto* atlas = std::get_if<Atlas>(&*m.model))
                    return textFrom(atlas->title);
                return textFrom(m.title);
            },
            "Of the file, or of a mesh its file's name. Bytes that are not UTF-8 are \\xff here.")
        .def_property_readonly(
            "bounds", [](const AnyModel& m) { return boundsArray(boundsOf(*m.model)); },
            "(2, 3) float64: least and greatest corner, scene units; None where nothing is.")
        .def_property_readonly(
            "origin", [](const AnyModel& m) { return arrayOf(originOf(*m.model)); },
            "(3,) float64: what positions and cameras count from; 0 but for models with very large "
            "coordinates.")
        .def_property_readonly(
            "up", [](const AnyModel& m) { return arrayOf(upOf(*m.model)); },
            "(3,) float64, unit: the direction that is up.")
        .def(
            "aligned",
            [](const AnyModel& m, const Camera& camera) { return alignedCamera(*m.model, camera); },
            py::arg("camera"),
            "A camera that was given beside those of the views, moved as the ones near it were "
            "where "
            "`poses` of refining moved them; else the same.");
    bindMesh(module);
    bindBundle(module);
    bindAtlas(module);
}

}  // namespace stx::python

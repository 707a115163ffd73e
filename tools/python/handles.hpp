#pragma once

#include <memory>
#include <mutex>
#include <string>

#include <pybind11/pybind11.h>

#include "formats/stx/stx.hpp"
#include "tools/python/work.hpp"

/// What the objects of Python hold. All of it is shared and never changes, so that arrays may look
/// into it for as long as they are used.
namespace stx::python {

struct AnyModel {
    std::shared_ptr<const Model> model;
    std::string title;  ///< of bundles that are made of it: its file's name without the ending
};
struct MeshModel : AnyModel {
    [[nodiscard]] const Mesh& get() const { return std::get<Mesh>(*model); }
};
struct BundleModel : AnyModel {
    [[nodiscard]] const Bundle& get() const { return std::get<Bundle>(*model); }
};
struct AtlasModel : AnyModel {
    [[nodiscard]] const Atlas& get() const { return std::get<Atlas>(*model); }
};

/// A model as the class that Python has for its kind.
[[nodiscard]] py::object modelObject(Model model, std::string title = {});

/// A film, for one call at a time.
struct Film {
    std::mutex mutex;
    std::unique_ptr<Sequence> frames;

    explicit Film(std::unique_ptr<Sequence> taken) : frames(std::move(taken)) {}
    [[nodiscard]] const Timeline& timeline() const { return frames->timeline(); }
};

/// A picture, and where it was taken.
struct DrawnFrame {
    std::shared_ptr<const Frame> frame;
    Camera camera;
    glm::dvec3 origin;  ///< what the camera counts from
};

void bindCamera(py::module_& module);
void bindModels(py::module_& module);
void bindCalls(py::module_& module);
void bindFilms(py::module_& module);
void bindPictures(py::module_& module);

}  // namespace stx::python

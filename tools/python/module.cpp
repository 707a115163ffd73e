#include "tools/python/handles.hpp"

PYBIND11_MODULE(_stx, module) {
    module.doc() = "What stx is made of; see the package stx.";
    module.attr("__version__") = stx::version();
    stx::python::bindJob(module);
    stx::python::bindCamera(module);
    stx::python::bindModels(module);
    stx::python::bindFilms(module);
    stx::python::bindCalls(module);
    stx::python::bindPictures(module);
}

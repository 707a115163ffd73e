#pragma once

#include <memory>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "formats/stx/stx.hpp"

/// Images and vectors of the library as numpy arrays, and the other way round.
namespace stx::python {

namespace py = pybind11;

template <class T>
struct ElementsOf {
    using Scalar = T;
    static constexpr py::ssize_t count = 0;  ///< no axis of its own
};
template <int N, class T>
struct ElementsOf<glm::vec<N, T>> {
    using Scalar = T;
    static constexpr py::ssize_t count = N;
};

/// A read-only array of memory that `owner` keeps alive.
[[nodiscard]] py::array arrayOfMemory(const py::dtype& type, std::vector<py::ssize_t> shape,
                                      const void* data, std::shared_ptr<const void> owner);

/// Rows of values as they are, without a copy; None of none.
template <class T>
[[nodiscard]] py::object arrayOf(const Image<T>& image, std::shared_ptr<const void> owner) {
    using Elements = ElementsOf<T>;
    if (image.empty()) return py::none();
    std::vector<py::ssize_t> shape{image.height(), image.width()};
    if (Elements::count > 0) shape.push_back(Elements::count);
    return arrayOfMemory(py::dtype::of<typename Elements::Scalar>(), shape, image.data(),
                         std::move(owner));
}
template <class T>
[[nodiscard]] py::object arrayOf(const std::vector<T>& values, std::shared_ptr<const void> owner) {
    using Elements = ElementsOf<T>;
    if (values.empty()) return py::none();
    std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(values.size())};
    if (Elements::count > 0) shape.push_back(Elements::count);
    return arrayOfMemory(py::dtype::of<typename Elements::Scalar>(), shape, values.data(),
                         std::move(owner));
}
[[nodiscard]] py::object arrayOf(const Texture& texture, std::shared_ptr<const void> owner);

/// A vector or a matrix, as (rows, columns), copied.
[[nodiscard]] py::array_t<double> arrayOf(glm::dvec3 vector);
[[nodiscard]] py::array_t<double> arrayOf(const glm::dmat4& matrix);

/// Throws stx.Error (usage) where a value is one of numpy's masked arrays, whose mask nothing here
/// looks at.
void refuseMasked(py::handle value, const char* name);

/// Arrays of the caller. Each throws stx.Error (usage), which says what `name` is and what is
/// expected; masked arrays are refused.
[[nodiscard]] glm::dvec3 vectorFrom(py::handle value, const char* name);
/// Grey or r, g, b.
[[nodiscard]] glm::vec3 colourFrom(py::handle value, const char* name);
/// (4, 4) or (3, 4): rotation and shift.
[[nodiscard]] glm::dmat4 poseFrom(py::handle value, const char* name);
/// (width, height), pixels.
[[nodiscard]] glm::ivec2 sizeFrom(py::handle value, const char* name);
/// uint8 (sRGB) or float32 (linear light) of (height, width, 3 or 4). `hasAlpha`: whether it has.
[[nodiscard]] Texture textureFrom(py::handle value, const char* name, bool* hasAlpha = nullptr);
/// Floats of (height, width), or (height, width, 3).
[[nodiscard]] Image<float> depthFrom(py::handle value, const char* name);
[[nodiscard]] Image<glm::vec3> vectorsFrom(py::handle value, const char* name);
/// bool or uint8 of (height, width): 255 where it is true, or 128 and more.
[[nodiscard]] Image<std::uint8_t> maskFrom(py::handle value, const char* name);

}  // namespace stx::python

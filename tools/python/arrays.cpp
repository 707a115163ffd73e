#include "tools/python/arrays.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "tools/python/work.hpp"

namespace stx::python {
namespace {

/// "float64 of shape (4, 4)", or the type of what is no array.
std::string described(py::handle value) {
    if (!py::isinstance<py::array>(value))
        return py::str(py::type::handle_of(value).attr("__name__"));
    return fmt::format("{} of shape {}", std::string(py::str(value.attr("dtype"))),
                       std::string(py::str(value.attr("shape"))));
}

/// Whatever numpy takes for numbers.
template <class T>
py::array_t<T> numbersFrom(py::handle value, const char* name, const char* expected) {
    refuseMasked(value, name);
    const auto array = py::array::ensure(value);
    if (array && std::strchr("iuf", array.dtype().kind()))
        if (auto numbers = py::array_t<T, py::array::c_style | py::array::forcecast>::ensure(array))
            return numbers;
    PyErr_Clear();
    refuse("{} is {}; {} is expected", name, described(value), expected);
}

/// An array as it is, of one of the kinds of numbers and with these axes; -1: of any length.
py::array imageFrom(py::handle value, const char* name, bool fits, const char* expected) {
    refuseMasked(value, name);
    if (!fits) refuse("{} is {}; {} is expected", name, described(value), expected);
    auto array = py::reinterpret_borrow<py::array>(value);
    for (py::ssize_t axis = 0; axis < 2; ++axis)
        if (array.shape(axis) < 1 || array.shape(axis) > Limits().maxImageSide)
            refuse("{} is {}; each side is 1 to {} pixels", name, described(value),
                   Limits().maxImageSide);
    return array;
}

/// A kind of numpy's numbers, of some sizes in bytes. Their order of bytes does not matter.
struct ElementType {
    char kind;
    std::initializer_list<py::ssize_t> sizes;
};
constexpr ElementType kBools{'b', {1}}, kCodes{'u', {1}}, kFloat32{'f', {4}};
// float16, float32, float64, and longdouble, which takes 12 or 16 with what fills it up.
constexpr ElementType kFloats{'f', {2, 4, 8, 12, 16}};

bool isImage(py::handle value, std::initializer_list<ElementType> types,
             std::initializer_list<py::ssize_t> channels) {
    if (!py::isinstance<py::array>(value)) return false;
    const auto array = py::reinterpret_borrow<py::array>(value);
    const py::dtype type = array.dtype();
    const bool known = std::ranges::any_of(types, [&](const ElementType& wanted) {
        return type.kind() == wanted.kind &&
               std::ranges::find(wanted.sizes, type.itemsize()) != wanted.sizes.end();
    });
    if (!known) return false;
    const py::ssize_t depth = array.ndim() == 3 ? array.shape(2) : 0;
    return (array.ndim() == 2 || array.ndim() == 3) &&
           std::ranges::find(channels, depth) != channels.end();
}

/// The pixels of an array that has as many values for each.
template <class T>
Image<T> copied(const py::array& array) {
    using Scalar = typename ElementsOf<T>::Scalar;
    const auto rows = py::array_t<Scalar, py::array::c_style | py::array::forcecast>::ensure(array);
    if (!rows) throw py::error_already_set();
    Image<T> image(static_cast<int>(array.shape(1)), static_cast<int>(array.shape(0)));
    std::memcpy(image.data(), rows.data(), image.count() * sizeof(T));
    return image;
}

/// Colours with their alpha, or `full` where they have none.
template <int N, class T>
Image<glm::vec<4, T>> withAlpha(const py::array& array, T full) {
    if (array.shape(2) == 4) return copied<glm::vec<4, T>>(array);
    const auto colours = copied<glm::vec<N, T>>(array);
    Image<glm::vec<4, T>> image(colours.width(), colours.height());
    for (std::size_t i = 0; i < colours.count(); ++i)
        image.data()[i] = glm::vec<4, T>(colours.data()[i], full);
    return image;
}

}  // namespace

void refuseMasked(py::handle value, const char* name) {
    if (py::isinstance<py::array>(value) && py::hasattr(value, "filled"))
        refuse("{} is a masked array; .filled(VALUE) of it, which has no mask, is expected", name);
}

py::array arrayOfMemory(const py::dtype& type, std::vector<py::ssize_t> shape, const void* data,
                        std::shared_ptr<const void> owner) {
    const py::capsule keeps(new std::shared_ptr<const void>(std::move(owner)), [](void* kept) {
        delete static_cast<std::shared_ptr<const void>*>(kept);
    });
    py::array array(type, std::move(shape), data, keeps);
    // The memory may be that of other objects, too.
    array.attr("flags").attr("writeable") = false;
    return array;
}

py::object arrayOf(const Texture& texture, std::shared_ptr<const void> owner) {
    if (const auto* coded = texture.rgba8()) return arrayOf(*coded, std::move(owner));
    return arrayOf(*texture.rgbaFloat(), std::move(owner));
}

py::array_t<double> arrayOf(glm::dvec3 v) {
    return py::array_t<double>(3, &v.x);
}

py::array_t<double> arrayOf(const glm::dmat4& matrix) {
    const glm::dmat4 rows = glm::transpose(matrix);
    return py::array_t<double>({4, 4}, &rows[0][0]);
}

glm::dvec3 vectorFrom(py::handle value, const char* name) {
    constexpr const char* kExpected = "three finite numbers";
    const auto numbers = numbersFrom<double>(value, name, kExpected);
    if (numbers.ndim() != 1 || numbers.size() != 3 ||
        !std::all_of(numbers.data(), numbers.data() + 3, [](double v) { return std::isfinite(v); }))
        refuse("{} is {}; {} are expected", name, std::string(py::str(value)), kExpected);
    return {numbers.at(0), numbers.at(1), numbers.at(2)};
}

glm::vec3 colourFrom(py::handle value, const char* name) {
    const auto numbers = numbersFrom<double>(value, name, "grey or three numbers (r, g, b)");
    const glm::dvec3 colour =
        numbers.ndim() == 0 ? glm::dvec3(*numbers.data()) : vectorFrom(value, name);
    constexpr double kMost = std::numeric_limits<float>::max();
    if (!glm::all(glm::lessThanEqual(glm::abs(colour), glm::dvec3(kMost))))
        refuse("{} is {}; finite numbers are expected", name, std::string(py::str(value)));
    return glm::vec3(colour);
}

glm::dmat4 poseFrom(py::handle value, const char* name) {
    constexpr const char* kExpected = "a matrix of (4, 4), or (3, 4)";
    const auto rows = numbersFrom<double>(value, name, kExpected);
    if (rows.ndim() != 2 || rows.shape(1) != 4 || (rows.shape(0) != 3 && rows.shape(0) != 4))
        refuse("{} is {}; {}, is expected", name, described(rows), kExpected);
    glm::dmat4 pose(1.0);
    for (int row = 0; row < rows.shape(0); ++row)
        for (int column = 0; column < 4; ++column) pose[column][row] = rows.at(row, column);
    const auto turned = glm::dmat3(pose);
    // How far a rotation that was kept as floats, or printed with six digits, is off.
    constexpr double kRounded = 1e-4;
    const glm::dmat3 square = turned * glm::transpose(turned);
    double off = std::abs(glm::determinant(turned) - 1);
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k)
            off = std::max(off, std::abs(square[i][k] - (i == k ? 1.0 : 0.0)));
    const bool last = pose[0][3] == 0 && pose[1][3] == 0 && pose[2][3] == 0 && pose[3][3] == 1;
    if (!(off <= kRounded) || !last || !std::isfinite(glm::dot(pose[3], pose[3])))
        refuse(
            "{} is not a rotation and a shift, but {}; finite numbers without scale, shear or "
            "mirror are expected, columns x, y, z and position, last row 0 0 0 1",
            name, std::string(py::str(rows.attr("tolist")())));
    return pose;
}

glm::ivec2 sizeFrom(py::handle value, const char* name) {
    try {
        const auto [width, height] = value.cast<std::pair<int, int>>();
        const int most = Limits().maxImageSide;
        if (width >= 1 && height >= 1 && width <= most && height <= most) return {width, height};
        refuse("{} is {}x{}; each side is 1 to {} pixels", name, width, height, most);
    } catch (const py::cast_error&) {
        refuse("{} is {}; (width, height) in pixels is expected", name,
               std::string(py::repr(value)));
    }
}

Texture textureFrom(py::handle value, const char* name, bool* hasAlpha) {
    const auto array =
        imageFrom(value, name, isImage(value, {kCodes, kFloat32}, {3, 4}),
                  "an array of uint8 (sRGB) or float32 (linear light) and of shape (height, width, "
                  "3 or 4)");
    if (hasAlpha) *hasAlpha = array.shape(2) == 4;
    if (array.dtype().kind() == 'u') return withAlpha<3, std::uint8_t>(array, 255);
    auto image = withAlpha<3, float>(array, 1.0f);
    if (!std::ranges::all_of(image.pixels(), [](glm::vec4 c) {
            return std::isfinite(c.r) && std::isfinite(c.g) && std::isfinite(c.b) &&
                   std::isfinite(c.a);
        }))
        refuse("{} holds NaN or infinity; finite values are expected", name);
    return image;
}

Image<float> depthFrom(py::handle value, const char* name) {
    return copied<float>(imageFrom(
        value, name, isImage(value, {kFloats}, {0}),
        "an array of floats (distances in scene units, infinite or 0 where there is none) "
        "and of shape (height, width)"));
}

Image<glm::vec3> vectorsFrom(py::handle value, const char* name) {
    auto image = copied<glm::vec3>(imageFrom(value, name, isImage(value, {kFloats}, {3}),
                                             "an array of floats and of shape (height, width, 3)"));
    if (!std::ranges::all_of(image.pixels(), [](glm::vec3 v) {
            return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
        }))
        refuse("{} holds NaN or infinity; finite values are expected", name);
    return image;
}

Image<std::uint8_t> maskFrom(py::handle value, const char* name) {
    const auto array = imageFrom(value, name, isImage(value, {kBools, kCodes}, {0}),
                                 "an array of bool or uint8 and of shape (height, width)");
    auto mask = copied<std::uint8_t>(array);
    if (array.dtype().kind() == 'b')
        for (auto& pixel : mask.pixels()) pixel = pixel ? 255 : 0;
    return mask;
}

}  // namespace stx::python

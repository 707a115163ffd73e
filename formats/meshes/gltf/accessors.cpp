#include <algorithm>
#include <cstring>
#include <limits>
#include <type_traits>

#include "formats/meshes/gltf/gltf_file.hpp"

namespace stx::gltf {
namespace {

enum ComponentType : std::uint64_t {
    kByte = 5120,
    kUnsignedByte = 5121,
    kShort = 5122,
    kUnsignedShort = 5123,
    kUnsignedInt = 5125,
    kFloat = 5126
};

int componentSize(std::uint64_t type) {
    switch (type) {
        case kByte:
        case kUnsignedByte:
            return 1;
        case kShort:
        case kUnsignedShort:
            return 2;
        case kUnsignedInt:
        case kFloat:
            return 4;
        default:
            return 0;
    }
}

int componentCount(std::string_view type) {
    if (type == "SCALAR") return 1;
    if (type == "VEC2") return 2;
    if (type == "VEC3") return 3;
    if (type == "VEC4" || type == "MAT2") return 4;
    if (type == "MAT3") return 9;
    if (type == "MAT4") return 16;
    return 0;
}

// The glTF data and this machine are little-endian; values may lie at any address.
template <class T>
T load(const std::byte* at) {
    T value;
    std::memcpy(&value, at, sizeof value);
    return value;
}

template <class To, class From>
To convert(From value, bool normalized) {
    if constexpr (std::is_same_v<To, float>) {
        if (!std::is_floating_point_v<From> && normalized)
            return static_cast<float>(std::max(
                static_cast<double>(value) / static_cast<double>(std::numeric_limits<From>::max()),
                -1.0));
    }
    return static_cast<To>(value);
}

template <class To>
To component(const std::byte* at, std::uint64_t type, bool normalized) {
    switch (type) {
        case kByte:
            return convert<To>(load<std::int8_t>(at), normalized);
        case kUnsignedByte:
            return convert<To>(load<std::uint8_t>(at), normalized);
        case kShort:
            return convert<To>(load<std::int16_t>(at), normalized);
        case kUnsignedShort:
            return convert<To>(load<std::uint16_t>(at), normalized);
        case kUnsignedInt:
            return convert<To>(load<std::uint32_t>(at), normalized);
        default:
            return convert<To>(load<float>(at), normalized);
    }
}

/// Errors when `count` elements of `size` bytes, each `stride` after the last, leave the view.
Result<void> checkRange(ByteSpan bytes, std::uint64_t offset, std::uint64_t count,
                        std::uint64_t stride, std::uint64_t size, const std::string& where) {
    const bool fits = offset <= bytes.size() && size <= bytes.size() - offset &&
                      (count - 1) <= (bytes.size() - offset - size) / stride;
    if (fits) return {};
    return fail(ErrorCode::invalidInput,
                "{} needs {} elements of {} bytes from byte {} on, each {} after the last, but its "
                "bufferView "
                "has only {} bytes",
                where, count, size, offset, stride, bytes.size());
}

}  // namespace

void AccessorValues::keep(const std::vector<bool>& kept) {
    AccessorValues out;
    out.components = components;
    for (std::size_t i = 0; i < kept.size(); ++i) {
        if (!kept[i]) continue;
        ++out.count;
        for (int c = 0; c < components; ++c) out.values.push_back(at(i, c));
    }
    *this = std::move(out);
}

struct GltfFile::Layout {
    std::string where;
    std::uint64_t componentType = 0;
    int components = 0;
    std::uint64_t count = 0;
    bool normalized = false;
    std::optional<std::uint64_t> view;
    std::uint64_t offset = 0;
    const Json* sparse = nullptr;
};

Result<GltfFile::Layout> GltfFile::layout(std::uint64_t index, const std::string& user,
                                          std::initializer_list<std::string_view> types) {
    STX_TRY(const Json* object, element(root_, "accessors", index, user));
    Layout l;
    l.where = fmt::format("accessors[{}] ({})", index, user);
    STX_TRY(const auto componentType, getUint(*object, "componentType", l.where));
    if (!componentType || componentSize(*componentType) == 0)
        return fail(ErrorCode::invalidInput,
                    "{} has componentType {}, expected 5120..5123, 5125 or 5126", l.where,
                    componentType.value_or(0));
    l.componentType = *componentType;
    STX_TRY(const auto type, getString(*object, "type", l.where));
    if (!type || std::find(types.begin(), types.end(), *type) == types.end())
        return fail(ErrorCode::invalidInput, "{} has type '{}', expected {}", l.where,
                    type.value_or(""), fmt::join(types, " or "));
    l.components = componentCount(*type);
    STX_TRY(const auto count, getUint(*object, "count", l.where));
    if (count.value_or(0) == 0)
        return fail(ErrorCode::invalidInput, "{} has no elements; count must be 1 or more",
                    l.where);
    l.count = *count;
    STX_TRY(const auto normalized, getBool(*object, "normalized", l.where));
    l.normalized = normalized.value_or(false);
    STX_TRY(l.view, getUint(*object, "bufferView", l.where));
    STX_TRY(const auto offset, getUint(*object, "byteOffset", l.where));
    l.offset = offset.value_or(0);
    STX_TRY(l.sparse, getObject(*object, "sparse", l.where));
    return l;
}

template <class Component>
Result<std::vector<Component>> GltfFile::elements(const Layout& l) {
    const auto size = static_cast<std::uint64_t>(componentSize(l.componentType));
    const auto components = static_cast<std::uint64_t>(l.components);
    const std::uint64_t elementSize = size * components;
    ByteSpan bytes;
    std::uint64_t stride = elementSize;
    if (l.view) {
        STX_TRY(const auto view, bufferView(*l.view, l.where));
        bytes = view.bytes;
        if (view.stride != 0) stride = view.stride;
        if (stride < elementSize)
            return fail(ErrorCode::invalidInput,
                        "{}: byteStride {} is less than an element's {} bytes", l.where, stride,
                        elementSize);
        STX_CHECK(checkRange(bytes, l.offset, l.count, stride, elementSize, l.where));
    }
    STX_CHECK(builder_->charge(l.count, components * sizeof(Component), l.where));
    std::vector<Component> values(l.count * components, Component{0});
    for (std::uint64_t i = 0; l.view && i < l.count; ++i) {
        const auto* at = bytes.data() + l.offset + i * stride;
        for (std::uint64_t c = 0; c < components; ++c)
            values[i * components + c] =
                component<Component>(at + c * size, l.componentType, l.normalized);
    }
    if (!l.sparse) return values;

    const auto where = l.where + ".sparse";
    STX_TRY(const auto sparseCount, getUint(*l.sparse, "count", where));
    const auto changes = sparseCount.value_or(0);
    if (changes == 0 || changes > l.count)
        return fail(ErrorCode::invalidInput, "{} replaces {} of {} elements", where, changes,
                    l.count);
    STX_TRY(const Json* indexObject, getObject(*l.sparse, "indices", where));
    STX_TRY(const Json* valueObject, getObject(*l.sparse, "values", where));
    if (!indexObject || !valueObject)
        return fail(ErrorCode::invalidInput, "{} lacks its indices or values", where);
    STX_TRY(const auto indexType, getUint(*indexObject, "componentType", where + ".indices"));
    const auto type = indexType.value_or(0);
    if (type != kUnsignedByte && type != kUnsignedShort && type != kUnsignedInt)
        return fail(ErrorCode::invalidInput,
                    "{}.indices has componentType {}, expected 5121, 5123 or 5125", where, type);
    STX_TRY(const auto indexView, getUint(*indexObject, "bufferView", where + ".indices"));
    STX_TRY(const auto valueView, getUint(*valueObject, "bufferView", where + ".values"));
    if (!indexView || !valueView)
        return fail(ErrorCode::invalidInput, "{}: indices and values must name a bufferView",
                    where);
    STX_TRY(const auto indexOffset, getUint(*indexObject, "byteOffset", where + ".indices"));
    STX_TRY(const auto valueOffset, getUint(*valueObject, "byteOffset", where + ".values"));
    STX_TRY(const auto indexBytes, bufferView(*indexView, where));
    STX_TRY(const auto valueBytes, bufferView(*valueView, where));
    const auto indexSize = static_cast<std::uint64_t>(componentSize(type));
    STX_CHECK(checkRange(indexBytes.bytes, indexOffset.value_or(0), changes, indexSize, indexSize,
                         where + ".indices"));
    STX_CHECK(checkRange(valueBytes.bytes, valueOffset.value_or(0), changes, elementSize,
                         elementSize, where + ".values"));
    for (std::uint64_t i = 0; i < changes; ++i) {
        const auto target = component<std::uint32_t>(
            indexBytes.bytes.data() + indexOffset.value_or(0) + i * indexSize, type, false);
        if (target >= l.count)
            return fail(ErrorCode::invalidInput, "{} replaces element {} of {}", where, target,
                        l.count);
        const auto* at = valueBytes.bytes.data() + valueOffset.value_or(0) + i * elementSize;
        for (std::uint64_t c = 0; c < components; ++c)
            values[target * components + c] =
                component<Component>(at + c * size, l.componentType, l.normalized);
    }
    return values;
}

Result<AccessorValues> GltfFile::accessor(std::uint64_t index, const std::string& user,
                                          std::initializer_list<std::string_view> types,
                                          bool normalise) {
    STX_TRY(auto l, layout(index, user, types));
    l.normalized = l.normalized || normalise;
    AccessorValues result;
    result.count = l.count;
    result.components = l.components;
    STX_TRY(result.values, elements<float>(l));
    return result;
}

Result<std::vector<std::uint32_t>> GltfFile::indices(std::uint64_t index, const std::string& user) {
    STX_TRY(const auto l, layout(index, user, {"SCALAR"}));
    if (l.componentType != kUnsignedByte && l.componentType != kUnsignedShort &&
        l.componentType != kUnsignedInt)
        return fail(ErrorCode::invalidInput,
                    "{} has componentType {}, but indices are 5121, 5123 or 5125", l.where,
                    l.componentType);
    return elements<std::uint32_t>(l);
}

}  // namespace stx::gltf

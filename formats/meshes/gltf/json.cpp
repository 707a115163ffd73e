#include "formats/meshes/gltf/json.hpp"

#include <cmath>

namespace stx::gltf {
namespace {

const Json* find(const Json& object, const char* key) {
    if (!object.is_object()) return nullptr;
    const auto it = object.find(key);
    return it == object.end() ? nullptr : &*it;
}

tl::unexpected<Error> wrongType(const Json& found, const char* key, const std::string& where,
                                const char* expected) {
    return fail(ErrorCode::invalidInput, "{}.{} is {} {}, expected {}",
                where.empty() ? "glTF" : where, key,
                found.is_array() || found.is_object() ? "an" : "a", found.type_name(), expected);
}

}  // namespace

Result<std::optional<double>> getNumber(const Json& object, const char* key,
                                        const std::string& where) {
    const auto* value = find(object, key);
    if (!value) return std::nullopt;
    if (!value->is_number()) return wrongType(*value, key, where, "a number");
    const double number = value->get<double>();
    if (!std::isfinite(number)) return wrongType(*value, key, where, "a finite number");
    return number;
}

namespace {

bool isIndex(double number) {
    return number >= 0 && number <= 9007199254740992.0 && std::floor(number) == number;
}

}  // namespace

Result<std::optional<std::uint64_t>> getUint(const Json& object, const char* key,
                                             const std::string& where) {
    STX_TRY(const auto number, getNumber(object, key, where));
    if (!number) return std::nullopt;
    if (!isIndex(*number))
        return fail(ErrorCode::invalidInput, "{}.{} is {}, expected a whole number from 0", where,
                    key, *number);
    return static_cast<std::uint64_t>(*number);
}

Result<std::optional<bool>> getBool(const Json& object, const char* key, const std::string& where) {
    const auto* value = find(object, key);
    if (!value) return std::nullopt;
    if (!value->is_boolean()) return wrongType(*value, key, where, "true or false");
    return value->get<bool>();
}

Result<std::optional<std::string>> getString(const Json& object, const char* key,
                                             const std::string& where) {
    const auto* value = find(object, key);
    if (!value) return std::nullopt;
    if (!value->is_string()) return wrongType(*value, key, where, "a string");
    return value->get<std::string>();
}

Result<const Json*> getObject(const Json& object, const char* key, const std::string& where) {
    const auto* value = find(object, key);
    if (!value) return nullptr;
    if (!value->is_object()) return wrongType(*value, key, where, "an object");
    return value;
}

Result<const Json*> getArray(const Json& object, const char* key, const std::string& where) {
    const auto* value = find(object, key);
    if (!value) return nullptr;
    if (!value->is_array()) return wrongType(*value, key, where, "an array");
    return value;
}

Result<bool> getNumbers(const Json& object, const char* key, const std::string& where,
                        std::span<double> values) {
    STX_TRY(const Json* array, getArray(object, key, where));
    if (!array) return false;
    if (array->size() != values.size())
        return fail(ErrorCode::invalidInput, "{}.{} has {} elements, expected {} numbers", where,
                    key, array->size(), values.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
        const auto& v = (*array)[i];
        if (!v.is_number() || !std::isfinite(v.get<double>()))
            return fail(ErrorCode::invalidInput, "{}.{}[{}] is a {}, expected a number", where, key,
                        i, v.type_name());
        values[i] = v.get<double>();
    }
    return true;
}

Result<std::vector<std::uint64_t>> getIndices(const Json& object, const char* key,
                                              const std::string& where) {
    std::vector<std::uint64_t> indices;
    STX_TRY(const Json* array, getArray(object, key, where));
    if (!array) return indices;
    for (std::size_t i = 0; i < array->size(); ++i) {
        const auto& v = (*array)[i];
        if (!v.is_number() || !isIndex(v.get<double>()))
            return fail(ErrorCode::invalidInput, "{}.{}[{}] is not an index", where, key, i);
        indices.push_back(static_cast<std::uint64_t>(v.get<double>()));
    }
    return indices;
}

Result<const Json*> element(const Json& root, const char* list, std::uint64_t index,
                            const std::string& user) {
    const auto* array = find(root, list);
    if (array && !array->is_array()) return wrongType(*array, list, "", "an array");
    const std::size_t size = array ? array->size() : 0;
    if (index >= size)
        return fail(ErrorCode::invalidInput, "{} refers to {}[{}], but there are only {}", user,
                    list, index, size);
    const auto& value = (*array)[index];
    if (!value.is_object())
        return fail(ErrorCode::invalidInput, "{}[{}] is a {}, expected an object", list, index,
                    value.type_name());
    return &value;
}

Result<const Json*> getExtension(const Json& object, const char* name, const std::string& where) {
    STX_TRY(const Json* extensions, getObject(object, "extensions", where));
    if (!extensions) return nullptr;
    return getObject(*extensions, name, where + ".extensions");
}

std::size_t listSize(const Json& root, const char* list) {
    const auto* array = find(root, list);
    return array && array->is_array() ? array->size() : 0;
}

}  // namespace stx::gltf

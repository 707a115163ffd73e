#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include <nlohmann/json.hpp>

#include "lib/base/result.hpp"

namespace stx::gltf {

using Json = nlohmann::json;

// Members of glTF objects, with types checked. `where` is the object's place (`materials[2]`); an
// error names the member, what was found and what is expected. Absent members are not errors.

[[nodiscard]] Result<std::optional<double>> getNumber(const Json& object, const char* key,
                                                      const std::string& where);
/// A number without fraction, 0..2^53.
[[nodiscard]] Result<std::optional<std::uint64_t>> getUint(const Json& object, const char* key,
                                                           const std::string& where);
[[nodiscard]] Result<std::optional<bool>> getBool(const Json& object, const char* key,
                                                  const std::string& where);
[[nodiscard]] Result<std::optional<std::string>> getString(const Json& object, const char* key,
                                                           const std::string& where);
/// The member, or null when absent.
[[nodiscard]] Result<const Json*> getObject(const Json& object, const char* key,
                                            const std::string& where);
[[nodiscard]] Result<const Json*> getArray(const Json& object, const char* key,
                                           const std::string& where);
/// Fills exactly `values.size()` numbers; false when the member is absent.
[[nodiscard]] Result<bool> getNumbers(const Json& object, const char* key, const std::string& where,
                                      std::span<double> values);
/// An array of indices, which are as of getUint(); empty when absent.
[[nodiscard]] Result<std::vector<std::uint64_t>> getIndices(const Json& object, const char* key,
                                                            const std::string& where);
/// `root[list][index]`, which must exist and be an object; `user` names who refers to it.
[[nodiscard]] Result<const Json*> element(const Json& root, const char* list, std::uint64_t index,
                                          const std::string& user);
/// `object.extensions[name]`, or null.
[[nodiscard]] Result<const Json*> getExtension(const Json& object, const char* name,
                                               const std::string& where);
/// Number of elements of the array `root[list]`, 0 when there is none.
[[nodiscard]] std::size_t listSize(const Json& root, const char* list);

}  // namespace stx::gltf

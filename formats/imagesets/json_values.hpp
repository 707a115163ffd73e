#pragma once

#include <optional>
#include <string>
#include <vector>

#include <glm/glm.hpp>
#include <nlohmann/json.hpp>

#include "formats/files/files.hpp"

/// Values of JSON objects with errors that name the place, the key, what is there and what should
/// be.
namespace stx::imagesets {

using Json = nlohmann::json;

/// Errors name the line of a fault.
[[nodiscard]] Result<Json> parseJson(ByteSpan bytes);

/// A finite number; nothing when the key is missing or null.
[[nodiscard]] Result<std::optional<double>> findNumber(const Json& object, const char* key,
                                                       const std::string& where);
[[nodiscard]] Result<double> needNumber(const Json& object, const char* key,
                                        const std::string& where);
/// A list of `count` finite numbers.
[[nodiscard]] Result<std::optional<std::vector<double>>> findNumbers(const Json& object,
                                                                     const char* key,
                                                                     std::size_t count,
                                                                     const std::string& where);
[[nodiscard]] Result<std::vector<double>> needNumbers(const Json& object, const char* key,
                                                      std::size_t count, const std::string& where);
/// A text without NUL; nothing when the key is missing or null.
[[nodiscard]] Result<std::optional<std::string>> findText(const Json& object, const char* key,
                                                          const std::string& where);
[[nodiscard]] Result<std::string> needText(const Json& object, const char* key,
                                           const std::string& where);

/// A matrix of 3 or 4 rows of 4 finite numbers; the last row is 0 0 0 1, given or not.
[[nodiscard]] Result<glm::dmat4> needMatrix(const Json& object, const char* key,
                                            const std::string& where);

/// `what` of a whole number within 1..largest.
[[nodiscard]] Result<int> imageSide(double value, const char* key, int largest,
                                    const std::string& where);

}  // namespace stx::imagesets

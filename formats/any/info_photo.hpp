#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "formats/photos/photo.hpp"

namespace stx {

/// What a photograph with depth says of itself, by tools/schemas/info.schema.json. `from`: what its
/// camera follows from.
[[nodiscard]] nlohmann::ordered_json photoJson(const photos::Photo& photo, const Camera& camera,
                                               const std::string& from);

/// The same for people, a line for the picture, its depth, its camera and what else is in it.
[[nodiscard]] std::string photoText(const nlohmann::ordered_json& photo);

}  // namespace stx

#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "lib/base/job.hpp"
#include "lib/model/bundle.hpp"

namespace stx {

/// By how much each view disagrees with those that overlap it, by tools/schemas/info.schema.json.
/// A note names those that do, if `notes`.
[[nodiscard]] nlohmann::ordered_json agreementJson(const Bundle& bundle, bool notes, Job& job);

/// The same for people, a row for each view.
[[nodiscard]] std::string agreementText(const nlohmann::ordered_json& agreement);

}  // namespace stx

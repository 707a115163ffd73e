#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "lib/base/job.hpp"
#include "lib/model/view_table.hpp"

namespace stx {

/// By how much each view disagrees with those that overlap it, by tools/schemas/info.schema.json.
/// A note names those that do, if `notes`.
[[nodiscard]] Result<nlohmann::ordered_json> agreementJson(const ViewTable& table, bool notes,
                                                           Job& job);

/// The same for people, a row for each view.
[[nodiscard]] std::string agreementText(const nlohmann::ordered_json& agreement);

}  // namespace stx

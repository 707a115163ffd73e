#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "lib/base/job.hpp"
#include "lib/model/view_table.hpp"

namespace stx {

/// The memory that each command takes at most on these views, by tools/schemas/info.schema.json, as
/// its own check against the limit counts it (lib/model/peak_memory.hpp). Views on demand are read
/// once, one for each thread, to find whether they would be refined. `frames`: of a film, of which
/// these are the first. `mostKept`: bytes of decoded pictures of all frames that are kept beside
/// them, at most. Errors: reading.
[[nodiscard]] Result<nlohmann::ordered_json> memoryJson(const ViewTable& table, std::size_t frames,
                                                        std::uint64_t mostKept, Job& job);

/// Of views of which only the sizes are known, those of the field "views", which may be refined.
/// `onDemand`: they are read when they are asked for. Errors (invalidInput): a size is not known.
[[nodiscard]] Result<nlohmann::ordered_json> memoryOfSizes(const nlohmann::ordered_json& views,
                                                           std::size_t frames, bool onDemand,
                                                           const Limits& limits);

/// The same for people, a row for each command.
[[nodiscard]] std::string memoryText(const nlohmann::ordered_json& memory);

}  // namespace stx

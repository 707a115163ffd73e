#pragma once

#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

#include "lib/base/job.hpp"

namespace stx {

struct InfoOptions {
    /// Decode the pixels where the headers do not have the bounds or the points.
    bool bounds = false;
    /// Decode the pixels and measure by how much each view disagrees with those that overlap it; a
    /// note names those that do.
    bool agreement = false;
    /// The memory that each command takes at most; views on demand are read once to find it.
    bool memory = false;
    std::string object;  ///< as OpenOptions::object; empty: of all
};

/// What is in a file, as JSON by tools/schemas/info.schema.json: container, node kind, cameras,
/// sizes, bytes. Reads headers only, unless options.bounds,
/// options.agreement or options.memory asks for more. Errors: io, invalidInput.
[[nodiscard]] Result<nlohmann::ordered_json> describe(const std::filesystem::path& path,
                                                      const InfoOptions& options, Job& job);

/// The same for people: lines in which names are printable().
[[nodiscard]] std::string describeAsText(const nlohmann::ordered_json& info);

}  // namespace stx

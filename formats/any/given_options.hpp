#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "formats/any/options.hpp"
#include "lib/base/job.hpp"

namespace stx {

/// What an input is read as.
enum class Reads { mesh, moment, film };

/// Options that were given, by the names that the caller has for them: `--depth-unit`, or
/// `depth_unit` where they are keywords.
struct GivenOptions {
    std::vector<std::string> ofMeshes;
    std::vector<std::string> ofSets;
    std::vector<std::string> ofViews;    ///< of whatever has views already
    std::vector<std::string> ofMpeg4{};  ///< of how scenes of MPEG-4 are read
};

/// Notes the options that do not matter to this input: lists of many inputs may hold others that
/// they are for. `options` are what it is opened with.
void noteUnusedOptions(const std::filesystem::path& input, Reads as, const GivenOptions& given,
                       const OpenOptions& options, Job& job);

/// Errors (usage) for a frame that is asked for, by an option of this name, of a film that is not
/// an image set: its first one would be taken. `instead`: what to do.
[[nodiscard]] Result<void> checkFrameOf(const std::filesystem::path& input,
                                        const OpenOptions& options, std::string_view name,
                                        std::string_view instead, Job& job);

}  // namespace stx

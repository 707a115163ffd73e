#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "formats/any/options.hpp"
#include "lib/splats/from_bundle.hpp"
#include "tools/program.hpp"

namespace stx::tools {

/// What `stx extract` writes as a file.
enum class ExtractAs { points, splats, surfaces, rgbd, pair };

/// What a file is written as: what `as` says (empty: not given), else splats for .spz, surfaces for
/// .glb, points for .ply and .drc, rgbd for NAME_rgbd.png and .jpg, and pair for other pictures;
/// nothing for other endings, which take no --as. Errors (usage): an ending that does not hold it.
[[nodiscard]] Result<std::optional<ExtractAs>> extractedAs(const std::string& as,
                                                           const std::filesystem::path& file);

/// `stx extract` into a file of splats, or of a film into one for each frame, all or none, where
/// `output` has a number (%04d): says what was written and reports it. Errors: those of momentOf(),
/// of the input, splatsOfViews() and writeSplats().
[[nodiscard]] Result<int> extractSplats(const std::string& input, const OpenOptions& open,
                                        const std::string& output,
                                        const std::optional<double>& time,
                                        const std::string& refine, const SplatSettings& settings,
                                        Program& program);

}  // namespace stx::tools

#pragma once

#include <optional>
#include <string>

#include "formats/any/options.hpp"
#include "formats/imagesets/export_picture.hpp"
#include "formats/viewer/surfaces_glb.hpp"
#include "tools/program.hpp"

namespace stx::tools {

/// `stx extract` into a picture with depth: says what was written and reports it. `view`: as
/// namedView(). `jpegQuality`: as exportPicture(). Errors: those of momentOf(), namedView() and
/// exportPicture().
[[nodiscard]] Result<int> extractPicture(const std::string& input, const OpenOptions& open,
                                         const std::string& output, DepthPicture kind,
                                         int jpegQuality, int view,
                                         const std::optional<double>& time,
                                         const std::string& refine, Program& program);

/// Whether a file that ends so is one that others show as it is: ".html", a page for browsers,
/// and ".glb", a model for any viewer.
[[nodiscard]] bool isShown(const std::string& ending);
/// `stx extract` into such a file: says what was written and reports it. `time`: the moment that a
/// model is of. `refine`: see refineOption(). `model`: of one. Errors: those of momentOf(), of the
/// input and of writing.
[[nodiscard]] Result<int> extractShown(const std::string& input, const OpenOptions& open,
                                       const std::string& output, const std::optional<double>& time,
                                       const std::string& refine, const SurfacesOptions& model,
                                       Program& program);

}  // namespace stx::tools

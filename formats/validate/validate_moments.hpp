#pragma once

#include <filesystem>

#include "formats/mpeg4/scene/document.hpp"
#include "formats/validate/findings.hpp"
#include "lib/base/job.hpp"

namespace stx {

/// Whether a presentation may change by commands, by pictures of its streams or by clocks.
[[nodiscard]] bool changesLater(const mpeg4::Document& document);

/// Rule 2032: reads each moment but the first, of which the other rules are asked. `folder` is that
/// of the file.
void checkLaterMoments(mpeg4::Document document, const std::filesystem::path& folder,
                       Findings& findings, Job& job);

}  // namespace stx

#pragma once

#include "formats/stx/stx.hpp"
#include "tools/python/keywords.hpp"

/// Keywords as the settings of the library's calls; each throws stx.Error (usage).
namespace stx::python {

[[nodiscard]] OpenOptions openOptionsFrom(const Keywords& given);
/// The keywords of `given`, a list of those that differ from their defaults, by what they are of.
[[nodiscard]] GivenOptions givenFrom(const Keywords& given);
[[nodiscard]] SaveOptions saveOptionsFrom(int jpegQuality, std::optional<int> h264, bool noClobber);
[[nodiscard]] ConvertSettings convertSettingsFrom(const Keywords& given);
[[nodiscard]] BakeSettings bakeSettingsFrom(const Keywords& given);
[[nodiscard]] PackSettings packSettingsFrom(const Keywords& given);
/// Nothing when no keyword asks for pruning.
[[nodiscard]] std::optional<PruneSettings> pruneSettingsFrom(const Keywords& given);
[[nodiscard]] StillSettings stillSettingsFrom(const Keywords& given);
[[nodiscard]] RenderSettings renderSettingsFrom(const Keywords& given);
[[nodiscard]] Backend backendFrom(const Keywords& given);

}  // namespace stx::python

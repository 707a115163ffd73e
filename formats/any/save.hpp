#pragma once

#include <filesystem>
#include <optional>

#include "formats/any/open.hpp"
#include "formats/any/options.hpp"
#include "formats/mpeg4/mpeg4.hpp"

namespace stx {

/// The container that a target's ending asks for: .exr, .mp4, .xmt or .bt. Errors (usage) for
/// others.
[[nodiscard]] Result<FileKind> containerOf(const std::filesystem::path& target);

/// Writes a bundle whole or not at all, in the container of the target's ending. Errors: what
/// Bundle::check() says; files; (unsupported) what the container cannot hold.
[[nodiscard]] Result<void> saveBundle(const Bundle& bundle, const std::filesystem::path& target,
                                      const SaveOptions& options, Job& job);

/// The same bytes of views that are written when they come; .exr `together` with other files, if
/// these are given. Errors: also those of the views.
[[nodiscard]] Result<void> saveViews(const ViewTable& table, const std::filesystem::path& target,
                                     const SaveOptions& options, Job& job,
                                     OutputFiles* together = nullptr);

/// What of the options is about the scene, and about its file.
[[nodiscard]] mpeg4::SceneWriteOptions mpeg4Scene(const SaveOptions& options);
[[nodiscard]] Mpeg4WriteOptions mpeg4Write(const SaveOptions& options);

/// Converts one MPEG-4 file into another container without decoding an image: every stream's bytes
/// pass untouched. Returns what the presentation shows, as a bundle without images (empty when it
/// shows no view), or with them when `pixels` is set, for a report. Nothing, and nothing written,
/// when this is not such a conversion: another kind of input or target, or options that change
/// pixels.
[[nodiscard]] Result<std::optional<Bundle>> convertDocument(const std::filesystem::path& input,
                                                            const std::filesystem::path& target,
                                                            const SaveOptions& options,
                                                            bool changesDepth, bool pixels,
                                                            Job& job);

}  // namespace stx

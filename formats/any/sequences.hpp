#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "formats/any/options.hpp"
#include "lib/base/job.hpp"
#include "lib/model/sequence.hpp"

namespace stx {

/// Opens whatever holds views in time: an MPEG-4 presentation with MovieTextures, commands or
/// interpolators; an image set with time; OpenEXR bundles and atlases by a numbered name
/// (`name_%04d.exr`, `atlas_%04d` of folders), with the times that they hold, else 25 a second, all
/// counted from the origin of the first.
/// Whatever stands still gives one frame. Frames that are missing or damaged are the ones before,
/// with a note, or errors where options.set.strict (acrossDamage()). Errors as openBundle().
[[nodiscard]] Result<std::unique_ptr<Sequence>> openSequence(const std::filesystem::path& path,
                                                             const OpenOptions& options, Job& job);

/// World bounds of all frames of a film, which count from an origin (Bundle::origin).
struct FilmBounds {
    Bounds bounds;
    glm::dvec3 origin{0.0};
};
/// A film of numbered files, frames as these have them, but for the first one's origin in all.
struct NumberedFilm {
    std::unique_ptr<Sequence> frames;
    std::optional<FilmBounds> bounds;  ///< by the files' headers; none where these do not tell all
};
/// Opens one. Errors as openSequence().
[[nodiscard]] Result<NumberedFilm> openNumbered(const std::filesystem::path& pattern,
                                                const OpenOptions& options, Job& job);

/// Whether a target can hold more than one frame: MPEG-4, or a numbered name of .exr.
[[nodiscard]] bool holdsSequences(const std::filesystem::path& target);

/// Writes a sequence whole or not at all: MPEG-4 (see sequence_write.hpp) or one .exr for each
/// frame, numbered from 0 (OutputFiles). A sequence of one frame is saved as its bundle. Errors as
/// saveBundle(); (usage) a target that holds one frame only, several numbers in its name, or the
/// name of a film that is open (FilesOfFilm).
[[nodiscard]] Result<void> saveSequence(Sequence& frames, const std::filesystem::path& target,
                                        const SaveOptions& options, Job& job);

}  // namespace stx

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "formats/mpeg4/scene/document.hpp"
#include "lib/base/job.hpp"

/// The files beside a text, in which the bytes of its streams are.
namespace stx::mpeg4 {

/// Whether a text has to keep a stream in an .mp4 of its own, named as `file.mp4#1`, which other
/// programs read, too: it has several pictures, or a sample entry or edits of its own.
[[nodiscard]] bool needsTrackFile(const ElementaryStream& stream);

/// Opens the files that the streams of a document (from a text) name, found in the first of
/// `folders` that has them. Streams that do not say what they are get their type from the file.
/// `name.mp4#3` is track 3 of an .mp4. Errors: (invalidInput) names that leave the folder; (io)
/// files that are not there.
[[nodiscard]] Result<void> loadMedia(Document& document,
                                     const std::vector<std::filesystem::path>& folders, Job& job);

/// Notes the files in document.folder that urls of the scene name, PROTOs included, and that are
/// not in `to` likewise: a url is written as it is, and finds nothing there. Those of object
/// descriptors are none of them.
void noteFilesOfUrls(const Document& document, const std::filesystem::path& to, Job& job);

/// In a scene that was made from a bundle, says what the tracks of its images are for: each gets a
/// name, and only colour is in the movie, so that players that know no scenes have no reason to
/// show depth as a video. Other scenes stay as they are.
void nameTracks(Document& document);

/// Names for the files of all streams, each once: their own name where it is a plain one, else what
/// they are for (`front_depth.png`, from the DEF name of the DepthImage), else by object
/// descriptor. In the order of the streams in document.odFrames; empty for streams without samples.
[[nodiscard]] std::vector<std::string> mediaFileNames(const Document& document);

/// The folder of these files, beside the text: `name_images` of `name.xmt`, `name_images_bt` of
/// `name.bt`, and `name_images_xmta` of `name.xmta`. What readers of a file's name take for
/// something else (`%` of numbers, `#` of a track, `:` of a URL), and bytes that XML cannot have,
/// is `=` and two hexadecimal digits, so that two texts never share a folder.
[[nodiscard]] std::string mediaFolderName(const std::filesystem::path& text);

}  // namespace stx::mpeg4

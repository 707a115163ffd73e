#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "formats/exr/exr_file.hpp"
#include "lib/base/job.hpp"
#include "lib/model/environment.hpp"

// clang-format off
/// Environments in OpenEXR files: one part with the standard attribute `envmap`, R G B A
/// premultiplied linear light; half for 8-bit sRGB, which comes back to the bit.
///  - latlong: our picture as it is. OpenEXR's longitude 0, in the middle, is its +Z, which is our
///    -Z: its world is ours turned by half a turn about Y.
///  - cube: six squares in a column, +X -X +Y -Y +Z -Z of OpenEXR's world, which are our left,
///    right, top, bottom, front and back; top and bottom are turned by half a turn there.
///
/// Pixels are areas here, as most programs take them; OpenEXR's formulas put the first and the last
/// sample of a row on the very edges, which is half a pixel at most.
///
/// Ours also have stx:environment ("latlong", "cube", or "none": sky and ground alone, in one
/// pixel), stx:colour ("sRGB8" or "linear"), stx:quaternion (text: w x y z), stx:faces (those that
/// are there, where some are not), stx:sky and stx:ground (text: r g b, then angle r g b for each
/// further colour).
// clang-format on
namespace stx {

/// What an environment's part says without its pixels.
struct ExrEnvironmentHeader {
    Environment environment;  ///< without pictures
    glm::ivec2 size{0};       ///< of the picture, or of each face
    std::vector<CubeFace> faces;
    bool linear = true;
    std::uint64_t bytes = 0;  ///< of the pixels in the file
};

/// The first part that we wrote as an environment, or that has `envmap`; -1: none.
[[nodiscard]] int environmentPartOf(const ExrReader& reader);
/// Errors (invalidInput): a size that an environment cannot have.
[[nodiscard]] Result<ExrEnvironmentHeader> environmentHeader(const ExrPart& part);
/// The environment of a part: one of environmentPartOf(), or any whose picture is twice as wide as
/// high, taken as latlong. Errors: environmentHeader(), files, memory.
[[nodiscard]] Result<std::shared_ptr<const Environment>> readEnvironmentPart(
    const ExrReader& reader, int part, Job& job);

/// Replaces what other programs leave in pictures of light: in the channels R, G, B, Y and A
/// infinity becomes 65504 (alpha: 1), NaN and negative infinity become 0. Notes say how many.
/// `values` are interleaved.
void makeFinite(std::span<float> values, std::span<const std::string> channels,
                const std::string& where, Job& job);

/// A file of its own: an OpenEXR file with one part. Errors: environmentPart(), files.
[[nodiscard]] Result<void> writeEnvironmentExr(const Environment& environment,
                                               const std::filesystem::path& path, Job& job,
                                               OutputFile::Options options = {});
/// The environment of an OpenEXR file: the part of one, else a first part whose picture is twice as
/// wide as high. Errors (invalidInput): there is none; files.
[[nodiscard]] Result<std::shared_ptr<const Environment>> readEnvironmentExr(
    const std::filesystem::path& path, Job& job);

/// The part of an environment, to be written by writeEnvironmentPart(). Faces of other shapes or
/// unlike sizes are resampled with a note. Errors: Environment::check().
struct ExrEnvironmentPart {
    ExrPart part;
    Environment environment;  ///< as it is written
};
[[nodiscard]] Result<ExrEnvironmentPart> environmentPart(const Environment& environment, Job& job);
/// Changes a part so that it can be in one file with others: it gets the display window and the
/// pixel aspect ratio of the others, which all parts of a file must share, and a name that none of
/// them has.
void joinParts(ExrPart& part, const std::vector<ExrPart>& others);
[[nodiscard]] Result<void> writeEnvironmentPart(ExrWriter& writer, int index,
                                                const ExrEnvironmentPart& part);

}  // namespace stx

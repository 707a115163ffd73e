#include "formats/any/given_options.hpp"

#include "formats/any/open.hpp"
#include "formats/any/sequences.hpp"
#include "formats/exr/bundle_exr.hpp"

namespace stx {
namespace {

/// A photograph with depth, in its file or beside it.
bool isPhoto(const Result<FileKind>& kind, const OpenOptions& options) {
    return kind && (*kind == FileKind::photo ||
                    (*kind == FileKind::image && !options.set.depthPattern.empty()));
}

/// Whether an input is read as an image set. An .exr is a bundle or a picture with Z.
bool isSet(const std::filesystem::path& input, const Result<FileKind>& kind,
           const OpenOptions& options, const Limits& limits) {
    if (!options.set.from.empty() || !kind || *kind == FileKind::imageSet || isPhoto(kind, options))
        return true;
    if (*kind != FileKind::exr) return false;
    const auto reader = ExrReader::open(input, limits);
    return !reader || exrViewParts(*reader).empty();
}

void take(std::vector<std::string>& from, std::string_view word) {
    std::erase_if(from, [&](const std::string& name) {
        return name == word || name == "--" + std::string(word);
    });
}

}  // namespace

void noteUnusedOptions(const std::filesystem::path& input, Reads as, const GivenOptions& given,
                       const OpenOptions& options, Job& job) {
    const auto kind = recognise(input);
    const bool set = isSet(input, kind, options, job.limits);
    const auto note = [&](const std::vector<std::string>& names, const char* ofWhat,
                          const char* isWhat) {
        job.noteUnused(names, ofWhat, fmt::format("'{}' is {}", input.filename().string(), isWhat));
    };
    if (as != Reads::mesh) {
        auto names = given.ofMeshes;
        // Of an image set it is the pattern of names.
        if (set) take(names, "texture");
        if (isPhoto(kind, options)) take(names, "fov");
        note(names, "of meshes", kind ? nameOf(*kind) : "none");
    } else {
        note(given.ofViews, "of inputs with views", nameOf(FileKind::mesh));
    }
    if (!options.set.from.empty() || !kind || *kind != FileKind::mpeg4)
        note(given.ofMpeg4, "of MPEG-4 scenes", kind ? nameOf(*kind) : "none");
    if (set) return;
    auto names = given.ofSets;
    if (as == Reads::film) take(names, "strict");
    note(names, "of image sets", nameOf(*kind));
}

Result<void> checkFrameOf(const std::filesystem::path& input, const OpenOptions& options,
                          std::string_view name, std::string_view instead, Job& job) {
    if (!options.set.from.empty()) return {};
    const auto kind = recognise(input);
    if (!kind || (*kind != FileKind::mpeg4 && *kind != FileKind::numbered)) return {};
    Job quiet;  // what is noted of the input comes when it is read
    quiet.workFor(job);
    STX_TRY(const auto frames, openSequence(input, options, quiet));
    if (!frames->timeline().moves()) return {};
    return fail(ErrorCode::usage, "{} is of image sets, and '{}' is {}; {}", name, input.string(),
                nameOf(*kind), instead);
}

}  // namespace stx

#include "formats/atlas/atlas_files.hpp"
#include "formats/open.hpp"
#include "formats/stx/stx.hpp"
#include "formats/validate/validate.hpp"

namespace stx {
namespace {

Result<std::vector<Finding>> findingsOf(const std::filesystem::path& path, Job& job) {
    STX_TRY(const auto kind, recognise(path));
    if (kind == FileKind::atlas) {
        STX_TRY(const auto atlas, readAtlas(path, job));
        return validate(atlas);
    }
    if (kind == FileKind::exr) {
        STX_TRY(const auto bundle, openBundle(path, {}, job));
        return validate(bundle);
    }
    if (kind == FileKind::mpeg4 || kind == FileKind::unknown) {
        ValidateOptions options;
        options.folder = path.parent_path();
        return validateMpeg4File(path, options, job);
    }
    return fail(ErrorCode::invalidInput,
                "'{}' is {}; bundles (.mp4, .xmt, .bt, .exr) and atlases can be validated",
                path.string(), nameOf(kind));
}

}  // namespace

Result<std::vector<BrokenRule>> validate(const std::filesystem::path& path, Job& job) {
    STX_TRY(const auto findings, findingsOf(path, job));
    std::vector<BrokenRule> broken;
    for (const auto& f : findings)
        broken.push_back({f.rule->number, f.rule->severity == Rule::Severity::error, f.rule->clause,
                          f.rule->summary, f.where, f.found, f.expected});
    return broken;
}

}  // namespace stx

#include "formats/open.hpp"
#include "formats/validate/findings.hpp"
#include "formats/validate/validate_mpeg4.hpp"

namespace stx {

Result<std::vector<Finding>> validateFile(const std::filesystem::path& path,
                                          const ValidateOptions& options, Job& job) {
    STX_TRY(const FileKind kind, recognise(path));
    Result<std::vector<Finding>> findings;
    switch (kind) {
        case FileKind::mpeg4:
        case FileKind::unknown:  // a presentation that is damaged at its beginning, perhaps
            findings = validateMpeg4File(path, options, job);
            break;
        case FileKind::exr:
            findings = validateExrFile(path, options, job);
            break;
        case FileKind::atlas:
            findings = validateAtlasFile(path, options, job);
            break;
        case FileKind::mesh:
        case FileKind::imageSet:
        case FileKind::image:
            return fail(ErrorCode::invalidInput,
                        "'{}' is {}; bundles (.mp4, .xmt, .bt, .exr) and atlases can be validated",
                        path.string(), nameOf(kind));
    }
    STX_CHECK(job.checkCancelled());
    return findings;
}

}  // namespace stx

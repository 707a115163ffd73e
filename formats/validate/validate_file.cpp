#include <map>
#include <utility>

#include "formats/any/open.hpp"
#include "formats/files/numbered.hpp"
#include "formats/imagesets/image_sets.hpp"
#include "formats/imagesets/set_views.hpp"
#include "formats/imagesets/summary.hpp"
#include "formats/meshes/meshes.hpp"
#include "formats/validate/findings.hpp"
#include "formats/validate/validate_mpeg4.hpp"

namespace stx {
namespace {

/// Missing files first, all of them; the pixels only when there are none.
Result<std::vector<Finding>> validateImageSet(const std::filesystem::path& path,
                                              const ValidateOptions& options, Job& job) {
    const auto set = summariseImageSet(path, job);
    if (!set) return unreadable(set.error());
    Findings findings;
    for (std::size_t i = 0; i < set->views.size(); ++i)
        for (const std::string& name : set->views[i].missing)
            findings.add(1003, viewText(i, set->views[i].name), fmt::format("no file '{}'", name),
                         "the file");
    if (!findings.list.empty() || !options.pixels) return findings.list;
    auto views = [&]() -> Result<std::vector<Finding>> {
        ImageSetOptions asGiven;
        asGiven.refine.set(RefineStep::poses, false);
        STX_TRY(const auto table, openSetViews(path, asGiven, job, heldWhole(job.limits)));
        return validateViews(*table, job);
    }();
    if (views) return views;
    // Without --depth-range and the like the set is not wrong, but cannot be read.
    if (views.error().code == ErrorCode::usage) return views;
    Error error = views.error();
    if (error.code == ErrorCode::io) error.code = ErrorCode::invalidInput;
    return unreadable(error);
}

/// Takes away what is no fault of a frame where other frames of the film do without it: a view, or
/// all of them, without a point (rules 4006 and 4007). `files`: the findings of each.
void forgiveEmptyFrames(std::vector<std::vector<Finding>>& files) {
    std::map<std::pair<int, std::string>, std::size_t> counts;
    const auto isOfFrame = [](const Finding& f) {
        return f.rule->number == 4006 || f.rule->number == 4007;
    };
    for (const auto& found : files)
        for (const Finding& f : found)
            if (isOfFrame(f)) ++counts[{f.rule->number, f.where}];
    for (auto& found : files)
        std::erase_if(found, [&](const Finding& f) {
            return isOfFrame(f) && counts[{f.rule->number, f.where}] < files.size();
        });
}

/// Each file of a film, its findings with its name, and files that are missing between others.
Result<std::vector<Finding>> validateNumbered(const std::filesystem::path& path,
                                              const ValidateOptions& options, Job& job) {
    STX_TRY(const auto files, numberedFiles(path.string()));
    Findings findings;
    if (const auto gap = firstMissing(files))
        findings.add(1003, "", fmt::format("no file number {}", *gap),
                     "the files between the first and the last");
    std::vector<std::vector<Finding>> each;
    for (const NumberedFile& file : files) {
        STX_CHECK(job.checkCancelled());
        STX_TRY(auto found, validateFile(file.path, options, job));
        each.push_back(std::move(found));
    }
    forgiveEmptyFrames(each);
    for (std::size_t i = 0; i < files.size(); ++i) {
        for (Finding& finding : each[i]) {
            const std::string name = fmt::format("'{}'", files[i].path.filename().string());
            finding.where = finding.where.empty() ? name : name + ": " + finding.where;
            findings.list.push_back(std::move(finding));
        }
    }
    return findings.list;
}

}  // namespace

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
        case FileKind::imageSet:
            findings = validateImageSet(path, options, job);
            break;
        case FileKind::numbered:
            findings = validateNumbered(path, options, job);
            break;
        case FileKind::mesh: {
            const auto mesh = readMesh(path, job);
            if (!mesh)
                findings = unreadable(mesh.error());
            else
                findings = std::vector<Finding>();
            break;
        }
        case FileKind::photo:
        case FileKind::image:
            return fail(ErrorCode::invalidInput,
                        "'{}' is a picture; bundles (.mp4, .xmt, .bt, .exr), atlases, image sets "
                        "and meshes can be validated",
                        path.string());
    }
    STX_CHECK(job.checkCancelled());
    return findings;
}

}  // namespace stx

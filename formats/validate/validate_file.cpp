#include <algorithm>
#include <functional>
#include <iterator>
#include <map>
#include <set>
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

/// What is left of a set whose reading ended with an error: the error itself (usage) where the set
/// is not wrong, but needs --depth-range and the like; else a finding of rule 1001.
Result<std::vector<Finding>> ofUnreadSet(Error error) {
    if (error.code == ErrorCode::usage) return tl::unexpected(std::move(error));
    if (error.code == ErrorCode::io) error.code = ErrorCode::invalidInput;
    return unreadable(error);
}

/// The same of each view that cannot be read; where there is none, of what ended the reading.
Result<std::vector<Finding>> ofUnreadViews(const std::vector<Error>& views, const Error& ended) {
    if (views.empty()) return ofUnreadSet(ended);
    std::vector<Finding> all;
    for (const Error& error : views) {
        STX_TRY(auto found, ofUnreadSet(error));
        std::ranges::move(found, std::back_inserter(all));
    }
    return all;
}

/// Takes away what is not a fault of a frame where other frames of the film do without it: a view,
/// or all of them, without a point (rules 4006 and 4007). `files`: the findings of each.
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

/// Findings of each part of a film, with its name, as one list.
std::vector<Finding> ofAllParts(std::vector<std::vector<Finding>> each,
                                const std::function<std::string(std::size_t)>& nameOf) {
    forgiveEmptyFrames(each);
    std::vector<Finding> all;
    for (std::size_t i = 0; i < each.size(); ++i) {
        for (Finding& finding : each[i]) {
            const std::string name = nameOf(i);
            finding.where = finding.where.empty() ? name : name + ": " + finding.where;
            all.push_back(std::move(finding));
        }
    }
    return all;
}

/// Each frame of a set that moves. A picture that cannot be read is a finding once, at the first
/// moment that shows it.
Result<std::vector<Finding>> validateSetFrames(const std::filesystem::path& path,
                                               ImageSetOptions set, Job& job) {
    set.strict = true;  // the frame before in its place would be sound
    std::vector<Error> unread;
    set.failedView = [&](const Error& error) { unread.push_back(error); };
    STX_TRY(const auto frames, openImageSet(path, set, job));
    std::vector<std::vector<Finding>> each(frames->timeline().count());
    std::set<std::string> said;
    for (std::size_t i = 0; i < each.size(); ++i) {
        STX_CHECK(job.checkCancelled());
        // What is noted of one frame would be noted of all.
        Job quiet;
        quiet.workFor(job);
        auto found = [&]() -> Result<std::vector<Finding>> {
            STX_TRY(const auto table, frames->views(i, i == 0 ? job : quiet));
            return validateViews(*table, i == 0 ? job : quiet);
        }();
        if (!found) {
            STX_SET(found, ofUnreadViews(std::exchange(unread, {}), found.error()));
            std::erase_if(*found, [&](const Finding& f) { return !said.insert(f.text()).second; });
        }
        each[i] = std::move(*found);
    }
    return ofAllParts(std::move(each), [&](std::size_t i) { return frames->timeline().nameOf(i); });
}

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
    ImageSetOptions asGiven;
    asGiven.refine.set(RefineStep::poses, false);
    std::vector<Error> unread;
    asGiven.failedView = [&](const Error& error) { unread.push_back(error); };
    auto found = [&]() -> Result<std::vector<Finding>> {
        if (set->timeline.moves()) return validateSetFrames(path, asGiven, job);
        STX_TRY(const auto table, openSetViews(path, asGiven, job, heldWhole(job.limits)));
        return validateViews(*table, job);
    }();
    return found ? std::move(found) : ofUnreadViews(unread, found.error());
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
    auto ofFiles = ofAllParts(std::move(each), [&](std::size_t i) {
        return fmt::format("'{}'", files[i].path.filename().string());
    });
    std::ranges::move(ofFiles, std::back_inserter(findings.list));
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

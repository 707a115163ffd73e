#include <algorithm>

#include "formats/any/open.hpp"
#include "formats/exr/bundle_exr.hpp"
#include "formats/exr/environment_exr.hpp"
#include "formats/validate/findings.hpp"

namespace stx {
namespace {

std::string samplingText(const ExrPart& part, const ExrChannel& channel) {
    return sizeText((part.width + channel.xSampling - 1) / channel.xSampling,
                    (part.height + channel.ySampling - 1) / channel.ySampling);
}

/// Rules on what channels a view has and how large they are. What breaks them is taken out of the
/// part, so that the rest can be read. False when there is no depth to read.
bool checkChannels(ExrPart& part, const std::string& where, Findings& findings) {
    const std::string size = sizeText(part.width, part.height);
    bool depth = part.channel("Z") != nullptr;
    if (!depth) findings.add(4003, where, "no channel Z", "the depth in a channel Z");
    std::vector<std::string> names;
    for (const ExrChannel& channel : part.channels) {
        if (channel.xSampling == 1 && channel.ySampling == 1) continue;
        names.push_back(channel.name);
        const bool vector = channel.name.find('.') != std::string::npos;
        if (channel.name == "Z") depth = false;
        findings.add(
            vector ? 6001 : 4001, where,
            fmt::format("the channel {} with {}", channel.name, samplingText(part, channel)), size);
    }
    std::erase_if(part.channels, [&](const ExrChannel& channel) {
        return std::find(names.begin(), names.end(), channel.name) != names.end();
    });
    for (const char* name : {"N", "splatU", "splatV"}) {
        std::string found;
        for (const char* axis : {".X", ".Y", ".Z"}) {
            const std::string channel = std::string(name) + axis;
            const bool stored = std::find(names.begin(), names.end(), channel) != names.end();
            if (part.channel(channel) || stored) found += (found.empty() ? "" : " ") + channel;
        }
        const auto channels = std::count(found.begin(), found.end(), ' ') + 1;
        if (!found.empty() && channels < 3)
            findings.add(6002, where, "only " + found, fmt::format("{0}.X, {0}.Y and {0}.Z", name));
    }
    return depth;
}

}  // namespace

void checkEnvironment(const Result<std::shared_ptr<const Environment>>& read, Findings& findings) {
    if (!read)
        findings.add(4005, "environment", read.error().text(), "a picture that can be decoded");
}

Result<std::vector<Finding>> validateExrFile(const std::filesystem::path& path,
                                             const ValidateOptions& options, Job& job) {
    const auto reader = ExrReader::open(path, job.limits);
    if (!reader) return unreadable(reader.error());
    if (!isExrBundle(*reader)) {
        // Of another program: what it means is fitted to our rules while it is read.
        const auto bundle = openBundle(path, {}, job);
        if (!bundle) return unreadable(bundle.error());
        return validate(*bundle);
    }
    if (const auto kind = checkExrKind(*reader); !kind) return unreadable(kind.error());
    Findings findings;
    std::int64_t points = 0;
    bool allRead = options.pixels;
    std::size_t index = 0;
    for (const int at : exrViewParts(*reader)) {
        if (job.cancelled) break;
        ExrPart part = reader->parts()[at];
        const std::string where = viewText(index++, part.name);
        auto view = exrCamera(part);
        if (!view) {
            findings.add(1001, where, view.error().text(), "a camera");
            allRead = false;
            continue;
        }
        checkViewHeader(*view, where, findings);
        if (!checkChannels(part, where, findings)) allRead = false;
        if (!options.pixels || !part.channel("Z")) continue;
        auto read = reader->checkPlausible(at);
        if (read) read = job.limits.checkAllocation(exrViewBytes(*reader, part), 1, "the images");
        if (read) read = readExrView(*reader, at, part, *view);
        if (!read) {
            findings.add(4005, where, read.error().message, "pixels that can be decoded");
            allRead = false;
            continue;
        }
        points += checkViewImages(*view, where, findings);
    }
    if (const int at = environmentPartOf(*reader); at >= 0 && options.pixels)
        checkEnvironment(readEnvironmentPart(*reader, at, job), findings);
    if (allRead && points == 0) findings.add(4007, "", "no point in any view", "points");
    return findings.list;
}

}  // namespace stx

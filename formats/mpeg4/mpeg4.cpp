#include "formats/mpeg4/mpeg4.hpp"

#include <algorithm>
#include <optional>
#include <vector>

#include "formats/files/files.hpp"
#include "formats/files/no_case.hpp"
#include "formats/files/text_encoding.hpp"
#include "formats/mpeg4/container/isobmff.hpp"
#include "formats/mpeg4/mapping/picture_spool.hpp"
#include "formats/mpeg4/media_files.hpp"
#include "formats/mpeg4/text/bt.hpp"
#include "formats/mpeg4/text/text_descriptors.hpp"
#include "formats/mpeg4/text/text_values.hpp"
#include "formats/mpeg4/text/xmt.hpp"
#include "lib/geometry/directions.hpp"
#include "lib/model/from_origin.hpp"

namespace stx {

using namespace mpeg4;

namespace {

/// Files in a folder that an earlier text's images left there, by the names that we give.
std::vector<std::string> earlierImages(const std::filesystem::path& folder) {
    std::vector<std::string> names;
    std::error_code error;
    for (std::filesystem::directory_iterator it(folder, error), end; !error && it != end;
         it.increment(error)) {
        const std::string name = it->path().filename().string(), stem = it->path().stem().string();
        bool ours = stem.starts_with("od") && integerFromText(stem.substr(2)).has_value();
        for (const char* role : {"_texture", "_depth", "_normal", "_splatU", "_splatV"})
            ours = ours || stem.ends_with(role);
        for (const char* face : kCubeFaceNames)
            ours = ours || stem == fmt::format("environment_{}", face);
        if (ours) names.push_back(name);
    }
    return names;
}

Result<void> writeText(const Document& source, const std::filesystem::path& path,
                       Mpeg4Container container, Job& job, const OutputFile::Options& options) {
    Document document = source;
    const auto names = mediaFileNames(document);
    // Names in the text are found beside the file that a link leads to.
    STX_TRY(const auto real, throughLinks(path));
    const std::string folderName = mediaFolderName(real);
    struct Part {
        ElementaryStream* stream;
        std::string name;
        bool asTrack;  ///< an .mp4 with one track, number 1
    };
    std::vector<Part> parts;
    std::size_t next = 0;
    for (OdFrame& frame : document.odFrames) {
        for (OdCommand& command : frame.commands) {
            auto* update = std::get_if<UpdateObjectDescriptors>(&command);
            if (!update) continue;
            for (ObjectDescriptor& od : update->descriptors) {
                for (ElementaryStream& stream : od.streams) {
                    const std::string& name = names.at(next++);
                    if (name.empty()) continue;
                    parts.push_back({&stream, name, needsTrackFile(stream)});
                }
            }
        }
    }
    for (Part& part : parts)
        part.stream->fileName = folderName + "/" + part.name + (part.asTrack ? "#1" : "");
    for (const ElementaryStream* stream : {&document.sceneStream, &document.odStream})
        if (!stream->edits.edits.empty())
            job.note(
                "the edit list of the scene or its object descriptors is left out: texts have "
                "none");
    const auto coded =
        std::ranges::count_if(document.frames, [](const CommandFrame& f) { return !!f.coded; });
    if (coded > 0)
        job.note(fmt::format(
            "{} access unit(s) of the scene have commands that are not known here; these are left "
            "out of the text",
            coded));
    STX_TRY(const auto text,
            container == Mpeg4Container::bt ? writeBt(document, job) : writeXmt(document, job));
    if (path == "-") {
        if (!parts.empty())
            return fail(
                ErrorCode::usage,
                "a text with images cannot go to stdout: its images need a folder; name a file");
    }
    STX_TRY(auto file, OutputFile::create(path, options));
    STX_CHECK(file.write(text));
    if (parts.empty()) return file.commit();

    std::vector<std::string> allNames;
    for (const Part& part : parts) {
        if (part.asTrack) {
            allNames.push_back(part.name);
            continue;
        }
        for (const std::string& name : sampleFileNames(*part.stream))
            allNames.push_back(name.substr(folderName.size() + 1));
    }
    const auto beside = real.parent_path() / folderName;
    STX_TRY(auto folder, OutputFolder::create(beside, options, earlierImages(beside)));
    next = 0;
    for (const Part& part : parts) {
        STX_CHECK(job.checkCancelled());
        if (part.asTrack) {
            STX_TRY(auto track, OutputFile::create(folder.temporaryPath() / allNames[next++]));
            STX_CHECK(writeMp4Stream(*part.stream, track, job));
            STX_CHECK(track.commit());
            continue;
        }
        for (const Sample& sample : part.stream->samples) {
            STX_TRY(const auto bytes, sample.data.load(job.limits));
            STX_CHECK(writeFile(folder.temporaryPath() / allNames[next++], bytes));
        }
    }
    return folder.commitWith(file);
}

/// Whether a text begins as BT may: behind comments a descriptor, a command, a PROTO, or a node
/// that can hold a scene, which may have a name. VRML has such nodes, too, behind a first line of
/// its own.
bool beginsAsBt(std::string_view text) {
    constexpr std::string_view kBlanks = " \t\r\n,";
    constexpr std::string_view kWords[] = {"InitialObjectDescriptor",
                                           "Group",
                                           "OrderedGroup",
                                           "Layer2D",
                                           "Layer3D",
                                           "DEF",
                                           "PROTO",
                                           "EXTERNPROTO",
                                           "AT",
                                           "RAP"};
    if (text.starts_with("#VRML") || text.starts_with("#X3D")) return false;
    for (;;) {
        text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
        if (!text.starts_with('#')) break;
        text.remove_prefix(std::min(text.find_first_of("\r\n"), text.size()));
    }
    const auto first = text.substr(0, text.find_first_of(" \t\r\n,{#"));
    return std::ranges::find(kWords, first) != std::end(kWords);
}

}  // namespace

std::optional<Mpeg4Container> mpeg4ContainerOf(const std::filesystem::path& path) {
    const std::string ending = path.extension().string();
    if (equalNoCase(ending, ".mp4") || equalNoCase(ending, ".m4v")) return Mpeg4Container::mp4;
    if (equalNoCase(ending, ".bt")) return Mpeg4Container::bt;
    if (equalNoCase(ending, ".xmt") || equalNoCase(ending, ".xmta")) return Mpeg4Container::xmt;
    return {};
}

std::optional<Mpeg4Container> mpeg4ContainerOf(ByteSpan head) {
    if (looksLikeMp4(head)) return Mpeg4Container::mp4;
    const auto marked = utf8FromMarked(head);
    const std::string_view text = textOf(marked ? ByteSpan(*marked) : head);
    const auto first = text.find_first_not_of(" \t\r\n");
    if (first != std::string_view::npos && text[first] == '<' &&
        text.find("<XMT-A") != std::string_view::npos)
        return Mpeg4Container::xmt;
    if (beginsAsBt(text)) return Mpeg4Container::bt;
    return {};
}

Result<std::optional<Mpeg4Container>> mpeg4ContainerOf(const ByteSource& source,
                                                       const std::filesystem::path& path) {
    Bytes head(static_cast<std::size_t>(std::min<std::uint64_t>(source.size(), 4096)));
    STX_CHECK(source.read(0, head));
    const auto content = mpeg4ContainerOf(ByteSpan(head));
    return content ? content : mpeg4ContainerOf(path);
}

Result<Mpeg4Document> readMpeg4(const std::filesystem::path& path, Job& job) {
    const std::string where = fmt::format("'{}'", path.string());
    ByteSource source;
    Bytes whole;
    if (path == "-") {
        STX_TRY(whole, readFile(path, job.limits));
        source = ByteSource::fromBytes(whole);
    } else {
        STX_TRY(source, ByteSource::open(path));
    }
    STX_TRY(const auto container, within(where, mpeg4ContainerOf(source, path)));
    if (!container)
        return failAt(
            where, ErrorCode::invalidInput,
            "the file is neither an MP4 nor a BT or XMT-A text (endings .mp4, .bt, .xmt)");
    if (*container == Mpeg4Container::mp4) {
        STX_TRY(auto film, within(where, readMp4(source, job)));
        film.folder = folderOf(path);
        return film;
    }
    if (path != "-") STX_SET(whole, readFile(path, job.limits));
    auto document = *container == Mpeg4Container::bt ? readBt(textOf(whole), path.string(), job)
                                                     : readXmt(textOf(whole), path.string(), job);
    if (!document) return document;
    std::vector<std::filesystem::path> folders = {folderOf(path)};
    // Standard input has no folder, whatever it is a link to.
    if (folders.front() != "/dev") {
        STX_TRY(const auto real, throughLinks(path));
        folders.push_back(folderOf(real));
    }
    STX_CHECK(within(where, loadMedia(*document, folders, job)));
    document->folder = folders.front();
    return document;
}

Result<void> writeMpeg4(const Mpeg4Document& document, const std::filesystem::path& path, Job& job,
                        const Mpeg4WriteOptions& options) {
    const auto container = path == "-" ? Mpeg4Container::mp4 : mpeg4ContainerOf(path);
    if (!container)
        return fail(ErrorCode::usage, "'{}' has no ending of an MPEG-4 file: .mp4, .bt or .xmt",
                    path.string());
    if (options.bifsVersion < 0 || options.bifsVersion > 2)
        return fail(ErrorCode::usage, "BIFS of version {}; 1 and 2 are possible",
                    options.bifsVersion);
    if (options.bifsVersion != 0 && options.bifsVersion != document.bifsConfig.version) {
        Mpeg4Document other = document;
        other.bifsConfig.version = options.bifsVersion;
        other.sceneStream.objectTypeIndication =
            options.bifsVersion == 2 ? oti::kSystemsV2 : oti::kSystemsV1;
        Mpeg4WriteOptions same = options;
        same.bifsVersion = 0;
        return writeMpeg4(other, path, job, same);
    }
    noteFilesOfUrls(document, folderOf(path), job);
    if (*container != Mpeg4Container::mp4)
        return writeText(document, path, *container, job, options.output);
    STX_TRY(auto file, OutputFile::create(path, options.output));
    Mp4WriteOptions mp4;
    mp4.style = options.style;
    Document named = document;
    nameTracks(named);
    STX_CHECK(writeMp4(named, file, job, mp4));
    return file.commit();
}

Result<Bundle> readMpeg4Bundle(const std::filesystem::path& path, Job& job) {
    STX_TRY(const auto document, readMpeg4(path, job));
    SceneReadOptions options;
    options.folder = folderOf(path);
    return within(fmt::format("'{}'", path.string()), bundleFromScene(document, options, job));
}

Result<std::unique_ptr<ViewTable>> openMpeg4Views(const std::filesystem::path& path, Job& job) {
    STX_TRY(auto document, readMpeg4(path, job));
    SceneReadOptions options;
    options.folder = folderOf(path);
    return within(
        fmt::format("'{}'", path.string()),
        viewsFromScene(std::make_shared<const Document>(std::move(document)), options, job));
}

Result<void> writeMpeg4Views(const ViewTable& table, const std::filesystem::path& path, Job& job,
                             const SceneWriteOptions& scene, const Mpeg4WriteOptions& options) {
    std::optional<PictureSpool> spool;
    if (path != "-") STX_SET(spool, PictureSpool::create(folderBeside(path)));
    const glm::dvec3 origin = originOf(table);
    noteOrigin(origin, table.about(), job);
    std::unique_ptr<ViewTable> moved;
    if (origin != table.about().origin) moved = countedFrom(origin, table);
    STX_TRY(const auto document,
            sceneFromViews(moved ? *moved : table, scene, spool ? &*spool : nullptr, job));
    return writeMpeg4(document, path, job, options);
}

}  // namespace stx

#include "formats/mpeg4/media_files.hpp"

#include <cmath>
#include <map>
#include <set>
#include <span>

#include "formats/files/no_case.hpp"
#include "formats/mpeg4/container/isobmff.hpp"
#include "formats/mpeg4/mapping/mapping.hpp"
#include "formats/mpeg4/text/text_descriptors.hpp"
#include "formats/mpeg4/text/text_values.hpp"
#include "lib/base/code_point.hpp"
#include "lib/base/counted.hpp"
#include "lib/geometry/directions.hpp"

namespace stx::mpeg4 {
namespace {

/// Calls body(stream, object descriptor's id) for each stream that an OD brings.
template <class Doc, class Body>
Result<void> forEachStream(Doc& document, Body body) {
    for (auto& frame : document.odFrames) {
        for (auto& command : frame.commands) {
            if (auto* update = std::get_if<UpdateObjectDescriptors>(&command)) {
                for (auto& od : update->descriptors)
                    for (auto& stream : od.streams) STX_CHECK(body(stream, od.id));
            } else if (auto* streams = std::get_if<UpdateStreams>(&command)) {
                for (auto& stream : streams->streams)
                    STX_CHECK(body(stream, streams->objectDescriptorId));
            }
        }
    }
    return {};
}

/// objectTypeIndication of a file's first bytes; 0 when it is neither JPEG nor PNG.
std::uint8_t typeOf(ByteSpan head) {
    const auto byte = [&](std::size_t i) { return std::to_integer<int>(head[i]); };
    if (head.size() >= 3 && byte(0) == 0xFF && byte(1) == 0xD8 && byte(2) == 0xFF)
        return oti::kJpeg;
    if (head.size() >= 4 && byte(0) == 0x89 && byte(1) == 'P' && byte(2) == 'N' && byte(3) == 'G')
        return oti::kPng;
    return 0;
}

bool isPlainFileName(std::string_view name) {
    if (name.empty() || name[0] == '.' || name.size() > 120) return false;
    for (const char c : name) {
        const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                           (c >= '0' && c <= '9') || c == '_' || c == '-' || c == '.';
        if (!plain) return false;
    }
    return true;
}

std::string_view endingOf(const ElementaryStream& stream) {
    if (needsTrackFile(stream)) return ".mp4";
    switch (stream.objectTypeIndication) {
        case oti::kJpeg:
            return ".jpg";
        case oti::kPng:
            return ".png";
        default:
            return ".bin";
    }
}

/// What an image is for: the depth of DepthImage `front`.
struct Role {
    std::string view, field;
    [[nodiscard]] std::string name() const { return view + "_" + field; }
};

/// What the object descriptors of a scene are for.
std::map<int, Role> rolesOf(const Document& document) {
    std::map<int, Role> roles;
    int count = 0;
    const auto visit = [&](const NodePtr& node) {
        if (node->is("Background")) {
            for (std::size_t f = 0; f < kCubeFaceNames.size(); ++f)
                for (const Url& one :
                     node->get<std::vector<Url>>(fmt::format("{}Url", kCubeFaceNames[f])))
                    if (one.objectDescriptorId != 0)
                        roles.try_emplace(one.objectDescriptorId,
                                          Role{"environment", kCubeFaceNames[f]});
            return;
        }
        const int index = node->info->find("diTexture");
        if (index < 0) return;
        const auto* texture = std::get_if<NodePtr>(&node->value(index));
        const std::string base =
            isPlainFileName(node->defName) ? node->defName : fmt::format("view{}", count);
        ++count;
        if (!texture || !*texture) return;
        for (const Node::SetField& field : (*texture)->setFields) {
            const auto* image = std::get_if<NodePtr>(&field.value);
            const int url = image && *image ? (*image)->info->find("url") : -1;
            if (url < 0) continue;
            if (const auto* urls = std::get_if<std::vector<Url>>(&(*image)->value(url)))
                for (const Url& one : *urls)
                    if (one.objectDescriptorId != 0)
                        roles.try_emplace(one.objectDescriptorId,
                                          Role{base, (*texture)->info->fields[field.index].name});
        }
    };
    for (const CommandFrame& frame : document.frames)
        for (const Command& command : frame.commands) forEachNode(command, visit);
    return roles;
}

/// Files are opened, or, when there are many, read: a process may have a thousand files open.
constexpr std::size_t kMostOpen = 256;

class MediaLoader {
  public:
    MediaLoader(std::span<const std::filesystem::path> folders, bool many, Job& job)
        : folders_(folders), many_(many), job_(job) {}

    Result<void> load(ElementaryStream& stream, int odId) {
        if (stream.fileName.empty()) return {};
        STX_CHECK(within(fmt::format("object descriptor {}", odId), loadNamed(stream)));
        return {};
    }

  private:
    Result<void> loadNamed(ElementaryStream& stream) {
        if (const auto hash = stream.fileName.rfind('#'); hash != std::string::npos) {
            const auto choice = trackOf(stream, stream.fileName.substr(hash + 1));
            if (!choice)
                return fail(ErrorCode::invalidInput,
                            "'{}' names no track; expected FILE.mp4#NUMBER, FILE.mp4#video or "
                            "FILE.mp4#audio",
                            excerpt(stream.fileName));
            STX_TRY(const auto path, find(stream.fileName.substr(0, hash)));
            return loadTrack(stream, path, *choice);
        }
        const auto names = sampleFileNames(stream);
        if (names.empty() || names.size() != stream.samples.size())
            return fail(ErrorCode::invalidInput, "'{}' is not a name of {} file(s)",
                        excerpt(stream.fileName), stream.samples.size());
        for (std::size_t i = 0; i < names.size(); ++i) {
            STX_TRY(const auto path, find(names[i]));
            STX_TRY(stream.samples[i].data, open(path));
            if (names.size() > 1) continue;
            STX_TRY(const bool isFilm, checkAccessUnit(path, stream.samples[i].data));
            if (isFilm) return loadTrack(stream, path, *trackOf(stream, ""));
        }
        if (stream.samples.empty()) return {};
        ByteRange head = stream.samples[0].data;
        head.size = std::min<std::uint64_t>(head.size, 16);
        STX_TRY(const auto bytes, head.load(job_.limits));
        if (stream.objectTypeIndication == 0) stream.objectTypeIndication = typeOf(bytes);
        if (stream.streamType == StreamType::none) stream.streamType = StreamType::visual;
        return {};
    }
    /// Where it is named, else beside the text: other programs write names as seen from where they
    /// ran, and files get moved together.
    Result<std::filesystem::path> find(const std::string& name) const {
        const auto slash = name.find_last_of("/\\");
        const std::string alone = slash == std::string::npos ? name : name.substr(slash + 1);
        for (const auto& folder : folders_)
            for (const std::string& form : {name, alone})
                if (auto found = resolveInside(folder, form, job_.limits)) return found;
        return resolveInside(folders_.front(), name, job_.limits);  // the error that it has
    }
    Result<ByteRange> open(const std::filesystem::path& path) {
        if (!many_) {
            STX_TRY(auto source, ByteSource::open(path));
            const auto size = source.size();
            return ByteRange(std::move(source), 0, size);
        }
        STX_TRY(auto bytes, readFile(path, job_.limits));
        total_ += bytes.size();
        STX_CHECK(job_.limits.checkAllocation(total_, 1, "the images"));
        return ByteRange::of(std::move(bytes));
    }
    /// `1`, `trackID=1`, `video`, `audio`, as others write it, or nothing: by the stream's type.
    static std::optional<TrackChoice> trackOf(const ElementaryStream& stream, std::string name) {
        if (equalNoCase(name, "audio") || (name.empty() && stream.streamType == StreamType::audio))
            return TrackChoice{0, "soun"};
        if (name.empty() || equalNoCase(name, "video")) return TrackChoice{0, "vide"};
        constexpr std::string_view kById = "trackID=";
        if (name.size() > kById.size() && equalNoCase(name.substr(0, kById.size()), kById))
            name.erase(0, kById.size());
        const auto id = integerFromText(name);
        if (!id || *id < 1 || *id > 0xFFFFFFFF) return {};
        return TrackChoice{static_cast<std::uint32_t>(*id), {}};
    }
    /// Whether a file is not an access unit but an .mp4 of many. Errors (unsupported) on other
    /// files that are more than one: a stream of their bytes would be damaged.
    Result<bool> checkAccessUnit(const std::filesystem::path& path, ByteRange data) const {
        data.size = std::min<std::uint64_t>(data.size, 16);
        STX_TRY(const auto head, data.load(job_.limits));
        if (looksLikeMp4(head)) return true;
        const std::string ending = path.extension().string();
        for (const std::string_view film :
             {".264", ".h264", ".avc", ".265", ".h265", ".hevc", ".m4v", ".cmp", ".m1v", ".m2v",
              ".mpg", ".mpeg", ".ts", ".avi", ".mkv", ".webm", ".aac", ".mp3", ".ogg"})
            if (equalNoCase(ending, film))
                return fail(ErrorCode::unsupported,
                            "'{}' holds many pictures or sounds, and only an .mp4 is taken apart "
                            "here; make one of it (ffmpeg -i {} -c copy {}.mp4) and name that",
                            path.string(), path.filename().string(), path.stem().string());
        return false;
    }
    Result<void> loadTrack(ElementaryStream& stream, const std::filesystem::path& path,
                           const TrackChoice& choice) {
        STX_TRY(const auto source, ByteSource::open(path));
        STX_TRY(auto found, readMp4Stream(source, choice, job_));
        // What the text says of the start of the stream delays the track.
        const double start = stream.samples.empty()
                                 ? 0
                                 : static_cast<double>(stream.samples[0].time) / stream.timescale;
        const auto delay = static_cast<std::uint64_t>(std::llround(start * found.timescale));
        for (Sample& sample : found.samples) sample.time += delay;
        stream.samples = std::move(found.samples);
        stream.timescale = found.timescale;
        stream.edits = std::move(found.edits);
        stream.width = found.width;
        stream.height = found.height;
        stream.sampleEntry = std::move(found.sampleEntry);
        stream.handler = std::move(found.handler);
        if (stream.objectTypeIndication == 0)
            stream.objectTypeIndication = found.objectTypeIndication;
        if (stream.streamType == StreamType::none) stream.streamType = found.streamType;
        if (stream.decoderSpecificInfo.empty())
            stream.decoderSpecificInfo = std::move(found.decoderSpecificInfo);
        return {};
    }

    std::span<const std::filesystem::path> folders_;
    bool many_;
    Job& job_;
    std::uint64_t total_ = 0;
};

/// The urls of a scene that are texts.
class UrlTexts {
  public:
    explicit UrlTexts(const Document& document) {
        const auto visit = [&](const NodePtr& node) {
            for (const Node::SetField& field : node->setFields) add(field.value);
        };
        forEachNode(document.frames, visit);
        for (const CommandFrame& frame : document.frames)
            for (const Command& command : frame.commands)
                std::visit(
                    [&](const auto& c) {
                        if constexpr (requires { c.value; }) add(c.value);
                        if constexpr (requires { c.protos; }) addProtos(c.protos);
                    },
                    command);
    }
    std::set<std::string> found;

  private:
    void add(const FieldValue& value) {
        if (const auto* one = std::get_if<Url>(&value)) found.insert(one->text);
        if (const auto* several = std::get_if<std::vector<Url>>(&value))
            for (const Url& one : *several) found.insert(one.text);
    }
    void addProtos(const std::vector<ProtoPtr>& protos) {
        for (const ProtoPtr& proto : protos) {
            add(proto->urls);
            if (proto->type.defaults)
                for (const FieldValue& value : proto->type.defaults->values) addAll(value);
            addAll(proto->body);
            addProtos(proto->protos);
        }
    }
    void addAll(const FieldValue& value) {
        add(value);
        const auto visit = [&](const NodePtr& node) {
            for (const Node::SetField& field : node->setFields) add(field.value);
        };
        if (const auto* node = std::get_if<NodePtr>(&value)) forEachNode(*node, visit);
        if (const auto* list = std::get_if<NodeList>(&value))
            for (const NodePtr& node : *list) forEachNode(node, visit);
    }
};

}  // namespace

void noteFilesOfUrls(const Document& document, const std::filesystem::path& to, Job& job) {
    if (document.folder.empty()) return;
    std::vector<std::string> lost;
    for (const std::string& name : UrlTexts(document).found) {
        const auto file = resolveInside(document.folder, name, job.limits);
        if (!file) continue;
        std::error_code error;
        if (std::filesystem::equivalent(*file, to / name, error)) continue;
        const auto before = readFile(*file, job.limits), there = readFile(to / name, job.limits);
        if (!before || !there || *before != *there) lost.push_back(name);
    }
    if (lost.empty()) return;
    job.note(fmt::format(
        "urls of the scene name {}, not taken along ('{}'{}); copy {} into '{}', or give the "
        "textures object descriptors",
        counted(lost.size(), "file"), excerpt(lost.front()),
        lost.size() > 1 ? fmt::format(" and {} more", lost.size() - 1) : "",
        lost.size() > 1 ? "them" : "it", to.string()));
}

bool needsTrackFile(const ElementaryStream& stream) {
    if (stream.samples.empty()) return false;
    if (!stream.sampleEntry.empty() || !stream.edits.edits.empty()) return true;
    if (stream.samples.size() > 1) return true;
    const Sample& first = stream.samples.front();
    return !first.sync || first.compositionOffset != 0;
}

Result<void> loadMedia(Document& document, const std::vector<std::filesystem::path>& folders,
                       Job& job) {
    std::size_t files = 0;
    STX_CHECK(forEachStream(document, [&](ElementaryStream& stream, int) -> Result<void> {
        files += stream.samples.size();
        return {};
    }));
    MediaLoader loader(folders, files > kMostOpen, job);
    return forEachStream(
        document, [&](ElementaryStream& stream, int odId) { return loader.load(stream, odId); });
}

void nameTracks(Document& document) {
    bool ours = false;
    forEachNode(document.frames, [&](const NodePtr& node) {
        if (!node->is("WorldInfo")) return;
        const auto& info = node->get<std::vector<std::string>>("info");
        ours = ours || (!info.empty() && info.front() == kMadeByUs);
    });
    if (!ours) return;
    const auto roles = rolesOf(document);
    const auto done = forEachStream(document, [&](ElementaryStream& stream, int odId) {
        const auto role = roles.find(odId);
        if (role == roles.end()) return Result<void>();
        stream.trackName = role->second.view + " " + role->second.field;
        stream.inMovie = role->second.field == "texture";
        return Result<void>();
    });
    (void)done;  // the body never fails
}

std::vector<std::string> mediaFileNames(const Document& document) {
    std::vector<std::string> names;
    std::set<std::string> taken;
    const auto roles = rolesOf(document);
    const auto added =
        forEachStream(document, [&](const ElementaryStream& stream, int odId) -> Result<void> {
            if (stream.samples.empty()) {
                names.emplace_back();
                return {};
            }
            // Another tool's handler name: "*color.jpg@TOOL-VERSION".
            std::string name = stream.fileName.substr(0, stream.fileName.find('@'));
            if (!name.empty() && name[0] == '*') name.erase(0, 1);
            if (const auto slash = name.find_last_of("/\\"); slash != std::string::npos)
                name.erase(0, slash + 1);
            if (const auto percent = name.find('%'); percent != std::string::npos)
                name = name.substr(0, percent) +
                       name.substr(std::min(name.size(), name.find('.', percent)));
            const std::string_view ending = endingOf(stream);
            const auto dot = name.rfind('.');
            const std::string_view own =
                dot == std::string::npos ? "" : std::string_view(name).substr(dot);
            const bool fits = equalNoCase(own, ending) ||
                              (ending == ".jpg" && equalNoCase(own, ".jpeg")) ||
                              (ending == ".bin" && !own.empty());
            if (!isPlainFileName(name) || !fits) {
                const auto role = roles.find(odId);
                name = (role != roles.end() ? role->second.name() : fmt::format("od{}", odId)) +
                       std::string(ending);
            }
            const auto end = name.rfind('.');
            const std::string stem = name.substr(0, end), tail = name.substr(end);
            // Some file systems take A.png and a.png for one.
            const auto key = [](std::string text) {
                for (char& c : text)
                    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
                return text;
            };
            for (int n = 1; !taken.insert(key(name)).second; ++n)
                name = fmt::format("{}_od{}{}{}", stem, odId, n > 1 ? fmt::format("_{}", n) : "",
                                   tail);
            names.push_back(name);
            return {};
        });
    (void)added;  // the body never fails
    return names;
}

std::string mediaFolderName(const std::filesystem::path& text) {
    const std::string stem = text.stem().string();
    const std::string_view whole = stem;
    const auto digit = [&](std::size_t at) {
        return at < whole.size() &&
               ((whole[at] >= '0' && whole[at] <= '9') || (whole[at] >= 'A' && whole[at] <= 'F'));
    };
    std::string name;
    for (std::size_t at = 0; at < whole.size();) {
        const auto [value, bytes] = firstCodePoint(whole.substr(at));
        const bool control = value < 0x20 || value == 0x7f;
        const bool special = value == '%' || value == '#' || value == ':';
        const bool coded = value == '=' && digit(at + 1) && digit(at + 2);
        if (bytes == 0 || control || special || coded)
            name += fmt::format("={:02X}", static_cast<unsigned char>(whole[at++]));
        else {
            name += whole.substr(at, bytes);
            at += bytes;
        }
    }
    const std::string ending = text.extension().string();
    return name + (equalNoCase(ending, ".xmt") ? "_images" : "_images_" + ending.substr(1));
}

}  // namespace stx::mpeg4

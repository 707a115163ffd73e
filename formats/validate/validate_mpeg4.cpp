#include "formats/validate/validate_mpeg4.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "formats/mpeg4/mapping/octree.hpp"
#include "formats/mpeg4/mapping/point_texture.hpp"
#include "formats/mpeg4/mapping/scene_timeline.hpp"
#include "formats/mpeg4/mpeg4.hpp"
#include "formats/mpeg4/scene/events.hpp"
#include "formats/mpeg4/scene/scene_walk.hpp"
#include "formats/validate/findings.hpp"
#include "formats/validate/validate_background.hpp"
#include "formats/validate/validate_moments.hpp"
#include "formats/validate/validate_movies.hpp"
#include "formats/validate/validate_pictures.hpp"

namespace stx {

using namespace mpeg4;

namespace {

class DocumentValidator {
  public:
    DocumentValidator(const Document& document, const ValidateOptions& options,
                      const PresentationImages& source, Job& job)
        : document_(document), options_(options), source_(source), job_(job) {}

    std::vector<Finding> run() {
        checkContainer();
        checkDescriptors();
        checkScene();
        return std::move(findings_.list);
    }

  private:
    void add(int rule, std::string where, std::string found, std::string expected) {
        findings_.add(rule, std::move(where), std::move(found), std::move(expected));
    }

    // ---- Container
    static int ruleOf(Mp4Deviation::Kind kind) {
        using Kind = Mp4Deviation::Kind;
        switch (kind) {
            case Kind::noIods:
                return 2001;
            case Kind::sceneNotInIods:
                return 2002;
            case Kind::imageInSystemsEntry:
                return 2003;
            case Kind::imageInNativeEntry:
                return 2004;
            case Kind::fullEsdInOd:
                return 2005;
            case Kind::mpodMissing:
                return 2006;
            case Kind::streamNotFound:
                return 2007;
            case Kind::streamOdTag:
                return 2008;
            case Kind::noOdTrack:
                return 2009;
            case Kind::esIdNotZero:
                return 2010;
            case Kind::trailingBytes:
                return 2011;
            case Kind::other:
                break;
        }
        return 2012;
    }
    void checkContainer() {
        if (!document_.mp4) return;
        for (const Mp4Deviation& deviation : document_.mp4->deviations) {
            const int rule = ruleOf(deviation.kind);
            // PointTextures, PixelTextures and files beside this one need no descriptors.
            if (rule == 2009 && namedDescriptors().empty()) continue;
            add(rule, deviation.where, deviation.text, findRule(rule)->summary);
        }
    }

    // ---- Descriptors
    void checkDescriptors() {
        std::set<std::uint32_t> esIds;
        const auto checkEsId = [&](const ElementaryStream& stream, const std::string& where) {
            if (stream.esId != 0 && !esIds.insert(stream.esId).second)
                add(2028, where, fmt::format("ES_ID {} a second time", stream.esId),
                    "an ES_ID of its own");
        };
        checkEsId(document_.sceneStream, "scene stream");
        checkEsId(document_.odStream, "OD stream");
        const int oti = document_.sceneStream.objectTypeIndication;
        if (oti != 0 && oti != document_.bifsConfig.version)
            add(2027, "scene stream",
                fmt::format("objectTypeIndication {} with a config of version {}", oti,
                            document_.bifsConfig.version),
                fmt::format("objectTypeIndication {}", document_.bifsConfig.version));

        const std::set<int> named = namedDescriptors();
        ofMovies_ = namedDescriptors("MovieTexture");
        std::set<int> present;
        for (const OdFrame& frame : document_.odFrames) {
            for (const OdCommand& command : frame.commands) {
                const auto* update = std::get_if<UpdateObjectDescriptors>(&command);
                if (!update) continue;
                std::set<int> inUpdate;
                for (const ObjectDescriptor& od : update->descriptors) {
                    if (od.id < 1 || od.id > 1022)
                        add(2021, descriptorText(od.id), fmt::format("the id {}", od.id),
                            "1 to 1022");
                    if (!inUpdate.insert(od.id).second)
                        add(2022, descriptorText(od.id), "the id twice in one update",
                            "each id once");
                    present.insert(od.id);
                    if (od.url.empty() && od.streams.empty())
                        add(2023, descriptorText(od.id), "no stream", "a stream with a picture");
                    for (const ElementaryStream& stream : od.streams) {
                        checkEsId(stream, descriptorText(od.id));
                        checkImageStream(od, stream);
                    }
                }
            }
        }
        for (const int id : named)
            if (!present.contains(id))
                add(2020, descriptorText(id), "no such object descriptor",
                    "one, since the scene names it");
        for (const int id : present)
            if (!named.contains(id))
                add(2024, descriptorText(id), "no node that names it", "a url of a texture");
    }
    /// Object descriptors that some node of the scene, or a command, names; or a node of one type.
    std::set<int> namedDescriptors(std::string_view type = {}) const {
        std::set<int> named;
        // A scene with more nodes than are looked at breaks rule 2031.
        (void)forEachNodeInside(document_.frames, [&](const NodePtr& node) {
            if (!type.empty() && !node->is(type)) return;
            for (const Node::SetField& field : node->setFields) collectUrls(field.value, named);
        });
        if (!type.empty()) return named;
        for (const CommandFrame& frame : document_.frames)
            for (const Command& command : frame.commands)
                std::visit(
                    [&](const auto& c) {
                        if constexpr (requires { c.value; }) collectUrls(c.value, named);
                    },
                    command);
        return named;
    }
    static void collectUrls(const FieldValue& value, std::set<int>& ids) {
        if (const auto* url = std::get_if<Url>(&value); url && url->objectDescriptorId != 0)
            ids.insert(url->objectDescriptorId);
        if (const auto* urls = std::get_if<std::vector<Url>>(&value))
            for (const Url& url : *urls)
                if (url.objectDescriptorId != 0) ids.insert(url.objectDescriptorId);
    }
    /// MPEG-4 Visual, H.264, HEVC, MPEG-2 and MPEG-1 video (ISO/IEC 14496-1 table 5).
    static bool isVideoCoding(int objectTypeIndication) {
        return objectTypeIndication == 0x20 || objectTypeIndication == oti::kAvc ||
               objectTypeIndication == oti::kHevc ||
               (objectTypeIndication >= 0x60 && objectTypeIndication <= 0x65) ||
               objectTypeIndication == 0x6A;
    }
    void checkImageStream(const ObjectDescriptor& od, const ElementaryStream& stream) {
        if (stream.streamType != StreamType::visual && stream.streamType != StreamType::none)
            return;
        if (stream.url.empty() && (stream.samples.empty() || stream.samples[0].data.size == 0)) {
            add(2023, descriptorText(od.id), "a stream without a picture",
                "a JPEG or PNG file in it");
            return;
        }
        if (stream.samples.empty()) return;
        if (stream.objectTypeIndication != oti::kJpeg && stream.objectTypeIndication != oti::kPng) {
            if (!(isVideoCoding(stream.objectTypeIndication) && ofMovies_.contains(od.id)))
                add(2026, descriptorText(od.id),
                    fmt::format("objectTypeIndication 0x{:02X}", stream.objectTypeIndication),
                    "0x6C (JPEG) or 0x6D (PNG)");
            return;
        }
        ByteRange head = stream.samples[0].data;
        head.size = std::min<std::uint64_t>(head.size, 4);
        const auto bytes = head.load(job_.limits);
        if (!bytes || bytes->size() < 3) return;
        const bool jpeg = (*bytes)[0] == std::byte{0xFF} && (*bytes)[1] == std::byte{0xD8};
        const bool png = (*bytes)[0] == std::byte{0x89} && (*bytes)[1] == std::byte{'P'};
        const bool saysJpeg = stream.objectTypeIndication == oti::kJpeg;
        if ((saysJpeg && !jpeg) || (!saysJpeg && !png))
            add(2025, descriptorText(od.id),
                jpeg  ? "a JPEG"
                : png ? "a PNG"
                      : "neither JPEG nor PNG",
                saysJpeg ? "a JPEG (0x6C)" : "a PNG (0x6D)");
    }

    // ---- Scene
    void checkScene() {
        const bool hasScene =
            !document_.frames.empty() && !document_.frames[0].commands.empty() &&
            std::holds_alternative<ReplaceScene>(document_.frames[0].commands[0]) &&
            std::get<ReplaceScene>(document_.frames[0].commands[0]).root;
        if (!hasScene) {
            add(2030, "scene", "no scene in the first command",
                "a command that replaces the scene");
            return;
        }
        for (const std::string& broken : brokenKeys(document_.frames))
            add(2033, "scene", broken, "a key for each keyValue, in ascending order");
        if (const auto last = composeScene(document_.frames); !last)
            add(2031, "scene", last.error().text(), "commands that fit");
        auto images = StreamImages::make(document_, source_.folder, job_.limits);
        if (!images) return;
        images_ = &*images;
        const auto scene = sceneAtStart(document_, *images, false);
        if (!scene) return;
        const auto shown = shownScene(scene->root, job_.limits);
        if (!shown) {
            add(2031, "scene", shown.error().text(), "a scene that can be walked");
            return;
        }
        int index = 0;
        for (const ShownNode& node : shown->nodes) {
            const auto world = similarityFrom(node.worldFromLocal);
            const std::string where = nameOf(*node.node, index);
            if (!world) add(3006, where, world.error().message, "one scale above 0 for all axes");
            if (node.node->is("OctreeImage")) {
                checkOctree(*node.node, where);
                for (const NodePtr& image : node.node->get<NodeList>("images"))
                    if (image) checkDepthImage(*image, nameOf(*image, index++), true);
            } else {
                checkDepthImage(*node.node, where, false);
                ++index;
            }
        }
        checkBackgrounds(shown->backgrounds, pictures());
        checkMasks(shown->infos, pictures());
        // A place without an object is a scene, too.
        if (index == 0 && shown->backgrounds.empty())
            add(4014, "scene", "no DepthImage that is shown", "one at least");
        checkObject(*shown);
        if (options_.pixels && decoded_ > 0 && decoded_ == emptyViews_)
            add(4007, "scene", "no point in any view", "points (depth codes above 0)");
    }
    PictureReader pictures() {
        return {*images_, source_.decode, options_, job_.limits, findings_};
    }
    static std::string nameOf(const Node& node, int index) {
        const std::string kind = node.is("OctreeImage") ? "OctreeImage" : "view";
        return node.defName.empty() ? fmt::format("{} {}", kind, index)
                                    : fmt::format("{} {} '{}'", kind, index, node.defName);
    }

    void checkObject(const ShownScene& shown) {
        std::map<int, int> perGroup;
        std::set<std::pair<const Node*, std::string>> places;
        for (const ShownNode& node : shown.nodes) {
            if (!node.node->is("OctreeImage")) ++perGroup[node.parent];
            std::string place;
            for (int c = 0; c < 4; ++c)
                for (int r = 0; r < 4; ++r) place += fmt::format("{} ", node.worldFromLocal[c][r]);
            if (!places.insert({node.node.get(), place}).second)
                add(4021, nameOf(*node.node, 0), "the same node twice in one place", "it once");
        }
        bool oneEach = perGroup.size() > 1;
        for (const auto& [group, count] : perGroup) oneEach = oneEach && count == 1;
        if (oneEach)
            add(4020, "scene",
                fmt::format("{} grouping nodes with one DepthImage each", perGroup.size()),
                "the views of an object together under one (points of one group are united)");
    }

    void checkOctree(const Node& node, const std::string& where) {
        const auto octree = Octree::parse(node.get<std::vector<std::int32_t>>("octree"),
                                          node.get<std::int32_t>("octreeResolution"), job_.limits);
        if (!octree) {
            add(4013, where, octree.error().message, "a whole octree");
        } else if (octree->unusedBytes() > 0) {
            add(4013, where, fmt::format("{} bytes behind the octree", octree->unusedBytes()),
                "none");
        }
        for (const NodePtr& image : node.get<NodeList>("images"))
            if (image && !image->get<bool>("orthographic"))
                add(4013, where, "an image with orthographic FALSE", "orthographic images");
    }

    void checkCamera(const Node& node, const std::string& where, bool inOctree) {
        const auto position = node.get<glm::vec3>("position");
        const auto orientation = node.get<Rotation>("orientation");
        const auto fov = node.get<glm::vec2>("fieldOfView");
        const float nearPlane = node.get<float>("nearPlane"),
                    farPlane = node.get<float>("farPlane");
        bool finite = true;
        for (const float v :
             {position.x, position.y, position.z, orientation.axis.x, orientation.axis.y,
              orientation.axis.z, orientation.angle, fov.x, fov.y, nearPlane, farPlane})
            finite = finite && std::isfinite(v);
        if (!finite) {
            add(3005, where, "a value that is not finite in its camera", "finite numbers");
            return;
        }
        const bool orthographic = node.get<bool>("orthographic");
        if (!inOctree) {  // there, depth is not used
            if (!(nearPlane < farPlane))
                add(3001, where, fmt::format("nearPlane {} and farPlane {}", nearPlane, farPlane),
                    "nearPlane < farPlane");
            if (nearPlane < 0)
                add(3002, where, fmt::format("nearPlane {}", nearPlane), "0 or more");
            if (nearPlane == 0 && !orthographic) add(3007, where, "nearPlane 0", "more than 0");
        }
        const float highest = orthographic ? std::numeric_limits<float>::max() : 3.1415927f;
        if (!(fov.x > 0 && fov.y > 0 && fov.x < highest && fov.y < highest))
            add(3003, where,
                fmt::format("fieldOfView {} {} with orthographic {}", fov.x, fov.y, orthographic),
                orthographic ? "sides above 0" : "angles between 0 and 3.1415927");
        const float length = glm::length(orientation.axis);
        if (std::abs(length - 1.0f) > 1e-3f && orientation.angle != 0)
            add(3004, where, fmt::format("an axis of length {:.6g} in orientation", length),
                "length 1");
        if (!inOctree && !node.isSet("orthographic") && !node.isSet("fieldOfView"))
            add(3008, where,
                fmt::format("orthographic TRUE and fieldOfView {} {} by default", fov.x, fov.y),
                "one of them given");
    }

    void checkDepthImage(const Node& node, const std::string& where, bool inOctree) {
        checkCamera(node, where, inOctree);
        const NodePtr& texture = node.get<NodePtr>("diTexture");
        if (!texture) {
            add(4009, where, "diTexture NULL", "a SimpleTexture or PointTexture");
            return;
        }
        if (texture->info->find("depthNbBits") >= 0) {
            checkPointTexture(node, *texture, where);
        } else {
            checkSimpleTexture(node, *texture, where, inOctree);
            checkMovies(*texture, *images_, where, job_.limits, findings_);
        }
    }

    void checkPointTexture(const Node& node, const Node& texture, const std::string& where) {
        ReferenceView view;
        view.nearPlane = node.get<float>("nearPlane");
        view.farPlane = node.get<float>("farPlane");
        if (texture.get<std::vector<std::int32_t>>("depth").empty()) {
            add(4009, where, "a PointTexture without points", "points");
            return;
        }
        const auto views = viewsFromPointTexture(texture, view, job_.limits);
        if (!views) {
            add(4012, where, views.error().message, "lists that fit");
            return;
        }
        ++decoded_;
        std::int64_t points = 0;
        for (const ReferenceView& layer : *views) points += layer.pointCount();
        if (points == 0) countEmpty(where);
    }
    void countEmpty(const std::string& where) {
        ++emptyViews_;
        add(4006, where, "no point (all depth codes are 0)", "one point at least");
    }

    void checkSimpleTexture(const Node& node, const Node& texture, const std::string& where,
                            bool inOctree) {
        const NodePtr& colour = texture.get<NodePtr>("texture");
        const NodePtr& depth = texture.get<NodePtr>("depth");
        if (!colour && !depth) {
            add(4009, where, "a texture without images", "texture and depth");
            return;
        }
        if (inOctree && !colour)
            add(4013, where, "an image without texture", "one, since depth is not used");
        const auto colourInfo = colour ? pictures().probe(*colour, "texture", where) : std::nullopt;
        const auto depthInfo = depth ? pictures().probe(*depth, "depth", where) : std::nullopt;
        const bool hasAlpha =
            colourInfo && (colourInfo->channels == 2 || colourInfo->channels == 4);
        if (!depth && !inOctree && colourInfo && !hasAlpha)
            add(4003, where,
                fmt::format("depth NULL and a texture with {} channels", colourInfo->channels),
                "a depth image, or alpha");
        if (depthInfo) {
            if (colourInfo &&
                (colourInfo->width != depthInfo->width || colourInfo->height != depthInfo->height))
                add(4001, where,
                    fmt::format("depth {} and texture {}",
                                sizeText(depthInfo->width, depthInfo->height),
                                sizeText(colourInfo->width, colourInfo->height)),
                    "one size");
            if (depthInfo->format == "jpeg" && !inOctree) add(4004, where, "depth as JPEG", "PNG");
            if (depthInfo->channels >= 3)
                add(4002, where, fmt::format("a depth image with {} channels", depthInfo->channels),
                    "1");
            if (depthInfo->channels == 2) add(4008, where, "a depth image with alpha", "grey only");
            if (depthInfo->bits != 8 && depthInfo->bits != 16)
                add(4011, where, fmt::format("depth of {} bits", depthInfo->bits), "8 or 16");
        }
        const auto& size = depthInfo ? depthInfo : colourInfo;
        checkVectorImages(node, texture, where, size);
        const auto highest = checkViewPixels(node, texture, where, inOctree, pictures());
        if (!highest) return;
        ++decoded_;
        // A camera of a film may begin later, or what it sees come into its picture.
        if (*highest == 0 && !anyPointLater(texture, pictures(), job_)) countEmpty(where);
    }

    void checkVectorImages(const Node& node, const Node& texture, const std::string& where,
                           const std::optional<ImageInfo>& size) {
        if (!texture.is("SimpleTextureV2")) return;
        for (const char* field : {"normal", "splatU", "splatV"}) {
            const NodePtr& image = texture.get<NodePtr>(field);
            const auto info = image ? pictures().probe(*image, field, where) : std::nullopt;
            if (!info) continue;
            if (size && (info->width != size->width || info->height != size->height))
                add(6001, where,
                    fmt::format("{} {} and depth {}", field, sizeText(info->width, info->height),
                                sizeText(size->width, size->height)),
                    "one size");
            if (info->channels < 3)
                add(6002, where, fmt::format("{} with {} channel(s)", field, info->channels),
                    "RGB");
        }
        const bool u = texture.get<NodePtr>("splatU") != nullptr,
                   v = texture.get<NodePtr>("splatV") != nullptr;
        if (u != v)
            add(6003, where, u ? "splatU without splatV" : "splatV without splatU",
                "both or neither");
        if (!u && !v) return;
        const int minMax = node.info->find("splatMinMax");
        if (minMax < 0) {
            add(6006, where, "splats in a DepthImage, which has no splatMinMax", "a DepthImageV2");
            return;
        }
        if (!node.isSet(minMax))
            add(6004, where, "splatMinMax by default", "the range of the splats");
        const glm::vec2 range = std::get<glm::vec2>(node.value(minMax));
        if (!(range.x < range.y) || !std::isfinite(range.x) || !std::isfinite(range.y))
            add(6005, where, fmt::format("splatMinMax {} {}", range.x, range.y), "a range");
    }

    const Document& document_;
    const ValidateOptions& options_;
    const PresentationImages& source_;
    Job& job_;
    Findings findings_;
    const StreamImages* images_ = nullptr;
    std::set<int> ofMovies_;  ///< object descriptors that a MovieTexture names
    int decoded_ = 0;
    int emptyViews_ = 0;
};

}  // namespace

std::vector<Finding> validate(const Mpeg4Document& document, const ValidateOptions& options,
                              const PresentationImages& images, Job& job) {
    Findings findings;
    findings.list = DocumentValidator(document, options, images, job).run();
    const bool sound = std::ranges::none_of(
        findings.list, [](const Finding& f) { return f.rule->severity == Rule::Severity::error; });
    if (options.pixels && sound && changesLater(document))
        checkLaterMoments(document, images.folder, findings, job);
    return findings.list;
}

Result<std::vector<Finding>> validateMpeg4File(const std::filesystem::path& path,
                                               const ValidateOptions& options, Job& job) {
    PresentationImages images;
    images.folder = folderOf(path);
    const auto document = readMpeg4(path, job);
    Findings findings;
    if (!document) {
        // A file that a text names may be missing; only the text itself must be there.
        Error error = document.error();
        if (error.code == ErrorCode::io && (path == "-" || ByteSource::open(path)))
            error.code = ErrorCode::invalidInput;
        return unreadable(error);
    }
    if (path != "-") {
        const auto source = ByteSource::open(path);
        Bytes head(source ? static_cast<std::size_t>(std::min<std::uint64_t>(source->size(), 4096))
                          : 0);
        if (source && source->read(0, head)) {
            const auto content = mpeg4ContainerOf(ByteSpan(head)), ending = mpeg4ContainerOf(path);
            if (content && ending && *content != *ending)
                findings.add(1002, "", fmt::format("the ending '{}'", path.extension().string()),
                             *content == Mpeg4Container::mp4  ? ".mp4"
                             : *content == Mpeg4Container::bt ? ".bt"
                                                              : ".xmt");
        }
    }
    auto rest = validate(*document, options, images, job);
    findings.list.insert(findings.list.end(), rest.begin(), rest.end());
    return findings.list;
}

}  // namespace stx

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "formats/mpeg4/mapping/background.hpp"
#include "formats/mpeg4/mapping/mapping.hpp"
#include "formats/mpeg4/mapping/new_document.hpp"
#include "formats/mpeg4/mapping/octree_write.hpp"
#include "formats/mpeg4/mapping/picture_spool.hpp"
#include "formats/mpeg4/mapping/point_texture.hpp"
#include "formats/mpeg4/mapping/texture_images.hpp"
#include "formats/mpeg4/mapping/view_images.hpp"
#include "formats/mpeg4/mapping/view_notes.hpp"
#include "formats/mpeg4/text/text_fields.hpp"
#include "lib/base/parallel.hpp"
#include "lib/base/unique_names.hpp"

namespace stx::mpeg4 {
namespace {

class SceneWriter {
  public:
    /// Pictures go into `spool`, if any. PointTexture and OctreeImage are made of a whole table.
    SceneWriter(const ViewTable& table, const SceneWriteOptions& options, PictureSpool* spool,
                Job& job)
        : table_(table), bundle_(table.about()), options_(options), spool_(spool), job_(job) {}

    Result<Document> write() {
        STX_CHECK(checkRequest());
        ViewNotes notes;
        if (bundle_.origin != glm::dvec3(0.0)) notes.origin = bundle_.origin;
        // A presentation begins at 0: players would wait for 40 years where a film begins at Unix
        // time, edit lists cannot begin before 0, and texts have none.
        if (bundle_.time.value_or(0) != 0) notes.start = bundle_.time;
        notes.duration = bundle_.duration;
        NodePtr root;
        if (options_.octreeLevels > 0) {
            bounds_ = bundle_.bounds ? *bundle_.bounds : bundle_.computeBounds();
            STX_TRY(root, octreeGroup(notes));
        } else {
            STX_TRY(auto children, depthImages(notes));
            notes.bounds = bounds_;
            root = groupOf(std::move(children), notes);
        }
        if (bundle_.environment) {
            STX_TRY(NodePtr background,
                    backgroundFromEnvironment(*bundle_.environment, options_, update_, job_));
            root->edit<NodeList>("children").push_back(std::move(background));
        }
        addNavigation(*root);

        const Camera& first = bundle_.views[0].camera;
        return newDocument(std::move(root), std::move(update_),
                           {std::min(first.width, 65535), std::min(first.height, 65535)});
    }

  private:
    [[nodiscard]] std::string viewName(std::size_t i) const {
        return fmt::format("view {} '{}'", i, bundle_.views[i].name);
    }
    [[nodiscard]] bool isV2(const ReferenceView& view) const {
        return isWrittenAsV2(view, options_);
    }
    [[nodiscard]] int bitsOf(const ReferenceView& view) const {
        return writtenDepthBits(view, options_);
    }

    /// Encodes the views when they come, and adds up their bounds where the bundle has none.
    Result<NodeList> depthImages(ViewNotes& notes) {
        const std::size_t count = table_.count();
        std::vector<std::shared_ptr<const ReferenceView>> views(count);
        std::vector<ViewImages> images(count);
        std::vector<Bounds> bounds(count);
        const bool vectors = std::ranges::any_of(
            table_.kinds(), [](const auto& kinds) { return kinds.normal || kinds.hasSplats(); });
        NodeList children;
        const auto encode = [&](std::size_t i,
                                std::shared_ptr<const ReferenceView> view) -> Result<void> {
            STX_TRY(images[i], within(viewName(i), encodeView(*view, options_, job_.limits,
                                                              i < options_.splatRanges.size()
                                                                  ? options_.splatRanges[i]
                                                                  : 0)));
            if (!bundle_.bounds) bounds[i] = view->computeBounds();
            views[i] = std::move(view);
            return {};
        };
        const auto add = [&](std::size_t i) -> Result<void> {
            if (options_.pointTexture) return {};  // a node may have several
            STX_CHECK(addDepthImage(i, {&views[i], 1}, {&images[i], 1}, children, notes));
            views[i].reset();
            images[i] = {};
            return {};
        };
        STX_CHECK(
            forEachView(table_, vectors ? peak::kMpeg4Vectors : peak::kMpeg4, job_, encode, add));
        for (std::size_t i = 0; options_.pointTexture && i < count;) {
            const std::size_t layers = layersFrom(i);
            STX_CHECK(addDepthImage(i, {&views[i], layers}, {&images[i], layers}, children, notes));
            i += layers;
        }
        bounds_ = bundle_.bounds.value_or(Bounds());
        for (const Bounds& one : bounds) {
            if (one.empty()) continue;
            bounds_.add(one.min);
            bounds_.add(one.max);
        }
        sayTotals();
        notes.count = static_cast<int>(children.size());
        return children;
    }

    /// Of view `i`, or with the layers of the PointTexture that begins there.
    Result<void> addDepthImage(std::size_t i,
                               std::span<const std::shared_ptr<const ReferenceView>> views,
                               std::span<ViewImages> images, NodeList& children, ViewNotes& notes) {
        const std::string key = ViewNotes::keyOf(children.size());
        STX_TRY(NodePtr node, depthImage(i, views, images[0], key, notes));
        children.push_back(std::move(node));
        for (std::size_t k = 0; k < views.size(); ++k) {
            const ReferenceView& view = *views[k];
            sayWhatIsLost(i + k, view, images[k]);
            const bool unknown = view.noDepth == NoDepth::unknown;
            if (!view.pruned && !unknown && !view.background && view.refined.steps.empty())
                continue;
            ViewNotes::Layer& of = notes.views[key].layers[static_cast<int>(k)];
            if (view.pruned) of.pruned = images[k].unknown;
            if (unknown)
                of.unknown = options_.unknownWhere.empty() ? images[k].unknown
                                                           : options_.unknownWhere[i + k];
            of.background = view.background;
            of.refined = view.refined;
        }
        return {};
    }

    /// Group { WorldInfo, children }.
    NodePtr groupOf(NodeList children, const ViewNotes& notes, const char* type = "Group") const {
        NodePtr worldInfo = makeNode("WorldInfo");
        worldInfo->set("title", bundle_.title);
        std::vector<std::string> info = notes.text();
        info.insert(info.begin(), kMadeByUs);
        worldInfo->set("info", std::move(info));
        children.insert(children.begin(), worldInfo);
        NodePtr group = makeNode(type);
        group->set("children", std::move(children));
        return group;
    }

    /// For players: the whole object in sight from the side of the first view, and turned around
    /// it.
    void addNavigation(Node& root) const {
        if (bounds_.empty()) return;
        NodePtr viewpoint = makeNode("Viewpoint");
        const double angle = viewpoint->get<float>("fieldOfView");
        const double radius = bounds_.radius() > 0 ? bounds_.radius() : 1e-6;
        const double away = radius / std::sin(angle / 2);
        // From the rounded orientation: a bundle that was read gives the same bytes again.
        const glm::vec4 turn(axisAngleFromQuat(bundle_.views[0].camera.orientation));
        const glm::dvec3 back = quatFromAxisAngle(glm::dvec4(turn)) * glm::dvec3(0, 0, 1);
        viewpoint->set("position", glm::vec3(bounds_.centre() + back * away));
        viewpoint->set("orientation", Rotation{glm::vec3(turn), turn.w});
        viewpoint->set("description", std::string("all"));
        NodePtr navigation = makeNode("NavigationInfo");
        navigation->set("type", std::vector<std::string>{"EXAMINE", "ANY"});
        navigation->set("headlight", false);
        NodeList children = root.get<NodeList>("children");
        children.push_back(viewpoint);
        children.push_back(navigation);
        root.set("children", std::move(children));
    }

    /// The WorldInfo is in the frame of the octree's cube, so that its bounds follow it; that of
    /// the origin is outside, where nothing scales it.
    Result<NodePtr> octreeGroup(ViewNotes& notes) {
        STX_TRY(auto parts, octreeFromBundle(bundle_, options_.octreeLevels, job_));
        NodePtr octree = makeNode("OctreeImage");
        octree->defName = names_.take("octree");
        octree->set("octreeResolution", parts.resolution);
        octree->set("octree", std::move(parts.octree));
        NodeList images;
        for (std::size_t i = 0; i < parts.pictures.size(); ++i) {
            STX_TRY(auto image, within(viewName(i), octreePicture(i, parts.pictures[i],
                                                                  ViewNotes::keyOf(i), notes)));
            images.push_back(std::move(image));
        }
        notes.count = static_cast<int>(images.size());
        octree->set("images", std::move(images));
        job_.note(fmt::format("depth is rounded to {} voxels of {:.4g} scene units on a side",
                              parts.voxels, parts.side / parts.resolution));
        for (const ReferenceView& view : bundle_.views)
            vectorsLost_ = vectorsLost_ || view.hasNormals() || view.hasSplats();
        if (vectorsLost_) job_.note("an OctreeImage has no normals and splats: they are left out");
        if (std::ranges::any_of(bundle_.views, &ReferenceView::background))
            job_.note(
                "an OctreeImage has no background: what was behind becomes part of the object");
        notes.bounds = parts.used;
        sayTotals();
        if (parts.isUnitCube()) return groupOf({octree}, notes);
        notes.bounds->min = (notes.bounds->min - parts.centre) / parts.side;
        notes.bounds->max = (notes.bounds->max - parts.centre) / parts.side;
        ViewNotes outside;
        outside.origin = std::exchange(notes.origin, {});
        NodePtr transform = groupOf({octree}, notes, "Transform");
        transform->set("translation", glm::vec3(parts.centre));
        transform->set("scale", glm::vec3(static_cast<float>(parts.side)));
        if (outside.origin) return groupOf({transform}, outside);
        NodePtr group = makeNode("Group");
        group->set("children", NodeList{transform});
        return group;
    }
    Result<NodePtr> octreePicture(std::size_t i, const OctreeParts::Picture& picture,
                                  const std::string& key, ViewNotes& notes) {
        STX_TRY(const auto padding,
                centringPadding(picture.camera, std::min(job_.limits.maxImageSide, 65535)));
        const Rgba8Image colour = padded(picture.colour, padding);
        Bytes bytes;
        if (options_.texture == SceneWriteOptions::Texture::jpeg)
            STX_SET(bytes, colourJpeg(colour, options_.jpegQuality));
        else
            STX_SET(bytes, colourPng(colour, false));
        NodePtr node = makeNode("DepthImage");
        node->defName = defNameOf(bundle_.views[i], i, key, notes);
        STX_CHECK(within(viewName(i), setCamera(*node, padding.camera)));
        node->set("orthographic", true);
        NodePtr texture = makeNode("SimpleTexture");
        STX_TRY(NodePtr image, textureNode(node->defName, "texture", std::move(bytes)));
        texture->set("texture", std::move(image));
        node->set("diTexture", texture);
        return node;
    }

    Result<void> checkRequest() const {
        if (options_.jpegQuality < 1 || options_.jpegQuality > 100)
            return fail(ErrorCode::usage, "the JPEG quality is {}; 1 to 100 is possible",
                        options_.jpegQuality);
        if (options_.h264 < -1 || options_.h264 > 51)
            return fail(ErrorCode::usage, "the quality of H.264 is {}; 0 to 51 is possible",
                        options_.h264);
        if (options_.depthBits != 0 && options_.depthBits != 8 && options_.depthBits != 16)
            return fail(ErrorCode::usage,
                        "depth of {} bits has no place in MPEG-4; 8 or 16 is possible",
                        options_.depthBits);
        if (options_.normalBits != 8 && options_.normalBits != 16)
            return fail(ErrorCode::usage, "normals of {} bits are not possible; 8 or 16",
                        options_.normalBits);
        if (table_.whole()) STX_CHECK(bundle_.checkHeaders());
        if (options_.pointTexture && options_.octreeLevels > 0)
            return fail(ErrorCode::usage,
                        "PointTexture and OctreeImage are both asked for; only one is possible");
        if (options_.octreeLevels < 0 || options_.octreeLevels > kMaxOctreeLevels)
            return fail(ErrorCode::usage, "an octree of {} levels; 1 to {} are possible",
                        options_.octreeLevels, kMaxOctreeLevels);
        if (options_.pointTexture) return {};
        std::size_t count = 0;
        for (const ViewImageKinds& kinds : table_.kinds()) {
            count += options_.octreeLevels > 0 ? 1 : 2;
            if (options_.octreeLevels == 0 && options_.nodes != SceneWriteOptions::Nodes::v1)
                count += (kinds.normal ? 1u : 0u) + (kinds.hasSplats() ? 2u : 0u);
        }
        if (count > kLastImageOd - kFirstImageOd + 1)
            return fail(ErrorCode::unsupported,
                        "the bundle has {} views with {} images; MPEG-4 has object descriptors for "
                        "{} images "
                        "(select fewer views, or write .exr)",
                        bundle_.views.size(), count, kLastImageOd - kFirstImageOd + 1);
        return {};
    }

    /// Views from `first` on that one PointTexture can hold.
    [[nodiscard]] std::size_t layersFrom(std::size_t first) const {
        std::size_t n = 1;
        while (first + n < bundle_.views.size() &&
               isLayerOf(bundle_.views[first + n], bundle_.views[first], n))
            ++n;
        return n;
    }

    /// A name that every text form can hold, and that no other view has.
    std::string defNameOf(const ReferenceView& view, std::size_t i, const std::string& key,
                          ViewNotes& notes) {
        std::string defName = view.name;
        for (char& c : defName)
            if (!isPlainName(std::string("a") + c)) c = '_';
        // N12 would be taken for a number.
        if (!isPlainName(defName) || idFromTextName(defName, 'N') != 0) defName = "view_" + defName;
        if (view.name.empty()) defName = fmt::format("view{}", i);
        defName = names_.take(defName);
        if (defName != view.name && !view.name.empty()) notes.views[key].name = view.name;
        return defName;
    }

    /// A texture node with a stream of its own behind it.
    Result<NodePtr> textureNode(const std::string& defName, const char* role, Bytes bytes) {
        STX_TRY(const Url url, addPictureStream(update_, fmt::format("{}_{}", defName, role),
                                                std::move(bytes), spool_));
        NodePtr node = makeNode("ImageTexture");
        node->set("url", std::vector{url});
        // Outside of the window there is nothing to repeat.
        node->set("repeatS", false);
        node->set("repeatT", false);
        return node;
    }

    Result<NodePtr> depthImage(std::size_t i,
                               std::span<const std::shared_ptr<const ReferenceView>> layers,
                               ViewImages& images, const std::string& key, ViewNotes& notes) {
        const ReferenceView& view = *layers[0];
        const bool v2 = isV2(view);
        NodePtr node = makeNode(v2 ? "DepthImageV2" : "DepthImage");
        node->defName = defNameOf(view, i, key, notes);
        STX_CHECK(within(viewName(i), setCamera(*node, images.padding.camera)));
        node->set("nearPlane", images.nearPlane);
        node->set("farPlane", images.farPlane);
        node->set("orthographic", images.padding.camera.orthographic);
        if (v2) {
            const glm::vec2 range = view.hasSplats() && !options_.pointTexture
                                        ? glm::vec2(-images.longestSplat, images.longestSplat)
                                        : std::get<glm::vec2>(node->value("splatMinMax"));
            node->set("splatMinMax", range);
        }
        if (options_.pointTexture) {
            std::vector<const ReferenceView*> list;
            for (const auto& layer : layers) list.push_back(layer.get());
            const int bits = bitsOf(view);
            const DepthCode code{images.nearPlane, images.farPlane, bits == 8 ? 255u : 65535u};
            node->set("diTexture", paddedPointTexture(list, images.padding, code, bits, v2));
        } else {
            NodePtr texture = makeNode(v2 ? "SimpleTextureV2" : "SimpleTexture");
            struct Role {
                const char* name;
                Bytes* bytes;
            };
            for (const auto& [name, bytes] :
                 {Role{"texture", &images.texture}, Role{"depth", &images.depth},
                  Role{"normal", &images.normal}, Role{"splatU", &images.splatU},
                  Role{"splatV", &images.splatV}}) {
                if (bytes->empty()) continue;
                STX_TRY(NodePtr picture, textureNode(node->defName, name, std::move(*bytes)));
                texture->set(std::string_view(name), std::move(picture));
            }
            node->set("diTexture", texture);
        }
        if (!view.camera.orthographic && !view.camera.centred(0.0)) {
            const Padding& p = images.padding;
            notes.views[key].padding = {p.left,   p.top,          p.right,
                                        p.bottom, view.camera.cx, view.camera.cy};
        }
        return node;
    }

    static NodePtr paddedPointTexture(const std::vector<const ReferenceView*>& layers,
                                      const Padding& padding, const DepthCode& code, int bits,
                                      bool v2) {
        NodePtr node = pointTextureFromViews(layers, code, bits, v2);
        if (!padding.any()) return node;
        // Pixels without a point are a count of 0 each; colours and vectors stay as they are.
        const int width = layers[0]->depth.width(), height = layers[0]->depth.height();
        const auto& counts = node->get<std::vector<std::int32_t>>("depth");
        const int wide = width + padding.left + padding.right;
        std::vector<std::int32_t> out(static_cast<std::size_t>(wide) * padding.bottom, 0);
        std::size_t at = 0;
        for (int y = 0; y < height; ++y) {
            out.insert(out.end(), static_cast<std::size_t>(padding.left), 0);
            for (int x = 0; x < width; ++x) {
                const auto n = static_cast<std::size_t>(counts[at]) + 1;
                out.insert(out.end(), counts.begin() + static_cast<std::ptrdiff_t>(at),
                           counts.begin() + static_cast<std::ptrdiff_t>(at + n));
                at += n;
            }
            out.insert(out.end(), static_cast<std::size_t>(padding.right), 0);
        }
        out.insert(out.end(), static_cast<std::size_t>(wide) * padding.top, 0);
        node->set("width", wide);
        node->set("height", height + padding.top + padding.bottom);
        node->set("depth", std::move(out));
        return node;
    }

    void sayWhatIsLost(std::size_t i, const ReferenceView& view, const ViewImages& images) {
        const Padding& p = images.padding;
        if (!p.any() && p.shift > 1e-6)
            job_.note(
                fmt::format("{}: its principal point is {:.3g} pixels off the centre, to "
                            "which it is moved",
                            viewName(i), p.shift));
        if (p.any())
            job_.note(fmt::format(
                "{}: its principal point is off the centre; padded by {} {} {} {} pixels (left, "
                "top, right, bottom), the rest of {:.3g} pixels is moved",
                viewName(i), p.left, p.top, p.right, p.bottom, p.shift));
        (options_.loss ? *options_.loss : loss_).add(i, view, bitsOf(view), images);
        unmeasuredLost_ = unmeasuredLost_ || images.unmeasuredLost;
        dropped_ = dropped_ || (!isV2(view) && (view.hasNormals() || view.hasSplats()));
    }
    void sayTotals() {
        // An OctreeImage has colours, too, and no pictures to be added.
        loss_.linear = loss_.linear || table_.kindsOf(0).linear;
        if (!options_.loss) loss_.note(options_, job_);
        if (unmeasuredLost_)
            job_.note(
                "a PointTexture has points only: colours without a depth are lost; a DepthImage "
                "keeps them");
        if (dropped_) job_.note("SimpleTexture (V1) has no normals and splats: they are left out");
    }

    const ViewTable& table_;
    const Bundle& bundle_;
    const SceneWriteOptions& options_;
    PictureSpool* spool_;
    Job& job_;
    UpdateObjectDescriptors update_;
    Bounds bounds_;
    UniqueNames names_{"_", 1};
    PictureLoss loss_;
    bool dropped_ = false, vectorsLost_ = false, unmeasuredLost_ = false;
};

}  // namespace

Result<Document> sceneFromBundle(const Bundle& bundle, const SceneWriteOptions& options, Job& job) {
    return sceneFromViews(*viewsOf(bundle), options, nullptr, job);
}

void noteOrigin(const glm::dvec3& origin, const Bundle& before, Job& job) {
    if (origin == before.origin) return;
    job.note(
        fmt::format("the coordinates are too large for 32-bit floats: the origin {} {} {} is "
                    "subtracted before they are rounded, and kept beside them",
                    origin.x, origin.y, origin.z));
}

Result<Document> sceneFromViews(const ViewTable& table, const SceneWriteOptions& options,
                                PictureSpool* spool, Job& job) {
    if ((options.pointTexture || options.octreeLevels > 0) && !table.whole()) {
        STX_TRY(const auto whole, wholeBundle(table, job));
        return sceneFromBundle(whole, options, job);
    }
    noteMaterialLeftOut(table, job);
    STX_TRY(auto document, SceneWriter(table, options, spool, job).write());
    if (!spool) return document;
    STX_TRY(const ByteSource source, spool->source());
    for (OdFrame& frame : document.odFrames)
        for (OdCommand& command : frame.commands)
            if (auto* update = std::get_if<UpdateObjectDescriptors>(&command))
                for (ObjectDescriptor& od : update->descriptors)
                    for (Sample& sample : od.streams.front().samples)
                        // Those of the environment are in memory.
                        if (sample.data.source.size() == 0) sample.data.source = source;
    return document;
}

}  // namespace stx::mpeg4

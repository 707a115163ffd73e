#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <unordered_map>
#include <unordered_set>

#include "formats/mpeg4/mapping/background.hpp"
#include "formats/mpeg4/mapping/mapping.hpp"
#include "formats/mpeg4/mapping/octree.hpp"
#include "formats/mpeg4/mapping/point_texture.hpp"
#include "formats/mpeg4/mapping/scene_sequence.hpp"
#include "formats/mpeg4/mapping/stream_images.hpp"
#include "formats/mpeg4/mapping/texture_images.hpp"
#include "formats/mpeg4/mapping/view_notes.hpp"
#include "formats/mpeg4/scene/scene_walk.hpp"
#include "lib/base/parallel.hpp"

namespace stx::mpeg4 {
namespace {

/// Appended to what is said of things that move.
constexpr const char* kOthers = " (stx render --time and --times show the rest)";

/// A view before its pixels are there.
struct Plan {
    NodePtr depthImage;
    NodePtr texture;  ///< SimpleTexture(V2) or PointTexture(V2)
    Similarity worldFromLocal;
    std::string name;
    std::string key;         ///< in ViewNotes::views
    int parent = 0;          ///< ShownNode::parent
    std::size_t number = 0;  ///< among the views of that parent, with those that are left out
    const Octree* octree = nullptr;  ///< gives the depth, instead of the depth image
};

class BundleReader {
  public:
    BundleReader(const Document& document, const SceneReadOptions& options, Job& job)
        : document_(document), options_(options), job_(job) {}

    /// The object as a scene has it. With `still`, says what moves: the moment is all that is read.
    Result<Bundle> read(const Scene& scene, const StreamImages& images, bool still) {
        STX_TRY(const auto shown, shownScene(scene.root, job_.limits));
        if (!shown.leftOut.empty())
            job_.note(fmt::format("the scene has nodes that are no views; they are left out: {}",
                                  fmt::join(shown.leftOut, ", ")));
        if (!shown.asGroups.empty())
            job_.note(fmt::format(
                "nodes that place or choose their children by themselves are read as Group: {}",
                fmt::join(shown.asGroups, ", ")));
        STX_TRY(auto plans, makePlans(shown));
        const ViewNotes notes = notesOf(shown, plans);
        if (plans.empty() && options_.mayBeEmpty) {
            Bundle nothing;
            nothing.title = shown.title;
            return nothing;
        }
        if (still && options_.noteMotion) noteMotion(scene, shown);
        if (plans.empty())
            return fail(ErrorCode::invalidInput,
                        "the scene shows no DepthImage or OctreeImage with a texture; at least one "
                        "is expected");

        std::vector<Result<std::vector<ReferenceView>>> read(plans.size());
        images_ = &images;
        if (options_.pixels) STX_CHECK(checkMemory(plans));
        parallelFor(0, static_cast<std::int64_t>(plans.size()), [&](std::int64_t i) {
            const auto at = static_cast<std::size_t>(i);
            if (!job_.cancelled)
                read[at] = options_.pixels ? readView(plans[at]) : readHeader(plans[at]);
        });
        STX_CHECK(job_.checkCancelled());
        Bundle bundle;
        bundle.title = shown.title;
        bundle.bounds = notes.bounds;
        bundle.origin = notes.origin;
        bundle.time = notes.start;
        for (std::size_t i = 0; i < plans.size(); ++i) {
            if (!read[i]) {
                const Error error =
                    read[i].error().at(fmt::format("view {} '{}'", i, plans[i].name));
                if (options_.pixels) return tl::unexpected(error);
                job_.note(error.text() + "; it is left out");
                continue;
            }
            for (std::size_t layer = 0; layer < read[i]->size(); ++layer) {
                ReferenceView& view = (*read[i])[layer];
                if (const auto said = notes.views.find(plans[i].key); said != notes.views.end())
                    applyNotes(view, plans[i], said->second, static_cast<int>(layer));
                applySimilarity(view, plans[i].worldFromLocal);
                bundle.views.push_back(std::move(view));
            }
        }
        if (bundle.views.size() > static_cast<std::size_t>(job_.limits.maxViews))
            return fail(ErrorCode::invalidInput, "the scene has {} views; at most {} are read",
                        bundle.views.size(), job_.limits.maxViews);
        makeNamesUnique(bundle);
        if (options_.pixels && options_.environment) {
            STX_TRY(bundle.environment,
                    boundEnvironment(shown.backgrounds, images, options_.decode, job_));
        }
        if (options_.pixels) STX_CHECK(bundle.check());
        return bundle;
    }

  private:
    /// What all WorldInfo say. Bounds are moved as the WorldInfo is; they hold only when each
    /// object is moved with one.
    ViewNotes notesOf(const ShownScene& shown, std::vector<Plan>& plans) {
        ViewNotes all;
        std::vector<std::string> lost;
        std::vector<glm::dmat4> places;
        for (const ShownInfo& info : shown.infos) {
            ViewNotes notes = ViewNotes::parse(info.text);
            takeViews(all, notes, info.parent, plans, lost);
            if (all.origin == glm::dvec3(0.0)) all.origin = notes.origin;
            if (!all.start) all.start = notes.start;
            if (!notes.bounds) continue;
            places.push_back(info.worldFromLocal);
            if (!all.bounds) all.bounds.emplace();
            for (int corner = 0; corner < 8; ++corner) {
                const Bounds& b = *notes.bounds;
                const glm::dvec4 p(corner & 1 ? b.max.x : b.min.x, corner & 2 ? b.max.y : b.min.y,
                                   corner & 4 ? b.max.z : b.min.z, 1.0);
                all.bounds->add(glm::dvec3(info.worldFromLocal * p));
            }
        }
        for (Plan& plan : plans) {
            if (const auto at = all.views.find(plan.key);
                at != all.views.end() && !at->second.name.empty())
                plan.name = at->second.name;
        }
        if (!lost.empty())
            job_.note(
                fmt::format("WorldInfo says of {} view(s) what the scene does not show or has in "
                            "another number, "
                            "the first '{}': names, padding, what was pruned, unknown or "
                            "background of these is "
                            "lost",
                            lost.size(), lost.front()));
        const bool moved =
            std::any_of(shown.nodes.begin(), shown.nodes.end(), [&](const ShownNode& node) {
                return std::find(places.begin(), places.end(), node.worldFromLocal) == places.end();
            });
        if (all.bounds && moved) {
            job_.note(
                "the bounds that WorldInfo states are left out: a Transform moves views away "
                "from them");
            all.bounds.reset();
        }
        return all;
    }
    /// Takes over what a WorldInfo says of views: by their number among those beside it, where
    /// these are as many as it was written for, or by the DEF names of before. Adds to `lost` the
    /// keys that mean none of `plans`.
    void takeViews(ViewNotes& all, const ViewNotes& notes, int parent,
                   const std::vector<Plan>& plans, std::vector<std::string>& lost) const {
        const auto beside = counts_.find(parent);
        const bool counts =
            notes.count && beside != counts_.end() && *notes.count == beside->second;
        for (const auto& [key, view] : notes.views) {
            bool found = false;
            for (const Plan& plan : plans) {
                const bool meant = key.starts_with('#') ? counts && plan.parent == parent &&
                                                              key == ViewNotes::keyOf(plan.number)
                                                        : key == plan.depthImage->defName;
                if (meant) all.views.emplace(plan.key, view);
                found = found || meant;
            }
            if (!found) lost.push_back(key);
        }
    }
    /// Gives a view what a WorldInfo says of it.
    void applyNotes(ReferenceView& view, const Plan& plan, const ViewNotes::View& notes,
                    int layer) {
        if (notes.padding) removePadding(view, *notes.padding);
        const auto of = notes.layers.find(layer);
        if (of == notes.layers.end()) return;
        if (of->second.unknown && markUnknown(view, plan, *of->second.unknown))
            view.noDepth = NoDepth::unknown;
        if (of->second.pruned) view.pruned = markUnknown(view, plan, *of->second.pruned);
        view.background = of->second.background;
        view.refined = of->second.refined;
    }
    /// Gives a view full alpha where its depth is unknown. A mask that is damaged costs quality
    /// only, so that it is a note, and false.
    bool markUnknown(ReferenceView& view, const Plan& plan, const std::string& where) {
        if (where == kUnknownInAlpha || !options_.pixels) return true;
        // The list of a PointTexture has no colours for pixels without depth; neighbours' serve.
        if (plan.texture->info->find("depthNbBits") >= 0) bleedColour(view.texture);
        const auto ok = applyUnknownMask(view, where, job_.limits);
        if (!ok)
            job_.note(fmt::format("view '{}': {}; borders of what has no depth may show", view.name,
                                  ok.error().text()));
        return ok.has_value();
    }

    /// Says what would change the views in time, besides commands.
    void noteMotion(const Scene& scene, const ShownScene& shown) {
        std::unordered_map<int, std::size_t> pictures;
        for (const ObjectDescriptor* od : document_.objectDescriptors())
            if (!od->streams.empty()) pictures[od->id] = od->streams[0].samples.size();
        std::unordered_set<const Node*> inViews = shown.above;
        std::unordered_set<int> moving;
        // Views share nodes, so all are walked as one graph.
        const NodePtr all = makeNode("Group");
        for (const ShownNode& view : shown.nodes)
            all->edit<NodeList>("children").push_back(view.node);
        forEachNode(all, [&](const NodePtr& node) {
            inViews.insert(node.get());
            const int url = node->info->find("url");
            const auto* urls = url < 0 ? nullptr : std::get_if<std::vector<Url>>(&node->value(url));
            if (urls == nullptr || urls->empty()) return;
            const auto found = pictures.find(urls->front().objectDescriptorId);
            if (found != pictures.end() && found->second > 1) moving.insert(found->first);
        });
        const auto routes =
            std::count_if(scene.routes.begin(), scene.routes.end(),
                          [&](const Route& route) { return inViews.contains(route.to.get()); });
        if (routes > 0)
            job_.note(
                fmt::format("{} ROUTE(s) change the views in time; only their start is read{}",
                            routes, kOthers));
        if (!moving.empty())
            job_.note(
                fmt::format("{} image(s) of the views have several pictures in time; only "
                            "the first of each is read{}",
                            moving.size(), kOthers));
        if (document_.frames.size() > 1)
            job_.note(fmt::format(
                "the scene changes {} time(s) after its start; only its start is read{}",
                document_.frames.size() - 1, kOthers));
    }

    std::string freeName(const NodePtr& node) {
        std::string name = node->defName;
        if (name.empty()) name = fmt::format("view{}", count_);
        ++count_;
        return name;
    }
    static void makeNamesUnique(Bundle& bundle) {
        std::set<std::string> taken;
        for (ReferenceView& view : bundle.views) {
            const std::string base = view.name;
            for (int i = 1; !taken.insert(view.name).second; ++i)
                view.name = fmt::format("{}_{}", base, i);
        }
    }

    Result<std::vector<Plan>> makePlans(const ShownScene& shown) {
        std::vector<Plan> plans;
        for (const ShownNode& node : shown.nodes) {
            auto world = similarityFrom(node.worldFromLocal);
            if (!world) {
                const Error error = world.error().at(fmt::format("{} '{}'", node.node->info->name,
                                                                 node.node->defName.empty()
                                                                     ? std::to_string(plans.size())
                                                                     : node.node->defName));
                if (options_.pixels) return tl::unexpected(error);
                job_.note(error.text() + "; its camera is shown without these Transforms");
                world = Similarity();
            }
            if (node.node->is("OctreeImage")) {
                auto& octree = octrees_[node.node.get()];
                if (!octree) {
                    auto parsed = Octree::parse(node.node->get<std::vector<std::int32_t>>("octree"),
                                                node.node->get<std::int32_t>("octreeResolution"),
                                                job_.limits);
                    if (!parsed) return propagate(parsed);
                    octree = std::make_unique<Octree>(std::move(*parsed));
                    if (octree->unusedBytes() > 0)
                        job_.note(fmt::format("OctreeImage.octree has {} bytes more than its tree",
                                              octree->unusedBytes()));
                }
                for (const NodePtr& image : node.node->get<NodeList>("images"))
                    addPlan(plans, image, *world, node.parent, octree.get());
            } else {
                addPlan(plans, node.node, *world, node.parent, nullptr);
            }
        }
        return plans;
    }
    void addPlan(std::vector<Plan>& plans, const NodePtr& image, const Similarity& world,
                 int parent, const Octree* octree) {
        const auto number = static_cast<std::size_t>(counts_[parent]++);
        if (!image) return;
        const NodePtr& texture = image->get<NodePtr>("diTexture");
        const bool isPoints = texture && texture->info->find("depthNbBits") >= 0;
        const bool empty =
            !texture || (isPoints && texture->get<std::vector<std::int32_t>>("depth").empty()) ||
            (!isPoints && !texture->get<NodePtr>("texture") && !texture->get<NodePtr>("depth"));
        if (empty) {
            job_.note(fmt::format("a {} has no {}; it is left out", image->info->name,
                                  texture ? "images" : "diTexture"));
            return;
        }
        plans.push_back({image, texture, world, freeName(image), fmt::format("{}", plans.size()),
                         parent, number, octree});
    }

    /// What all pixels together will take, before the first is read.
    Result<void> checkMemory(const std::vector<Plan>& plans) const {
        std::uint64_t pixels = 0;
        for (const Plan& plan : plans) {
            for (const char* field : {"texture", "depth"}) {
                const int index = plan.texture->info->find(field);
                if (index < 0 || !std::holds_alternative<NodePtr>(plan.texture->value(index)))
                    continue;
                const auto& image = std::get<NodePtr>(plan.texture->value(index));
                if (!image) continue;
                // Images without a readable header fail later, with a message of their own.
                if (const auto info = images_->probe(*image)) {
                    pixels += static_cast<std::uint64_t>(info->width) *
                              static_cast<std::uint64_t>(info->height);
                    break;
                }
            }
            const bool vectors = plan.texture->is("SimpleTextureV2");
            STX_CHECK(job_.limits.checkAllocation(pixels, vectors ? 44 : 8, "the views' pixels"));
        }
        return {};
    }

    /// Camera and planes; the size comes from the image.
    Result<ReferenceView> cameraOf(const Plan& plan, int width, int height) const {
        const Node& node = *plan.depthImage;
        ReferenceView view;
        view.name = plan.name;
        const auto fov = node.get<glm::vec2>("fieldOfView");
        const bool orthographic = node.get<bool>("orthographic");
        constexpr float kPi = 3.14159265f;
        if (!(fov.x > 0 && fov.y > 0 && std::isfinite(fov.x) && std::isfinite(fov.y)) ||
            (!orthographic && (fov.x >= kPi || fov.y >= kPi)))
            return fail(ErrorCode::invalidInput, "fieldOfView is {} {}; {}", fov.x, fov.y,
                        orthographic ? "the window of an orthographic DepthImage has sides above 0"
                                     : "angles lie between 0 and 3.1415927 (both excluded)");
        view.nearPlane = node.get<float>("nearPlane");
        view.farPlane = node.get<float>("farPlane");
        if (!(view.nearPlane >= 0 && view.nearPlane < view.farPlane &&
              std::isfinite(view.farPlane)))
            return fail(ErrorCode::invalidInput,
                        "nearPlane is {} and farPlane {}; 0 <= nearPlane < farPlane must hold",
                        view.nearPlane, view.farPlane);
        const glm::dvec4 turn = axisAngle(node.get<Rotation>("orientation"));
        const glm::dvec3 position(node.get<glm::vec3>("position"));
        for (const double v : {turn.x, turn.y, turn.z, turn.w, position.x, position.y, position.z})
            if (!std::isfinite(v))
                return fail(ErrorCode::invalidInput,
                            "position or orientation has a value that is not finite");
        view.camera = Camera::fromFieldOfView(position, quatFromAxisAngle(turn), glm::dvec2(fov),
                                              orthographic, width, height);
        return view;
    }

    Result<DecodedImage> decode(const NodePtr& texture, std::string_view what) const {
        auto image = images_->decode(
            *texture, options_.decode, job_.limits,
            what == "depth" ? StreamImages::Samples::codes : StreamImages::Samples::colours);
        if (!image) return tl::unexpected(image.error().at(std::string(what)));
        return image;
    }

    Result<std::vector<ReferenceView>> readView(const Plan& plan) const {
        if (plan.texture->info->find("depthNbBits") >= 0) {
            STX_TRY(const auto view, cameraOf(plan, plan.texture->get<std::int32_t>("width"),
                                              plan.texture->get<std::int32_t>("height")));
            return viewsFromPointTexture(*plan.texture, view, job_.limits);
        }
        STX_TRY(auto view, readSimpleTexture(plan));
        std::vector<ReferenceView> views;
        views.push_back(std::move(view));
        return views;
    }

    /// The view without its images: size and depth bits from the image's header.
    Result<std::vector<ReferenceView>> readHeader(const Plan& plan) const {
        if (plan.texture->info->find("depthNbBits") >= 0) {
            STX_TRY(const auto view, cameraOf(plan, plan.texture->get<std::int32_t>("width"),
                                              plan.texture->get<std::int32_t>("height")));
            return headersFromPointTexture(*plan.texture, view, job_.limits);
        }
        const NodePtr& depth = plan.texture->get<NodePtr>("depth");
        const NodePtr& colour = plan.texture->get<NodePtr>("texture");
        STX_TRY(const auto info, images_->probe(depth && !plan.octree ? *depth : *colour));
        STX_TRY(auto view, cameraOf(plan, info.width, info.height));
        if (!plan.octree) view.depthBits = info.bits;
        return std::vector<ReferenceView>{view};
    }

    Result<ReferenceView> readSimpleTexture(const Plan& plan) const {
        const NodePtr& colourNode = plan.texture->get<NodePtr>("texture");
        const NodePtr& depthNode = plan.texture->get<NodePtr>("depth");
        DecodedImage colour;
        if (colourNode) {
            STX_TRY(colour, decode(colourNode, "texture"));
            if (colour.bits() == 16) job_.note("16-bit colour is read as 8 bits");
        }
        const bool hasAlpha = colourNode && (colour.channels == 2 || colour.channels == 4);
        int depthBits = 16;
        ReferenceView view;
        if (plan.octree) {
            if (!colourNode)
                return fail(ErrorCode::invalidInput, "an image of an OctreeImage has no texture");
            STX_TRY(view, cameraOf(plan, colour.width, colour.height));
            STX_CHECK(castOctree(*plan.octree, view));
        } else if (depthNode) {
            STX_TRY(const auto depth, decode(depthNode, "depth"));
            STX_TRY(view, cameraOf(plan, depth.width, depth.height));
            if (colourNode && (colour.width != depth.width || colour.height != depth.height))
                return fail(ErrorCode::invalidInput,
                            "depth is {}x{} but texture is {}x{}; both must match", depth.width,
                            depth.height, colour.width, colour.height);
            if (!isGrey(depth))
                return fail(ErrorCode::invalidInput,
                            "the depth image has colours; depth is grey-scale (one channel)");
            if (depth.channels == 2 || depth.channels == 4)
                job_.note("a depth image has an alpha channel, which is left out");
            depthBits = depth.bits();
            const auto stored = images_->probe(*depthNode);
            STX_TRY(view.depth, depthFromImage(depth, 0, stored ? stored->greyBits : 0,
                                               view.nearPlane, view.farPlane));
        } else {
            if (!hasAlpha)
                return fail(ErrorCode::invalidInput,
                            "the depth image is NULL and the texture has no alpha; one of them "
                            "must hold the depth");
            STX_TRY(view, cameraOf(plan, colour.width, colour.height));
            depthBits = colour.bits();
            STX_TRY(view.depth,
                    depthFromImage(colour, colour.channels - 1, 0, view.nearPlane, view.farPlane));
        }
        if (!plan.octree) view.depthBits = depthBits;

        Rgba8Image pixels =
            colourNode ? rgba8From(colour)
                       : Rgba8Image(view.camera.width, view.camera.height, glm::u8vec4(255));
        if (!colourNode) job_.note("a view has depth but no texture; it is read as white");
        if (!(hasAlpha && depthNode && !plan.octree))
            for (std::size_t i = 0; i < pixels.count(); ++i)
                pixels.pixels()[i].a = hasPoint(view.depth.pixels()[i]) ? 255 : 0;
        view.texture = Texture(std::move(pixels));

        if (plan.texture->is("SimpleTextureV2")) STX_CHECK(readVectors(plan, view));
        return view;
    }

    Result<void> readVectors(const Plan& plan, ReferenceView& view) const {
        const auto load = [&](std::string_view what, const NodePtr& node) -> Result<DecodedImage> {
            STX_TRY(auto image, decode(node, what));
            if (image.width != view.camera.width || image.height != view.camera.height)
                return fail(ErrorCode::invalidInput,
                            "{} is {}x{} but depth is {}x{}; both must match", what, image.width,
                            image.height, view.camera.width, view.camera.height);
            return image;
        };
        if (const NodePtr& node = plan.texture->get<NodePtr>("normal")) {
            STX_TRY(const auto image, load("normal", node));
            STX_TRY(view.normal, normalsFromImage(image, view.depth));
        }
        const NodePtr& u = plan.texture->get<NodePtr>("splatU");
        const NodePtr& v = plan.texture->get<NodePtr>("splatV");
        if (static_cast<bool>(u) != static_cast<bool>(v))
            job_.note("a SimpleTextureV2 has only one of splatU and splatV; it is left out");
        if (!u || !v) return {};
        const int minMax = plan.depthImage->info->find("splatMinMax");
        if (minMax < 0) {
            job_.note(
                "a DepthImage has splats but no splatMinMax (only DepthImageV2 has); they are left "
                "out");
            return {};
        }
        const glm::vec2 range = std::get<glm::vec2>(plan.depthImage->value(minMax));
        if (!std::isfinite(range.x) || !std::isfinite(range.y) || range.x >= range.y)
            return fail(ErrorCode::invalidInput,
                        "splatMinMax is {} {}; the first must be the smaller", range.x, range.y);
        STX_TRY(const auto imageU, load("splatU", u));
        STX_TRY(const auto imageV, load("splatV", v));
        STX_TRY(view.splatU, splatsFromImage(imageU, range, view.depth));
        STX_TRY(view.splatV, splatsFromImage(imageV, range, view.depth));
        return {};
    }

    /// Depth of the first voxel behind each pixel. Planes are put around what is there.
    Result<void> castOctree(const Octree& octree, ReferenceView& view) const {
        if (!view.camera.orthographic)
            return fail(ErrorCode::invalidInput, "an image of an OctreeImage must be orthographic");
        const Camera& c = view.camera;
        const glm::dvec3 forward = c.forward();
        Image<double> hits(c.width, c.height, static_cast<double>(kNoDepth));
        double nearest = kNoDepth, furthest = -static_cast<double>(kNoDepth);
        for (int y = 0; y < c.height; ++y) {
            if (job_.cancelled) return {};
            for (int x = 0; x < c.width; ++x) {
                const glm::dvec3 origin =
                    c.position + c.orientation * c.unproject(x + 0.5, y + 0.5, 0.0);
                const double dist = octree.firstHit(origin, forward);
                hits.at(x, y) = dist;
                if (!(dist < kNoDepth)) continue;
                nearest = std::min(nearest, dist);
                furthest = std::max(furthest, dist);
            }
        }
        view.depth = Image<float>(c.width, c.height, kNoDepth);
        if (!(nearest < kNoDepth)) return {};
        // The viewpoint may be inside the cube or behind it: rays are parallel, so step back.
        const double back = nearest < 0.5 ? 1.0 - nearest : 0.0;
        view.camera.position -= forward * back;
        view.nearPlane = std::floor((nearest + back) * 1024) / 1024;
        view.farPlane = std::ceil((furthest + back) * 1024 + 1) / 1024;
        for (std::size_t i = 0; i < hits.count(); ++i)
            if (hits.pixels()[i] < kNoDepth)
                view.depth.pixels()[i] = static_cast<float>(hits.pixels()[i] + back);
        return {};
    }

    const Document& document_;
    const SceneReadOptions& options_;
    Job& job_;
    const StreamImages* images_ = nullptr;
    std::unordered_map<const Node*, std::unique_ptr<Octree>> octrees_;
    std::unordered_map<int, int> counts_;  ///< of views, by ShownNode::parent
    int count_ = 0;
};

}  // namespace

Result<Bundle> bundleFromScene(const Document& document, const SceneReadOptions& options,
                               Job& job) {
    if (document.frames.empty())
        return fail(ErrorCode::invalidInput, "the presentation has no scene");
    STX_TRY(const auto scene, composeScene(document.frames, document.frames.front().time));
    STX_TRY(const auto images, StreamImages::make(document, options.folder, job.limits));
    return BundleReader(document, options, job).read(scene, images, true);
}

Result<Bundle> bundleOfMoment(const Document& document, const Scene& scene,
                              const StreamImages& images, const SceneReadOptions& options,
                              Job& job) {
    return BundleReader(document, options, job).read(scene, images, false);
}

const char* nodeKindOf(const Document& document) {
    static constexpr std::array<const char*, 4> kKinds = {"SimpleTexture", "PointTexture",
                                                          "OctreeImage", "SimpleTextureV2"};
    int best = -1;
    for (const auto& frame : document.frames) {
        for (const auto& command : frame.commands) {
            forEachNode(command, [&](const NodePtr& node) {
                for (int i = 0; i < static_cast<int>(kKinds.size()); ++i) {
                    if (node->is(kKinds[static_cast<std::size_t>(i)]) ||
                        (i == 1 && node->is("PointTextureV2")))
                        best = std::max(best, i);
                }
            });
        }
    }
    return best < 0 ? "none" : kKinds[static_cast<std::size_t>(best)];
}

}  // namespace stx::mpeg4

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <unordered_map>
#include <unordered_set>

#include "formats/mpeg4/mapping/background.hpp"
#include "formats/mpeg4/mapping/mapping.hpp"
#include "formats/mpeg4/mapping/octree.hpp"
#include "formats/mpeg4/mapping/scene_sequence.hpp"
#include "formats/mpeg4/mapping/stream_images.hpp"
#include "formats/mpeg4/mapping/view_notes.hpp"
#include "formats/mpeg4/mapping/view_read.hpp"
#include "formats/mpeg4/scene/interpolators.hpp"
#include "formats/mpeg4/scene/scene_walk.hpp"
#include "lib/base/parallel.hpp"
#include "lib/base/unique_names.hpp"
#include "lib/geometry/frustum.hpp"

namespace stx::mpeg4 {
namespace {

/// Appended to what is said of things that move.
constexpr const char* kOthers = " (stx render --time and --times show the rest)";

class BundleReader {
  public:
    BundleReader(const Document& document, const SceneReadOptions& options, Job& job)
        : document_(document), options_(options), job_(job) {}

    /// What a scene shows, before its pictures are read.
    struct Object {
        Bundle about;  ///< without views
        std::vector<ViewPlan> plans;
        ViewNotes notes;
        std::vector<ShownBackground> backgrounds;
    };

    /// The object as a scene has it. With `still`, says what moves: the moment is all that is read.
    Result<Bundle> read(const Scene& scene, const ShownScene& shown, const StreamImages& images,
                        bool still) {
        STX_TRY(const auto object, objectOf(scene, shown, images, still));
        return read(object, images);
    }
    Result<Bundle> read(const Object& object, const StreamImages& images) {
        const std::vector<ViewPlan>& plans = object.plans;
        if (plans.empty()) return object.about;
        const ViewReader reader(options_, images, job_);
        std::vector<Result<std::vector<ReferenceView>>> read(plans.size());
        if (options_.pixels) STX_CHECK(reader.checkMemory(plans));
        parallelFor(0, plans.size(), [&](std::size_t at) {
            if (!job_.cancelled)
                read[at] = options_.pixels ? reader.read(plans[at]) : reader.header(plans[at]);
        });
        STX_CHECK(job_.checkCancelled());
        Bundle bundle = object.about;
        std::vector<bool> known;
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
                place(view, plans[i], object.notes, static_cast<int>(layer));
                bundle.views.push_back(std::move(view));
                known.push_back(planesOfPoints(plans[i]));
            }
        }
        if (bundle.views.size() > static_cast<std::size_t>(job_.limits.maxViews))
            return fail(ErrorCode::invalidInput, "the scene has {} views; at most {} are read",
                        bundle.views.size(), job_.limits.maxViews);
        makeNamesUnique(bundle);
        leaveOutStaleBounds(bundle, known);
        if (options_.pixels && options_.environment)
            STX_SET(bundle.environment,
                    boundEnvironment(object.backgrounds, images, options_.decode, job_));
        if (options_.pixels) STX_CHECK(bundle.check());
        return bundle;
    }

    Result<Object> objectOf(const Scene& scene, const ShownScene& shown, const StreamImages& images,
                            bool still) {
        if (!shown.leftOut.empty())
            job_.note(fmt::format("the scene has nodes that are no views; they are left out: {}",
                                  fmt::join(shown.leftOut, ", ")));
        if (!shown.asGroups.empty())
            job_.note(fmt::format(
                "nodes that place or choose their children by themselves are read as Group: {}",
                fmt::join(shown.asGroups, ", ")));
        noteUnmoved(scene, shown);
        if (still) noteBrokenKeys(document_, job_);
        Object object;
        STX_TRY(object.plans, makePlans(shown));
        object.notes = notesOf(shown, object.plans);
        object.about.title = shown.title;
        object.backgrounds = shown.backgrounds;
        if (object.plans.empty() && options_.mayBeEmpty) return object;
        if (still && options_.noteMotion) noteMotion(scene, shown, images);
        if (object.plans.empty())
            return fail(ErrorCode::invalidInput,
                        "the scene shows no DepthImage or OctreeImage with a texture; at least one "
                        "is expected");
        object.about.bounds = object.notes.bounds;
        object.about.origin = object.notes.origin.value_or(glm::dvec3(0.0));
        object.about.time = object.notes.start;
        // Frames of a film last as its Timeline says.
        if (still && !mayMove(scene)) object.about.duration = object.notes.duration;
        // A moment at 0, which needs no note.
        if (object.about.duration && !object.about.time) object.about.time = 0;
        return object;
    }

    /// The views of an object without their pixels, and which images each has; nothing where only
    /// the pixels tell.
    struct Headers {
        Bundle bundle;
        std::vector<ViewImageKinds> kinds;
    };
    std::optional<Headers> headersOf(const Object& object, const StreamImages& images) {
        const ViewReader reader(options_, images, job_);
        Headers headers;
        headers.bundle = object.about;
        std::vector<bool> known;
        for (const ViewPlan& plan : object.plans) {
            const auto kinds = reader.knownKinds(plan);
            if (!kinds || hasMask(plan, object.notes)) return {};
            auto views = reader.header(plan);
            if (!views || views->size() != 1) return {};
            ReferenceView& view = views->front();
            if (view.depthBits != 8 && view.depthBits != 16) return {};
            place(view, plan, object.notes, 0);
            headers.bundle.views.push_back(std::move(view));
            headers.kinds.push_back(*kinds);
            known.push_back(planesOfPoints(plan));
        }
        makeNamesUnique(headers.bundle);
        leaveOutStaleBounds(headers.bundle, known);
        return headers;
    }

    /// The one view of a plan of headersOf(), but for its name, which is unique there.
    Result<ReferenceView> readOne(const Object& object, std::size_t index,
                                  const StreamImages& images) {
        const ViewPlan& plan = object.plans[index];
        STX_TRY(auto views, within(fmt::format("view {} '{}'", index, plan.name),
                                   ViewReader(options_, images, job_).read(plan)));
        place(views.front(), plan, object.notes, 0);
        return std::move(views.front());
    }

  private:
    /// What all WorldInfo say. Bounds are moved as the WorldInfo is; they hold only when each
    /// object is moved with one. All count from the first origin: what is beside another is moved.
    ViewNotes notesOf(const ShownScene& shown, std::vector<ViewPlan>& plans) {
        ViewNotes all;
        std::vector<std::string> lost;
        std::vector<glm::dmat4> places;
        std::unordered_map<int, glm::dvec3> shifts;  // of what is beside each origin
        for (const ShownInfo& info : shown.infos) {
            ViewNotes notes = ViewNotes::parse(info.text);
            takeViews(all, notes, info.parent, plans, lost);
            if (notes.origin) {
                const glm::dvec3 origin = glm::dmat3(info.worldFromLocal) * *notes.origin;
                if (!all.origin && std::isfinite(origin.x + origin.y + origin.z))
                    all.origin = origin;
                if (all.origin) shifts.emplace(info.parent, origin - *all.origin);
            }
            const auto shift = shifts.find(info.parent);
            if (!all.start) all.start = notes.start;
            if (!all.duration) all.duration = notes.duration;
            if (!notes.bounds) continue;
            places.push_back(info.worldFromLocal);
            if (!all.bounds) all.bounds.emplace();
            for (int corner = 0; corner < 8; ++corner) {
                const Bounds& b = *notes.bounds;
                const glm::dvec4 p(corner & 1 ? b.max.x : b.min.x, corner & 2 ? b.max.y : b.min.y,
                                   corner & 4 ? b.max.z : b.min.z, 1.0);
                all.bounds->add(glm::dvec3(info.worldFromLocal * p) +
                                (shift == shifts.end() ? glm::dvec3(0.0) : shift->second));
            }
        }
        for (ViewPlan& plan : plans) {
            if (const auto at = all.views.find(plan.key);
                at != all.views.end() && !at->second.name.empty())
                plan.name = at->second.name;
            if (const auto shift = shifts.find(plan.parent); shift != shifts.end())
                plan.worldFromLocal.translation += shift->second;
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
                   const std::vector<ViewPlan>& plans, std::vector<std::string>& lost) const {
        const auto beside = counts_.find(parent);
        const bool counts =
            notes.count && beside != counts_.end() && *notes.count == beside->second;
        for (const auto& [key, view] : notes.views) {
            bool found = false;
            for (const ViewPlan& plan : plans) {
                const bool meant = key.starts_with('#') ? counts && plan.parent == parent &&
                                                              key == ViewNotes::keyOf(plan.number)
                                                        : key == plan.depthImage->defName;
                if (meant) all.views.emplace(plan.key, view);
                found = found || meant;
            }
            if (!found) lost.push_back(key);
        }
    }
    /// Gives a view what the scene says around it.
    void place(ReferenceView& view, const ViewPlan& plan, const ViewNotes& notes, int layer) {
        if (const auto said = notes.views.find(plan.key); said != notes.views.end())
            applyNotes(view, plan, said->second, layer);
        applySimilarity(view, plan.worldFromLocal);
    }
    /// Whether the planes of a view are around its points: those of an OctreeImage are not.
    static bool planesOfPoints(const ViewPlan& plan) {
        return !plan.octree &&
               planesSaySomething(static_cast<double>(plan.depthImage->get<float>("nearPlane")),
                                  static_cast<double>(plan.depthImage->get<float>("farPlane")));
    }
    /// Text may be edited: bounds of which some view sees nothing between its planes are not those
    /// of the views. `known`: planesOfPoints() of each.
    void leaveOutStaleBounds(Bundle& bundle, const std::vector<bool>& known) {
        if (!bundle.bounds || bundle.bounds->empty()) return;
        // Cameras and planes are floats: their last bit, of three values that add up.
        constexpr double kRounding = 4 * std::numeric_limits<float>::epsilon();
        const Bounds& box = *bundle.bounds;
        const glm::dvec3 corner = glm::max(glm::abs(box.min), glm::abs(box.max));
        for (std::size_t i = 0; i < bundle.views.size(); ++i) {
            const ReferenceView& view = bundle.views[i];
            const double slack = kRounding * (glm::length(corner) +
                                              glm::length(view.camera.position) + view.farPlane);
            if (!known[i] || !apart(view.camera, view.nearPlane, view.farPlane, box, slack))
                continue;
            job_.note(fmt::format(
                "the bounds that WorldInfo states are left out: view '{}' sees nothing of them "
                "between its planes",
                view.name));
            bundle.bounds.reset();
            return;
        }
    }
    /// Whether a WorldInfo has a picture of what is unknown in a view, which may be damaged.
    static bool hasMask(const ViewPlan& plan, const ViewNotes& notes) {
        const auto said = notes.views.find(plan.key);
        if (said == notes.views.end()) return false;
        for (const auto& [number, layer] : said->second.layers)
            for (const auto& where : {layer.unknown, layer.pruned})
                if (where && *where != kUnknownInAlpha && *where != kUnknownAll) return true;
        return false;
    }
    /// Gives a view what a WorldInfo says of it.
    void applyNotes(ReferenceView& view, const ViewPlan& plan, const ViewNotes::View& notes,
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
    bool markUnknown(ReferenceView& view, const ViewPlan& plan, const std::string& where) {
        if (where == kUnknownInAlpha || !options_.pixels) return true;
        // The list of a PointTexture has no colours for pixels without depth; neighbours' serve.
        if (plan.texture->info->find("depthNbBits") >= 0) bleedColour(view.texture);
        const auto ok = applyUnknownMask(view, where, job_.limits);
        if (!ok)
            job_.note(fmt::format("view '{}': {}; borders of what has no depth may show", view.name,
                                  ok.error().text()));
        return ok.has_value();
    }

    /// Says what clocks would move, and do not here.
    void noteUnmoved(const Scene& scene, const ShownScene& shown) {
        std::set<std::string> unmoved = routesNotFollowed(scene);
        for (const std::string& proto : shown.withClocks)
            unmoved.insert(fmt::format("TimeSensor inside of PROTO {}", proto));
        if (!unmoved.empty())
            job_.note(fmt::format("clocks move nothing through these, which are not followed: {}",
                                  fmt::join(unmoved, ", ")));
    }

    /// Whether something may change after the start: what a WorldInfo says of the duration is then
    /// of all the film.
    [[nodiscard]] bool mayMove(const Scene& scene) const {
        return document_.frames.size() > 1 || document_.odFrames.size() > 1 ||
               !scene.routes.empty() ||
               std::ranges::any_of(document_.objectDescriptors(), [](const ObjectDescriptor* od) {
                   return !od->streams.empty() && od->streams[0].samples.size() > 1;
               });
    }
    /// Says what would change the views in time, besides commands.
    void noteMotion(const Scene& scene, const ShownScene& shown, const StreamImages& images) {
        std::unordered_set<const Node*> inViews = shown.above;
        std::unordered_set<const ElementaryStream*> moving;
        // Views share nodes, so all are walked as one graph.
        const NodePtr all = makeNode("Group");
        for (const ShownNode& view : shown.nodes)
            all->edit<NodeList>("children").push_back(view.node);
        forEachNode(all, [&](const NodePtr& node) {
            inViews.insert(node.get());
            const ElementaryStream* stream = images.stream(*node);
            if (stream && stream->samples.size() > 1) moving.insert(stream);
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
        UniqueNames names("_", 1);
        for (ReferenceView& view : bundle.views) view.name = names.take(view.name);
    }

    Result<std::vector<ViewPlan>> makePlans(const ShownScene& shown) {
        std::vector<ViewPlan> plans;
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
    void addPlan(std::vector<ViewPlan>& plans, const NodePtr& image, const Similarity& world,
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
        // A PointTexture has depths of its own.
        plans.push_back({image, texture, world, freeName(image), fmt::format("{}", plans.size()),
                         parent, number, isPoints ? nullptr : octree});
    }

    const Document& document_;
    const SceneReadOptions& options_;
    Job& job_;
    std::unordered_map<const Node*, std::unique_ptr<Octree>> octrees_;
    std::unordered_map<int, int> counts_;  ///< of views, by ShownNode::parent
    int count_ = 0;
};

}  // namespace

namespace {

/// The views of a moment, read one by one.
class MomentViews : public ViewTable {
  public:
    MomentViews(std::shared_ptr<const Document> document,
                std::shared_ptr<const StreamImages> images, SceneReadOptions options,
                BundleReader::Object object, BundleReader::Headers headers)
        : ViewTable(std::move(headers.bundle), std::move(headers.kinds)),
          document_(std::move(document)),
          images_(std::move(images)),
          options_(std::move(options)),
          object_(std::move(object)) {}

    /// With the pictures as they are decoded, before they are a view.
    std::uint64_t bytesToMake(std::size_t index) const override {
        return bytesOf(index) + kDecodedBytes * pixelsOf(index);
    }

  protected:
    Result<std::shared_ptr<const ReferenceView>> make(std::size_t index, Job& job) const override {
        BundleReader reader(*document_, options_, job);
        STX_TRY(auto read, reader.readOne(object_, index, *images_));
        auto view = std::make_shared<ReferenceView>(std::move(read));
        view->name = about().views[index].name;
        STX_CHECK(within(fmt::format("view {}", index), view->check()));
        return view;
    }

  private:
    /// RGBA of 8 bits and a depth of 16.
    static constexpr std::uint64_t kDecodedBytes = 6;
    std::shared_ptr<const Document> document_;
    std::shared_ptr<const StreamImages> images_;
    SceneReadOptions options_;
    BundleReader::Object object_;
};

}  // namespace

Result<std::unique_ptr<ViewTable>> viewsOfMoment(std::shared_ptr<const Document> document,
                                                 const Scene& scene, const ShownScene& shown,
                                                 std::shared_ptr<const StreamImages> images,
                                                 const SceneReadOptions& options, bool still,
                                                 Job& job) {
    BundleReader reader(*document, options, job);
    STX_TRY(auto object, reader.objectOf(scene, shown, *images, still));
    auto headers = reader.headersOf(object, *images);
    if (!headers || headers->bundle.views.size() > static_cast<std::size_t>(job.limits.maxViews)) {
        STX_TRY(auto bundle, reader.read(object, *images));
        return tableOf(std::move(bundle));
    }
    if (options.environment)
        STX_SET(headers->bundle.environment,
                boundEnvironment(object.backgrounds, *images, options.decode, job));
    return std::make_unique<MomentViews>(std::move(document), std::move(images), options,
                                         std::move(object), std::move(*headers));
}

Result<std::unique_ptr<ViewTable>> viewsFromScene(std::shared_ptr<const Document> document,
                                                  const SceneReadOptions& options, Job& job) {
    if (document->frames.empty())
        return fail(ErrorCode::invalidInput, "the presentation has no scene");
    STX_TRY(auto images, StreamImages::make(*document, options.folder, job.limits));
    STX_TRY(const auto scene, sceneAtStart(*document, images, options.timesFromStart));
    STX_TRY(const auto shown, shownScene(scene.root, job.limits));
    return viewsOfMoment(std::move(document), scene, shown,
                         std::make_shared<StreamImages>(std::move(images)), options, true, job);
}

Result<Bundle> bundleFromScene(const Document& document, const SceneReadOptions& options,
                               Job& job) {
    if (document.frames.empty())
        return fail(ErrorCode::invalidInput, "the presentation has no scene");
    STX_TRY(const auto images, StreamImages::make(document, options.folder, job.limits));
    STX_TRY(const auto scene, sceneAtStart(document, images, options.timesFromStart));
    STX_TRY(const auto shown, shownScene(scene.root, job.limits));
    return BundleReader(document, options, job).read(scene, shown, images, true);
}

Result<Bundle> bundleOfMoment(const Document& document, const Scene& scene, const ShownScene& shown,
                              const StreamImages& images, const SceneReadOptions& options,
                              Job& job) {
    return BundleReader(document, options, job).read(scene, shown, images, false);
}

const char* nodeKindOf(const Document& document) {
    static constexpr std::array<const char*, 4> kKinds = {"SimpleTexture", "PointTexture",
                                                          "OctreeImage", "SimpleTextureV2"};
    int best = -1;
    // Of more nodes than are looked at, those before tell.
    (void)forEachNodeInside(document.frames, [&](const NodePtr& node) {
        for (int i = 0; i < static_cast<int>(kKinds.size()); ++i) {
            if (node->is(kKinds[i]) || (i == 1 && node->is("PointTextureV2")))
                best = std::max(best, i);
        }
    });
    return best < 0 ? "none" : kKinds[best];
}

}  // namespace stx::mpeg4

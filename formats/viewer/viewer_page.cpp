#include "formats/viewer/viewer_page.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>

#include "formats/stx/stx.hpp"
#include "formats/viewer/coarse_views.hpp"
#include "formats/viewer/page_scene.hpp"
#include "formats/viewer/page_writer.hpp"
#include "formats/viewer/unmeasured_views.hpp"
#include "lib/base/counted.hpp"
#include "lib/geometry/view_layout.hpp"
#include "lib/model/depth_values.hpp"
#include "lib/model/median_distance.hpp"
#include "lib/model/peak_memory.hpp"
#include "lib/model/view_table.hpp"
#include "lib/packing/packing.hpp"
#include "lib/refine/unmeasured.hpp"
#include "lib/render/scene/page_set.hpp"

namespace stx {
namespace {

using Json = nlohmann::ordered_json;

/// Browsers need several times the size of a page to hold it.
constexpr std::uint64_t kHard = 256ull << 20;
/// Views that all look within this angle of their mean look at a scene, not around an object.
constexpr double kSameSideCosine = 0.5;
/// How far the eye goes to each side of a single view, as a share of the distance of what it turns
/// around: as far as one photograph with depth bears.
constexpr double kSingleReach = 0.08;
/// The slot of what is behind all else: views have the first two.
constexpr std::size_t kUnmeasuredSlot = 2;
constexpr double kStartFovDeg = 40.0, kStartElevationDeg = 15.0;

std::string titleOf(const PageOptions& options, const std::string& bundle) {
    if (!options.title.empty()) return options.title;
    return bundle.empty() ? std::filesystem::path(options.input).filename().string() : bundle;
}

Result<PageWriter> startPage(const std::filesystem::path& path, const PageOptions& options,
                             const std::string& title, bool moves) {
    STX_TRY(auto file, OutputFile::create(path, options.output));
    PageWriter writer(std::move(file), titleOf(options, title), moves);
    STX_CHECK(writer.begin());
    return writer;
}

/// What a page says of the points of the first frame that has any.
struct PagePoints {
    std::int64_t count = 0;
    Bounds bounds;
    bool boundsKnown = false;
    /// Of a view that is alone with its textures, the first that is not behind the others: how far
    /// away what it shows is, scene units, and its near plane.
    std::optional<double> distance;
    double nearPlane = 0;
};

/// The pose of a single view, around whose median distance the page turns a little.
Json startOfSingle(const Camera& c, double distance, double nearPlane) {
    const glm::dvec3 target = c.position + c.forward() * (distance > 0 ? distance : nearPlane);
    Json j;
    j["eye"] = listOf(c.position);
    j["target"] = listOf(target);
    // That of `stx render --eye`, unless the camera is tilted sideways against it.
    const glm::dvec3 up = upOfCameras({c}), right = c.orientation * glm::dvec3(1, 0, 0);
    const bool upright = std::abs(glm::dot(right, up)) < 1e-6;
    j["up"] = listOf(upright ? up : c.orientation * glm::dvec3(0, 1, 0));
    j["fov"] = glm::degrees(2 * std::atan(0.5 * c.height / c.fy));
    j["centre"] = listOf(target);
    j["radius"] = distance > 0 ? distance : 1e-9;
    j["around"] = false;
    j["turn"] = std::atan(kSingleReach);
    return j;
}

/// Where the page begins: in front of an object, or, where all views look from one side, where the
/// one in their middle is.
Result<Json> startOf(const std::vector<Camera>& cameras, const Bounds& bounds) {
    const glm::dvec3 centre = bounds.empty() ? glm::dvec3(0) : bounds.centre();
    const double radius = bounds.empty() ? 1.0 : bounds.radius() > 0 ? bounds.radius() : 1e-9;
    glm::dvec3 mean(0), middle(0);
    for (const Camera& c : cameras) {
        mean += c.forward();
        middle += c.position / static_cast<double>(cameras.size());
    }
    const bool oneSide = std::ranges::all_of(cameras, [&](const Camera& c) {
        return !c.orthographic && glm::length(mean) > 0 &&
               glm::dot(c.forward(), glm::normalize(mean)) > kSameSideCosine;
    });
    Json j;
    CameraSettings lens;
    lens.fovRad = glm::radians(kStartFovDeg);
    lens.up = upOfCameras(cameras);
    if (oneSide) {
        const Camera& c = *std::ranges::min_element(cameras, {}, [&](const Camera& camera) {
            return glm::length(camera.position - middle);
        });
        const double reach = glm::dot(centre - c.position, c.forward());
        j["eye"] = listOf(c.position);
        j["target"] = listOf(c.position + c.forward() * (reach > 0 ? reach : radius));
        lens.fovRad = 2 * std::atan(0.5 * c.height / c.fy);
    } else {
        OrbitSettings orbit;
        orbit.elevationRad = glm::radians(kStartElevationDeg);
        STX_TRY(const auto front, orbitCameras(centre, radius, orbit, lens));
        j["eye"] = listOf(front[0].position);
        j["target"] = listOf(centre);
    }
    j["up"] = listOf(lens.up);
    j["fov"] = glm::degrees(lens.fovRad);
    j["centre"] = listOf(centre);
    j["radius"] = radius;
    j["around"] = !oneSide;
    return j;
}

/// What the page knows beside its scenes.
Result<Json> dataOf(const std::vector<ReferenceView>& views, const PagePoints& points,
                    glm::dvec3 origin, const Timeline& line, const PageOptions& options) {
    std::vector<Camera> cameras;
    Json listed = Json::array();
    for (const ReferenceView& view : views) {
        if (view.background) continue;
        cameras.push_back(view.camera);
        listed.push_back(pageCamera(view.camera, view.name));
    }
    const bool single = cameras.size() == 1 && !cameras[0].orthographic;
    if (cameras.empty()) {
        for (const ReferenceView& view : views) cameras.push_back(view.camera);
    }
    Json j;
    j["version"] = 1;
    j["input"] = options.input;
    j["options"] = options.renderOptions;
    j["up"] = listOf(upOfCameras(cameras));  // without --up
    j["facts"] = fmt::format("{}, {}", counted(views.size(), "view"),
                             counted(static_cast<std::size_t>(points.count), "point"));
    j["origin"] = listOf(origin);
    if (single)
        j["start"] = startOfSingle(cameras[0], points.distance.value_or(0), points.nearPlane);
    else
        STX_SET(j["start"], startOf(cameras, points.bounds));
    j["cameras"] = std::move(listed);
    j["times"] = line.times;
    j["end"] = line.end;
    j["slack"] = line.slack(line.end);
    return j;
}

/// Takes some views out of a bundle.
Bundle takeViews(Bundle& bundle, const std::vector<std::size_t>& numbers) {
    Bundle out;
    out.title = bundle.title;
    out.origin = bundle.origin;
    for (const std::size_t i : numbers) out.views.push_back(std::move(bundle.views[i]));
    return out;
}

/// The views of a frame of a page, scene by scene and of each atlas by atlas: what is there now,
/// then what is behind it; a set of background alone is drawn as any.
using PageGroups = std::vector<std::vector<std::vector<std::size_t>>>;

/// Memory of a view of a page beside what its table holds, bytes.
std::uint64_t memoryOfPageView(const ViewTable& table, std::size_t index) {
    const std::uint64_t work = peak::kPage.perPixel * table.pixelsOf(index);
    return table.whole() ? work : std::max(table.bytesToMake(index), table.bytesOf(index) + work);
}

/// In films all views have atlases of their own, so that what did not change in the next frame is
/// the same image. What stands still has one, or where memory does not hold all views as few as
/// hold each as many as fit. The textures of one scene all have the same images: where views do not
/// it is one, too.
PageGroups pageGroups(const ViewTable& table, bool moves, const Limits& limits) {
    const bool whole =
        !moves && (table.whole() || memoryOfAll(table, peak::kPage) <= limits.maxMemoryBytes);
    PageGroups out;
    for (const bool background : {false, true}) {
        std::vector<std::vector<std::size_t>> groups;
        std::uint64_t taken = 0;
        std::optional<ViewImageKinds> first;
        bool alike = true;
        std::vector<std::size_t> all;
        for (std::size_t i = 0; i < table.count(); ++i) {
            if (table.about().views[i].background != background) continue;
            const ViewImageKinds& kinds = table.kindsOf(i);
            if (!first) first = kinds;
            alike =
                alike && kinds.normal == first->normal && kinds.hasSplats() == first->hasSplats();
            const std::uint64_t takes = memoryOfPageView(table, i);
            if (all.empty() || moves || taken + takes > limits.maxMemoryBytes) {
                groups.emplace_back();
                taken = table.bytesHeld();
            }
            taken += takes;
            groups.back().push_back(i);
            all.push_back(i);
        }
        if (all.empty()) continue;
        if (whole || !alike) groups = {std::move(all)};
        out.push_back(std::move(groups));
    }
    return out;
}

/// The views of a frame, read as they are asked for.
class PageViews {
  public:
    static Result<PageViews> of(std::unique_ptr<ViewTable> table, bool moves, Job& job) {
        PageViews out;
        out.groups_ = pageGroups(*table, moves, job.limits);
        std::uint64_t most = 0, pixels = 0;
        for (const auto& groups : out.groups_) {
            for (const auto& group : groups) {
                std::uint64_t takes = 0;
                for (const std::size_t i : group) takes += memoryOfPageView(*table, i);
                most = std::max(most, takes);
            }
        }
        for (std::size_t i = 0; i < table->count(); ++i) pixels += table->pixelsOf(i);
        STX_CHECK(
            checkPeak({peak::kPage.what, 0}, pixels, 0, table->bytesHeld() + most, job.limits));
        if (table->whole() || (out.groups_.size() == 1 && out.groups_[0].size() == 1))
            STX_SET(out.bundle_, wholeBundle(std::move(table), job));
        else
            out.table_ = std::move(table);
        return out;
    }

    [[nodiscard]] const PageGroups& groups() const { return groups_; }
    /// Some of the views, once each.
    Result<Bundle> take(const std::vector<std::size_t>& group, Job& job) {
        if (!table_) return takeViews(bundle_, group);
        std::vector<bool> wanted(table_->count());
        for (const std::size_t i : group) wanted[i] = true;
        STX_TRY(auto some, someViews(*table_, wanted, nullptr, job));
        return takeViews(some, group);
    }

  private:
    Bundle bundle_;  ///< with all images, if table_ is null
    std::unique_ptr<ViewTable> table_;
    PageGroups groups_;
};

/// Adds what views say that have points.
void look(const Bundle& views, PagePoints& points) {
    points.count += views.pointCount();
    if (!points.boundsKnown)
        points.bounds = boundsTogether(std::array{points.bounds, views.computeBounds()});
    const ReferenceView& first = views.views.front();
    if (views.views.size() > 1 || first.background || points.distance) return;
    points.distance = medianDistance(first);
    points.nearPlane = first.nearPlane;
}

/// Stages of `stx render` for which there was no memory, by name.
using LeftOut = std::set<std::string>;

/// Puts the views of a table in memory.
Result<void> readAll(std::unique_ptr<ViewTable>& table, Job& job) {
    if (std::as_const(*table).whole()) return {};
    STX_TRY(auto bundle, wholeBundle(std::move(table), job));
    table = tableOf(std::move(bundle));
    return {};
}

/// Takes coarse points away from the views of a frame, whose table is read for it where there is
/// memory.
Result<void> leaveCoarseOut(std::unique_ptr<ViewTable>& table, LeftOut& leftOut, Job& job) {
    const ViewTable& views = *table;
    if (!mayHaveCoarse(views.about().views)) return {};
    if (memoryOfAll(views, peak::kPage) > job.limits.maxMemoryBytes) {
        job.note(
            "points of views that others show at least twice as finely are on the page, which "
            "stx render --mode splat leaves out: --max-memory has no room to find them");
        leftOut.insert("coarse");
        return {};
    }
    STX_TRY(auto bundle, wholeBundle(std::move(table), job));
    takeCoarseAway(bundle);
    table = tableOf(std::move(bundle));
    return {};
}

/// Writes what unmeasuredViews() gives as a scene, the last of its frame.
Result<std::optional<int>> writeUnmeasured(PageWriter& writer, const Bundle& views,
                                           const PageOptions& options, Job& job) {
    Bundle layer = unmeasuredViews(views);
    if (layer.views.empty()) return std::nullopt;
    codeColours(layer, "the page", job);
    STX_TRY(const Atlas atlas, packForPage(layer, job));
    layer.views.clear();
    PageScene scene({.jpegQuality = options.colours.jpegQuality});
    Json pages = Json::array();
    STX_TRY(auto images, scene.add(atlas, job));
    STX_CHECK(writer.addImages(kUnmeasuredSlot, 0, std::move(images), pages));
    STX_TRY(const int number,
            writer.addScene(kUnmeasuredSlot, scene.description(std::move(pages))));
    return number;
}

/// The same of a frame, whose table is read for it where there is memory.
Result<std::optional<int>> writeBehind(PageWriter& writer, std::unique_ptr<ViewTable>& table,
                                       const PageOptions& options, LeftOut& leftOut, Job& job) {
    const ViewTable& views = *table;
    if (std::ranges::none_of(views.about().views, mayHaveUnmeasured)) return std::nullopt;
    if (memoryOfUnmeasured(views) > job.limits.maxMemoryBytes) {
        job.note(
            "colours without depth are not on the page, which stx render draws behind all else: "
            "--max-memory has no room to find their places");
        leftOut.insert("unmeasured");
        return std::nullopt;
    }
    STX_CHECK(readAll(table, job));
    return writeUnmeasured(writer, std::as_const(*table).about(), options, job);
}

/// Writes one scene of a frame and gives its number; nothing where it has no point. `points`, if
/// any, is added to.
Result<std::optional<int>> writeScene(PageWriter& writer, std::size_t slot, PageViews& views,
                                      const PageOptions& options, PagePoints* points, Job& job) {
    PageScene scene(options.colours);
    Json pages = Json::array();
    const auto& groups = views.groups()[slot];
    for (std::size_t k = 0; k < groups.size(); ++k) {
        STX_CHECK(job.checkCancelled());
        STX_TRY(Bundle bundle, views.take(groups[k], job));
        makeViewable(bundle, job);
        if (options.colours.copies) keepExactFiles(bundle, job.limits);
        // What has no content has no texture.
        if (bundle.pointCount() == 0) continue;
        if (points) look(bundle, *points);
        STX_TRY(const Atlas atlas, packForPage(bundle, job));
        bundle.views.clear();
        STX_TRY(auto images, scene.add(atlas, job));
        STX_CHECK(writer.addImages(slot, k, std::move(images), pages));
    }
    if (pages.empty()) return std::nullopt;
    STX_TRY(const int number, writer.addScene(slot, scene.description(std::move(pages))));
    return number;
}

PageReport reportOf(const PageWriter& writer, std::size_t views, std::int64_t points,
                    std::size_t frames) {
    return {views, points, frames, writer.imageBytes(), writer.bytes()};
}

/// As of views, which have the note's words.
void noteMaterialLeftOut(const AtlasPage& page, Job& job) {
    Bundle like;
    ReferenceView& view = like.views.emplace_back();
    if (!page.metallicRoughness.empty()) view.metallicRoughness = Image<glm::vec2>(1, 1);
    if (!page.emissive.empty()) view.emissive = Image<glm::vec3>(1, 1);
    like.noteMaterialLeftOut(job);
}

void noteSize(const PageReport& report, Job& job) {
    if (report.bytes > kHard)
        job.note(fmt::format(
            "the page has {} MiB, which phones and small computers may not be able to open; "
            "smaller or fewer views, or fewer frames, make it smaller",
            report.bytes >> 20));
}

}  // namespace

void noteEnvironmentLeftOut(const std::shared_ptr<const Environment>& environment, Job& job) {
    if (environment)
        job.note(
            "pages, models, points and single pictures have no place for the environment: it is "
            "left out; stx extract to a folder writes its pictures");
}

Result<PageReport> writeViewerPage(Sequence& frames, const std::filesystem::path& path,
                                   const PageOptions& options, Job& job) {
    const Timeline& line = frames.timeline();
    std::optional<PageWriter> writer;
    Json scenes = Json::array(), data;
    PagePoints points;
    Bundle about;  // of the same frame, without images
    LeftOut leftOut;
    for (std::size_t i = 0; i < line.count(); ++i) {
        job.progress(static_cast<std::int64_t>(i), static_cast<std::int64_t>(line.count()),
                     "writing frames");
        STX_CHECK(job.checkCancelled());
        STX_TRY(auto table, frames.views(i, job));
        if (i == 0) {
            noteMaterialLeftOut(*table, job);
            noteEnvironmentLeftOut(std::as_const(*table).about().environment, job);
        }
        if (!writer)
            STX_SET(writer,
                    startPage(path, options, std::as_const(*table).about().title, line.moves()));
        STX_TRY(const auto behind, writeBehind(*writer, table, options, leftOut, job));
        const bool tells = data.is_null();  // no frame before has a point
        if (tells) about = headersOf(std::as_const(*table).about());
        STX_CHECK(leaveCoarseOut(table, leftOut, job));
        STX_TRY(auto views, PageViews::of(std::move(table), line.moves(), job));
        if (tells) {
            points.boundsKnown = about.bounds.has_value();
            if (points.boundsKnown) points.bounds = *about.bounds;
        }
        Json numbers = Json::array();
        for (std::size_t slot = 0; slot < views.groups().size(); ++slot) {
            STX_TRY(const auto number,
                    writeScene(*writer, slot, views, options, tells ? &points : nullptr, job));
            if (number) numbers.push_back(*number);
        }
        if (behind) numbers.push_back(*behind);
        scenes.push_back(std::move(numbers));
        if (tells && points.count > 0)
            STX_SET(data, dataOf(about.views, points, about.origin, line, options));
    }
    if (data.is_null()) return fail(ErrorCode::invalidInput, "none of the views has a point");
    data["frames"] = std::move(scenes);
    if (!leftOut.empty()) data["without"] = fmt::format("{}", fmt::join(leftOut, ","));
    STX_CHECK(writer->finish(data));
    const auto report = reportOf(*writer, about.views.size(), points.count, line.count());
    noteSize(report, job);
    return report;
}

Result<PageReport> writeViewerPage(const Atlas& atlas, const std::filesystem::path& path,
                                   const PageOptions& options, Job& job) {
    STX_CHECK(atlas.check());
    // A single view says by its depth how far away things are.
    const bool asItIs = atlas.views.size() > 1 && atlas.paddingHolds(PageSet::kPadding) &&
                        !atlas.pages[0].texture.isLinear() && !mayHaveCoarse(atlas.views) &&
                        std::ranges::none_of(atlas.views, [](const ReferenceView& v) {
                            return v.depthBits == 32 || v.background;
                        });
    if (!asItIs) {
        STX_TRY(auto bundle, unpack(atlas, job));
        const auto still = sequenceOf(std::move(bundle));
        return writeViewerPage(*still, path, options, job);
    }
    STX_TRY(auto writer, startPage(path, options, atlas.title, false));
    noteMaterialLeftOut(atlas.pages[0], job);
    noteEnvironmentLeftOut(atlas.environment, job);
    STX_TRY(const PageSet set, PageSet::of(atlas, job));
    PagePoints points;
    points.count = atlas.pointCount();
    points.bounds = set.bounds();
    STX_TRY(Json data, dataOf(atlas.views, points, atlas.origin, Timeline(), options));
    PageScene scene(options.colours);
    Json pages = Json::array();
    STX_TRY(auto images, scene.add(atlas, job));
    STX_CHECK(writer.addImages(0, 0, std::move(images), pages));
    STX_TRY(const int number, writer.addScene(0, scene.description(std::move(pages))));
    data["frames"] = {{number}};
    if (std::ranges::any_of(atlas.views, mayHaveUnmeasured)) {
        STX_TRY(const auto bundle, unpack(atlas, job));
        STX_TRY(const auto behind, writeUnmeasured(writer, bundle, options, job));
        if (behind) data["frames"][0].push_back(*behind);
    }
    STX_CHECK(writer.finish(data));
    const auto report = reportOf(writer, atlas.views.size(), points.count, 1);
    noteSize(report, job);
    return report;
}

}  // namespace stx

#include "formats/viewer/viewer_page.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

#include "embedded_viewer.hpp"
#include "formats/stx/stx.hpp"
#include "formats/viewer/page_scene.hpp"
#include "formats/viewer/page_text.hpp"
#include "lib/base/counted.hpp"
#include "lib/geometry/view_layout.hpp"
#include "lib/model/median_distance.hpp"
#include "lib/model/peak_memory.hpp"
#include "lib/packing/packing.hpp"
#include "lib/render/scene/page_set.hpp"

namespace stx {
namespace {

using Json = nlohmann::ordered_json;

/// Browsers need several times the size of a page to hold it.
constexpr std::uint64_t kHard = 256ull << 20;
/// Where what a page holds is put.
constexpr std::string_view kDataMark = "@DATA@";
/// Views that all look within this angle of their mean look at a scene, not around an object.
constexpr double kSameSideCosine = 0.5;
/// How far the eye goes to each side of a single view, as a share of the distance of what it turns
/// around: as far as one photograph with depth bears.
constexpr double kSingleReach = 0.08;
constexpr double kStartFovDeg = 40.0, kStartElevationDeg = 15.0;

std::string textOf(const Json& json) {
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string inHtml(std::string_view text) {
    std::string out;
    for (const char c : text) {
        switch (c) {
            case '&':
                out += "&amp;";
                break;
            case '<':
                out += "&lt;";
                break;
            case '>':
                out += "&gt;";
                break;
            case '"':
                out += "&quot;";
                break;
            default:
                out += c;
        }
    }
    // As JSON does it, what is not UTF-8 is replaced.
    return Json::parse(textOf(out));
}

/// The program of the page, its shaders and its panel, packed.
std::string packedProgram() {
    Json texts;
    for (const auto& [name, text] : {std::pair{"screen.vert", viewer::screen_vert},
                                     {"prepare.frag", viewer::prepare_frag},
                                     {"splat.vert", viewer::splat_vert},
                                     {"splat.frag", viewer::splat_frag},
                                     {"resolve.frag", viewer::resolve_frag},
                                     {"pinholes.frag", viewer::pinholes_frag},
                                     {"directions.frag", viewer::directions_frag},
                                     {"outline.vert", viewer::outline_vert},
                                     {"outline.frag", viewer::outline_frag},
                                     {"silhouettes.frag", viewer::silhouettes_frag},
                                     {"present.frag", viewer::present_frag}})
        texts[name] = withoutComments(text);
    std::string code = "\"use strict\";\nconst kPanel=" + Json(viewer::panel_html).dump() +
                       ",kShaders=" + texts.dump() + ";\n";
    for (const auto part : {viewer::png_js, viewer::camera_js, viewer::scene_js, viewer::painter_js,
                            viewer::viewer_js})
        code += withoutComments(part);
    return packedPageText(code);
}

/// What a page writes as it goes.
class PageWriter {
  public:
    PageWriter(OutputFile file, std::string_view title) : file_(std::move(file)) {
        const std::string_view shell = viewer::viewer_html;
        const std::size_t at = shell.find(kDataMark);
        head_ = shell.substr(0, at);
        end_ = shell.substr(at + kDataMark.size());
        const auto put = [](std::string& part, std::string_view mark, const std::string& text) {
            part.replace(part.find(mark), mark.size(), text);
        };
        put(head_, "@TITLE@", inHtml(title));
        put(end_, "@UNPACK@", withoutComments(viewer::unpack_js));
    }

    Result<void> begin() {
        STX_CHECK(write(kUtf16Mark));
        return write(utf16Of(head_));
    }

    /// The number of a scene; that of the frame before when it is the same.
    Result<int> add(std::size_t slot, PageScene scene) {
        Json pages = Json::array();
        if (slots_.size() <= slot) slots_.resize(slot + 1);
        Slot& before = slots_[slot];
        for (std::size_t i = 0; i < scene.pages.size(); ++i) {
            Json numbers = Json::object();
            const std::size_t owner = scene.owners[i];
            const std::size_t page = i > 0 && scene.owners[i - 1] == owner ? 1 : 0;
            for (auto& [name, bytes] : scene.pages[i]) {
                Image& last = before.images[{owner, page, name}];
                if (last.number < 0 || last.bytes != bytes) {
                    last = {images_++, std::move(bytes)};
                    report.imageBytes += last.bytes.size();
                    STX_CHECK(element(fmt::format("image{}", last.number), pageText(last.bytes)));
                }
                numbers[name] = last.number;
            }
            pages.push_back(std::move(numbers));
        }
        scene.description["pages"] = std::move(pages);
        std::string text = packedPageText(textOf(scene.description));
        if (before.number >= 0 && before.text == text) return before.number;
        before.text = std::move(text);
        before.number = scenes_++;
        STX_CHECK(element(fmt::format("scene{}", before.number), before.text));
        return before.number;
    }

    Result<void> finish(const Json& data) {
        STX_CHECK(element("data", packedPageText(textOf(data))));
        STX_CHECK(element("code", packedProgram()));
        STX_CHECK(write(utf16Of(end_)));
        return file_.commit();
    }

    PageReport report;

  private:
    struct Image {
        int number = -1;
        Bytes bytes;
    };
    struct Slot {
        /// By the atlas, its page and the name.
        std::map<std::tuple<std::size_t, std::size_t, std::string>, Image> images;
        int number = -1;
        std::string text;
    };

    Result<void> write(std::string_view text) {
        report.bytes += text.size();
        return file_.write(text);
    }
    /// `text` as pageText() gives it.
    Result<void> element(std::string_view id, std::string_view text) {
        STX_CHECK(write(utf16Of(fmt::format("<script type=\"text/plain\" id=\"{}\">", id))));
        STX_CHECK(write(text));
        return write(utf16Of("</script>\n"));
    }

    OutputFile file_;
    std::string head_, end_;
    std::vector<Slot> slots_;
    int images_ = 0, scenes_ = 0;
};

std::string titleOf(const PageOptions& options, const std::string& bundle) {
    if (!options.title.empty()) return options.title;
    return bundle.empty() ? std::filesystem::path(options.input).filename().string() : bundle;
}

Result<PageWriter> startPage(const std::filesystem::path& path, const PageOptions& options,
                             const std::string& title) {
    STX_TRY(auto file, OutputFile::create(path, options.output));
    PageWriter writer(std::move(file), titleOf(options, title));
    STX_CHECK(writer.begin());
    return writer;
}

/// The pose of a single view, around whose median distance the page turns a little.
Json startOfSingle(const ReferenceView& view) {
    const Camera& c = view.camera;
    const double distance = medianDistance(view);
    const glm::dvec3 target = c.position + c.forward() * (distance > 0 ? distance : view.nearPlane);
    Json j;
    j["eye"] = listOf(c.position);
    j["target"] = listOf(target);
    // That of `stx render --eye`, unless the camera is tilted sideways against it.
    const glm::dvec3 up = upOfCameras({c}), right = c.orientation * glm::dvec3(1, 0, 0);
    const bool upright = std::abs(glm::dot(right, up)) < 1e-6;
    j["up"] = listOf(upright ? up : c.orientation * glm::dvec3(0, 1, 0));
    j["fov"] = glm::degrees(2 * std::atan(0.5 * c.height / c.fy));
    j["centre"] = listOf(target);
    j["radius"] = std::max(distance, 1e-9);
    j["around"] = false;
    j["turn"] = std::atan(kSingleReach);
    return j;
}

/// Where the page begins: in front of an object, or, where all views look from one side, where the
/// one in their middle is.
Result<Json> startOf(const std::vector<Camera>& cameras, const Bounds& bounds) {
    const glm::dvec3 centre = bounds.empty() ? glm::dvec3(0) : bounds.centre();
    const double radius = bounds.empty() ? 1.0 : std::max(bounds.radius(), 1e-9);
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
Result<Json> dataOf(const std::vector<ReferenceView>& views, const Bounds& bounds,
                    glm::dvec3 origin, const Timeline& line, const PageOptions& options,
                    const PageReport& report) {
    std::vector<Camera> cameras;
    const ReferenceView* single = nullptr;
    Json listed = Json::array();
    for (const ReferenceView& view : views) {
        if (view.background) continue;
        cameras.push_back(view.camera);
        single = cameras.size() == 1 && !view.camera.orthographic ? &view : nullptr;
        Json j = pageCamera(view.camera, view.name);
        const Camera& c = view.camera;
        j["fov"] = c.orthographic ? 0.0 : glm::degrees(2 * std::atan(0.5 * c.height / c.fy));
        listed.push_back(std::move(j));
    }
    if (cameras.empty()) {
        for (const ReferenceView& view : views) cameras.push_back(view.camera);
    }
    Json j;
    j["version"] = 1;
    j["input"] = options.input;
    j["facts"] = fmt::format("{}, {}", counted(views.size(), "view"),
                             counted(static_cast<std::size_t>(report.points), "point"));
    j["origin"] = listOf(origin);
    if (single) {
        j["start"] = startOfSingle(*single);
    } else {
        STX_TRY(j["start"], startOf(cameras, bounds));
    }
    j["cameras"] = std::move(listed);
    j["times"] = line.times;
    j["end"] = line.end;
    j["slack"] = line.slack(line.end);
    return j;
}

/// Takes the views of one kind out of a bundle.
Bundle takePart(Bundle& bundle, bool background) {
    Bundle out;
    out.title = bundle.title;
    out.origin = bundle.origin;
    for (ReferenceView& view : bundle.views)
        if (view.background == background) out.views.push_back(std::move(view));
    std::erase_if(bundle.views,
                  [&](const ReferenceView& view) { return view.background == background; });
    return out;
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
            "pages and models have no place for the environment: it is left out; stx extract to a "
            "folder writes its pictures");
}

Result<PageReport> writeViewerPage(Sequence& frames, const std::filesystem::path& path,
                                   const PageOptions& options, Job& job) {
    const Timeline& line = frames.timeline();
    std::optional<PageWriter> writer;
    Json scenes = Json::array(), data;
    for (std::size_t i = 0; i < line.count(); ++i) {
        job.progress(static_cast<std::int64_t>(i), static_cast<std::int64_t>(line.count()),
                     "writing frames");
        STX_CHECK(job.checkCancelled());
        STX_TRY(Bundle bundle, frames.frame(i, job));
        STX_CHECK(checkPeak(peak::kPage, bundle.views, job.limits));
        makeViewable(bundle, job);
        if (options.colours.copies) keepExactFiles(bundle, job.limits);
        if (!writer) {
            bundle.noteMaterialLeftOut(job);
            noteEnvironmentLeftOut(bundle.environment, job);
            STX_TRY(writer, startPage(path, options, bundle.title));
            writer->report.views = bundle.views.size();
            writer->report.points = bundle.pointCount();
            writer->report.frames = line.count();
            STX_TRY(data,
                    dataOf(bundle.views, bundle.bounds ? *bundle.bounds : bundle.computeBounds(),
                           bundle.origin, line, options, writer->report));
        }
        // What is there now first, then what is behind it; a set of background alone is drawn as
        // any.
        Json numbers = Json::array();
        std::vector<Bundle> parts;
        parts.push_back(takePart(bundle, false));
        parts.push_back(takePart(bundle, true));
        std::erase_if(parts, [](const Bundle& b) { return b.views.empty(); });
        for (std::size_t k = 0; k < parts.size(); ++k) {
            STX_TRY(const auto atlases, packForPage(parts[k], line.moves(), job));
            parts[k].views.clear();
            STX_TRY(auto scene, pageScene(atlases, options.colours, job));
            STX_TRY(const int number, writer->add(k, std::move(scene)));
            numbers.push_back(number);
        }
        scenes.push_back(std::move(numbers));
    }
    data["frames"] = std::move(scenes);
    STX_CHECK(writer->finish(data));
    noteSize(writer->report, job);
    return writer->report;
}

Result<PageReport> writeViewerPage(const Atlas& atlas, const std::filesystem::path& path,
                                   const PageOptions& options, Job& job) {
    STX_CHECK(atlas.check());
    // A single view tells its page by its depth how far away things are.
    const bool asItIs = atlas.views.size() > 1 && atlas.paddingHolds(PageSet::kPadding) &&
                        !atlas.pages[0].texture.isLinear() &&
                        std::ranges::none_of(atlas.views, [](const ReferenceView& v) {
                            return v.depthBits == 32 || v.background;
                        });
    if (!asItIs) {
        STX_TRY(auto bundle, unpack(atlas, job));
        const auto still = sequenceOf(std::move(bundle));
        return writeViewerPage(*still, path, options, job);
    }
    STX_TRY(auto writer, startPage(path, options, atlas.title));
    writer.report.views = atlas.views.size();
    writer.report.points = atlas.pointCount();
    writer.report.frames = 1;
    noteEnvironmentLeftOut(atlas.environment, job);
    STX_TRY(const PageSet set, PageSet::of(atlas, job));
    STX_TRY(Json data,
            dataOf(atlas.views, set.bounds(), atlas.origin, Timeline(), options, writer.report));
    STX_TRY(auto scene, pageScene({&atlas, 1}, options.colours, job));
    STX_TRY(const int number, writer.add(0, std::move(scene)));
    data["frames"] = {{number}};
    STX_CHECK(writer.finish(data));
    noteSize(writer.report, job);
    return writer.report;
}

}  // namespace stx

#include "formats/any/info.hpp"

#include <algorithm>

#include "formats/any/info_agreement.hpp"
#include "formats/any/info_memory.hpp"
#include "formats/any/info_photo.hpp"
#include "formats/any/open.hpp"
#include "formats/any/sequences.hpp"
#include "formats/atlas/atlas_files.hpp"
#include "formats/exr/bundle_exr.hpp"
#include "formats/files/no_case.hpp"
#include "formats/files/numbered.hpp"
#include "formats/imagesets/set_views.hpp"
#include "formats/imagesets/summary.hpp"
#include "formats/meshes/meshes.hpp"
#include "formats/mpeg4/mapping/background.hpp"
#include "formats/mpeg4/mapping/scene_sequence.hpp"
#include "formats/mpeg4/mpeg4.hpp"
#include "lib/model/splat_cloud.hpp"
#include "lib/packing/packing.hpp"

namespace stx {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// Of a file, or of those that lie in a folder.
std::uint64_t bytesAt(const fs::path& path) {
    std::error_code ec;
    if (!fs::is_directory(path, ec)) return fs::file_size(path, ec);
    std::uint64_t bytes = 0;
    for (const auto& entry : fs::directory_iterator(path, ec))
        if (entry.is_regular_file(ec)) bytes += entry.file_size(ec);
    return bytes;
}

Json vectorJson(glm::dvec3 v) {
    return {v.x, v.y, v.z};
}

/// In the world: `origin` is what `b` counts from.
Json boundsJson(const Bounds& b, glm::dvec3 origin) {
    return {{"min", vectorJson(b.min + origin)}, {"max", vectorJson(b.max + origin)}};
}

void addLens(const Camera& camera, Json& j) {
    const auto fov = camera.fieldOfView();
    j["fieldOfView"] = {fov.x, fov.y};
    j["orthographic"] = camera.orthographic;
    if (!camera.centred(1e-6))
        j["intrinsics"] = {
            {"fx", camera.fx}, {"fy", camera.fy}, {"cx", camera.cx}, {"cy", camera.cy}};
}

void addOrigin(Json& out, glm::dvec3 origin) {
    if (origin != glm::dvec3(0.0)) out["origin"] = vectorJson(origin);
}

Json viewJson(const ReferenceView& view, glm::dvec3 origin) {
    const auto axisAngle = axisAngleFromQuat(view.camera.orientation);
    Json j = {{"name", view.name},
              {"width", view.camera.width},
              {"height", view.camera.height},
              {"depthBits", view.depthBits},
              {"position", vectorJson(view.camera.position + origin)},
              {"orientation", {axisAngle.x, axisAngle.y, axisAngle.z, axisAngle.w}},
              {"nearPlane", view.nearPlane},
              {"farPlane", view.farPlane}};
    addLens(view.camera, j);
    j["noDepth"] = nameOf(view.noDepth);
    if (!view.refined.steps.empty())
        j["refined"] = Refined{view.refined.steps, view.refined.doubt}.text();
    if (const auto& move = view.refined.moved)
        j["moved"] = {{"shift", vectorJson(move->shift)},
                      {"turn", {move->turn.x, move->turn.y, move->turn.z, move->turn.w}}};
    if (view.pruned) j["pruned"] = true;
    if (view.background) j["background"] = true;
    return j;
}

/// What is known of an environment without its pixels.
Json environmentJson(const Environment& e, glm::ivec2 size, const std::vector<CubeFace>& faces) {
    Json j = {{"layout", e.layout == Environment::Layout::cube ? "cube" : "equirectangular"}};
    if (size.x > 0) {
        j["width"] = size.x;
        j["height"] = size.y;
    }
    auto names = Json::array();
    for (const CubeFace face : faces)
        names.push_back(kCubeFaceNames[static_cast<std::size_t>(face)]);
    if (e.layout == Environment::Layout::cube) j["faces"] = std::move(names);
    j["skyColours"] = e.skyColours.size();
    j["groundColours"] = e.groundColours.size();
    const auto turn = axisAngleFromQuat(e.orientation);
    j["orientation"] = {turn.x, turn.y, turn.z, turn.w};
    return j;
}

/// Of the first Background of a scene; sizes are those of the first picture.
void addBackground(const mpeg4::Document& document, const mpeg4::StreamImages& images, Json& out,
                   const Limits& limits) {
    if (document.frames.empty()) return;
    const auto scene = mpeg4::sceneAtStart(document, images, false);
    const auto shown = scene ? mpeg4::shownScene(scene->root, limits)
                             : Result<mpeg4::ShownScene>(tl::unexpected(scene.error()));
    if (!shown || shown->backgrounds.empty()) return;
    const mpeg4::ShownBackground& first = shown->backgrounds.front();
    Environment e;
    e.orientation = glm::normalize(first.worldFromLocal);
    e.skyColours.resize(first.node->get<std::vector<mpeg4::Color>>("skyColor").size());
    e.groundColours.resize(first.node->get<std::vector<mpeg4::Color>>("groundColor").size());
    glm::ivec2 size(0);
    std::vector<CubeFace> faces;
    for (int f = 0; f < 6; ++f) {
        const auto texture = mpeg4::faceTexture(*first.node, static_cast<CubeFace>(f));
        if (!texture) continue;
        faces.push_back(static_cast<CubeFace>(f));
        if (const auto info = images.probe(*texture); info && size.x == 0)
            size = {info->width, info->height};
    }
    out["environment"] = environmentJson(e, size, faces);
}

Json splatsJson(const SplatCloud& cloud) {
    constexpr float kNearlyTransparent = 0.1f;
    const auto faint = std::ranges::count_if(
        cloud.opacities, [](float opacity) { return opacity < kNearlyTransparent; });
    return {{"count", cloud.positions.size()},
            {"degree", cloud.degree},
            {"nearlyTransparent", faint},
            {"colourSpace", cloud.linear ? "linear" : "sRGB"},
            {"up", cloud.up.y < 0 ? "-Y" : "Y"}};
}

/// Fills in what only the pixels show.
Result<void> addFromPixels(Json& out, const ViewTable& table, Job& job) {
    const Bundle& about = table.about();
    std::vector<std::int64_t> pointsOf(table.count());
    std::vector<Bounds> boundsOf(table.count());
    STX_CHECK(forEachView(table, {"counting points", 0}, job,
                          [&](std::size_t i, auto view) -> Result<void> {
                              pointsOf[i] = view->pointCount();
                              if (!about.bounds) boundsOf[i] = view->computeBounds();
                              return {};
                          }));
    std::int64_t points = 0;
    Bounds bounds;
    // A panorama becomes several views.
    const bool each = table.count() == out["views"].size();
    for (std::size_t i = 0; i < table.count(); ++i) {
        if (each) out["views"][i]["points"] = pointsOf[i];
        points += pointsOf[i];
        if (boundsOf[i].empty()) continue;
        bounds.add(boundsOf[i].min);
        bounds.add(boundsOf[i].max);
    }
    out["points"] = points;
    if (!out.contains("bounds"))
        out["bounds"] = boundsJson(about.bounds ? *about.bounds : bounds, about.origin);
    return {};
}

Result<void> describeExr(const fs::path& path, Json& out, Job& job) {
    STX_TRY(const auto reader, ExrReader::open(path, job.limits));
    const int at = environmentPartOf(reader);
    if (at >= 0 && exrViewParts(reader).empty()) {
        STX_TRY(auto e, within(reader.where(), environmentHeader(reader.parts()[at])));
        out["container"] = "exr";
        out["views"] = Json::array();
        out["environment"] = environmentJson(e.environment, e.size, e.faces);
        return {};
    }
    STX_TRY(auto header, readExrBundleHeader(reader));
    STX_CHECK(measureForeignViews(reader, header));
    out["container"] = "exr";
    out["nodeKind"] = header.nodeKind();
    if (!header.title.empty()) out["title"] = header.title;
    auto views = Json::array();
    auto streams = Json::array();
    std::int64_t points = 0;
    for (const auto& v : header.views) {
        auto j = viewJson(v.view, header.origin);
        if (v.points >= 0) j["points"] = v.points;
        points = v.points < 0 || points < 0 ? -1 : points + v.points;
        j["normals"] = v.normals;
        j["splats"] = v.splats;
        if (v.metallicRoughness) j["metallicRoughness"] = true;
        if (v.emissive) j["emissive"] = true;
        j["bytes"] = v.bytes;
        views.push_back(std::move(j));
        streams.push_back({{"name", v.view.name}, {"kind", "part"}, {"bytes", v.bytes}});
    }
    out["views"] = std::move(views);
    if (points >= 0) out["points"] = points;
    addOrigin(out, header.origin);
    if (header.bounds) out["bounds"] = boundsJson(*header.bounds, header.origin);
    if (const auto& e = header.environment) {
        out["environment"] = environmentJson(e->environment, e->size, e->faces);
        streams.push_back({{"name", "environment"}, {"kind", "part"}, {"bytes", e->bytes}});
    }
    out["streams"] = std::move(streams);
    return {};
}

/// Of what moves: frames, duration in seconds, and the rate where it is steady.
void addTime(Json& out, const Timeline& timeline) {
    if (!timeline.moves()) return;
    out["frames"] = timeline.count();
    if (timeline.start() != 0) out["start"] = timeline.start();
    out["duration"] = timeline.duration();
    if (const double rate = timeline.rate(); rate > 0) out["rate"] = rate;
}

const char* streamKind(const mpeg4::ElementaryStream& stream) {
    switch (stream.objectTypeIndication) {
        case mpeg4::oti::kJpeg:
            return "jpeg";
        case mpeg4::oti::kPng:
            return "png";
        default:
            return "stream";
    }
}

Result<void> describeMpeg4(const fs::path& path, Json& out, Job& job) {
    STX_TRY(const auto document, readMpeg4(path, job));
    STX_TRY(const auto source, ByteSource::open(path));
    STX_TRY(const auto container, mpeg4ContainerOf(source, path));
    out["container"] = container == Mpeg4Container::bt    ? "bt"
                       : container == Mpeg4Container::xmt ? "xmt"
                                                          : "mp4";
    mpeg4::SceneReadOptions options;
    options.folder = folderOf(path);
    options.pixels = false;
    options.mayBeEmpty = true;
    options.noteMotion = false;
    STX_TRY(const auto bundle, within(fmt::format("'{}'", path.string()),
                                      mpeg4::bundleFromScene(document, options, job)));
    out["nodeKind"] = mpeg4::nodeKindOf(document);
    if (!bundle.title.empty()) out["title"] = bundle.title;
    auto views = Json::array();
    for (const auto& v : bundle.views) views.push_back(viewJson(v, bundle.origin));
    out["views"] = std::move(views);
    addOrigin(out, bundle.origin);
    if (bundle.bounds) out["bounds"] = boundsJson(*bundle.bounds, bundle.origin);
    STX_TRY(const auto images, mpeg4::StreamImages::make(document, options.folder, job.limits));
    STX_TRY(const auto timeline, mpeg4::timelineOf(document, images, false, &job));
    addTime(out, timeline);
    addBackground(document, images, out, job.limits);
    auto streams = Json::array();
    const auto add = [&](const mpeg4::ElementaryStream& stream, const std::string& name,
                         const char* kind) {
        std::uint64_t bytes = 0;
        for (const auto& sample : stream.samples) bytes += sample.data.size;
        streams.push_back({{"name", name}, {"kind", kind}, {"bytes", bytes}});
        if (stream.samples.size() > 1) streams.back()["pictures"] = stream.samples.size();
    };
    if (!document.sceneStream.samples.empty()) add(document.sceneStream, "scene", "bifs");
    if (!document.odStream.samples.empty()) add(document.odStream, "object descriptors", "od");
    // Those of the start, which the views are of, and what comes later with its time.
    for (const auto& frame : document.odFrames) {
        for (const auto& command : frame.commands) {
            const auto* update = std::get_if<mpeg4::UpdateObjectDescriptors>(&command);
            if (!update) continue;
            for (const auto& descriptor : update->descriptors) {
                for (const auto& stream : descriptor.streams) {
                    add(stream, fmt::format("od {}", descriptor.id), streamKind(stream));
                    if (&frame != &document.odFrames.front())
                        streams.back()["time"] =
                            static_cast<double>(frame.time) / document.odStream.timescale;
                }
            }
        }
    }
    out["streams"] = std::move(streams);
    return {};
}

/// Each object of an atlas: what it has, and what share of the textures.
Json objectsJson(const AtlasHeader& header) {
    auto objects = Json::array();
    const double area = static_cast<double>(header.pageWidth) * header.pageHeight * header.pages;
    for (const auto& o : header.atlas.objects) {
        const auto covered = coveredPixels(header.atlas.rectangles, o.firstView, o.views);
        objects.push_back({{"name", o.name},
                           {"firstView", o.firstView},
                           {"views", o.views},
                           {"used", static_cast<double>(covered) / area},
                           {"pixels", {{"source", o.sourcePixels}, {"kept", o.keptPixels}}}});
        Json& entry = objects.back();
        if (!o.title.empty()) entry["title"] = o.title;
        addOrigin(entry, o.origin);
        if (o.bounds) entry["bounds"] = boundsJson(*o.bounds, o.origin);
    }
    return objects;
}

/// What the camera of a view counts from: objects that share an atlas lie in worlds of their own.
glm::dvec3 originOfView(const Atlas& atlas, int view) {
    for (const AtlasObject& o : atlas.objects)
        if (view >= o.firstView && view < o.firstView + o.views) return o.origin;
    return atlas.origin;
}

Result<void> describeAtlas(const fs::path& path, const std::string& object, Json& out, Job& job) {
    STX_TRY(auto header, readAtlasHeader(path, job.limits));
    if (!object.empty()) {
        if (const auto kept = keepObject(header.atlas, object); !kept)
            return tl::unexpected(Error(kept.error()).at(fmt::format("'{}'", path.string())));
        out["object"] = object;
    }
    out["container"] =
        fs::is_regular_file(path) && lowerExtension(path) == ".exr" ? "atlas-exr" : "atlas";
    bool second = false;
    auto textures = Json::array();
    for (const auto& t : header.textures) {
        second = second || t.attribute == "normal" || t.attribute == "splat";
        textures.push_back({{"attribute", t.attribute},
                            {"width", t.width},
                            {"height", t.height},
                            {"page", t.page},
                            {"file", t.file},
                            {"coding", t.coding},
                            {"bytes", t.bytes}});
    }
    out["nodeKind"] = second ? "SimpleTextureV2" : "SimpleTexture";
    if (!header.atlas.title.empty()) out["title"] = header.atlas.title;
    auto views = Json::array();
    for (const auto& v : header.atlas.views)
        views.push_back(viewJson(v, originOfView(header.atlas, static_cast<int>(views.size()))));
    out["views"] = std::move(views);
    out["textures"] = std::move(textures);
    auto rectangles = Json::array();
    for (const auto& r : header.atlas.rectangles)
        rectangles.push_back({{"view", r.view},
                              {"page", r.page},
                              {"viewX", r.viewX},
                              {"viewY", r.viewY},
                              {"width", r.width},
                              {"height", r.height},
                              {"atlasX", r.atlasX},
                              {"atlasY", r.atlasY},
                              {"turned", r.turned}});
    out["rectangles"] = std::move(rectangles);
    out["used"] = header.used();
    if (!header.atlas.objects.empty()) out["objects"] = objectsJson(header);
    out["pixels"] = {{"source", header.atlas.sourcePixels}, {"kept", header.atlas.keptPixels}};
    addOrigin(out, header.atlas.origin);
    if (header.atlas.bounds) out["bounds"] = boundsJson(*header.atlas.bounds, header.atlas.origin);
    const bool folder = !header.environmentFile.empty();
    if (!folder && out["container"] != "atlas-exr") return {};
    fs::path file = path;
    if (folder)
        STX_SET(file, resolveInside(fs::is_directory(path) ? path : folderOf(path),
                                    header.environmentFile, job.limits));
    STX_TRY(const auto reader, ExrReader::open(file, job.limits));
    if (const int at = environmentPartOf(reader); at >= 0) {
        STX_TRY(const auto e, environmentHeader(reader.parts()[at]));
        out["environment"] = environmentJson(e.environment, e.size, e.faces);
    }
    return {};
}

Result<void> describeSet(const fs::path& path, Json& out, Job& job) {
    STX_TRY(const auto set, summariseImageSet(path, job));
    out["container"] = "imageset";
    out["bytes"] = set.bytes;
    out["imageSet"] = set.kind;
    if (!set.title.empty()) out["title"] = set.title;
    out["frames"] = set.frames;
    addTime(out, set.timeline);
    auto views = Json::array();
    int missing = 0;
    for (const auto& view : set.views) {
        const Camera& c = view.camera;
        Json j = {{"name", view.name}, {"width", c.width}, {"height", c.height}};
        if (!view.colour.empty()) j["colour"] = view.colour;
        if (!view.depth.empty()) j["depth"] = view.depth;
        if (!view.missing.empty()) j["missing"] = view.missing;
        missing += static_cast<int>(view.missing.size());
        if (view.lost) {
            j["lost"] = true;
        } else if (set.camerasKnown) {
            const auto turn = axisAngleFromQuat(c.orientation);
            j["position"] = vectorJson(c.position);
            j["orientation"] = {turn.x, turn.y, turn.z, turn.w};
            if (view.panorama)
                j["panorama"] = true;
            else if (c.width > 0)
                addLens(c, j);
        }
        views.push_back(std::move(j));
    }
    out["views"] = std::move(views);
    out["missing"] = missing;
    if (set.photo) out["photo"] = photoJson(*set.photo, set.views.front().camera, set.cameraFrom);
    return {};
}

/// The first of the files, and how long all of them take.
Result<Json> describeNumbered(const fs::path& path, const InfoOptions& options, Job& job) {
    STX_TRY(const auto files, numberedFiles(path.string()));
    OpenOptions open;
    open.object = options.object;
    STX_TRY(const auto film, openNumbered(path, open, job));
    STX_TRY(Json out, describe(files.front().path, options, job));
    out["file"] = path.string();
    std::uint64_t bytes = 0;
    for (const NumberedFile& file : files) bytes += bytesAt(file.path);
    out["bytes"] = bytes;
    addTime(out, film.frames->timeline());
    if (!out.contains("bounds") || files.size() < 2) return out;
    if (film.bounds)
        out["bounds"] = boundsJson(film.bounds->bounds, film.bounds->origin);
    else
        job.note("bounds are those of the first frame: headers do not tell those of all");
    return out;
}

Result<void> describeMesh(const fs::path& path, const InfoOptions& options, Json& out, Job& job) {
    if (options.agreement)
        return fail(ErrorCode::usage,
                    "'{}' is a mesh, which has no views that could agree; leave out "
                    "--agreement",
                    path.string());
    if (options.memory)
        return fail(ErrorCode::usage,
                    "'{}' is a mesh; what its views take depends on --views and --size of "
                    "stx convert; leave out --memory",
                    path.string());
    STX_TRY(const auto mesh, readMesh(path, job));
    out["container"] = "mesh";
    out["triangles"] = mesh.triangles.size();
    out["vertices"] = mesh.positions.size();
    out["points"] = mesh.points.size();
    out["materials"] = mesh.materials.size();
    auto textures = Json::array();
    for (const auto& t : mesh.textures)
        textures.push_back(
            {{"attribute", "colour"}, {"width", t.pixels.width()}, {"height", t.pixels.height()}});
    out["textures"] = std::move(textures);
    if (mesh.splats) out["splats"] = splatsJson(*mesh.splats);
    addOrigin(out, mesh.origin);
    out["bounds"] = boundsJson(mesh.bounds(), mesh.origin);
    return {};
}

/// What commands take of an image set at a moment, as far as that shows before it is read.
Result<Json> memoryOfSet(const fs::path& path, std::size_t frames, Job& job) {
    Job quiet;  // it has been described
    quiet.workFor(job);
    STX_TRY(const auto set, summariseImageSet(path, quiet));
    std::uint64_t bytes = 0;
    bool alone = true;
    auto views = Json::array();
    for (const auto& view : set.views) {
        if (view.later) continue;
        const Camera& c = view.camera;
        views.push_back({{"name", view.name}, {"width", c.width}, {"height", c.height}});
        bytes += ViewImageKinds().bytesPerPixel() * static_cast<std::uint64_t>(c.width) *
                 static_cast<std::uint64_t>(c.height);
        alone = alone && !view.panorama && !view.video;
    }
    const bool onDemand = alone && views.size() > 1 && bytes > heldWhole(job.limits);
    return memoryOfSizes(views, frames, onDemand, job.limits);
}

/// What takes more than headers: what of the pixels was asked for.
Result<void> addMeasured(const fs::path& path, FileKind kind, const InfoOptions& options,
                         const OpenOptions& open, Json& out, Job& job) {
    const bool bounds = options.bounds && (!out.contains("bounds") || !out.contains("points"));
    if (bounds || options.agreement) {
        STX_TRY(const auto table, openViews(path, open, job));
        if (bounds) STX_CHECK(addFromPixels(out, *table, job));
        // An import names views that are off by itself.
        if (options.agreement)
            STX_SET(out["agreement"], agreementJson(*table, out["container"] != "imageset", job));
    }
    if (options.memory) {
        const auto memory = [&]() -> Result<Json> {
            const bool onDemand = kind == FileKind::mpeg4 || out["container"] == "exr";
            const auto frames = out.value("frames", std::size_t{1});
            if (kind == FileKind::imageSet) return memoryOfSet(path, frames, job);
            if (!onDemand) return memoryOfSizes(out["views"], frames, false, job.limits);
            STX_TRY(const auto table, openViews(path, open, job));
            const bool keeps = kind == FileKind::mpeg4 && frames > 1;
            return memoryJson(*table, frames, keeps ? mpeg4::keptPictureBytes(job.limits) : 0, job);
        };
        STX_TRY(out["memory"], within(fmt::format("'{}'", path.string()), memory()));
    }
    return {};
}

}  // namespace

Result<Json> describe(const fs::path& path, const InfoOptions& options, Job& job) {
    STX_TRY(const auto kind, recognise(path));
    OpenOptions open;
    open.object = options.object;
    STX_CHECK(checkObject(path, kind, open));
    if (kind == FileKind::numbered) return describeNumbered(path, options, job);
    Json out = {{"$schema", "info.schema.json"}, {"file", path.string()}};
    out["bytes"] = bytesAt(path);
    switch (kind) {
        case FileKind::exr:
            if (auto ok = describeExr(path, out, job); !ok) {
                // Of another program: then it may be a set by itself.
                const auto reader = ExrReader::open(path, job.limits);
                const bool ours = !reader || isExrBundle(*reader);
                if (ours || !describeSet(path, out, job)) return propagate(ok);
            }
            break;
        case FileKind::mpeg4:
            STX_CHECK(describeMpeg4(path, out, job));
            break;
        case FileKind::atlas:
            STX_CHECK(describeAtlas(path, options.object, out, job));
            break;
        case FileKind::mesh:
            STX_CHECK(describeMesh(path, options, out, job));
            return out;
        case FileKind::imageSet:
        case FileKind::photo:
            STX_CHECK(describeSet(path, out, job));
            break;
        case FileKind::numbered:  // described above
        case FileKind::image:
        case FileKind::unknown:
            return tl::unexpected(unknownInput(path));
    }
    STX_CHECK(addMeasured(path, kind, options, open, out, job));
    return out;
}

}  // namespace stx

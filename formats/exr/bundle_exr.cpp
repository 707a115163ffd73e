#include "formats/exr/bundle_exr.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "formats/exr/environment_exr.hpp"
#include "formats/exr/exr_colour.hpp"
#include "lib/base/parallel_try.hpp"

// Our attributes, all exact.
//   each part: stx:position (v3d) · stx:orientation (text: axis x y z, angle in radians) ·
//              stx:quaternion (text: w x y z) · stx:fieldOfView (v2d) · stx:orthographic (int) ·
//              stx:fx, stx:fy, stx:cx, stx:cy (double, pixels) · stx:nearPlane, stx:farPlane
//              (double) · stx:depthBits (int) · stx:points (double) · stx:noDepth ("unknown" or
//              "empty", which is left out) · stx:refined (text: see Refined::text()) · stx:pruned
//              (int, 1; of pruned views only) · stx:background (int, 1; of background views only) ·
//              stx:summary (text: see ViewSummary::text(); of views that are known to be exact)
//   part 0:    stx:version (int) · stx:kind ("bundle") · stx:colour ("sRGB8" or "linear") ·
//              stx:title (text) · stx:boundsMin, stx:boundsMax (v3d) · stx:origin (v3d; where it
//              is not 0: added to positions and bounds, gives the world's) · stx:time (double,
//              seconds by the sequence's clock; of a frame of a sequence) · stx:duration (double,
//              seconds that it is shown)
//   A view's further channels: surface.metallic, surface.roughness; emissive.R to emissive.B
//   the last:  the environment, where there is one: environment_exr.hpp
namespace stx {

namespace {

constexpr std::int64_t kVersion = 1;

using Type = ExrChannel::Type;

/// Channels of what engines need; null ends a shorter list.
using Names = std::array<const char*, 3>;
constexpr Names kSurface = {"surface.metallic", "surface.roughness", nullptr};
constexpr Names kEmissive = {"emissive.R", "emissive.G", "emissive.B"};

bool hasAll(const ExrPart& part, const Names& names) {
    return std::all_of(names.begin(), names.end(),
                       [&](const char* name) { return !name || part.channel(name); });
}

/// `first` is of interleaved values, as many as names.
template <class Pixels, class Pointer>
void addNamedPixels(std::vector<Pixels>& pixels, const Names& names, Pointer first) {
    const std::size_t count = names[2] ? 3 : 2;
    for (std::size_t i = 0; i < count; ++i) pixels.push_back({names[i], first + i, count});
}

void addVectorChannels(std::vector<ExrChannel>& channels, const std::string& name) {
    for (const char* axis : {".X", ".Y", ".Z"}) channels.push_back({name + axis, Type::float32});
}

template <class Pixels, class Pointer>
void addVectorPixels(std::vector<Pixels>& pixels, const std::string& name, Pointer first) {
    pixels.push_back({name + ".X", first, 3});
    pixels.push_back({name + ".Y", first + 1, 3});
    pixels.push_back({name + ".Z", first + 2, 3});
}

/// Names of parts must be there and differ.
std::vector<std::string> partNames(const Bundle& bundle) {
    std::vector<std::string> names;
    std::set<std::string> used;
    for (std::size_t i = 0; i < bundle.views.size(); ++i) {
        std::string name = bundle.views[i].name;
        if (name.empty()) name = fmt::format("view_{}", i);
        while (!used.insert(name).second) name += fmt::format("_{}", i);
        names.push_back(std::move(name));
    }
    return names;
}

/// OpenEXR wants one pixel aspect ratio in all parts; 1 when they differ, the exact one is ours.
double commonAspect(const Bundle& bundle) {
    const auto aspect = [](const ReferenceView& v) { return v.camera.fy / v.camera.fx; };
    const double first = aspect(bundle.views[0]);
    for (const auto& v : bundle.views) {
        if (std::abs(aspect(v) - first) > 1e-6 * first) return 1.0;
    }
    return std::abs(first - 1.0) < 1e-6 || first < 1e-5 || first > 1e5 ? 1.0 : first;
}

/// What pixels say of a view: its planes, where the table does not know them, and its points.
void setPixelAttributes(ExrPart& part, const ReferenceView& view, std::int64_t points) {
    setExrCamera(part, view);
    part.attributes["stx:points"] = static_cast<double>(points);
}

void setBounds(ExrPart& first, const Bounds& bounds) {
    first.attributes["stx:boundsMin"] = bounds.min;
    first.attributes["stx:boundsMax"] = bounds.max;
}

/// The parts as far as they are known before the pixels are.
std::vector<ExrPart> partsFrom(const ViewTable& table) {
    const Bundle& bundle = table.about();
    glm::ivec2 display(0);
    for (const auto& v : bundle.views)
        display = glm::max(display, glm::ivec2(v.camera.width, v.camera.height));
    const auto names = partNames(bundle);
    const double aspect = commonAspect(bundle);
    std::vector<ExrPart> parts;
    for (std::size_t i = 0; i < bundle.views.size(); ++i) {
        const ReferenceView& view = bundle.views[i];
        const ViewImageKinds& kinds = table.kindsOf(i);
        ExrPart part;
        part.name = names[i];
        part.view = names[i];
        part.width = view.camera.width;
        part.height = view.camera.height;
        part.displayWidth = display.x;
        part.displayHeight = display.y;
        part.pixelAspectRatio = aspect;
        setPixelAttributes(part, view, 0);
        const Type colour = kinds.linear ? Type::float32 : Type::half;
        for (const char* name : {"R", "G", "B", "A"}) part.channels.push_back({name, colour});
        part.channels.push_back({"Z", Type::float32});
        if (kinds.normal) addVectorChannels(part.channels, "N");
        if (kinds.splatU) addVectorChannels(part.channels, "splatU");
        if (kinds.splatV) addVectorChannels(part.channels, "splatV");
        for (const auto& [name, there] :
             {std::pair{kSurface, kinds.metallicRoughness}, std::pair{kEmissive, kinds.emissive}}) {
            if (!there) continue;
            for (const char* channel : name) {
                if (channel) part.channels.push_back({channel, Type::float32});
            }
        }
        parts.push_back(std::move(part));
    }
    auto& first = parts[0].attributes;
    first["stx:version"] = kVersion;
    first["stx:kind"] = std::string("bundle");
    first["stx:colour"] = std::string(table.kindsOf(0).linear ? "linear" : "sRGB8");
    if (!bundle.title.empty()) first["stx:title"] = bundle.title;
    setExrOrigin(parts[0], bundle.origin);
    if (bundle.time) first["stx:time"] = *bundle.time;
    if (bundle.duration) first["stx:duration"] = *bundle.duration;
    return parts;
}

Result<void> writeView(ExrWriter& writer, int index, const ReferenceView& view) {
    // A whole view's colours as floats would be twice the view.
    Image<glm::vec4> colour;
    return writer.writePart(index, [&](int y, int rows) {
        colour = premultipliedLinear(view.texture, y, rows);
        const float* rgba = &colour.data()->x;
        std::vector<ExrConstPixels> pixels = {{"R", rgba, 4},
                                              {"G", rgba + 1, 4},
                                              {"B", rgba + 2, 4},
                                              {"A", rgba + 3, 4},
                                              {"Z", view.depth.row(y).data(), 1}};
        const auto add = [&](const char* name, const Image<glm::vec3>& image) {
            if (!image.empty()) addVectorPixels(pixels, name, &image.row(y).data()->x);
        };
        add("N", view.normal);
        add("splatU", view.splatU);
        add("splatV", view.splatV);
        if (!view.metallicRoughness.empty())
            addNamedPixels(pixels, kSurface, &view.metallicRoughness.row(y).data()->x);
        if (!view.emissive.empty())
            addNamedPixels(pixels, kEmissive, &view.emissive.row(y).data()->x);
        return pixels;
    });
}

using Summarise = std::function<ViewSummary(const ReferenceView&)>;

/// Writes views while they come. `hasPoints`: some view has a point, so that there are bounds.
/// False, and a file that is not finished, where none has.
Result<bool> writeViews(const ViewTable& table, bool hasPoints, const Summarise& summarise,
                        OutputFile& file, Job& job) {
    auto parts = partsFrom(table);
    const auto count = parts.size();
    // As long as those that come.
    if (summarise)
        for (ExrPart& part : parts) part.attributes["stx:summary"] = ViewSummary().text();
    const Bundle& about = table.about();
    Bounds bounds = about.bounds.value_or(Bounds());
    if (about.bounds ? !bounds.empty() : hasPoints) setBounds(parts[0], bounds);
    std::optional<ExrEnvironmentPart> environment;
    if (about.environment) {
        STX_TRY(environment, environmentPart(*about.environment, job));
        joinParts(environment->part, parts);
        parts.push_back(environment->part);
    }
    STX_TRY(auto writer, ExrWriter::create(file, parts));
    std::vector<std::shared_ptr<const ReferenceView>> views(count);
    std::vector<Bounds> each(count);
    const auto keep = [&](std::size_t i,
                          std::shared_ptr<const ReferenceView> view) -> Result<void> {
        STX_TRY(auto points, within(fmt::format("view {}", i), view->checkedPointCount()));
        STX_CHECK(within(fmt::format("view {}", i), view->texture.check()));
        setPixelAttributes(parts[i], *view, points);
        if (summarise) parts[i].attributes["stx:summary"] = summarise(*view).text();
        if (!about.bounds) each[i] = view->computeBounds();
        views[i] = std::move(view);
        return {};
    };
    const auto write = [&](std::size_t i) -> Result<void> {
        STX_CHECK(job.checkCancelled());
        STX_CHECK(writeView(writer, static_cast<int>(i), *views[i]));
        views[i].reset();
        job.progress(static_cast<std::int64_t>(i) + 1, static_cast<std::int64_t>(count),
                     "writing views");
        return {};
    };
    STX_CHECK(forEachView(table, {"writing OpenEXR", summarise ? peak::kSummary.perPixel : 0}, job,
                          keep, write));
    for (const Bounds& one : each) {
        if (one.empty()) continue;
        bounds.add(one.min);
        bounds.add(one.max);
    }
    if (!about.bounds && hasPoints) {
        if (bounds.empty()) return false;
        setBounds(parts[0], bounds);
    }
    if (environment) STX_CHECK(writeEnvironmentPart(writer, static_cast<int>(count), *environment));
    STX_CHECK(writer.finish(parts));
    return true;
}

Result<void> writeTable(const ViewTable& table, const Summarise& summarise, OutputFile& file,
                        Job& job) {
    STX_TRY(const bool written, writeViews(table, true, summarise, file, job));
    if (written) return {};
    // Headers whose bounds stay away are shorter.
    STX_CHECK(writeViews(table, false, summarise, file, job));
    return {};
}

bool hasVectors(const ExrPart& part, const std::string& name) {
    return part.channel(name + ".X") && part.channel(name + ".Y") && part.channel(name + ".Z");
}

/// Distances of other programs' files, and planes that hold them.
void adoptForeignDepth(ReferenceView& view) {
    float nearest = kNoDepth, farthest = 0.0f;
    for (float& d : view.depth.pixels()) {
        if (!(d >= 0.0f) || d >= 1e9f) d = kNoDepth;
        if (!hasPoint(d)) continue;
        nearest = std::min(nearest, d);
        farthest = std::max(farthest, d);
    }
    if (nearest > farthest) return;
    view.nearPlane = nearest;
    view.farPlane = nearest < farthest ? farthest : std::nextafter(farthest, kNoDepth);
}

bool isLinearExr(const ExrReader& reader) {
    const auto* colour = reader.parts()[0].attribute<std::string>("stx:colour");
    return !colour || *colour != "sRGB8";
}

}  // namespace

std::vector<int> exrViewParts(const ExrReader& reader) {
    std::vector<int> views;
    const auto& parts = reader.parts();
    for (std::size_t i = 0; i < parts.size(); ++i) {
        const bool other = parts[i].attribute<glm::dmat4>("worldToCamera") && parts[i].channel("Z");
        if (isOurView(parts[i]) || other) views.push_back(static_cast<int>(i));
    }
    return views;
}

bool isOurView(const ExrPart& part) {
    return part.attribute<glm::dvec3>("stx:position");
}

bool isExrBundle(const ExrReader& reader) {
    return std::any_of(reader.parts().begin(), reader.parts().end(), isOurView);
}

Result<void> measureForeignViews(const ExrReader& reader, ExrBundleHeader& header) {
    std::size_t number = 0;
    for (const int i : exrViewParts(reader)) {
        ExrViewHeader& entry = header.views[number++];
        const ExrPart& part = reader.parts()[i];
        if (isOurView(part)) continue;
        entry.view.depth = Image<float>(part.width, part.height);
        STX_CHECK(reader.readPart(i, {{"Z", entry.view.depth.data(), 1}}));
        adoptForeignDepth(entry.view);
        entry.points = static_cast<std::int64_t>(entry.view.pointCount());
        entry.view.depth = {};
    }
    return {};
}

Result<void> checkExrKind(const ExrReader& reader) {
    const ExrPart& first = reader.parts()[0];
    const auto* version = first.attribute<std::int64_t>("stx:version");
    if (version && *version > kVersion)
        return failAt(reader.where(), ErrorCode::unsupported,
                      "it was written by a newer stx (version {} of the attributes; this one knows "
                      "{})",
                      *version, kVersion);
    const auto* kind = first.attribute<std::string>("stx:kind");
    if (kind && *kind != "bundle")
        return failAt(reader.where(), ErrorCode::invalidInput, "it holds an stx '{}', not a bundle",
                      *kind);
    return {};
}

std::uint64_t exrViewBytes(const ExrReader& reader, const ExrPart& part) {
    std::uint64_t each = (isLinearExr(reader) ? 16 : 4) + 4;
    for (const char* name : {"N", "splatU", "splatV"}) {
        if (hasVectors(part, name)) each += 12;
    }
    if (hasAll(part, kSurface)) each += 8;
    if (hasAll(part, kEmissive)) each += 12;
    return each * static_cast<std::uint64_t>(part.width) * part.height;
}

Result<void> readExrView(const ExrReader& reader, int index, const ExrPart& part,
                         ReferenceView& view) {
    view.depth = Image<float>(part.width, part.height);
    std::vector<ExrPixels> pixels = {{"Z", view.depth.data(), 1}};
    const auto addVectors = [&](const char* name, Image<glm::vec3>& image) {
        if (!hasVectors(part, name)) return;
        image = Image<glm::vec3>(part.width, part.height);
        addVectorPixels(pixels, name, &image.data()->x);
    };
    addVectors("N", view.normal);
    addVectors("splatU", view.splatU);
    addVectors("splatV", view.splatV);
    if (hasAll(part, kSurface)) {
        view.metallicRoughness = Image<glm::vec2>(part.width, part.height);
        addNamedPixels(pixels, kSurface, &view.metallicRoughness.data()->x);
    }
    if (hasAll(part, kEmissive)) {
        view.emissive = Image<glm::vec3>(part.width, part.height);
        addNamedPixels(pixels, kEmissive, &view.emissive.data()->x);
    }
    STX_TRY(view.texture, readTexture(reader, index, isLinearExr(reader), pixels));
    if (!isOurView(part)) adoptForeignDepth(view);
    return {};
}

const char* ExrBundleHeader::nodeKind() const {
    const bool v2 = std::any_of(views.begin(), views.end(),
                                [](const ExrViewHeader& v) { return v.normals || v.splats; });
    return v2 ? "SimpleTextureV2" : "SimpleTexture";
}

Result<void> writeExrViews(const ViewTable& table, const std::filesystem::path& path, Job& job,
                           OutputFile::Options options, const Summarise& summarise) {
    if (table.whole()) STX_CHECK(table.about().checkHeaders());
    STX_TRY(auto file, OutputFile::create(path, options));
    STX_CHECK(within(fmt::format("'{}'", path.string()), writeTable(table, summarise, file, job)));
    return file.commit();
}

Result<ExrBundleHeader> readExrBundleHeader(const ExrReader& reader) {
    STX_CHECK(checkExrKind(reader));
    ExrBundleHeader header;
    const ExrPart& first = reader.parts()[0];
    if (const auto* title = first.attribute<std::string>("stx:title")) header.title = *title;
    const auto* min = first.attribute<glm::dvec3>("stx:boundsMin");
    const auto* max = first.attribute<glm::dvec3>("stx:boundsMax");
    if (min && max) header.bounds = Bounds{*min, *max};
    header.origin = exrOrigin(reader);
    if (const auto* time = first.attribute<double>("stx:time"); time && std::isfinite(*time))
        header.time = *time;
    if (const auto* shown = first.attribute<double>("stx:duration");
        shown && std::isfinite(*shown) && *shown > 0)
        header.duration = *shown;
    header.linear = isLinearExr(reader);
    for (const int i : exrViewParts(reader)) {
        const ExrPart& part = reader.parts()[i];
        STX_TRY(auto view, within(reader.where(), exrCamera(part)));
        ExrViewHeader entry;
        entry.view = std::move(view);
        if (auto ok = entry.view.camera.check(); !ok)
            return tl::unexpected(
                ok.error().at(fmt::format("{}: part '{}'", reader.where(), part.name)));
        entry.normals = hasVectors(part, "N");
        entry.splats = hasVectors(part, "splatU") && hasVectors(part, "splatV");
        entry.metallicRoughness = hasAll(part, kSurface);
        entry.emissive = hasAll(part, kEmissive);
        entry.bytes = part.bytes;
        if (isTrimmed(part, entry.view.camera)) {
            header.bounds.reset();
        } else {
            if (const auto* points = part.attribute<double>("stx:points");
                points && *points >= 0 && *points <= 1e15)
                entry.points = static_cast<std::int64_t>(*points);
            if (const auto* summary = part.attribute<std::string>("stx:summary"))
                entry.summary = ViewSummary::from(*summary);
        }
        header.views.push_back(std::move(entry));
    }
    if (const int at = environmentPartOf(reader); at >= 0) {
        STX_TRY(header.environment, within(reader.where(), environmentHeader(reader.parts()[at])));
    }
    if (header.views.empty())
        return failAt(reader.where(), ErrorCode::invalidInput,
                      "no part has a camera (stx:position or worldToCamera, and a channel Z)");
    return header;
}

Result<ExrBundleHeader> readExrBundleHeader(const std::filesystem::path& path,
                                            const Limits& limits) {
    STX_TRY(const auto reader, ExrReader::open(path, limits));
    return readExrBundleHeader(reader);
}

namespace {

/// What a bundle says beside its pixels. Errors: those of the headers, and parts that claim more
/// pixels than their bytes can hold.
Result<Bundle> bundleWithoutPixels(const ExrReader& reader, ExrBundleHeader header, Job& job) {
    for (const int i : exrViewParts(reader)) STX_CHECK(reader.checkPlausible(i));
    if (const std::string& note = reader.parts()[0].primariesNote; !note.empty())
        job.note(reader.where() + ": " + note);
    Bundle bundle;
    bundle.title = header.title;
    bundle.bounds = header.bounds;
    bundle.origin = header.origin;
    bundle.time = header.time;
    bundle.duration = header.duration;
    for (auto& view : header.views) bundle.views.push_back(std::move(view.view));
    return bundle;
}

class ExrViews : public ViewTable {
  public:
    ExrViews(ExrReader reader, Bundle headers, std::vector<ViewImageKinds> kinds,
             std::vector<ViewSummary> summaries)
        : ViewTable(std::move(headers), std::move(kinds)),
          reader_(std::move(reader)),
          parts_(exrViewParts(reader_)),
          summaries_(std::move(summaries)) {}

    std::vector<ViewSummary> summaries() const override { return summaries_; }
    std::string where() const override { return reader_.where(); }

  protected:
    Result<std::shared_ptr<const ReferenceView>> make(std::size_t index, Job&) const override {
        auto view = std::make_shared<ReferenceView>(about().views[index]);
        const int part = parts_[index];
        STX_CHECK(readExrView(reader_, part, reader_.parts()[part], *view));
        if (auto ok = view->check(); !ok)
            return tl::unexpected(
                ok.error().at(fmt::format("{}: view {}", reader_.where(), index)));
        return view;
    }

  private:
    ExrReader reader_;
    std::vector<int> parts_;
    std::vector<ViewSummary> summaries_;
};

ViewImageKinds kindsOf(const ExrPart& part, bool linear) {
    return {linear,
            hasVectors(part, "N"),
            hasVectors(part, "splatU"),
            hasVectors(part, "splatV"),
            hasAll(part, kSurface),
            hasAll(part, kEmissive)};
}

}  // namespace

Result<std::unique_ptr<ViewTable>> openExrViews(const std::filesystem::path& path, Job& job) {
    STX_TRY(auto reader, ExrReader::open(path, job.limits));
    STX_TRY(auto header, readExrBundleHeader(reader));
    std::vector<ViewImageKinds> kinds;
    for (const int i : exrViewParts(reader)) {
        const ExrPart& part = reader.parts()[i];
        if (!isOurView(part)) return std::unique_ptr<ViewTable>();
        kinds.push_back(kindsOf(part, header.linear));
    }
    std::vector<ViewSummary> summaries;
    for (const ExrViewHeader& view : header.views)
        if (view.summary) summaries.push_back(*view.summary);
    if (summaries.size() < header.views.size()) summaries.clear();
    STX_TRY(auto bundle, bundleWithoutPixels(reader, std::move(header), job));
    if (const int at = environmentPartOf(reader); at >= 0) {
        STX_TRY(bundle.environment, readEnvironmentPart(reader, at, job));
    }
    return std::make_unique<ExrViews>(std::move(reader), std::move(bundle), std::move(kinds),
                                      std::move(summaries));
}

Result<Bundle> readExrBundle(const ExrReader& reader, Job& job) {
    STX_TRY(auto header, readExrBundleHeader(reader));
    STX_TRY(auto bundle, bundleWithoutPixels(reader, std::move(header), job));
    const auto parts = exrViewParts(reader);
    std::uint64_t total = 0;
    for (const int i : parts) total += exrViewBytes(reader, reader.parts()[i]);
    STX_CHECK(within(reader.where(), job.limits.checkAllocation(total, 1, "the views")));

    const auto count = static_cast<std::int64_t>(parts.size());
    std::atomic<std::int64_t> finished = 0;
    const auto read = parallelTry(0, count, [&](std::int64_t i) -> Result<void> {
        STX_CHECK(job.checkCancelled());
        STX_CHECK(readExrView(reader, parts[i], reader.parts()[parts[i]], bundle.views[i]));
        job.progress(++finished, count, "reading views");
        return {};
    });
    STX_CHECK(read);
    if (const int at = environmentPartOf(reader); at >= 0)
        STX_SET(bundle.environment, readEnvironmentPart(reader, at, job));
    STX_CHECK(within(reader.where(), bundle.check()));
    return bundle;
}

Result<Bundle> readExrBundle(ByteSpan bytes, std::string_view name, Job& job) {
    STX_TRY(const auto reader, ExrReader::open(bytes, name, job.limits));
    return readExrBundle(reader, job);
}

Result<Bundle> readExrBundle(const std::filesystem::path& path, Job& job) {
    STX_TRY(const auto reader, ExrReader::open(path, job.limits));
    return readExrBundle(reader, job);
}

}  // namespace stx

#include "formats/viewer/surfaces_glb.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <unordered_map>
#include <utility>

#include <nlohmann/json.hpp>

#include "formats/images/images.hpp"
#include "formats/viewer/fewer_triangles.hpp"
#include "formats/viewer/page_scene.hpp"
#include "formats/viewer/viewer_page.hpp"
#include "lib/base/counted.hpp"
#include "lib/geometry/view_layout.hpp"
#include "lib/model/peak_memory.hpp"
#include "lib/model/translucent.hpp"
#include "lib/model/view_table.hpp"
#include "lib/render/surface/view_surfaces.hpp"

namespace stx {
namespace {

using Json = nlohmann::ordered_json;

// Numbers of glTF 2.0.
constexpr int kUnsignedShort = 5123, kUnsignedInt = 5125, kFloat = 5126;
constexpr int kVertices = 34962, kIndices = 34963;
constexpr int kLinear = 9729, kLinearMipmaps = 9987, kClamp = 33071;
constexpr std::uint32_t kMagic = 0x46546c67, kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;
/// Indices up to this are of 16 bits; the value above it would restart a strip.
constexpr std::size_t kMostOf16Bits = 65535;

template <class T>
ByteSpan bytesOfList(const std::vector<T>& list) {
    return std::as_bytes(std::span(list));
}

/// The file as it grows. `spool`: where its bytes are until they are written; null: in memory.
class Model {
  public:
    explicit Model(PixelSpool* spool) : spool_(spool) {
        root_["asset"] = {{"version", "2.0"}, {"generator", "stx"}};
        root_["scene"] = 0;
        root_["scenes"] = Json::array({Json::object()});
        for (const char* name : {"nodes", "meshes", "materials", "textures", "images", "samplers",
                                 "accessors", "bufferViews"})
            root_[name] = Json::array();
    }

    Json& root() { return root_; }
    std::size_t add(const char* list, Json entry) {
        root_[list].push_back(std::move(entry));
        return root_[list].size() - 1;
    }

    /// Bytes at a multiple of four, as a new buffer view. `target` 0: of an image.
    std::size_t addBytes(ByteSpan bytes, int target) {
        Json view{{"buffer", 0}, {"byteOffset", size_}, {"byteLength", bytes.size()}};
        if (target != 0) view["target"] = target;
        Pixels<std::byte> piece((bytes.size() + 3) / 4 * 4, {}, spool_);
        std::ranges::copy(bytes, piece.data());
        size_ += piece.size();
        pieces_.push_back(std::move(piece));
        return add("bufferViews", std::move(view));
    }
    std::size_t addNumbers(ByteSpan bytes, std::size_t count, const char* type, int component,
                           int target) {
        const std::size_t view = addBytes(bytes, target);
        return add(
            "accessors",
            {{"bufferView", view}, {"componentType", component}, {"count", count}, {"type", type}});
    }
    std::size_t addPositions(const std::vector<glm::vec3>& positions) {
        const std::size_t number =
            addNumbers(bytesOfList(positions), positions.size(), "VEC3", kFloat, kVertices);
        glm::vec3 low = positions[0], high = positions[0];
        for (const glm::vec3& p : positions) low = glm::min(low, p), high = glm::max(high, p);
        root_["accessors"][number]["min"] = {low.x, low.y, low.z};
        root_["accessors"][number]["max"] = {high.x, high.y, high.z};
        return number;
    }
    std::size_t addIndices(const std::vector<std::uint32_t>& indices, std::size_t vertices) {
        if (vertices > kMostOf16Bits)
            return addNumbers(bytesOfList(indices), indices.size(), "SCALAR", kUnsignedInt,
                              kIndices);
        const std::vector<std::uint16_t> shorts(indices.begin(), indices.end());
        return addNumbers(bytesOfList(shorts), shorts.size(), "SCALAR", kUnsignedShort, kIndices);
    }

    /// The bytes of a normalised list of N numbers of 16 bits in each entry.
    std::size_t addUnits(const std::vector<std::uint16_t>& values, std::size_t each,
                         const char* type) {
        const std::size_t number =
            addNumbers(bytesOfList(values), values.size() / each, type, kUnsignedShort, kVertices);
        root_["accessors"][number]["normalized"] = true;
        return number;
    }

    void addNode(std::string name, Json primitives) {
        const std::size_t mesh =
            add("meshes", {{"name", name}, {"primitives", std::move(primitives)}});
        const std::size_t node = add("nodes", {{"name", std::move(name)}, {"mesh", mesh}});
        root_["scenes"][0]["nodes"].push_back(node);
    }

    /// Puts all nodes below one that turns them.
    void turn(const glm::dmat3& by) {
        const glm::dquat q = glm::normalize(glm::quat_cast(by));
        const std::size_t node = add("nodes", {{"name", "up"},
                                               {"rotation", {q.x, q.y, q.z, q.w}},
                                               {"children", root_["scenes"][0]["nodes"]}});
        root_["scenes"][0]["nodes"] = Json::array({node});
    }

    Result<void> write(const std::filesystem::path& path, OutputFile::Options options) {
        root_["buffers"] = Json::array({{{"byteLength", size_}}});
        // Lists that glTF does not take empty.
        for (const char* name : {"textures", "images", "samplers", "materials"})
            if (root_[name].empty()) root_.erase(name);
        std::string text = root_.dump(-1, ' ', false, Json::error_handler_t::replace);
        text.resize((text.size() + 3) / 4 * 4, ' ');
        const std::uint64_t size = 28ull + text.size() + size_;
        if (size > std::numeric_limits<std::uint32_t>::max())
            return fail(ErrorCode::failed,
                        "the model has {} bytes; a GLB file holds less than 2^32 (smaller or fewer "
                        "views make it smaller)",
                        size);
        STX_TRY(auto file, OutputFile::create(path, options));
        const auto words = [&](std::initializer_list<std::uint64_t> list) {
            std::vector<std::uint32_t> out;
            for (const std::uint64_t w : list) out.push_back(static_cast<std::uint32_t>(w));
            return out;
        };
        STX_CHECK(file.write(bytesOfList(words({kMagic, 2, size, text.size(), kJsonChunk}))));
        STX_CHECK(file.write(text));
        STX_CHECK(file.write(bytesOfList(words({size_, kBinaryChunk}))));
        for (Pixels<std::byte>& piece : pieces_) {
            STX_CHECK(file.write(ByteSpan(piece.data(), piece.size())));
            piece = {};
        }
        return file.commit();
    }

  private:
    Json root_;
    PixelSpool* spool_;
    std::vector<Pixels<std::byte>> pieces_;  ///< each a multiple of four bytes
    std::uint64_t size_ = 0;                 ///< of all
};

/// A colour's part of 8 bits as 16 bits of linear light, as COLOR_0 has it.
std::uint16_t linearShort(std::uint8_t coded) {
    return static_cast<std::uint16_t>(
        std::lround(linearFromSrgb(static_cast<float>(coded) / 255.0f) * 65535.0f));
}

void addColour(glm::u8vec4 c, std::vector<std::uint16_t>& colours) {
    for (const std::uint8_t part : {c.r, c.g, c.b}) colours.push_back(linearShort(part));
    colours.push_back(65535);
}

glm::vec3 unitOr(glm::vec3 normal, glm::vec3 other) {
    const float length = glm::length(normal);
    return length > 0 ? normal / length : other;
}

/// Pixels of a view that its triangles lie on.
Image<std::uint8_t> pixelsOf(const ViewSurface& surface, glm::ivec2 size) {
    Image<std::uint8_t> on(size.x, size.y, 0);
    for (std::size_t t = 0; t < surface.triangles.size(); t += 3) {
        glm::ivec2 p[3];
        for (std::size_t k = 0; k < 3; ++k) p[k] = surface.pixels[surface.triangles[t + k]];
        const glm::ivec2 low = glm::min(p[0], glm::min(p[1], p[2]));
        const glm::ivec2 high = glm::max(p[0], glm::max(p[1], p[2]));
        const auto side = [&](int a, int b, glm::ivec2 at) {
            return (p[b].x - p[a].x) * (at.y - p[a].y) - (p[b].y - p[a].y) * (at.x - p[a].x);
        };
        for (int y = low.y; y <= high.y; ++y) {
            for (int x = low.x; x <= high.x; ++x) {
                const int a = side(0, 1, {x, y}), b = side(1, 2, {x, y}), c = side(2, 0, {x, y});
                if ((a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0)) on.at(x, y) = 1;
            }
        }
    }
    return on;
}

/// Whether each triangle is half of four neighbouring pixels whose fourth one is on another surface
/// of the view: a filter would mix that one's colour in.
std::vector<bool> cutTriangles(const ViewSurface& surface, const Image<std::uint8_t>& on) {
    const auto keyOf = [](std::uint32_t a, std::uint32_t b) {
        return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
    };
    std::unordered_map<std::uint64_t, int> edges;
    const auto& corners = surface.triangles;
    for (std::size_t t = 0; t < corners.size(); t += 3)
        for (std::size_t k = 0; k < 3; ++k)
            ++edges[keyOf(corners[t + k], corners[t + (k + 1) % 3])];
    std::vector<bool> cut(corners.size() / 3, false);
    for (std::size_t t = 0; t < corners.size(); t += 3) {
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t ends[] = {corners[t + k], corners[t + (k + 1) % 3]};
            const glm::ivec2 a = surface.pixels[ends[0]], b = surface.pixels[ends[1]];
            const glm::ivec2 third = surface.pixels[corners[t + (k + 2) % 3]];
            if (std::abs(a.x - b.x) != 1 || std::abs(a.y - b.y) != 1 ||
                edges[keyOf(ends[0], ends[1])] > 1)
                continue;
            const glm::ivec2 fourth = a + b - third;
            if (glm::min(a, b) != glm::min(glm::min(a, b), third) ||
                glm::max(a, b) != glm::max(glm::max(a, b), third))
                continue;  // a larger triangle: little of it is beside this edge
            cut[t / 3] = on.contains(fourth.x, fourth.y) && on.at(fourth.x, fourth.y) != 0;
        }
    }
    return cut;
}

/// Errors where a place does not fit into glTF's floats.
Result<void> checkPlaces(const ReferenceView& view, const std::vector<glm::vec3>& places) {
    for (const glm::vec3& p : places) {
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
            return fail(ErrorCode::invalidInput,
                        "view '{}' has a point that is farther than glTF's floats reach (3.4e38)",
                        view.name);
    }
    return {};
}

class Writer {
  public:
    Writer(const Bundle& bundle, const SurfacesOptions& options, Job& job)
        : bundle_(bundle), jpegQuality_(options.jpegQuality), job_(job), model_(options.spool) {
        lit_ = allHaveNormals(*viewsOf(bundle), job);
    }

    /// Takes the colours of other surfaces out of the view's.
    Result<void> add(ReferenceView& view, const ViewSurface& surface) {
        for (std::size_t i = 0; i < surface.mixedPixels.size(); ++i) {
            const glm::u16vec2 at = surface.mixedPixels[i];
            glm::u8vec4& colour = view.texture.rgba8()->at(at.x, at.y);
            colour = {glm::u8vec3(surface.ownColours[i] * 255.0f + 0.5f), colour.a};
        }
        translucent_ = translucent_ || hasTranslucentInside(view.texture, view.depth);
        if (!surface.triangles.empty()) {
            STX_CHECK(addSurface(view, surface));
        }
        for (std::size_t i = 0; i < surface.lonePixels.size(); ++i) {
            const glm::u16vec2 at = surface.lonePixels[i];
            const glm::u8vec4 c = view.texture.rgba8()->at(at.x, at.y);
            positions_.push_back(surface.lonePositions[i]);
            addColour(c, colours_);
            if (lit_) normals_.push_back(normalAt(view, at));
        }
        report.triangles += static_cast<std::int64_t>(surface.triangles.size() / 3);
        report.points += static_cast<std::int64_t>(surface.lonePixels.size());
        return {};
    }

    Result<SurfacesReport> write(const std::filesystem::path& path, OutputFile::Options options) {
        if (!positions_.empty()) addPoints();
        if (report.triangles + report.points == 0)
            return fail(ErrorCode::invalidInput, "the bundle has no points to make a model of");
        Json& root = model_.root();
        std::vector<Camera> cameras;
        for (const ReferenceView& view : bundle_.views) cameras.push_back(view.camera);
        const glm::dmat3 turn = turnOfUp(upOfCameras(cameras), {0, 1, 0});
        if (turn != glm::dmat3(1.0)) {
            model_.turn(turn);
            job_.note(fmt::format(
                "the model is turned by a node, x y z to {}, so that +Y is up, as it is in glTF",
                turnedAxes(turn)));
        }
        if (!bundle_.title.empty()) root["scenes"][0]["name"] = bundle_.title;
        if (bundle_.origin != glm::dvec3(0.0)) {
            const glm::dvec3 o = turn * bundle_.origin;
            root["asset"]["extras"]["origin"] = {o.x, o.y, o.z};
            job_.note(fmt::format(
                "the model stays at the origin, since glTF has floats only; add ({}, {}, {}) to "
                "its coordinates",
                o.x, o.y, o.z));
        }
        if (translucent_) job_.note("translucent surfaces are opaque in the model");
        if (!lit_) root["extensionsUsed"] = {"KHR_materials_unlit"};
        STX_CHECK(model_.write(path, options));
        return report;
    }

    SurfacesReport report;

  private:
    static glm::vec3 normalAt(const ReferenceView& view, glm::u16vec2 at) {
        return unitOr(view.normal.at(at.x, at.y),
                      -glm::vec3(view.camera.viewDirection(at.x + 0.5, at.y + 0.5)));
    }

    std::size_t addMaterial(Json look, const std::string& name) {
        look["metallicFactor"] = 0.0;
        look["roughnessFactor"] = 1.0;
        Json material{
            {"name", name}, {"pbrMetallicRoughness", std::move(look)}, {"doubleSided", true}};
        if (!lit_) material["extensions"]["KHR_materials_unlit"] = Json::object();
        return model_.add("materials", std::move(material));
    }

    Result<void> addSurface(const ReferenceView& view, const ViewSurface& surface) {
        // What is on no triangle here has the colour of what is, for filters and small copies.
        const Image<std::uint8_t> on = pixelsOf(surface, view.depth.size());
        Texture filled = view.texture;
        for (std::size_t i = 0; i < on.count(); ++i)
            filled.rgba8()->data()[i].a = on.data()[i] ? 255 : 0;
        bleedColour(filled);
        const Rgba8Image& colour = *filled.rgba8();
        std::vector<glm::u8vec3> rgb(colour.count());
        std::ranges::transform(colour.pixels(), rgb.begin(),
                               [](glm::u8vec4 c) { return glm::u8vec3(c); });
        const bool jpeg = jpegQuality_ > 0;
        STX_TRY(const Bytes file,
                jpeg ? encodeJpeg(colour.width(), colour.height(), 3, &rgb[0].r, jpegQuality_)
                     : encodePng(colour.width(), colour.height(), 3, 8, rgb.data(), true));
        if (model_.root()["samplers"].empty())
            model_.add("samplers", {{"magFilter", kLinear},
                                    {"minFilter", kLinearMipmaps},
                                    {"wrapS", kClamp},
                                    {"wrapT", kClamp}});
        const std::size_t image =
            model_.add("images", {{"name", view.name},
                                  {"mimeType", jpeg ? "image/jpeg" : "image/png"},
                                  {"bufferView", model_.addBytes(file, 0)}});
        const std::size_t texture = model_.add("textures", {{"sampler", 0}, {"source", image}});
        const std::size_t material =
            addMaterial({{"baseColorTexture", {{"index", texture}}}}, view.name);
        Json attributes{{"POSITION", model_.addPositions(surface.positions)}};
        if (lit_) {
            std::vector<glm::vec3> normals;
            normals.reserve(surface.pixels.size());
            for (const glm::u16vec2 at : surface.pixels) normals.push_back(normalAt(view, at));
            attributes["NORMAL"] =
                model_.addNumbers(bytesOfList(normals), normals.size(), "VEC3", kFloat, kVertices);
        }
        std::vector<std::uint16_t> places;
        places.reserve(2 * surface.pixels.size());
        for (const glm::u16vec2 at : surface.pixels) {
            const glm::dvec2 share = (glm::dvec2(at) + 0.5) / glm::dvec2(colour.size());
            for (const int k : {0, 1})
                places.push_back(static_cast<std::uint16_t>(std::lround(share[k] * 65535.0)));
        }
        attributes["TEXCOORD_0"] = model_.addUnits(places, 2, "VEC2");
        const std::vector<bool> cut = cutTriangles(surface, on);
        std::vector<std::uint32_t> whole, edges;
        for (std::size_t i = 0; i < surface.triangles.size(); ++i)
            (cut[i / 3] ? edges : whole).push_back(surface.triangles[i]);
        Json primitives = Json::array();
        if (!whole.empty())
            primitives.push_back({{"attributes", std::move(attributes)},
                                  {"indices", model_.addIndices(whole, surface.positions.size())},
                                  {"material", material}});
        if (!edges.empty()) primitives.push_back(colouredTriangles(view, surface, edges));
        model_.addNode(view.name, std::move(primitives));
        return {};
    }

    /// Triangles beside other surfaces, with colours of their corners.
    Json colouredTriangles(const ReferenceView& view, const ViewSurface& surface,
                           const std::vector<std::uint32_t>& corners) {
        if (!edgeMaterial_) edgeMaterial_ = addMaterial(Json::object(), "edges");
        std::unordered_map<std::uint32_t, std::uint32_t> numbers;
        std::vector<std::uint32_t> indices;
        std::vector<glm::vec3> positions, normals;
        std::vector<std::uint16_t> colours;
        for (const std::uint32_t corner : corners) {
            const auto [known, isNew] =
                numbers.emplace(corner, static_cast<std::uint32_t>(positions.size()));
            indices.push_back(known->second);
            if (!isNew) continue;
            const glm::u16vec2 at = surface.pixels[corner];
            positions.push_back(surface.positions[corner]);
            addColour(view.texture.rgba8()->at(at.x, at.y), colours);
            if (lit_) normals.push_back(normalAt(view, at));
        }
        Json attributes{{"POSITION", model_.addPositions(positions)}};
        if (lit_)
            attributes["NORMAL"] =
                model_.addNumbers(bytesOfList(normals), normals.size(), "VEC3", kFloat, kVertices);
        attributes["COLOR_0"] = model_.addUnits(colours, 4, "VEC4");
        const std::size_t list = model_.addIndices(indices, positions.size());
        return {
            {"attributes", std::move(attributes)}, {"indices", list}, {"material", *edgeMaterial_}};
    }

    void addPoints() {
        const std::size_t material = addMaterial(Json::object(), "points");
        Json attributes{{"POSITION", model_.addPositions(positions_)}};
        if (lit_)
            attributes["NORMAL"] = model_.addNumbers(bytesOfList(normals_), normals_.size(), "VEC3",
                                                     kFloat, kVertices);
        attributes["COLOR_0"] = model_.addUnits(colours_, 4, "VEC4");
        model_.addNode(
            "points",
            Json::array(
                {{{"attributes", std::move(attributes)}, {"mode", 0}, {"material", material}}}));
    }

    const Bundle& bundle_;
    int jpegQuality_;
    Job& job_;
    bool lit_ = false, translucent_ = false;
    std::optional<std::size_t> edgeMaterial_;
    Model model_;
    std::vector<glm::vec3> positions_, normals_;
    std::vector<std::uint16_t> colours_;
};

}  // namespace

Result<SurfacesReport> writeSurfaces(const std::filesystem::path& path, Bundle bundle,
                                     const SurfacesOptions& options, Job& job) {
    bundle.noteMaterialLeftOut(job);
    noteEnvironmentLeftOut(bundle.environment, job);
    codeColours(bundle, "the model", job, options.spool);
    const std::size_t count = bundle.views.size();
    Writer writer(bundle, options, job);
    writer.report.views = count;
    const auto checkSurface = [&](std::size_t i, const ViewSurface& surface) -> Result<void> {
        STX_CHECK(checkPlaces(bundle.views[i], surface.positions));
        return checkPlaces(bundle.views[i], surface.lonePositions);
    };
    const auto add = [&](std::size_t i, const ViewSurface& surface) -> Result<void> {
        job.progress(static_cast<std::int64_t>(i), static_cast<std::int64_t>(count),
                     "writing views");
        STX_CHECK(job.checkCancelled());
        return writer.add(bundle.views[i], surface);
    };
    if (options.mostTriangles == 0) {
        const auto take = [&](std::size_t i, const ViewSurface& surface) -> Result<void> {
            STX_CHECK(checkSurface(i, surface));
            return add(i, surface);
        };
        STX_CHECK(forEachSurface(bundle, options.spool, job, take));
        return writer.write(path, options.output);
    }
    STX_CHECK(checkPeak(peak::kFewerTriangles, bundle.views, job.limits));
    STX_TRY(auto surfaces, viewSurfaces(bundle, job));
    std::uint64_t triangles = 0;
    for (std::size_t i = 0; i < count; ++i) {
        STX_CHECK(checkSurface(i, surfaces[i]));
        triangles += surfaces[i].triangles.size() / 3;
    }
    STX_CHECK(checkPeakOfTriangles(triangles, bundle.views, job.limits));
    STX_CHECK(takeFewerTriangles(bundle, options.mostTriangles, surfaces, job));
    for (std::size_t i = 0; i < count; ++i) STX_CHECK(add(i, std::exchange(surfaces[i], {})));
    return writer.write(path, options.output);
}

}  // namespace stx

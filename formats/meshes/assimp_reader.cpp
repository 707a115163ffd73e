#include <algorithm>
#include <new>

#include "formats/meshes/alpha_map.hpp"
#include "formats/meshes/collada_text.hpp"
#include "formats/meshes/fbx_scene.hpp"
#include "formats/meshes/foreign_scene.hpp"
#include "formats/meshes/mesh_builder.hpp"
#include "formats/meshes/mtl_notes.hpp"
#include "formats/meshes/obj_faces.hpp"
#include "formats/meshes/readers.hpp"
#include "formats/meshes/scene_claims.hpp"
#include "formats/meshes/side_files.hpp"
#include "formats/meshes/stl_colours.hpp"
#include "formats/meshes/text_coordinates.hpp"
#include "formats/meshes/triangulate.hpp"
#include "formats/meshes/vertex_colours.hpp"
#include "lib/model/texture.hpp"

namespace stx {
namespace {

const char* endingOf(AssimpFormat format) {
    switch (format) {
        case AssimpFormat::obj:
            return "obj";
        case AssimpFormat::stl:
            return "stl";
        case AssimpFormat::dae:
            return "dae";
        case AssimpFormat::fbx:
            return "fbx";
    }
    return "";
}

using decoders::Tag;
using models::TextureUse;

constexpr int kMostModelSeconds = 120;
#ifdef __SANITIZE_ADDRESS__
/// AddressSanitizer waits for ever where it has no memory to say that there is none.
constexpr std::uint64_t kSanitizerBytes = std::uint64_t{1} << 40;
#else
constexpr std::uint64_t kSanitizerBytes = 0;
#endif

class SceneConverter {
  public:
    SceneConverter(const ForeignScene& scene, AssimpFormat format, ModelFiles& files,
                   const SideFiles& side, const PlainText& plain, std::set<std::string> bare)
        : scene_(scene),
          format_(format),
          files_(files),
          builder_(files.job()),
          mtl_(side.materials()),
          bare_(std::move(bare)) {
        saysUndefined_ =
            format == AssimpFormat::obj && (side.missing().empty() || side.hasMaterialFile());
        builder_.setOrigin(plain.origin);
        if (format == AssimpFormat::dae || format == AssimpFormat::fbx || !plain.unread.empty())
            builder_.setRounded();
    }

    Result<Mesh> convert() {
        place_ = files_.placeOfColour(
            builder_.textures(),
            std::ranges::any_of(scene_.meshes, [](const auto& mesh) { return !mesh.uvs.empty(); }));
        for (const auto& material : scene_.materials) STX_CHECK(convertMaterial(material));
        if (saysUndefined_ && place_ < 0) noteUndefined();
        if (builder_.materials().empty()) {
            builder_.materials().push_back(
                {.name = "default", .baseColourTexture = place_, .hasColour = false});
            mtlOf_.emplace_back();
        }
        for (const auto& node : scene_.nodes)
            worldFromNode_.push_back(node.parent < 0 ? glm::dmat4(node.parentFromNode)
                                                     : worldFromNode_[node.parent] *
                                                           glm::dmat4(node.parentFromNode));
        for (std::size_t i = 0; i < scene_.nodes.size(); ++i)
            for (const std::uint32_t mesh : scene_.nodes[i].meshes)
                STX_CHECK(convertMesh(scene_.meshes[mesh], worldFromNode_[i]));
        for (const auto& [count, what] : {std::pair{std::size_t{scene_.animations}, "animations"},
                                          {std::size_t{scene_.cameras}, "cameras"},
                                          {std::size_t{scene_.lights}, "lights"},
                                          {lines_, "lines"}})
            if (count > 0) files_.job().note(fmt::format("dropped: {} ({})", what, count));
        if (points_ > 0)
            files_.job().note(fmt::format("dropped: points in a mesh of triangles ({})", points_));
        return builder_.finish();
    }

  private:
    using Use = TextureUse;

    Result<void> convertMaterial(const ForeignScene::Material& source) {
        Material m;
        m.name = source.name;
        m.baseColourTexture = place_;
        MtlMaterial mtl = mtlNamed(m.name);

        const bool hasMap = textureOf(source, Use::diffuse).has_value();
        // Assimp invents a grey where the file says nothing.
        const bool scene = format_ == AssimpFormat::dae || format_ == AssimpFormat::fbx;
        const bool given = format_ == AssimpFormat::obj ? mtl.hasDiffuse : scene;
        m.hasColour = false;
        if (given && source.diffuse) {
            const glm::vec4 diffuse = *source.diffuse;
            m.hasColour = true;
            if (hasMap && diffuse.r == 0 && diffuse.g == 0 && diffuse.b == 0) {
                files_.job().note(fmt::format(
                    "material '{}' has a texture and a black Kd; Kd is taken as white", m.name));
            } else {
                m.baseColour = glm::vec4(linearFromSrgb(diffuse.r), linearFromSrgb(diffuse.g),
                                         linearFromSrgb(diffuse.b), 1.0f);
            }
        }
        float opacity = 1.0f;
        // Maps of opacity in scenes are not read; the number beside one means nothing without it.
        const bool opacityMap = scene && textureOf(source, Use::opacity);
        if ((scene && !opacityMap) || mtl.hasDissolve || mtl.hasTransparency)
            opacity = source.opacity.value_or(opacity);
        if (opacity <= 0.0f) {
            // Some programs write Tr as d; nobody means an object that cannot be seen.
            files_.job().note(
                fmt::format("material '{}' would be invisible; it is taken as opaque", m.name));
        } else if (opacity < 1.0f) {
            m.baseColour.a = opacity;
            m.alpha = Material::Alpha::blend;
        }
        for (const auto& what : mtl.dropped)
            files_.job().note(fmt::format("material '{}': {} is dropped", m.name, what));

        const bool ownAlpha = !mtl.alphaMap.empty() && mtl.alphaMap == mtl.diffuseMap &&
                              (mtl.alphaChannel == 0 || mtl.alphaChannel == 'm');
        if (hasMap && !files_.replacesColour()) {
            STX_TRY(m.baseColourTexture, texture(source, Use::diffuse));
            if (ownAlpha) m.alpha = Material::Alpha::blend;
        }
        if (!mtl.alphaMap.empty() && !ownAlpha && !files_.replacesColour())
            STX_CHECK(addAlphaMap(source, mtl.alphaChannel, m));
        STX_CHECK(addEmission(source, mtl, scene, m));
        if (textureOf(source, Use::normals))
            STX_SET(m.normalTexture, texture(source, Use::normals));
        for (const auto& [has, label] : {std::pair{source.hasBump, "bump map"},
                                         {source.hasDisplacement, "displacement map"},
                                         {opacityMap, "opacity map"}}) {
            if (has)
                files_.job().note(fmt::format("material '{}': its {} is dropped", m.name, label));
        }
        placeUvs(source, mtl);
        if (bare_.contains(m.name) &&
            std::ranges::any_of(source.textures, [](const auto& t) { return t.has_value(); }))
            files_.job().note(fmt::format(
                "material '{}': some of its faces have no texture coordinates; they have the "
                "colour of its texture at 0 0",
                m.name));
        builder_.materials().push_back(std::move(m));
        mtlOf_.push_back(mtl);
        return {};
    }

    /// All maps are drawn with the coordinates of the first: with its set, scaled and moved as it
    /// says.
    void placeUvs(const ForeignScene::Material& source, MtlMaterial& mtl) {
        const ForeignScene::Texture* first = nullptr;
        bool otherSet = false, otherPlace = false;
        for (const auto& texture : source.textures) {
            if (!texture) continue;
            if (!first) first = &*texture;
            otherSet = otherSet || texture->uvSet != first->uvSet;
            otherPlace = otherPlace || texture->uvScale != first->uvScale ||
                         texture->uvOffset != first->uvOffset;
        }
        if (!first) return;
        const auto note = [&](std::string_view what) {
            files_.job().note(fmt::format("material '{}': {}", source.name, what));
        };
        if (otherSet)
            note(
                "its maps have several sets of texture coordinates; all are drawn with that of the "
                "first");
        if (otherPlace)
            note("its maps are scaled or moved unlike each other; all are drawn as the first");
        if (first->uvRotationRad != 0) note("the rotation of its maps is not read");
        mtl.uvScale *= first->uvScale;
        mtl.uvOffset = mtl.uvOffset * first->uvScale + first->uvOffset;
    }

    /// Materials that a `usemtl` names and no material file has.
    void noteUndefined() {
        std::vector<std::string> names;
        for (const auto& material : scene_.materials)
            if (material.name != models::kUnnamedMaterial && !mtl_.contains(material.name))
                names.push_back(material.name);
        if (names.empty()) return;
        const bool one = names.size() == 1;
        files_.job().note(fmt::format(
            "{} in no material file; {} no colour",
            one ? fmt::format("material '{}' is", names[0])
                : fmt::format("{} materials, '{}' the first, are", names.size(), names[0]),
            one ? "it has" : "they have"));
    }

    /// map_d becomes the alpha of the base colour texture.
    Result<void> addAlphaMap(const ForeignScene::Material& source, char channel, Material& m) {
        if (!textureOf(source, Use::opacity)) return {};
        STX_TRY(const int map, texture(source, Use::opacity));
        if (map < 0) return {};
        auto& textures = builder_.textures();
        const auto& like = textures[m.baseColourTexture >= 0 ? m.baseColourTexture : map];
        STX_CHECK(builder_.charge(like.pixels.count(), sizeof(glm::u8vec4), "the alpha maps"));
        m.baseColourTexture = textureWithAlpha(textures, m.baseColourTexture, map, channel);
        m.alpha = Material::Alpha::blend;
        return {};
    }

    /// Ke and map_Ke, and what other formats have of the kind.
    Result<void> addEmission(const ForeignScene::Material& source, const MtlMaterial& mtl,
                             bool scene, Material& m) {
        const bool given = (scene || mtl.hasEmission) && source.emission;
        glm::vec4 emission = given ? *source.emission : glm::vec4(0, 0, 0, 1);
        const bool hasMap = textureOf(source, Use::emissive).has_value();
        if (!given && !hasMap) return {};
        if (hasMap && emission.r == 0 && emission.g == 0 && emission.b == 0)
            emission = glm::vec4(1);
        const auto linear = [](float v) { return linearFromSrgb(std::clamp(v, 0.0f, 1.0f)); };
        m.emissive = {linear(emission.r), linear(emission.g), linear(emission.b)};
        if (!hasMap) return {};
        STX_TRY(m.emissiveTexture, texture(source, Use::emissive));
        if (m.emissiveTexture < 0) m.emissive = glm::vec3(0.0f);
        return {};
    }

    /// Nothing special where no material file has it.
    [[nodiscard]] MtlMaterial mtlNamed(const std::string& name) const {
        const auto known = mtl_.find(name);
        return known == mtl_.end() ? MtlMaterial{} : known->second;
    }

    static const std::optional<ForeignScene::Texture>& textureOf(
        const ForeignScene::Material& source, Use use) {
        return source.textures[static_cast<std::size_t>(use)];
    }

    Result<int> texture(const ForeignScene::Material& source, Use use) {
        const ForeignScene::Texture& named = *textureOf(source, use);
        const auto wrap = [](std::uint8_t mode) {
            return mode > static_cast<std::uint8_t>(MeshTexture::Wrap::clamp)
                       ? MeshTexture::Wrap::repeat
                       : static_cast<MeshTexture::Wrap>(mode);
        };
        SamplerState state;
        state.wrapU = wrap(named.wrapU);
        state.wrapV = wrap(named.wrapV);
        if (named.embedded >= 0)
            return embeddedTexture(scene_.embedded[named.embedded], named.name, state);
        // Names are relative to the material file for some programs, to the model for others.
        return files_.textureFromFile(named.name, state, builder_.textures(),
                                      mtlNamed(source.name).folder);
    }

    /// A picture inside the model's own file: a PNG or JPEG as it is, or plain texels.
    Result<int> embeddedTexture(const ForeignScene::Embedded& inside, const std::string& name,
                                SamplerState state) {
        if (!inside.coded) {
            files_.job().note(fmt::format(
                "texture '{}' inside the model is not a PNG or JPEG; the plain colour is used",
                name));
            return -1;
        }
        return files_.textureFromBytes(inside.bytes, name, state, builder_.textures());
    }

    /// Where a skin brings each vertex: the mean of its bones by weight. A vertex without any
    /// follows the mesh's node.
    Result<std::vector<glm::dmat4>> poses(const ForeignScene::Mesh& mesh,
                                          const glm::dmat4& worldFromMesh,
                                          const std::string& where) {
        const auto count = mesh.positions.size();
        STX_CHECK(builder_.charge(count, sizeof(glm::dmat4) + sizeof(double), where));
        std::vector<glm::dmat4> worldFromVertex(count, glm::dmat4(0.0));
        std::vector<double> sums(count, 0.0);
        const models::BoneWeight* weight = mesh.weights.data();
        for (const auto& bone : mesh.bones) {
            const auto worldFromBone = worldFromNode_[bone.node] * glm::dmat4(bone.nodeFromMesh);
            for (std::uint32_t k = 0; k < bone.weights; ++k, ++weight) {
                worldFromVertex[weight->vertex] += worldFromBone * double{weight->weight};
                sums[weight->vertex] += weight->weight;
            }
        }
        for (std::size_t i = 0; i < count; ++i) {
            if (sums[i] == 0)
                worldFromVertex[i] = worldFromMesh;
            else
                worldFromVertex[i] /= sums[i];
        }
        return worldFromVertex;
    }

    /// Positions, normals, colours and texture coordinates; triangles face the other way where
    /// most vertices are mirrored.
    Result<void> addVertices(const ForeignScene::Mesh& mesh, const glm::dmat4& worldFromMesh,
                             MeshPart& part, bool& mirrored) {
        std::vector<glm::dmat4> posed;
        if (!mesh.bones.empty()) STX_SET(posed, poses(mesh, worldFromMesh, part.where));
        const bool moved = !posed.empty() || worldFromMesh != glm::dmat4(1.0);
        const auto worldFrom = [&](std::size_t i) -> const glm::dmat4& {
            return posed.empty() ? worldFromMesh : posed[i];
        };
        for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
            const glm::dvec3 p = mesh.positions[i];
            part.positions.push_back(moved ? glm::dvec3(worldFrom(i) * glm::dvec4(p, 1.0)) : p);
        }
        const auto isMirrored = [](const glm::dmat4& m) {
            return glm::determinant(glm::dmat3(m)) < 0;
        };
        mirrored = posed.empty() ? isMirrored(worldFromMesh)
                                 : std::ranges::count_if(posed, isMirrored) >
                                       static_cast<std::ptrdiff_t>(posed.size() / 2);
        // A facet's normal in STL is often wrong or zero, and says no more than its corners.
        if (!mesh.normals.empty() && format_ != AssimpFormat::stl) {
            for (std::size_t i = 0; i < mesh.normals.size(); ++i) {
                // Cofactors: the inverse transpose but for a factor.
                const glm::dmat3 m(worldFrom(i));
                const glm::dmat3 forNormals(glm::cross(m[1], m[2]), glm::cross(m[2], m[0]),
                                            glm::cross(m[0], m[1]));
                const double side = glm::determinant(m) < 0 ? -1.0 : 1.0;
                const auto& n = mesh.normals[i];
                part.normals.push_back(moved ? glm::vec3(forNormals * glm::dvec3(n) * side) : n);
            }
        }
        if (!mesh.colours.empty()) {
            part.colours = mesh.colours;
            linearFromSrgbColours(part.colours, true);
        }
        if (!mesh.uvs.empty()) {
            // v runs up in these formats, down in Mesh.
            const auto& mtl = mtlOf_[std::min<std::size_t>(part.material, mtlOf_.size() - 1)];
            for (const auto& given : mesh.uvs) {
                const auto uv = given * mtl.uvScale + mtl.uvOffset;
                part.uvs.emplace_back(uv.x, 1.0f - uv.y);
            }
        }
        return {};
    }

    /// Faces cut into triangles; counts lines and, where there are triangles, points. Without faces
    /// of any kind all vertices are points.
    void addFaces(const ForeignScene::Mesh& mesh, MeshPart& part) {
        std::size_t points = 0;
        std::vector<bool> named(part.positions.size());  // as points
        const bool triangles = mesh.cornerCounts.empty();
        const std::size_t faces = triangles ? mesh.corners.size() / 3 : mesh.cornerCounts.size();
        part.triangles.reserve(faces);
        std::vector<glm::dvec3> corners;
        std::vector<glm::uvec3> cut;
        const std::uint32_t* face = mesh.corners.data();
        for (std::size_t f = 0; f < faces; ++f) {
            const std::uint32_t sides = triangles ? 3 : mesh.cornerCounts[f];
            if (sides == 3) {
                part.triangles.emplace_back(face[0], face[1], face[2]);
            } else if (sides > 3) {
                corners.clear();
                cut.clear();
                for (std::uint32_t k = 0; k < sides; ++k)
                    corners.push_back(part.positions[face[k]]);
                triangulate(corners, cut);
                for (const auto& t : cut)
                    part.triangles.emplace_back(face[t.x], face[t.y], face[t.z]);
            } else if (sides == 1) {
                ++points;
                named[face[0]] = true;
            } else {
                ++lines_;
            }
            face += sides;
        }
        if (!part.triangles.empty()) points_ += points;
        part.points = part.triangles.empty() && (points > 0 || faces == 0);
        if (part.points && faces > 0) keepVertices(part, named);
    }

    /// Without texture coordinates a part gets its material without textures.
    void dropTexturesWithoutUvs(MeshPart& part) {
        const auto& material = builder_.materials()[part.material];
        const bool textured = material.baseColourTexture >= 0 || material.emissiveTexture >= 0 ||
                              material.normalTexture >= 0;
        if (!textured || !part.uvs.empty()) return;
        files_.job().note(
            fmt::format("{} has the textured material '{}' but no texture coordinates; the "
                        "plain colour is used",
                        part.where, material.name));
        auto plain = material;
        plain.baseColourTexture = plain.normalTexture = -1;
        if (plain.emissiveTexture >= 0) plain.emissive = glm::vec3(0.0f);
        plain.emissiveTexture = -1;
        part.material = static_cast<std::uint32_t>(builder_.materials().size());
        builder_.materials().push_back(std::move(plain));
    }

    Result<void> convertMesh(const ForeignScene::Mesh& mesh, const glm::dmat4& worldFromMesh) {
        MeshPart part;
        part.where = mesh.name.empty() ? "the mesh" : fmt::format("mesh '{}'", mesh.name);
        STX_CHECK(builder_.charge(mesh.positions.size(), 80, part.where));
        part.material = mesh.material < builder_.materials().size() ? mesh.material : 0;
        bool mirrored = false;
        STX_CHECK(addVertices(mesh, worldFromMesh, part, mirrored));
        addFaces(mesh, part);
        if (mirrored)
            for (auto& t : part.triangles) std::swap(t.y, t.z);
        if (part.triangles.empty() && !part.points) return {};
        dropTexturesWithoutUvs(part);
        weldVertices(part);
        return builder_.add(std::move(part));
    }

    const ForeignScene& scene_;
    AssimpFormat format_;
    ModelFiles& files_;
    MeshBuilder builder_;
    const std::map<std::string, MtlMaterial>& mtl_;
    std::vector<MtlMaterial> mtlOf_;  ///< of each material
    std::vector<glm::dmat4> worldFromNode_;
    int place_ = -1;              ///< of the caller's picture, in all materials
    std::set<std::string> bare_;  ///< materials that have faces with and without coordinates
    std::size_t lines_ = 0, points_ = 0;
    bool saysUndefined_ = false;  ///< nothing has been said of materials without a file
};

/// Says what of a COLLADA text is not read.
void noteNotRead(const PlainCollada& collada, Job& job) {
    if (!collada.wrap.empty())
        job.note(fmt::format(
            "wrap '{}' of samplers is not read, only WRAP, CLAMP and MIRROR: textures repeat",
            collada.wrap));
    if (!collada.twoSkeletons.empty())
        job.note(
            fmt::format("skin '{}' is shown with several skeletons; all have the pose of the first",
                        collada.twoSkeletons));
    if (collada.morphs > 0)
        job.note(fmt::format("dropped: morphs ({}); what they morph has its base shape",
                             collada.morphs));
    if (collada.holes > 0)
        job.note(fmt::format("holes of polygons are not read: {} are filled", collada.holes));
    if (!collada.boundTwice.empty())
        job.note(fmt::format(
            "'{}' is bound to several sets of texture coordinates; all textures have the first",
            collada.boundTwice));
}

/// What the process `of` says of the model that it was asked for.
Result<ForeignScene> hear(DecoderProcess& of, AssimpFormat format, SideFiles& side,
                          const Limits& limits) {
    Tag tag{};
    Bytes content;
    while (of.receiveMessage(tag, content, limits.maxMemoryBytes)) {
        decoders::Packer answer;
        const std::string name = decoders::Unpacker(content).getText();
        switch (tag) {
            case Tag::askExists:
                answer.put(static_cast<std::uint8_t>(side.exists(name)));
                break;
            case Tag::askFile: {
                const auto bytes = side.read(name);
                if (side.error()) return tl::unexpected(*side.error());
                answer.put(static_cast<std::uint8_t>(bytes.has_value()));
                if (bytes) answer.add(bytes->data(), bytes->size());
                break;
            }
            case Tag::scene:
                return receiveScene(of, content, limits);
            case Tag::failure:
                return fail(ErrorCode::invalidInput, "Assimp cannot read this {} file: {}",
                            endingOf(format), errorIn(content).message);
            case Tag::noMemory:
                return fail(ErrorCode::invalidInput,
                            "the model needs more than the memory limit of {} MiB; raise it with "
                            "--max-memory if the file is to be trusted",
                            limits.maxMemoryBytes >> 20);
            default:
                return of.lost();
        }
        of.send(Tag::fileIs, answer.bytes);
    }
    return of.lost();
}

}  // namespace

Result<Mesh> readWithAssimp(ByteSpan bytes, AssimpFormat format, const std::string& fileName,
                            ModelFiles& files) {
    const Limits& limits = files.job().limits;
    // Assimp's text parsers hold a file of n bytes in some 30 n bytes.
    STX_CHECK(limits.checkAllocation(bytes.size(), 30, "reading the model"));
    if (format == AssimpFormat::dae) STX_CHECK(checkColladaClaims(bytes, limits));
    if (format == AssimpFormat::fbx) STX_CHECK(checkFbxClaims(bytes, limits));
    if (format == AssimpFormat::stl) STX_CHECK(checkStlEnd(bytes));
    try {
        ObjFaces faces;
        std::optional<Bytes> usual;
        if (format == AssimpFormat::obj) {
            faces = objFaces(bytes);
            usual = plainObj(bytes);
            if (faces.smoothWithoutNormals)
                if (auto smooth = withSmoothNormals(usual ? ByteSpan(*usual) : bytes))
                    usual = std::move(smooth);
        }
        if (format == AssimpFormat::stl) {
            usual = lowerCaseStl(bytes);
            if (const auto behind = bytesBehindBinaryStl(bytes); behind > 0) {
                files.job().note(
                    fmt::format("dropped: what is behind the last facet ({} bytes)", behind));
                bytes = bytes.first(bytes.size() - behind);
            }
        }
        if (usual) bytes = *usual;
        PlainCollada collada;
        if (format == AssimpFormat::dae) {
            STX_SET(collada, plainCollada(bytes));
            bytes = std::as_bytes(std::span(collada.text));
        }
        PlainText plain;
        if (format == AssimpFormat::obj) plain = plainCoordinates(bytes, "v");
        if (format == AssimpFormat::stl) plain = plainCoordinates(bytes, "vertex");
        if (plain.text) bytes = *plain.text;
        DecoderBounds bounds;
        bounds.memoryBytes = limits.maxMemoryBytes + kSanitizerBytes;
        bounds.cpuSeconds = kMostModelSeconds;
        bounds.patienceMs = 2 * kMostModelSeconds * 1000;  // where others need the processor, too
        STX_TRY(const auto process, DecoderProcess::start(decoders::kModels, bounds, bytes));
        // The importer chooses by the ending.
        const auto stem = fileName.substr(0, fileName.find_last_of('.'));
        decoders::Packer request;
        request.putText(fmt::format("{}.{}", stem, endingOf(format)));
        process->send(Tag::readModel, request.bytes);
        SideFiles side(files);
        STX_TRY(auto scene, hear(*process, format, side, limits));
        if (format == AssimpFormat::dae)
            for (auto& material : scene.materials)
                if (material.diffuse && material.diffuse->r == kNoColour) material.diffuse.reset();
        if (format == AssimpFormat::fbx) STX_CHECK(completeFbx(bytes, scene, files.job()));
        if (format == AssimpFormat::stl && scene.meshes.size() == 1)
            readStlColours(bytes, scene.meshes[0].colours);
        if (!side.missing().empty() && !side.hasMaterialFile())
            files.job().note(
                fmt::format("material file {}; its materials have no colour", side.missing()));
        if (!plain.unread.empty())
            files.job().note(fmt::format(
                "found '{}', expected '{} X Y Z': vertices are as Assimp takes them, their "
                "coordinates rounded to 32-bit floats",
                plain.unread.substr(0, 60), format == AssimpFormat::obj ? "v" : "vertex"));
        if (plain.dropsAlpha)
            files.job().note("the alpha of vertex colours (v X Y Z R G B A) is not used");
        noteNotRead(collada, files.job());
        return SceneConverter(scene, format, files, side, plain, std::move(faces.bareMaterials))
            .convert();
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::failed, "the model needs more memory than there is");
    } catch (const std::exception& e) {
        return fail(ErrorCode::invalidInput, "Assimp cannot read this {} file: {}",
                    endingOf(format), e.what());
    }
}

}  // namespace stx

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <assimp/Importer.hpp>

#include <new>

#include "formats/meshes/alpha_map.hpp"
#include "formats/meshes/assimp_files.hpp"
#include "formats/meshes/mesh_builder.hpp"
#include "formats/meshes/mtl_notes.hpp"
#include "formats/meshes/readers.hpp"
#include "formats/meshes/scene_claims.hpp"
#include "formats/meshes/text_coordinates.hpp"
#include "formats/meshes/triangulate.hpp"
#include "formats/meshes/try_apart.hpp"
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

glm::vec3 toVec3(const aiVector3D& v) {
    return {v.x, v.y, v.z};
}

glm::dmat4 toMatrix(const aiMatrix4x4& m) {
    return glm::transpose(glm::dmat4(m.a1, m.a2, m.a3, m.a4, m.b1, m.b2, m.b3, m.b4, m.c1, m.c2,
                                     m.c3, m.c4, m.d1, m.d2, m.d3, m.d4));
}

class SceneConverter {
  public:
    SceneConverter(const aiScene& scene, AssimpFormat format, ModelFiles& files,
                   const AssimpFiles& system, glm::dvec3 origin)
        : scene_(scene),
          format_(format),
          files_(files),
          builder_(files.job()),
          materialFolder_(system.materialFolder()) {
        for (const auto& text : system.sideTexts()) scanMtl(text, mtl_);
        builder_.setOrigin(origin);
    }

    Result<Mesh> convert() {
        for (unsigned i = 0; i < scene_.mNumMaterials; ++i)
            STX_CHECK(convertMaterial(*scene_.mMaterials[i]));
        if (builder_.materials().empty()) {
            builder_.materials().push_back({.name = "default", .hasColour = false});
            mtlOf_.emplace_back();
        }
        if (scene_.mRootNode) STX_CHECK(convertNode(*scene_.mRootNode, glm::dmat4(1.0)));
        if (scene_.mNumAnimations > 0)
            files_.job().note(fmt::format("dropped: animations ({})", scene_.mNumAnimations));
        if (lines_ > 0) files_.job().note(fmt::format("dropped: lines ({})", lines_));
        if (points_ > 0)
            files_.job().note(fmt::format("dropped: points in a mesh of triangles ({})", points_));
        return builder_.finish();
    }

  private:
    Result<void> convertMaterial(const aiMaterial& source) {
        Material m;
        aiString name;
        if (source.Get(AI_MATKEY_NAME, name) == aiReturn_SUCCESS) m.name = name.C_Str();
        const auto known = mtl_.find(m.name);
        const MtlMaterial mtl = known == mtl_.end() ? MtlMaterial{} : known->second;

        aiString path;
        const bool hasMap = source.GetTexture(aiTextureType_DIFFUSE, 0, &path) == aiReturn_SUCCESS;
        aiColor4D diffuse(1, 1, 1, 1);
        // Assimp invents a grey where the file says nothing.
        const bool scene = format_ == AssimpFormat::dae || format_ == AssimpFormat::fbx;
        const bool given = format_ == AssimpFormat::obj ? mtl.hasDiffuse : scene;
        m.hasColour = false;
        if (given && source.Get(AI_MATKEY_COLOR_DIFFUSE, diffuse) == aiReturn_SUCCESS) {
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
        if (format_ == AssimpFormat::obj && (mtl.hasDissolve || mtl.hasTransparency))
            source.Get(AI_MATKEY_OPACITY, opacity);
        if (opacity <= 0.0f) {
            // Some programs write Tr as d; nobody means an object that cannot be seen.
            files_.job().note(
                fmt::format("material '{}' would be invisible; it is taken as opaque", m.name));
        } else if (opacity < 1.0f) {
            m.baseColour.a = opacity;
            m.alpha = Material::Alpha::blend;
        }
        for (const auto& option : mtl.droppedOptions)
            files_.job().note(
                fmt::format("material '{}': option {} of map_Kd is dropped", m.name, option));

        if (hasMap && !files_.replacesColour()) {
            STX_TRY(m.baseColourTexture, texture(source, aiTextureType_DIFFUSE, path));
            if (!mtl.alphaMap.empty() && mtl.alphaMap == mtl.diffuseMap)
                m.alpha = Material::Alpha::blend;
        }
        if (!mtl.alphaMap.empty() && mtl.alphaMap != mtl.diffuseMap && !files_.replacesColour())
            STX_CHECK(addAlphaMap(source, m));
        STX_CHECK(addEmission(source, mtl, scene, m));
        if (source.GetTexture(aiTextureType_NORMALS, 0, &path) == aiReturn_SUCCESS) {
            STX_TRY(m.normalTexture, texture(source, aiTextureType_NORMALS, path));
        }
        for (const auto& [type, label] : {std::pair{aiTextureType_HEIGHT, "bump map"},
                                          {aiTextureType_DISPLACEMENT, "displacement map"}}) {
            if (source.GetTextureCount(type) > 0)
                files_.job().note(fmt::format("material '{}': its {} is dropped", m.name, label));
        }
        builder_.materials().push_back(std::move(m));
        mtlOf_.push_back(mtl);
        return {};
    }

    /// map_d becomes the alpha of the base colour texture.
    Result<void> addAlphaMap(const aiMaterial& source, Material& m) {
        aiString path;
        if (source.GetTexture(aiTextureType_OPACITY, 0, &path) != aiReturn_SUCCESS) return {};
        STX_TRY(const int map, texture(source, aiTextureType_OPACITY, path));
        if (map < 0) return {};
        auto& textures = builder_.textures();
        const auto& like = textures[static_cast<std::size_t>(
            m.baseColourTexture >= 0 ? m.baseColourTexture : map)];
        STX_CHECK(builder_.charge(like.pixels.count(), sizeof(glm::u8vec4), "the alpha maps"));
        m.baseColourTexture = textureWithAlpha(textures, m.baseColourTexture, map);
        m.alpha = Material::Alpha::blend;
        return {};
    }

    /// Ke and map_Ke, and what other formats have of the kind.
    Result<void> addEmission(const aiMaterial& source, const MtlMaterial& mtl, bool scene,
                             Material& m) {
        aiColor4D emission(0, 0, 0, 1);
        const bool given = (scene || mtl.hasEmission) &&
                           source.Get(AI_MATKEY_COLOR_EMISSIVE, emission) == aiReturn_SUCCESS;
        aiString path;
        const bool hasMap = source.GetTexture(aiTextureType_EMISSIVE, 0, &path) == aiReturn_SUCCESS;
        if (!given && !hasMap) return {};
        if (hasMap && emission.r == 0 && emission.g == 0 && emission.b == 0)
            emission = aiColor4D(1, 1, 1, 1);
        const auto linear = [](float v) { return linearFromSrgb(std::clamp(v, 0.0f, 1.0f)); };
        m.emissive = {linear(emission.r), linear(emission.g), linear(emission.b)};
        if (!hasMap) return {};
        STX_TRY(m.emissiveTexture, texture(source, aiTextureType_EMISSIVE, path));
        if (m.emissiveTexture < 0) m.emissive = glm::vec3(0.0f);
        return {};
    }

    Result<int> texture(const aiMaterial& material, aiTextureType type, const aiString& path) {
        const auto wrap = [](int mode) {
            if (mode == aiTextureMapMode_Mirror) return MeshTexture::Wrap::mirror;
            if (mode == aiTextureMapMode_Clamp) return MeshTexture::Wrap::clamp;
            return MeshTexture::Wrap::repeat;
        };
        SamplerState state;
        int mode = aiTextureMapMode_Wrap;
        if (material.Get(AI_MATKEY_MAPPINGMODE_U(type, 0), mode) == aiReturn_SUCCESS)
            state.wrapU = wrap(mode);
        if (material.Get(AI_MATKEY_MAPPINGMODE_V(type, 0), mode) == aiReturn_SUCCESS)
            state.wrapV = wrap(mode);
        if (const auto* inside = scene_.GetEmbeddedTexture(path.C_Str()))
            return embeddedTexture(*inside, path.C_Str(), state);
        // Names are relative to the material file for some programs, to the model for others.
        return files_.textureFromFile(path.C_Str(), state, builder_.textures(), materialFolder_);
    }

    /// A picture inside the model's own file: a PNG or JPEG as it is, or plain texels.
    Result<int> embeddedTexture(const aiTexture& inside, const std::string& name,
                                SamplerState state) {
        if (inside.mHeight != 0) {
            files_.job().note(fmt::format(
                "texture '{}' inside the model is not a PNG or JPEG; the plain colour is used",
                name));
            return -1;
        }
        const auto* first = reinterpret_cast<const std::byte*>(inside.pcData);
        return files_.textureFromBytes({first, inside.mWidth}, name, state, builder_.textures());
    }

    Result<void> convertNode(const aiNode& node, const glm::dmat4& parent) {
        const auto worldFromNode = parent * toMatrix(node.mTransformation);
        for (unsigned i = 0; i < node.mNumMeshes; ++i)
            STX_CHECK(convertMesh(*scene_.mMeshes[node.mMeshes[i]], worldFromNode));
        for (unsigned i = 0; i < node.mNumChildren; ++i)
            STX_CHECK(convertNode(*node.mChildren[i], worldFromNode));
        return {};
    }

    Result<void> convertMesh(const aiMesh& mesh, const glm::dmat4& worldFromMesh) {
        MeshPart part;
        part.where =
            mesh.mName.length > 0 ? fmt::format("mesh '{}'", mesh.mName.C_Str()) : "the mesh";
        const std::size_t count = mesh.mNumVertices;
        STX_CHECK(builder_.charge(count, 80, part.where));
        part.material = mesh.mMaterialIndex < builder_.materials().size() ? mesh.mMaterialIndex : 0;
        const bool moved = worldFromMesh != glm::dmat4(1.0);
        const bool mirrored = glm::determinant(glm::dmat3(worldFromMesh)) < 0;
        for (std::size_t i = 0; i < count; ++i) {
            const glm::dvec3 p(toVec3(mesh.mVertices[i]));
            part.positions.push_back(moved ? glm::dvec3(worldFromMesh * glm::dvec4(p, 1.0)) : p);
        }
        // A facet's normal in STL is often wrong or zero, and says no more than its corners.
        if (mesh.mNormals && format_ != AssimpFormat::stl) {
            // Cofactors: the inverse transpose but for a factor.
            const glm::dmat3 m(worldFromMesh);
            const glm::dmat3 forNormals(glm::cross(m[1], m[2]), glm::cross(m[2], m[0]),
                                        glm::cross(m[0], m[1]));
            for (std::size_t i = 0; i < count; ++i) {
                const auto n = toVec3(mesh.mNormals[i]);
                part.normals.push_back(
                    moved ? glm::vec3(forNormals * glm::dvec3(n) * (mirrored ? -1.0 : 1.0)) : n);
            }
        }
        if (const auto* colours = mesh.mColors[0]) {
            for (std::size_t i = 0; i < count; ++i)
                part.colours.emplace_back(colours[i].r, colours[i].g, colours[i].b, colours[i].a);
            linearFromSrgbColours(part.colours, true);
        }
        if (const auto* uvs = mesh.mTextureCoords[0]) {
            // v runs up in these formats, down in Mesh.
            const auto& mtl = mtlOf_[std::min<std::size_t>(part.material, mtlOf_.size() - 1)];
            for (std::size_t i = 0; i < count; ++i) {
                const auto uv = glm::vec2(uvs[i].x, uvs[i].y) * mtl.uvScale + mtl.uvOffset;
                part.uvs.emplace_back(uv.x, 1.0f - uv.y);
            }
        }
        std::size_t points = 0;
        part.triangles.reserve(mesh.mNumFaces);
        std::vector<glm::dvec3> corners;
        std::vector<glm::uvec3> cut;
        for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
            const auto& face = mesh.mFaces[f];
            if (face.mNumIndices == 3) {
                part.triangles.emplace_back(face.mIndices[0], face.mIndices[1], face.mIndices[2]);
            } else if (face.mNumIndices > 3) {
                corners.clear();
                cut.clear();
                for (unsigned k = 0; k < face.mNumIndices; ++k)
                    corners.push_back(part.positions.at(face.mIndices[k]));
                triangulate(corners, cut);
                for (const auto& t : cut)
                    part.triangles.emplace_back(face.mIndices[t.x], face.mIndices[t.y],
                                                face.mIndices[t.z]);
            } else if (face.mNumIndices == 1) {
                ++points;
            } else {
                ++lines_;
            }
        }
        if (mirrored) {
            for (auto& t : part.triangles) std::swap(t.y, t.z);
        }
        if (!part.triangles.empty()) points_ += points;
        part.points = part.triangles.empty() && (points > 0 || mesh.mNumFaces == 0);
        if (part.triangles.empty() && !part.points) return {};
        const auto& material = builder_.materials()[part.material];
        if ((material.baseColourTexture >= 0 || material.emissiveTexture >= 0) &&
            part.uvs.empty()) {
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
        weldVertices(part);
        return builder_.add(std::move(part));
    }

    const aiScene& scene_;
    AssimpFormat format_;
    ModelFiles& files_;
    MeshBuilder builder_;
    std::map<std::string, MtlMaterial> mtl_;
    std::vector<MtlMaterial> mtlOf_;  ///< of each material
    std::string materialFolder_;
    std::size_t lines_ = 0, points_ = 0;
};

}  // namespace

Result<Mesh> readWithAssimp(ByteSpan bytes, AssimpFormat format, const std::string& fileName,
                            ModelFiles& files) {
    // Assimp's text parsers hold a file of n bytes in some 30 n bytes.
    STX_CHECK(files.job().limits.checkAllocation(bytes.size(), 30, "reading the model"));
    if (format == AssimpFormat::dae) STX_CHECK(checkColladaClaims(bytes, files.job().limits));
    if (format == AssimpFormat::fbx) STX_CHECK(checkFbxClaims(bytes, files.job().limits));
    if (format == AssimpFormat::stl) STX_CHECK(checkStlEnd(bytes));
    try {
        std::optional<ShiftedText> shifted;
        if (format == AssimpFormat::obj) shifted = shiftLargeCoordinates(bytes, "v");
        if (format == AssimpFormat::stl) shifted = shiftLargeCoordinates(bytes, "vertex");
        if (shifted) bytes = shifted->text;
        // The importer chooses by the ending.
        auto modelName = fileName;
        const auto dot = modelName.find_last_of('.');
        modelName = modelName.substr(0, dot) + "." + endingOf(format);
        const auto read = [&](Assimp::Importer& importer,
                              AssimpFiles* system) -> Result<const aiScene*> {
            importer.SetIOHandler(system);  // which owns it
            const aiScene* scene = importer.ReadFile(AssimpFiles::kFolder + modelName, 0);
            if (system->error()) return tl::unexpected(*system->error());
            if (scene) return scene;
            std::string reason = importer.GetErrorString();
            std::replace(reason.begin(), reason.end(), '\n', ' ');
            return fail(ErrorCode::invalidInput, "Assimp cannot read this {} file: {}",
                        endingOf(format), reason.empty() ? "no reason given" : reason);
        };
        // Damaged files crash its readers of these, and small ones may take any memory. What fails
        // there is not tried here.
        const auto readOnce = [&]() -> Result<void> {
            Assimp::Importer importer;
            STX_CHECK(read(importer, new AssimpFiles(bytes, modelName, files)));
            return {};
        };
        if (format == AssimpFormat::dae || format == AssimpFormat::fbx)
            STX_CHECK(tryApart(readOnce, files.job().limits));
        Assimp::Importer importer;
        auto* system = new AssimpFiles(bytes, modelName, files);
        STX_TRY(const aiScene* const scene, read(importer, system));
        if (!system->missing().empty() && system->sideTexts().empty())
            files.job().note(
                fmt::format("material file {}; its materials have no colour", system->missing()));
        return SceneConverter(*scene, format, files, *system,
                              shifted ? shifted->origin : glm::dvec3(0.0))
            .convert();
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::failed, "the model needs more memory than there is");
    } catch (const std::exception& e) {
        return fail(ErrorCode::invalidInput, "Assimp cannot read this {} file: {}",
                    endingOf(format), e.what());
    }
}

}  // namespace stx

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <assimp/Importer.hpp>

#include <new>

#include "formats/meshes/assimp_files.hpp"
#include "formats/meshes/mesh_builder.hpp"
#include "formats/meshes/mtl_notes.hpp"
#include "formats/meshes/readers.hpp"
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
        if (builder_.materials().empty()) builder_.materials().push_back({.name = "default"});
        if (scene_.mRootNode) STX_CHECK(convertNode(*scene_.mRootNode, glm::dmat4(1.0)));
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
        const bool given = format_ == AssimpFormat::obj ? mtl.hasDiffuse : false;
        if (given && source.Get(AI_MATKEY_COLOR_DIFFUSE, diffuse) == aiReturn_SUCCESS) {
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
        if (source.GetTexture(aiTextureType_NORMALS, 0, &path) == aiReturn_SUCCESS) {
            STX_TRY(m.normalTexture, texture(source, aiTextureType_NORMALS, path));
        }
        if (!mtl.alphaMap.empty() && mtl.alphaMap != mtl.diffuseMap)
            files_.job().note(
                fmt::format("material '{}': map_d '{}' is dropped", m.name, mtl.alphaMap));
        for (const auto& [type, label] : {std::pair{aiTextureType_HEIGHT, "bump map"},
                                          {aiTextureType_DISPLACEMENT, "displacement map"},
                                          {aiTextureType_EMISSIVE, "emissive map"}}) {
            if (source.GetTextureCount(type) > 0)
                files_.job().note(fmt::format("material '{}': its {} is dropped", m.name, label));
        }
        builder_.materials().push_back(std::move(m));
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
        // Names are relative to the material file for some programs, to the model for others.
        return files_.textureFromFile(path.C_Str(), state, builder_.textures(), materialFolder_);
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
        for (std::size_t i = 0; i < count; ++i) {
            const glm::dvec3 p(toVec3(mesh.mVertices[i]));
            part.positions.push_back(moved ? glm::dvec3(worldFromMesh * glm::dvec4(p, 1.0)) : p);
        }
        // A facet's normal in STL is often wrong or zero, and says no more than its corners.
        if (mesh.mNormals && format_ != AssimpFormat::stl) {
            for (std::size_t i = 0; i < count; ++i)
                part.normals.push_back(toVec3(mesh.mNormals[i]));
        }
        if (const auto* colours = mesh.mColors[0]) {
            for (std::size_t i = 0; i < count; ++i)
                part.colours.emplace_back(colours[i].r, colours[i].g, colours[i].b, colours[i].a);
            linearFromSrgbColours(part.colours, true);
        }
        if (const auto* uvs = mesh.mTextureCoords[0]) {
            // v runs up in these formats, down in Mesh.
            for (std::size_t i = 0; i < count; ++i)
                part.uvs.emplace_back(uvs[i].x, 1.0f - uvs[i].y);
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
        if (!part.triangles.empty()) points_ += points;
        part.points = part.triangles.empty() && (points > 0 || mesh.mNumFaces == 0);
        if (part.triangles.empty() && !part.points) return {};
        const auto& material = builder_.materials()[part.material];
        if (material.baseColourTexture >= 0 && part.uvs.empty()) {
            files_.job().note(
                fmt::format("{} has the textured material '{}' but no texture coordinates; the "
                            "plain colour is used",
                            part.where, material.name));
            auto plain = material;
            plain.baseColourTexture = plain.normalTexture = -1;
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
    std::string materialFolder_;
    std::size_t lines_ = 0, points_ = 0;
};

}  // namespace

Result<Mesh> readWithAssimp(ByteSpan bytes, AssimpFormat format, const std::string& fileName,
                            ModelFiles& files) {
    // Assimp's text parsers hold a file of n bytes in some 30 n bytes.
    STX_CHECK(files.job().limits.checkAllocation(bytes.size(), 30, "reading the model"));
    try {
        const auto shifted =
            shiftLargeCoordinates(bytes, format == AssimpFormat::obj ? "v" : "vertex");
        if (shifted) bytes = shifted->text;
        Assimp::Importer importer;
        // The importer chooses by the ending.
        auto modelName = fileName;
        const auto dot = modelName.find_last_of('.');
        modelName = modelName.substr(0, dot) + "." + endingOf(format);
        auto* system = new AssimpFiles(bytes, modelName, files);
        importer.SetIOHandler(system);  // which owns it
        const aiScene* scene = importer.ReadFile(AssimpFiles::kFolder + modelName, 0);
        if (system->error()) return tl::unexpected(*system->error());
        if (!system->missing().empty() && system->sideTexts().empty())
            files.job().note(fmt::format("material file {}; its materials become plain white",
                                         system->missing()));
        if (!scene) {
            std::string reason = importer.GetErrorString();
            std::replace(reason.begin(), reason.end(), '\n', ' ');
            return fail(ErrorCode::invalidInput, "Assimp cannot read this {} file: {}",
                        endingOf(format), reason.empty() ? "no reason given" : reason);
        }
        return SceneConverter(*scene, format, files, *system,
                              shifted ? shifted->origin : glm::dvec3(0.0))
            .convert();
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::invalidInput, "the model needs more memory than there is");
    } catch (const std::exception& e) {
        return fail(ErrorCode::invalidInput, "Assimp cannot read this {} file: {}",
                    endingOf(format), e.what());
    }
}

}  // namespace stx

// The module that reads models with Assimp: its entry, the files that it sees, and what it tells.

#include <assimp/config.h>
#include <assimp/scene.h>
#include <assimp/version.h>
#include <fmt/format.h>
#include <unistd.h>
#include <assimp/IOStream.hpp>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>

#include <algorithm>
#include <array>
#include <initializer_list>
#include <map>
#include <optional>

#include "formats/decoders/decoder_module.hpp"
#include "formats/decoders/given_file.hpp"
#include "formats/decoders/wire.hpp"
#include "formats/meshes/model_wire.hpp"
#include "lib/base/result.hpp"
#include "lib/model/mesh.hpp"

namespace stx::models {
namespace {

using decoders::Packer;
using decoders::Tag;

/// Where messages go to; of the one file that this process reads.
int answers = -1;

/// Parsers catch what allocations throw, and take the file for read or for damaged.
[[noreturn]] void onNoMemory() {
    (void)decoders::sendMessage(answers, Tag::noMemory);
    ::_exit(1);
}

/// Asks for a file that the model names. Who does not answer is gone.
bool ask(Tag tag, const char* name, std::vector<std::byte>& bytes) {
    Packer question;
    question.putText(name);
    Tag got{};
    std::vector<std::byte> answer;
    if (!decoders::sendMessage(answers, tag, question.bytes) ||
        !decoders::receiveMessage(answers, got, answer, UINT64_MAX, -1) || got != Tag::fileIs)
        ::_exit(1);
    decoders::Unpacker in(answer);
    const bool there = in.get<std::uint8_t>() != 0;
    const auto rest = in.rest();
    bytes.assign(rest.begin(), rest.end());
    return there;
}

class MemoryStream final : public Assimp::IOStream {
  public:
    explicit MemoryStream(std::span<const std::byte> bytes) : bytes_(bytes) {}
    explicit MemoryStream(std::vector<std::byte> owned)
        : owned_(std::move(owned)), bytes_(owned_) {}

    std::size_t Read(void* to, std::size_t size, std::size_t count) override {
        if (size == 0 || count == 0) return 0;
        const auto n = std::min(count, (bytes_.size() - at_) / size);
        if (n > 0) std::memcpy(to, bytes_.data() + at_, n * size);
        at_ += n * size;
        return n;
    }
    std::size_t Write(const void*, std::size_t, std::size_t) override { return 0; }
    aiReturn Seek(std::size_t offset, aiOrigin origin) override {
        const auto base = origin == aiOrigin_SET ? 0 : origin == aiOrigin_CUR ? at_ : bytes_.size();
        if (offset > bytes_.size() - base) return aiReturn_FAILURE;
        at_ = base + offset;
        return aiReturn_SUCCESS;
    }
    std::size_t Tell() const override { return at_; }
    std::size_t FileSize() const override { return bytes_.size(); }
    void Flush() override {}

  private:
    std::vector<std::byte> owned_;
    std::span<const std::byte> bytes_;
    std::size_t at_ = 0;
};

/// The only files that Assimp sees: the model, and what is given when it is asked for.
class Files final : public Assimp::IOSystem {
  public:
    Files(std::span<const std::byte> model, std::string modelName)
        : model_(model), modelName_(std::move(modelName)) {}

    bool Exists(const char* name) const override {
        std::vector<std::byte> none;
        return name == modelName_ || ask(Tag::askExists, name, none);
    }
    char getOsSeparator() const override { return '/'; }
    Assimp::IOStream* Open(const char* name, const char*) override {
        if (name == modelName_) return new MemoryStream(model_);
        std::vector<std::byte> bytes;
        if (!ask(Tag::askFile, name, bytes)) return nullptr;
        return new MemoryStream(std::move(bytes));
    }
    void Close(Assimp::IOStream* stream) override { delete stream; }

  private:
    std::span<const std::byte> model_;
    std::string modelName_;
};

constexpr aiTextureType kTypes[] = {aiTextureType_DIFFUSE, aiTextureType_OPACITY,
                                    aiTextureType_EMISSIVE, aiTextureType_NORMALS};
static_assert(std::size(kTypes) == kTextureUses);

/// The properties of FBX's materials that have a map for each of these uses, those of physical
/// materials last. Assimp gives types to a few of them alone.
constexpr std::array<std::initializer_list<const char*>, kTextureUses> kProperties = {{
    {"DiffuseColor", "Maya|DiffuseTexture|file", "Maya|baseColor", "Maya|baseColor|file",
     "Maya|TEX_color_map", "Maya|TEX_color_map|file", "3dsMax|Parameters|base_color_map",
     "3dsMax|main|base_color_map"},
    {"TransparentColor", "TransparencyFactor"},
    {"EmissiveColor", "EmissiveFactor", "Maya|emissionColor", "Maya|emissionColor|file",
     "Maya|TEX_emissive_map", "Maya|TEX_emissive_map|file", "3dsMax|Parameters|emission_map",
     "3dsMax|Parameters|emit_color_map", "3dsMax|main|emit_color_map"},
    {"NormalMap", "Maya|NormalTexture|file", "Maya|normalCamera", "Maya|normalCamera|file",
     "Maya|TEX_normal_map", "Maya|TEX_normal_map|file", "3dsMax|main|norm_map"},
}};

class SceneTeller {
  public:
    explicit SceneTeller(const aiScene& scene) : scene_(scene) {}

    bool tell() {
        out_.put(scene_.mNumMaterials);
        for (unsigned i = 0; i < scene_.mNumMaterials; ++i) putMaterial(*scene_.mMaterials[i]);
        out_.put(static_cast<std::uint32_t>(embedded_.size()));
        for (const aiTexture* texture : embedded_) {
            const bool coded = texture->mHeight == 0;
            out_.put(static_cast<std::uint8_t>(coded));
            out_.putBytes(
                {reinterpret_cast<const std::byte*>(texture->pcData), coded ? texture->mWidth : 0});
        }
        Packer nodes;
        if (scene_.mRootNode) putNode(*scene_.mRootNode, -1, nodes);
        out_.put(static_cast<std::uint32_t>(nodes_));
        out_.add(nodes.bytes.data(), nodes.bytes.size());
        out_.put(scene_.mNumMeshes);
        out_.put(scene_.mNumAnimations);
        out_.put(scene_.mNumCameras);
        out_.put(scene_.mNumLights);
        if (!decoders::sendMessage(answers, Tag::scene, out_.bytes)) return false;
        for (unsigned i = 0; i < scene_.mNumMeshes; ++i)
            if (!sendMesh(*scene_.mMeshes[i])) return false;
        return true;
    }

  private:
    template <class T>
    void putOptional(bool there, const T& value) {
        out_.put(static_cast<std::uint8_t>(there));
        if (there) out_.put(value);
    }

    void putMaterial(const aiMaterial& from) {
        aiString name;
        out_.putText(from.Get(AI_MATKEY_NAME, name) == aiReturn_SUCCESS ? name.C_Str() : "");
        aiColor4D colour(1, 1, 1, 1);
        putOptional(from.Get(AI_MATKEY_COLOR_DIFFUSE, colour) == aiReturn_SUCCESS, colour);
        colour = aiColor4D(0, 0, 0, 1);
        putOptional(from.Get(AI_MATKEY_COLOR_EMISSIVE, colour) == aiReturn_SUCCESS, colour);
        float opacity = 1.0f;
        putOptional(from.Get(AI_MATKEY_OPACITY, opacity) == aiReturn_SUCCESS, opacity);
        for (std::size_t use = 0; use < kTextureUses; ++use) putTexture(from, use);
        out_.put(static_cast<std::uint8_t>(from.GetTextureCount(aiTextureType_HEIGHT) > 0));
        out_.put(static_cast<std::uint8_t>(from.GetTextureCount(aiTextureType_DISPLACEMENT) > 0));
    }

    /// Where a material has what it says of a texture: under a property of FBX, which alone says
    /// which of the pictures inside the file is meant, or under a type.
    struct TextureKeys {
        std::string property, file, uvTransform, uvSet;
        unsigned type = 0;
    };

    static std::optional<TextureKeys> keysOf(const aiMaterial& from, std::size_t use) {
        aiString name;
        for (const char* property : kProperties[use]) {
            const auto key = [&](const char* what) {
                return fmt::format("$raw.{}|{}", property, what);
            };
            if (from.Get(key("file").c_str(), aiTextureType_UNKNOWN, 0, name) == aiReturn_SUCCESS)
                return TextureKeys{property, key("file"), key("uvtrafo"), key("uvwsrc"),
                                   aiTextureType_UNKNOWN};
        }
        if (from.GetTexture(kTypes[use], 0, &name) != aiReturn_SUCCESS) return std::nullopt;
        return TextureKeys{"", _AI_MATKEY_TEXTURE_BASE, _AI_MATKEY_UVTRANSFORM_BASE,
                           _AI_MATKEY_UVWSRC_BASE, static_cast<unsigned>(kTypes[use])};
    }

    /// Of a picture inside the file: its own name where no other one has it, else its number.
    [[nodiscard]] const char* nameOf(const aiTexture& inside, const aiString& number) const {
        const std::span all(scene_.mTextures, scene_.mNumTextures);
        const auto same = std::ranges::count_if(
            all, [&](const aiTexture* each) { return each->mFilename == inside.mFilename; });
        return same == 1 && inside.mFilename.length > 0 ? inside.mFilename.C_Str() : number.C_Str();
    }

    void putTexture(const aiMaterial& from, std::size_t use) {
        const auto keys = keysOf(from, use);
        out_.put(static_cast<std::uint8_t>(keys.has_value()));
        if (!keys) return;
        aiString name;
        from.Get(keys->file.c_str(), keys->type, 0, name);
        const aiTexture* inside = nullptr;
        if (keys->property.empty() || name.C_Str()[0] == '*')
            inside = scene_.GetEmbeddedTexture(name.C_Str());
        out_.putText(inside ? nameOf(*inside, name) : name.C_Str());
        out_.putText(keys->property);
        const auto wrap = [](int mode) {
            const auto kind = mode == aiTextureMapMode_Mirror  ? MeshTexture::Wrap::mirror
                              : mode == aiTextureMapMode_Clamp ? MeshTexture::Wrap::clamp
                                                               : MeshTexture::Wrap::repeat;
            return static_cast<std::uint8_t>(kind);
        };
        const aiTextureType type = kTypes[use];
        int mode = aiTextureMapMode_Wrap;
        from.Get(AI_MATKEY_MAPPINGMODE_U(type, 0), mode);
        out_.put(wrap(mode));
        mode = aiTextureMapMode_Wrap;
        from.Get(AI_MATKEY_MAPPINGMODE_V(type, 0), mode);
        out_.put(wrap(mode));
        aiUVTransform uv;
        from.Get(keys->uvTransform.c_str(), keys->type, 0, uv);
        out_.put(uv.mScaling);
        out_.put(uv.mTranslation);
        out_.put(uv.mRotation);
        out_.put(static_cast<std::uint32_t>(uvSetOf(from, *keys)));
        std::int32_t number = -1;
        if (inside) {
            const auto [at, added] =
                numbers_.emplace(inside, static_cast<std::int32_t>(embedded_.size()));
            if (added) embedded_.push_back(inside);
            number = at->second;
        }
        out_.put(number);
    }

    static glm::mat4 toMatrix(const aiMatrix4x4& m) {
        return glm::transpose(glm::mat4(m.a1, m.a2, m.a3, m.a4, m.b1, m.b2, m.b3, m.b4, m.c1, m.c2,
                                        m.c3, m.c4, m.d1, m.d2, m.d3, m.d4));
    }

    /// What turns the axes of FBX's GlobalSettings to ours: x to the right, y up, z to the front.
    /// Axes that are no rotation are not believed.
    [[nodiscard]] glm::mat4 worldFromFile() const {
        const glm::mat4 none(1.0f);
        if (!scene_.mMetaData) return none;
        glm::mat3 rows(0.0f);
        constexpr std::pair<const char*, const char*> kKeys[] = {{"CoordAxis", "CoordAxisSign"},
                                                                 {"UpAxis", "UpAxisSign"},
                                                                 {"FrontAxis", "FrontAxisSign"}};
        for (int row = 0; row < 3; ++row) {
            std::int32_t axis = 0, sign = 0;
            if (!scene_.mMetaData->Get(kKeys[row].first, axis) ||
                !scene_.mMetaData->Get(kKeys[row].second, sign) || axis < 0 || axis > 2)
                return none;
            rows[row][axis] = sign < 0 ? -1.0f : 1.0f;
        }
        return glm::determinant(rows) == 1.0f ? glm::mat4(glm::transpose(rows)) : none;
    }

    /// Of the root: axes and units of FBX become ours, metres. Newer versions of Assimp turn the
    /// root themselves, and bring it to FBX's own unit, the centimetre.
    [[nodiscard]] glm::mat4 worldFromRoot(const glm::mat4& given) const {
        double centimetres = 0;
        if (!scene_.mMetaData) return given;
        float single = 0;
        if (scene_.mMetaData->Get("UnitScaleFactor", single))
            centimetres = single;
        else if (!scene_.mMetaData->Get("UnitScaleFactor", centimetres))
            return given;
        const bool done = given != glm::mat4(1.0f);
        const auto metres = static_cast<float>((done ? 1.0 : centimetres) * 0.01);
        return glm::mat4(glm::mat3(metres)) * (done ? given : worldFromFile());
    }

    static int uvSetOf(const aiMaterial& material, const TextureKeys& keys) {
        int set = 0;
        material.Get(keys.uvSet.c_str(), keys.type, 0, set);
        return set;
    }

    /// The texture coordinates of the first texture of a mesh's material. Assimp leaves out sets
    /// that a mesh does not have, so a number behind the last is that one.
    [[nodiscard]] const aiVector3D* uvsOf(const aiMesh& mesh) const {
        const auto arrays = static_cast<int>(mesh.GetNumUVChannels());
        if (arrays == 0 || mesh.mMaterialIndex >= scene_.mNumMaterials)
            return mesh.mTextureCoords[0];
        const aiMaterial& material = *scene_.mMaterials[mesh.mMaterialIndex];
        std::optional<TextureKeys> first;
        for (std::size_t use = 0; use < kTextureUses && !first; ++use)
            first = keysOf(material, use);
        const int set = first ? uvSetOf(material, *first) : 0;
        return mesh.mTextureCoords[std::clamp(set, 0, arrays - 1)];
    }

    void putNode(const aiNode& node, std::int32_t parent, Packer& to) {
        const std::int32_t self = nodes_++;
        nodeOf_.emplace(node.mName.C_Str(), self);
        to.put(parent);
        to.putText(node.mName.C_Str());
        const glm::mat4 parentFromNode = toMatrix(node.mTransformation);
        to.put(parent < 0 ? worldFromRoot(parentFromNode) : parentFromNode);
        to.putBytes(std::as_bytes(std::span(node.mMeshes, node.mNumMeshes)));
        for (unsigned i = 0; i < node.mNumChildren; ++i) putNode(*node.mChildren[i], self, to);
    }

    [[nodiscard]] bool sendMesh(const aiMesh& mesh) const {
        const aiVector3D* given = uvsOf(mesh);
        MeshHead head;
        head.positions = mesh.mNumVertices;
        head.faces = mesh.mNumFaces;
        head.material = mesh.mMaterialIndex;
        head.normals = mesh.mNormals != nullptr;
        head.colours = mesh.mColors[0] != nullptr;
        head.uvs = given != nullptr;
        const std::span faces(mesh.mFaces, mesh.mNumFaces);
        head.triangles =
            std::ranges::all_of(faces, [](const auto& f) { return f.mNumIndices == 3; });
        for (const auto& face : faces) head.corners += face.mNumIndices;
        std::vector<std::uint32_t> counts, corners;
        corners.reserve(head.corners);
        for (const auto& face : faces)
            corners.insert(corners.end(), face.mIndices, face.mIndices + face.mNumIndices);
        if (!head.triangles)
            for (const auto& face : faces) counts.push_back(face.mNumIndices);
        std::vector<glm::vec2> uvs;
        if (head.uvs) {
            uvs.reserve(head.positions);
            for (const auto& uv : std::span(given, head.positions)) uvs.emplace_back(uv.x, uv.y);
        }
        std::vector<Bone> bones;
        std::vector<BoneWeight> weights;
        for (const aiBone* bone : std::span(mesh.mBones, mesh.mNumBones)) {
            const auto node = nodeOf_.find(bone->mName.C_Str());
            if (node == nodeOf_.end()) continue;
            const auto before = weights.size();
            for (const auto& weight : std::span(bone->mWeights, bone->mNumWeights))
                if (weight.mVertexId < mesh.mNumVertices)
                    weights.push_back({weight.mVertexId, weight.mWeight});
            bones.push_back({static_cast<std::uint32_t>(node->second),
                             static_cast<std::uint32_t>(weights.size() - before),
                             toMatrix(bone->mOffsetMatrix)});
        }
        head.bones = bones.size();
        head.weights = weights.size();
        const std::string_view name = mesh.mName.C_Str();
        const std::uint64_t length = name.size();
        const auto send = [](const void* from, std::size_t size) {
            return size == 0 || sendAll(answers, from, size);
        };
        static_assert(sizeof(aiVector3D) == sizeof(glm::vec3) &&
                      sizeof(aiColor4D) == sizeof(glm::vec4));
        return decoders::sendHead(answers, Tag::mesh,
                                  sizeof(head) + sizeof(length) + length + bytesOf(head).value()) &&
               send(&head, sizeof(head)) && send(&length, sizeof(length)) &&
               send(name.data(), length) &&
               send(mesh.mVertices, head.positions * sizeof(aiVector3D)) &&
               (!head.normals || send(mesh.mNormals, head.positions * sizeof(aiVector3D))) &&
               (!head.colours || send(mesh.mColors[0], head.positions * sizeof(aiColor4D))) &&
               send(uvs.data(), uvs.size() * sizeof(uvs[0])) &&
               send(counts.data(), counts.size() * sizeof(counts[0])) &&
               send(corners.data(), corners.size() * sizeof(corners[0])) &&
               send(bones.data(), bones.size() * sizeof(bones[0])) &&
               send(weights.data(), weights.size() * sizeof(weights[0]));
    }

    const aiScene& scene_;
    Packer out_;
    std::int32_t nodes_ = 0;
    std::map<std::string, std::int32_t> nodeOf_;  ///< by name, the first of each
    std::vector<const aiTexture*> embedded_;
    std::map<const aiTexture*, std::int32_t> numbers_;
};

void serve(int socket, int file) {
    constexpr std::uint64_t kLargestRequest = 1 << 20;
    answers = socket;
    Tag tag{};
    std::vector<std::byte> request;
    const decoders::GivenFile given(socket, file);
    if (!decoders::receiveMessage(socket, tag, request, kLargestRequest, -1)) return;
    const auto failed = [&](ErrorCode code, std::string text) {
        std::ranges::replace(text, '\n', ' ');
        (void)decoders::sendFailure(socket, static_cast<int>(code), text);
    };
    if (tag != Tag::readModel || !given.there())
        return failed(ErrorCode::failed, "the model did not come");
    std::set_new_handler(onNoMemory);
    try {
        const std::string name = kModelFolder + decoders::Unpacker(request).getText();
        Assimp::Importer importer;
        // Else files without meshes get those of bones that nobody made.
        importer.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);
        importer.SetIOHandler(new Files(given.bytes(), name));
        const aiScene* scene = importer.ReadFile(name, 0);
        if (!scene)
            return failed(ErrorCode::invalidInput, *importer.GetErrorString() != 0
                                                       ? importer.GetErrorString()
                                                       : "no reason given");
        if (!SceneTeller(*scene).tell()) ::_exit(1);
    } catch (const std::exception& e) {
        failed(ErrorCode::invalidInput, e.what());
    } catch (...) {
        failed(ErrorCode::invalidInput, "no reason given");
    }
}

const char* libraries() {
    static const std::string text = fmt::format("Assimp {}.{}.{}", aiGetVersionMajor(),
                                                aiGetVersionMinor(), aiGetVersionPatch());
    return text.c_str();
}

}  // namespace
}  // namespace stx::models

extern "C" __attribute__((visibility("default"))) const stx::decoders::Module* stxDecoder() {
    static const stx::decoders::Module module = {
        stx::decoders::kModuleVersion, stx::models::libraries, nullptr, stx::models::serve};
    return &module;
}

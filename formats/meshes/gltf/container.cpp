#include <algorithm>
#include <cstring>

#include "formats/files/base64.hpp"
#include "formats/meshes/gltf/gltf_file.hpp"

namespace stx::gltf {
namespace {

std::uint32_t readU32(ByteSpan bytes, std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i)
        value |= std::to_integer<std::uint32_t>(bytes[at + i]) << (8 * i);
    return value;
}

/// Extensions that are read, or that add nothing to shape and base colour; of those that are not
/// read, what uses them is asked for by GltfFile::mayLack().
constexpr std::string_view kKnownExtensions[] = {
    "KHR_draco_mesh_compression",
    "KHR_gaussian_splatting",
    "KHR_mesh_quantization",
    "KHR_texture_basisu",  // not read: mayLack()
    "KHR_texture_transform",
    "KHR_materials_unlit",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_emissive_strength",
    "KHR_materials_clearcoat",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_anisotropy",
    "KHR_materials_dispersion",
    "KHR_materials_transmission",  // not read: mayLack()
    "KHR_materials_volume",
    "KHR_materials_variants",
    "KHR_lights_punctual",
    "KHR_animation_pointer",
    "KHR_node_visibility",
    "KHR_xmp_json_ld",
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "EXT_mesh_features",
    "EXT_instance_features",
    "EXT_structural_metadata",
};

}  // namespace

Result<GltfFile> GltfFile::open(ByteSpan bytes, ModelFiles& files, MeshBuilder& builder) {
    GltfFile model;
    model.files_ = &files;
    model.builder_ = &builder;
    ByteSpan json = bytes;
    if (bytes.size() >= 4 && std::memcmp(bytes.data(), "glTF", 4) == 0) {
        if (bytes.size() < 12)
            return fail(ErrorCode::invalidInput, "the GLB header needs 12 bytes, the file has {}",
                        bytes.size());
        const auto version = readU32(bytes, 4);
        if (version != 2)
            return fail(version == 1 ? ErrorCode::unsupported : ErrorCode::invalidInput,
                        "the GLB file has version {}, expected 2", version);
        const std::uint64_t length = readU32(bytes, 8);
        if (length > bytes.size())
            return fail(ErrorCode::invalidInput,
                        "the GLB header says {} bytes, but the file has only {}; it is cut short",
                        length, bytes.size());
        if (length < bytes.size())
            model.job().note(fmt::format("{} bytes behind the end of the GLB file are not read",
                                         bytes.size() - length));
        bytes = bytes.first(length);
        std::size_t at = 12;
        json = {};
        bool hasJson = false;
        for (int chunk = 0; at < bytes.size(); ++chunk) {
            if (bytes.size() - at < 8)
                return fail(ErrorCode::invalidInput,
                            "the header of GLB chunk {} at byte {} is cut short", chunk, at);
            const std::uint64_t size = readU32(bytes, at);
            const auto type = readU32(bytes, at + 4);
            at += 8;
            if (size > bytes.size() - at)
                return fail(ErrorCode::invalidInput,
                            "GLB chunk {} at byte {} says {} bytes, but only {} follow", chunk,
                            at - 8, size, bytes.size() - at);
            const auto content = bytes.subspan(at, size);
            if (type == 0x4E4F534A && chunk == 0) {
                json = content;
                hasJson = true;
            } else if (type == 0x004E4942 && chunk == 1) {
                model.binaryChunk_ = content;
                model.hasBinaryChunk_ = true;
            } else if (chunk == 0) {
                return fail(ErrorCode::invalidInput, "the first GLB chunk is not JSON");
            }
            at += size;
        }
        if (!hasJson) return fail(ErrorCode::invalidInput, "the GLB file has no JSON chunk");
    }
    STX_CHECK(model.parse(json));
    STX_CHECK(model.checkAsset());
    model.buffers_.resize(listSize(model.root_, "buffers"));
    return model;
}

Result<void> GltfFile::parse(ByteSpan bytes) {
    // Each value follows one of these; it takes some 40 bytes, its text once more.
    std::uint64_t values = 1;
    for (const auto b : bytes) {
        const auto c = static_cast<char>(b);
        values += c == ',' || c == '[' || c == '{' || c == ':' ? 1 : 0;
    }
    STX_CHECK(builder_->charge(values, 40, "the JSON text"));
    STX_CHECK(builder_->charge(bytes.size(), 1, "the JSON text"));
    const auto* text = reinterpret_cast<const char*>(bytes.data());
    try {
        root_ = Json::parse(text, text + bytes.size());
    } catch (const std::exception& e) {
        std::string_view what = e.what();
        // nlohmann's messages begin with "[json.exception.parse_error.101] ".
        if (const auto bracket = what.find("] "); bracket != std::string_view::npos)
            what.remove_prefix(bracket + 2);
        std::string line(what.substr(0, 160));
        std::replace_if(
            line.begin(), line.end(), [](char c) { return static_cast<unsigned char>(c) < 32; },
            ' ');
        return fail(ErrorCode::invalidInput, "the glTF text is not JSON: {}", line);
    }
    if (!root_.is_object())
        return fail(ErrorCode::invalidInput, "the glTF text is a JSON {}, expected an object",
                    root_.type_name());
    return {};
}

Result<void> GltfFile::checkAsset() {
    STX_TRY(const Json* asset, getObject(root_, "asset", ""));
    if (!asset)
        return fail(ErrorCode::invalidInput,
                    "the JSON has no \"asset\" object, so it is not a glTF 2.0 file");
    STX_TRY(const auto version, getString(*asset, "version", "asset"));
    if (!version)
        return fail(ErrorCode::invalidInput, "asset.version is missing; expected \"2.0\"");
    if (version->substr(0, 2) != "2.")
        return fail(
            version->substr(0, 2) == "1." ? ErrorCode::unsupported : ErrorCode::invalidInput,
            "asset.version is \"{}\", expected \"2.0\"; convert the file with a glTF 2 exporter",
            *version);
    STX_TRY(const Json* required, getArray(root_, "extensionsRequired", ""));
    for (std::size_t i = 0; required && i < required->size(); ++i) {
        const auto& name = (*required)[i];
        if (!name.is_string())
            return fail(ErrorCode::invalidInput,
                        "extensionsRequired[{}] is a {}, expected a string", i, name.type_name());
        const auto& text = name.get_ref<const std::string&>();
        if (std::find(std::begin(kKnownExtensions), std::end(kKnownExtensions), text) ==
            std::end(kKnownExtensions))
            return fail(
                ErrorCode::unsupported,
                "the file requires the glTF extension {}, which is not known here; export it "
                "without",
                text);
        required_.insert(text);
    }
    return {};
}

Result<void> GltfFile::mayLack(std::string_view extension, std::string_view where,
                               std::string_view wayOut) const {
    if (!required_.contains(extension)) return {};
    return fail(ErrorCode::unsupported,
                "{} needs the glTF extension {}, which the file requires and which is not drawn "
                "here; {}",
                where, extension, wayOut);
}

Result<Bytes> GltfFile::uri(const std::string& uri, const std::string& user) {
    if (uri.starts_with("data:")) {
        const auto comma = uri.find(',');
        const std::string_view header = std::string_view(uri).substr(0, comma);
        if (comma == std::string::npos)
            return fail(ErrorCode::invalidInput, "{}: the data URI has no comma before its data",
                        user);
        const std::string_view data = std::string_view(uri).substr(comma + 1);
        if (header.ends_with(";base64")) {
            auto bytes = decodeBase64(data);
            if (!bytes)
                return fail(ErrorCode::invalidInput, "{}: the data URI is not valid base64 text",
                            user);
            return std::move(*bytes);
        }
        const auto text = percentDecoded(data);
        const auto* first = reinterpret_cast<const std::byte*>(text.data());
        return Bytes(first, first + text.size());
    }
    if (hasUriScheme(uri))
        return fail(
            ErrorCode::invalidInput,
            "{}: '{}' is a network or absolute address; only files beside the model are read", user,
            uri.substr(0, 120));
    auto bytes = files_->read(percentDecoded(uri));
    if (!bytes && bytes.error().code == ErrorCode::io && percentDecoded(uri) != uri) {
        if (auto literal = files_->read(uri)) return literal;
    }
    if (!bytes) return tl::unexpected(bytes.error().at(user));
    return bytes;
}

Result<ByteSpan> GltfFile::buffer(std::uint64_t index, const std::string& user) {
    STX_TRY(const Json* object, element(root_, "buffers", index, user));
    if (buffers_[index]) return *buffers_[index];
    const auto where = fmt::format("buffers[{}]", index);
    STX_TRY(const auto length, getUint(*object, "byteLength", where));
    if (!length) return fail(ErrorCode::invalidInput, "{} has no byteLength", where);
    STX_TRY(const auto uriText, getString(*object, "uri", where));
    ByteSpan bytes;
    if (uriText) {
        STX_TRY(auto loaded, uri(*uriText, where));
        STX_CHECK(builder_->charge(loaded.size(), 1, where));
        owned_.push_back(std::make_unique<Bytes>(std::move(loaded)));
        bytes = *owned_.back();
    } else if (index == 0 && hasBinaryChunk_) {
        bytes = binaryChunk_;
    } else {
        return fail(ErrorCode::invalidInput, "{} has neither a uri nor a GLB binary chunk", where);
    }
    if (*length > bytes.size())
        return fail(ErrorCode::invalidInput, "{} says {} bytes, but its data has only {}", where,
                    *length, bytes.size());
    buffers_[index] = bytes.first(*length);
    return *buffers_[index];
}

Result<BufferView> GltfFile::bufferView(std::uint64_t index, const std::string& user) {
    STX_TRY(const Json* object, element(root_, "bufferViews", index, user));
    const auto where = fmt::format("bufferViews[{}]", index);
    STX_TRY(const Json* packed, getExtension(*object, "EXT_meshopt_compression", where));
    if (packed) {
        STX_TRY(const auto bytes, unpacked(*packed, index, where));
        STX_TRY(const auto stride, getUint(*object, "byteStride", where));
        return BufferView{bytes, stride.value_or(0)};
    }
    STX_TRY(const auto bufferIndex, getUint(*object, "buffer", where));
    if (!bufferIndex) return fail(ErrorCode::invalidInput, "{} names no buffer", where);
    STX_TRY(const auto length, getUint(*object, "byteLength", where));
    if (!length) return fail(ErrorCode::invalidInput, "{} has no byteLength", where);
    STX_TRY(const auto offset, getUint(*object, "byteOffset", where));
    STX_TRY(const auto stride, getUint(*object, "byteStride", where));
    STX_TRY(const auto bytes, buffer(*bufferIndex, where));
    const auto begin = offset.value_or(0);
    if (begin > bytes.size() || *length > bytes.size() - begin)
        return fail(ErrorCode::invalidInput,
                    "{} is bytes {} to {} of buffers[{}], which has only {}", where, begin,
                    begin + *length, *bufferIndex, bytes.size());
    return BufferView{bytes.subspan(begin, *length), stride.value_or(0)};
}

}  // namespace stx::gltf

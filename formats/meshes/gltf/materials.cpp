#include "formats/meshes/gltf/materials.hpp"

#include <cmath>

namespace stx::gltf {

glm::vec2 UvSource::apply(glm::vec2 uv) const {
    const double c = std::cos(rotation), s = std::sin(rotation);
    const double u = uv.x * scale.x, v = uv.y * scale.y;
    // The extension's words, its example and Khronos' viewer turn this way; its GLSL the other.
    return {static_cast<float>(c * u + s * v + offset.x),
            static_cast<float>(-s * u + c * v + offset.y)};
}

Result<MaterialUse> Materials::use(std::optional<std::uint64_t> index, const std::string& user) {
    const std::int64_t key = index ? static_cast<std::int64_t>(*index) : -1;
    if (const auto it = known_.find(key); it != known_.end()) return it->second;
    MaterialUse result;
    if (index) {
        STX_TRY(result, read(*index, user));
    } else {
        result.index = static_cast<std::uint32_t>(builder_.materials().size());
        builder_.materials().push_back({.name = "default", .doubleSided = false});
    }
    known_.emplace(key, result);
    return result;
}

MaterialUse Materials::withoutTextures(const MaterialUse& use, bool keepBase, bool keepNormal) {
    MaterialUse result = use;
    if (!keepBase) result.baseColour = {};
    if (!keepNormal) result.normal = {};
    const auto [it, isNew] = plain_.try_emplace({use.index, keepBase, keepNormal}, 0);
    if (isNew) {
        auto material = builder_.materials()[use.index];
        if (!keepBase) material.baseColourTexture = -1;
        if (!keepNormal) material.normalTexture = -1;
        it->second = static_cast<std::uint32_t>(builder_.materials().size());
        builder_.materials().push_back(std::move(material));
    }
    result.index = it->second;
    return result;
}

Result<int> Materials::texture(const Json& info, const std::string& where, UvSource& uv) {
    STX_TRY(const auto index, getUint(info, "index", where));
    if (!index) return fail(ErrorCode::invalidInput, "{} has no index of a texture", where);
    STX_TRY(const auto set, getUint(info, "texCoord", where));
    uv = {};
    uv.set = static_cast<int>(std::min<std::uint64_t>(set.value_or(0), 1000));
    STX_TRY(const Json* transform, getExtension(info, "KHR_texture_transform", where));
    if (transform) {
        const auto at = where + ".extensions.KHR_texture_transform";
        STX_CHECK(getNumbers(*transform, "offset", at, {&uv.offset.x, 2}));
        STX_CHECK(getNumbers(*transform, "scale", at, {&uv.scale.x, 2}));
        STX_TRY(const auto rotation, getNumber(*transform, "rotation", at));
        uv.rotation = rotation.value_or(0);
        STX_TRY(const auto override, getUint(*transform, "texCoord", at));
        if (override) uv.set = static_cast<int>(std::min<std::uint64_t>(*override, 1000));
    }

    STX_TRY(const Json* object, element(model_.root(), "textures", *index, where));
    const auto textureWhere = fmt::format("textures[{}]", *index);
    SamplerState state;
    STX_TRY(const auto sampler, getUint(*object, "sampler", textureWhere));
    if (sampler) {
        STX_TRY(const Json* s, element(model_.root(), "samplers", *sampler, textureWhere));
        const auto samplerWhere = fmt::format("samplers[{}]", *sampler);
        const auto wrap = [&](const char* key) -> Result<MeshTexture::Wrap> {
            STX_TRY(const auto value, getUint(*s, key, samplerWhere));
            switch (value.value_or(10497)) {
                case 10497:
                    return MeshTexture::Wrap::repeat;
                case 33071:
                    return MeshTexture::Wrap::clamp;
                case 33648:
                    return MeshTexture::Wrap::mirror;
                default:
                    return fail(ErrorCode::invalidInput,
                                "{}.{} is {}, expected 10497, 33071 or 33648", samplerWhere, key,
                                *value);
            }
        };
        STX_TRY(state.wrapU, wrap("wrapS"));
        STX_TRY(state.wrapV, wrap("wrapT"));
        STX_TRY(const auto filter, getUint(*s, "magFilter", samplerWhere));
        state.nearest = filter.value_or(9729) == 9728;
    }

    STX_TRY(auto source, getUint(*object, "source", textureWhere));
    STX_TRY(const Json* webp, getExtension(*object, "EXT_texture_webp", textureWhere));
    if (webp) {
        STX_TRY(const auto webpSource, getUint(*webp, "source", textureWhere));
        if (webpSource) source = webpSource;
    }
    if (!source) {
        model_.job().note(fmt::format(
            "{} names no image that can be read; the plain colour is used", textureWhere));
        return -1;
    }
    STX_TRY(const Json* image, element(model_.root(), "images", *source, textureWhere));
    const auto imageWhere = fmt::format("images[{}]", *source);
    STX_TRY(const auto uri, getString(*image, "uri", imageWhere));
    STX_TRY(const auto view, getUint(*image, "bufferView", imageWhere));
    auto& textures = builder_.textures();
    int result = -1;
    if (uri && !uri->starts_with("data:")) {
        auto name = percentDecoded(*uri);
        if (name != *uri && resolveInside(model_.files().folder(), *uri, model_.job().limits))
            name = *uri;
        STX_TRY(result, model_.files().textureFromFile(name, state, textures));
    } else if (uri) {
        STX_TRY(const auto bytes, model_.uri(*uri, imageWhere));
        STX_TRY(result, model_.files().textureFromBytes(bytes, imageWhere, state, textures));
    } else if (view) {
        STX_TRY(const auto bytes, model_.bufferView(*view, imageWhere));
        STX_TRY(result, model_.files().textureFromBytes(bytes.bytes, imageWhere, state, textures));
    } else {
        return fail(ErrorCode::invalidInput, "{} has neither a uri nor a bufferView", imageWhere);
    }
    uv.used = result >= 0;
    return result;
}

Result<MaterialUse> Materials::read(std::uint64_t index, const std::string& user) {
    STX_TRY(const Json* object, element(model_.root(), "materials", index, user));
    const auto where = fmt::format("materials[{}]", index);
    MaterialUse use;
    Material m;
    STX_TRY(const auto name, getString(*object, "name", where));
    m.name = name.value_or(where);
    STX_TRY(const Json* glossy,
            getExtension(*object, "KHR_materials_pbrSpecularGlossiness", where));
    STX_TRY(const Json* pbr, getObject(*object, "pbrMetallicRoughness", where));
    const Json* base = glossy ? glossy : pbr;
    const auto baseWhere = where + (glossy ? ".extensions.KHR_materials_pbrSpecularGlossiness"
                                           : ".pbrMetallicRoughness");
    if (base) {
        glm::dvec4 factor(1.0);
        STX_CHECK(getNumbers(*base, glossy ? "diffuseFactor" : "baseColorFactor", baseWhere,
                             {&factor.x, 4}));
        m.baseColour = glm::vec4(factor);
        const char* key = glossy ? "diffuseTexture" : "baseColorTexture";
        STX_TRY(const Json* info, getObject(*base, key, baseWhere));
        if (info && !model_.files().replacesColour()) {
            STX_TRY(m.baseColourTexture, texture(*info, baseWhere + "." + key, use.baseColour));
        }
        if (base->contains("metallicRoughnessTexture")) ++dropped["metallic-roughness maps"];
        if (base->contains("specularGlossinessTexture")) ++dropped["specular-glossiness maps"];
    }
    STX_TRY(const Json* normal, getObject(*object, "normalTexture", where));
    if (normal) {
        STX_TRY(m.normalTexture, texture(*normal, where + ".normalTexture", use.normal));
        STX_TRY(const auto scale, getNumber(*normal, "scale", where + ".normalTexture"));
        m.normalScale = static_cast<float>(scale.value_or(1.0));
    }
    if (object->contains("occlusionTexture")) ++dropped["occlusion maps"];
    if (object->contains("emissiveTexture")) ++dropped["emissive maps"];
    glm::dvec3 emissive(0.0);
    STX_CHECK(getNumbers(*object, "emissiveFactor", where, {&emissive.x, 3}));
    if (emissive != glm::dvec3(0.0) && !object->contains("emissiveTexture"))
        ++dropped["emissive colours"];
    STX_TRY(const auto alphaMode, getString(*object, "alphaMode", where));
    if (alphaMode == "MASK") {
        m.alpha = Material::Alpha::mask;
    } else if (alphaMode == "BLEND") {
        m.alpha = Material::Alpha::blend;
    } else if (alphaMode.value_or("OPAQUE") != "OPAQUE") {
        return fail(ErrorCode::invalidInput, "{}.alphaMode is '{}', expected OPAQUE, MASK or BLEND",
                    where, *alphaMode);
    }
    STX_TRY(const auto cutoff, getNumber(*object, "alphaCutoff", where));
    m.alphaCutoff = static_cast<float>(cutoff.value_or(0.5));
    STX_TRY(const auto doubleSided, getBool(*object, "doubleSided", where));
    m.doubleSided = doubleSided.value_or(false);
    use.index = static_cast<std::uint32_t>(builder_.materials().size());
    builder_.materials().push_back(std::move(m));
    return use;
}

}  // namespace stx::gltf

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
        builder_.materials().push_back(
            {.name = "default", .doubleSided = false, .hasColour = false});
        if (model_.files().replacesColour()) {
            result.baseColour.used = true;
            builder_.materials().back().baseColourTexture = placeOfColour({});
        }
        if (model_.files().materials()) {
            builder_.materials().back().metallic = 1.0f;
            builder_.materials().back().hasMetallicRoughness = true;
        }
    }
    known_.emplace(key, result);
    return result;
}

MaterialUse Materials::withoutTextures(const MaterialUse& use, TexturesKept kept) {
    MaterialUse result = use;
    if (!kept.baseColour) result.baseColour = {};
    if (!kept.normal) result.normal = {};
    if (!kept.metallicRoughness) result.metallicRoughness = {};
    if (!kept.emissive) result.emissive = {};
    const auto [it, isNew] = plain_.try_emplace({use.index, kept}, 0);
    if (isNew) {
        auto material = builder_.materials()[use.index];
        if (!kept.baseColour) material.baseColourTexture = -1;
        if (!kept.metallicRoughness) material.metallicRoughnessTexture = -1;
        if (!kept.emissive) {
            // A map of what shines, which is dark for the most part.
            if (material.emissiveTexture >= 0) material.emissive = glm::vec3(0.0f);
            material.emissiveTexture = -1;
        }
        if (!kept.normal) material.normalTexture = -1;
        it->second = static_cast<std::uint32_t>(builder_.materials().size());
        builder_.materials().push_back(std::move(material));
    }
    result.index = it->second;
    return result;
}

namespace {

Result<UvSource> uvSourceOf(const Json& info, const std::string& where) {
    // No mesh has so many sets.
    constexpr std::uint64_t kMostSets = 1000;
    UvSource uv;
    STX_TRY(const auto set, getUint(info, "texCoord", where));
    uv.set = static_cast<int>(std::min(set.value_or(0), kMostSets));
    STX_TRY(const Json* transform, getExtension(info, "KHR_texture_transform", where));
    if (!transform) return uv;
    const auto at = where + ".extensions.KHR_texture_transform";
    STX_CHECK(getNumbers(*transform, "offset", at, {&uv.offset.x, 2}));
    STX_CHECK(getNumbers(*transform, "scale", at, {&uv.scale.x, 2}));
    STX_TRY(const auto rotation, getNumber(*transform, "rotation", at));
    uv.rotation = rotation.value_or(0);
    STX_TRY(const auto override, getUint(*transform, "texCoord", at));
    if (override) uv.set = static_cast<int>(std::min(*override, kMostSets));
    return uv;
}

/// glTF 2.0, 5.26; without a `sampler` the defaults.
Result<SamplerState> samplerOf(const Json& root, std::optional<std::uint64_t> sampler,
                               const std::string& textureWhere) {
    SamplerState state;
    if (!sampler) return state;
    STX_TRY(const Json* s, element(root, "samplers", *sampler, textureWhere));
    const auto where = fmt::format("samplers[{}]", *sampler);
    const auto wrap = [&](const char* key) -> Result<MeshTexture::Wrap> {
        STX_TRY(const auto value, getUint(*s, key, where));
        switch (value.value_or(10497)) {
            case 10497:
                return MeshTexture::Wrap::repeat;
            case 33071:
                return MeshTexture::Wrap::clamp;
            case 33648:
                return MeshTexture::Wrap::mirror;
            default:
                return fail(ErrorCode::invalidInput, "{}.{} is {}, expected 10497, 33071 or 33648",
                            where, key, *value);
        }
    };
    STX_TRY(state.wrapU, wrap("wrapS"));
    STX_TRY(state.wrapV, wrap("wrapT"));
    STX_TRY(const auto filter, getUint(*s, "magFilter", where));
    state.nearest = filter.value_or(9729) == 9728;
    return state;
}

/// The sampler of a texture.
Result<SamplerState> samplerOfTexture(const Json& root, const Json& texture,
                                      const std::string& where) {
    STX_TRY(const auto sampler, getUint(texture, "sampler", where));
    return samplerOf(root, sampler, where);
}

}  // namespace

int Materials::placeOfColour(const SamplerState& state) {
    const auto [it, isNew] = places_.try_emplace({state.wrapU, state.wrapV, state.nearest},
                                                 static_cast<int>(builder_.textures().size()));
    if (isNew)
        builder_.textures().push_back({Rgba8Image(1, 1), state.wrapU, state.wrapV, state.nearest});
    return it->second;
}

Result<void> Materials::readBaseColour(const Json* info, const std::string& where, Material& m,
                                       MaterialUse& use) {
    if (!model_.files().replacesColour()) {
        if (info) STX_SET(m.baseColourTexture, texture(*info, where, use.baseColour));
        return {};
    }
    SamplerState state;
    if (info) {
        STX_TRY(use.baseColour, uvSourceOf(*info, where));
        STX_TRY(const auto index, getUint(*info, "index", where));
        if (index) {
            STX_TRY(const Json* object, element(model_.root(), "textures", *index, where));
            STX_SET(state,
                    samplerOfTexture(model_.root(), *object, fmt::format("textures[{}]", *index)));
        }
    }
    use.baseColour.used = true;
    m.baseColourTexture = placeOfColour(state);
    return {};
}

Result<int> Materials::texture(const Json& info, const std::string& where, UvSource& uv) {
    STX_TRY(const auto index, getUint(info, "index", where));
    if (!index) return fail(ErrorCode::invalidInput, "{} has no index of a texture", where);
    STX_TRY(uv, uvSourceOf(info, where));
    STX_TRY(const Json* object, element(model_.root(), "textures", *index, where));
    const auto textureWhere = fmt::format("textures[{}]", *index);
    STX_TRY(const SamplerState state, samplerOfTexture(model_.root(), *object, textureWhere));
    STX_TRY(const auto source, imageOf(*object, textureWhere));
    if (!source) return -1;
    STX_TRY(const int result, readImage(*source, textureWhere, state));
    uv.used = result >= 0;
    return result;
}

Result<std::optional<std::uint64_t>> Materials::imageOf(const Json& texture,
                                                        const std::string& where) {
    STX_TRY(auto source, getUint(texture, "source", where));
    STX_TRY(const Json* webp, getExtension(texture, "EXT_texture_webp", where));
    if (webp) {
        STX_TRY(const auto webpSource, getUint(*webp, "source", where));
        if (webpSource) source = webpSource;
    }
    STX_TRY(const Json* basis, getExtension(texture, "KHR_texture_basisu", where));
    if (!source && basis)
        STX_CHECK(model_.mayLack("KHR_texture_basisu", where,
                                 "export PNG or JPEG textures, or give one with --texture"));
    if (!source)
        model_.job().note(
            basis ? fmt::format(
                        "{} is in Basis Universal (KHR_texture_basisu), which cannot be decoded "
                        "here: the plain colour is used; export PNG or JPEG textures, or give one "
                        "with --texture",
                        where)
                  : fmt::format("{} names no image that can be read; the plain colour is used",
                                where));
    return source;
}

Result<int> Materials::readImage(std::uint64_t index, const std::string& textureWhere,
                                 const SamplerState& state) {
    STX_TRY(const Json* image, element(model_.root(), "images", index, textureWhere));
    const auto where = fmt::format("images[{}]", index);
    STX_TRY(const auto uri, getString(*image, "uri", where));
    STX_TRY(const auto view, getUint(*image, "bufferView", where));
    auto& textures = builder_.textures();
    if (uri && !uri->starts_with("data:")) {
        auto name = percentDecoded(*uri);
        if (name != *uri && resolveInside(model_.files().folder(), *uri, model_.job().limits))
            name = *uri;
        return model_.files().textureFromFile(name, state, textures);
    }
    if (uri) {
        STX_TRY(const auto bytes, model_.uri(*uri, where));
        return model_.files().textureFromBytes(bytes, where, state, textures);
    }
    if (view) {
        STX_TRY(const auto bytes, model_.bufferView(*view, where));
        return model_.files().textureFromBytes(bytes.bytes, where, state, textures);
    }
    return fail(ErrorCode::invalidInput, "{} has neither a uri nor a bufferView", where);
}

Result<void> Materials::readEmissive(const Json& object, const std::string& where, Material& m,
                                     MaterialUse& use) {
    glm::dvec3 factor(0.0);
    STX_CHECK(getNumbers(object, "emissiveFactor", where, {&factor.x, 3}));
    STX_TRY(const Json* stronger, getExtension(object, "KHR_materials_emissive_strength", where));
    if (stronger) {
        STX_TRY(const auto strength, getNumber(*stronger, "emissiveStrength", where));
        factor *= std::clamp(strength.value_or(1.0), 0.0, 1e6);
    }
    STX_TRY(const Json* info, getObject(object, "emissiveTexture", where));
    if (factor == glm::dvec3(0.0)) return {};
    m.emissive = glm::clamp(glm::vec3(factor), 0.0f, 1e6f);
    if (!info) return {};
    STX_TRY(m.emissiveTexture, texture(*info, where + ".emissiveTexture", use.emissive));
    if (m.emissiveTexture < 0) m.emissive = glm::vec3(0.0f);
    if (!use.baseColour.used) use.baseColour = use.emissive;
    return {};
}

Result<void> Materials::readMetallicRoughness(const Json* base, bool glossy,
                                              const std::string& where, Material& m,
                                              MaterialUse& use) {
    if (base && base->contains("specularGlossinessTexture")) ++dropped["specular-glossiness maps"];
    if (!model_.files().materials()) {
        if (base && base->contains("metallicRoughnessTexture"))
            ++dropped["metallic-roughness maps"];
        return {};
    }
    m.hasMetallicRoughness = true;
    const auto factor = [&](const char* name) -> Result<float> {
        if (!base) return 1.0f;
        STX_TRY(const auto value, getNumber(*base, name, where));
        return static_cast<float>(std::clamp(value.value_or(1.0), 0.0, 1.0));
    };
    if (glossy) {
        // The nearest that metallic-roughness has to a specular colour of its own.
        STX_TRY(const float gloss, factor("glossinessFactor"));
        m.roughness = 1.0f - gloss;
        return {};
    }
    STX_TRY(m.metallic, factor("metallicFactor"));
    STX_TRY(m.roughness, factor("roughnessFactor"));
    if (!base) return {};
    STX_TRY(const Json* info, getObject(*base, "metallicRoughnessTexture", where));
    if (!info) return {};
    STX_TRY(m.metallicRoughnessTexture,
            texture(*info, where + ".metallicRoughnessTexture", use.metallicRoughness));
    if (!use.baseColour.used) use.baseColour = use.metallicRoughness;
    return {};
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
    m.hasColour = false;
    const char* key = glossy ? "diffuseTexture" : "baseColorTexture";
    const Json* colour = nullptr;
    if (base) {
        glm::dvec4 factor(1.0);
        STX_CHECK(getNumbers(*base, glossy ? "diffuseFactor" : "baseColorFactor", baseWhere,
                             {&factor.x, 4}));
        m.baseColour = glm::vec4(factor);
        m.hasColour = base->contains(glossy ? "diffuseFactor" : "baseColorFactor");
        STX_SET(colour, getObject(*base, key, baseWhere));
    }
    STX_CHECK(readBaseColour(colour, baseWhere + "." + key, m, use));
    STX_CHECK(readMetallicRoughness(base, glossy != nullptr, baseWhere, m, use));
    STX_TRY(const Json* normal, getObject(*object, "normalTexture", where));
    if (normal) {
        STX_TRY(m.normalTexture, texture(*normal, where + ".normalTexture", use.normal));
        STX_TRY(const auto scale, getNumber(*normal, "scale", where + ".normalTexture"));
        m.normalScale = static_cast<float>(scale.value_or(1.0));
    }
    if (object->contains("occlusionTexture")) ++dropped["occlusion maps"];
    STX_TRY(const Json* glass, getExtension(*object, "KHR_materials_transmission", where));
    if (glass) {
        STX_TRY(const auto factor, getNumber(*glass, "transmissionFactor",
                                             where + ".extensions.KHR_materials_transmission"));
        if (factor.value_or(0.0) > 0.0) {
            STX_CHECK(model_.mayLack("KHR_materials_transmission", where, "export it without"));
            ++dropped["transmission of materials"];
        }
    }
    STX_TRY(const Json* unlit, getExtension(*object, "KHR_materials_unlit", where));
    m.unlit = unlit != nullptr;
    // The colour of an unlit material is its base colour alone; what it emits is for programs that
    // do not know the extension.
    if (!unlit) STX_CHECK(readEmissive(*object, where, m, use));
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

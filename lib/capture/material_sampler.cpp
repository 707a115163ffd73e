#include "lib/capture/material_sampler.hpp"

#include <algorithm>
#include <cmath>

#include "lib/base/float4.hpp"
#include "lib/base/rounding.hpp"
#include "lib/model/srgb8.hpp"
#include "lib/model/texture.hpp"

namespace stx {
namespace {

int wrapped(int i, int n, MeshTexture::Wrap wrap) {
    // Nearly always inside or one step out; the divisions are for the rest.
    if (i >= 0 && i < n) return i;
    switch (wrap) {
        case MeshTexture::Wrap::clamp:
            return std::clamp(i, 0, n - 1);
        case MeshTexture::Wrap::mirror: {
            const int m = ((i % (2 * n)) + 2 * n) % (2 * n);
            return m < n ? m : 2 * n - 1 - m;
        }
        case MeshTexture::Wrap::repeat:
            break;
    }
    return ((i % n) + n) % n;
}

template <class T>
T mix3(const std::vector<T>& values, const glm::uvec3& t, glm::vec3 b) {
    return values[t.x] * b.x + values[t.y] * b.y + values[t.z] * b.z;
}

/// Far-out coordinates wrap before they are scaled, so that ints hold them.
float reduced(float v, MeshTexture::Wrap wrap) {
    if (wrap != MeshTexture::Wrap::clamp && std::abs(v) < 2.0f) return v;
    if (!std::isfinite(v)) return 0.0f;
    if (wrap == MeshTexture::Wrap::clamp) return std::clamp(v, 0.0f, 1.0f);
    return v - 2.0f * std::floor(v * 0.5f);
}

}  // namespace

glm::vec4 sampleTexture(const MeshTexture& texture, glm::vec2 uv) {
    const auto& image = texture.pixels;
    const int w = image.width(), h = image.height();
    const float x = reduced(uv.x, texture.wrapU) * w - 0.5f;
    const float y = reduced(uv.y, texture.wrapV) * h - 0.5f;
    if (texture.nearest) {
        const int ix = wrapped(floorToInt(x + 0.5f), w, texture.wrapU);
        const int iy = wrapped(floorToInt(y + 0.5f), h, texture.wrapV);
        return glm::vec4(image.at(ix, iy)) * (1.0f / 255.0f);
    }
    const int bx = floorToInt(x), by = floorToInt(y);
    const float fx = x - static_cast<float>(bx), fy = y - static_cast<float>(by);
    const int x0 = wrapped(bx, w, texture.wrapU), x1 = wrapped(bx + 1, w, texture.wrapU);
    const int y0 = wrapped(by, h, texture.wrapV), y1 = wrapped(by + 1, h, texture.wrapV);
    const Float4 top = floatsOf(image.at(x0, y0)) * (1 - fx) + floatsOf(image.at(x1, y0)) * fx;
    const Float4 bottom = floatsOf(image.at(x0, y1)) * (1 - fx) + floatsOf(image.at(x1, y1)) * fx;
    const Float4 mean = (top * (1 - fy) + bottom * fy) * (1.0f / 255.0f);
    return {mean[0], mean[1], mean[2], mean[3]};
}

bool hasMetallicRoughness(const Mesh& mesh) {
    return std::any_of(mesh.materials.begin(), mesh.materials.end(),
                       [](const Material& m) { return m.hasMetallicRoughness; });
}

bool emits(const Mesh& mesh) {
    return std::any_of(mesh.materials.begin(), mesh.materials.end(),
                       [](const Material& m) { return m.emissive != glm::vec3(0.0f); });
}

bool mayExceedWhite(const Mesh& mesh) {
    const auto exceeds = [](glm::vec3 c) { return std::max({c.x, c.y, c.z}) > 1.0f; };
    return emits(mesh) ||
           std::ranges::any_of(mesh.materials,
                               [&](const Material& m) { return exceeds(m.baseColour); }) ||
           std::ranges::any_of(mesh.colours, exceeds);
}

MaterialSampler::MaterialSampler(const Mesh& mesh, Glow glow) : mesh_(mesh), glow_(glow) {
    for (const auto& m : mesh.materials) {
        seeThrough_.push_back(m.alpha == Material::Alpha::mask);
        translucent_.push_back(m.alpha == Material::Alpha::blend);
        const bool shines = glow == Glow::inColour && m.emissive != glm::vec3(0.0f);
        plainTexture_.push_back(mesh.colours.empty() && m.baseColour == glm::vec4(1.0f) && !shines);
        constant_.push_back(mesh.colours.empty() && m.baseColourTexture < 0 &&
                            (!shines || m.emissiveTexture < 0));
        const auto light = glm::vec3(m.baseColour) + (shines ? m.emissive : glm::vec3(0.0f));
        constantColour_.emplace_back(srgbBeyondOne(light.x), srgbBeyondOne(light.y),
                                     srgbBeyondOne(light.z));
    }
}

glm::vec4 MaterialSampler::colour(std::uint32_t triangle, glm::vec3 b) const {
    return colour(triangle, b, glow_);
}

glm::vec4 MaterialSampler::colour(std::uint32_t triangle, glm::vec3 b, Glow where) const {
    const auto material = mesh_.triangleMaterial[triangle];
    const auto& m = mesh_.materials[material];
    const auto& t = mesh_.triangles[triangle];
    glm::vec4 texel(1.0f);
    if (m.baseColourTexture >= 0)
        texel = sampleTexture(mesh_.textures[m.baseColourTexture], mix3(mesh_.uvs, t, b));
    if (plainTexture_[material]) return texel;
    glm::vec4 factor = m.baseColour;
    if (!mesh_.colours.empty()) factor *= mix3(mesh_.colours, t, b);
    const glm::vec3 glow = where == Glow::inColour ? emissive(triangle, b) : glm::vec3(0.0f);
    glm::vec4 out;
    for (int k = 0; k < 3; ++k) {
        const float light = (m.baseColourTexture >= 0 ? linearByTable(texel[k]) : 1.0f) * factor[k];
        out[k] = srgbBeyondOne(light + glow[k]);
    }
    out.w = texel.w * factor.w;
    return out;
}

glm::vec3 MaterialSampler::emissive(std::uint32_t triangle, glm::vec3 b) const {
    const auto& m = mesh_.materials[mesh_.triangleMaterial[triangle]];
    glm::vec3 emissive = m.emissive;
    if (m.emissiveTexture >= 0 && emissive != glm::vec3(0.0f)) {
        const auto glow =
            sampleTexture(mesh_.textures[m.emissiveTexture],
                          mix3(uvsOr(mesh_.emissiveUvs), mesh_.triangles[triangle], b));
        for (int k = 0; k < 3; ++k) emissive[k] *= linearByTable(glow[k]);
    }
    return emissive;
}

glm::vec3 MaterialSampler::lit(const Lighting& lighting, std::uint32_t triangle, glm::vec3 b,
                               bool back, glm::vec3 albedo, glm::vec3 position,
                               glm::vec3 toEye) const {
    if (mesh_.materials[mesh_.triangleMaterial[triangle]].unlit) return albedo;
    const glm::vec3 n = normal(triangle, b, back);
    const glm::vec3 glow = glow_ == Glow::inColour ? emissive(triangle, b) : glm::vec3(0.0f);
    if (glow == glm::vec3(0.0f)) return shadePhong(lighting, albedo, position, n, toEye, false);
    const glm::vec3 bare(colour(triangle, b, Glow::apart));
    glm::vec3 out = shadePhong(lighting, bare, position, n, toEye, false);
    for (int k = 0; k < 3; ++k) {
        const float light = linearFromSrgb(out[k]) + glow[k];
        out[k] = srgbBeyondOne(light);
    }
    return out;
}

glm::vec2 MaterialSampler::metallicRoughness(std::uint32_t triangle, glm::vec3 b) const {
    const auto& m = mesh_.materials[mesh_.triangleMaterial[triangle]];
    glm::vec2 value(m.metallic, m.roughness);
    if (m.metallicRoughnessTexture >= 0) {
        const auto texel =
            sampleTexture(mesh_.textures[m.metallicRoughnessTexture],
                          mix3(uvsOr(mesh_.metallicRoughnessUvs), mesh_.triangles[triangle], b));
        value *= glm::vec2(texel.b, texel.g);
    }
    return value;
}

bool MaterialSampler::opaqueAt(std::uint32_t triangle, glm::vec3 b) const {
    const auto& m = mesh_.materials[mesh_.triangleMaterial[triangle]];
    return m.alpha != Material::Alpha::mask || colour(triangle, b).w >= m.alphaCutoff;
}

glm::vec3 MaterialSampler::normal(std::uint32_t triangle, glm::vec3 b, bool back) const {
    const glm::vec3 n = frontNormal(triangle, b);
    return back != normalsBehind(triangle) ? -n : n;
}

glm::vec3 MaterialSampler::areaNormal(std::uint32_t triangle) const {
    const auto& t = mesh_.triangles[triangle];
    return glm::cross(mesh_.positions[t.y] - mesh_.positions[t.x],
                      mesh_.positions[t.z] - mesh_.positions[t.x]);
}

bool MaterialSampler::normalsBehind(std::uint32_t triangle) const {
    if (mesh_.normals.empty()) return false;
    // Of all corners at once, so that a triangle has one front.
    return glm::dot(areaNormal(triangle),
                    mix3(mesh_.normals, mesh_.triangles[triangle], glm::vec3(1.0f))) < 0.0f;
}

glm::vec3 MaterialSampler::frontNormal(std::uint32_t triangle, glm::vec3 b) const {
    const auto& t = mesh_.triangles[triangle];
    glm::vec3 n = areaNormal(triangle);
    if (!mesh_.normals.empty()) {
        const glm::vec3 smooth = mix3(mesh_.normals, t, b);
        if (glm::dot(smooth, smooth) > 1e-12f) n = smooth;
    }
    const float length = glm::length(n);
    if (!(length > 0.0f)) return glm::vec3(0.0f);
    n /= length;

    const auto& m = mesh_.materials[mesh_.triangleMaterial[triangle]];
    if (m.normalTexture < 0 || mesh_.tangents.empty()) return n;
    const glm::vec4 tangent4 = mix3(mesh_.tangents, t, b);
    glm::vec3 tangent(tangent4);
    tangent -= n * glm::dot(n, tangent);
    const float tangentLength = glm::length(tangent);
    if (!(tangentLength > 1e-6f)) return n;
    tangent /= tangentLength;
    const glm::vec3 bitangent = glm::cross(n, tangent) * (tangent4.w < 0 ? -1.0f : 1.0f);
    const glm::vec2 at = mix3(uvsOr(mesh_.normalUvs), t, b);
    glm::vec3 bump = glm::vec3(sampleTexture(mesh_.textures[m.normalTexture], at)) * 2.0f - 1.0f;
    bump.x *= m.normalScale;
    bump.y *= m.normalScale;
    return glm::normalize(tangent * bump.x + bitangent * bump.y + n * std::max(bump.z, 1e-3f));
}

}  // namespace stx

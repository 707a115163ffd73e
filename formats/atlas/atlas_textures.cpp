#include "formats/atlas/atlas_textures.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>

#include "lib/base/parallel.hpp"
#include "lib/model/splat_steps.hpp"
#include "lib/model/srgb8.hpp"

namespace stx {

namespace {

/// Share of the brightest light of an object that its code may be off: less is seen as one light
/// (Weber's law, 1 to 2 %).
constexpr double kLightRounding = 0.02;

/// The objects of an atlas, or all of it as one without a name.
std::vector<AtlasObject> objectsOf(const Atlas& atlas) {
    if (!atlas.objects.empty()) return atlas.objects;
    AtlasObject all;
    all.views = static_cast<int>(atlas.views.size());
    return {all};
}

/// Calls visit(x, y) for the pixels of an object on a page.
template <class Visit>
void forEachPixelOf(const Atlas& atlas, const AtlasObject& object, int page, const Visit& visit) {
    for (const AtlasRectangle& r : atlas.rectangles) {
        if (r.page != page || r.view < object.firstView ||
            r.view - object.firstView >= object.views)
            continue;
        for (int y = r.atlasY; y < r.atlasY + r.atlasHeight(); ++y)
            for (int x = r.atlasX; x < r.atlasX + r.atlasWidth(); ++x) visit(x, y);
    }
}

/// Whether the steps of the splats' codes are too coarse for an object.
bool areSplatsCoarse(const Atlas& atlas, const AtlasObject& object, const AtlasTexture& t) {
    const AtlasPage& page = atlas.pages[t.page];
    SplatSteps steps(t.scale / 32767.0);
    forEachPixelOf(atlas, object, t.page, [&](int x, int y) {
        steps.add(page.splatU.at(x, y));
        steps.add(page.splatV.at(x, y));
    });
    return steps.tooCoarse();
}

/// Whether the brightest light of an object may be off by more than kLightRounding.
bool isLightCoarse(const Atlas& atlas, const AtlasObject& object, const AtlasTexture& t) {
    const Image<glm::vec3>& emissive = atlas.pages[t.page].emissive;
    float largest = 0;
    forEachPixelOf(atlas, object, t.page, [&](int x, int y) {
        const glm::vec3 light = emissive.at(x, y);
        largest = std::max({largest, light.x, light.y, light.z});
    });
    const auto share = static_cast<float>(largest / t.scale);
    const std::uint8_t code = srgb8FromLinear(share);
    if (!(largest > 0) || code == 255) return false;
    // Half of the step to the next code.
    const double off = 0.5 * (linearFromSrgb8(code + 1) - linearFromSrgb8(code));
    return off > kLightRounding * share;
}

/// " of 'cup', 'jug'", of the objects that a check finds; " " of an atlas without; else nothing.
std::string namesOf(const Atlas& atlas, const std::function<bool(const AtlasObject&)>& found) {
    std::string names;
    for (const AtlasObject& o : objectsOf(atlas)) {
        if (!found(o)) continue;
        if (o.name.empty()) return " ";
        names += fmt::format("{}'{}'", names.empty() ? " of " : ", ", o.name);
    }
    return names.empty() ? names : names + " ";
}

/// Which view each pixel of a row of a page belongs to, -1 = none: first by all rectangles with
/// their padding, then by all without, so that a rectangle's own pixels are always its own, and
/// overlapping paddings are settled alike on both ways. Row by row, since a whole page of numbers
/// is as large as its colours.
std::vector<std::int32_t> ownersOfRow(const Atlas& atlas, int page, int y, int width) {
    std::vector<std::int32_t> owner(static_cast<std::size_t>(width), -1);
    for (const int around : {atlas.padding, 0}) {
        for (const AtlasRectangle& r : atlas.rectangles) {
            if (r.page != page || y < r.atlasY - around || y >= r.atlasY + r.atlasHeight() + around)
                continue;
            const int first = std::max(0, r.atlasX - around);
            const int end = std::min(width, r.atlasX + r.atlasWidth() + around);
            std::fill(owner.begin() + first, owner.begin() + std::max(first, end), r.view);
        }
    }
    return owner;
}

}  // namespace

DepthCodes depthCodes(const Atlas& atlas, int page) {
    const Image<float>& depth = atlas.pages[page].depth;
    DepthCodes result;
    result.codes = Image<std::uint16_t>(depth.width(), depth.height());
    std::atomic<std::int64_t> outside = 0, clamped = 0;
    parallelFor(0, depth.height(), [&](int row) {
        const auto owner = ownersOfRow(atlas, page, row, depth.width());
        std::int64_t lost = 0, moved = 0;
        for (int x = 0, y = row; x < depth.width(); ++x) {
            const float d = depth.at(x, y);
            if (!hasPoint(d)) continue;
            const int view = owner[x];
            if (view < 0) {
                ++lost;
                continue;
            }
            const DepthCode code = atlas.views[view].depthCode();
            result.codes.at(x, y) = static_cast<std::uint16_t>(code.encode(d));
            const double slack = code.step() * 0.5 + 1e-6 * code.farPlane;
            if (d < code.nearPlane - slack || d > code.farPlane + slack) ++moved;
        }
        outside += lost;
        clamped += moved;
    });
    result.outside = outside;
    result.clamped = clamped;
    return result;
}

Result<Image<float>> depthFromCodes(const Atlas& atlas, int page,
                                    const Image<std::uint16_t>& codes) {
    Image<float> depth(codes.width(), codes.height(), kNoDepth);
    std::atomic<bool> tooLarge = false;
    parallelFor(0, codes.height(), [&](int row) {
        const auto owner = ownersOfRow(atlas, page, row, codes.width());
        for (int x = 0, y = row; x < codes.width(); ++x) {
            const std::uint32_t d = codes.at(x, y);
            const int view = owner[x];
            if (d == 0 || view < 0) continue;
            const DepthCode code = atlas.views[view].depthCode();
            if (d > code.dmax) tooLarge = true;
            depth.at(x, y) = static_cast<float>(code.decode(d));
        }
    });
    if (tooLarge)
        return fail(ErrorCode::invalidInput,
                    "the depth texture of page {} holds codes above 255 where its view has 8 bits",
                    page);
    return depth;
}

Image<std::uint16_t> withAlpha(const Image<std::uint16_t>& codes, const Rgba8Image& colour,
                               const AtlasTexture& texture, int factor) {
    Image<std::uint16_t> both(texture.width, texture.height);
    for (int y = 0; y < codes.height(); ++y) {
        const auto row = codes.row(y);
        std::copy(row.begin(), row.end(), both.row(y).begin());
        const auto alpha = both.row(y + texture.secondY).subspan(texture.secondX);
        for (int x = 0; x < codes.width(); ++x)
            alpha[x] = static_cast<std::uint16_t>(colour.at(x, y).a * factor);
    }
    return both;
}

std::vector<std::uint8_t> opaqueBytes(Texture texture) {
    bleedColour(texture);
    const Rgba8Image& rgba = *texture.rgba8();
    std::vector<std::uint8_t> bytes(rgba.count() * 3);
    for (std::size_t i = 0; i < rgba.count(); ++i) {
        for (int c = 0; c < 3; ++c) bytes[i * 3 + c] = rgba.pixels()[i][c];
    }
    return bytes;
}

void setAlpha(Rgba8Image& colour, const Image<std::uint8_t>& alpha) {
    for (std::size_t i = 0; i < colour.count(); ++i) colour.pixels()[i].a = alpha.pixels()[i];
}

double largestComponent(const Image<glm::vec3>& vectors) {
    float largest = 0.0f;
    for (const auto& v : vectors.pixels())
        largest = std::max({largest, std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    return largest > 0.0f ? largest : 1.0;
}

void codeVectors(const Image<glm::vec3>& vectors, double scale, int x0, int y0, int width,
                 std::vector<std::uint16_t>& rgb) {
    parallelFor(0, vectors.height(), [&](std::int64_t y) {
        auto* to = rgb.data() + ((y + y0) * static_cast<std::size_t>(width) + x0) * 3;
        for (const auto& v : vectors.row(static_cast<int>(y))) {
            for (int c = 0; c < 3; ++c) {
                const double value = std::clamp(v[c] / scale, -1.0, 1.0);
                *to++ = static_cast<std::uint16_t>(32768 + std::lround(32767.0 * value));
            }
        }
    });
}

Image<glm::vec3> vectorsFromCodes(const std::vector<std::uint16_t>& rgb, double scale, int x0,
                                  int y0, int width, glm::ivec2 size) {
    Image<glm::vec3> vectors(size.x, size.y);
    parallelFor(0, size.y, [&](std::int64_t y) {
        const auto* from = rgb.data() + ((y + y0) * static_cast<std::size_t>(width) + x0) * 3;
        for (auto& v : vectors.row(static_cast<int>(y))) {
            for (int c = 0; c < 3; ++c)
                v[c] = static_cast<float>((static_cast<int>(*from++) - 32768) * scale / 32767.0);
        }
    });
    return vectors;
}

double emissiveScale(const Image<glm::vec3>& emissive) {
    float largest = 1.0f;
    for (const auto& v : emissive.pixels()) {
        for (int c = 0; c < 3; ++c) {
            if (std::isfinite(v[c])) largest = std::max(largest, v[c]);
        }
    }
    return largest;
}

void noteCoarseScales(const Atlas& atlas, const std::vector<AtlasTexture>& textures, Job& job) {
    for (const AtlasTexture& t : textures) {
        if (t.coding == "snorm16" && t.attribute == "splat") {
            const std::string names =
                namesOf(atlas, [&](const AtlasObject& o) { return areSplatsCoarse(atlas, o, t); });
            if (!names.empty())
                job.noteOnce(fmt::format(
                    "splat axes{}are coded in steps of more than {:g} % of their median: "
                    "one scale, that of the longest axis, holds for a whole texture; "
                    "an .exr atlas keeps them exactly",
                    names, 100 * SplatSteps::kMostStep));
        }
        // The light of one model alone has the scale that it needs.
        if (t.coding == "sRGB8-emissive" && !atlas.objects.empty()) {
            const std::string names =
                namesOf(atlas, [&](const AtlasObject& o) { return isLightCoarse(atlas, o, t); });
            if (!names.empty())
                job.noteOnce(
                    fmt::format("emitted light{}is rounded by more than {:g} %, even where it is "
                                "brightest: one scale, that of the brightest object, holds for a "
                                "whole texture; an .exr atlas keeps it exactly",
                                names, 100 * kLightRounding));
        }
    }
}

std::vector<std::uint8_t> bytesOf(const Image<glm::vec2>& metallicRoughness) {
    // NaN is 0.
    const auto code = [](float v) {
        return v > 0.0f ? static_cast<std::uint8_t>(std::lround(255.0f * std::min(v, 1.0f))) : 0;
    };
    std::vector<std::uint8_t> rgb;
    rgb.reserve(metallicRoughness.count() * 3);
    for (const auto& v : metallicRoughness.pixels()) {
        const std::uint8_t metallic = code(v.x), roughness = code(v.y);
        const std::uint8_t any = metallic > 0 || roughness > 0 ? 255 : 0;
        rgb.insert(rgb.end(), {any, roughness, metallic});
    }
    return rgb;
}

std::vector<std::uint8_t> bytesOf(const Image<glm::vec3>& emissive, double scale) {
    std::vector<std::uint8_t> rgb;
    rgb.reserve(emissive.count() * 3);
    for (const auto& v : emissive.pixels()) {
        for (int c = 0; c < 3; ++c)
            rgb.push_back(srgb8FromLinear(static_cast<float>(v[c] / scale)));
    }
    return rgb;
}

Image<glm::vec2> metallicRoughnessFrom(const std::vector<std::uint8_t>& rgb, glm::ivec2 size) {
    Image<glm::vec2> image(size.x, size.y);
    const auto* from = rgb.data();
    for (auto& v : image.pixels()) {
        v = glm::vec2(from[2], from[1]) * (1.0f / 255.0f);
        from += 3;
    }
    return image;
}

Image<glm::vec3> emissiveFrom(const std::vector<std::uint8_t>& rgb, double scale, glm::ivec2 size) {
    Image<glm::vec3> image(size.x, size.y);
    const auto* from = rgb.data();
    for (auto& v : image.pixels()) {
        for (int c = 0; c < 3; ++c) v[c] = static_cast<float>(scale * linearFromSrgb8(*from++));
    }
    return image;
}

}  // namespace stx

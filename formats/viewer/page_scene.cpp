#include "formats/viewer/page_scene.hpp"

#include <algorithm>
#include <cmath>

#include "formats/atlas/atlas_textures.hpp"
#include "formats/images/images.hpp"
#include "formats/stx/mesh_views.hpp"
#include "lib/base/parallel.hpp"
#include "lib/packing/packing.hpp"
#include "lib/render/splat/prepared.hpp"
#include "lib/surface/normals.hpp"

namespace stx {
namespace {

using Json = nlohmann::ordered_json;

/// Sides that textures may have: what every device with WebGL 2 takes that is in use, most others,
/// and the largest.
constexpr int kSides[] = {4096, 8192, 16384};
/// Tangent of the steepest tilt that is coded (splat::Slope), and what stands for no tilt.
constexpr float kSteepest = 8.0f;
constexpr float kFlat = 128.0f, kSteps = 127.0f;

Rgba8Image coded(const RgbaFloatImage& linear) {
    Rgba8Image out(linear.width(), linear.height());
    parallelFor(0, linear.height(), [&](int y) {
        for (int x = 0; x < linear.width(); ++x) {
            const glm::vec4 c = linear.at(x, y);
            const auto byte = [](float v) {
                return static_cast<std::uint8_t>(std::lround(std::clamp(v, 0.0f, 1.0f) * 255.0f));
            };
            out.at(x, y) = {byte(srgbFromLinear(c.r)), byte(srgbFromLinear(c.g)),
                            byte(srgbFromLinear(c.b)), byte(c.a)};
        }
    });
    return out;
}

Result<Bytes> encodeRgb(glm::ivec2 size, const std::vector<glm::u8vec3>& values) {
    return encodePng(size.x, size.y, 3, 8, values.data(), false);
}

/// Tilts by their angle, and sizes, out of splat axes.
Result<std::vector<PageImages>> splatImages(const Atlas& atlas, Job& job) {
    STX_TRY(const PageSet set, PageSet::of(atlas, job));
    const splat::PreparedPages prepared = splat::preparePages(set, false);
    std::vector<PageImages> out(atlas.pages.size());
    for (std::size_t p = 0; p < atlas.pages.size(); ++p) {
        const AtlasPage& page = atlas.pages[p];
        const splat::PreparedPage& ready = prepared.pages[p];
        if (ready.sizes.empty()) continue;
        std::vector<glm::u8vec3> rgb(page.depth.count(), glm::u8vec3(0));
        const auto angle = [](std::int16_t code) {
            const float tilt = std::atan(code / splat::kSlopeScale) / std::atan(kSteepest);
            return static_cast<std::uint8_t>(std::lround(kFlat + kSteps * tilt));
        };
        for (std::size_t i = 0; i < rgb.size(); ++i) {
            if (!hasPoint(page.depth.data()[i]) || page.splatU.data()[i] == glm::vec3(0)) continue;
            rgb[i] = {angle(ready.slopes[i].u), angle(ready.slopes[i].v), ready.sizes[i]};
        }
        STX_TRY(out[p]["splat"], encodeRgb(page.depth.size(), rgb));
    }
    return out;
}

/// Whether a JPEG file gives exactly these colours, whatever their alpha, and browsers decode it as
/// we do: Exif may turn a picture for them, and more than three channels are inks.
bool isExact(const ColourFile& file, const Texture& texture, const Limits& limits) {
    constexpr std::string_view kExif("Exif\0\0", 6);
    const Rgba8Image* colour = texture.rgba8();
    if (!file.jpeg || !colour) return false;
    const std::string_view text(reinterpret_cast<const char*>(file.jpeg->data()),
                                file.jpeg->size());
    const auto info = probeImage(*file.jpeg);
    if (!info || info->channels > 3 || text.find(kExif) != text.npos) return false;
    const auto picture = decodeRgba8(*file.jpeg, "a view's colours", limits);
    if (!picture || picture->width() < file.x + colour->width() ||
        picture->height() < file.y + colour->height())
        return false;
    for (int y = 0; y < colour->height(); ++y) {
        for (int x = 0; x < colour->width(); ++x) {
            if (glm::u8vec3(picture->at(file.x + x, file.y + y)) != glm::u8vec3(colour->at(x, y)))
                return false;
        }
    }
    return true;
}

/// Alpha as an image of its own, where some is not full.
Result<void> addAlpha(const Rgba8Image& colour, PageImages& out) {
    if (std::ranges::all_of(colour.pixels(), [](glm::u8vec4 c) { return c.a == 255; })) return {};
    std::vector<std::uint8_t> alpha(colour.count());
    std::ranges::transform(colour.pixels(), alpha.begin(), [](glm::u8vec4 c) { return c.a; });
    STX_TRY(out["alpha"], encodePng(colour.width(), colour.height(), 1, 8, alpha.data(), false));
    return {};
}

/// Colour, and alpha where JPEG has no room for it.
Result<PageImages> colourImages(const Rgba8Image& colour, int jpegQuality) {
    const glm::ivec2 size = colour.size();
    PageImages out;
    const bool opaque =
        std::ranges::all_of(colour.pixels(), [](glm::u8vec4 c) { return c.a == 255; });
    if (!opaque && jpegQuality == 0) {
        STX_TRY(out["colour"], encodePng(size.x, size.y, 4, 8, colour.data(), true));
        return out;
    }
    std::vector<glm::u8vec3> rgb(colour.count());
    std::ranges::transform(colour.pixels(), rgb.begin(),
                           [](glm::u8vec4 c) { return glm::u8vec3(c); });
    // As PNG a tenth smaller than with alpha.
    STX_TRY(out["colour"], jpegQuality > 0 ? encodeJpeg(size.x, size.y, 3, &rgb[0].r, jpegQuality)
                                           : encodePng(size.x, size.y, 3, 8, rgb.data(), true));
    STX_CHECK(addAlpha(colour, out));
    return out;
}

Result<PageImages> imagesOf(const Atlas& atlas, std::size_t number, const PageColours& colours,
                            bool ofViews, const Limits& limits) {
    const AtlasPage& page = atlas.pages[number];
    const glm::ivec2 size = page.depth.size();
    const auto* colour = page.texture.rgba8();
    if (!colour)
        return fail(ErrorCode::invalidInput, "the colour of a page must be 8-bit sRGB, not linear");
    PageImages out;
    if (ofViews || (colours.copies && isExact(page.colourFile, page.texture, limits))) {
        if (!ofViews) out["colour"] = *page.colourFile.jpeg;
        STX_CHECK(addAlpha(*colour, out));
    } else {
        STX_TRY(out, colourImages(*colour, colours.jpegQuality));
    }
    const DepthCodes codes = depthCodes(atlas, static_cast<int>(number));
    const bool small =
        std::ranges::all_of(atlas.views, [](const ReferenceView& v) { return v.depthBits == 8; });
    if (small) {
        const std::vector<std::uint8_t> bytes(codes.codes.pixels().begin(),
                                              codes.codes.pixels().end());
        STX_TRY(out["depth"], encodePng(size.x, size.y, 1, 8, bytes.data(), false));
    } else {
        STX_TRY(out["depth"], encodePng(size.x, size.y, 1, 16, codes.codes.data(), false));
    }
    if (!page.normal.empty()) {
        std::vector<glm::u8vec3> rgb(page.normal.count());
        std::ranges::transform(page.normal.pixels(), rgb.begin(), rgbFromNormal);
        STX_TRY(out["normal"], encodeRgb(size, rgb));
    }
    return out;
}

}  // namespace

std::vector<double> listOf(glm::dvec3 v) {
    return {v.x, v.y, v.z};
}

Json pageCamera(const Camera& c, const std::string& name) {
    Json j;
    j["name"] = name;
    j["position"] = listOf(c.position);
    j["orientation"] = {c.orientation.w, c.orientation.x, c.orientation.y, c.orientation.z};
    j["orthographic"] = c.orthographic;
    j["width"] = c.width;
    j["height"] = c.height;
    for (const auto& [key, value] :
         {std::pair{"fx", c.fx}, std::pair{"fy", c.fy}, std::pair{"cx", c.cx}, {"cy", c.cy}})
        j[key] = value;
    return j;
}

void codeColours(Bundle& bundle, std::string_view what, Job& job, PixelSpool* spool) {
    const bool linear = std::ranges::any_of(
        bundle.views, [](const ReferenceView& v) { return v.texture.isLinear(); });
    const bool clipped = std::ranges::any_of(
        bundle.views, [](const ReferenceView& v) { return isBeyondWhite(v.texture); });
    if (linear)
        job.note(fmt::format("colours of linear light become 8-bit sRGB in {}{}", what,
                             clipped ? "; values above 1 are clipped" : ""));
    for (auto& view : bundle.views) {
        const auto* floats = view.texture.rgbaFloat();
        if (!floats) continue;
        view.texture = coded(*floats);
        view.texture.moveTo(spool);
    }
}

void makeViewable(Bundle& bundle, Job& job) {
    codeColours(bundle, "the page", job);
    const bool deep =
        std::ranges::any_of(bundle.views, [](const ReferenceView& v) { return v.depthBits == 32; });
    if (!deep) return;
    setDepthBits(bundle, 16);
    job.note("depth of 32 bits becomes 16 in the page");
}

Result<Atlas> packForPage(const Bundle& bundle, Job& job) {
    PackSettings settings;
    settings.layout = PackSettings::Layout::tight;
    settings.unmeasuredPixels = 0;  // a page has these behind all else, or says that it has not
    Result<Atlas> atlas = Atlas();
    for (const int side : kSides) {
        settings.maxSize = side;
        atlas = pack(bundle, settings, job);
        if (atlas || atlas.error().code == ErrorCode::failed) break;
    }
    return atlas;
}

void keepExactFiles(Bundle& bundle, const Limits& limits) {
    for (ReferenceView& view : bundle.views)
        if (!isExact(view.colourFile, view.texture, limits)) view.colourFile = {};
}

Result<std::vector<PageImages>> PageScene::add(const Atlas& atlas, Job& job) {
    std::vector<PageImages> pages(atlas.pages.size());
    if (atlas.views.empty()) return pages;
    STX_CHECK(atlas.check());
    padding_ = atlas.padding;
    const auto firstView = static_cast<int>(views_.size()), firstPage = static_cast<int>(pages_);
    const bool ofViews = colours_.copies && std::ranges::all_of(atlas.views, [](const auto& v) {
                             return v.colourFile.jpeg != nullptr;
                         });
    for (const ReferenceView& view : atlas.views) {
        if (view.depthBits == 32)
            return fail(ErrorCode::invalidInput, "the depth of a page has 8 or 16 bits, not 32");
        pruned_ = pruned_ || view.pruned;
        Json v = pageCamera(view.camera, view.name);
        // For what no rectangle shows: of a masked view that is empty.
        v["noDepth"] = nameOf(view.masked.value_or(false) ? NoDepth::empty : view.noDepth);
        v["pruned"] = view.pruned;
        v["nearPlane"] = view.nearPlane;
        v["farPlane"] = view.farPlane;
        v["dmax"] = view.depthCode().dmax;
        if (ofViews) v["colourAt"] = {view.colourFile.x, view.colourFile.y};
        views_.push_back(std::move(v));
    }
    for (const AtlasRectangle& r : atlas.rectangles)
        rectangles_.push_back({firstView + r.view, firstPage + r.page, r.viewX, r.viewY, r.atlasX,
                               r.atlasY, r.atlasWidth(), r.atlasHeight(), r.turned ? 1 : 0});
    if (std::ranges::any_of(atlas.pages, [](const auto& p) { return !p.splatU.empty(); }))
        STX_SET(pages, splatImages(atlas, job));
    for (std::size_t i = 0; i < pages.size(); ++i) {
        STX_CHECK(job.checkCancelled());
        STX_TRY(auto images, imagesOf(atlas, i, colours_, ofViews, job.limits));
        pages[i].merge(images);
    }
    for (std::size_t k = 0; ofViews && k < atlas.views.size(); ++k)
        pages[0][fmt::format("view{}", firstView + k)] = *atlas.views[k].colourFile.jpeg;
    pages_ += pages.size();
    return pages;
}

Json PageScene::description(Json pages) const {
    Json j;
    j["padding"] = padding_;
    j["pruned"] = pruned_;
    j["views"] = views_;
    j["rectangles"] = rectangles_;
    j["pages"] = std::move(pages);
    return j;
}

}  // namespace stx

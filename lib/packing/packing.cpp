#include "lib/packing/packing.hpp"

#include <algorithm>
#include <numeric>

#include "lib/base/parallel.hpp"
#include "lib/packing/layout.hpp"
#include "lib/packing/views_one_by_one.hpp"

namespace stx {
namespace {

/// Metallic and roughness where a material does not say them (MaterialSampler).
constexpr glm::vec2 kUnsaidMetallicRoughness{0, 1};

struct Contents {
    bool linear = false, normals = false, splats = false;
    bool metallicRoughness = false, emissive = false;

    /// Those of a SimpleTexture, which the limit of four is about.
    [[nodiscard]] int texturesPerPage() const { return 2 + (normals ? 1 : 0) + (splats ? 1 : 0); }
    [[nodiscard]] std::uint64_t bytesPerPixel() const {
        return (linear ? 16 : 4) + 4 + (normals ? 12 : 0) + (splats ? 24 : 0) +
               (metallicRoughness ? 8 : 0) + (emissive ? 12 : 0);
    }
    /// What a page takes while it is written, bytes a pixel beside itself.
    [[nodiscard]] std::uint64_t toWrite(const PackSettings& settings) const {
        if (settings.bytesToWrite) return *settings.bytesToWrite;
        const bool more = normals || splats || metallicRoughness || emissive;
        return (more ? peak::kAtlasPagesVectors : peak::kAtlasPages).perPixel;
    }
};

Contents contentsOf(const std::vector<ViewImageKinds>& views) {
    Contents c;
    c.linear = !views.empty() && views[0].linear;
    for (const ViewImageKinds& v : views) {
        c.normals = c.normals || v.normal;
        c.splats = c.splats || v.hasSplats();
        c.metallicRoughness = c.metallicRoughness || v.metallicRoughness;
        c.emissive = c.emissive || v.emissive;
    }
    return c;
}

Texture emptyTexture(int width, int height, bool linear) {
    if (linear) return RgbaFloatImage(width, height, glm::vec4(0));
    return Rgba8Image(width, height, glm::u8vec4(0));
}

/// Calls copy(page pixel, view pixel) for a rectangle with `around` pixels more on each side; the
/// view pixel is held inside the view.
template <class Copy>
void forEachPixel(const AtlasRectangle& r, glm::ivec2 viewSize, int around, const Copy& copy) {
    for (int y = r.viewY - around; y < r.viewY + r.height + around; ++y) {
        for (int x = r.viewX - around; x < r.viewX + r.width + around; ++x) {
            copy(r.atlasFromView(x, y),
                 glm::ivec2(std::clamp(x, 0, viewSize.x - 1), std::clamp(y, 0, viewSize.y - 1)));
        }
    }
}

/// Calls copy(image of `from`, the same image of `to`) for all that `from` has; one is a view and
/// the other a page.
template <class From, class To, class Copy>
void copyImages(const From& from, To& to, const Copy& copy) {
    if (const auto* colour = from.texture.rgba8()) copy(*colour, *to.texture.rgba8());
    if (const auto* colour = from.texture.rgbaFloat()) copy(*colour, *to.texture.rgbaFloat());
    copy(from.depth, to.depth);
    const auto further = [&](const auto& image, auto& other) {
        if (!image.empty()) copy(image, other);
    };
    further(from.normal, to.normal);
    if (!from.splatU.empty() && !from.splatV.empty()) {
        copy(from.splatU, to.splatU);
        copy(from.splatV, to.splatV);
    }
    further(from.metallicRoughness, to.metallicRoughness);
    further(from.emissive, to.emissive);
}

void fillPage(const ReferenceView& view, const AtlasRectangle& r, int padding, AtlasPage& page) {
    copyImages(view, page, [&](const auto& from, auto& to) {
        forEachPixel(r, view.depth.size(), padding,
                     [&](glm::ivec2 p, glm::ivec2 v) { to.at(p.x, p.y) = from.at(v.x, v.y); });
    });
    // Others on the page have them; zeros would be smooth plastic.
    if (view.metallicRoughness.empty() && !page.metallicRoughness.empty())
        forEachPixel(r, view.depth.size(), padding, [&](glm::ivec2 p, glm::ivec2) {
            page.metallicRoughness.at(p.x, p.y) = kUnsaidMetallicRoughness;
        });
}

/// Images, zero everywhere, of all that the views have beside colour and depth; `to` is a page or
/// a view.
template <class To>
void makeFurther(const Contents& contents, int width, int height, To& to) {
    if (contents.normals) to.normal = Image<glm::vec3>(width, height, glm::vec3(0));
    if (contents.splats) {
        to.splatU = Image<glm::vec3>(width, height, glm::vec3(0));
        to.splatV = to.splatU;
    }
    if (contents.metallicRoughness)
        to.metallicRoughness = Image<glm::vec2>(width, height, glm::vec2(0));
    if (contents.emissive) to.emissive = Image<glm::vec3>(width, height, glm::vec3(0));
}

/// A view without its images: what an atlas keeps of it.
ReferenceView withoutImages(const ReferenceView& view) {
    ReferenceView v;
    static_cast<ViewHeader&>(v) = view;
    return v;
}

/// Pixels of a view that neither rectangles nor padding show: full alpha where outsideBits() says
/// so, else background.
void fillOutside(const std::vector<std::uint64_t>& outside, const Image<std::uint8_t>& given,
                 Texture& texture) {
    for (std::size_t i = 0; i < given.count(); ++i) {
        if (given.data()[i] || !(outside[i / 64] >> (i % 64) & 1)) continue;
        if (auto* image = texture.rgba8()) image->data()[i].a = 255;
        if (auto* image = texture.rgbaFloat()) image->data()[i].a = 1.0f;
    }
}

/// Colour and alpha of the padding of a rectangle, back into its view: what surrounds it there.
void copyPadding(const AtlasRectangle& r, const Atlas& atlas, ReferenceView& view,
                 Image<std::uint8_t>& given) {
    const AtlasPage& page = atlas.pages[r.page];
    for (int y = r.viewY - atlas.padding; y < r.viewY + r.height + atlas.padding; ++y) {
        for (int x = r.viewX - atlas.padding; x < r.viewX + r.width + atlas.padding; ++x) {
            const glm::ivec2 p = r.atlasFromView(x, y);
            if (!view.depth.contains(x, y) || !page.depth.contains(p.x, p.y)) continue;
            if (auto* image = view.texture.rgba8())
                image->at(x, y) = page.texture.rgba8()->at(p.x, p.y);
            if (auto* image = view.texture.rgbaFloat())
                image->at(x, y) = page.texture.rgbaFloat()->at(p.x, p.y);
            given.at(x, y) = 1;
        }
    }
}

/// Leaves out views without a rectangle when `drop` says so, and numbers the rectangles anew.
/// Returns the view of the bundle for each that is left.
std::vector<int> keptViews(const Bundle& bundle, bool drop, std::vector<AtlasRectangle>& rectangles,
                           Job& job) {
    std::vector<bool> holds(bundle.views.size(), !drop);
    for (const auto& r : rectangles) holds[r.view] = true;
    std::vector<int> kept, number(bundle.views.size(), -1);
    for (std::size_t i = 0; i < holds.size(); ++i) {
        if (!holds[i]) continue;
        number[i] = static_cast<int>(kept.size());
        kept.push_back(static_cast<int>(i));
    }
    for (auto& r : rectangles) r.view = number[r.view];
    const auto dropped = bundle.views.size() - kept.size();
    if (dropped > 0)
        job.note(
            fmt::format("{} of {} views dropped: they are empty", dropped, bundle.views.size()));
    return kept;
}

/// The objects of an atlas, of those of its bundle; `source` is the view of that for each that is
/// left.
std::vector<AtlasObject> keptObjects(std::vector<AtlasObject> objects,
                                     const std::vector<int>& source) {
    std::size_t next = 0;
    for (AtlasObject& o : objects) {
        const int end = o.firstView + o.views;
        o.firstView = static_cast<int>(next);
        while (next < source.size() && source[next] < end) ++next;
        o.views = static_cast<int>(next) - o.firstView;
    }
    return objects;
}

template <class T>
void dropIfZero(Image<T>& image) {
    for (const auto& p : image.pixels()) {
        if (p != T(0)) return;
    }
    image = {};
}

}  // namespace

bool mayBeUnmeasured(const ReferenceView& view, std::optional<bool> masked) {
    return view.noDepth == NoDepth::unknown && !view.pruned && !view.background &&
           !(masked ? *masked : lacksDepthByMask(view));
}

std::int64_t objectPixels(const ReferenceView& view) {
    std::int64_t n = 0;
    for (int y = 0; y < view.depth.height(); ++y) {
        for (int x = 0; x < view.depth.width(); ++x)
            n += hasPoint(view.depth.at(x, y)) || view.texture.at(x, y).a >= 1.0f ? 1 : 0;
    }
    return n;
}

namespace {

/// Pixels without a depth.
struct LackingPixels {
    std::int64_t empty = 0, covered = 0;

    void add(float depth, float alpha) {
        if (!hasPoint(depth)) (alpha < 1.0f ? empty : covered) += 1;
    }
    [[nodiscard]] bool masked() const { return empty > covered; }
};

/// lacksDepthByMask() of a view of an atlas; of atlases that do not say it, of what they keep.
bool isMasked(const Atlas& atlas, std::size_t view) {
    if (atlas.views[view].masked) return *atlas.views[view].masked;
    const Camera& camera = atlas.views[view].camera;
    LackingPixels lacking;
    for (const AtlasRectangle& r : atlas.rectangles) {
        if (r.view != static_cast<int>(view)) continue;
        const AtlasPage& page = atlas.pages[r.page];
        forEachPixel(r, {camera.width, camera.height}, atlas.padding,
                     [&](glm::ivec2 p, glm::ivec2) {
                         if (page.depth.contains(p.x, p.y))
                             lacking.add(page.depth.at(p.x, p.y), page.texture.at(p.x, p.y).a);
                     });
    }
    return lacking.masked();
}

Result<void> checkSettings(const ViewTable& table, const PackSettings& settings) {
    if (settings.padding < 0 || settings.padding > 64)
        return fail(ErrorCode::usage, "the padding is {} pixels; 0 to 64 is possible",
                    settings.padding);
    if (settings.maxSize < 1 || settings.maxSize > 65535)
        return fail(ErrorCode::usage, "the largest texture size is {}; 1 to 65535 is possible",
                    settings.maxSize);
    const glm::ivec2 size = settings.size;
    if (size != glm::ivec2(0) &&
        (size.x < 1 || size.y < 1 || std::max(size.x, size.y) > settings.maxSize))
        return fail(ErrorCode::usage, "textures of {}x{} are asked for; 1 to {} is possible",
                    size.x, size.y, settings.maxSize);
    const glm::ivec2 page = settings.maxPage;
    if (page != glm::ivec2(0) && (page.x < 1 || page.y < 1))
        return fail(ErrorCode::usage, "the largest page is {}x{}; 1 or more is possible", page.x,
                    page.y);
    if (table.whole()) STX_CHECK(table.about().check());
    if (settings.objects) STX_CHECK(checkObjects(*settings.objects, table.count()));
    if (!settings.contentOf) return {};
    const std::vector<ReferenceView>& content = settings.contentOf->views;
    bool alike = content.size() == table.count();
    for (std::size_t i = 0; alike && i < content.size(); ++i) {
        const Camera& camera = table.about().views[i].camera;
        alike = content[i].depth.size() == glm::ivec2(camera.width, camera.height);
    }
    if (!alike)
        return fail(ErrorCode::usage,
                    "the {} views are not those of the frames that they are packed like",
                    table.count());
    return {};
}

/// Where all goes; pixels are looked at for it in the tight layout.
Result<AtlasLayout> layoutOf(const ViewTable& table, const PackSettings& settings, int maxPages,
                             Job& job) {
    if (settings.layout == PackSettings::Layout::grid)
        return gridLayout(table.about(), settings, maxPages);
    if (settings.contentOf)
        return tightLayout(*viewsOf(*settings.contentOf), settings, maxPages, job);
    return tightLayout(table, settings, maxPages, job);
}

/// An atlas of empty pages.
Atlas emptyAtlas(const ViewTable& table, const AtlasLayout& layout, const Contents& contents,
                 const PackSettings& settings) {
    const Bundle& bundle = table.about();
    Atlas atlas;
    atlas.layout = settings.layout == PackSettings::Layout::tight ? "tight" : "grid";
    atlas.padding = settings.padding;
    atlas.bounds = bundle.bounds;
    atlas.origin = bundle.origin;
    atlas.environment = bundle.environment;
    atlas.title = bundle.title;
    atlas.time = bundle.time;
    atlas.duration = bundle.duration;
    for (int i = 0; i < layout.pages; ++i) {
        AtlasPage page;
        page.texture = emptyTexture(layout.width, layout.height, contents.linear);
        page.depth = Image<float>(layout.width, layout.height, kNoDepth);
        makeFurther(contents, layout.width, layout.height, page);
        atlas.pages.push_back(std::move(page));
    }
    return atlas;
}

/// Says that the tight layout leaves out colours without a depth. `found`: in views as they are.
void noteUnmeasured(const PackSettings& settings, std::int64_t found, Job& job) {
    const std::int64_t pixels = settings.unmeasuredPixels.value_or(found);
    if (pixels <= 0) return;
    constexpr const char* kSaid =
        "pixels that have colours but no depth, the tight layout keeps only those amid others; "
        "--layout grid keeps all";
    // Frames have other numbers each, and one line is enough for a film.
    if (settings.contentOf)
        job.noteOnce(fmt::format("of {}", kSaid));
    else
        job.note(fmt::format("of {} {}", pixels, kSaid));
}

std::uint64_t pixelsOf(const AtlasLayout& layout) {
    return static_cast<std::uint64_t>(layout.width) * static_cast<std::uint64_t>(layout.height) *
           static_cast<std::uint64_t>(layout.pages);
}

/// Of the pages, and with views that are in memory.
Result<void> checkAtlas(const ViewTable& table, const AtlasLayout& layout, const Contents& contents,
                        const PackSettings& settings, const Limits& limits) {
    return limits.checkAllocation(
        pixelsOf(layout),
        (table.whole() ? 2 : 1) * contents.bytesPerPixel() + contents.toWrite(settings),
        "an atlas");
}

}  // namespace

Result<void> checkGrid(const ViewTable& table, const PackSettings& settings, const Limits& limits) {
    STX_CHECK(checkSettings(table, settings));
    const Contents contents = contentsOf(table.kinds());
    STX_TRY(const AtlasLayout layout,
            gridLayout(table.about(), settings, 4 / contents.texturesPerPage()));
    return checkAtlas(table, layout, contents, settings, limits);
}

Result<std::uint64_t> memoryOfGrid(const ViewTable& table, const PackSettings& settings) {
    const Contents contents = contentsOf(table.kinds());
    STX_TRY(const AtlasLayout layout,
            gridLayout(table.about(), settings, 4 / contents.texturesPerPage()));
    // Views come before the pages are written.
    const std::uint64_t pixels = pixelsOf(layout);
    return pixels * contents.bytesPerPixel() +
           std::max(memoryOfEach(table, {"an atlas", 0}),
                    table.bytesHeld() + pixels * contents.toWrite(settings));
}

Result<Atlas> pack(const ViewTable& table, const PackSettings& settings, Job& job) {
    STX_CHECK(checkSettings(table, settings));
    const std::size_t count = table.count();
    const Contents contents = contentsOf(table.kinds());
    STX_TRY(AtlasLayout layout, layoutOf(table, settings, 4 / contents.texturesPerPage(), job));
    if (layout.rectangles.empty())
        return fail(ErrorCode::invalidInput, "none of the {} views has a point to pack", count);
    STX_CHECK(checkAtlas(table, layout, contents, settings, job.limits));
    Atlas atlas = emptyAtlas(table, layout, contents, settings);
    // Frames that are packed alike keep all views: a film has the same ones from start to end.
    const bool drop = settings.layout == PackSettings::Layout::tight && !settings.contentOf;
    const std::vector<int> source = keptViews(table.about(), drop, layout.rectangles, job);
    if (settings.objects) atlas.objects = keptObjects(*settings.objects, source);
    for (const int i : source) atlas.views.push_back(withoutImages(table.about().views[i]));
    atlas.rectangles = std::move(layout.rectangles);
    STX_CHECK(job.checkCancelled());
    std::vector<std::vector<const AtlasRectangle*>> ofView(count);
    for (const AtlasRectangle& r : atlas.rectangles) ofView[source[r.view]].push_back(&r);
    const bool tight = settings.layout == PackSettings::Layout::tight;
    std::vector<std::int64_t> object(count), points(count);
    std::vector<std::int64_t> unmeasured(count);
    std::vector<std::optional<bool>> masked(count);
    STX_CHECK(forEachView(
        table, {"an atlas", 0}, job,
        [&](std::size_t i, const std::shared_ptr<const ReferenceView>& view) -> Result<void> {
            parallelFor(0, ofView[i].size(), [&](std::size_t k) {
                const AtlasRectangle& r = *ofView[i][k];
                fillPage(*view, r, settings.padding, atlas.pages[r.page]);
            });
            object[i] = objectPixels(*view);
            points[i] = view->pointCount();
            if (!tight) return {};
            // What the rectangles leave out decides with what they show.
            if (view->noDepth == NoDepth::unknown) masked[i] = lacksDepthByMask(*view);
            if (mayBeUnmeasured(*view, masked[i])) unmeasured[i] = object[i] - points[i];
            return {};
        }));
    for (std::size_t k = 0; k < source.size(); ++k) atlas.views[k].masked = masked[source[k]];
    atlas.sourcePixels = std::reduce(object.begin(), object.end());
    if (settings.sourcePixels > 0) atlas.sourcePixels = settings.sourcePixels;
    if (settings.objects) {
        atlas.sourcePixels = 0;
        for (const auto& o : atlas.objects) atlas.sourcePixels += o.sourcePixels;
    }
    atlas.keptPixels = std::reduce(points.begin(), points.end());
    if (tight) noteUnmeasured(settings, std::reduce(unmeasured.begin(), unmeasured.end()), job);
    return atlas;
}

Result<Atlas> pack(const Bundle& bundle, const PackSettings& settings, Job& job) {
    return pack(*viewsOf(bundle), settings, job);
}

bool lacksDepthByMask(const ReferenceView& view) {
    LackingPixels lacking;
    for (std::size_t i = 0; i < view.depth.count(); ++i)
        lacking.add(view.depth.data()[i], view.texture.alpha(i));
    return lacking.masked();
}

std::vector<std::uint64_t> outsideBits(const Atlas& atlas, std::size_t of) {
    constexpr int kMostReach = 6;  // pixels
    // What a view saw of the object is in its rectangles, unless it was pruned or missed.
    if (atlas.keptPixels >= atlas.sourcePixels || !atlas.views[of].depthMayBeUnknown()) return {};
    const Camera& camera = atlas.views[of].camera;
    std::vector<std::uint64_t> bits(
        (static_cast<std::size_t>(camera.width) * camera.height + 63) / 64, 0);
    // Nothing is known there, wherever others look.
    if (atlas.views[of].noDepth == NoDepth::unknown && !isMasked(atlas, of)) {
        std::ranges::fill(bits, ~std::uint64_t{0});
        return bits;
    }
    const glm::dmat4 cameraFromWorld = camera.cameraFromWorld();
    for (const AtlasRectangle& r : atlas.rectangles) {
        if (r.view == static_cast<int>(of)) continue;
        const Camera& other = atlas.views[r.view].camera;
        const Image<float>& depth = atlas.pages[r.page].depth;
        const glm::dmat4 fromOther = cameraFromWorld * other.worldFromCamera();
        for (int y = r.viewY; y < r.viewY + r.height; ++y) {
            for (int x = r.viewX; x < r.viewX + r.width; ++x) {
                const glm::ivec2 texel = r.atlasFromView(x, y);
                const float dist = depth.at(texel.x, texel.y);
                if (!hasPoint(dist)) continue;
                const glm::dvec3 p(fromOther *
                                   glm::dvec4(other.unproject(x + 0.5, y + 0.5, dist), 1.0));
                if (!camera.orthographic && !(p.z < 0)) continue;
                const glm::dvec3 at = camera.project(p);
                if (!(at.x > -kMostReach && at.y > -kMostReach &&
                      at.x < camera.width + kMostReach && at.y < camera.height + kMostReach))
                    continue;
                const double coarser = other.sampleSpacing(dist).x / camera.sampleSpacing(-p.z).x;
                const int reach = 1 + static_cast<int>(std::min(coarser, kMostReach - 1.0));
                const int cx = static_cast<int>(std::floor(at.x)),
                          cy = static_cast<int>(std::floor(at.y));
                const int left = std::max(0, cx - reach);
                const int count = std::min(camera.width - 1, cx + reach) - left + 1;
                if (count <= 0) continue;
                const std::uint64_t run = (std::uint64_t{1} << count) - 1;
                for (int ny = std::max(0, cy - reach);
                     ny <= std::min(camera.height - 1, cy + reach); ++ny) {
                    const std::size_t bit = static_cast<std::size_t>(ny) * camera.width + left;
                    const std::size_t shift = bit % 64;
                    bits[bit / 64] |= run << shift;
                    if (shift + count > 64) bits[bit / 64 + 1] |= run >> (64 - shift);
                }
            }
        }
    }
    return bits;
}

Result<Bundle> unpack(const Atlas& atlas, Job& job) {
    STX_CHECK(atlas.check());
    if (!atlas.objects.empty())
        return fail(ErrorCode::usage, "the atlas has {} objects; take one out of it to unpack it",
                    atlas.objects.size());
    const AtlasPage& first = atlas.pages[0];
    const Contents contents{first.texture.isLinear(), !first.normal.empty(), !first.splatU.empty(),
                            !first.metallicRoughness.empty(), !first.emissive.empty()};
    std::uint64_t pixels = 0;
    for (const auto& view : atlas.views)
        pixels += static_cast<std::uint64_t>(view.camera.width) * view.camera.height;
    STX_CHECK(
        job.limits.checkAllocation(pixels, contents.bytesPerPixel() + 1, "the views of the atlas"));

    std::vector<std::vector<const AtlasRectangle*>> ofView(atlas.views.size());
    for (const auto& r : atlas.rectangles) ofView[r.view].push_back(&r);
    Bundle bundle;
    bundle.title = atlas.title;
    bundle.bounds = atlas.bounds;
    bundle.origin = atlas.origin;
    bundle.environment = atlas.environment;
    bundle.time = atlas.time;
    bundle.duration = atlas.duration;
    bundle.views.resize(atlas.views.size());
    parallelFor(0, atlas.views.size(), [&](std::size_t i) {
        ReferenceView& view = bundle.views[i];
        view = withoutImages(atlas.views[i]);
        view.masked.reset();  // its pixels say it
        const int width = view.camera.width, height = view.camera.height;
        view.texture = emptyTexture(width, height, contents.linear);
        view.depth = Image<float>(width, height, kNoDepth);
        makeFurther(contents, width, height, view);
        Image<std::uint8_t> given(width, height, 0);  // 1 = by padding, 2 = by a rectangle
        const auto outside = outsideBits(atlas, i);
        if (!outside.empty()) {
            for (const AtlasRectangle* r : ofView[i]) copyPadding(*r, atlas, view, given);
        }
        std::int64_t covered = 0;
        for (const AtlasRectangle* r : ofView[i]) {
            const AtlasPage& page = atlas.pages[r->page];
            copyImages(page, view, [&](const auto& from, auto& to) {
                forEachPixel(*r, view.depth.size(), 0, [&](glm::ivec2 p, glm::ivec2 v) {
                    to.at(v.x, v.y) = from.at(p.x, p.y);
                });
            });
            forEachPixel(*r, view.depth.size(), 0, [&](glm::ivec2, glm::ivec2 v) {
                covered += given.at(v.x, v.y) == 2 ? 0 : 1;
                given.at(v.x, v.y) = 2;
            });
        }
        // Whole views come back as they were, colours under alpha 0 included.
        if (covered < static_cast<std::int64_t>(given.count())) bleedColour(view.texture);
        if (!outside.empty()) fillOutside(outside, given, view.texture);
        // An atlas keeps room for normals when any view has them; give them back only to those.
        // Zeros of emission mean the same as no image; zeros of metallic-roughness are smooth
        // plastic.
        dropIfZero(view.normal);
        dropIfZero(view.splatU);
        dropIfZero(view.splatV);
        dropIfZero(view.emissive);
    });
    STX_CHECK(job.checkCancelled());
    return bundle;
}

}  // namespace stx

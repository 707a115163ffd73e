#include "lib/render/scene/page_set.hpp"

#include <algorithm>
#include <cmath>

#include "lib/base/parallel.hpp"
#include "lib/model/depth_values.hpp"
#include "lib/packing/packing.hpp"

namespace stx {
namespace {

const Image<glm::vec3>* orNull(const Image<glm::vec3>& image) {
    return image.empty() ? nullptr : &image;
}

/// The camera whose pixels are the texels of a rectangle on its page.
Camera windowOf(const Camera& view, const AtlasRectangle& r) {
    Camera c = view;
    c.width = r.atlasWidth();
    c.height = r.atlasHeight();
    if (!r.turned) {
        c.cx = view.cx - r.viewX;
        c.cy = view.cy - r.viewY;
        return c;
    }
    // Turned by a quarter clockwise: the window's x runs up the view, its y to the view's right.
    c.fx = view.fy;
    c.fy = view.fx;
    c.cx = r.height - (view.cy - r.viewY);
    c.cy = view.cx - r.viewX;
    c.orientation = view.orientation * glm::angleAxis(glm::half_pi<double>(), glm::dvec3(0, 0, 1));
    return c;
}

bool anyValue(const Image<glm::vec3>& image, const PageRectangle& r) {
    for (int y = r.y0; y < r.y1; ++y)
        for (int x = r.x0; x < r.x1; ++x)
            if (image.data()[r.texel(x, y)] != glm::vec3(0)) return true;
    return false;
}

}  // namespace

void PageSet::addRectangle(const AtlasRectangle& from, int padding, Data& data) {
    const auto page = static_cast<std::size_t>(from.page);
    const Camera& camera = data.views[from.view].camera;
    const std::ptrdiff_t stride = data.pages[page].width();
    PageRectangle r;
    r.view = from.view;
    r.page = from.page;
    r.x0 = from.viewX;
    r.y0 = from.viewY;
    r.x1 = from.viewX + from.width;
    r.y1 = from.viewY + from.height;
    const glm::ivec2 origin = from.atlasFromView(r.x0, r.y0);
    r.stepX = from.turned ? stride : 1;
    r.stepY = from.turned ? -1 : stride;
    r.first = origin.y * stride + origin.x - r.x0 * r.stepX - r.y0 * r.stepY;
    r.pageX = from.atlasX;
    r.pageY = from.atlasY;
    r.width = from.atlasWidth();
    r.height = from.atlasHeight();
    r.left = std::min(padding, from.turned ? camera.height - r.y1 : r.x0);
    r.right = std::min(padding, from.turned ? r.y0 : camera.width - r.x1);
    r.top = std::min(padding, from.turned ? r.x0 : r.y0);
    r.bottom = std::min(padding, from.turned ? camera.width - r.x1 : camera.height - r.y1);
    r.window = windowOf(camera, from);
    data.rectangles.push_back(r);
}

void PageSet::addBundle(const Bundle& bundle, Data& data) {
    data.bounds = bundle.bounds;
    data.pruned = bundle.pruned();
    for (std::size_t i = 0; i < bundle.views.size(); ++i) {
        const ReferenceView& from = bundle.views[i];
        data.pages.push_back({&from.texture, &from.depth, orNull(from.normal), orNull(from.splatU),
                              orNull(from.splatV)});
        PageView v{from};
        v.hasNormals = from.hasNormals();
        v.hasSplats = from.hasSplats();
        v.firstRectangle = static_cast<std::uint32_t>(i);
        v.rectangleCount = 1;
        v.whole = true;
        data.views.push_back(std::move(v));
        const auto number = static_cast<int>(i);
        addRectangle({number, number, 0, 0, from.camera.width, from.camera.height, 0, 0, false}, 0,
                     data);
    }
    data.index.resize(data.views.size());
}

PageSet::PageSet(const Bundle& bundle) {
    auto data = std::make_shared<Data>();
    addBundle(bundle, *data);
    data_ = std::move(data);
}

PageSet::PageSet(const Bundle& bundle, PixelSpool& spool) {
    auto data = std::make_shared<Data>();
    addBundle(bundle, *data);
    data->spool = &spool;
    data_ = std::move(data);
}

PageSet::PageSet(const Bundle& bundle, std::span<const ViewSummary> summaries, PixelSpool* spool) {
    auto data = std::make_shared<Data>();
    addBundle(bundle, *data);
    for (std::size_t i = 0; i < data->views.size(); ++i)
        if (bundle.views[i].depth.empty()) data->views[i].unread = &summaries[i];
    data->spool = spool;
    data_ = std::move(data);
}

Result<PageSet> PageSet::of(const Atlas& atlas, Job& job) {
    STX_CHECK(atlas.check());
    auto data = std::make_shared<Data>();
    if (!atlas.paddingHolds(kPadding)) {
        STX_TRY(auto bundle, unpack(atlas, job));
        data->unpacked = std::make_shared<const Bundle>(std::move(bundle));
        addBundle(*data->unpacked, *data);
        return PageSet(std::move(data));
    }
    data->bounds = atlas.bounds;
    data->padding = kPadding;
    for (const AtlasPage& page : atlas.pages)
        data->pages.push_back({&page.texture, &page.depth, orNull(page.normal), orNull(page.splatU),
                               orNull(page.splatV)});
    for (const ReferenceView& view : atlas.views) {
        data->views.push_back({view});
        data->pruned = data->pruned || view.pruned;
    }
    std::vector<AtlasRectangle> sorted = atlas.rectangles;
    std::stable_sort(sorted.begin(), sorted.end(),
                     [](const auto& a, const auto& b) { return a.view < b.view; });
    for (const AtlasRectangle& r : sorted) {
        PageView& view = data->views[r.view];
        if (view.rectangleCount++ == 0)
            view.firstRectangle = static_cast<std::uint32_t>(data->rectangles.size());
        addRectangle(r, kPadding, *data);
        // An atlas keeps room for normals and splats when any view has them.
        const PageRectangle& added = data->rectangles.back();
        const AtlasPage& page = atlas.pages[r.page];
        if (!page.normal.empty() && !view.hasNormals)
            view.hasNormals = anyValue(page.normal, added);
        if (!page.splatU.empty() && !view.hasSplats)
            view.hasSplats = anyValue(page.splatU, added) || anyValue(page.splatV, added);
    }
    buildIndex(*data);
    PageSet set(data);
    parallelFor(0, data->index.size(),
                [&](std::size_t view) { data->index[view].outside = outsideBits(atlas, view); });
    STX_CHECK(job.checkCancelled());
    return set;
}

void PageSet::buildIndex(Data& data) {
    data.index.resize(data.views.size());
    for (std::size_t i = 0; i < data.views.size(); ++i) {
        const PageView& view = data.views[i];
        ViewIndex& index = data.index[i];
        index.blocksX = static_cast<std::uint32_t>((view.camera.width + kBlock - 1) / kBlock);
        const int blocksY = (view.camera.height + kBlock - 1) / kBlock;
        std::vector<std::vector<std::uint32_t>> near(static_cast<std::size_t>(blocksY) *
                                                     index.blocksX);
        for (std::uint32_t k = 0; k < view.rectangleCount; ++k) {
            const std::uint32_t number = view.firstRectangle + k;
            const PageRectangle& r = data.rectangles[number];
            const int lastX = std::min(r.x1 + data.padding, view.camera.width) - 1;
            const int lastY = std::min(r.y1 + data.padding, view.camera.height) - 1;
            for (int by = std::max(r.y0 - data.padding, 0) / kBlock; by <= lastY / kBlock; ++by)
                for (int bx = std::max(r.x0 - data.padding, 0) / kBlock; bx <= lastX / kBlock; ++bx)
                    near[static_cast<std::size_t>(by) * index.blocksX + static_cast<unsigned>(bx)]
                        .push_back(number);
        }
        for (const auto& list : near) {
            index.begin.push_back(static_cast<std::uint32_t>(index.near.size()));
            index.near.insert(index.near.end(), list.begin(), list.end());
        }
        index.begin.push_back(static_cast<std::uint32_t>(index.near.size()));
    }
}

bool PageSet::linear() const {
    const auto read =
        std::ranges::find_if(pages(), [](const Page& p) { return !p.depth->empty(); });
    return read != pages().end() && read->texture->isLinear();
}

bool PageSet::exactDepth() const {
    return std::none_of(views().begin(), views().end(), [](const PageView& v) {
        return v.refined.doubt > 0 || wasDone(RefineStep::edges, v.refined);
    });
}

std::int64_t PageSet::pointCount() const {
    std::int64_t n = 0;
    for (const PageRectangle& r : rectangles()) {
        const Image<float>& depth = *pages()[r.page].depth;
        for (int y = r.pageY; y < r.pageY + r.height; ++y)
            for (int x = r.pageX; x < r.pageX + r.width; ++x) n += hasPoint(depth.at(x, y)) ? 1 : 0;
    }
    return n;
}

Bounds PageSet::bounds() const {
    if (data_->bounds) return *data_->bounds;
    std::vector<Bounds> each(rectangles().size());
    parallelFor(0, each.size(), [&](std::int64_t k) {
        const PageRectangle& r = rectangles()[k];
        const PageView& view = views()[r.view];
        const Image<float>& depth = *pages()[r.page].depth;
        if (view.unread)
            each[k] = view.unread->bounds;
        else if (view.whole)
            each[k] = boundsOfPoints(depth, r.window);
        else
            each[k] = boundsOfPoints(depth.part(r.pageX, r.pageY, r.width, r.height), r.window);
        settle();
    });
    return boundsTogether(each);
}

Texture PageSet::textureOfView(std::size_t number) const {
    const Camera& camera = views()[number].camera;
    const auto filled = [&](auto image, auto full, const auto& texelsOf) {
        for (int y = 0; y < camera.height; ++y)
            for (int x = 0; x < camera.width; ++x)
                if (objectOutside(number, x, y)) image.at(x, y).a = full;
        for (const PageRectangle& r : rectanglesOf(number)) {
            const auto* texels = texelsOf(*pages()[r.page].texture);
            const int padding = views()[number].whole ? 0 : data_->padding;
            const int x0 = std::max(r.x0 - padding, 0), y0 = std::max(r.y0 - padding, 0);
            const int x1 = std::min(r.x1 + padding, camera.width);
            const int y1 = std::min(r.y1 + padding, camera.height);
            for (int y = y0; y < y1; ++y)
                for (int x = x0; x < x1; ++x) image.at(x, y) = texels[r.texel(x, y)];
        }
        return Texture(std::move(image));
    };
    if (linear())
        return filled(RgbaFloatImage(camera.width, camera.height, glm::vec4(0)), 1.0f,
                      [](const Texture& t) { return t.rgbaFloat()->data(); });
    return filled(Rgba8Image(camera.width, camera.height, glm::u8vec4(0)), std::uint8_t{255},
                  [](const Texture& t) { return t.rgba8()->data(); });
}

ReferenceView PageSet::copyOfView(std::size_t number) const {
    const PageView& from = views()[number];
    const int width = from.camera.width, height = from.camera.height;
    ReferenceView view;
    static_cast<ViewHeader&>(view) = from;
    view.texture = textureOfView(number);
    view.depth = Image<float>(width, height, kNoDepth);
    if (from.hasNormals) view.normal = Image<glm::vec3>(width, height, glm::vec3(0));
    if (from.hasSplats) {
        view.splatU = Image<glm::vec3>(width, height, glm::vec3(0));
        view.splatV = view.splatU;
    }
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const PageRectangle* r = find(number, x, y);
            if (!r) continue;
            const Page& page = pages()[r->page];
            const std::size_t texel = r->texel(x, y);
            view.depth.at(x, y) = page.depth->data()[texel];
            if (from.hasNormals) view.normal.at(x, y) = page.normal->data()[texel];
            if (from.hasSplats) {
                view.splatU.at(x, y) = page.splatU->data()[texel];
                view.splatV.at(x, y) = page.splatV->data()[texel];
            }
        }
    }
    return view;
}

bool sameCamera(const Camera& a, const Camera& b) {
    // Scene units: what a camera at the origin is off in files that were turned.
    constexpr double kRounding = 1e-13;
    const auto near = [](double x, double y) {
        return std::abs(x - y) <= 1e-9 * std::max(1.0, std::abs(x));
    };
    return a.width == b.width && a.height == b.height && a.orthographic == b.orthographic &&
           near(a.fx, b.fx) && near(a.fy, b.fy) && near(a.cx, b.cx) && near(a.cy, b.cy) &&
           glm::distance(a.position, b.position) <=
               std::max(kRounding, 1e-9 * glm::length(a.position)) &&
           std::abs(std::abs(glm::dot(a.orientation, b.orientation)) - 1.0) <= 1e-12;
}

}  // namespace stx

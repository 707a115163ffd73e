#pragma once

#include "lib/model/atlas.hpp"
#include "tests/small_bundle.hpp"

/// The views of a small bundle laid side by side, every second one turned, by hand; `pages` 1 or 2.
inline stx::Atlas smallAtlas(int views, int depthBits, bool v2, bool linear, int pages = 1,
                             unsigned seed = 1) {
    const stx::Bundle bundle = smallBundle(views, depthBits, v2, linear, seed);
    stx::Atlas atlas;
    atlas.title = bundle.title;
    atlas.bounds = bundle.bounds;
    atlas.layout = "tight";
    atlas.padding = 2;
    atlas.sourcePixels = bundle.pointCount();
    atlas.keptPixels = bundle.pointCount() - 1;
    int width = 1, height = 1;
    std::vector<int> next(static_cast<std::size_t>(pages), 0);
    for (int i = 0; i < views; ++i) {
        stx::ReferenceView view = bundle.views[i];
        view.texture = {};
        view.depth = {};
        view.normal = view.splatU = view.splatV = {};
        atlas.views.push_back(view);
        stx::AtlasRectangle r;
        r.view = i;
        r.page = i % pages;
        r.viewX = i % 3;
        r.viewY = i % 2;
        r.width = view.camera.width - 4;
        r.height = view.camera.height - 3;
        r.turned = i % 2 == 1;
        r.atlasX = next[r.page] + atlas.padding;
        r.atlasY = atlas.padding + i % 4;
        next[r.page] = r.atlasX + r.atlasWidth() + atlas.padding;
        width = std::max(width, next[r.page]);
        height = std::max(height, r.atlasY + r.atlasHeight() + atlas.padding);
        atlas.rectangles.push_back(r);
    }
    for (int p = 0; p < pages; ++p) {
        stx::AtlasPage page;
        stx::Rgba8Image colour(width, height);
        stx::RgbaFloatImage floats(width, height);
        page.depth = stx::Image<float>(width, height, stx::kNoDepth);
        if (v2) page.normal = page.splatU = page.splatV = stx::Image<glm::vec3>(width, height);
        for (const auto& r : atlas.rectangles) {
            if (r.page != p) continue;
            const auto& view = bundle.views[r.view];
            // With its padding, as the packing room does it.
            for (int y = r.viewY - 2; y < r.viewY + r.height + 2; ++y) {
                for (int x = r.viewX - 2; x < r.viewX + r.width + 2; ++x) {
                    const glm::ivec2 to = r.atlasFromView(x, y);
                    const int vx = std::clamp(x, 0, view.camera.width - 1);
                    const int vy = std::clamp(y, 0, view.camera.height - 1);
                    if (linear) {
                        floats.at(to.x, to.y) = view.texture.rgbaFloat()->at(vx, vy);
                    } else {
                        colour.at(to.x, to.y) = view.texture.rgba8()->at(vx, vy);
                    }
                    page.depth.at(to.x, to.y) = view.depth.at(vx, vy);
                    if (v2) {
                        page.normal.at(to.x, to.y) = view.normal.at(vx, vy);
                        page.splatU.at(to.x, to.y) = view.splatU.at(vx, vy);
                        page.splatV.at(to.x, to.y) = view.splatV.at(vx, vy);
                    }
                }
            }
        }
        page.texture = linear ? stx::Texture(std::move(floats)) : stx::Texture(std::move(colour));
        atlas.pages.push_back(std::move(page));
    }
    return atlas;
}

/// Empty when everything but the pixels is the same, else what differs first.
inline std::string headerDifference(const stx::Atlas& a, const stx::Atlas& b) {
    if (a.title != b.title) return "title";
    if (a.bounds != b.bounds) return "bounds";
    if (a.layout != b.layout || a.padding != b.padding) return "layout";
    if (a.sourcePixels != b.sourcePixels || a.keptPixels != b.keptPixels) return "pixels";
    if (!(a.rectangles == b.rectangles)) return "rectangles";
    if (a.views.size() != b.views.size()) return "number of views";
    for (std::size_t i = 0; i < a.views.size(); ++i) {
        const auto& v = a.views[i];
        const auto& w = b.views[i];
        if (v.name != w.name || !(v.camera == w.camera) || v.nearPlane != w.nearPlane ||
            v.farPlane != w.farPlane || v.depthBits != w.depthBits)
            return "view " + std::to_string(i);
    }
    return {};
}

#include <algorithm>
#include <cassert>
#include <cmath>
#include <tuple>

#include "formats/validate/validate_findings.hpp"

namespace stx {

void Findings::add(int rule, std::string where, std::string found, std::string expected) {
    const Rule* known = findRule(rule);
    assert(known);
    list.push_back({known, std::move(where), std::move(found), std::move(expected)});
}

std::string sizeText(int width, int height) {
    return fmt::format("{}x{}", width, height);
}

void checkVectors(const ReferenceView& view, const std::string& where, Findings& findings) {
    if (!view.hasNormals()) return;
    std::int64_t count = 0, away = 0;
    for (int y = 0; y < view.depth.height(); ++y) {
        for (int x = 0; x < view.depth.width(); ++x) {
            const glm::vec3 n = view.normal.at(x, y);
            if (!hasPoint(view.depth.at(x, y)) || n == glm::vec3(0)) continue;
            ++count;
            const glm::dvec3 towards = -view.camera.viewDirection(x + 0.5, y + 0.5);
            // Edge-on normals are rounded to either side.
            if (glm::dot(glm::dvec3(n), towards) < -0.05) ++away;
        }
    }
    if (away * 10 > count)
        findings.add(6008, where, fmt::format("{} of {} normals point away from it", away, count),
                     "normals that point to the viewer");
}

std::vector<Finding> validate(const Bundle& bundle) {
    Findings findings;
    std::int64_t points = 0;
    for (std::size_t i = 0; i < bundle.views.size(); ++i) {
        const ReferenceView& view = bundle.views[i];
        const std::string where = fmt::format("view {} '{}'", i, view.name);
        if (auto ok = view.camera.check(); !ok)
            findings.add(3005, where, ok.error().message, "a camera");
        if (!(view.nearPlane < view.farPlane))
            findings.add(3001, where,
                         fmt::format("nearPlane {} and farPlane {}", view.nearPlane, view.farPlane),
                         "nearPlane < farPlane");
        if (view.nearPlane < 0)
            findings.add(3002, where, fmt::format("nearPlane {}", view.nearPlane), "0 or more");
        if (view.depth.size() !=
                view.camera.width * glm::ivec2(1, 0) + view.camera.height * glm::ivec2(0, 1) ||
            view.texture.width() != view.depth.width() ||
            view.texture.height() != view.depth.height()) {
            findings.add(4001, where,
                         fmt::format("depth {}, texture {} and camera {}",
                                     sizeText(view.depth.width(), view.depth.height()),
                                     sizeText(view.texture.width(), view.texture.height()),
                                     sizeText(view.camera.width, view.camera.height)),
                         "one size");
            continue;
        }
        for (const auto* image : {&view.normal, &view.splatU, &view.splatV})
            if (!image->empty() && image->size() != view.depth.size())
                findings.add(6001, where, sizeText(image->width(), image->height()),
                             sizeText(view.depth.width(), view.depth.height()));
        if (view.splatU.empty() != view.splatV.empty())
            findings.add(6003, where, "one of splatU and splatV", "both or neither");
        const std::int64_t here = view.pointCount();
        points += here;
        if (here == 0) findings.add(4006, where, "no point", "one point at least");
        // Planes are rounded when they are written; a code's half step covers that.
        const double slack = (view.farPlane - view.nearPlane) * 1e-4;
        std::int64_t outside = 0;
        for (const float d : view.depth.pixels())
            if (hasPoint(d) && !(d >= view.nearPlane - slack && d <= view.farPlane + slack))
                ++outside;
        if (outside > 0)
            findings.add(4030, where,
                         fmt::format("{} of {} distances outside {} to {}", outside, here,
                                     view.nearPlane, view.farPlane),
                         "distances between the planes");
        if (view.normal.size() == view.depth.size() && view.camera.check())
            checkVectors(view, where, findings);
    }
    if (points == 0) findings.add(4007, "", "no point in any view", "points");
    return findings.list;
}

std::vector<Finding> validate(const Atlas& atlas) {
    Findings findings;
    const int textures = atlas.textureCount();
    if (textures > 4) findings.add(5003, "", fmt::format("{} textures", textures), "at most 4");
    for (std::size_t p = 0; p < atlas.pages.size(); ++p) {
        const AtlasPage& page = atlas.pages[p];
        const glm::ivec2 size = page.depth.size();
        const auto fits = [&](const auto& image) {
            return image.width() == 0 || (image.width() == size.x && image.height() == size.y);
        };
        if (!fits(page.texture) || !fits(page.normal) || !fits(page.splatU) || !fits(page.splatV))
            findings.add(5004, fmt::format("page {}", p), "textures of several sizes",
                         sizeText(size.x, size.y));
    }
    const auto& list = atlas.rectangles;
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < list.size(); ++i) {
        const AtlasRectangle& r = list[i];
        const bool known = r.view >= 0 && static_cast<std::size_t>(r.view) < atlas.views.size() &&
                           r.page >= 0 && static_cast<std::size_t>(r.page) < atlas.pages.size();
        bool inside = known && r.width > 0 && r.height > 0 && r.viewX >= 0 && r.viewY >= 0 &&
                      r.atlasX >= 0 && r.atlasY >= 0;
        if (inside) {
            const Camera& c = atlas.views[static_cast<std::size_t>(r.view)].camera;
            const glm::ivec2 page = atlas.pages[static_cast<std::size_t>(r.page)].depth.size();
            inside = r.width <= c.width - r.viewX && r.height <= c.height - r.viewY &&
                     r.atlasWidth() <= page.x - r.atlasX && r.atlasHeight() <= page.y - r.atlasY;
        }
        if (!inside)
            findings.add(
                5001, fmt::format("rectangle {}", i),
                fmt::format("{}x{} at {} {} of view {}, at {} {} of page {}", r.width, r.height,
                            r.viewX, r.viewY, r.view, r.atlasX, r.atlasY, r.page),
                "a rectangle inside both");
        else
            order.push_back(i);
    }
    // Along y, so that only neighbours are compared.
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return std::tie(list[a].page, list[a].atlasY, a) <
               std::tie(list[b].page, list[b].atlasY, b);
    });
    for (std::size_t i = 0; i < order.size(); ++i) {
        const AtlasRectangle& a = list[order[i]];
        for (std::size_t k = i + 1; k < order.size(); ++k) {
            const AtlasRectangle& b = list[order[k]];
            if (b.page != a.page || b.atlasY >= a.atlasY + a.atlasHeight()) break;
            if (b.atlasX < a.atlasX + a.atlasWidth() && a.atlasX < b.atlasX + b.atlasWidth())
                findings.add(5002, fmt::format("rectangles {} and {}", order[i], order[k]),
                             fmt::format("an overlap on page {}", a.page), "none");
        }
    }
    return findings.list;
}

}  // namespace stx

#include "lib/render/splat/gl/gl_points.hpp"

#include "lib/base/parallel.hpp"
#include "lib/model/srgb8.hpp"
#include "lib/render/splat/constants.hpp"
#include "lib/surface/depth_gradient.hpp"

namespace stx::gl {
namespace {

/// The normals of a view that brings none: of its depth as a surface.
Image<glm::vec3> normalsOf(const ReferenceView& view) {
    const Camera& camera = view.camera;
    DepthSurface surface = depthSurface(view, BakeSettings{});
    continueSlopes(camera, surface);  // as in baked views
    Image<glm::vec3> out(camera.width, camera.height, glm::vec3(0));
    parallelFor(0, camera.height, [&](int y) {
        for (int x = 0; x < camera.width; ++x) {
            if (!hasPoint(view.depth.at(x, y))) continue;
            out.at(x, y) =
                glm::vec3(camera.orientation *
                          planeNormal(camera, x, y, surface.w.at(x, y), surface.gradient.at(x, y)));
        }
    });
    return out;
}

}  // namespace

PointArrays makePointArrays(const PageSet& set, bool lit) {
    PointArrays out;
    const Bounds bounds = set.bounds();
    if (!bounds.empty()) out.centre = bounds.centre();
    out.linear = set.linear();
    out.decoded = lit && !out.linear;
    for (std::size_t i = 0; i < set.views().size(); ++i) {
        const PageView& view = set.views()[i];
        const Camera& camera = view.camera;
        Image<glm::vec3> made;
        if (lit && !view.hasNormals) made = normalsOf(set.copyOfView(i));
        for (const PageRectangle& r : set.rectanglesOf(i)) {
            const Page& page = set.pages()[r.page];
            for (int y = r.y0; y < r.y1; ++y) {
                for (int x = r.x0; x < r.x1; ++x) {
                    const std::size_t texel = r.texel(x, y);
                    const float dist = page.depth->data()[texel];
                    if (!hasPoint(dist)) continue;
                    if (!(page.texture->alpha(texel) >= splat::kHides)) continue;
                    const glm::dvec3 p =
                        camera.position +
                        camera.orientation * camera.unproject(x + 0.5, y + 0.5, dist) - out.centre;
                    out.radius = std::max(out.radius, glm::length(p));
                    out.positions.emplace_back(p);
                    if (const auto* floats = page.texture->rgbaFloat())
                        out.coloursF.emplace_back(glm::vec3(floats->data()[texel]), 1.0f);
                    else if (const glm::u8vec4 code = page.texture->rgba8()->data()[texel]; lit)
                        out.coloursF.emplace_back(linearFromSrgb8(code.r), linearFromSrgb8(code.g),
                                                  linearFromSrgb8(code.b), 1.0f);
                    else
                        out.colours.emplace_back(glm::u8vec3(code), 255);
                    if (lit)
                        out.normals.push_back(view.hasNormals ? page.normal->data()[texel]
                                                              : made.at(x, y));
                    const glm::dvec2 spacing = camera.sampleSpacing(dist);
                    out.spacings.push_back(static_cast<float>(std::max(spacing.x, spacing.y)));
                }
            }
        }
    }
    return out;
}

void groupPoints(const PointArrays& points, const RenderSettings& settings, const Camera& camera,
                 int largest, PointGroups& out) {
    const glm::vec3 axis(camera.forward());
    const float offset =
        static_cast<float>(glm::dot(points.centre - camera.position, camera.forward()));
    const auto focal = static_cast<float>(std::max(camera.fx, camera.fy));
    // A splat of this size just closes the diagonal of the lattice of points.
    const float closing = std::sqrt(2.0f) * focal;
    const std::size_t count = points.positions.size();
    std::vector<std::uint8_t> sizes(count);
    const int top = std::min(largest, 255);
    float nearest = std::numeric_limits<float>::infinity(), farthest = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const float dist = glm::dot(points.positions[i], axis) + offset;
        if (!(dist > 0)) continue;  // size 0: left out
        nearest = std::min(nearest, dist);
        farthest = std::max(farthest, dist);
        const float scale = camera.orthographic ? 1.0f : 1.0f / dist;
        float size = 1;
        if (settings.splat == SplatRule::data)
            size = closing * points.spacings[i] * scale;
        else if (settings.splat == SplatRule::paper && settings.splatCoefficient > 0)
            size = static_cast<float>(settings.splatCoefficient) * scale;
        else if (settings.splat == SplatRule::paper)
            size = closing * points.spacings[i] * scale;
        sizes[i] = static_cast<std::uint8_t>(
            std::clamp(static_cast<int>(std::min(std::ceil(size), 1000.0f)), 1, top));
    }
    out.nearest = nearest;
    out.farthest = farthest;
    std::array<std::size_t, 257> start{};
    for (const auto s : sizes) ++start[s + 1u];
    for (std::size_t s = 1; s < start.size(); ++s) start[s] += start[s - 1];
    out.indices.resize(count);
    auto next = start;
    for (std::size_t i = 0; i < count; ++i)
        out.indices[next[sizes[i]]++] = static_cast<std::uint32_t>(i);
    out.groups.clear();
    for (int s = 1; s <= top; ++s) {
        const std::size_t first = start[s];
        const std::size_t n = start[static_cast<std::size_t>(s) + 1] - first;
        if (n > 0) out.groups.push_back({s, first, n});
    }
}

}  // namespace stx::gl

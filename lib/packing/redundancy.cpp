#include "lib/packing/redundancy.hpp"

#include <algorithm>
#include <cmath>

#include "lib/base/parallel.hpp"

namespace stx {
namespace {

/// Views that a view is compared with; with hundreds of views the nearest say it all.
constexpr std::size_t kMostPartners = 24;

/// Share of the distance by which the corners of a quad may differ for it to be drawn.
constexpr double kBridged = 0.009;

void findBounds(PruneView& p) {
    Bounds bounds;
    const ReferenceView& v = *p.view;
    for (int y = 0; y < v.depth.height(); ++y) {
        for (int x = 0; x < v.depth.width(); ++x) {
            if (p.point(x, y)) bounds.add(v.worldPoint(x, y));
        }
    }
    if (bounds.empty()) return;
    p.worldCentre = bounds.centre();
    p.worldRadius = bounds.radius();
}

/// Neither sphere nor frustum rules out that `to` shows points of `from`.
bool mayShow(const PruneView& to, const PruneView& from) {
    const Camera& camera = to.view->camera;
    const glm::dvec3 c = to.cameraFromWorld * (from.worldCentre - camera.position);
    const double r = from.worldRadius;
    if (glm::length(from.worldCentre - to.worldCentre) > from.worldRadius + to.worldRadius)
        return false;
    if (!camera.orthographic && -c.z <= r) return -c.z > -r;
    const double nearest = camera.orthographic ? 1.0 : -c.z - r;
    const glm::dvec3 middle = camera.project(c);
    // A sphere's image is at most this far around the image of its centre; generous when near.
    const double reach = 2.0 * r * std::max(camera.fx, camera.fy) / nearest;
    return middle.x > -reach && middle.y > -reach && middle.x < camera.width + reach &&
           middle.y < camera.height + reach;
}

/// Samples per area of the surface that pixel (x, y) lies on.
double rateAt(const PruneView& p, int x, int y, double w) {
    const PixelSteps steps = planeSteps(p.view->camera, x, y, w, p.surface.gradient.at(x, y));
    const double area = glm::length(glm::cross(steps.alongX, steps.alongY));
    return area > 0 ? 1.0 / area : 0.0;
}

}  // namespace

Result<std::vector<PruneView>> preparePruning(const Bundle& bundle, const std::vector<int>& rank,
                                              std::vector<DepthSurface> surfaces, Job& job) {
    std::vector<PruneView> views(bundle.views.size());
    parallelFor(0, static_cast<std::int64_t>(views.size()), [&](std::int64_t i) {
        PruneView& p = views[i];
        p.view = &bundle.views[i];
        p.surface = std::move(surfaces[i]);
        p.worldFromCamera = glm::mat3_cast(p.view->camera.orientation);
        p.cameraFromWorld = glm::transpose(p.worldFromCamera);
        p.kept = Image<std::uint8_t>(p.view->depth.width(), p.view->depth.height(), 0);
        p.locked = p.kept;
        for (std::size_t k = 0; k < p.kept.count(); ++k)
            p.kept.pixels()[k] = std::isnan(p.surface.w.pixels()[k]) ? 0 : 1;
        p.error = Image<float>(p.kept.width(), p.kept.height(), 0.0f);
        findBounds(p);
    });
    STX_CHECK(job.checkCancelled());
    parallelFor(0, static_cast<std::int64_t>(views.size()), [&](std::int64_t i) {
        PruneView& p = views[i];
        for (const int j : rank) {
            // What shows now and what is remembered do not stand for each other.
            const bool alike = views[j].view->background == p.view->background;
            if (j != i && alike && mayShow(views[j], p)) p.partners.push_back(j);
        }
        if (p.partners.size() <= kMostPartners) return;
        // The nearest by direction and place, still in the order of rank.
        std::vector<std::pair<double, int>> near;
        for (const int j : p.partners) {
            const Camera &a = p.view->camera, &b = views[j].view->camera;
            near.emplace_back(glm::length(a.position - b.position) / (p.worldRadius + 1e-30) +
                                  2 * glm::length(a.forward() - b.forward()),
                              j);
        }
        std::nth_element(near.begin(), near.begin() + kMostPartners, near.end());
        std::vector<bool> close(views.size(), false);
        for (std::size_t k = 0; k < kMostPartners; ++k) close[near[k].second] = true;
        std::erase_if(p.partners, [&](int j) { return !close[j]; });
    });
    STX_CHECK(job.checkCancelled());
    return views;
}

PrunePixel::PrunePixel(const PruneView& view, int x, int y) {
    const Camera& camera = view.view->camera;
    const double w = view.surface.w.at(x, y);
    const double dist = camera.orthographic ? w : 1.0 / w;
    world = camera.position + view.worldFromCamera * camera.unproject(x + 0.5, y + 0.5, dist);
    const PixelSteps steps = planeSteps(camera, x, y, w, view.surface.gradient.at(x, y));
    // Along y runs down, so this faces the viewpoint.
    const glm::dvec3 across = glm::cross(steps.alongY, steps.alongX);
    const double area = glm::length(across);
    if (area > 0) {
        rate = 1.0 / area;
        normal = view.worldFromCamera * (across * rate);
    }
    colour = view.view->texture.at(x, y);
}

Replacement findReplacement(const PruneView& from, const PrunePixel& source, const PruneView& to,
                            const PruneSettings& settings) {
    Replacement r;
    const Camera& b = to.view->camera;
    const glm::dvec3 towards = b.orthographic ? -b.forward() : b.position - source.world;
    if (!(glm::dot(source.normal, towards) > 0)) return r;
    const glm::dvec3 inCamera = to.cameraFromWorld * (source.world - b.position);
    const double z = -inCamera.z;
    if (!b.orthographic && !(z > 0)) return r;
    const glm::dvec3 pixel = b.project(inCamera);
    const double fx = pixel.x - 0.5, fy = pixel.y - 0.5;
    if (!(fx >= 0 && fy >= 0 && fx < b.width - 1 && fy < b.height - 1)) return r;
    const int x0 = static_cast<int>(fx), y0 = static_cast<int>(fy);
    for (int k = 0; k < 4; ++k) {
        if (!to.kept.at(x0 + (k & 1), y0 + (k >> 1))) return r;
    }
    // All four must be this surface: their planes meet the line of sight at the point.
    const double wz = affineDepth(b, z);
    const double share =
        settings.depthTolerance * (b.orthographic ? std::max(z, from.worldRadius) : wz);
    const double steps =
        0.5 * (from.surface.step + to.surface.step) * (b.orthographic ? 1.0 : wz * wz);
    for (int k = 0; k < 4; ++k) {
        const int px = x0 + (k & 1), py = y0 + (k >> 1);
        const glm::dvec2 g = to.surface.gradient.at(px, py);
        const double predicted = to.surface.w.at(px, py) + g.x * (fx - px) + g.y * (fy - py);
        if (std::abs(predicted - wz) > share + steps + 0.5 * (std::abs(g.x) + std::abs(g.y)))
            return r;
    }
    // Renderers bridge neighbours only when their depths are close; a quad they leave open shows
    // nothing, whatever its corners say.
    double low = to.surface.w.at(x0, y0), high = low;
    for (int k = 1; k < 4; ++k) {
        const double corner = to.surface.w.at(x0 + (k & 1), y0 + (k >> 1));
        low = std::min(low, corner);
        high = std::max(high, corner);
    }
    if (!(high - low < kBridged * (b.orthographic ? std::max(high, to.worldRadius) : high)))
        return r;
    const int nx = static_cast<int>(pixel.x), ny = static_cast<int>(pixel.y);
    if (rateAt(to, nx, ny, to.surface.w.at(nx, ny)) * settings.rateTolerance *
            settings.rateTolerance <
        source.rate)
        return r;
    const auto tx = static_cast<float>(fx - x0), ty = static_cast<float>(fy - y0);
    const Texture& other = to.view->texture;
    const glm::vec3 corner[4] = {other.at(x0, y0), other.at(x0 + 1, y0), other.at(x0, y0 + 1),
                                 other.at(x0 + 1, y0 + 1)};
    const glm::vec3 found =
        glm::mix(glm::mix(corner[0], corner[1], tx), glm::mix(corner[2], corner[3], tx), ty);
    const glm::vec3 contrast =
        glm::max(glm::max(corner[0], corner[1]), glm::max(corner[2], corner[3])) -
        glm::min(glm::min(corner[0], corner[1]), glm::min(corner[2], corner[3]));
    const glm::vec3 difference = glm::abs(found - source.colour);
    if (glm::any(
            glm::greaterThan(difference, contrast + static_cast<float>(settings.colourTolerance))))
        return r;
    r.found = true;
    r.x = x0;
    r.y = y0;
    r.error = glm::dot(difference, difference) / 3.0;
    return r;
}

}  // namespace stx

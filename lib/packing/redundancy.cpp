#include "lib/packing/redundancy.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "lib/base/parallel.hpp"
#include "lib/selection/coverage.hpp"

namespace stx {
namespace {

/// Views that a view is compared with; with hundreds of views the nearest say it all.
constexpr std::size_t kMostPartners = 24;

/// Share of the distance by which the corners of a quad may differ for it to be drawn.
constexpr double kBridged = 0.009;

void findBounds(const ReferenceView& v, PruneView& p) {
    Bounds bounds;
    for (int y = 0; y < v.depth.height(); ++y) {
        for (int x = 0; x < v.depth.width(); ++x) {
            if (p.point(x, y)) bounds.add(v.worldPoint(x, y));
        }
    }
    if (bounds.empty()) return;
    p.worldCentre = bounds.centre();
    p.worldRadius = bounds.radius();
}

/// Room for what is looked at of the points, and what that is.
void keepPoints(const ReferenceView& view, const DepthSurface& surface, PruneView& p) {
    p.places = BlockPlaces(p.kept);
    p.surfels.resize(p.places.size());
    p.depths.resize(p.places.size());
    const auto* bytes = view.texture.rgba8();
    bytes ? p.colours.resize(p.places.size()) : p.linear.resize(p.places.size());
    for (int y = 0; y < p.kept.height(); ++y) {
        for (int x = 0; x < p.kept.width(); ++x) {
            if (!p.point(x, y)) continue;
            const std::size_t at = p.places.at(x, y);
            p.surfels[at] = {surface.w.at(x, y), surface.gradient.at(x, y)};
            p.depths[at] = view.depth.at(x, y);
            if (bytes)
                p.colours[at] = bytes->at(x, y);
            else
                p.linear[at] = view.texture.rgbaFloat()->at(x, y);
        }
    }
}

/// Neither sphere nor frustum rules out that `to` shows points of `from`.
bool mayShow(const PruneView& to, const PruneView& from) {
    const Camera& camera = to.camera;
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
double rateAt(const PruneView& p, int x, int y, const PruneView::Surfel& s) {
    const PixelSteps steps = planeSteps(p.camera, x, y, s.w, s.gradient);
    const double area = glm::length(glm::cross(steps.alongX, steps.alongY));
    return area > 0 ? 1.0 / area : 0.0;
}

/// Whether most of what a view shows around a point of space is empty.
bool isEmptyAt(const PruneView& view, const glm::dvec3& world) {
    const Camera& camera = view.camera;
    const glm::dvec3 inCamera = view.cameraFromWorld * (world - camera.position);
    if (!camera.orthographic && !(inCamera.z < 0)) return false;
    const glm::dvec3 pixel = camera.project(inCamera);
    if (!(pixel.x >= 0 && pixel.y >= 0 && pixel.x < camera.width && pixel.y < camera.height))
        return false;
    const double fx = std::clamp(pixel.x - 0.5, 0.0, camera.width - 1.0),
                 fy = std::clamp(pixel.y - 0.5, 0.0, camera.height - 1.0);
    const int x0 = static_cast<int>(fx), y0 = static_cast<int>(fy);
    double empty = 0;
    for (int k = 0; k < 4; ++k) {
        const int x = std::min(x0 + (k & 1), camera.width - 1),
                  y = std::min(y0 + (k >> 1), camera.height - 1);
        if (!view.empty[static_cast<std::size_t>(y) * view.kept.width() + x]) continue;
        empty += (k & 1 ? fx - x0 : 1 - (fx - x0)) * (k >> 1 ? fy - y0 : 1 - (fy - y0));
    }
    return empty > 0.5;
}

/// Of each block of BlockPlaces::kSide of a picture, row by row: whether `has` holds of a pixel.
template <class Has>
std::vector<std::uint8_t> blocksWith(const Image<std::uint8_t>& picture, const Has& has) {
    constexpr int side = BlockPlaces::kSide;
    const int columns = (picture.width() + side - 1) / side,
              rows = (picture.height() + side - 1) / side;
    std::vector<std::uint8_t> blocks(static_cast<std::size_t>(columns) * rows, 0);
    std::size_t k = 0;
    for (int y = 0; y < picture.height(); ++y) {
        for (int x = 0; x < picture.width(); ++x, ++k)
            if (has(k)) blocks[static_cast<std::size_t>(y / side) * columns + x / side] = 1;
    }
    return blocks;
}

}  // namespace

BlockPlaces::BlockPlaces(const Image<std::uint8_t>& wanted) {
    const auto blocks = [](int pixels) {
        return (static_cast<std::size_t>(pixels) + kSide - 1) / kSide;
    };
    blocksX_ = blocks(wanted.width());
    first_.resize(blocksX_ * blocks(wanted.height()));
    std::vector<bool> has(first_.size());
    for (int y = 0; y < wanted.height(); ++y) {
        const std::size_t row = static_cast<unsigned>(y) / kSide * blocksX_;
        for (int x = 0; x < wanted.width(); ++x)
            if (wanted.at(x, y)) has[row + static_cast<unsigned>(x) / kSide] = true;
    }
    for (std::size_t block = 0; block < has.size(); ++block) {
        if (!has[block]) continue;
        first_[block] = size_;
        size_ += std::size_t{kSide} * kSide;
    }
}

Image<float> PruneView::depth() const {
    Image<float> out(kept.width(), kept.height(), kNoDepth);
    for (int y = 0; y < out.height(); ++y) {
        for (int x = 0; x < out.width(); ++x)
            if (point(x, y)) out.at(x, y) = depths[places.at(x, y)];
    }
    return out;
}

void PruneView::keepAll() {
    for (std::size_t k = 0; k < kept.count(); ++k) kept.pixels()[k] = points[k] ? 1 : 0;
    locked.assign(places.size(), 0);
    errors.assign(places.size(), 0.0f);
    findLiveBlocks();
}

void PruneView::findLiveBlocks() {
    liveBlocks = blocksWith(kept, [&](std::size_t k) { return kept.data()[k] != 0; });
}

namespace {

/// Where the kept points of a block are between, world.
using Corners = std::array<glm::dvec3, 8>;

std::optional<Corners> cornersOf(const PruneView& view, const PruneBlock& block) {
    float least = std::numeric_limits<float>::max(), most = 0;
    for (int y = block.y0; y < block.y1; ++y) {
        for (int x = block.x0; x < block.x1; ++x) {
            if (!view.kept.at(x, y)) continue;
            least = std::min(least, view.surfel(x, y).w);
            most = std::max(most, view.surfel(x, y).w);
        }
    }
    if (!(least <= most)) return std::nullopt;
    Corners corners;
    for (std::size_t k = 0; k < corners.size(); ++k) {
        const double w = k & 4 ? most : least;
        corners[k] =
            view.camera.position +
            view.worldFromCamera * view.camera.unproject(k & 1 ? block.x1 : block.x0,
                                                         k & 2 ? block.y1 : block.y0,
                                                         view.camera.orthographic ? w : 1 / w);
    }
    return corners;
}

/// Whether something between the corners may fall on blocks of a view that are marked.
bool mayFallOn(const std::vector<std::uint8_t>& blocks, const PruneView& to,
               const Corners& corners) {
    constexpr int side = BlockPlaces::kSide;
    const Camera& camera = to.camera;
    glm::dvec2 low(std::numeric_limits<double>::max()), high(-low);
    for (const glm::dvec3& corner : corners) {
        const glm::dvec3 inCamera = to.cameraFromWorld * (corner - camera.position);
        if (!camera.orthographic && !(inCamera.z < 0)) return true;
        const glm::dvec2 pixel(camera.project(inCamera));
        low = glm::min(low, pixel);
        high = glm::max(high, pixel);
    }
    // The four pixels around a place, and one more for rounding.
    const glm::dvec2 last(camera.width - 1, camera.height - 1);
    const glm::ivec2 first(glm::clamp(low - 2.0, glm::dvec2(0), last)),
        end(glm::clamp(high + 2.0, glm::dvec2(0), last));
    const int columns = (camera.width + side - 1) / side;
    for (int y = first.y / side; y <= end.y / side; ++y)
        for (int x = first.x / side; x <= end.x / side; ++x)
            if (blocks[static_cast<std::size_t>(y) * columns + x]) return true;
    return false;
}

}  // namespace

BlockPartners partnersOfBlock(const std::vector<PruneView>& views, const PruneView& from,
                              const PruneBlock& block) {
    BlockPartners out;
    const auto corners = cornersOf(from, block);
    if (!corners) return out;
    for (const int j : from.partners) {
        if (mayFallOn(views[j].liveBlocks, views[j], *corners)) out.kept.push_back(j);
        if (mayFallOn(views[j].emptyBlocks, views[j], *corners)) out.empty.push_back(j);
    }
    return out;
}

PruneView preparePruning(const ReferenceView& view) {
    const DepthSurface surface = depthSurface(view, {});
    PruneView p;
    p.camera = view.camera;
    p.background = view.background;
    p.step = surface.step;
    p.codeStep = candidateOf(view).step;
    p.worldFromCamera = glm::mat3_cast(view.camera.orientation);
    p.cameraFromWorld = glm::transpose(p.worldFromCamera);
    p.kept = Image<std::uint8_t>(view.depth.width(), view.depth.height());
    p.points.resize(p.kept.count());
    for (std::size_t k = 0; k < p.kept.count(); ++k) {
        p.points[k] = !std::isnan(surface.w.pixels()[k]);
        p.kept.pixels()[k] = p.points[k] ? 1 : 0;
    }
    p.empty.resize(p.kept.count());
    for (std::size_t k = 0; k < p.kept.count(); ++k)
        p.empty[k] = !p.points[k] && view.texture.alpha(k) < 0.5f;
    p.emptyBlocks = blocksWith(p.kept, [&](std::size_t k) { return p.empty[k]; });
    keepPoints(view, surface, p);
    findBounds(view, p);
    return p;
}

void findPartners(std::vector<PruneView>& views, const std::vector<int>& rank) {
    parallelFor(0, views.size(), [&](std::int64_t i) {
        PruneView& p = views[i];
        for (const int j : rank) {
            // What shows now and what is remembered must not replace each other.
            const bool alike = views[j].background == p.background;
            if (j != i && alike && mayShow(views[j], p)) p.partners.push_back(j);
        }
        if (p.partners.size() <= kMostPartners) return;
        // The nearest by direction and place, still in the order of rank.
        std::vector<std::pair<double, int>> near;
        for (const int j : p.partners) {
            const Camera &a = p.camera, &b = views[j].camera;
            near.emplace_back(glm::length(a.position - b.position) / (p.worldRadius + 1e-30) +
                                  2 * glm::length(a.forward() - b.forward()),
                              j);
        }
        std::nth_element(near.begin(), near.begin() + kMostPartners, near.end());
        std::vector<bool> close(views.size(), false);
        for (std::size_t k = 0; k < kMostPartners; ++k) close[near[k].second] = true;
        std::erase_if(p.partners, [&](int j) { return !close[j]; });
    });
}

PrunePixel::PrunePixel(const PruneView& view, int x, int y) {
    const Camera& camera = view.camera;
    const PruneView::Surfel& surfel = view.surfel(x, y);
    const double w = surfel.w;
    const double dist = camera.orthographic ? w : 1.0 / w;
    world = camera.position + view.worldFromCamera * camera.unproject(x + 0.5, y + 0.5, dist);
    const PixelSteps steps = planeSteps(camera, x, y, w, surfel.gradient);
    // Along y runs down, so this faces the viewpoint.
    const glm::dvec3 across = glm::cross(steps.alongY, steps.alongX);
    const double area = glm::length(across);
    if (area > 0) {
        rate = 1.0 / area;
        normal = view.worldFromCamera * (across * rate);
    }
    colour = view.colour(view.places.at(x, y));
}

bool seesPast(const PruneView& view, const PrunePixel& pixel) {
    if (!isEmptyAt(view, pixel.world)) return false;
    const Camera& camera = view.camera;
    const double z = -(view.cameraFromWorld * (pixel.world - camera.position)).z;
    return isEmptyAt(view, pixel.world - pixel.normal * camera.sampleSpacing(z).x);
}

Replacement findReplacement(const PruneView& from, const PrunePixel& source, const PruneView& to,
                            const PruneSettings& settings) {
    Replacement r;
    const Camera& b = to.camera;
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
    std::array<std::size_t, 4> places{};
    for (std::size_t k = 0; k < 4; ++k)
        places[k] = to.places.at(x0 + static_cast<int>(k & 1), y0 + static_cast<int>(k >> 1));
    // All four must be this surface: their planes meet the line of sight at the point.
    const double wz = affineDepth(b, z);
    const double share =
        settings.depthTolerance * (b.orthographic ? std::max(z, from.worldRadius) : wz);
    const double steps = 0.5 * (from.step + to.step) * (b.orthographic ? 1.0 : wz * wz);
    for (int k = 0; k < 4; ++k) {
        const int px = x0 + (k & 1), py = y0 + (k >> 1);
        const PruneView::Surfel& surfel = to.surfels[places[k]];
        const glm::dvec2 g = surfel.gradient;
        const double predicted = surfel.w + g.x * (fx - px) + g.y * (fy - py);
        if (std::abs(predicted - wz) > share + steps + 0.5 * (std::abs(g.x) + std::abs(g.y)))
            return r;
    }
    // Renderers bridge neighbours only when their depths are close; a quad they leave open shows
    // nothing, whatever its corners say.
    double low = to.surfels[places[0]].w, high = low;
    for (std::size_t k = 1; k < 4; ++k) {
        const double corner = to.surfels[places[k]].w;
        low = std::min(low, corner);
        high = std::max(high, corner);
    }
    if (!(high - low < kBridged * (b.orthographic ? std::max(high, to.worldRadius) : high)))
        return r;
    const int nx = static_cast<int>(pixel.x), ny = static_cast<int>(pixel.y);
    const PruneView::Surfel& nearest = to.surfels[places[nx - x0 + 2 * (ny - y0)]];
    if (rateAt(to, nx, ny, nearest) * settings.rateTolerance * settings.rateTolerance < source.rate)
        return r;
    const auto tx = static_cast<float>(fx - x0), ty = static_cast<float>(fy - y0);
    const glm::vec3 corner[4] = {to.colour(places[0]), to.colour(places[1]), to.colour(places[2]),
                                 to.colour(places[3])};
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

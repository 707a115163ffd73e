#include "lib/splats/finest.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "lib/base/parallel.hpp"
#include "lib/geometry/near_views.hpp"

namespace stx::splats {
namespace {

constexpr std::size_t kMostViews = 16;
/// After so many discs it is looked at how much of a spool is in use.
constexpr std::size_t kLookEvery = 8192;
/// Discs of one surface lie in each other's plane to within this share of the larger one's side.
constexpr float kOff = 0.5f;
constexpr float kLeastCosine = 0.5f;  ///< between their normals
/// Edges cover their pixel in part: what replaces others must cover all of it.
constexpr float kWhole = 0.995f;

struct Shape {
    glm::vec3 normal{0.0f};
    float area = 0;
};

Shape shapeOf(const Disc& d) {
    const glm::vec3 across = glm::cross(d.u, d.v);
    const float area = glm::length(across);
    return {area > 0 ? across / area : glm::vec3(0.0f), area};
}

/// Whether the disc and its four neighbours are there, none of them an edge.
bool isInside(const Image<Disc>& discs, int x, int y) {
    if (x < 1 || y < 1 || x + 1 >= discs.width() || y + 1 >= discs.height()) return false;
    const auto whole = [&](int i, int j) { return discs.at(i, j).colour.w >= kWhole; };
    return whole(x, y) && whole(x - 1, y) && whole(x + 1, y) && whole(x, y - 1) && whole(x, y + 1);
}

/// Whether another view shows the place of a disc finer; of equally fine ones the first stays.
bool showsFiner(const Camera& camera, const glm::dmat3& cameraFromWorld, const Image<Disc>& discs,
                bool comesFirst, const Disc& disc, const Shape& shape) {
    const glm::dvec3 inCamera = cameraFromWorld * (glm::dvec3(disc.centre) - camera.position);
    if (!(inCamera.z < 0)) return false;
    const glm::dvec3 at = camera.project(inCamera);
    if (!(at.x >= 1 && at.y >= 1 && at.x < discs.width() - 1 && at.y < discs.height() - 1))
        return false;
    const int x = static_cast<int>(at.x), y = static_cast<int>(at.y);
    const Disc& other = discs.at(x, y);
    if (!isInside(discs, x, y)) return false;
    const Shape theirs = shapeOf(other);
    if (!(theirs.area < shape.area || (theirs.area == shape.area && comesFirst))) return false;
    if (std::abs(glm::dot(theirs.normal, shape.normal)) < kLeastCosine) return false;
    const glm::vec3 apart = disc.centre - other.centre;
    const float side = std::sqrt(shape.area);
    return std::abs(glm::dot(apart, theirs.normal)) <= kOff * side &&
           glm::length(apart) <= 2.0f * side;
}

}  // namespace

void keepFinest(const Bundle& bundle, std::vector<Image<Disc>>& discs, PixelSpool* spool) {
    const std::size_t count = bundle.views.size();
    std::vector<Image<std::uint8_t>> gone(count);
    const auto camera = [&](std::size_t i) -> const Camera& { return bundle.views[i].camera; };
    std::vector<glm::dmat3> turns;
    for (std::size_t i = 0; i < count; ++i)
        turns.push_back(glm::transpose(glm::mat3_cast(camera(i).orientation)));
    parallelFor(0, count, [&](std::size_t i) {
        const Image<Disc>& own = discs[i];
        Image<std::uint8_t> found(own.width(), own.height(), 0);
        Bounds bounds;
        for (const Disc& d : own.pixels())
            if (d.colour.w > 0) bounds.add(d.centre);
        if (bounds.empty()) return;
        if (spool) spool->settle();
        auto others = nearViews(count, camera, i, bounds.centre(), kMostViews);
        std::erase_if(others, [&](std::size_t j) {
            return bundle.views[j].background != bundle.views[i].background;
        });
        for (std::size_t p = 0; p < own.count(); ++p) {
            if (spool && p % kLookEvery == 0) spool->settle();
            const Disc& disc = own.pixels()[p];
            if (!(disc.colour.w > 0)) continue;
            const Shape shape = shapeOf(disc);
            found.data()[p] = std::ranges::any_of(others, [&](std::size_t j) {
                return showsFiner(camera(j), turns[j], discs[j], j < i, disc, shape);
            });
        }
        found.moveTo(spool);
        gone[i] = std::move(found);
    });
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t p = 0; p < gone[i].count(); ++p)
            if (gone[i].data()[p]) discs[i].data()[p].colour.w = 0;
}

}  // namespace stx::splats

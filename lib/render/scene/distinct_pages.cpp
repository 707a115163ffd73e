#include <algorithm>
#include <cmath>

#include "lib/render/scene/page_set.hpp"

namespace stx {
namespace {

/// The number of pixels of a view that are compared, about.
constexpr double kComparedPixels = 20000;
/// Colours (0..1) and depths (a share) that are apart by no more are the same: steps of 8 bits, and
/// what rounding makes of poses that are the same up to it.
constexpr float kSameColours = 2.5f / 255, kSameDistance = 1e-4f;
/// The share of pixels that may differ: where rounding decides at an edge.
constexpr double kMayDiffer = 0.001;

bool samePixel(const PageSet& set, std::size_t a, std::size_t b, int x, int y) {
    const PageRectangle *ra = set.find(a, x, y), *rb = set.find(b, x, y);
    if (!ra || !rb) return ra == rb;
    const float za = set.depth(a, x, y), zb = set.depth(b, x, y);
    if (hasPoint(za) != hasPoint(zb)) return false;
    if (hasPoint(za) && !(std::abs(za - zb) <= kSameDistance * za)) return false;
    // What is transparent shows no colour: in atlases it has any.
    const auto colour = [&](const PageRectangle& r) {
        const glm::vec4 c = set.pages()[r.page].texture->at(r.texel(x, y));
        return glm::vec4(glm::vec3(c) * c.a, c.a);
    };
    return glm::all(
        glm::lessThanEqual(glm::abs(colour(*ra) - colour(*rb)), glm::vec4(kSameColours)));
}

/// Whether two views of one camera show the same.
bool samePicture(const PageSet& set, std::size_t a, std::size_t b) {
    const Camera& c = set.views()[a].camera;
    const double pixels = static_cast<double>(c.width) * c.height;
    const int step = std::clamp(static_cast<int>(std::sqrt(pixels / kComparedPixels)), 1,
                                std::min(c.width, c.height));
    const auto compared = [step](int size) { return (size - 1 - step / 2) / step + 1; };
    const double mayDiffer = kMayDiffer * compared(c.width) * compared(c.height);
    // Of many views from one place each is compared with all others: those that differ are left
    // after a few pixels.
    int different = 0;
    for (int y = step / 2; y < c.height; y += step)
        for (int x = step / 2; x < c.width; x += step)
            if (!samePixel(set, a, b, x, y) && ++different > mayDiffer) return false;
    return true;
}

}  // namespace

PageSet PageSet::distinct() const {
    if (pruned()) return *this;
    std::vector<bool> kept(views().size(), true);
    for (std::size_t i = 0; i < kept.size(); ++i)
        for (std::size_t k = 0; k < i && kept[i]; ++k)
            kept[i] = !kept[k] || views()[k].background != views()[i].background ||
                      views()[k].hasNormals != views()[i].hasNormals ||
                      !sameCamera(views()[k].camera, views()[i].camera) ||
                      !samePicture(*this, k, i);
    return std::all_of(kept.begin(), kept.end(), [](bool k) { return k; }) ? *this : only(kept);
}

}  // namespace stx

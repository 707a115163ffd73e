#include "lib/render/surface/missing_normals.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "lib/base/parallel.hpp"
#include "lib/geometry/depth_code.hpp"

namespace stx::surface {
namespace {

/// How far normals are looked for, pixels to each side: two cover the rim of texels without normals
/// in views as coarse as half the picture, and surfaces bend little on the way.
constexpr int kFarthest = 2;
/// Pixels side by side are on one surface when their depths differ by no more than so many of a
/// pixel's size: that of a slope of 76 degrees, beyond which next to nothing is seen of it.
constexpr double kSteepestSlope = 4.0;
/// Sums of unit normals that are shorter point nowhere.
constexpr float kNoLength = 1e-6f;

/// The mean of what is within `reach` pixels of a pixel on its surface; zero where nothing is.
glm::vec3 meanAround(const Camera& camera, const Frame& frame, int x, int y, int reach) {
    const float here = frame.depth.at(x, y);
    const glm::dvec2 pixel = camera.sampleSpacing(here);
    const double most = kSteepestSlope * reach * std::max(pixel.x, pixel.y);
    glm::vec3 sum(0.0f);
    for (int ny = std::max(0, y - reach); ny <= std::min(frame.depth.height() - 1, y + reach);
         ++ny) {
        for (int nx = std::max(0, x - reach); nx <= std::min(frame.depth.width() - 1, x + reach);
             ++nx) {
            const float there = frame.depth.at(nx, ny);
            if (hasPoint(there) && std::abs(there - here) <= most) sum += frame.normal.at(nx, ny);
        }
    }
    const float length = glm::length(sum);
    return length > kNoLength ? sum / length : glm::vec3(0.0f);
}

}  // namespace

void borrowNormals(const Camera& camera, Frame& frame) {
    struct Borrowed {
        int x;
        glm::vec3 normal;
    };
    // Put in afterwards: what was borrowed is not lent again.
    std::vector<std::vector<Borrowed>> rows(static_cast<std::size_t>(frame.normal.height()));
    parallelFor(0, frame.normal.height(), [&](std::int64_t row) {
        const int y = static_cast<int>(row);
        for (int x = 0; x < frame.normal.width(); ++x) {
            if (frame.normal.at(x, y) != glm::vec3(0.0f) || !(frame.colour.at(x, y).a > 0.0f) ||
                !hasPoint(frame.depth.at(x, y)))
                continue;
            glm::vec3 mean(0.0f);
            for (int reach = 1; reach <= kFarthest && mean == glm::vec3(0.0f); ++reach)
                mean = meanAround(camera, frame, x, y, reach);
            if (mean != glm::vec3(0.0f)) rows[static_cast<std::size_t>(y)].push_back({x, mean});
        }
    });
    for (int y = 0; y < frame.normal.height(); ++y)
        for (const Borrowed& b : rows[static_cast<std::size_t>(y)])
            frame.normal.at(b.x, y) = b.normal;
}

}  // namespace stx::surface

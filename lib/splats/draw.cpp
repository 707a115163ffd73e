#include "lib/splats/draw.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "lib/base/parallel.hpp"
#include "lib/geometry/depth_code.hpp"
#include "lib/model/srgb8.hpp"
#include "lib/model/texture.hpp"
#include "lib/splats/harmonics.hpp"
#include "lib/splats/kernels.hpp"

namespace stx {
namespace {

using splats::kTile;
using splats::kTilePixels;
using splats::Projected;

constexpr double kDilation = 0.3;  ///< square pixels, added to each splat's covariance
constexpr double kCut = 9.0;       ///< squared deviations: 3 standard deviations
constexpr double kLeastAlpha = 1.0 / 255.0;

/// The camera as the published rules have it: x right, y down, z forward.
struct Eye {
    explicit Eye(const Camera& c)
        : camera(c),
          fromWorld(glm::dmat3(1, 0, 0, 0, -1, 0, 0, 0, -1) *
                    glm::transpose(glm::mat3_cast(c.orientation))) {
        // Beyond 1.3 times the half picture the projection's slope is that of there.
        const glm::dvec2 size(c.width, c.height), focal(c.fx, c.fy), middle(c.cx, c.cy);
        least = (-middle - 0.15 * size) / focal;
        largest = (size - middle + 0.15 * size) / focal;
    }
    /// What of a splat is needed in camera space: its own axes, as long as their deviations.
    struct Shape {
        glm::dvec3 centre;
        glm::dmat3 axes;
        [[nodiscard]] double along() const {
            return glm::length(glm::dvec3(axes[0].z, axes[1].z, axes[2].z));
        }
    };
    [[nodiscard]] glm::dmat3 turnOf(const SplatCloud& cloud, std::size_t i) const {
        const glm::dvec4 q(cloud.rotations[i]);
        return fromWorld * glm::mat3_cast(glm::dquat(q.w, q.x, q.y, q.z));
    }
    [[nodiscard]] Shape shapeOf(const SplatCloud& cloud, std::size_t i) const {
        Shape s{fromWorld * (glm::dvec3(cloud.positions[i]) - camera.position), turnOf(cloud, i)};
        for (int k = 0; k < 3; ++k) s.axes[k] *= static_cast<double>(cloud.scales[i][k]);
        return s;
    }

    const Camera& camera;
    glm::dmat3 fromWorld;
    glm::dvec2 least, largest;  ///< of x / z and y / z
};

glm::vec3 colourOf(const SplatCloud& cloud, std::size_t i, const Camera& camera) {
    glm::vec3 colour = cloud.colours[i];
    if (cloud.degree > 0) {
        const glm::dvec3 away = glm::dvec3(cloud.positions[i]) - camera.position;
        alignas(64) float basis[16];
        splats::harmonicsBasis(camera.orthographic ? camera.forward() : glm::normalize(away),
                               cloud.degree, basis);
        const int padded = SplatCloud::paddedCount(cloud.degree);
        splats::addHarmonics(cloud.harmonics.data() + i * 3 * static_cast<std::size_t>(padded),
                             padded, basis, &colour.x);
    }
    return glm::max(colour, 0.0f);
}

/// A splat in the picture and how far it is; false where nothing of it shows.
bool project(const SplatCloud& cloud, std::size_t i, const Eye& eye, Projected& to, float& far) {
    const Camera& c = eye.camera;
    const double opacity = cloud.opacities[i];
    if (!(opacity >= kLeastAlpha)) return false;
    const Eye::Shape shape = eye.shapeOf(cloud, i);
    const glm::dvec3 p = shape.centre;
    if (!(p.z > 0) || p.z <= shape.along()) return false;
    const double scale = c.orthographic ? 1.0 : 1.0 / p.z;
    const glm::dvec2 slope = c.orthographic
                                 ? glm::dvec2(0.0)
                                 : glm::clamp(glm::dvec2(p.x, p.y) * scale, eye.least, eye.largest);
    // The rows of J W R S.
    glm::dvec3 u, v;
    for (int k = 0; k < 3; ++k) {
        u[k] = c.fx * scale * (shape.axes[k].x - slope.x * shape.axes[k].z);
        v[k] = c.fy * scale * (shape.axes[k].y - slope.y * shape.axes[k].z);
    }
    const double xx = glm::dot(u, u) + kDilation, xy = glm::dot(u, v),
                 yy = glm::dot(v, v) + kDilation;
    // xx yy - xy xy, without its cancellation (Lagrange's identity).
    const glm::dvec3 area = glm::cross(u, v);
    const double determinant = glm::dot(area, area) + kDilation * (xx + yy - kDilation);
    if (!(determinant > 0) || !std::isfinite(determinant)) return false;
    const double cut = std::min(kCut, 2.0 * std::log(opacity / kLeastAlpha));
    const double halfX = std::sqrt(cut * xx), halfY = std::sqrt(cut * yy);
    const double x = c.cx + c.fx * p.x * scale, y = c.cy + c.fy * p.y * scale;
    if (!(x + halfX > 0 && x - halfX < c.width && y + halfY > 0 && y - halfY < c.height))
        return false;
    const glm::vec3 colour = colourOf(cloud, i, c);
    to = {static_cast<float>(x),
          static_cast<float>(y),
          static_cast<float>(std::sqrt(yy / determinant)),
          static_cast<float>(-xy / std::sqrt(yy * determinant)),
          static_cast<float>(1 / std::sqrt(yy)),
          static_cast<float>(cut),
          static_cast<float>(halfX),
          static_cast<float>(halfY),
          static_cast<float>(opacity),
          colour.x,
          colour.y,
          colour.z,
          static_cast<std::uint32_t>(i)};
    far = static_cast<float>(c.orthographic ? p.z : glm::length(p));
    return true;
}

/// Numbers of the splats, nearest first; of equally far ones in their own order.
std::vector<std::uint32_t> sorted(const std::vector<float>& far) {
    constexpr int kBits = 11, kPasses = 3;
    constexpr std::uint64_t kMask = (1u << kBits) - 1;
    // Floats above 0 are in the order of their bits.
    std::vector<std::uint64_t> keys(far.size()), other(far.size());
    std::vector<std::uint32_t> starts(kPasses << kBits);
    for (std::size_t i = 0; i < far.size(); ++i) {
        const std::uint64_t bits = std::bit_cast<std::uint32_t>(far[i]);
        keys[i] = bits << 32 | i;
        for (int pass = 0; pass < kPasses; ++pass)
            ++starts[(static_cast<std::size_t>(pass) << kBits) + (bits >> (pass * kBits) & kMask)];
    }
    for (int pass = 0; pass < kPasses; ++pass) {
        std::uint32_t* const start = starts.data() + (static_cast<std::size_t>(pass) << kBits);
        std::exclusive_scan(start, start + kMask + 1, start, 0u);
        for (const std::uint64_t key : keys)
            other[start[key >> (32 + pass * kBits) & kMask]++] = key;
        std::swap(keys, other);
    }
    std::vector<std::uint32_t> order(far.size());
    for (std::size_t i = 0; i < keys.size(); ++i) order[i] = static_cast<std::uint32_t>(keys[i]);
    return order;
}

/// The splats that each tile shows, nearest first.
struct Bins {
    std::vector<std::uint64_t> first;  ///< of each tile, and the end of the last
    std::vector<std::uint32_t> splats;
};

/// Tiles that a splat's box meets, both ends among them.
struct TileBox {
    int x0, y0, x1, y1;
    TileBox(const Projected& s, int tilesX, int tilesY) {
        const auto tile = [](float pixel, int tiles) {
            return static_cast<int>(
                std::clamp(std::floor(pixel / kTile), 0.0f, static_cast<float>(tiles - 1)));
        };
        x0 = tile(s.x - s.halfX, tilesX), x1 = tile(s.x + s.halfX, tilesX);
        y0 = tile(s.y - s.halfY, tilesY), y1 = tile(s.y + s.halfY, tilesY);
    }
};

Result<Bins> binned(const std::vector<Projected>& seen, const std::vector<std::uint32_t>& order,
                    int tilesX, int tilesY, const Limits& limits) {
    const auto tiles = static_cast<std::size_t>(tilesX) * static_cast<std::size_t>(tilesY);
    // Each piece of the list counts for itself, so that all threads keep one order.
    constexpr std::size_t kPiece = 1 << 16, kMostCounts = 1 << 24;
    const std::size_t pieces =
        std::clamp<std::size_t>(std::min(order.size() / kPiece, kMostCounts / tiles), 1, 64);
    std::vector<std::uint32_t> counts(pieces * tiles);
    const auto forPiece = [&](std::size_t piece, const auto& visit) {
        const std::size_t end = order.size() * (piece + 1) / pieces;
        for (std::size_t i = order.size() * piece / pieces; i < end; ++i) {
            const TileBox box(seen[order[i]], tilesX, tilesY);
            for (int y = box.y0; y <= box.y1; ++y)
                for (int x = box.x0; x <= box.x1; ++x)
                    visit(order[i], static_cast<std::size_t>(y) * static_cast<std::size_t>(tilesX) +
                                        static_cast<std::size_t>(x));
        }
    };
    const auto forPieces = [&](const auto& body) {
        parallelFor(0, pieces, [&](std::size_t p) { body(p); });
    };
    forPieces([&](std::size_t piece) {
        forPiece(piece, [&](std::uint32_t, std::size_t tile) { ++counts[piece * tiles + tile]; });
    });
    Bins bins;
    bins.first.resize(tiles + 1);
    for (std::size_t tile = 0; tile < tiles; ++tile) {
        std::uint32_t sum = 0;
        for (std::size_t piece = 0; piece < pieces; ++piece) {
            const std::uint32_t count = counts[piece * tiles + tile];
            counts[piece * tiles + tile] = sum;
            sum += count;
        }
        bins.first[tile + 1] = bins.first[tile] + sum;
    }
    if (auto room = limits.checkAllocation(bins.first[tiles], 4, "the splats of all tiles"); !room)
        return tl::unexpected(
            room.error().at("the splats are too large for this picture; smaller views need less"));
    bins.splats.resize(bins.first[tiles]);
    forPieces([&](std::size_t piece) {
        forPiece(piece, [&](std::uint32_t splat, std::size_t tile) {
            bins.splats[bins.first[tile] + counts[piece * tiles + tile]++] = splat;
        });
    });
    return bins;
}

/// Where the ray of a pixel comes nearest to a splat's centre, see SplatPicture::depth.
double depthIn(const SplatCloud& cloud, std::size_t i, const Eye& eye, double x, double y) {
    const Camera& c = eye.camera;
    const Eye::Shape shape = eye.shapeOf(cloud, i);
    const glm::dmat3 turn = glm::transpose(eye.turnOf(cloud, i));
    const glm::dvec2 offset((x - c.cx) / c.fx, (y - c.cy) / c.fy);
    const glm::dvec3 start(c.orthographic ? offset : glm::dvec2(0.0), 0.0),
        ray(c.orthographic ? glm::dvec2(0.0) : offset, 1.0);
    glm::dvec3 size(cloud.scales[i]);
    const double largest = std::max({size.x, size.y, size.z});
    if (!(largest > 0)) return shape.centre.z;
    // Nothing is flatter than that: a disc without thickness has a plane, too.
    size = glm::max(size, largest * 1e-7) / largest;
    const glm::dvec3 to = turn * (shape.centre - start) / size, along = turn * ray / size;
    const double depth = glm::dot(along, to) / glm::dot(along, along), reach = 3 * shape.along();
    // A disc seen from its side has its plane anywhere.
    return std::clamp(depth, shape.centre.z - reach, shape.centre.z + reach);
}

glm::vec3 normalOf(const SplatCloud& cloud, std::size_t i, const Camera& camera) {
    const glm::vec3 size = cloud.scales[i];
    const int shortest = size.x <= size.y && size.x <= size.z ? 0 : size.y <= size.z ? 1 : 2;
    const glm::vec4 q = cloud.rotations[i];
    const glm::dvec3 axis(glm::mat3_cast(glm::quat(q.w, q.x, q.y, q.z))[shortest]);
    const glm::dvec3 away =
        camera.orthographic ? camera.forward() : glm::dvec3(cloud.positions[i]) - camera.position;
    return glm::vec3(glm::dot(axis, away) > 0 ? -axis : axis);
}

/// What the splats of a pixel came to, as SplatPicture::colour has it.
glm::vec4 pixelColour(glm::vec3 sum, float alpha) {
    if (!(alpha > 0.0f)) return glm::vec4(0.0f);
    // Harmonics of a damaged file can lead beyond all floats.
    return {glm::min(sum / alpha, kLargestHalf) * alpha, alpha};
}

}  // namespace

Result<SplatPicture> drawSplats(const SplatCloud& cloud, const Camera& camera, bool normals,
                                Job& job) {
    STX_CHECK(camera.check());
    const int width = camera.width, height = camera.height;
    STX_CHECK(job.limits.checkAllocation(static_cast<std::uint64_t>(width) * height,
                                         normals ? 32 : 20, "the picture"));
    // What shows, its distance, and the keys of sorting.
    STX_CHECK(job.limits.checkAllocation(cloud.positions.size(), sizeof(Projected) + 24,
                                         "the splats of a picture"));
    const Eye eye(camera);
    std::vector<Projected> seen;
    std::vector<std::uint32_t> order;
    {
        constexpr std::int64_t kPiece = 1 << 14;
        const auto count = static_cast<std::int64_t>(cloud.positions.size());
        const std::int64_t pieces = (count + kPiece - 1) / kPiece;
        seen.resize(cloud.positions.size());
        std::vector<float> far(cloud.positions.size());
        std::vector<std::size_t> found(static_cast<std::size_t>(pieces));
        parallelFor(0, pieces, [&](std::int64_t piece) {
            auto at = static_cast<std::size_t>(piece * kPiece);
            const std::size_t first = at;
            for (std::int64_t i = piece * kPiece; i < std::min(count, (piece + 1) * kPiece); ++i)
                if (project(cloud, static_cast<std::size_t>(i), eye, seen[at], far[at])) ++at;
            found[piece] = at - first;
        });
        STX_CHECK(job.checkCancelled());
        std::size_t kept = 0;
        for (std::size_t piece = 0; piece < found.size(); ++piece) {
            const auto from = static_cast<std::ptrdiff_t>(piece * kPiece),
                       to = from + static_cast<std::ptrdiff_t>(found[piece]);
            std::copy(seen.begin() + from, seen.begin() + to,
                      seen.begin() + static_cast<std::ptrdiff_t>(kept));
            std::copy(far.begin() + from, far.begin() + to,
                      far.begin() + static_cast<std::ptrdiff_t>(kept));
            kept += found[piece];
        }
        seen.resize(kept);
        far.resize(kept);
        order = sorted(far);
    }
    SplatPicture out;
    out.colour = Image<glm::vec4>(width, height, glm::vec4(0.0f));
    out.depth = Image<float>(width, height, kNoDepth);
    if (normals) out.normal = Image<glm::vec3>(width, height, glm::vec3(0.0f));
    if (seen.empty()) return out;
    const int tilesX = (width + kTile - 1) / kTile, tilesY = (height + kTile - 1) / kTile;
    STX_TRY(const Bins bins, binned(seen, order, tilesX, tilesY, job.limits));
    parallelFor(0, static_cast<std::int64_t>(bins.first.size()) - 1, [&](std::int64_t tile) {
        const auto number = static_cast<std::size_t>(tile);
        const std::size_t count = bins.first[number + 1] - bins.first[number];
        if (count == 0 || job.cancelled.load(std::memory_order_relaxed)) return;
        const int left = static_cast<int>(tile % tilesX) * kTile,
                  top = static_cast<int>(tile / tilesX) * kTile;
        splats::TilePixels pixels;
        pixels.transmittance.fill(1.0f);
        pixels.red.fill(0.0f);
        pixels.green.fill(0.0f);
        pixels.blue.fill(0.0f);
        pixels.median.fill(-1);
        splats::blendTile(seen.data(), bins.splats.data() + bins.first[number], count, left, top,
                          pixels);
        for (int y = top; y < std::min(top + kTile, height); ++y) {
            for (int x = left; x < std::min(left + kTile, width); ++x) {
                const auto p = static_cast<std::size_t>((y - top) * kTile + x - left);
                out.colour.at(x, y) = pixelColour({pixels.red[p], pixels.green[p], pixels.blue[p]},
                                                  1.0f - pixels.transmittance[p]);
                if (pixels.median[p] < 0) continue;
                const std::size_t splat = seen[pixels.median[p]].number;
                const double depth = depthIn(cloud, splat, eye, x + 0.5, y + 0.5);
                if (!(depth > 0)) continue;
                out.depth.at(x, y) = static_cast<float>(depth);
                if (normals) out.normal.at(x, y) = normalOf(cloud, splat, camera);
            }
        }
    });
    STX_CHECK(job.checkCancelled());
    return out;
}

}  // namespace stx

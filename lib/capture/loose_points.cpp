#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <unordered_map>
#include <vector>

#include "lib/capture/rasterizer.hpp"
#include "lib/model/strays.hpp"

namespace stx {
namespace {

/// Points sorted into a cubic grid.
class PointGrid {
  public:
    PointGrid(const Mesh& mesh, double cell) : mesh_(mesh), cell_(cell) {
        for (const auto p : mesh.points) cells_[key(cellOf(mesh.positions[p]))].push_back(p);
    }
    [[nodiscard]] double nearest(std::uint32_t point) const {
        const auto centre = cellOf(mesh_.positions[point]);
        double best = std::numeric_limits<double>::infinity();
        for (int ring = 0; ring <= 3; ++ring) {
            for (int dz = -ring; dz <= ring; ++dz) {
                for (int dy = -ring; dy <= ring; ++dy) {
                    for (int dx = -ring; dx <= ring; ++dx) {
                        if (std::max({std::abs(dx), std::abs(dy), std::abs(dz)}) != ring) continue;
                        visit(centre + glm::i64vec3(dx, dy, dz), point, best);
                    }
                }
            }
            // Cells further out cannot hold anything nearer.
            if (best <= (ring * cell_) * (ring * cell_)) break;
        }
        return std::sqrt(best);
    }

  private:
    [[nodiscard]] glm::i64vec3 cellOf(glm::vec3 p) const {
        return glm::i64vec3(glm::floor(glm::dvec3(p) / cell_));
    }
    static std::uint64_t key(glm::i64vec3 c) {
        return (static_cast<std::uint64_t>(c.x) * 73856093u) ^
               (static_cast<std::uint64_t>(c.y) * 19349663u) ^
               (static_cast<std::uint64_t>(c.z) * 83492791u);
    }
    void visit(glm::i64vec3 cell, std::uint32_t point, double& best) const {
        const auto found = cells_.find(key(cell));
        if (found == cells_.end()) return;
        for (const auto other : found->second) {
            const glm::dvec3 d =
                glm::dvec3(mesh_.positions[other]) - glm::dvec3(mesh_.positions[point]);
            const double square = glm::dot(d, d);
            if (square > 0) best = std::min(best, square);
        }
    }

    const Mesh& mesh_;
    double cell_;
    std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

/// Sampled points or triangles say enough of how dense all are.
constexpr std::size_t kDensitySamples = 4096;

/// The median of the triangles' shortest sides; infinite without triangles.
double shortSide(const Mesh& mesh) {
    std::vector<double> sides;
    const std::size_t step = std::max<std::size_t>(1, mesh.triangles.size() / kDensitySamples);
    for (std::size_t i = 0; i < mesh.triangles.size(); i += step) {
        const glm::uvec3 t = mesh.triangles[i];
        const glm::dvec3 a(mesh.positions[t.x]), b(mesh.positions[t.y]), c(mesh.positions[t.z]);
        sides.push_back(std::min({glm::length(b - a), glm::length(c - b), glm::length(a - c)}));
    }
    if (sides.empty()) return std::numeric_limits<double>::infinity();
    const auto middle = sides.begin() + static_cast<std::ptrdiff_t>(sides.size() / 2);
    std::nth_element(sides.begin(), middle, sides.end());
    return *middle;
}

}  // namespace

LoosePoints loosePoints(const Mesh& mesh) {
    if (mesh.points.empty()) return {};
    // A single point far off says nothing of how dense the others are.
    const auto bounds = findStrays(mesh.points.size(), [&](std::uint64_t i) {
                            const glm::dvec3 p(mesh.positions[mesh.points[i]]);
                            return Piece{p, p};
                        }).bounds;
    // Few points beside many triangles, as of a scan whose thin parts are loose points: they are as
    // dense as the triangles.
    const double size = bounds.radius() * 2.0;
    const double most = std::min(size * 0.02, shortSide(mesh));
    // One point, or all in one place: any radius shows it.
    if (!(size > 0)) return {0.01f, true};
    // Points lie on surfaces: n of them on a size x size area are size / sqrt(n) apart.
    const double guess = size / std::sqrt(static_cast<double>(mesh.points.size()));
    const PointGrid grid(mesh, guess);
    std::vector<double> distances;
    const std::size_t step = std::max<std::size_t>(1, mesh.points.size() / kDensitySamples);
    for (std::size_t i = 0; i < mesh.points.size(); i += step) {
        const double d = grid.nearest(mesh.points[i]);
        if (std::isfinite(d)) distances.push_back(d);
    }
    if (distances.empty()) return {static_cast<float>(std::min(guess * 0.5, most)), true};
    // Irregular scans: most gaps are closed by the distance that nine in ten points stay under.
    const auto at = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() * 9 / 10);
    std::nth_element(distances.begin(), at, distances.end());
    // A handful of points does not make a surface: they stay dots.
    const double closing = *at * std::numbers::sqrt2 * 0.75;
    return {static_cast<float>(std::min(closing, most)), closing > most};
}

Mesh pointsAsTriangles(const Mesh& mesh, const Camera& camera, const LoosePoints& shape) {
    Mesh out = mesh;
    out.points.clear();
    const auto material = static_cast<std::uint32_t>(out.materials.size());
    out.materials.emplace_back();
    out.materials.back().name = "points";
    // Rings around the axis towards the camera, by their angle from it, and the pole of a ball.
    const int corners = shape.apart ? 12 : 6;
    constexpr double kRight = std::numbers::pi / 2;
    const std::vector<double> rings = shape.apart
                                          ? std::vector<double>{kRight, kRight * 2 / 3, kRight / 3}
                                          : std::vector<double>{kRight};
    const std::size_t each = static_cast<std::size_t>(corners) * rings.size() + shape.apart;
    out.positions.reserve(out.positions.size() + mesh.points.size() * each);
    const glm::vec3 forward(camera.forward());
    const glm::vec3 eye(camera.position);
    for (const auto p : mesh.points) {
        const glm::vec3 centre = mesh.positions[p];
        glm::vec3 axis = camera.orthographic ? -forward : eye - centre;
        const float length = glm::length(axis);
        if (!(length > 0.0f)) continue;
        axis /= length;
        const glm::vec3 other = std::abs(axis.y) < 0.9f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0);
        const glm::vec3 u = glm::normalize(glm::cross(other, axis)), v = glm::cross(axis, u);
        const auto first = static_cast<std::uint32_t>(out.positions.size());
        const auto add = [&](glm::vec3 direction) {
            out.positions.push_back(centre + direction * shape.radius);
            if (!mesh.normals.empty()) out.normals.push_back(mesh.normals[p]);
            if (!mesh.colours.empty()) out.colours.push_back(mesh.colours[p]);
            if (!mesh.uvs.empty()) out.uvs.push_back(mesh.uvs[p]);
            for (const auto uvs :
                 {&Mesh::normalUvs, &Mesh::metallicRoughnessUvs, &Mesh::emissiveUvs})
                if (!(mesh.*uvs).empty()) (out.*uvs).push_back((mesh.*uvs)[p]);
            if (!mesh.tangents.empty()) out.tangents.push_back(mesh.tangents[p]);
        };
        for (const double angle : rings)
            for (int k = 0; k < corners; ++k) {
                const float a = 2.0f * std::numbers::pi_v<float> * static_cast<float>(k) /
                                static_cast<float>(corners);
                add((u * std::cos(a) + v * std::sin(a)) * static_cast<float>(std::sin(angle)) +
                    axis * static_cast<float>(std::cos(angle)));
            }
        if (shape.apart) add(axis);
        const auto triangle = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
            out.triangles.emplace_back(first + a, first + b, first + c);
            out.triangleMaterial.push_back(material);
        };
        const auto around = static_cast<std::uint32_t>(corners);
        for (std::uint32_t ring = 0; ring + 1 < rings.size(); ++ring)
            for (std::uint32_t k = 0; k < around; ++k) {
                const std::uint32_t next = (k + 1) % around, low = ring * around,
                                    high = low + around;
                triangle(low + k, low + next, high + next);
                triangle(low + k, high + next, high + k);
            }
        if (shape.apart) {
            const std::uint32_t pole = static_cast<std::uint32_t>(each) - 1;
            for (std::uint32_t k = 0; k < around; ++k)
                triangle(pole - around + k, pole - around + (k + 1) % around, pole);
        } else {
            for (std::uint32_t k = 2; k < around; ++k) triangle(0, k - 1, k);
        }
    }
    return out;
}

}  // namespace stx

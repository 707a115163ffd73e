#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "lib/base/parallel.hpp"
#include "lib/capture/triangles.hpp"
#include "lib/model/strays.hpp"

namespace stx {
namespace {

/// Points sorted into a cubic grid.
class PointGrid {
  public:
    PointGrid(const Mesh& mesh, double cell) : mesh_(mesh), cell_(cell) {
        points_.reserve(mesh.points.size());
        for (const auto p : mesh.points)
            points_.push_back({key(cellOf(mesh.positions[p])), mesh.positions[p]});
        std::ranges::sort(points_, {}, &Placed::cell);
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
        const std::uint64_t wanted = key(cell);
        for (auto other = std::ranges::lower_bound(points_, wanted, {}, &Placed::cell);
             other != points_.end() && other->cell == wanted; ++other) {
            const glm::dvec3 d = glm::dvec3(other->position) - glm::dvec3(mesh_.positions[point]);
            const double square = glm::dot(d, d);
            if (square > 0) best = std::min(best, square);
        }
    }

    struct Placed {
        std::uint64_t cell;  ///< key()
        glm::vec3 position;
    };
    const Mesh& mesh_;
    double cell_;
    std::vector<Placed> points_;  ///< sorted by their cells
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

namespace {

/// Drawing takes at most this part of the memory limit at a time, beside the points that show.
constexpr std::uint64_t kPartOfMemory = 4;

/// What points become: rings of corners around the axis towards the camera, and the pole of a ball.
struct Shape {
    explicit Shape(const LoosePoints& points)
        : radius(points.radius), around(points.apart ? 12 : 6), pole(points.apart) {
        constexpr double kRight = std::numbers::pi / 2;
        rings = {kRight};
        if (pole) rings.insert(rings.end(), {kRight * 2 / 3, kRight / 3});
    }
    [[nodiscard]] std::size_t corners() const { return around * rings.size() + pole; }
    [[nodiscard]] std::size_t triangles() const {
        return around * 2 * (rings.size() - 1) + (pole ? around : around - 2);
    }

    float radius;
    std::uint32_t around;       ///< corners of a ring
    std::vector<double> rings;  ///< by their angle from the axis
    bool pole;
};

/// use(values, those of `to`) for each array of values of vertices that a mesh has.
template <class Use>
void forEachArray(const Mesh& mesh, Mesh& to, const Use& use) {
    const auto each = [&](const auto array) {
        if (!(mesh.*array).empty()) use(mesh.*array, to.*array);
    };
    each(&Mesh::normals);
    each(&Mesh::tangents);
    each(&Mesh::colours);
    each(&Mesh::uvs);
    each(&Mesh::normalUvs);
    each(&Mesh::metallicRoughnessUvs);
    each(&Mesh::emissiveUvs);
}

/// Bytes of a point's triangles, and of what is kept of them to draw them.
std::uint64_t memoryOfPoint(const Mesh& mesh, const Shape& shape) {
    std::uint64_t corner = sizeof(glm::vec3) + sizeof(glm::vec2);  // in the world and the picture
    Mesh none;
    forEachArray(mesh, none, [&](const auto& values, auto&) { corner += sizeof(values[0]); });
    constexpr std::uint64_t kTriangle = sizeof(glm::uvec3) + 2 * sizeof(std::uint32_t);
    return shape.corners() * corner + shape.triangles() * kTriangle;
}

/// Towards the camera; nothing of a point at its position.
std::optional<glm::vec3> axisOf(glm::vec3 point, const Camera& camera) {
    const glm::vec3 axis =
        camera.orthographic ? -glm::vec3(camera.forward()) : glm::vec3(camera.position) - point;
    const float length = glm::length(axis);
    if (!(length > 0.0f)) return {};
    return axis / length;
}

/// The triangles of a mesh, without what belongs to points alone.
Mesh withoutPoints(const Mesh& mesh) {
    std::uint32_t used = 0;
    for (const auto& t : mesh.triangles) used = std::max({used, t.x + 1, t.y + 1, t.z + 1});
    Mesh out;
    out.positions.assign(mesh.positions.begin(), mesh.positions.begin() + used);
    forEachArray(mesh, out, [&](const auto& values, auto& to) {
        to.assign(values.begin(), values.begin() + used);
    });
    out.triangles = mesh.triangles;
    out.triangleMaterial = mesh.triangleMaterial;
    out.materials = mesh.materials;
    out.textures = mesh.textures;
    return out;
}

/// Adds some points of `mesh`, shape.triangles() for each that has an axisOf().
void addPoints(const Mesh& mesh, std::span<const std::uint32_t> points, const Camera& camera,
               const Shape& shape, Mesh& out) {
    const auto material = static_cast<std::uint32_t>(out.materials.size());
    out.materials.emplace_back();
    out.materials.back().name = "points";
    const std::size_t vertices = out.positions.size() + points.size() * shape.corners();
    out.positions.reserve(vertices);
    forEachArray(mesh, out, [&](const auto&, auto& to) { to.reserve(vertices); });
    out.triangles.reserve(out.triangles.size() + points.size() * shape.triangles());
    out.triangleMaterial.reserve(out.triangles.capacity());
    const std::uint32_t around = shape.around;
    for (const auto p : points) {
        const glm::vec3 centre = mesh.positions[p];
        const auto axis = axisOf(centre, camera);
        if (!axis) continue;
        const glm::vec3 other = std::abs(axis->y) < 0.9f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0);
        const glm::vec3 u = glm::normalize(glm::cross(other, *axis)), v = glm::cross(*axis, u);
        const auto first = static_cast<std::uint32_t>(out.positions.size());
        const auto add = [&](glm::vec3 direction) {
            out.positions.push_back(centre + direction * shape.radius);
            forEachArray(mesh, out, [&](const auto& values, auto& to) { to.push_back(values[p]); });
        };
        for (const double angle : shape.rings)
            for (std::uint32_t k = 0; k < around; ++k) {
                const float a = 2.0f * std::numbers::pi_v<float> * static_cast<float>(k) /
                                static_cast<float>(around);
                add((u * std::cos(a) + v * std::sin(a)) * static_cast<float>(std::sin(angle)) +
                    *axis * static_cast<float>(std::cos(angle)));
            }
        if (shape.pole) add(*axis);
        const auto triangle = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
            out.triangles.emplace_back(first + a, first + b, first + c);
            out.triangleMaterial.push_back(material);
        };
        for (std::uint32_t ring = 0; ring + 1 < shape.rings.size(); ++ring)
            for (std::uint32_t k = 0; k < around; ++k) {
                const std::uint32_t next = (k + 1) % around, low = ring * around,
                                    high = low + around;
                triangle(low + k, low + next, high + next);
                triangle(low + k, high + next, high + k);
            }
        if (shape.pole) {
            const auto pole = static_cast<std::uint32_t>(shape.corners()) - 1;
            for (std::uint32_t k = 0; k < around; ++k)
                triangle(pole - around + k, pole - around + (k + 1) % around, pole);
        } else {
            for (std::uint32_t k = 2; k < around; ++k) triangle(0, k - 1, k);
        }
    }
}

/// The points of which something shows among all points.
Result<std::vector<std::uint32_t>> shownOf(const Mesh& mesh, std::vector<std::uint32_t> points,
                                           const Camera& camera, const RasterSettings& settings,
                                           const Shape& shape, Job& job) {
    Mesh drawn;
    addPoints(mesh, points, camera, shape, drawn);
    STX_TRY(const auto shown, shownTriangles(drawn, camera, settings, job));
    const auto each = static_cast<std::ptrdiff_t>(shape.triangles());
    auto at = shown.begin();
    std::erase_if(points, [&](std::uint32_t p) {
        if (!axisOf(mesh.positions[p], camera)) return true;
        const auto end = at + each;
        return std::find(std::exchange(at, end), end, 1) == end;
    });
    return points;
}

/// All points where they take little memory; else those of which something shows among all points,
/// which is what each piece of them leaves of it together with those before, and in their order:
/// of what is equally near the first shows.
Result<std::vector<std::uint32_t>> pointsToDraw(const Mesh& mesh, const Camera& camera,
                                                const RasterSettings& settings, const Shape& shape,
                                                Job& job) {
    const std::uint64_t each = memoryOfPoint(mesh, shape);
    const auto allows = [&](std::uint64_t bytesEach) {
        return static_cast<std::size_t>(job.limits.maxMemoryBytes / bytesEach);
    };
    // Other threads may draw other views.
    const std::size_t piece =
        std::max<std::size_t>(1, allows((each + shape.triangles() * memoryOfTriangle()) *
                                        kPartOfMemory * static_cast<std::uint64_t>(threadCount())));
    if (mesh.points.size() <= piece) return mesh.points;
    std::vector<std::uint32_t> out;
    for (auto rest = std::span(mesh.points); !rest.empty();) {
        // As many as are drawn again with them, so that none is drawn often.
        const std::size_t most = std::max(allows(each), out.size()) - out.size();
        const auto next =
            rest.first(std::min(rest.size(), std::max(piece, std::min(out.size(), most))));
        rest = rest.subspan(next.size());
        out.insert(out.end(), next.begin(), next.end());
        STX_SET(out, shownOf(mesh, std::move(out), camera, settings, shape, job));
        STX_CHECK(job.limits.checkAllocation(out.size(), each, "the points that a picture shows"));
    }
    return out;
}

}  // namespace

Result<Mesh> pointsAsTriangles(const Mesh& mesh, const Camera& camera,
                               const RasterSettings& settings, Job& job) {
    const Shape shape(loosePoints(mesh));
    STX_TRY(const auto points, pointsToDraw(mesh, camera, settings, shape, job));
    Mesh out = withoutPoints(mesh);
    addPoints(mesh, points, camera, shape, out);
    return out;
}

}  // namespace stx

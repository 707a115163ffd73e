#include "lib/model/strays.hpp"

#include <algorithm>
#include <array>
#include <memory>

#include "lib/model/splat_cloud.hpp"

namespace stx {
namespace {

/// Pieces that are looked at to find the core, evenly spread over the list.
constexpr std::uint64_t kSamples = 8192;
constexpr double kFarOut = 10.0;
constexpr std::uint64_t kOneIn = 1000;

/// The box that holds all but 1 in 200 of some values at each end of each axis.
Bounds coreOf(std::uint64_t count, const std::function<Piece(std::uint64_t)>& piece) {
    std::array<std::vector<double>, 3> values;
    const std::uint64_t step = std::max<std::uint64_t>(1, count / kSamples);
    for (std::uint64_t i = 0; i < count; i += step) {
        const auto p = piece(i);
        for (int k = 0; k < 3; ++k) values[k].push_back((p.min[k] + p.max[k]) * 0.5);
    }
    Bounds core;
    glm::dvec3 low, high;
    for (int k = 0; k < 3; ++k) {
        auto& v = values[k];
        const auto left = static_cast<std::ptrdiff_t>(v.size() / 200);
        const auto right = static_cast<std::ptrdiff_t>(v.size()) - 1 - left;
        std::nth_element(v.begin(), v.begin() + left, v.end());
        low[k] = v[left];
        std::nth_element(v.begin(), v.begin() + right, v.end());
        high[k] = v[right];
    }
    core.add(low);
    core.add(high);
    return core;
}

/// Distance of a point from a box; 0 inside.
double outside(const Bounds& box, glm::dvec3 p) {
    return glm::length(glm::max(glm::max(box.min - p, p - box.max), glm::dvec3(0.0)));
}

Piece pieceOf(const Mesh& mesh, std::uint64_t i) {
    if (i >= mesh.triangles.size()) {
        const glm::dvec3 p(mesh.positions[mesh.points[i - mesh.triangles.size()]]);
        return {p, p};
    }
    const auto& t = mesh.triangles[i];
    const glm::dvec3 a(mesh.positions[t.x]), b(mesh.positions[t.y]), c(mesh.positions[t.z]);
    return {glm::min(a, glm::min(b, c)), glm::max(a, glm::max(b, c))};
}

/// Of all splats but the strays, as far as they reach. Which are strays goes by their centres: one
/// far off is not part of the object because it is large.
Bounds boundsOfSplats(const Mesh& mesh, const Strays& strays) {
    Bounds bounds;
    std::size_t next = 0;
    for (std::size_t i = 0; i < mesh.points.size(); ++i) {
        if (next < strays.pieces.size() && strays.pieces[next] == i) {
            ++next;
            continue;
        }
        const std::uint32_t p = mesh.points[i];
        const glm::dvec3 centre(mesh.positions[p]);
        const glm::dvec3 most(mesh.splats->mostReach(p));
        Bounds wide = bounds;
        wide.add(centre - most);
        wide.add(centre + most);
        if (wide == bounds) continue;
        const glm::dmat3 reach = mesh.splats->reach(p);
        const glm::dvec3 half(reach[0][0], reach[1][1], reach[2][2]);
        bounds.add(centre - half);
        bounds.add(centre + half);
    }
    return bounds;
}

/// A cloud in which the strays are transparent: numbers of splats are those of vertices, so they
/// keep their places.
Result<std::shared_ptr<const SplatCloud>> withoutStrays(const Mesh& mesh, const Strays& strays,
                                                        const Limits& limits) {
    const SplatCloud& whole = *mesh.splats;
    STX_CHECK(limits.checkAllocation(whole.positions.size(), SplatCloud::bytesEach(whole.degree),
                                     "the splats without those far outside"));
    auto cloud = std::make_shared<SplatCloud>(whole);
    for (const std::uint64_t piece : strays.pieces) cloud->opacities[mesh.points[piece]] = 0;
    return cloud;
}

}  // namespace

Strays findStrays(std::uint64_t count, const std::function<Piece(std::uint64_t)>& piece) {
    Strays out;
    Bounds all;
    for (std::uint64_t i = 0; i < count; ++i) {
        const auto p = piece(i);
        all.add(p.min);
        all.add(p.max);
    }
    out.bounds = all;
    if (count < kOneIn) return out;
    const auto core = coreOf(count, piece);
    const auto size = core.max - core.min;
    const double largest = std::max({size.x, size.y, size.z});
    const auto reach = glm::dvec3(largest * kFarOut);
    const Bounds wide{core.min - reach, core.max + reach};
    if (!(largest > 0) ||
        (all.min == glm::max(all.min, wide.min) && all.max == glm::min(all.max, wide.max)))
        return out;
    Bounds rest;
    double farthest = 0;
    for (std::uint64_t i = 0; i < count; ++i) {
        const auto p = piece(i);
        const auto extent = p.max - p.min;
        const double away = outside(wide, (p.min + p.max) * 0.5);
        if (!(away > 0) || std::max({extent.x, extent.y, extent.z}) > largest) {
            rest.add(p.min);
            rest.add(p.max);
            continue;
        }
        // More than strays can be: this is the shape of the object.
        if (out.pieces.size() == count / kOneIn) {
            out.pieces.clear();
            return out;
        }
        out.pieces.push_back(i);
        if (away > farthest) {
            farthest = away;
            out.farthest = (p.min + p.max) * 0.5;
        }
    }
    if (!out.pieces.empty()) out.bounds = rest;
    return out;
}

Strays findStrays(const Mesh& mesh) {
    Strays strays = findStrays(mesh.triangles.size() + mesh.points.size(),
                               [&](std::uint64_t i) { return pieceOf(mesh, i); });
    if (mesh.splats) strays.bounds = boundsOfSplats(mesh, strays);
    return strays;
}

void noteStrays(const Strays& strays, std::uint64_t count, const char* what, glm::dvec3 shift,
                Job& job) {
    if (strays.pieces.empty()) return;
    const auto at = strays.farthest + shift;
    const bool one = strays.pieces.size() == 1;
    job.note(
        fmt::format("{} of {} {} {} far outside of the rest ({} {:.6g} {:.6g} {:.6g}): bounds and "
                    "reference views leave {} out",
                    strays.pieces.size(), count, what, one ? "lies" : "lie",
                    one ? "at" : "the farthest at", at.x, at.y, at.z, one ? "it" : "them"));
}

Result<void> dropStrays(Mesh& mesh, const Strays& strays, const Limits& limits) {
    if (strays.pieces.empty()) return {};
    if (mesh.splats) STX_SET(mesh.splats, withoutStrays(mesh, strays, limits));
    const auto triangles = mesh.triangles.size();
    std::size_t next = 0, keptTriangles = 0, keptPoints = 0;
    const auto stray = [&](std::uint64_t i) {
        if (next == strays.pieces.size() || strays.pieces[next] != i) return false;
        ++next;
        return true;
    };
    for (std::size_t i = 0; i < triangles; ++i) {
        if (stray(i)) continue;
        mesh.triangles[keptTriangles] = mesh.triangles[i];
        mesh.triangleMaterial[keptTriangles++] = mesh.triangleMaterial[i];
    }
    for (std::size_t i = 0; i < mesh.points.size(); ++i) {
        if (!stray(triangles + i)) mesh.points[keptPoints++] = mesh.points[i];
    }
    mesh.triangles.resize(keptTriangles);
    mesh.triangleMaterial.resize(keptTriangles);
    mesh.points.resize(keptPoints);
    return {};
}

}  // namespace stx

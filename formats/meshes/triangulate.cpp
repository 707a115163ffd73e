#include "formats/meshes/triangulate.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

namespace stx {
namespace {

double cross(glm::dvec2 a, glm::dvec2 b, glm::dvec2 c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

bool inside(glm::dvec2 p, glm::dvec2 a, glm::dvec2 b, glm::dvec2 c) {
    return cross(a, b, p) >= 0 && cross(b, c, p) >= 0 && cross(c, a, p) >= 0;
}

/// The polygon in its own plane, counter-clockwise.
std::vector<glm::dvec2> flatten(std::span<const glm::dvec3> corners) {
    glm::dvec3 normal(0.0);
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const auto a = corners[i], b = corners[(i + 1) % corners.size()];
        normal += glm::cross(a - corners[0], b - corners[0]);
    }
    const auto size = glm::abs(normal);
    std::vector<glm::dvec2> flat;
    flat.reserve(corners.size());
    for (const auto& c : corners) {
        if (size.x >= size.y && size.x >= size.z)
            flat.emplace_back(normal.x < 0 ? c.z : c.y, normal.x < 0 ? c.y : c.z);
        else if (size.y >= size.z)
            flat.emplace_back(normal.y < 0 ? c.x : c.z, normal.y < 0 ? c.z : c.x);
        else
            flat.emplace_back(normal.z < 0 ? c.y : c.x, normal.z < 0 ? c.x : c.y);
    }
    return flat;
}

void fan(std::span<const std::uint32_t> corners, std::vector<glm::uvec3>& triangles) {
    for (std::size_t i = 1; i + 1 < corners.size(); ++i)
        triangles.emplace_back(corners[0], corners[i], corners[i + 1]);
}

/// The corners that are left, in squares: an ear has few in and around it.
class CornerGrid {
  public:
    explicit CornerGrid(std::span<const glm::dvec2> flat) : flat_(flat) {
        low_ = glm::dvec2(flat[0]);
        glm::dvec2 high = low_;
        for (const auto& p : flat) low_ = glm::min(low_, p), high = glm::max(high, p);
        constexpr double kEach = 2;  // corners in a square, if they were spread evenly
        side_ = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(flat.size()) / kEach)));
        size_ = glm::max((high - low_) / static_cast<double>(side_), glm::dvec2(1e-300));
        squares_.resize(static_cast<std::size_t>(side_) * side_);
        for (std::uint32_t i = 0; i < flat.size(); ++i) squareOf(flat[i]).push_back(i);
    }
    void remove(std::uint32_t corner) {
        auto& square = squareOf(flat_[corner]);
        *std::ranges::find(square, corner) = square.back();
        square.pop_back();
    }
    /// Whether a corner lies in the triangle. Adds to `steps` what it looked at.
    bool anyInside(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint64_t& steps) const {
        const auto pa = flat_[a], pb = flat_[b], pc = flat_[c];
        const auto first = place(glm::min(pa, glm::min(pb, pc)));
        const auto last = place(glm::max(pa, glm::max(pb, pc)));
        for (int y = first.y; y <= last.y; ++y)
            for (int x = first.x; x <= last.x; ++x) {
                const auto& square = squares_[static_cast<std::size_t>(y) * side_ + x];
                steps += 1 + square.size();
                for (const auto corner : square) {
                    const auto p = flat_[corner];
                    // Corners at the same place (a bridge to a hole) do not block.
                    if (p != pa && p != pb && p != pc && inside(p, pa, pb, pc)) return true;
                }
            }
        return false;
    }

  private:
    [[nodiscard]] glm::ivec2 place(glm::dvec2 p) const {
        // In this order what is not a number is in the last square.
        return glm::ivec2(glm::min(glm::dvec2(side_ - 1), (p - low_) / size_));
    }
    std::vector<std::uint32_t>& squareOf(glm::dvec2 p) {
        const auto at = place(p);
        return squares_[static_cast<std::size_t>(at.y) * side_ + at.x];
    }

    std::span<const glm::dvec2> flat_;
    glm::dvec2 low_{0.0}, size_{1.0};  ///< of all, of a square
    int side_ = 1;                     ///< squares
    std::vector<std::vector<std::uint32_t>> squares_;
};

bool isConvex(std::span<const glm::dvec2> flat) {
    const std::size_t n = flat.size();
    for (std::size_t i = 0; i < n; ++i)
        if (!(cross(flat[i], flat[(i + 1) % n], flat[(i + 2) % n]) >= 0)) return false;
    return true;
}

void cutEars(std::span<const glm::dvec2> flat, std::vector<glm::uvec3>& triangles) {
    const auto n = static_cast<std::uint32_t>(flat.size());
    std::vector<std::uint32_t> next(n), previous(n);
    for (std::uint32_t i = 0; i < n; ++i) {
        next[i] = (i + 1) % n;
        previous[i] = (i + n - 1) % n;
    }
    // Of a drawing each ear takes a few steps, 1000 where its corners are badly spread. What takes
    // more is an attack.
    constexpr std::uint64_t kMostSteps = 1 << 16;  // for each corner
    CornerGrid grid(flat);
    std::uint32_t at = 0, left = n, misses = 0;
    for (std::uint64_t steps = 0; left > 3 && misses < left && steps < kMostSteps * n; ++steps) {
        const auto before = previous[at], after = next[at];
        if (cross(flat[before], flat[at], flat[after]) > 0 &&
            !grid.anyInside(before, at, after, steps)) {
            triangles.emplace_back(before, at, after);
            grid.remove(at);
            next[before] = after;
            previous[after] = before;
            at = before;
            --left;
            misses = 0;
        } else {
            at = after;
            ++misses;
        }
    }
    std::vector<std::uint32_t> rest(left);
    for (auto& corner : rest) {
        corner = at;
        at = next[at];
    }
    std::rotate(rest.begin(), std::ranges::min_element(rest), rest.end());
    fan(rest, triangles);
}

}  // namespace

void triangulate(std::span<const glm::dvec3> corners, std::vector<glm::uvec3>& triangles) {
    const auto n = static_cast<std::uint32_t>(corners.size());
    if (n < 3) return;
    std::vector<std::uint32_t> all(n), apart;
    std::iota(all.begin(), all.end(), 0u);
    if (n == 3) return fan(all, triangles);
    const auto flat = flatten(corners);
    // A corner that is there twice has no angle: a notch at it would be filled, and no ear is cut.
    std::vector<glm::dvec2> places;
    for (const auto i : all) {
        if (corners[i] == corners[(i + 1) % n]) continue;
        apart.push_back(i);
        places.push_back(flat[i]);
    }
    if (isConvex(places)) return fan(all, triangles);
    const std::size_t before = triangles.size();
    cutEars(places, triangles);
    for (auto& t : std::span(triangles).subspan(before)) t = {apart[t.x], apart[t.y], apart[t.z]};
}

}  // namespace stx

#include "lib/splats/merge.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "lib/base/parallel.hpp"

namespace stx::splats {
namespace {

constexpr int kLevels = 6;  ///< the largest square has 64 x 64 texels
/// A distance from the common plane of this share of a square's half side weighs as much as the
/// largest difference of colour.
constexpr float kPlane = 0.5f;

/// A square of discs of the level below.
struct Square {
    Disc disc;
    float loss = -1;  ///< of being one disc, never less than its parts'; below 0: cannot be
};
using Level = Image<Square>;

Square merged(const Square* const (&parts)[4]) {
    Square out;
    glm::vec3 u(0.0f), v(0.0f);
    for (const Square* part : parts) {
        if (part->loss < 0) return {};
        out.disc.centre += 0.25f * part->disc.centre;
        out.disc.colour += 0.25f * part->disc.colour;
        u += 0.25f * part->disc.u;
        v += 0.25f * part->disc.v;
    }
    // Twice as far across.
    out.disc.u = 2.0f * u;
    out.disc.v = 2.0f * v;
    const glm::vec3 across = glm::cross(u, v);
    const float area = glm::length(across);
    if (!(area > 0.0f)) return {};
    const glm::vec3 normal = across / area;
    const float side = std::sqrt(area);
    out.loss = 0;
    for (const Square* part : parts) {
        const glm::vec4 off = glm::abs(part->disc.colour - out.disc.colour);
        const float colour = std::max({off.x, off.y, off.z, off.w});
        const float plane =
            std::abs(glm::dot(part->disc.centre - out.disc.centre, normal)) / (kPlane * side);
        // Where the surface ends, parts are as far apart as they are far behind each other.
        const glm::vec3 apart = part->disc.centre - out.disc.centre;
        const float gap = std::max(0.0f, glm::length(apart) / side - 2.0f);
        out.loss = std::max(out.loss, part->loss + colour + plane + gap);
    }
    return out;
}

std::vector<Level> pyramidOf(Image<Disc> discs) {
    std::vector<Level> levels;
    levels.emplace_back(discs.width(), discs.height());
    for (std::size_t i = 0; i < discs.count(); ++i) {
        Square& s = levels[0].pixels()[i];
        s.disc = discs.pixels()[i];
        s.loss = s.disc.colour.w > 0.0f ? 0.0f : -1.0f;
    }
    for (int l = 1; l <= kLevels; ++l) {
        const Level& from = levels.back();
        Level to(from.width() / 2, from.height() / 2);
        if (to.empty()) break;
        for (int y = 0; y < to.height(); ++y)
            for (int x = 0; x < to.width(); ++x)
                to.at(x, y) = merged({&from.at(2 * x, 2 * y), &from.at(2 * x + 1, 2 * y),
                                      &from.at(2 * x, 2 * y + 1), &from.at(2 * x + 1, 2 * y + 1)});
        levels.push_back(std::move(to));
    }
    return levels;
}

/// What is left of a square when each that loses at most `loss` is one disc.
void cut(const std::vector<Level>& levels, std::size_t level, int x, int y, float loss,
         std::vector<Disc>& to) {
    const Level& here = levels[level];
    if (here.contains(x, y)) {
        const Square& s = here.at(x, y);
        if (s.loss >= 0 && (level == 0 || s.loss <= loss)) {
            to.push_back(s.disc);
            return;
        }
    }
    // Edges that no square of this level covers have parts, too.
    for (int part = 0; part < 4 && level > 0; ++part)
        cut(levels, level - 1, 2 * x + part % 2, 2 * y + part / 2, loss, to);
}

}  // namespace

std::vector<std::vector<Disc>> mergeDiscs(std::vector<Image<Disc>> images, std::size_t most) {
    std::vector<std::vector<Level>> pyramids(images.size());
    parallelFor(0, static_cast<std::int64_t>(images.size()), [&](std::int64_t i) {
        const auto n = static_cast<std::size_t>(i);
        pyramids[n] = pyramidOf(std::move(images[n]));
    });
    std::size_t count = 0;
    std::vector<float> losses;
    for (const auto& levels : pyramids) {
        for (const Square& s : levels[0].pixels()) count += s.loss >= 0 ? 1 : 0;
        for (std::size_t l = 1; l < levels.size(); ++l)
            for (const Square& s : levels[l].pixels())
                if (s.loss >= 0) losses.push_back(s.loss);
    }
    // Each square that becomes one disc takes three away, as its parts lose no more than it.
    const std::size_t needed = count > most ? (count - most + 2) / 3 : 0;
    const std::size_t taken = std::min(needed, losses.size());
    float least = -1;
    if (taken > 0) {
        const auto last = losses.begin() + static_cast<std::ptrdiff_t>(taken - 1);
        std::nth_element(losses.begin(), last, losses.end());
        least = *last;
    }
    std::vector<std::vector<Disc>> out(images.size());
    for (std::size_t i = 0; i < pyramids.size(); ++i) {
        const auto& levels = pyramids[i];
        const std::size_t top = levels.size() - 1;
        const int side = 1 << top;
        for (int y = 0; y * side < levels[0].height(); ++y)
            for (int x = 0; x * side < levels[0].width(); ++x)
                cut(levels, top, x, y, least, out[i]);
    }
    return out;
}

}  // namespace stx::splats

#include "lib/splats/merge.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "lib/base/parallel.hpp"

namespace stx::splats {
namespace {

constexpr int kLevels = 6;  ///< the largest square has 64 x 64 texels
constexpr std::int64_t kRows = 32;
/// A distance from the common plane of this share of a square's half side weighs as much as the
/// largest difference of colour.
constexpr float kPlane = 0.5f;

/// A square of discs of the level below.
struct Square {
    Disc disc;
    float loss = -1;  ///< of being one disc, never less than its parts'; below 0: cannot be
};
using Level = Image<Square>;

Square merged(const Square (&parts)[4]) {
    Square out;
    glm::vec3 u(0.0f), v(0.0f);
    for (const Square& part : parts) {
        if (part.loss < 0) return {};
        out.disc.centre += 0.25f * part.disc.centre;
        out.disc.colour += 0.25f * part.disc.colour;
        u += 0.25f * part.disc.u;
        v += 0.25f * part.disc.v;
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
    for (const Square& part : parts) {
        const glm::vec4 off = glm::abs(part.disc.colour - out.disc.colour);
        const float colour = std::max({off.x, off.y, off.z, off.w});
        const float plane =
            std::abs(glm::dot(part.disc.centre - out.disc.centre, normal)) / (kPlane * side);
        // Where the surface ends, parts are as far apart as they are far behind each other.
        const glm::vec3 apart = part.disc.centre - out.disc.centre;
        const float gap = std::max(0.0f, glm::length(apart) / side - 2.0f);
        out.loss = std::max(out.loss, part.loss + colour + plane + gap);
    }
    return out;
}

/// Squares of half the size, of parts that `partAt(x, y)` gives.
template <class PartAt>
Level halved(int width, int height, const PartAt& partAt) {
    Level to(width / 2, height / 2);
    parallelFor(0, to.height(), kRows, [&](int y) {
        for (int x = 0; x < to.width(); ++x)
            to.at(x, y) = merged({partAt(2 * x, 2 * y), partAt(2 * x + 1, 2 * y),
                                  partAt(2 * x, 2 * y + 1), partAt(2 * x + 1, 2 * y + 1)});
    });
    return to;
}

/// Squares of 2 x 2 discs, of 4 x 4, and so on. On all threads: of one image at a time they take
/// little memory.
std::vector<Level> squaresOf(const Image<Disc>& discs, PixelSpool* spool) {
    std::vector<Level> levels;
    const auto add = [&](Level level) {
        if (!level.empty()) levels.push_back(std::move(level));
        return !levels.empty() && static_cast<int>(levels.size()) < kLevels;
    };
    bool more = add(halved(discs.width(), discs.height(), [&](int x, int y) {
        if (spool && x == 0) spool->settle();
        const Disc& d = discs.at(x, y);
        return Square{d, d.colour.w > 0.0f ? 0.0f : -1.0f};
    }));
    while (more) {
        const Level& from = levels.back();
        const std::size_t before = levels.size();
        Level next = halved(from.width(), from.height(),
                            [&](int x, int y) -> const Square& { return from.at(x, y); });
        more = add(std::move(next)) && levels.size() > before;
    }
    return levels;
}

/// What is left of a square of `discs` when each that loses at most `loss` is one disc. Level 0 are
/// the discs.
void cut(const Image<Disc>& discs, const std::vector<Level>& levels, std::size_t level, int x,
         int y, float loss, std::vector<Disc>& to) {
    if (level == 0) {
        if (discs.contains(x, y) && discs.at(x, y).colour.w > 0.0f) to.push_back(discs.at(x, y));
        return;
    }
    const Level& here = levels[level - 1];
    if (here.contains(x, y)) {
        const Square& s = here.at(x, y);
        if (s.loss >= 0 && s.loss <= loss) {
            to.push_back(s.disc);
            return;
        }
    }
    // Edges that no square of this level covers have parts, too.
    for (int part = 0; part < 4; ++part)
        cut(discs, levels, level - 1, 2 * x + part % 2, 2 * y + part / 2, loss, to);
}

/// The losses of all squares that can be one disc.
Image<float> lossesOf(const std::vector<Level>& levels) {
    const auto can = [](const Square& s) { return s.loss >= 0; };
    std::ptrdiff_t count = 0;
    for (const Level& level : levels) count += std::ranges::count_if(level.pixels(), can);
    Image<float> losses(static_cast<int>(count), 1);
    float* next = losses.data();
    for (const Level& level : levels)
        for (const Square& s : level.pixels())
            if (can(s)) *next++ = s.loss;
    return losses;
}

/// The value of that rank among all, 0 being the least; none is negative. They are looked at twice:
/// floats that are not negative are in the order of their bits, of which a half is found each time.
float valueOfRank(std::span<const Image<float>> values, std::size_t rank) {
    constexpr int kHalf = 16;
    std::uint32_t found = 0;
    for (const int shift : {kHalf, 0}) {
        std::vector<std::size_t> counts(std::size_t{1} << kHalf, 0);
        for (const Image<float>& image : values) {
            for (const float value : image.pixels()) {
                const auto bits = std::bit_cast<std::uint32_t>(value);
                if (shift == kHalf || bits >> kHalf == found) ++counts[bits >> shift & 0xffffu];
            }
        }
        std::uint32_t half = 0;
        while (rank >= counts[half]) rank -= counts[half++];
        found = found << kHalf | half;
    }
    return std::bit_cast<float>(found);
}

}  // namespace

DiscMerging::DiscMerging(std::span<const Image<Disc>> images, std::size_t most, PixelSpool* spool)
    : spool_(spool) {
    std::vector<Image<float>> losses;
    std::size_t squares = 0;
    for (const Image<Disc>& image : images) {
        count_ += static_cast<std::size_t>(
            std::ranges::count_if(image.pixels(), [](const Disc& d) { return d.colour.w > 0.0f; }));
        losses.push_back(lossesOf(squaresOf(image, spool)));
        losses.back().moveTo(spool);
        squares += losses.back().count();
    }
    // Each square that becomes one disc takes three away, as its parts lose no more than it.
    const std::size_t needed = count_ > most ? (count_ - most + 2) / 3 : 0;
    const std::size_t taken = std::min(needed, squares);
    if (taken == 0) return;
    loss_ = valueOfRank(losses, taken - 1);
    for (const Image<float>& image : losses)
        count_ -= 3 * static_cast<std::size_t>(std::ranges::count_if(
                          image.pixels(), [this](float loss) { return loss <= loss_; }));
}

void DiscMerging::left(const Image<Disc>& image,
                       const std::function<void(const std::vector<Disc>&)>& each) const {
    const std::vector<Level> levels = squaresOf(image, spool_);
    const std::size_t top = levels.size();
    const int side = 1 << top;
    std::vector<Disc> row;
    for (int y = 0; y * side < image.height(); ++y) {
        if (spool_) spool_->settle();
        row.clear();
        for (int x = 0; x * side < image.width(); ++x) cut(image, levels, top, x, y, loss_, row);
        each(row);
    }
}

}  // namespace stx::splats

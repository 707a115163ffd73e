#include "lib/render/finish/fill.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "lib/base/parallel.hpp"
#include "lib/render/surface/votes.hpp"

namespace stx::surface {
namespace {

// Where no source is named the value was chosen by trial on the project's image sets and meshes.
// Shares are of q, see DepthAxis::relativeScale().

/// A pixel covered by this share or more is not worth filling.
constexpr float kClosed = 0.999f;
/// A pixel open by more than this share takes the depth of what fills it.
constexpr float kMostlyOpen = 0.5f;

// Small holes (fillUnseen).
/// How far surface is looked for in each direction, pixels.
constexpr int kReach = 12;
/// Directions that must meet surface, of eight: see enclosed().
constexpr int kLeastDirections = 6;
/// The ray is looked at from this share of q in front of the nearest hit to this share of q behind
/// the farthest, but no farther than twice its distance (half its q).
constexpr float kInFront = 0.02f, kBehind = 0.05f, kFarthestShare = 0.5f;
/// Depths that are tried on the way, and how many in a row must be hidden.
constexpr int kDepths = 48, kHiddenDepths = 2;
/// Colours of surfaces in front of the fill, by more than this share of q, weigh less by this.
constexpr float kForeground = 0.01f, kForegroundWeight = 0.1f;

// Backgrounds (fillBackground).
/// Side of the cells that are crossed in one step where they are empty, pixels.
constexpr int kCell = 32;
/// Directions that surface is looked for in.
constexpr int kRays = 32;
/// Pixels averaged where a ray meets surface, while they differ by no more than this share of q.
constexpr int kAveraged = 2;
constexpr float kSameSurface = 0.03f;
/// The farthest hits weigh most. Depths are compared over their range and this share of q, so that
/// equal depths weigh the same; the nearest keep a little weight.
constexpr float kLeastRange = 0.05f, kNearestWeight = 0.01f;

struct Hit {
    glm::vec3 colour{0.0f};
    float q = 0, distance = 0;
};

struct Fill {
    int x, y;
    glm::vec3 colour;
    float q;
};

/// Filled pixels of each row, put in at the end so that no fill feeds on another.
void putIn(OpenFrame& frame, const std::vector<std::vector<Fill>>& rows) {
    for (const auto& row : rows) {
        for (const Fill& fill : row) {
            glm::vec4& pixel = frame.albedo.at(fill.x, fill.y);
            const float open = 1.0f - pixel.a;
            pixel += glm::vec4(fill.colour * open, open);
            float& q = frame.q.at(fill.x, fill.y);
            if (!(q > 0.0f) || open > kMostlyOpen) q = fill.q;
        }
    }
}

bool closed(const OpenFrame& frame, int x, int y) {
    return frame.albedo.at(x, y).a >= kClosed && frame.q.at(x, y) > 0.0f;
}

Hit hitAt(const OpenFrame& frame, int x, int y, float distance) {
    const glm::vec4 c = frame.albedo.at(x, y);
    return {glm::vec3(c) / c.a, frame.q.at(x, y), distance};
}

constexpr std::array<std::array<int, 2>, 8> kDirections = {
    {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}}};

/// Whether an opening is small enough to be an unseen part of a surface: surface in all directions
/// but one, or in all but two opposite ones, as in the slits between a machine's cooling fins.
bool enclosed(unsigned directionsMet) {
    const unsigned open = ~directionsMet & 0xffu;
    if ((open & (open - 1)) == 0) return true;
    return open == 0x11u || open == 0x22u || open == 0x44u || open == 0x88u;
}

/// The depth of a hidden stretch of the ray through (x, y) between two depths, 0 = none.
float hiddenDepth(std::span<const LocalSource> sources, float x, float y, float qNear, float qFar) {
    int unknown = 0;
    for (int step = 0; step < kDepths; ++step) {
        const float q = qNear + (qFar - qNear) * static_cast<float>(step) / (kDepths - 1);
        bool free = false;
        for (const LocalSource& s : sources) {
            if (seesPast(s, x, y, q)) {
                free = true;
                break;
            }
        }
        unknown = free ? 0 : unknown + 1;
        if (unknown == kHiddenDepths) return q;
    }
    return 0.0f;
}

}  // namespace

void fillUnseen(OpenFrame frame, std::span<const LocalSource> sources) {
    const int width = frame.q.width(), height = frame.q.height();
    std::vector<std::vector<Fill>> rows(static_cast<std::size_t>(height));
    parallelForBlocks(0, height, 8, [&](std::int64_t from, std::int64_t to) {
        for (int y = static_cast<int>(from); y < to; ++y) {
            for (int x = 0; x < width; ++x) {
                if (frame.albedo.at(x, y).a >= kClosed) continue;
                std::array<Hit, 8> hits;
                int count = 0;
                unsigned met = 0;  // a bit for each direction
                float nearest = 0, farthest = std::numeric_limits<float>::max();
                for (std::size_t k = 0;
                     k < kDirections.size() && count + 8 - static_cast<int>(k) >= kLeastDirections;
                     ++k) {
                    for (int step = 1; step <= kReach; ++step) {
                        const int nx = x + kDirections[k][0] * step,
                                  ny = y + kDirections[k][1] * step;
                        if (!frame.q.contains(nx, ny)) break;
                        if (!closed(frame, nx, ny)) continue;
                        const float length = (k & 1) ? 1.41421356f : 1.0f;
                        hits[static_cast<std::size_t>(count)] =
                            hitAt(frame, nx, ny, length * static_cast<float>(step));
                        nearest = std::max(nearest, hits[static_cast<std::size_t>(count)].q);
                        farthest = std::min(farthest, hits[static_cast<std::size_t>(count)].q);
                        ++count;
                        met |= 1u << k;
                        break;
                    }
                }
                if (!enclosed(met)) continue;
                const float scale = frame.space.axis.relativeScale(nearest);
                const float q =
                    hiddenDepth(sources, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f,
                                nearest + kInFront * scale,
                                std::max(farthest - kBehind * scale, kFarthestShare * farthest));
                if (!(q > 0.0f)) continue;
                glm::vec3 sum(0.0f);
                float weights = 0;
                for (int k = 0; k < count; ++k) {
                    const Hit& hit = hits[static_cast<std::size_t>(k)];
                    float weight = 1.0f / (hit.distance * hit.distance);
                    if (hit.q > q + kForeground * frame.space.axis.relativeScale(q))
                        weight *= kForegroundWeight;
                    sum += weight * hit.colour;
                    weights += weight;
                }
                rows[static_cast<std::size_t>(y)].push_back({x, y, sum / weights, q});
            }
        }
    });
    putIn(frame, rows);
}

void fillBackground(OpenFrame frame) {
    const int width = frame.q.width(), height = frame.q.height();
    const int cellsX = (width + kCell - 1) / kCell, cellsY = (height + kCell - 1) / kCell;
    // Cells without any surface are crossed in one step.
    std::vector<char> occupied(static_cast<std::size_t>(cellsX) * cellsY, 0);
    bool any = false;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            if (!closed(frame, x, y)) continue;
            occupied[static_cast<std::size_t>(y / kCell) * cellsX + x / kCell] = 1;
            any = true;
        }
    }
    if (!any) return;
    std::array<glm::vec2, kRays> rays;
    for (int k = 0; k < kRays; ++k) {
        const float angle = static_cast<float>(k) * (6.2831853f / kRays);
        rays[static_cast<std::size_t>(k)] = {std::cos(angle), std::sin(angle)};
    }
    std::vector<std::vector<Fill>> rows(static_cast<std::size_t>(height));
    parallelForBlocks(0, height, 8, [&](std::int64_t from, std::int64_t to) {
        for (int y = static_cast<int>(from); y < to; ++y) {
            for (int x = 0; x < width; ++x) {
                if (frame.albedo.at(x, y).a >= kClosed) continue;
                std::array<Hit, kRays> hits;
                int count = 0;
                for (int k = 0; k < kRays; ++k) {
                    const float dx = rays[static_cast<std::size_t>(k)].x;
                    const float dy = rays[static_cast<std::size_t>(k)].y;
                    float along = 1;
                    Hit hit;
                    int averaged = 0;
                    while (averaged < kAveraged) {
                        const float px = static_cast<float>(x) + 0.5f + dx * along;
                        const float py = static_cast<float>(y) + 0.5f + dy * along;
                        if (!(px >= 0 && py >= 0 && px < static_cast<float>(width) &&
                              py < static_cast<float>(height)))
                            break;
                        const int nx = static_cast<int>(px), ny = static_cast<int>(py);
                        if (averaged == 0 &&
                            !occupied[static_cast<std::size_t>(ny / kCell) * cellsX + nx / kCell]) {
                            along += kCell / 2;
                            continue;
                        }
                        along += 1;
                        if (!closed(frame, nx, ny)) {
                            if (averaged) break;
                            continue;
                        }
                        const Hit here = hitAt(frame, nx, ny, along);
                        if (averaged == 0) {
                            hit = here;
                        } else {
                            if (std::abs(here.q - hit.q) >
                                kSameSurface * frame.space.axis.relativeScale(hit.q))
                                break;
                            hit.colour += here.colour;
                        }
                        ++averaged;
                    }
                    if (!averaged) continue;
                    hit.colour /= static_cast<float>(averaged);
                    hits[static_cast<std::size_t>(count++)] = hit;
                }
                if (!count) continue;
                float farthest = hits[0].q, nearest = hits[0].q;
                for (int k = 1; k < count; ++k) {
                    farthest = std::min(farthest, hits[static_cast<std::size_t>(k)].q);
                    nearest = std::max(nearest, hits[static_cast<std::size_t>(k)].q);
                }
                const float range =
                    nearest - farthest + kLeastRange * frame.space.axis.relativeScale(nearest);
                glm::vec3 sum(0.0f);
                float weights = 0, depth = 0;
                for (int k = 0; k < count; ++k) {
                    const Hit& hit = hits[static_cast<std::size_t>(k)];
                    const float behind = (nearest - hit.q) / range + kNearestWeight;
                    const float weight = behind * behind / (hit.distance * std::sqrt(hit.distance));
                    sum += weight * hit.colour;
                    depth += weight * hit.q;
                    weights += weight;
                }
                rows[static_cast<std::size_t>(y)].push_back({x, y, sum / weights, depth / weights});
            }
        }
    });
    putIn(frame, rows);
}

}  // namespace stx::surface

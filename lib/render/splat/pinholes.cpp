#include "lib/render/splat/pinholes.hpp"

#include <vector>

#include "lib/base/parallel.hpp"
#include "lib/geometry/depth_code.hpp"

namespace stx {

namespace {

// Chosen by trial on the project's image sets and meshes.
/// Neighbours with a depth that close a pixel, of eight; among pruned views, and how often then.
constexpr int kEnclosing = 7, kEnclosingPruned = 5, kRoundsPruned = 2;
/// Neighbours nearer than this share of the farthest are on a surface in front.
constexpr float kSameDepth = 0.97f;
/// A pixel with less coverage than the first among eight with that of the second is a speck.
constexpr float kSpeck = 0.75f, kFull = 0.999f;

/// Whether a pixel shows a faint point of a rim, alone among pixels that are covered in full.
bool isSpeck(const Frame& frame, int x, int y) {
    if (!(frame.colour.at(x, y).a < kSpeck)) return false;
    for (int j = y - 1; j <= y + 1; ++j)
        for (int i = x - 1; i <= x + 1; ++i)
            if ((i != x || j != y) && !(frame.colour.at(i, j).a >= kFull)) return false;
    return true;
}

struct Closed {
    int x = 0, y = 0;
    glm::vec4 colour{0.0f}, albedo{0.0f};
    glm::vec3 normal{0.0f};
    float depth = 0;
};

/// Adds what closes a pixel, if at least `enclosing` of its eight neighbours have a depth.
void addClosed(const Frame& frame, int x, int y, int enclosing, std::vector<Closed>& out) {
    int covered = 0;
    float farthest = 0;
    for (int j = y - 1; j <= y + 1; ++j) {
        for (int i = x - 1; i <= x + 1; ++i) {
            if ((i == x && j == y) || !hasPoint(frame.depth.at(i, j))) continue;
            ++covered;
            farthest = std::max(farthest, frame.depth.at(i, j));
        }
    }
    if (covered < enclosing) return;
    // What opens between two surfaces belongs to the one behind.
    Closed c{x, y, {}, {}, {}, 0};
    float n = 0;
    for (int j = y - 1; j <= y + 1; ++j) {
        for (int i = x - 1; i <= x + 1; ++i) {
            const float depth = frame.depth.at(i, j);
            if ((i == x && j == y) || !hasPoint(depth) || depth < kSameDepth * farthest) continue;
            n += 1;
            c.depth += depth;
            c.colour += frame.colour.at(i, j);
            if (frame.normal.empty()) continue;
            c.albedo += frame.albedo.at(i, j);
            c.normal += frame.normal.at(i, j);
        }
    }
    c.depth /= n;
    c.colour /= n;
    c.albedo /= n;
    if (const float length = glm::length(c.normal); length > 0) c.normal /= length;
    out.push_back(c);
}

/// Closes pixels of whose eight neighbours at least `enclosing` have a depth, and specks.
void closeEnclosed(Frame& frame, int enclosing, const Extent& part) {
    constexpr int kRowsPerTask = 32;
    const int width = frame.depth.width(), height = frame.depth.height();
    const int tasks = (part.y1 - part.y0 + kRowsPerTask - 1) / kRowsPerTask;
    std::vector<std::vector<Closed>> closed(tasks);
    parallelFor(0, tasks, [&](std::int64_t t) {
        const int first = part.y0 + static_cast<int>(t) * kRowsPerTask;
        const int from = std::max(1, first);
        const int to = std::min({height - 1, part.y1, first + kRowsPerTask});
        for (int y = from; y < to; ++y) {
            const auto row = frame.depth.row(y);
            const glm::vec4* colours = frame.colour.row(y).data();
            const int last = std::min(width - 1, part.x1);
            constexpr int kAtOnce = 16;
            for (int begin = std::max(1, part.x0); begin < last; begin += kAtOnce) {
                const int end = std::min(last, begin + kAtOnce);
                // Most are full among full ones, or empty among empty ones.
                int points = 0, faint = 0;
                for (int x = begin - 1; x <= end; ++x) points += hasPoint(row[x]) ? 1 : 0;
                if (points == 0) continue;
                for (int x = begin; x < end; ++x) faint += colours[x].a < kSpeck ? 1 : 0;
                if (points == end - begin + 2 && faint == 0) continue;
                for (int x = begin; x < end; ++x) {
                    if (hasPoint(row[x]) ? isSpeck(frame, x, y)
                                         : hasPoint(row[x - 1]) || hasPoint(row[x + 1]))
                        addClosed(frame, x, y, enclosing, closed[t]);
                }
            }
        }
    });
    // Only now, so that one closed pixel does not enclose the next.
    for (const auto& list : closed) {
        for (const auto& c : list) {
            frame.depth.at(c.x, c.y) = c.depth;
            frame.colour.at(c.x, c.y) = c.colour;
            if (frame.normal.empty()) continue;
            frame.albedo.at(c.x, c.y) = c.albedo;
            frame.normal.at(c.x, c.y) = c.normal;
        }
    }
}

}  // namespace

void closePinholes(Frame& frame, bool pruned, const Extent& drawn) {
    // What closes lies among what was drawn.
    const Extent part = drawn.grown(1, frame.depth.width(), frame.depth.height());
    closeEnclosed(frame, kEnclosing, part);
    if (!pruned) return;
    for (int round = 0; round < kRoundsPruned; ++round)
        closeEnclosed(frame, kEnclosingPruned, part);
}

}  // namespace stx

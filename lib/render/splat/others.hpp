#pragma once

#include <algorithm>
#include <cstdint>

#include "lib/render/scene/page_set.hpp"
#include "lib/render/splat/block_task.hpp"

namespace stx::splat {

/// Finds for each quarter of each block without edges which other views show all of it, inside of a
/// surface (BlockInfo::shownBy, PreparedRectangle::others). Costs nothing where all views look from
/// about the same place. `prepared` must hold the slopes of `set`.
void findOthers(const PageSet& set, PreparedPages& prepared);

/// The quarters of a block that a frame needs, a bit for each: not those that other views show from
/// so much nearer to where the novel camera looks from that the block's own points would hardly
/// count. `quality` is the weight of its own view by that angle, BlockTask::quality. What is left
/// out depends on no other block, and the views that count most are never left out: nothing opens.
[[nodiscard]] std::uint8_t neededQuarters(const PreparedRectangle& rectangle,
                                          const BlockInfo& block, const Camera& novel,
                                          float quality);

/// Weight of a view by the cosine of the angle between it and the novel one, seen from a point.
template <class T>
[[nodiscard]] T qualityOf(T cosine) {
    // A view that looks from the other side still counts a little.
    constexpr T kLeast = T(0.01);
    const T angle = cosine > 0 ? cosine : T(0);
    return kLeast + angle * angle * angle * angle;
}

/// Calls call(u0, v0, u1, v1) for the parts of a block that are to be drawn, at most two: pixels,
/// u1 and v1 one past the last.
template <class F>
void forNeeded(const BlockTask& task, const F& call) {
    const int middleU = std::min(task.u0 + kBlock / 2, int{task.u1});
    const int middleV = std::min(task.v0 + kBlock / 2, int{task.v1});
    const auto rows = [&](unsigned halves, int v0, int v1) {
        if (halves && v0 < v1)
            call(halves & 1 ? task.u0 : middleU, v0, halves & 2 ? task.u1 : middleU, v1);
    };
    const unsigned upper = task.quarters & 3u, lower = task.quarters >> 2;
    if (upper == lower) return rows(upper, task.v0, task.v1);
    rows(upper, task.v0, middleV);
    rows(lower, middleV, task.v1);
}

}  // namespace stx::splat

#pragma once

#include <algorithm>
#include <cstdint>

#include "lib/render/scene/page_set.hpp"
#include "lib/render/splat/block_task.hpp"

namespace stx::splat {

/// Finds, for each quarter of each block that has no edges, the other views that show all of it
/// away from their own edges (BlockInfo::shownBy, PreparedRectangle::others). It does nothing where
/// all views look from about the same place. `prepared` must hold the slopes of `set`.
void findOthers(const PageSet& set, PreparedPages& prepared);

/// The quarters of a block that a frame has to draw, one bit each. A quarter is left out when other
/// views show all of it, from directions so much nearer to the novel camera's that the points of
/// this view would have next to no weight in the blend. `quality` is the weight of the block's own
/// view (BlockTask::quality). Each quarter is decided by itself, and the views of the most weight
/// always draw theirs, so no hole can open.
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

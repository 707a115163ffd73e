#pragma once

#include <gtest/gtest.h>

#include "lib/render/surface/cpu/cpu_surface.hpp"

namespace stx {

inline Frame draw(const Bundle& bundle, const Camera& camera) {
    Job job;
    auto frame = makeCpuSurfaceRenderer(bundle, {}, job)->render(camera);
    EXPECT_TRUE(frame);
    return std::move(*frame);
}

/// Pixels inside the object that pruning opened: those that `before` shows opaque, as the eight
/// around, and `truth` (when given) as well, and that `after` shows less than half.
inline int holes(const Frame& before, const Frame& after, const Frame* truth = nullptr) {
    int n = 0;
    for (int y = 1; y + 1 < before.colour.height(); ++y) {
        for (int x = 1; x + 1 < before.colour.width(); ++x) {
            bool inside = true;
            for (int k = 0; k < 9 && inside; ++k) {
                const int nx = x + k % 3 - 1, ny = y + k / 3 - 1;
                inside = before.colour.at(nx, ny).a > 0.99f &&
                         (!truth || truth->colour.at(nx, ny).a > 0.99f);
            }
            n += inside && after.colour.at(x, y).a < 0.5f;
        }
    }
    return n;
}

}  // namespace stx

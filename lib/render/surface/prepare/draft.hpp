#pragma once

#include <cstdint>

#include "lib/base/image.hpp"
#include "lib/render/surface/prepare/source.hpp"

namespace stx::surface {

/// A view while it is prepared: its pixels side by side, wherever they are kept.
struct Draft {
    Image<float> q;               ///< see PreparedPage
    Image<std::uint8_t> info;     ///< see PreparedPage
    Image<std::uint8_t> covered;  ///< 1 = full alpha
    Image<std::uint8_t> levels;   ///< see PreparedPage; empty without alpha

    [[nodiscard]] bool linkRight(int x, int y) const { return info.at(x, y) & Info::kLinkRight; }
    [[nodiscard]] bool linkDown(int x, int y) const { return info.at(x, y) & Info::kLinkDown; }
    [[nodiscard]] int edgeDistance(int x, int y) const { return info.at(x, y) >> 4; }
    [[nodiscard]] bool pruned(int x, int y) const { return q.at(x, y) < 0.0f; }
};

/// Finds the planar pieces and the cells of a source whose links and distances to edges are known:
/// its leaves, what its blocks hold, its noise and flatness.
void findLeaves(Source& source, const Draft& draft);

}  // namespace stx::surface

#pragma once

#include <cstring>

#include "lib/model/reference_view.hpp"

namespace stx {

/// Whether two views have the same images, bit for bit: colour, depth, normals, splats and
/// materials. Cameras and planes are not looked at.
[[nodiscard]] inline bool samePictures(const ReferenceView& a, const ReferenceView& b) {
    const auto same = [](const auto& x, const auto& y) {
        return x.size() == y.size() &&
               (x.empty() || std::memcmp(x.data(), y.data(), x.count() * sizeof(*x.data())) == 0);
    };
    if (a.pruned != b.pruned || a.noDepth != b.noDepth || a.refined != b.refined ||
        a.texture.isLinear() != b.texture.isLinear())
        return false;
    const bool colour = a.texture.isLinear() ? same(*a.texture.rgbaFloat(), *b.texture.rgbaFloat())
                                             : same(*a.texture.rgba8(), *b.texture.rgba8());
    return colour && same(a.depth, b.depth) && same(a.normal, b.normal) &&
           same(a.splatU, b.splatU) && same(a.splatV, b.splatV) &&
           same(a.metallicRoughness, b.metallicRoughness) && same(a.emissive, b.emissive);
}

}  // namespace stx

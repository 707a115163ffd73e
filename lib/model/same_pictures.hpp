#pragma once

#include <array>
#include <cstddef>
#include <cstring>
#include <functional>
#include <span>
#include <string_view>

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

/// A hash of bytes. That of other bytes is another, but for about one in 2^64.
[[nodiscard]] inline std::size_t hashOf(std::span<const std::byte> bytes) {
    return std::hash<std::string_view>()(
        {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

/// What is kept of a view to know its images again when they are not in memory any more: equal
/// where samePictures() says so of views of one size. Of the pixels it has their hashes, hashOf().
struct PicturesKey {
    bool pruned = false, linear = false;
    NoDepth noDepth = NoDepth::empty;
    Refined refined;
    /// Texture, depth, normal, splatU, splatV, metallicRoughness, emissive.
    std::array<std::size_t, 7> hashes{};
    bool operator==(const PicturesKey&) const = default;

    [[nodiscard]] static PicturesKey of(const ReferenceView& view) {
        const auto hash = [](const auto& image) { return hashOf(std::as_bytes(image.pixels())); };
        PicturesKey key{view.pruned, view.texture.isLinear(), view.noDepth, view.refined, {}};
        key.hashes = {key.linear ? hash(*view.texture.rgbaFloat()) : hash(*view.texture.rgba8()),
                      hash(view.depth),
                      hash(view.normal),
                      hash(view.splatU),
                      hash(view.splatV),
                      hash(view.metallicRoughness),
                      hash(view.emissive)};
        return key;
    }
};

}  // namespace stx

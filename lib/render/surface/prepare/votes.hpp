#pragma once

#include <span>

#include "lib/render/surface/prepare/source.hpp"
#include "lib/render/surface/prepare/structs.hpp"

namespace stx::surface {

/// A source as one tile uses it.
struct LocalSource {
    const Source* source = nullptr;
    Warp sourceFromPixel;             ///< from frame pixel positions
    const float* samples = nullptr;   ///< its own surface in this tile; null = it has none here
    glm::mat4 frameFromSource{1.0f};  ///< the inverse of sourceFromPixel
};

/// The processor's side of the code it shares with the shaders.
namespace shared {
using namespace glsl;

/// The pixels of sources as shaders/shared/surface_votes.glsl asks for them: the one place that
/// knows where they are kept.
struct SourcePixels {
    using Axis = const DepthAxis&;
    /// A group of pixels that are kept together, from pixel (x, y) of the source on.
    struct Place {
        surface::Place kept;
        int x, y;
    };

    /// Of 4x4 pixels, with what can be read of them: from the first two of `bounds` to the others.
    struct Taps : Place {
        ivec4 bounds;
    };

    std::span<const LocalSource> locals;

    [[nodiscard]] const Source& at(int s) const {
        return *locals[static_cast<std::size_t>(s)].source;
    }
    [[nodiscard]] vec4 warp(int s, float x, float y, float q) const {
        return locals[static_cast<std::size_t>(s)].sourceFromPixel.homogeneous(x, y, q);
    }
    [[nodiscard]] vec4 warpChange(int s, const vec4& d) const {
        return locals[static_cast<std::size_t>(s)].sourceFromPixel.ofChange(d);
    }
    [[nodiscard]] vec4 unwarpColumn(int s, int column) const {
        return locals[static_cast<std::size_t>(s)].frameFromSource[column];
    }
    [[nodiscard]] ivec2 sizeOf(int s) const { return {at(s).width, at(s).height}; }
    [[nodiscard]] bool hasAlpha(int s) const { return at(s).hasAlpha; }
    [[nodiscard]] float freeLevelOf(int s) const { return at(s).freeLevel; }
    [[nodiscard]] Axis axisOf(int s) const { return at(s).space.axis; }
    [[nodiscard]] float coarseOf(int s) const {
        return static_cast<float>(at(s).space.axis.coarse);
    }
    [[nodiscard]] float texelAt(int s, float q) const { return at(s).space.axis.texel(q); }
    [[nodiscard]] float nearestOf(int s) const { return at(s).space.axis.nearest(); }
    [[nodiscard]] float clearlyBehindOf(int s) const { return kClearlyBehind + at(s).noise; }
    [[nodiscard]] float besideOf(int s) const { return at(s).beside; }
    [[nodiscard]] float stepOf(int s) const { return at(s).step; }
    [[nodiscard]] Place placeOf(int s, ivec2 corner) const {
        return {at(s).placeOf(corner.x, corner.y), corner.x, corner.y};
    }
    [[nodiscard]] Taps tapPlaceOf(int s, ivec2 corner) const {
        const TapPlace taps = at(s).tapPlaceOf(corner.x, corner.y);
        return {{taps, corner.x, corner.y}, {taps.x0, taps.y0, taps.x1, taps.y1}};
    }
    [[nodiscard]] static bool canRead(const Taps& p, ivec2 at) {
        return at.x >= p.bounds.x && at.y >= p.bounds.y && at.x < p.bounds.z && at.y < p.bounds.w;
    }
    [[nodiscard]] float qAt(int s, const Place& p, int i, int j) const {
        return at(s).qAt(p.kept, i, j);
    }
    [[nodiscard]] vec2 gradientAt(int s, const Place& p, int i, int j) const {
        return at(s).gradientAt(p.kept, i, j, p.x + i, p.y + j);
    }
    [[nodiscard]] float alphaOf(int s, const Place& p, int i, int j) const {
        return at(s).alphaAt(p.kept, i, j);
    }
    [[nodiscard]] float levelOf(int s, const Place& p, int i, int j) const {
        return at(s).levelAt(p.kept, i, j);
    }
    [[nodiscard]] float edgeDistanceOf(int s, const Place& p, int i, int j) const {
        return static_cast<float>(at(s).infoAt(p.kept, i, j) >> 4);
    }
    [[nodiscard]] float ownColourOf(int s, const Place& p, int i, int j) const {
        return static_cast<float>(
            Info::ownColour(static_cast<std::uint8_t>(at(s).infoAt(p.kept, i, j))));
    }
    [[nodiscard]] bool depthMayBeUnknown(int s) const { return at(s).view->depthMayBeUnknown(); }
    [[nodiscard]] bool mixesColours(int s, const Place& p, int i, int j) const {
        return Info::mixesColours(static_cast<std::uint8_t>(at(s).infoAt(p.kept, i, j)));
    }
    [[nodiscard]] static float relativeScale(Axis axis, float q) { return axis.relativeScale(q); }
    [[nodiscard]] static float qPerUnit(Axis axis, float q) { return axis.qPerUnit(q); }
};

/// Free-space votes: voteOf(source, x, y, q) is kNoVote, kHalfVote, kWholeVote or kTwoVotes.
struct Votes : SourcePixels {
#include "shaders/shared/surface_votes.glsl"
};

}  // namespace shared

/// Whether a source sees past the point at (x, y, q) of the novel view.
[[nodiscard]] inline bool seesPast(const LocalSource& source, float x, float y, float q) {
    return shared::Votes{{{&source, 1}}}.voteOf(0, x, y, q) != shared::Votes::kNoVote;
}

}  // namespace stx::surface

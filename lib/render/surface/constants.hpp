#pragma once

/// The numbers that surface mode is tuned with: the processor's passes and, by way of
/// surfaceHeader() in lib/render/surface/gpu/surface_shaders.hpp, the shaders take them from here.
/// Depths are in q (see DepthAxis), shares of q or of 1.

namespace stx::surface {

// Drawing the sources (surface_raster.cpp).
/// Room that neighbouring pieces overlap by, in samples, so that rounding opens no crack.
inline constexpr float kCrack = 0.004f;
/// Leaves stand on fitted planes, a little beside their neighbours' corners: pixels.
inline constexpr float kLeafGrow = 0.06f;
/// Half the side of an extension, pixels: beside background, and at inner edges.
inline constexpr float kHalfBesideBackground = 0.6f, kHalfInside = 0.5f;
/// The corners of an extension stray from its pixel's q by no more.
inline constexpr float kExtensionReach = 0.02f;

// Fusing them (surface_fuse.cpp, surface_opinion.hpp).
/// Surfaces closer than this share of their depth are one.
inline constexpr float kSame = 0.002f;
/// Samples of one pixel are one piece until q jumps by more.
inline constexpr float kJump = 0.0015f;
/// Samples of one source in a pixel are one surface within this.
inline constexpr float kOneSurface = 0.01f;
/// Neighbouring samples of one source are linked within this.
inline constexpr float kLinkedSamples = 0.03f;
/// What an extension counts beside a mesh.
inline constexpr float kExtensionWeight = 0.01f;
/// Bilinear alpha below which a point is outside the object. Points tangent to a silhouette sit at
/// one half, so this is clearly less. Among pruned sources often only one is left to show a piece
/// of surface, and none agrees with it where it touches another's silhouette: less still.
inline constexpr float kFreeAlpha = 0.45f, kFreeAlphaPruned = 0.36f;
/// A point this share of its depth in front of a surface is in front of it.
inline constexpr float kClearlyBehind = 0.0002f;
/// And this share of the change of q over a pixel more, where the surface is steep.
inline constexpr float kSlopeDoubt = 0.0625f;

// Shading the pieces (surface_shade.cpp).
/// Views weigh exp(-kAngleFalloff * angle).
inline constexpr float kAngleFalloff = 3.0f;
/// Pixels this far from an edge count in full, those on it kEdgeWeight.
inline constexpr float kEdgeFade = 3.0f, kEdgeWeight = 0.01f;
/// A sample covers its own pixel, so a coarse source spreads by this share of its Jacobian.
inline constexpr float kOwn = 0.15f;
/// A tap is on the surface of the piece within this share of q, and this share of the slope, which
/// counts up to kSteepestTap; predictions go no further than kFarthestTap.
inline constexpr float kOnSurface = 0.003f, kOnSlope = 0.5f;
inline constexpr float kSteepestTap = 0.02f, kFarthestTap = 0.04f;

}  // namespace stx::surface

#pragma once

/// The numbers that splat mode is tuned with: the processor's kernels and, by way of
/// splatConstants() in lib/render/splat/gpu/splat_shaders.hpp, the shaders take them from here.

namespace stx::splat {

/// Nearer than this the projection means nothing.
inline constexpr float kNearest = 1e-12f;
/// A splat closes its gaps within 2x2 pixels while no point of the surface is farther from a sample
/// than this, squared.
inline constexpr float kSmallCover2 = 0.9f;
/// Sparse samples weigh less than dense ones, down to this share.
inline constexpr float kLeastDensity = 1e-3f;
/// Inside its splat a point's colour goes on as its neighbours' does, by this share of the
/// gradient. Where samples are so dense that their mean matters more this fades out: all at twice
/// kFadeTo output pixels per source pixel, nothing at kFadeTo.
inline constexpr float kGradient = 0.75f, kFadeTo = 0.3f;
/// Half width of the Gaussian in sample spacings, and of the low-pass filter in pixels.
inline constexpr float kSigmaSource = 0.5f, kSigmaPixel = 0.3f;
/// Where a large splat ends, and where it stops to hide, in squared standard deviations. The
/// lattice closes at half a diagonal: 0.5 / kSigmaSource^2 = 2.
inline constexpr float kReach2 = 5.0f, kCore2 = 2.1f;
/// None is larger, in pixels from its centre: a point almost at the viewpoint would fill the frame.
inline constexpr float kLargest = 256.0f;
/// Steeper planes (relative depth per pixel) are nearly edge-on and would run away.
inline constexpr float kSteepestPlane = 0.05f;
/// Where a surface ends: the share of the squared radius that hides; beside any edge: of the
/// weight.
inline constexpr float kRimCore2 = 0.5f, kEdgeQuality = 0.05f;

}  // namespace stx::splat

// The numbers that splat mode is tuned with: C++ has them by lib/render/splat/constants.hpp. Where no
// source is named the value was chosen by measurement on the image sets and meshes of tests/bench/pictures.md.

// Nearer than this the projection means nothing.
CONSTANT float kNearest = 1e-12f;
// Points with this alpha or more, half of a pixel, hide what is behind them. Those of less belong to a
// silhouette: they lend colour but hide nothing, unless they are glass (splat::Slope). No code of 8 bits is equal to it, but floats are.
CONSTANT float kHides = 0.5f;
// Where no such point is, colours of this mean alpha or more are of the skirts of such points. It is a code of 8 bits less,
// by which sums of codes may be off.
CONSTANT float kSkirts = kHides - 1.0f / 255.0f;
// A splat closes its gaps within 2x2 pixels while no point of the surface is farther from a sample
// than this, squared.
CONSTANT float kSmallCover2 = 0.9f;
// Sparse samples weigh less than dense ones, down to this share.
CONSTANT float kLeastDensity = 1e-3f;
// Inside its splat a point's colour goes on as its neighbours' does, by this share of the
// gradient. Where samples are so dense that their mean matters more this fades out: all at twice
// kFadeTo output pixels per source pixel, nothing at kFadeTo.
CONSTANT float kGradient = 0.75f, kFadeTo = 0.3f;
// Half width of the Gaussian in sample spacings, and of the low-pass filter in pixels.
CONSTANT float kSigmaSource = 0.5f, kSigmaPixel = 0.3f;
// Where a large splat ends, and where it stops to hide, in squared standard deviations. The
// lattice closes at half a diagonal: 0.5 / kSigmaSource^2 = 2.
CONSTANT float kReach2 = 5.0f, kCore2 = 2.1f;
// It is drawn up to here along either axis: all that hides, and of the rest what weighs a ninth or more.
CONSTANT float kDrawn2 = 2.6f;
// None is larger in perspective, in pixels from its centre, or as a share of the picture's longer side where
// that is more: a point almost at the viewpoint would fill the frame. The share is that of 256 pixels in
// pictures of 512, where it was chosen. Orthographic pictures have no such points.
CONSTANT float kLargest = 256.0f, kLargestShare = 0.5f;
// Steeper planes (relative depth per pixel) are nearly edge-on and would run away.
CONSTANT float kSteepestPlane = 0.05f;
// Where a surface ends: the share of the squared radius that hides; beside any edge: of the
// weight.
CONSTANT float kRimCore2 = 0.5f, kEdgeQuality = 0.05f;

// The numbers that surface mode is tuned with: C++ has them by lib/render/surface/prepare/constants.hpp.
// Depths are in q (see DepthAxis), shares of q or of 1. Where no source is named the value was
// chosen by measurement on the image sets and meshes of tests/bench/pictures.md.

// Side of the tiles that a frame is drawn in, pixels.
CONSTANT int kTile = 32;
// Side of the blocks that sources are prepared in, pixels.
CONSTANT int kSourceBlock = 16;
// Instead of a slot: the source has no samples in the tile.
CONSTANT uint kNoSlot = 0xffffffffu;
// Threads of a group that shade pieces.
CONSTANT uint kShadeGroup = 128u;

// Drawing the sources.
// Room that neighbouring pieces overlap by, in samples, so that rounding opens no crack.
CONSTANT float kCrack = 0.004f;
// Quads of a source that are drawn as one plane (leaves) do not quite meet the corners of their neighbours:
// each is drawn larger by this to either side, pixels of the source. It is less than the parallax by which
// a plane may be off (kPlanarPixels, 0.08).
CONSTANT float kLeafGrow = 0.06f;
// What reaches behind the camera is cut at this share of the distance of its farthest corner. Sums of floats of
// what is cut nearer are off: at 1/10000 a percent of a picture of 165 degrees has a wrong depth, at 1/64 none.
CONSTANT float kNearestShare = 0.015625f;
// An extension is a square around a pixel at an edge, which the source's mesh of pixel centres covers by half
// only. Half its side, pixels: that half pixel at edges inside of the object; beside background a little more,
// since alpha ends the surface there.
CONSTANT float kHalfBesideBackground = 0.6f, kHalfInside = 0.5f;
// The q of an extension's corners differs from that of its pixel by at most this share.
CONSTANT float kExtensionReach = 0.02f;
// An extension beside background is drawn over what its source shows behind it (by kLinkedSamples), so that faces
// that views see one by one meet at their edge. Not where its q changes by this share over its half side: there
// what turns away ends sooner. Of 121 random cases 0.002, 0.006 and 0.02 raise the mean by 0.03, 0.04 and 0.04 dB,
// the last with a torus 0.9 dB worse; over all inner edges, too, spheres-miv loses 0.3 dB: of these only rims of a
// view that is alone do (rims.hpp).
CONSTANT float kExtensionCovers = 0.006f;

// Fusing them.
// Surfaces closer than this share of their depth are one.
CONSTANT float kSame = 0.002f;
// Samples of one pixel are one piece until q jumps by more.
CONSTANT float kJump = 0.0015f;
// The slope of a piece is fitted to its samples when it has as many.
CONSTANT int kFittedSamples = 6;
// Samples of one source in a pixel are one surface within this.
CONSTANT float kOneSurface = 0.01f;
// Neighbouring samples of one source are linked within this.
CONSTANT float kLinkedSamples = 0.03f;
// Weight of an extension beside a mesh in the mean depth: next to none, so that it decides only where no
// source has a mesh.
CONSTANT float kExtensionWeight = 0.01f;
// Outline level below which a point is outside the object. Points tangent to a silhouette have one
// half, and a threshold of one half or more removes them; this is clearly less. Among pruned
// sources often only one is left to show a piece of surface, and no other agrees with it where it
// touches another's silhouette: less still (the largest value at which spot, Fox, CesiumMilkTruck
// and 2CylinderEngine open at no pixel).
CONSTANT float kFreeLevel = 0.4625f, kFreeLevelPruned = 0.36f;
// Alpha from which on a pixel is covered in full, rounding apart.
CONSTANT float kSolidAlpha = 0.99f;
// Distances from edges are counted up to this, pixels.
CONSTANT int kFarFromEdge = 4;
// A surface is seen edge on by a source that has no more than this share of the area for it that the source
// has that shows it. Background must be there so many of its pixels behind that surface, too.
CONSTANT float kEdgeOn = 0.05f, kBehindTexel = 0.25f;
// What its source measured, instead of continuing it by an extension, is seen edge on by whoever has no more than
// that share of the area of the surface itself, since its source may see it as steeply. And background must be this far
// behind: alpha of 4x4 samples tells outlines along rows and columns to an eighth of a pixel only. With 1 pixel a torus of
// tests/sweep rises from 26.9 to 48.1 dB (with 0.5 to 35.4), the mean of 120 random cases changes by less than 0.01.
CONSTANT float kBehindMeasured = 1.0f;
// What a coarse source measured is seen at a grazing angle up to kEdgeOn times what its pixels are in parts of kFinePixel. All
// of that lies close to outlines, which pixels tell to a tenth: background must be that far behind it. Of 155 random cases
// (seed 30111) 0.1 raises three by 0.06, 0.16 and 2.90 dB and lowers one by more than 0.05, by 0.08 (with 1 pixel five, by up
// to 0.44; with 0.05 that of 2.90 rises by 1.4).
CONSTANT float kBehindGrazing = 0.1f;
// And so many standard deviations of that source's noise, which tilts its pixels by as much, too. Of noisy sets 1
// and 2 are the same to 0.1 dB (oak tree with noise of 0.5 %: 28.84 and 28.69); a thin plate 23.5 -> 32.6 dB.
CONSTANT float kBehindNoises = 1.0f;
// A source that sees a surface this many times as large as another knows better where it is. Of 121 random cases
// 1.0, 1.5 and 2.0 raise the mean by 0.115, 0.120 and 0.106 dB; a truck loses 0.09, 0.08 and 0.01.
// Extensions of coarse sources stick out farther: against these it is this divided by what their pixels are in parts of
// kFinePixel, and at least 1. Of 222 random cases that raises eight by 0.3 to 13 dB and lowers four by 0.3 to 1.2.
CONSTANT float kSeesBetter = 2.0f;
// A point this share of its depth in front of a surface is in front of it.
CONSTANT float kClearlyBehind = 0.0002f;
// On steep surfaces that margin grows by this share of the change of q over a pixel.
CONSTANT float kSlopeDoubt = 0.0625f;
// Votes that reject a sample, beside one for each other source that shows it: one where it is near an
// edge of its source, else two.
CONSTANT int kVotesNearEdge = 1, kVotesElsewhere = 2;
// Flags in the lowest bits of a sample's q, where they do not matter to its value: beyond the
// source's own mesh; from within two pixels of an edge.
CONSTANT uint kExtensionBit = 1u, kNearEdgeBit = 2u, kSampleFlags = 3u;
// Beside them, of polygons: they are drawn over what is behind them, and not kept.
CONSTANT uint kCoversBit = 4u;
// And they are rims (rims.hpp): what is behind them by this share is another surface, since pixels of one surface
// are linked up to 0.005. 0.03 (kLinkedSamples), 0.015, 0.006 and 0.003 give 30.95, 31.14, 31.40 and 31.40 dB of Laundry
// and 34.08, 34.04, 34.03 and 34.03 of Dolls; Books, Cones and Teddy stay.
CONSTANT uint kRimBit = 8u;
CONSTANT float kBehindRim = 0.006f;
// In the mean of what all sources of a tile show and what the first of them do, the first answer counts this
// much. 0.5, 0.6 and 0.7: oak tree 32.13, 32.17 and 32.16 dB (31.91 without the mean), a truck 44.20, 44.22 and 44.24
// (44.27); of 233 random cases 0.5 leaves 4 more than 0.3 dB below `normal`, 0.65 leaves 8, all sources alone 13.
CONSTANT float kAllShare = 0.6f;
// Sources that one tile is built from, at most: the bits of a piece's `seenBy`.
CONSTANT int kMostTileSources = 32;
// Of them, so many are kept for sources of places that the others do not show: in 540 cases of tests/sweep
// such tiles asked for up to 6.
CONSTANT int kSourcesOfPlaces = 8;

// Shading the pieces.
// Views weigh exp(-kAngleFalloff * angle).
CONSTANT float kAngleFalloff = 3.0f;
// Views that a piece takes colours from weigh less, the nearer their weight is to that of the first
// that it leaves out, so that they fade when views take each other's place; equal ones keep this share.
CONSTANT float kLeastKeptWeight = 0.02f;
// Views weigh by the root of the area that they show of a piece's plane, and never less than that
// of this area: the plane of a few samples on an edge may be turned away from every view that shows them.
CONSTANT float kLeastArea = 1e-16f;
// Pixels this far from an edge count in full, those on it and on creases kEdgeWeight, unless
// views disagree (ShadeSettings::edgeWeight).
CONSTANT float kEdgeFade = 3.0f, kEdgeWeight = 0.05f;
// Near edges, a tap on an edge inside the object or on a crease mixes the colours of two surfaces: where its pixel is n
// pixels of the frame wide, it counts 1/n of the taps beside it, and at least this share; so little in pruned views and
// others with unknown depth, of which few others outweigh it. With kSpreadRidge two pruned rooms rise from 38.9 and 43.6
// to 48.9 and 52.8 dB. In other views 1/n raises 24 of 160 random cases by up to 0.33 dB and lowers two by 0.05; 2/n half
// as much; this share in all takes up to 0.37 dB from those with n below 2, and 0.02 from spheres-miv at `best`.
CONSTANT float kMixedTap = 0.2f;
// Where taps lie far apart in the frame, what holds the quadratic terms down (ShadeSettings::ridge) grows with the
// square of how far, by this share: else one tap that is off bends the colours between the others. 0.2 raises the mean of 177
// random cases by 0.10 dB, of those with texels of more than 4 pixels by 0.31; with kMixedTap 0.1, 0.2 and 0.5 raise it by
// 0.132, 0.136 and 0.135; of 44 cases 4 and 20 cost fine textures 0.1 and 0.2.
CONSTANT float kSpreadRidge = 0.2f;
// Taps farther than kNarrowReach pixels from the position in a source count nothing where no step of a
// pixel in the frame moves that position by more than the root of kNarrowStep pixels along either axis: the
// kernel has fallen to 1/400 there.
CONSTANT float kNarrowStep = 1.3f, kNarrowReach = 1.5f;
// A source gives colours up to so many pixels beyond its picture, where the same taps are nearest: what it shows goes on
// there by kHalfBesideBackground from the middles of its last pixels, and nobody else may see it.
CONSTANT float kBesidePicture = 0.5f;
// A sample covers its own pixel, so a source as fine as the frame spreads by this share of its Jacobian,
// a coarser one by more (metricOf).
CONSTANT float kOwn = 0.15f;
// A tap is on the surface of the piece within this share of q, and this share of the slope, which
// counts up to kSteepestTap; predictions go no further than kFarthestTap.
CONSTANT float kOnSurface = 0.003f, kOnSlope = 0.5f;
CONSTANT float kSteepestTap = 0.02f, kFarthestTap = 0.04f;

// Adding up the pieces of a pixel.
// The depth of a pixel is that of the piece with the largest share of it, among equal ones of that nearest to its
// centre: a square pixel of distance counts as kOffCentre of a share, which is less than one sample of 16, halved.
// Ranks within kSameRank differ by rounding. A steep plane that is a piece for each row of samples was up to 0.38
// pixels of slope off with the first of them, and is 0.25.
CONSTANT float kOffCentre = 0.01f, kSameRank = 1e-5f;

// What a pixel of a source is, in 32 bits: how the cell between it and its right and lower
// neighbours is drawn, and what the pixel itself is.
CONSTANT uint kNoCell = 0u;
CONSTANT uint kLeafCell = 1u;  // part of a planar piece
CONSTANT uint kQuadCell = 2u;  // flat enough for one piece
CONSTANT uint kFallingSplit = 3u;  // two triangles along the diagonal from the upper left
CONSTANT uint kRisingSplit = 4u;
CONSTANT uint kUpperLeft = 5u;  // one triangle around this corner
CONSTANT uint kUpperRight = 6u;
CONSTANT uint kLowerRight = 7u;
CONSTANT uint kLowerLeft = 8u;
CONSTANT uint kShapeMask = 15u;

CONSTANT uint kCellNearEdge = 16u;
CONSTANT uint kEdgePixel = 32u;  // lays out an extension
CONSTANT uint kBesideBackground = 64u;
CONSTANT uint kCreasePixel = 128u;  // see creases.hpp
CONSTANT uint kRimPixel = 2048u;  // see rims.hpp
CONSTANT int kDistanceShift = 8;  // distance to the nearest edge
CONSTANT uint kDistanceMask = 7u;
CONSTANT int kLeafShift = 16;  // the leaf's number in its block
CONSTANT uint kLeafMask = 255u;
CONSTANT int kLevelShift = 24;  // outline level (see outline_levels.hpp): (byte - kLevelZero) * kLevelStep
CONSTANT float kLevelZero = 76.0f, kLevelStep = 0.01f;

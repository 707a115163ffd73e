// The tiles of a batch, the sources that each uses, and the pieces of surface in its pixels.
layout(std430, binding = 5) readonly buffer TileBuffer { TileEntry tiles[]; };
layout(std430, binding = 6) readonly buffer LocalBuffer { uvec2 locals[]; };  // source, slot
layout(std430, binding = 7) buffer PieceBuffer { Piece pieces[]; };
// First piece and number of pieces of each pixel, of what all sources of its tile show, then of what the first
// do, in tiles that are the mean of both. Before that is known its first is kAsksAgain where it is wanted.
const uint kAsksAgain = 0xffffffffu;
layout(std430, binding = 8) buffer RangeBuffer { uvec4 ranges[]; };
layout(std430, binding = 9) buffer CountBuffer { uint groups[3]; uint pieceCount; };

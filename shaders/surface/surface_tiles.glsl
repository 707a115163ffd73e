// The tiles of a batch, the sources that each uses, and the pieces of surface in its pixels.
struct Tile {
    int x, y;          // first pixel
    uint first, count; // its sources in locals[]
    float step;        // coarsest depth code of its sources, scene units
    float pad0, pad1, pad2;
};
struct Piece {
    float x, y, q, qx, qy, share;
    uint seenBy;
    uint at;  // pixel of the batch: tile * TILE² + row * TILE + column
};
layout(std430, binding = 5) readonly buffer TileBuffer { Tile tiles[]; };
layout(std430, binding = 6) readonly buffer LocalBuffer { uvec2 locals[]; };  // source, slot
layout(std430, binding = 7) buffer PieceBuffer { Piece pieces[]; };
// First piece and number of pieces of each pixel, or the colours of pieces.
layout(std430, binding = 8) buffer RangeBuffer { uvec2 ranges[]; };
layout(std430, binding = 9) buffer CountBuffer { uint groups[3]; uint pieceCount; };

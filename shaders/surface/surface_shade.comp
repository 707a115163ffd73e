// Surface mode, pass D: the colour of each piece, by the code of shared/surface_shade.glsl. A thread
// does one piece. MOST = sources that one piece takes colours from.
#include "surface/surface_common.glsl"
#include "surface/surface_tiles.glsl"
layout(local_size_x = int(kShadeGroup)) in;
layout(std430, binding = 10) writeonly buffer PieceColourBuffer { vec4 pieceColours[]; };

TileEntry tile;
int sourceOf(int k) { return int(locals[tile.first + uint(k)].x); }
#include "shared/surface_votes.glsl"
#include "shared/surface_shade.glsl"

void main() {
    uint index = gl_WorkGroupID.x * kShadeGroup + gl_LocalInvocationID.x;
    if (index >= pieceCount) return;
    Piece piece = pieces[index];
    tile = tiles[piece.at / uint(kTile * kTile)];
    pieceColours[index] = shadePiece(piece);
}

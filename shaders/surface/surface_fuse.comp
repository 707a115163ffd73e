// Surface mode, pass B: what each pixel shows. A thread does one pixel with the code of
// shared/surface_fuse.glsl, as the processor does in lib/render/surface/cpu/fuse.cpp. Of tiles that are the mean of
// two answers, a first run gives what all sources show, and a second, with `core`, what the first do where that is
// not simple. A loop around both would run into the 65535 rounds that llvmpipe allows all loops of a thread together.
#include "surface/surface_common.glsl"
#include "surface/surface_tiles.glsl"
layout(local_size_x = 16, local_size_y = 16) in;
layout(std430, binding = 4) readonly buffer SampleBuffer { uint samples[]; };
layout(location = 0) uniform bool core;

TileEntry tile;
int sourceOf(int k) { return int(locals[tile.first + uint(k)].x); }
uint sampleOf(int k, int i, int j) {
    uint slot = locals[tile.first + uint(k)].y;
    return slot == kNoSlot ? 0u : samples[slot * uint(SIDE * SIDE) + uint(j * SIDE + i)];
}
#include "shared/surface_votes.glsl"
#include "shared/surface_slope.glsl"
#include "shared/surface_fuse.glsl"

// The samples of source k in a pixel: the least, the greatest, flags of any, and flags of all that
// are there.
uvec4 rangeOf(int k, ivec2 pixel) {
    uvec4 range = uvec4(0xffffffffu, 0u, 0u, 0xffffffffu);
    for (int j = 0; j < S; ++j) {
        for (int i = 0; i < S; ++i) {
            uint value = sampleOf(k, pixel.x * S + i, pixel.y * S + j);
            range.x = min(range.x, value);
            range.y = max(range.y, value);
            range.z |= value;
            if (value != 0u) range.w &= value;
        }
    }
    return range;
}

shared uint groupCount, groupFirst;

void main() {
    uint t = gl_WorkGroupID.x / uint(kTile * kTile / 256);
    uint part = gl_WorkGroupID.x % uint(kTile * kTile / 256);
    tile = tiles[t];
    bool twice = tile.core < tile.count;
    ivec2 pixel =
        ivec2(part % uint(kTile / 16), part / uint(kTile / 16)) * 16 + ivec2(gl_LocalInvocationID.xy);
    uint first = t * uint(kTile * kTile);
    uint index = first + uint(pixel.y * kTile + pixel.x);
    ivec2 inFrame = ivec2(tile.x, tile.y) + pixel;
    bool wanted = all(greaterThanEqual(inFrame, ivec2(0))) && all(lessThan(inFrame, frame.size.xy));
    if (core) {
        wanted = wanted && ranges[index].z == kAsksAgain;
        tile.count = tile.core;
    }
    if (gl_LocalInvocationIndex == 0u) groupCount = 0u;
    barrier();

    shownCount = 0;
    uint count = 0u;
    bool simple = false;
    Piece only;
    if (wanted) {
        WholePixel whole = startPixel();
        for (int k = 0; k < int(tile.count); ++k) {
            if (locals[tile.first + uint(k)].y == kNoSlot) continue;
            uvec4 range = rangeOf(k, pixel);
            addSource(whole, k, uintBitsToFloat(range.x), uintBitsToFloat(range.y), range.z);
        }
        simple = whole.any && isSimple(whole);
        if (simple) {
            uint also = 0u;
            for (uint left = whole.others; left != 0u; left &= left - 1u) {
                uvec4 range = rangeOf(findLSB(left), pixel);
                if (alsoShows(whole, uintBitsToFloat(range.y), range.w)) also |= 1u << findLSB(left);
            }
            count = simplePiece(whole, also, pixel.x, pixel.y, only) ? 1u : 0u;
        } else if (whole.any) {
            fuseSamples(pixel.x, pixel.y);
            for (int begin = 0; begin < shownCount; begin = pieceEnd(begin)) ++count;
        }
    }
    // Room for the pieces of all pixels of the group at once.
    uint mine = count > 0u ? atomicAdd(groupCount, count) : 0u;
    barrier();
    if (gl_LocalInvocationIndex == 0u && groupCount > 0u) {
        groupFirst = atomicAdd(pieceCount, groupCount);
        atomicMax(groups[0], (groupFirst + groupCount + kShadeGroup - 1u) / kShadeGroup);
    }
    barrier();
    mine += groupFirst;
    bool again = twice && !simple;
    float share = core ? 1.0f - kAllShare : again ? kAllShare : 1.0f;
    if (!core)
        ranges[index] = uvec4(mine, count, again ? kAsksAgain : 0u, 0u);
    else if (wanted)
        ranges[index].zw = uvec2(mine, count);
    if (simple && count > 0u) {
        only.at += first;
        only.share *= share;
        pieces[mine] = only;
    }
    for (int begin = 0; begin < shownCount;) {
        int end = pieceEnd(begin);
        Piece piece = pieceOf(pixel.x, pixel.y, begin, end);
        piece.at += first;
        piece.share *= share;
        pieces[mine++] = piece;
        begin = end;
    }
}

// Surface mode, last pass: the pieces of each pixel, in their order, so that the sum is always the
// same. ORIGIN = 1 also gives from where in which source the main piece of each pixel comes.
#include "surface/surface_common.glsl"
#include "surface/surface_tiles.glsl"
layout(local_size_x = int(kShadeGroup)) in;
layout(std430, binding = 10) readonly buffer PieceColourBuffer { vec4 pieceColours[]; };
layout(std430, binding = 11) writeonly buffer ColourOutBuffer { vec4 colourOut[]; };
layout(std430, binding = 12) writeonly buffer DepthOutBuffer { float depthOut[]; };
#if ORIGIN
layout(std430, binding = 13) writeonly buffer OriginOutBuffer { vec4 originOut[]; };
#endif

void main() {
    uint index = gl_WorkGroupID.x * kShadeGroup + gl_LocalInvocationID.x;
    uvec4 range = ranges[index];
    vec4 sum = vec4(0.0);
    float most = 0.0, q = 0.0;
    uint main_ = 0u;
    for (uint n = 0u; n < range.y + range.w; ++n) {
        uint k = n < range.y ? range.x + n : range.z + (n - range.y);
        float share = pieces[k].share;
        sum += vec4(pieceColours[k].rgb, 1.0) * share;
        vec2 off = fract(vec2(pieces[k].x, pieces[k].y)) - 0.5;
        float rank = share - kOffCentre * dot(off, off);
        if (rank > most + kSameRank) {
            most = rank;
            q = pieces[k].q;
            main_ = k;
        }
    }
    colourOut[index] = sum;
    depthOut[index] = q;
#if ORIGIN
    vec4 origin = vec4(-1.0, 0.0, 0.0, 0.0);
    if (most > 0.0 && pieceColours[main_].w >= 0.0) {
        int s = int(pieceColours[main_].w);
        vec4 h = warp(s, pieces[main_].x, pieces[main_].y, q);
        origin = vec4(float(s), h.xy / h.w, 0.0);
    }
    originOut[index] = origin;
#endif
}

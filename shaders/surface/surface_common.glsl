// What the passes of surface mode share. The twins of these functions are in
// lib/render/surface/; names and constants are the same.
// Defined from outside: S (samples along a side of a pixel), TILE.
#define SIDE (TILE * S)
#define EXTENSION 1u
#define NEAR_EDGE 2u
#define NO_SLOT 0xffffffffu

struct Source {
    vec4 warpX, warpY, warpQ, warpW;  // rows of sourceFromPixel
    vec4 rayX, rayY, rayZ;            // rows of the vector from its eye to a point of the frame
    ivec4 size;                       // width, height, has alpha, blocks in a row
    vec4 axis;                        // 1 = q is 1/dist, 1/unit, step, share of q that is clearly behind
};
layout(std430, binding = 0) readonly buffer SourceBuffer { Source sources[]; };
layout(std140, binding = 0) uniform Frame {
    vec4 axis;               // 1 = q is 1/dist, 1/unit, largest q
    vec4 eyeX, eyeY, eyeZ;   // rows of the vector from the eye to a point of the frame
    vec4 fit;                // squared radius, ridge, colours are at most 1
    ivec4 frameSize;         // width, height, blocks with cells, blocks with edges
};
// q, dq/dx, dq/dy as bits, and what the pixel is: see CellCode in gpu_surface_scene.hpp.
layout(binding = 0) uniform usampler2DArray surfaces;
layout(binding = 1) uniform sampler2DArray colours;

float whole(vec4 a, float q) { return a.x != 0.0 ? q : 1.0; }
float perUnit(vec4 a, float q) { return a.x != 0.0 ? q * q : a.y; }

vec4 warp(int s, float x, float y, float q) {
    vec4 p = vec4(x, y, q, 1.0);
    return vec4(dot(sources[s].warpX, p), dot(sources[s].warpY, p), dot(sources[s].warpQ, p),
                dot(sources[s].warpW, p));
}
bool inside(int s, ivec2 p) {
    return p.x >= 0 && p.y >= 0 && p.x < sources[s].size.x && p.y < sources[s].size.y;
}

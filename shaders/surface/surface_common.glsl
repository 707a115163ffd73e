// What the passes of surface mode share: the frame, the sources, and their pixels as the shared
// code asks for them. Defined from outside: S (samples along a side of a pixel), kFreeAlpha of this
// renderer as FREE_ALPHA.
#include "shared/language.glsl"
#include "shared/surface_constants.glsl"
#include "shared/surface_structs.glsl"
#include "shared/surface_cells.glsl"
#define SIDE (kTile * S)
#define SAMPLES (S * S)

layout(std430, binding = 0) readonly buffer SourceBuffer { SourceEntry sources[]; };
layout(std140, binding = 0) uniform FrameBlock { FrameEntry frame; };
// q, dq/dx, dq/dy as bits, and what the pixel is: see shared/surface_cells.glsl.
layout(binding = 0) uniform usampler2DArray surfaces;
layout(binding = 1) uniform sampler2DArray colours;

// See DepthAxis. 1 = q is 1/dist, 1/unit.
#define Axis vec4
float relativeScale(Axis a, float q) { return a.x != 0.0 ? q : 1.0; }
float qPerUnit(Axis a, float q) { return a.x != 0.0 ? q * q : a.y; }
Axis frameAxis() { return frame.axis; }
Axis axisOf(int s) { return sources[s].axis; }

// A group of pixels that are kept together: a layer of the textures for each source.
struct Place {
    ivec3 texel;
};
Place placeOf(int s, ivec2 corner) { return Place(ivec3(corner, s)); }
uvec4 surfaceAt(int s, Place p, int i, int j) { return texelFetch(surfaces, p.texel + ivec3(i, j, 0), 0); }
vec4 colourOf(int s, Place p, int i, int j) { return texelFetch(colours, p.texel + ivec3(i, j, 0), 0); }
float qAt(int s, Place p, int i, int j) { return uintBitsToFloat(surfaceAt(s, p, i, j).x); }
vec2 gradientAt(int s, Place p, int i, int j) { return uintBitsToFloat(surfaceAt(s, p, i, j).yz); }
float alphaOf(int s, Place p, int i, int j) { return colourOf(s, p, i, j).a; }
float edgeDistanceOf(int s, Place p, int i, int j) {
    return float(surfaceAt(s, p, i, j).w >> kDistanceShift & kDistanceMask);
}
ivec2 sizeOf(int s) { return sources[s].size.xy; }
bool hasAlpha(int s) { return sources[s].size.z != 0; }
float freeAlphaOf(int s) { return FREE_ALPHA; }
float stepOf(int s) { return sources[s].axis.z; }
float clearlyBehindOf(int s) { return sources[s].axis.w; }
vec4 warp(int s, float x, float y, float q) {
    vec4 p = vec4(x, y, q, 1.0);
    return vec4(dot(sources[s].warpX, p), dot(sources[s].warpY, p), dot(sources[s].warpQ, p),
                dot(sources[s].warpW, p));
}

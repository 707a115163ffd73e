// What the passes of surface mode share: the frame, the sources, and their pixels as the shared
// code asks for them. Defined from outside: S (samples along a side of a pixel), kFreeLevel of this
// renderer as FREE_LEVEL.
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

// Where the rectangles of sources are, for those that are not whole: see PlaceTable in
// lib/render/surface/gpu/surface_textures.hpp.
layout(std430, binding = 14) readonly buffer PlaceBuffer { uint table[]; };

// Neighbouring pixels of a source: where they are kept, pixel (i, j) at texel + i stepX + j stepY, and
// which pixels of the source can be read there, the last two one past the last.
struct Place {
    ivec3 texel;  // layer -1: no rectangle shows them
    ivec2 stepX, stepY;
    uint outside;  // of no rectangle: bit i + 2 j says that the object is at (i, j)
    ivec4 bounds;
};

// A rectangle of source s that shows all pixels from `low` to `high`, seen from `corner`.
Place findPlace(int s, ivec2 corner, ivec2 low, ivec2 high) {
    int first = sources[s].place.y + (low.y / kSourceBlock) * sources[s].size.w + low.x / kSourceBlock;
    for (uint k = table[first]; k < table[first + 1]; ++k) {
        int r = int(table[k]);
        ivec4 bounds = ivec4(table[r], table[r + 1], table[r + 2], table[r + 3]);
        if (any(lessThan(low, bounds.xy)) || any(greaterThanEqual(high, bounds.zw))) continue;
        ivec2 origin = ivec2(table[r + 4], table[r + 5]);
        int layer = int(table[r + 6]);
        if (table[r + 7] != 0u)  // turned
            return Place(ivec3(origin.x - corner.y, origin.y + corner.x, layer), ivec2(0, 1),
                         ivec2(-1, 0), 0u, bounds);
        return Place(ivec3(origin + corner, layer), ivec2(1, 0), ivec2(0, 1), 0u, bounds);
    }
    return Place(ivec3(0, 0, -1), ivec2(0), ivec2(0), 0u, ivec4(0));
}
Place wholePlace(int s, ivec2 corner) {
    return Place(ivec3(corner, sources[s].place.x), ivec2(1, 0), ivec2(0, 1), 0u,
                 ivec4(0, 0, sources[s].size.xy));
}
bool objectOutside(int s, ivec2 p) {
    if (sources[s].place.z < 0) return false;
    uint bit = uint(p.y) * uint(sources[s].size.x) + uint(p.x);
    return (table[sources[s].place.z + int(bit / 32u)] >> (bit % 32u) & 1u) != 0u;
}

// Of the 2x2 pixels from `corner` on and, where they have points, of their neighbours.
Place placeOf(int s, ivec2 corner) {
    if (sources[s].place.x >= 0) return wholePlace(s, corner);
    ivec2 last = sources[s].size.xy - 1;
    ivec2 low = max(corner, ivec2(0)), high = min(corner + 1, last);
    Place p;
    p.texel.z = -1;
    for (int margin = 1; margin >= 0 && p.texel.z < 0; --margin)
        p = findPlace(s, corner, max(low - margin, ivec2(0)), min(high + margin, last));
    if (p.texel.z >= 0) return p;
    for (int y = low.y; y <= high.y; ++y)
        for (int x = low.x; x <= high.x; ++x)
            if (objectOutside(s, ivec2(x, y))) p.outside |= 1u << (x - corner.x + 2 * (y - corner.y));
    return p;
}
#define Taps Place
// Of the 4x4 pixels from `corner` on, taps around a point among the middle four.
Place tapPlaceOf(int s, ivec2 corner) {
    if (sources[s].place.x >= 0) return wholePlace(s, corner);
    ivec2 last = sources[s].size.xy - 1;
    Place p = findPlace(s, corner, max(corner, ivec2(0)), min(corner + 3, last));
    for (int k = 1; k <= 2 && p.texel.z < 0; ++k) {
        ivec2 middle = clamp(corner + k, ivec2(0), last);
        p = findPlace(s, corner, middle, middle);
    }
    return p;
}
bool canRead(Place p, ivec2 pixel) {
    return all(greaterThanEqual(pixel, p.bounds.xy)) && all(lessThan(pixel, p.bounds.zw));
}
ivec3 texelOf(Place p, int i, int j) { return p.texel + ivec3(i * p.stepX + j * p.stepY, 0); }
uvec4 surfaceAt(int s, Place p, int i, int j) {
    if (p.texel.z >= 0) return texelFetch(surfaces, texelOf(p, i, j), 0);
    bool unknown = sources[s].place.w != 0 && (p.outside >> (i + 2 * j) & 1u) != 0u;
    return uvec4(unknown ? floatBitsToUint(-1.0) : 0u, 0u, 0u, 0u);
}
vec4 colourOf(int s, Place p, int i, int j) {
    if (p.texel.z >= 0) return texelFetch(colours, texelOf(p, i, j), 0);
    return vec4(0.0, 0.0, 0.0, float(p.outside >> (i + 2 * j) & 1u));
}
float qAt(int s, Place p, int i, int j) { return uintBitsToFloat(surfaceAt(s, p, i, j).x); }
vec2 gradientAt(int s, Place p, int i, int j) { return uintBitsToFloat(surfaceAt(s, p, i, j).yz); }
float alphaOf(int s, Place p, int i, int j) { return colourOf(s, p, i, j).a; }
float levelOf(int s, Place p, int i, int j) {
    if (p.texel.z < 0) return float(p.outside >> (i + 2 * j) & 1u);
    return (float(surfaceAt(s, p, i, j).w >> kLevelShift) - kLevelZero) * kLevelStep;
}
float edgeDistanceOf(int s, Place p, int i, int j) {
    return float(surfaceAt(s, p, i, j).w >> kDistanceShift & kDistanceMask);
}
float ownColourOf(int s, Place p, int i, int j) {
    return (surfaceAt(s, p, i, j).w & kCreasePixel) != 0u ? 0.0f : edgeDistanceOf(s, p, i, j);
}
bool depthMayBeUnknown(int s) { return sources[s].place.w != 0; }
bool mixesColours(int s, Place p, int i, int j) {
    uint code = surfaceAt(s, p, i, j).w;
    return (code & kCreasePixel) != 0u || (code & (kDistanceMask << kDistanceShift | kBesideBackground)) == 0u;
}
ivec2 sizeOf(int s) { return sources[s].size.xy; }
bool hasAlpha(int s) { return sources[s].size.z != 0; }
float freeLevelOf(int s) { return FREE_LEVEL; }
float stepOf(int s) { return sources[s].axis.z; }
float besideOf(int s) { return sources[s].doubt.x; }
vec4 unwarpColumn(int s, int i) { return sources[s].unwarp[i]; }
float texelAt(int s, float q) { return sources[s].doubt.w / (sources[s].axis.x != 0.0 ? q : 1.0); }
float coarseOf(int s) { return sources[s].doubt.z; }
float nearestOf(int s) { return sources[s].doubt.y; }
float clearlyBehindOf(int s) { return sources[s].axis.w; }
vec4 warpChange(int s, vec4 d) {
    return vec4(dot(sources[s].warpX, d), dot(sources[s].warpY, d), dot(sources[s].warpQ, d),
                dot(sources[s].warpW, d));
}
vec4 warp(int s, float x, float y, float q) { return warpChange(s, vec4(x, y, q, 1.0)); }

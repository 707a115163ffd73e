// Surface mode, pass A: blocks of sources drawn as surfaces, the nearest q at each sample, by the code
// of shared/surface_raster.glsl. A group draws one block of one source into one tile; a thread draws
// one cell (EXTEND = 0) or the square around one edge pixel (EXTEND = 1). Positive floats sort as
// their bits do, so the nearest is an atomic maximum.
#include "surface/surface_common.glsl"
layout(local_size_x = 16, local_size_y = 16) in;

layout(std430, binding = 1) readonly buffer SlotBuffer { SlotEntry slots[]; };
layout(std430, binding = 2) readonly buffer TaskBuffer { uvec4 tasks[]; };  // slot, block, leaves
layout(std430, binding = 3) readonly buffer LeafBuffer { uvec4 leaves[]; };  // bits of q0, qx, qy; x | y << 16
layout(std430, binding = 4) buffer SampleBuffer { uint samples[]; };

uint slot;

vec4 toSamples(float x, float y, float q) {
    vec4 p = vec4(x, y, q, 1.0);
    return vec4(dot(slots[slot].warpX, p), dot(slots[slot].warpY, p), dot(slots[slot].warpQ, p),
                dot(slots[slot].warpW, p));
}
float qLimit() { return frame.axis.z; }
uint sampleNumber(int x, int y) { return slot * uint(SIDE * SIDE) + uint(y * SIDE + x); }
bool mayDraw(int x, int y, float behind) {
#if EXTEND
    uint old = samples[sampleNumber(x, y)];
    return old == 0u || (old & kExtensionBit) != 0u || uintBitsToFloat(old) < behind;
#else
    return true;
#endif
}
void raise(int x, int y, uint value) {
    uint at = sampleNumber(x, y);
    if (value > samples[at]) atomicMax(samples[at], value);
}
#include "shared/surface_cut.glsl"
#include "shared/surface_raster.glsl"

void main() {
    uint task = gl_WorkGroupID.y * 32768u + gl_WorkGroupID.x;
    if (task >= uint(EXTEND != 0 ? frame.size.w : frame.size.z)) return;
    slot = tasks[task].x;
    int s = slots[slot].source.x;
    int block = int(tasks[task].y), inRow = sources[s].size.w;
    ivec2 p = ivec2(block % inRow, block / inRow) * 16 + ivec2(gl_LocalInvocationID.xy);
    if (any(greaterThanEqual(p, sizeOf(s)))) return;
    Place place = placeOf(s, p);
    uint code = surfaceAt(s, place, 0, 0).w;
    float x = float(p.x) + 0.5, y = float(p.y) + 0.5, q = qAt(s, place, 0, 0);
#if EXTEND
    if ((code & kEdgePixel) == 0u) return;
    vec2 g = gradientAt(s, place, 0, 0);
    drawExtension(x, y, q, g.x, g.y, coarseOf(s) * relativeScale(axisOf(s), q), (code & kBesideBackground) != 0u,
                  (code & kRimPixel) != 0u);
#else
    uint shape = code & kShapeMask;
    if (shape == kNoCell) return;
    if (shape == kLeafCell) {
        // Each thread draws its own cell of the leaf.
        uvec4 found = leaves[tasks[task].z + (code >> kLeafShift & kLeafMask)];
        vec3 leaf = uintBitsToFloat(found.xyz);
        vec2 d = vec2(p - ivec2(found.w & 0xffffu, found.w >> 16));
        drawLeaf(x, y, 1.0, leaf.x + leaf.y * d.x + leaf.z * d.y, leaf.y, leaf.z);
        return;
    }
    drawCell(shape, toSamples(x, y, q), toSamples(x + 1.0, y, qAt(s, place, 1, 0)),
             toSamples(x + 1.0, y + 1.0, qAt(s, place, 1, 1)), toSamples(x, y + 1.0, qAt(s, place, 0, 1)),
             (code & kCellNearEdge) != 0u ? kNearEdgeBit : 0u);
#endif
}

// Surface mode, pass A: blocks of sources drawn as surfaces, the nearest q at each sample. A group
// draws one block of one source into one tile; a thread draws one cell (EXTEND = 0) or the square
// around one edge pixel (EXTEND = 1). Positive floats sort as their bits do, so the nearest is an
// atomic maximum. The twin is lib/render/surface/cpu/raster.cpp.
layout(local_size_x = 16, local_size_y = 16) in;

struct Slot {
    vec4 warpX, warpY, warpQ, warpW;  // samples of its tile from pixels of its source
    ivec4 source;
};
layout(std430, binding = 1) readonly buffer SlotBuffer { Slot slots[]; };
layout(std430, binding = 2) readonly buffer TaskBuffer { uvec4 tasks[]; };  // slot, block, leaves
layout(std430, binding = 3) readonly buffer LeafBuffer { uvec4 leaves[]; };  // bits of q0, qx, qy; x | y << 16
layout(std430, binding = 4) buffer SampleBuffer { uint samples[]; };

const float kGrow = kLeafGrow * float(S);

uint slot;

vec4 project(float x, float y, float q) {
    vec4 p = vec4(x, y, q, 1.0);
    float d = dot(slots[slot].warpW, p);
    return vec4(vec3(dot(slots[slot].warpX, p), dot(slots[slot].warpY, p),
                     dot(slots[slot].warpQ, p)) / d, d > 0.0 ? 1.0 : 0.0);
}

// Samples of the convex polygon with these edges and this plane.
void scan(vec4 ex, vec4 ey, vec4 e0, vec3 plane, vec2 range, vec4 box, uint bits) {
    box = vec4(max(box.xy, 0.0), min(box.zw, float(SIDE - 1)));
    if (!(box.x <= box.z && box.y <= box.w) || !(range.x > 0.0) || !(range.y <= axis.z)) return;
    ivec4 b = ivec4(ceil(box.xy), floor(box.zw));
    uint base = slot * uint(SIDE * SIDE);
    for (int y = b.y; y <= b.w; ++y) {
        for (int x = b.x; x <= b.z; ++x) {
            vec4 e = ex * float(x) + (ey * float(y) + e0);
            if (min(min(e.x, e.y), min(e.z, e.w)) < 0.0) continue;
            float q = clamp(plane.x * float(x) + (plane.y * float(y) + plane.z), range.x, range.y);
            uint value = (floatBitsToUint(q) & ~3u) | bits;
            uint at = base + uint(y * SIDE + x);
            uint old = samples[at];
#if EXTEND
            if (old != 0u && (old & EXTENSION) == 0u) continue;
#endif
            if (value > old) atomicMax(samples[at], value);
        }
    }
}

void fillQuad(vec4 a, vec4 b, vec4 c, vec4 d, float grow, uint bits) {
    if (a.w + b.w + c.w + d.w < 4.0) return;
    vec3 ac = c.xyz - a.xyz, bd = d.xyz - b.xyz;
    float area = ac.x * bd.y - ac.y * bd.x;
    if (!(area > 0.0)) return;
    float px = (ac.z * bd.y - ac.y * bd.z) / area, py = (ac.x * bd.z - ac.z * bd.x) / area;
    vec3 middle = 0.25 * (a.xyz + b.xyz + c.xyz + d.xyz);
    vec4 xs = vec4(a.x, b.x, c.x, d.x), ys = vec4(a.y, b.y, c.y, d.y);
    vec4 ex = ys - ys.yzwx, ey = xs.yzwx - xs;
    vec4 e0 = grow * (abs(ex) + abs(ey)) - (ex * xs + ey * ys);
    vec3 low = min(min(a.xyz, b.xyz), min(c.xyz, d.xyz));
    vec3 high = max(max(a.xyz, b.xyz), max(c.xyz, d.xyz));
    scan(ex, ey, e0, vec3(px, py, middle.z - px * middle.x - py * middle.y), vec2(low.z, high.z),
         vec4(low.xy - grow, high.xy + grow), bits);
}

void fillTriangle(vec4 a, vec4 b, vec4 c, uint bits) {
    if (a.w + b.w + c.w < 3.0) return;
    vec3 ab = b.xyz - a.xyz, ac = c.xyz - a.xyz;
    float area = ab.x * ac.y - ab.y * ac.x;
    if (!(area > 0.0)) return;
    float px = (ab.z * ac.y - ab.y * ac.z) / area, py = (ab.x * ac.z - ab.z * ac.x) / area;
    vec3 middle = (a.xyz + b.xyz + c.xyz) / 3.0;
    vec3 xs = vec3(a.x, b.x, c.x), ys = vec3(a.y, b.y, c.y);
    vec3 ex = ys - ys.yzx, ey = xs.yzx - xs;
    vec3 e0 = kCrack * (abs(ex) + abs(ey)) - (ex * xs + ey * ys);
    vec3 low = min(min(a.xyz, b.xyz), c.xyz), high = max(max(a.xyz, b.xyz), c.xyz);
    scan(vec4(ex, 0.0), vec4(ey, 0.0), vec4(e0, 1.0),
         vec3(px, py, middle.z - px * middle.x - py * middle.y), vec2(low.z, high.z),
         vec4(low.xy - kCrack, high.xy + kCrack), bits);
}

float depthAt(ivec2 p, int s) { return uintBitsToFloat(texelFetch(surfaces, ivec3(p, s), 0).x); }

void main() {
    uint task = gl_WorkGroupID.y * 32768u + gl_WorkGroupID.x;
    if (task >= uint(EXTEND != 0 ? frameSize.w : frameSize.z)) return;
    slot = tasks[task].x;
    int s = slots[slot].source.x;
    int block = int(tasks[task].y), inRow = sources[s].size.w;
    ivec2 p = ivec2(block % inRow, block / inRow) * 16 + ivec2(gl_LocalInvocationID.xy);
    if (!inside(s, p)) return;
    uvec4 here = texelFetch(surfaces, ivec3(p, s), 0);
    uint code = here.w;
    vec2 at = vec2(p) + 0.5;
#if EXTEND
    if ((code & 32u) == 0u) return;
    float half_ = (code & 64u) != 0u ? kHalfBesideBackground : kHalfInside;
    float q = uintBitsToFloat(here.x);
    vec2 g = vec2(uintBitsToFloat(here.y), uintBitsToFloat(here.z)) * half_;
    float reach = kExtensionReach * whole(sources[s].axis, q);
    float plus = clamp(g.x + g.y, -reach, reach), minus = clamp(g.x - g.y, -reach, reach);
    fillQuad(project(at.x - half_, at.y - half_, q - plus), project(at.x + half_, at.y - half_, q + minus),
             project(at.x + half_, at.y + half_, q + plus), project(at.x - half_, at.y + half_, q - minus),
             kCrack, EXTENSION | NEAR_EDGE);
#else
    uint shape = code & 15u;
    if (shape == 0u) return;
    vec4 q;  // upper left, upper right, lower right, lower left
    float grow = kCrack;
    if (shape == 1u) {
        uvec4 found = leaves[tasks[task].z + (code >> 16)];
        vec3 leaf = uintBitsToFloat(found.xyz);
        vec2 d = vec2(p - ivec2(found.w & 0xffffu, found.w >> 16));
        float first = leaf.x + leaf.y * d.x + leaf.z * d.y;
        q = vec4(first, first + leaf.y, first + leaf.y + leaf.z, first + leaf.z);
        grow = kGrow;
    } else {
        q = vec4(uintBitsToFloat(here.x), depthAt(p + ivec2(1, 0), s), depthAt(p + ivec2(1, 1), s),
                 depthAt(p + ivec2(0, 1), s));
    }
    vec4 v00 = project(at.x, at.y, q.x), v10 = project(at.x + 1.0, at.y, q.y);
    vec4 v11 = project(at.x + 1.0, at.y + 1.0, q.z), v01 = project(at.x, at.y + 1.0, q.w);
    uint bits = (code & 16u) != 0u ? NEAR_EDGE : 0u;
    if (shape <= 2u) {
        fillQuad(v00, v10, v11, v01, grow, bits);
        return;
    }
    if (shape == 3u) {
        fillTriangle(v00, v10, v11, bits);
        fillTriangle(v00, v11, v01, bits);
    } else if (shape == 4u) {
        fillTriangle(v00, v10, v01, bits);
        fillTriangle(v10, v11, v01, bits);
    } else if (shape == 5u) {
        fillTriangle(v00, v10, v01, bits);
    } else if (shape == 6u) {
        fillTriangle(v10, v11, v00, bits);
    } else if (shape == 7u) {
        fillTriangle(v11, v01, v10, bits);
    } else {
        fillTriangle(v01, v00, v11, bits);
    }
#endif
}

// Splatting with atomics. PASS 1: the front distance per pixel. PASS 2: what lies within the
// tolerance of the front is added with its weight.
// ACCUMULATE: 0 = 32-bit integers, 1 = floats, 2 = pairs of 32-bit integers in 64 bits.
// NORMALS: normals are kept. Channels of a pixel: R, G, B (times alpha), weight, alpha, normal.
// Continued colours may be negative: sums are two's complement.
#include "splat/splat_points.glsl"
layout(local_size_x = 256) in;

layout(std430, binding = 3) buffer FrontBuffer { uint front[]; };
#if CULL && PASS == 2
// splat_cull.comp: 0 where all of a task's splats lie behind what is in front.
layout(std430, binding = 10) readonly buffer VisibleBuffer { uint visible[]; };
#endif

#if PASS == 2
#define CHANNELS (4 + TRANSLUCENT + 3 * NORMALS)
#define PAIRS ((CHANNELS + 1) / 2)
#if ACCUMULATE == 0
layout(std430, binding = 4) buffer SumBuffer { int sums[]; };
#elif ACCUMULATE == 1
layout(std430, binding = 4) buffer SumBuffer { float sums[]; };
#else
layout(std430, binding = 4) buffer SumBuffer { int64_t sums[]; };
#endif

#if ACCUMULATE == 2
// low + high * 2^32 as one number; resolve.comp takes it apart. Signed, since Mesa has the 64-bit
// atomicAdd() of GL_NV_shader_atomic_int64 for signed numbers only.
int64_t pair(int low, int high) {
    return packInt2x32(ivec2(low, low < 0 ? high - 1 : high));
}
#endif

// What a point adds for each unit of weight, times the colour scale.
struct Paint {
    float alpha;
    vec3 colour;  // times alpha
    vec3 across, down;  // its change per pixel
    vec3 normal;  // 0..1
    float quality, tolerance;
};

Paint paintOf(Point p, ivec3 texel, Splat splat) {
    Paint paint;
    vec4 colour = pointColour(texel);
#if TRANSLUCENT
    colour.rgb *= colour.a;
#endif
    paint.colour = colour.rgb * frame.scales.y;
    paint.alpha = colour.a * frame.scales.y;
#if NORMALS
    paint.normal = (pointNormal(texel) * 0.5 + 0.5) * frame.scales.y;
#endif
    colourGradient(texel, splat.steps, paint.across, paint.down);
    paint.across *= frame.scales.y;
    paint.down *= frame.scales.y;
    paint.quality = splat.quality * frame.scales.x;
    paint.tolerance = p.task.tolerance;
    return paint;
}

void add(int at, float kernel, vec2 d, float depth, Paint paint) {
    float nearest = uintBitsToFloat(front[at]);
    if (!(depth <= nearest * (1.0 + paint.tolerance))) return;
    vec3 colour = paint.colour + d.x * paint.across + d.y * paint.down;
#if ACCUMULATE == 1
    float weight = kernel * paint.quality;
#else
    // Whole numbers, so that a flat colour comes back exactly; never none.
    float weight = max(1.0, floor(kernel * paint.quality + 0.5));
#endif
#if ACCUMULATE == 1
    int j = at * CHANNELS;
    atomicAdd(sums[j], colour.r * weight);
    atomicAdd(sums[j + 1], colour.g * weight);
    atomicAdd(sums[j + 2], colour.b * weight);
    atomicAdd(sums[j + 3], weight);
#if TRANSLUCENT
    atomicAdd(sums[j + 4], paint.alpha * weight);
#endif
#if NORMALS
    atomicAdd(sums[j + 4 + TRANSLUCENT], paint.normal.x * weight);
    atomicAdd(sums[j + 5 + TRANSLUCENT], paint.normal.y * weight);
    atomicAdd(sums[j + 6 + TRANSLUCENT], paint.normal.z * weight);
#endif
#else
    ivec3 c = ivec3(round(colour * weight));
    int w = int(weight);
#if TRANSLUCENT
    int a = int(paint.alpha * weight + 0.5);
#endif
#if NORMALS
    ivec3 n = ivec3(paint.normal * weight + 0.5);
#endif
#if ACCUMULATE == 0
    int j = at * CHANNELS;
    atomicAdd(sums[j], c.r);
    atomicAdd(sums[j + 1], c.g);
    atomicAdd(sums[j + 2], c.b);
    atomicAdd(sums[j + 3], w);
#if TRANSLUCENT
    atomicAdd(sums[j + 4], a);
#endif
#if NORMALS
    atomicAdd(sums[j + 4 + TRANSLUCENT], n.x);
    atomicAdd(sums[j + 5 + TRANSLUCENT], n.y);
    atomicAdd(sums[j + 6 + TRANSLUCENT], n.z);
#endif
#else
    int j = at * PAIRS;
    atomicAdd(sums[j], pair(c.r, c.g));
    atomicAdd(sums[j + 1], pair(c.b, w));
#if TRANSLUCENT && NORMALS
    atomicAdd(sums[j + 2], pair(a, n.x));
    atomicAdd(sums[j + 3], pair(n.y, n.z));
#elif TRANSLUCENT
    atomicAdd(sums[j + 2], pair(a, 0));
#elif NORMALS
    atomicAdd(sums[j + 2], pair(n.x, n.y));
    atomicAdd(sums[j + 3], pair(n.z, 0));
#endif
#endif
#endif
}
#endif

void main() {
    uint task = gl_WorkGroupID.y * 32768u + gl_WorkGroupID.x;
    if (task >= uint(frame.counts.y)) return;
#if CULL && PASS == 2
    if (visible[task + uint(frame.counts.z)] == 0u) return;
#endif
    Point p;
    ivec3 texel;
    if (!fetchPoint(task + uint(frame.counts.z), gl_LocalInvocationIndex, p, texel)) return;
    int stride = frame.frameSize.z;  // buffers have a border of one pixel, so small splats need no clipping
#if RULE == 0
    ivec2 at = ivec2(floor(clamp(p.pixel, vec2(-2.0), vec2(1.0e6)) + 0.5));
    if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, frame.frameSize.xy))) return;
    int index = (at.y + 1) * stride + at.x + 1;
#if PASS == 1
    atomicMin(front[index], floatBitsToUint(p.dist));
#else
    Splat splat;
    splat.quality = 1.0;
    splat.steps = vec4(0.0);
    Paint paint = paintOf(p, texel, splat);
    paint.tolerance = 0.0;
    add(index, 1.0, vec2(0.0), p.dist, paint);
#endif
#elif TWO_BY_TWO
    vec2 corner = floor(p.pixel);
    if (!(all(greaterThanEqual(corner, vec2(-1.0))) && all(lessThan(corner, vec2(frame.frameSize.xy))))) return;
    vec2 f = p.pixel - corner, g = 1.0 - f;
    vec2 f2 = f * f, g2 = g * g;
    int index = (int(corner.y) + 1) * stride + int(corner.x) + 1;
    Splat splat;
    if (!splatOf(p, texel, splat)) return;
    float zx = splat.slope.x, zy = splat.slope.y, core2 = splat.core2;
    float z = p.dist - f.x * zx - f.y * zy;
#if PASS == 1
    if (f2.x + f2.y <= core2) atomicMin(front[index], floatBitsToUint(z));
    if (g2.x + f2.y <= core2) atomicMin(front[index + 1], floatBitsToUint(z + zx));
    if (f2.x + g2.y <= core2) atomicMin(front[index + stride], floatBitsToUint(z + zy));
    if (g2.x + g2.y <= core2) atomicMin(front[index + stride + 1], floatBitsToUint(z + zx + zy));
#else
    Paint paint = paintOf(p, texel, splat);
    vec2 near = lowPass(f2), far = lowPass(g2);
    vec4 kernel = vec4(near.x, far.x, near.x, far.x) * vec4(near.yy, far.yy);
    vec4 radius2 = vec4(f2.x, g2.x, f2.x, g2.x) + vec4(f2.yy, g2.yy);
    if (worthwhile(kernel.x, radius2.x, core2)) add(index, kernel.x, -f, z, paint);
    if (worthwhile(kernel.y, radius2.y, core2))
        add(index + 1, kernel.y, vec2(g.x, -f.y), z + zx, paint);
    if (worthwhile(kernel.z, radius2.z, core2))
        add(index + stride, kernel.z, vec2(-f.x, g.y), z + zy, paint);
    if (worthwhile(kernel.w, radius2.w, core2))
        add(index + stride + 1, kernel.w, g, z + zx + zy, paint);
#endif
#else
    Splat splat;
    if (!splatOf(p, texel, splat)) return;
    vec2 low = floor(p.pixel), high = low + 1.0;
    if (!splat.small) {
        low = ceil(p.pixel - splat.reach);
        high = floor(p.pixel + splat.reach);
    }
    low = max(low, vec2(0.0));
    high = min(high, vec2(frame.frameSize.xy - 1));
    if (!all(lessThanEqual(low, high))) return;
    ivec2 from = ivec2(low), to = ivec2(high);
#if PASS == 2
    Paint paint = paintOf(p, texel, splat);
#endif
    for (int y = from.y; y <= to.y; ++y) {
        for (int x = from.x; x <= to.x; ++x) {
            vec2 d = vec2(x, y) - p.pixel;
            float q = squaredRadius(splat, d);
            float depth = depthAt(p.dist, splat.slope, d);
            int index = (y + 1) * stride + x + 1;
#if PASS == 1
            if (q <= splat.core2) atomicMin(front[index], floatBitsToUint(depth));
#else
            float kernel = kernelAt(splat, d, q);
            if (kernel > 0.0) add(index, kernel, d, depth, paint);
#endif
        }
    }
#endif
}

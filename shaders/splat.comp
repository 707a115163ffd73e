// Splatting with atomics. PASS 1: the front distance per pixel. PASS 2: what lies within the
// tolerance of the front is added with its weight. Needs splat_points.glsl.
// ACCUMULATE: 0 = 32-bit integers, 1 = floats, 2 = pairs of 32-bit integers in 64 bits.
// NORMALS: normals are kept. Channels of a pixel: R, G, B (times alpha), weight, alpha,
// normal.
layout(local_size_x = 256) in;

layout(std430, binding = 3) buffer FrontBuffer { uint front[]; };

#if PASS == 2
#define CHANNELS (4 + TRANSLUCENT + 3 * NORMALS)
#define PAIRS ((CHANNELS + 1) / 2)
#if ACCUMULATE == 0
layout(std430, binding = 4) buffer SumBuffer { uint sums[]; };
#elif ACCUMULATE == 1
layout(std430, binding = 4) buffer SumBuffer { float sums[]; };
#else
layout(std430, binding = 4) buffer SumBuffer { uint64_t sums[]; };
#endif

// What a point adds for each unit of weight, times the colour scale.
struct Paint {
    float alpha;  // 0..1
    vec3 colour;  // times alpha
    vec3 normal;  // 0..1
    float quality, tolerance;
};

Paint paintOf(Point p) {
    Paint paint;
    vec4 colour = pointColour(p);
#if TRANSLUCENT
    colour.rgb *= colour.a;
#endif
    paint.colour = colour.rgb * scales.y;
    paint.alpha = colour.a * scales.y;
#if NORMALS
    paint.normal = (pointNormal(p) * 0.5 + 0.5) * scales.y;
#endif
    paint.quality = tasks[p.task].quality * scales.x;
    paint.tolerance = tasks[p.task].tolerance;
    return paint;
}

void add(int at, float kernel, float depth, Paint paint) {
    float nearest = uintBitsToFloat(front[at]);
    if (!(depth <= nearest * (1.0 + paint.tolerance))) return;
#if ACCUMULATE == 1
    float weight = kernel * paint.quality;
#else
    // Whole numbers, so that a flat colour comes back exactly; never none.
    float weight = max(1.0, floor(kernel * paint.quality + 0.5));
#endif
#if ACCUMULATE == 1
    int j = at * CHANNELS;
    atomicAdd(sums[j], paint.colour.r * weight);
    atomicAdd(sums[j + 1], paint.colour.g * weight);
    atomicAdd(sums[j + 2], paint.colour.b * weight);
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
    uvec3 c = uvec3(paint.colour * weight + 0.5);
    uint w = uint(weight);
#if TRANSLUCENT
    uint a = uint(paint.alpha * weight + 0.5);
#endif
#if NORMALS
    uvec3 n = uvec3(paint.normal * weight + 0.5);
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
    // The halves of a pair cannot run into each other while no 32-bit sum overflows.
    int j = at * PAIRS;
    atomicAdd(sums[j], packUint2x32(c.rg));
    atomicAdd(sums[j + 1], packUint2x32(uvec2(c.b, w)));
#if TRANSLUCENT && NORMALS
    atomicAdd(sums[j + 2], packUint2x32(uvec2(a, n.x)));
    atomicAdd(sums[j + 3], packUint2x32(n.yz));
#elif TRANSLUCENT
    atomicAdd(sums[j + 2], packUint2x32(uvec2(a, 0u)));
#elif NORMALS
    atomicAdd(sums[j + 2], packUint2x32(n.xy));
    atomicAdd(sums[j + 3], packUint2x32(uvec2(n.z, 0u)));
#endif
#endif
#endif
}
#endif

void main() {
    uint task = gl_WorkGroupID.y * 32768u + gl_WorkGroupID.x;
    if (task >= uint(counts.y)) return;
    Point p;
    if (!fetchPoint(task + uint(counts.z), gl_LocalInvocationIndex, p)) return;
    int stride = frameSize.z;  // buffers have a border of one pixel, so small splats need no clipping
#if RULE == 0
    ivec2 at = ivec2(floor(clamp(p.pixel, vec2(-2.0), vec2(1.0e6)) + 0.5));
    if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, frameSize.xy))) return;
    int index = (at.y + 1) * stride + at.x + 1;
#if PASS == 1
    atomicMin(front[index], floatBitsToUint(p.dist));
#else
    Paint paint = paintOf(p);
    paint.quality = scales.x;
    paint.tolerance = 0.0;
    add(index, 1.0, p.dist, paint);
#endif
#elif RULE == 1
    vec2 corner = floor(p.pixel);
    if (!(all(greaterThanEqual(corner, vec2(-1.0))) && all(lessThan(corner, vec2(frameSize.xy))))) return;
    vec2 f = p.pixel - corner, g = 1.0 - f;
    vec2 f2 = f * f, g2 = g * g;
    int index = (int(corner.y) + 1) * stride + int(corner.x) + 1;
    float zx = p.dist * tasks[p.task].slopeX, zy = p.dist * tasks[p.task].slopeY;
    float z = p.dist - f.x * zx - f.y * zy;
#if PASS == 1
    float core2 = tasks[p.task].core2;
    if (f2.x + f2.y <= core2) atomicMin(front[index], floatBitsToUint(z));
    if (g2.x + f2.y <= core2) atomicMin(front[index + 1], floatBitsToUint(z + zx));
    if (f2.x + g2.y <= core2) atomicMin(front[index + stride], floatBitsToUint(z + zy));
    if (g2.x + g2.y <= core2) atomicMin(front[index + stride + 1], floatBitsToUint(z + zx + zy));
#else
    Paint paint = paintOf(p);
    vec2 near = lowPass(f2), far = lowPass(g2);
    vec4 kernel = vec4(near.x, far.x, near.x, far.x) * vec4(near.yy, far.yy);
    vec4 radius2 = vec4(f2.x, g2.x, f2.x, g2.x) + vec4(f2.yy, g2.yy);
    float core2 = tasks[p.task].core2;
    if (worthwhile(kernel.x, radius2.x, core2)) add(index, kernel.x, z, paint);
    if (worthwhile(kernel.y, radius2.y, core2)) add(index + 1, kernel.y, z + zx, paint);
    if (worthwhile(kernel.z, radius2.z, core2)) add(index + stride, kernel.z, z + zy, paint);
    if (worthwhile(kernel.w, radius2.w, core2)) add(index + stride + 1, kernel.w, z + zx + zy, paint);
#endif
#else
    Ellipse e;
    if (!ellipseOf(p, e)) return;
    vec2 low = max(ceil(p.pixel - e.reach), vec2(0.0));
    vec2 high = min(floor(p.pixel + e.reach), vec2(frameSize.xy - 1));
    if (!all(lessThanEqual(low, high))) return;
    ivec2 from = ivec2(low), to = ivec2(high);
#if PASS == 2
    Paint paint = paintOf(p);
#endif
    for (int y = from.y; y <= to.y; ++y) {
        for (int x = from.x; x <= to.x; ++x) {
            vec2 d = vec2(x, y) - p.pixel;
            float q = squaredRadius(e.q, d);
            // A plane that runs through the viewpoint must not hide all.
            float depth = max(p.dist + dot(e.slope, d), 0.5 * p.dist);
            int index = (y + 1) * stride + x + 1;
#if PASS == 1
            if (q <= e.core2) atomicMin(front[index], floatBitsToUint(depth));
#else
            if (q < kFaint2) add(index, ellipseKernel(q), depth, paint);
#endif
        }
    }
#endif
}

// Fetching a point of the object and its splat.
// RULE: 0 = one pixel, 1 = small splats (2x2 pixels) that share a tilt, 2 = each from its own data,
// small or an ellipse, 3 = the paper's, 4 = each from its own data, all small.
// PASS: 1 = visibility, 2 = blending. SIZES: the slope texture holds sizes too.
#include "splat/splat_frame.glsl"
#include "shared/splat_shape.glsl"

#define TWO_BY_TWO (RULE == 1 || RULE == 4)
#define BOXES (RULE == 2 || RULE == 3)

#if RASTER
uniform usamplerBuffer taskBuffer;
TaskEntry taskAt(uint i) {
    int at = int(i) * 4;
    uvec4 a = texelFetch(taskBuffer, at);
    vec4 b = uintBitsToFloat(texelFetch(taskBuffer, at + 1));
    vec4 c = uintBitsToFloat(texelFetch(taskBuffer, at + 2));
    uvec4 d = texelFetch(taskBuffer, at + 3);
    return TaskEntry(a.x, a.y, a.z, a.w, b.x, b.y, b.z, b.w, c.x, c.y, c.z, c.w,
                     uintBitsToFloat(d.x), d.y, d.z, uintBitsToFloat(d.w));
}
#else
layout(std430, binding = 1) readonly buffer TaskBuffer { TaskEntry tasks[]; };
TaskEntry taskAt(uint i) { return tasks[i]; }
#endif

AT(0) uniform sampler2DArray colourTexture;
AT(1) uniform sampler2DArray depthTexture;
AT(2) uniform sampler2DArray normalTexture;
AT(3) uniform isampler2DArray slopeTexture;

const float kFarAway = 3.0e38;

// False for background, points behind the novel camera and lanes past the end.
bool fetchPoint(uint task, uint lane, out Point p, out ivec3 texel) {
    p.task = taskAt(task);
    uint dx = lane & 15u, dy = lane >> 4u;
    if (dx >= (p.task.count & 0xffffu) || dy >= (p.task.count >> 16u)) return false;
    uint atlas = p.task.atlasXY, viewLayer = p.task.viewLayer, uv = p.task.uv;
    texel = ivec3((atlas & 0xffffu) + dx, (atlas >> 16u) + dy, viewLayer >> 20u);
    p.source = texelFetch(depthTexture, texel, 0).r;
    if (!(p.source < kFarAway)) return false;
    p.view = viewAt(viewLayer & 0xfffffu);
    p.flatFrame = orthographic();
    p.largest = frame.scales.z;
    if (!placePoint(p, float((uv & 0xffffu) + dx), float((uv >> 16u) + dy))) return false;
    p.opaque = true;
#if TRANSLUCENT
    float alpha = texelFetch(colourTexture, texel, 0).a;
    if (!(alpha > 0.0)) return false;
#if PASS == 1 && RULE != 0
    // Glass hides whatever its alpha is: see splat::Slope.
    if (!(alpha >= kHides) && (texelFetch(slopeTexture, texel, 0).x & 1) == 0) return false;
#endif
    p.opaque = alpha >= 1.0;
#endif
    return true;
}

vec4 pointColour(ivec3 texel) { return texelFetch(colourTexture, texel, 0); }
vec3 pointNormal(ivec3 texel) { return texelFetch(normalTexture, texel, 0).xyz; }

// False when the splat faces away.
bool splatOf(Point p, ivec3 texel, out Splat s) {
#if RULE <= 1
    s = uniformSplat(p);
    return true;
#elif RULE == 3
    s = paperSplat(p, frame.novelPosition.w);
    return true;
#else
    ivec4 coded = texelFetch(slopeTexture, texel, 0);
#if SIZES
    float size = float(coded.z) * (1.0 / 64.0);
#else
    const float size = 1.0;
#endif
    return ownSplat(p, coded.x, coded.y, size, RULE == 4, s);
#endif
}

// Change of a point's colour per novel pixel across and down, from its four neighbours.
void colourGradient(ivec3 texel, vec4 steps, out vec3 across, out vec3 down) {
    across = down = vec3(0.0);
    if (steps.x == 0.0 && steps.w == 0.0) return;
    vec3 u = texelFetchOffset(colourTexture, texel, 0, ivec2(1, 0)).rgb -
             texelFetchOffset(colourTexture, texel, 0, ivec2(-1, 0)).rgb;
    vec3 v = texelFetchOffset(colourTexture, texel, 0, ivec2(0, 1)).rgb -
             texelFetchOffset(colourTexture, texel, 0, ivec2(0, -1)).rgb;
    across = steps.x * u + steps.y * v;
    down = steps.z * u + steps.w * v;
}

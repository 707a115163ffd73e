// Fetching a point of the object and laying out its splat; the twin of
// lib/render/splat/cpu/kernels.cpp. Needs splat_frame.glsl.
// RULE: 0 = one pixel, 1 = small splats (2x2 pixels) that share a tilt, 2 = each from its own data,
// small or an ellipse, 3 = the paper's, 4 = each from its own data, all small.
// PASS: 1 = visibility, 2 = blending. SIZES: the slope texture holds sizes too.

#define TWO_BY_TWO (RULE == 1 || RULE == 4)
#define OWN_DATA (RULE == 2 || RULE == 4)
#define BOXES (RULE == 2 || RULE == 3)

struct Task {
    uint uv;         // u0 | v0 << 16, pixel of the view
    uint count;      // columns | rows << 16
    uint atlasXY;    // x | y << 16 of that pixel in the textures
    uint viewLayer;  // view | layer << 20
    float slopeX, slopeY;  // relative distance per novel pixel (small splats)
    float core2;           // squared radius in which a splat hides what is behind (small ones)
    float tolerance;       // relative distance behind the front that still blends
    float quality;         // weight among views
    float uAcross, vAcross, uDown, vDown;  // half the source pixels that go by per novel pixel
    uint tilesFrom, tilesTo;  // column | row << 16 of the tiles of the frame that it may touch
    float nearest;            // nothing of its splats is nearer to the camera
};
#if RASTER
uniform usamplerBuffer taskBuffer;
Task taskAt(uint i) {
    int at = int(i) * 4;
    uvec4 a = texelFetch(taskBuffer, at);
    vec4 b = uintBitsToFloat(texelFetch(taskBuffer, at + 1));
    vec4 c = uintBitsToFloat(texelFetch(taskBuffer, at + 2));
    uvec4 d = texelFetch(taskBuffer, at + 3);
    return Task(a.x, a.y, a.z, a.w, b.x, b.y, b.z, b.w, c.x, c.y, c.z, c.w, uintBitsToFloat(d.x),
                d.y, d.z, uintBitsToFloat(d.w));
}
#else
layout(std430, binding = 1) readonly buffer TaskBuffer { Task tasks[]; };
Task taskAt(uint i) { return tasks[i]; }
#endif

AT(0) uniform sampler2DArray colourTexture;
AT(1) uniform sampler2DArray depthTexture;
AT(2) uniform sampler2DArray normalTexture;
AT(3) uniform isampler2DArray slopeTexture;

const float kFarAway = 3.0e38;
const float kSigmaSource2 = kSigmaSource * kSigmaSource, kSigmaPixel2 = kSigmaPixel * kSigmaPixel;

struct Point {
    Task task;
    View view;
    ivec3 texel;
    vec3 a, h;     // of its pixel; see View
    float source;  // distance in the reference view
    vec2 pixel;    // novel frame, centres at whole numbers
    float dist;    // from the novel camera
};

// False for background, points behind the novel camera and lanes past the end.
bool fetchPoint(uint task, uint lane, out Point p) {
    Task t = taskAt(task);
    uint dx = lane & 15u, dy = lane >> 4u;
    if (dx >= (t.count & 0xffffu) || dy >= (t.count >> 16u)) return false;
    uint atlas = t.atlasXY, viewLayer = t.viewLayer, uv = t.uv;
    p.texel = ivec3((atlas & 0xffffu) + dx, (atlas >> 16u) + dy, viewLayer >> 20u);
    p.source = texelFetch(depthTexture, p.texel, 0).r;
    if (!(p.source < kFarAway)) return false;
    float u = float((uv & 0xffffu) + dx), v = float((uv >> 16u) + dy);
    View view = viewAt(viewLayer & 0xfffffu);
    p.task = t;
    p.view = view;
    p.a = view.a0.xyz + view.au.xyz * u + view.av.xyz * v;
    p.h = p.a * p.source + (view.b0.xyz + view.bu.xyz * u + view.bv.xyz * v);
    p.dist = p.h.z;
    if (!(p.dist > kNearest)) return false;
#if TRANSLUCENT
    // Pixels less than half covered belong to the silhouette: they lend colour but hide nothing.
    float alpha = texelFetch(colourTexture, p.texel, 0).a;
#if PASS == 1 && RULE != 0
    if (!(alpha > 0.5)) return false;
#else
    if (!(alpha > 0.0)) return false;
#endif
#endif
    p.pixel = novelAxisX.w != 0.0 ? p.h.xy : p.h.xy / p.h.z;
    return true;
}

vec4 pointColour(Point p) { return texelFetch(colourTexture, p.texel, 0); }
vec3 pointNormal(Point p) { return texelFetch(normalTexture, p.texel, 0).xyz; }

// The low-pass filter over an output pixel: close to a Gaussian of sigma 0.35, zero from 1 on.
vec2 lowPass(vec2 squared) {
    vec2 a = 1.0 - squared, b = a * a;
    return b * b;
}

// Fainter than 1/64 a small splat's weight is not worth its atomics, unless it closes the surface.
bool worthwhile(float kernel, float radius2, float core2) {
    return kernel > 1.0 / 64.0 || radius2 <= core2;
}

// A splat's footprint. Small: the 2x2 pixels around, q and core2 in squared pixels. Else an
// ellipse: q(d) = (xx, 2 xy, yy) . (dx dx, dx dy, dy dy), d in pixels from the point.
struct Splat {
    bool small;
    vec3 q;
    vec2 reach;    // of the bounding box
    float core2;   // q up to which it hides what is behind
    vec2 slope;    // distance per pixel
    float quality;
    vec4 steps;    // uAcross, vAcross, uDown, vDown; zero where colour must not be continued
};

float squaredRadius(Splat s, vec2 d) {
    return s.small ? dot(d, d) : s.q.x * d.x * d.x + s.q.y * d.x * d.y + s.q.z * d.y * d.y;
}

// Weight at d, whose squaredRadius is q. Ellipses fall off like a Gaussian and end at kReach2.
float kernelAt(Splat s, vec2 d, float q) {
    if (s.small) {
        vec2 k = lowPass(min(d * d, vec2(1.0)));
        return k.x * k.y;
    }
    float fall = max(0.0, 1.0 - q * (1.0 / kReach2));
    return fall * fall * fall;
}

// False when the splat faces away.
bool splatOf(Point p, out Splat s) {
#if RULE <= 1
    s.small = true;
    s.core2 = p.task.core2;
    s.slope = vec2(p.task.slopeX, p.task.slopeY) * p.dist;
    s.quality = p.task.quality;
    s.steps = vec4(p.task.uAcross, p.task.vAcross, p.task.uDown,
                   p.task.vDown);
    return true;
#elif RULE == 3
    float radius =
        min(max(0.5, 0.5 * novelPosition.w * (novelAxisX.w != 0.0 ? 1.0 : 1.0 / p.dist)), kLargest);
    s.small = false;
    s.q = vec3(1.0, 0.0, 1.0) * (kReach2 / (radius * radius));
    s.reach = vec2(radius);
    s.core2 = kReach2;
    s.slope = vec2(0.0);
    s.quality = 1.0;
    s.steps = vec4(0.0);
    return true;
#else
    View view = p.view;
    float inverse = novelAxisX.w != 0.0 ? 1.0 : 1.0 / p.h.z;
    float back = novelAxisX.w != 0.0 ? 0.0 : 1.0;
    ivec4 coded = texelFetch(slopeTexture, p.texel, 0);
    bool linked = (coded.x & 1) != 0, rim = (coded.y & 1) != 0;
    float spacing = view.a0.w != 0.0 ? 1.0 : p.source;
    vec2 tilt = vec2(coded.xy) * (spacing / kSlopeScale) / vec2(view.au.w, view.av.w);
    vec3 hu = view.au.xyz * p.source + view.bu.xyz + p.a * tilt.x;
    vec3 hv = view.av.xyz * p.source + view.bv.xyz + p.a * tilt.y;
    vec2 eu = (hu.xy - back * p.pixel * hu.z) * inverse;
    vec2 ev = (hv.xy - back * p.pixel * hv.z) * inverse;
    float det = eu.x * ev.y - ev.x * eu.y;
    if (!(det > 0.0)) return false;
#if SIZES
    float size = float(coded.z) * (1.0 / 64.0);
#else
    const float size = 1.0;
#endif
    vec2 longer = eu + ev, other = eu - ev;
    float cover2 = size * size * 0.25 * max(dot(longer, longer), dot(other, other));
    s.small = RULE == 4 || cover2 < kSmallCover2;
    // The plane's distance per pixel; nearly edge-on it would run away.
    vec2 relative = vec2(hu.z * ev.y - hv.z * eu.y, hv.z * eu.x - hu.z * ev.x) / (det * p.h.z);
    s.slope = clamp(relative, vec2(-kSteepestPlane), vec2(kSteepestPlane)) * p.dist;
    float density = 1.0 / max(1.0, max(dot(eu, eu), dot(ev, ev)));
    s.quality = p.task.quality * (linked ? 1.0 : kEdgeQuality) *
                max(density * density, kLeastDensity);
    float fade = linked ? clamp(det / kFadeTo - 1.0, 0.0, 1.0) : 0.0;
    s.steps = vec4(ev.y, -eu.y, -ev.x, eu.x) * (fade * 0.5 * kGradient / det);
    if (s.small) {
        // At its rim the surface ends within half a sample.
        s.core2 = max(0.5, 1.08 * cover2) * (rim ? kRimCore2 : 1.0);
        return true;
    }
    s.core2 = kCore2;
    float k = kSigmaSource2 * size * size;
    float vxx = k * (eu.x * eu.x + ev.x * ev.x) + kSigmaPixel2;
    float vyy = k * (eu.y * eu.y + ev.y * ev.y) + kSigmaPixel2;
    float vxy = k * (eu.x * eu.y + ev.x * ev.y);
    // vxx vyy - vxy vxy without cancellation.
    float determinant = k * k * det * det + kSigmaPixel2 * (vxx + vyy - kSigmaPixel2);
    s.q = vec3(vyy, -2.0 * vxy, vxx) / determinant;
    s.reach = min(sqrt(kReach2 * vec2(vxx, vyy)), vec2(kLargest));
    return true;
#endif
}

// Change of a point's colour per novel pixel across and down, from its four neighbours.
void colourGradient(Point p, vec4 steps, out vec3 across, out vec3 down) {
    across = down = vec3(0.0);
    if (steps.x == 0.0 && steps.w == 0.0) return;
    vec3 u = texelFetchOffset(colourTexture, p.texel, 0, ivec2(1, 0)).rgb -
             texelFetchOffset(colourTexture, p.texel, 0, ivec2(-1, 0)).rgb;
    vec3 v = texelFetchOffset(colourTexture, p.texel, 0, ivec2(0, 1)).rgb -
             texelFetchOffset(colourTexture, p.texel, 0, ivec2(0, -1)).rgb;
    across = steps.x * u + steps.y * v;
    down = steps.z * u + steps.w * v;
}

// Fetching a point of the object and laying out its splat; the twin of
// lib/render/cpu/splat_kernels.cpp. Needs splat_frame.glsl.
// RULE: 0 = one pixel, 1 = small splats (2x2 pixels), 2 = ellipses from the data, 3 = the paper's.
// PASS: 1 = visibility, 2 = blending. SIZES: the slope texture holds sizes too.

struct Task {
    uint uv;         // u0 | v0 << 16, pixel of the view
    uint count;      // columns | rows << 16
    uint atlasXY;    // x | y << 16 of that pixel in the textures
    uint viewLayer;  // view | layer << 20
    float slopeX, slopeY;  // relative distance per novel pixel (small splats)
    float core2;           // squared radius in which a splat hides what is behind (small ones)
    float tolerance;       // relative distance behind the front that still blends
    float quality;         // weight among views
    float pad0, pad1, pad2;
};
layout(std430, binding = 1) readonly buffer TaskBuffer { Task tasks[]; };

layout(binding = 0) uniform sampler2DArray colourTexture;
layout(binding = 1) uniform sampler2DArray depthTexture;
layout(binding = 2) uniform sampler2DArray normalTexture;
layout(binding = 3) uniform isampler2DArray slopeTexture;

const float kFarAway = 3.0e38;
const float kNearest = 1.0e-12;
const float kSlopeScale = 2048.0;
const float kSigmaSource2 = SIGMA_SOURCE_2, kSigmaPixel2 = SIGMA_PIXEL_2;
const float kReach2 = REACH_2, kCore2 = CORE_2, kLargest = LARGEST;

struct Point {
    uint task;
    uint view;
    ivec3 texel;
    vec3 a, h;     // of its pixel; see View
    float source;  // distance in the reference view
    vec2 pixel;    // novel frame, centres at whole numbers
    float dist;    // from the novel camera
};

// False for background, points behind the novel camera and lanes past the end.
bool fetchPoint(uint task, uint lane, out Point p) {
    p.task = task;
    uint dx = lane & 15u, dy = lane >> 4u;
    uint count = tasks[task].count;
    if (dx >= (count & 0xffffu) || dy >= (count >> 16u)) return false;
    uint atlas = tasks[task].atlasXY, viewLayer = tasks[task].viewLayer, uv = tasks[task].uv;
    p.view = viewLayer & 0xfffffu;
    p.texel = ivec3((atlas & 0xffffu) + dx, (atlas >> 16u) + dy, viewLayer >> 20u);
    p.source = texelFetch(depthTexture, p.texel, 0).r;
    if (!(p.source < kFarAway)) return false;
    float u = float((uv & 0xffffu) + dx), v = float((uv >> 16u) + dy);
    p.a = views[p.view].a0.xyz + views[p.view].au.xyz * u + views[p.view].av.xyz * v;
    p.h = p.a * p.source + (views[p.view].b0.xyz + views[p.view].bu.xyz * u + views[p.view].bv.xyz * v);
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

#if RULE >= 2
// The same for ellipses: where their kernel is 1/64. Silhouettes are made of faint ones, too.
const float kFaint2 = RULE == 3 || TRANSLUCENT == 1 ? kReach2 : 0.75 * kReach2;

// q(d) = (xx, 2 xy, yy) . (dx dx, dx dy, dy dy), d in pixels from the point.
struct Ellipse {
    vec3 q;
    vec2 reach;    // of the bounding box
    float core2;   // q up to which it hides what is behind
    vec2 slope;    // distance per pixel
};

// False when the splat faces away.
bool ellipseOf(Point p, out Ellipse e) {
#if RULE == 3
    float radius = max(0.5, 0.5 * novelPosition.w * (novelAxisX.w != 0.0 ? 1.0 : 1.0 / p.dist));
    e.q = vec3(1.0, 0.0, 1.0) * (kReach2 / (radius * radius));
    e.reach = vec2(min(radius, kLargest));
    e.core2 = kReach2;
    e.slope = vec2(0.0);
    return true;
#else
    View view = views[p.view];
    float inverse = novelAxisX.w != 0.0 ? 1.0 : 1.0 / p.h.z;
    float back = novelAxisX.w != 0.0 ? 0.0 : 1.0;
    ivec4 coded = texelFetch(slopeTexture, p.texel, 0);
    float spacing = view.a0.w != 0.0 ? 1.0 : p.source;
    vec2 slope = vec2(coded.xy) * (spacing / kSlopeScale) / vec2(view.au.w, view.av.w);
    vec3 hu = view.au.xyz * p.source + view.bu.xyz + p.a * slope.x;
    vec3 hv = view.av.xyz * p.source + view.bv.xyz + p.a * slope.y;
    vec2 eu = (hu.xy - back * p.pixel * hu.z) * inverse;
    vec2 ev = (hv.xy - back * p.pixel * hv.z) * inverse;
    float det = eu.x * ev.y - ev.x * eu.y;
    if (!(det > 0.0)) return false;
#if SIZES
    float size = float(coded.z) * (1.0 / 64.0);
#else
    const float size = 1.0;
#endif
    float k = kSigmaSource2 * size * size;
    float vxx = k * (eu.x * eu.x + ev.x * ev.x) + kSigmaPixel2;
    float vyy = k * (eu.y * eu.y + ev.y * ev.y) + kSigmaPixel2;
    float vxy = k * (eu.x * eu.y + ev.x * ev.y);
    // vxx vyy - vxy vxy without cancellation.
    float determinant = k * k * det * det + kSigmaPixel2 * (vxx + vyy - kSigmaPixel2);
    e.q = vec3(vyy, -2.0 * vxy, vxx) / determinant;
    e.reach = min(sqrt(kFaint2 * vec2(vxx, vyy)), vec2(kLargest));
    e.core2 = kCore2;
    // The plane's distance per pixel; nearly edge-on it would run away.
    vec2 relative = vec2(hu.z * ev.y - hv.z * eu.y, hv.z * eu.x - hu.z * ev.x) / (det * p.h.z);
    e.slope = clamp(relative, vec2(-0.05), vec2(0.05)) * p.dist;
    return true;
#endif
}

float squaredRadius(vec3 q, vec2 d) { return q.x * d.x * d.x + q.y * d.x * d.y + q.z * d.y * d.y; }

// Falls off like a Gaussian and reaches zero at kReach2.
float ellipseKernel(float q) {
    float fall = max(0.0, 1.0 - q * (1.0 / kReach2));
    return fall * fall * fall;
}
#endif

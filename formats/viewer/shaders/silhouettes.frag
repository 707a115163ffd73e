// Gives the outline the coverage of what lies within its outermost points, or where these are too few that
// which the views' alpha saw: lib/render/outline/outlines.cpp and silhouettes.cpp.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;
uniform sampler2D pictureTexture, frontTexture, directionTexture, outlineTexture;
uniform sampler2DArray coverTexture;  // a layer for each view: coverage, and what is around (scene.js)
uniform sampler2D viewTable;          // where the frame's pixels are in each view; six texels
uniform int viewCount;
uniform float farthest, pixelSize;    // of a pixel at distance 1
uniform bool carve, hasGlass;         // some view shows glass
out vec4 picture;

const int kReach = 2, kSamples = 4, kAll = (1 << (kSamples * kSamples)) - 1, kStepCount = 14;
const float kFree = 0.43;
const float kDepthSteps[kStepCount] =
    float[kStepCount](0.0, 1.0, 3.0, -2.0, 5.0, 8.0, -5.0, 12.0, 17.0, -10.0, 24.0, 32.0, -18.0, 44.0);

const float kEnoughPoints = 12.0;

// Area of the part of a unit square, centred at the origin, on which dot(n, x) < t; n has length 1.
float areaBelow(float t, vec2 n) {
    float a = max(abs(n.x), abs(n.y)), b = min(abs(n.x), abs(n.y));
    float mid = 0.5 * (a + b), size = abs(t);
    if (size >= mid) return t > 0.0 ? 1.0 : 0.0;
    if (size <= 0.5 * (a - b)) return 0.5 + t / a;
    float corner = (mid - size) * (mid - size) / (2.0 * a * b);
    return t > 0.0 ? 1.0 - corner : corner;
}

float frontAt(ivec2 at) { return texelFetch(frontTexture, clamp(at, ivec2(0), textureSize(frontTexture, 0) - 1), 0).r; }

// Where a pixel's ray is in a view at a distance: h before its division, p the pixel there, and what is around
// it; false where the view does not show it.
bool intoView(int n, vec2 pixel, float dist, out vec3 h, out vec2 p, out bool flatView, out int layer, out float around) {
    vec4 a0 = texelFetch(viewTable, ivec2(0, n), 0), au = texelFetch(viewTable, ivec2(1, n), 0);
    vec4 av = texelFetch(viewTable, ivec2(2, n), 0), b0 = texelFetch(viewTable, ivec2(3, n), 0);
    h = (a0.xyz + au.xyz * pixel.x + av.xyz * pixel.y) * dist + b0.xyz;
    flatView = a0.w != 0.0;
    layer = int(b0.w);
    if (!(h.z > 0.0)) return false;
    p = flatView ? h.xy : h.xy / h.z;
    if (any(lessThan(p, vec2(-0.5))) || any(greaterThanEqual(p, vec2(au.w, av.w) - 0.5))) return false;
    around = texelFetch(coverTexture, ivec3(ivec2(floor(p + 0.5)), layer), 0).g;
    return true;
}

// The samples of a pixel through which some view sees past the object, at a distance.
int freeSamples(vec2 pixel, float dist) {
    int free = 0;
    for (int n = 0; n < viewCount; ++n) {
        vec4 au = texelFetch(viewTable, ivec2(1, n), 0), av = texelFetch(viewTable, ivec2(2, n), 0);
        vec3 h;
        vec2 p;
        bool flatView;
        int layer;
        float around;
        if (!intoView(n, pixel, dist, h, p, flatView, layer, around)) continue;
        vec2 size = vec2(au.w, av.w);
        if (around > 0.9) continue;
        if (around < 0.1) return kAll;
        // Within a pixel the way into a reference is as good as affine.
        vec3 hu = h + au.xyz * dist, hv = h + av.xyz * dist;
        vec2 right = (flatView ? hu.xy : hu.xy / hu.z) - p, down = (flatView ? hv.xy : hv.xy / hv.z) - p;
        for (int k = 0; k < kSamples * kSamples; ++k) {
            vec2 d = (vec2(k % kSamples, k / kSamples) + 0.5) / float(kSamples) - 0.5;
            vec2 s = p + right * d.x + down * d.y;
            // At the border of a view nothing is known.
            if (any(lessThan(s, vec2(0.0))) || any(greaterThanEqual(s, size - 1.0))) continue;
            float cover = textureLod(coverTexture, vec3((s + 0.5) / vec2(textureSize(coverTexture, 0).xy), float(layer)), 0.0).r;
            if (cover < kFree) free |= 1 << k;
        }
        if (free == kAll) break;
    }
    return free;
}

// The share of a pixel that no view sees past at any depth around a distance.
float coveredAt(vec2 pixel, float dist) {
    int free = kAll;
    for (int k = 0; k < kStepCount; ++k) {
        float there = dist * (1.0 + kDepthSteps[k] * pixelSize);
        if (!(there > 0.0)) continue;
        free &= freeSamples(pixel, there);
        if (free == 0) break;
    }
    float covered = float(kSamples * kSamples);
    for (int k = 0; k < kSamples * kSamples; ++k) covered -= float((free >> k) & 1);
    return covered / float(kSamples * kSamples);
}

// Whether some view shows glass there or beside it.
bool nearGlass(vec2 pixel, float dist) {
    for (int n = 0; n < viewCount; ++n) {
        vec3 h;
        vec2 p;
        bool flatView;
        int layer;
        float around;
        if (intoView(n, pixel, dist, h, p, flatView, layer, around) && (int(around * 255.0 + 0.5) & 1) != 0) return true;
    }
    return false;
}

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy), last = textureSize(pictureTexture, 0) - 1;
    picture = texelFetch(pictureTexture, at, 0);
    if (!carve || !(picture.a > 0.0)) return;
    bool near = false;
    float most = 0.0;  // alpha around: some pixels are covered in part
    for (int y = -kReach; y <= kReach; ++y)
        for (int x = -kReach; x <= kReach; ++x) {
            ivec2 beside = at + ivec2(x, y);
            if (any(lessThan(beside, ivec2(0))) || any(greaterThan(beside, last))) continue;
            float alpha = texelFetch(pictureTexture, beside, 0).a;
            near = near || !(alpha > 0.0);
            most = max(most, alpha);
        }
    if (!near) return;
    vec4 reach = texelFetch(outlineTexture, at, 0);
    float front = frontAt(at);
    // A pixel that was closed, or is only grazed: the nearest around it.
    for (int k = 0; k < 9 && !(frontAt(at) < 1.0); ++k) front = min(front, frontAt(at + ivec2(k % 3, k / 3) - 1));
    float covered, dist = front * farthest;
    if (reach.a >= kEnoughPoints) {
        vec2 outward = texelFetch(directionTexture, at, 0).xy;
        covered = max(0.0, areaBelow(reach.r, outward) - areaBelow(-reach.g, outward));
    } else {
        if (!(front < 1.0)) return;
        covered = coveredAt(vec2(at), dist);
    }
    // Something opaque around it does not make glass opaque.
    if (hasGlass && front < 1.0 && nearGlass(vec2(at), dist)) covered = min(covered * most, picture.a);
    picture *= covered / picture.a;
}

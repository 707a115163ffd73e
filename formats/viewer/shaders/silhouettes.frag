// Gives the outline the coverage of what lies within its outermost points, or where these are too few that
// which the views' alpha saw: lib/render/outline/outlines.cpp and silhouettes.cpp.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;
uniform sampler2D pictureTexture, frontTexture, directionTexture, outlineTexture;
uniform sampler2DArray coverTexture;  // a layer for each view: alpha, and what is around (scene.js)
uniform sampler2D viewTable;          // where the frame's pixels are in each view; six texels
uniform int viewCount;
uniform float farthest, pixelSize;    // of a pixel at distance 1
uniform bool carve;
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

// The samples of a pixel through which some view sees past the object, at a distance.
int freeSamples(vec2 pixel, float dist) {
    int free = 0;
    for (int n = 0; n < viewCount; ++n) {
        vec4 a0 = texelFetch(viewTable, ivec2(0, n), 0), au = texelFetch(viewTable, ivec2(1, n), 0);
        vec4 av = texelFetch(viewTable, ivec2(2, n), 0), b0 = texelFetch(viewTable, ivec2(3, n), 0);
        vec3 h = (a0.xyz + au.xyz * pixel.x + av.xyz * pixel.y) * dist + b0.xyz;
        bool flatView = a0.w != 0.0;
        if (!(h.z > 0.0)) continue;
        vec2 p = flatView ? h.xy : h.xy / h.z, size = vec2(au.w, av.w);
        if (any(lessThan(p, vec2(-0.5))) || any(greaterThanEqual(p, size - 0.5))) continue;
        float around = texelFetch(coverTexture, ivec3(ivec2(floor(p + 0.5)), int(b0.w)), 0).g;
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
            float cover = textureLod(coverTexture, vec3((s + 0.5) / vec2(textureSize(coverTexture, 0).xy), b0.w), 0.0).r;
            if (cover < kFree) free |= 1 << k;
        }
        if (free == kAll) break;
    }
    return free;
}

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy), last = textureSize(pictureTexture, 0) - 1;
    picture = texelFetch(pictureTexture, at, 0);
    if (!carve || !(picture.a > 0.0)) return;
    bool near = false;
    for (int y = -kReach; y <= kReach; ++y)
        for (int x = -kReach; x <= kReach; ++x) {
            ivec2 beside = at + ivec2(x, y);
            if (any(lessThan(beside, ivec2(0))) || any(greaterThan(beside, last))) continue;
            near = near || !(texelFetch(pictureTexture, beside, 0).a > 0.0);
        }
    if (!near) return;
    vec4 reach = texelFetch(outlineTexture, at, 0);
    if (reach.a >= kEnoughPoints) {
        vec2 outward = texelFetch(directionTexture, at, 0).xy;
        picture *= max(0.0, areaBelow(reach.r, outward) - areaBelow(-reach.g, outward)) / picture.a;
        return;
    }
    float front = frontAt(at);
    // A pixel that was closed, or is only grazed: the nearest around it.
    for (int k = 0; k < 9 && !(frontAt(at) < 1.0); ++k) front = min(front, frontAt(at + ivec2(k % 3, k / 3) - 1));
    if (!(front < 1.0)) return;
    float dist = front * farthest;
    int free = kAll;
    for (int k = 0; k < kStepCount; ++k) {
        float there = dist * (1.0 + kDepthSteps[k] * pixelSize);
        if (!(there > 0.0)) continue;
        free &= freeSamples(vec2(at), there);
        if (free == 0) break;
    }
    float covered = float(kSamples * kSamples);
    for (int k = 0; k < kSamples * kSamples; ++k) covered -= float((free >> k) & 1);
    picture *= covered / float(kSamples * kSamples) / picture.a;
}

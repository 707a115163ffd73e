// What is known of each pixel before any camera is, as lib/render/splat/prepared.cpp finds it: the tilt of
// its surface, from the file's splats, else its normals, else the neighbours' depths; and its normal.
#include "formats/viewer/shaders/scene.glsl"
uniform sampler2D givenNormals;  // 0..1, zero = none
uniform sampler2D givenSplats;   // tilt along u and v, size; zero = none
uniform bvec2 given;                  // normals, splats
uniform sampler2D glassTexture;       // how much of a texel glass covers (scene.js)
uniform bool hasGlass;
uniform ivec4 area;                   // first texel, size
uniform ivec4 around;                 // texels on the left, on top, right and below that show the view, too
uniform vec4 sourceLens;              // fx, fy, cx, cy
uniform vec4 planes;                  // near, far, dmax, 1 = orthographic
uniform mat3 worldFromSource;
uniform int layer;
layout(location = 0) out ivec4 slopeOut;
layout(location = 1) out vec4 normalOut;

const float kSteepest = 8.0, kAlike = 0.05, kSteepestRim = 1.0, kCreaseFactor = 3.0, kCreaseMore = 0.5;
const float kNone = 3.0e38;
const float kHalfGlass = 127.5 / 255.0;  // lib/render/scene/glass_pages.hpp

bool orthographic() { return planes.w != 0.0; }
ivec3 texelAt(ivec2 at) { return ivec3(area.xy + at, layer); }
bool shows(ivec2 at) {
    return all(greaterThanEqual(at, -around.xy)) && all(lessThan(at, area.zw + around.zw));
}
float depthOf(ivec2 at) {
    if (!shows(at)) return kNone;
    uint code = texelFetch(depthTexture, texelAt(at), 0).r;
    return code == 0u ? kNone : distanceOf(code, planes.x, planes.y, planes.z);
}
float alphaOf(ivec2 at) { return texelFetch(colourTexture, texelAt(at), 0).a; }

vec3 rayOf(vec2 at) {
    if (orthographic()) return vec3(0.0, 0.0, -1.0);
    return vec3((at.x + 0.5 - sourceLens.z) / sourceLens.x, -(at.y + 0.5 - sourceLens.w) / sourceLens.y, -1.0);
}
vec2 slopeFromNormal(vec3 n, vec3 ray) {
    float towards = dot(n, ray);
    if (!(towards < -1e-3 * length(n))) return vec2(0.0);
    return vec2(-n.x / towards, n.y / towards);
}
vec3 normalFromSlope(vec2 slope, vec3 ray) {
    return normalize(cross(vec3(0.0, -1.0, 0.0) + slope.y * ray, vec3(1.0, 0.0, 0.0) + slope.x * ray));
}
float tangent(float change, float f, float other) { return other < kNone ? change * (orthographic() ? f : f / other) : kNone; }

// Step k along `way`, from pixel k - 1 to pixel k.
float stepOf(ivec2 at, ivec2 way, int k) {
    float from = depthOf(at + (k - 1) * way), to = depthOf(at + k * way);
    return from < kNone ? tangent(to - from, way.x != 0 ? sourceLens.x : sourceLens.y, to) : kNone;
}
bool alike(ivec2 at, ivec2 way, int k, float slope, float z) {
    float there = stepOf(at, way, k);
    if (!(there < kNone)) return false;
    return abs(there * (orthographic() ? 1.0 : z / depthOf(at + (k - 1) * way)) - slope) <= kAlike * abs(slope);
}
// One surface: not too steep, or three steps alike.
bool sameAlong(ivec2 at, ivec2 way, float slope, float z) {
    if (abs(slope) <= kSteepest) return true;
    if (!(slope < kNone)) return false;
    int on = 0, back = 0;
    if (alike(at, way, 2, slope, z)) on = alike(at, way, 3, slope, z) ? 2 : 1;
    if (alike(at, way, 0, slope, z)) back = alike(at, way, -1, slope, z) ? 2 : 1;
    return on + back >= 2;
}
float slopeFrom(float a, bool hasA, float b, bool hasB) {
    if (hasA && hasB) {
        if (abs(a) > kCreaseFactor * abs(b) + kCreaseMore) return b;
        if (abs(b) > kCreaseFactor * abs(a) + kCreaseMore) return a;
        return 0.5 * (a + b);
    }
    return hasA ? a : hasB ? b : 0.0;
}

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy) - area.xy;
    float z = depthOf(at);
    slopeOut = ivec4(0, 0, 64, 0);
    normalOut = vec4(0.5);
    if (!(z < kNone)) return;
    // Right, left, below, above.
    const ivec2 kWays[4] = ivec2[4](ivec2(1, 0), ivec2(-1, 0), ivec2(0, 1), ivec2(0, -1));
    vec4 steps;  // away from here
    bvec4 same;
    for (int k = 0; k < 4; ++k) {
        steps[k] = stepOf(at, kWays[k], 1);
        same[k] = sameAlong(at, kWays[k], steps[k], z);
    }
    vec3 ray = rayOf(vec2(at));
    vec3 given3 = texelFetch(givenNormals, texelAt(at).xy, 0).xyz;
    bool hasNormal = given.x && given3 != vec3(0.0), hasSplat = false;
    vec3 normal = normalize(given3 * 2.0 - 1.0);
    vec2 slope;
    if (given.y) {
        vec3 code = texelFetch(givenSplats, texelAt(at).xy, 0).xyz * 255.0;
        hasSplat = code.z > 0.0;
        slope = tan((code.xy - 128.0) / 127.0 * atan(kSteepest));
        if (hasSplat) slopeOut.z = int(code.z + 0.5);
    }
    if (!hasSplat && hasNormal)
        slope = slopeFromNormal(transpose(worldFromSource) * normal, ray);
    else if (!hasSplat)
        slope = vec2(slopeFrom(-steps.y, same.y, steps.x, same.x), slopeFrom(-steps.w, same.w, steps.z, same.z));

    bool linked = alphaOf(at) >= 1.0;
    bvec4 behind;
    for (int k = 0; k < 4; ++k) {
        ivec2 beside = at + kWays[k];
        behind[k] = false;
        if (!shows(beside)) {
            linked = false;
            continue;
        }
        if (!same[k] || alphaOf(beside) < 1.0) linked = false;
        behind[k] = !same[k] && depthOf(beside) > z;
    }
    // What is one pixel thin has no rim: it would break into dots.
    bool thin = (behind.x && behind.y) || (behind.z && behind.w);
    bool rim = !thin && any(behind);
    if (rim && !hasSplat) slope = clamp(slope, vec2(-kSteepestRim), vec2(kSteepestRim));
    ivec2 coded = ivec2(round(clamp(slope, vec2(-kSteepest), vec2(kSteepest)) * kSlopeScale));
    // Points of glass are never linked: the bit says of those that are not opaque that they are glass.
    bool isGlass = hasGlass && texelFetch(glassTexture, texelAt(at).xy, 0).r > kHalfGlass;
    slopeOut.xy = (coded & ivec2(~1)) | ivec2(linked || isGlass, rim);
    if (!hasNormal) normal = worldFromSource * normalFromSlope(slope, ray);
    normalOut = vec4(normal * 0.5 + 0.5, 1.0);
}

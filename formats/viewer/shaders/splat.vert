// A vertex is a point. PASS 1 finds the front of each pixel, PASS 2 adds the colours of what lies there.
#include "formats/viewer/shaders/points.glsl"
uniform sampler2DArray normalTexture;
uniform vec4 lens;        // 1 / fx, 1 / fy, cx, cy: pixel centres at whole numbers
uniform float splatSize;  // 1 = what the data says
uniform float mostReach;  // the largest point that the device draws, halved

uniform sampler2D smoothTexture;  // a texel for each block

layout(location = 0) in uvec4 block;  // u0 | v0 << 16, columns | rows << 16, rectangle, number

flat out vec3 centre;  // pixel, distance
flat out vec3 inverse;
flat out vec4 shape;   // small, core2, slope
flat out vec2 boxReach;  // pixels from the centre to the sides of what is drawn
#if PASS == 2
flat out vec4 colour;
flat out vec3 across, down, normal;
flat out vec2 weighing;  // quality, tolerance
#endif

const uint kBlockColumns = 1024u;  // of the texture of blocks
// How far behind the front a point still belongs to it; see lib/render/splat/plan.cpp for these.
const float kTolerance = 0.01, kToleranceRough = 0.02;
const float kLeastQuality = 0.01;

// Views that look from about where the novel camera looks from count more.
float qualityOf(int rectangle, Point p) {
    vec4 eye = rectangleEntry(rectangle, 6), forward = rectangleEntry(rectangle, 7);
    vec2 ray = (p.pixel - lens.zw) * lens.xy * vec2(1.0, -1.0);
    vec3 point = vec3(ray * p.dist, -p.dist);
    vec3 fromSource = p.view.a0.w != 0.0 ? forward.xyz : normalize(point - eye.xyz);
    float angle = max(0.0, dot(fromSource, normalize(point)));
    return kLeastQuality + angle * angle * angle * angle;
}

// Change of colour per novel pixel across and down, from the four neighbours.
void colourGradient(ivec3 texel, vec4 steps, out vec3 toRight, out vec3 toBottom) {
    toRight = toBottom = vec3(0.0);
    if (steps.x == 0.0 && steps.w == 0.0) return;
    vec3 u = texelFetch(colourTexture, texel + ivec3(1, 0, 0), 0).rgb - texelFetch(colourTexture, texel - ivec3(1, 0, 0), 0).rgb;
    vec3 v = texelFetch(colourTexture, texel + ivec3(0, 1, 0), 0).rgb - texelFetch(colourTexture, texel - ivec3(0, 1, 0), 0).rgb;
    toRight = steps.x * u + steps.y * v;
    toBottom = steps.z * u + steps.w * v;
}

void main() {
    gl_Position = vec4(0.0, 0.0, -2.0, 1.0);  // outside: not drawn
    gl_PointSize = 1.0;
    uint u, v;
    ivec3 texel;
    if (!texelOf(block.xyz, u, v, texel)) return;
    int rectangle = int(block.z);
    uint code = texelFetch(depthTexture, texel, 0).r;
    if (code == 0u) return;
    vec4 rgba = texelFetch(colourTexture, texel, 0);
    // Pixels less than half covered belong to the silhouette: they lend colour but hide nothing.
    if (!(rgba.a > 0.0) || (PASS == 1 && !hides(texel, rgba.a))) return;

    Point p = pointOf(rectangle, code, rgba.a);
    if (!placePoint(p, float(u), float(v))) return;
    p.task.quality = qualityOf(rectangle, p);
    ivec4 coded = texelFetch(slopeTexture, texel, 0);
    Splat splat;
    if (!ownSplat(p, coded.x, coded.y, float(coded.z) / 64.0 * splatSize, false, splat)) return;

    vec2 at = floor(p.pixel) + 1.0;  // a small splat: the corner that 2x2 pixels share
    float side = 2.0;
    if (!splat.small) {
        // The point is held inside the frame, or a device would drop what reaches in from outside.
        vec2 from = p.pixel + 0.5;
        at = clamp(from, vec2(0.0), frameSize);
        vec2 reach = min(splat.reach, vec2(mostReach)) + abs(from - at);
        if (any(greaterThan(abs(from - at), splat.reach))) return;
        side = min(2.0 * max(reach.x, reach.y) + 1.0, 2.0 * mostReach);
    }
    centre = vec3(p.pixel, p.dist);
    inverse = splat.q;
    boxReach = splat.reach;
    shape = vec4(splat.small ? 1.0 : 0.0, splat.core2, splat.slope);
#if PASS == 2
    colour = rgba;
    bool smoothBlock = texelFetch(smoothTexture, ivec2(block.w % kBlockColumns, block.w / kBlockColumns), 0).r > 0.5;
    weighing = vec2(splat.quality, smoothBlock ? kTolerance : kToleranceRough);
    colourGradient(texel, splat.steps, across, down);
    normal = texelFetch(normalTexture, texel, 0).xyz * 2.0 - 1.0;
#endif
    gl_Position = vec4(at / frameSize * 2.0 - 1.0, 0.0, 1.0);
    gl_PointSize = side;
}

// The visibility pass (PASS 1: the least distance, by MIN blending) and the blended pass (PASS
// 2) of the raster pipeline.
#include "splat/splat_points.glsl"
#if PASS == 2
flat in vec4 colour;
flat in vec3 across, down;
flat in vec2 weighing;
#if NORMALS
flat in vec3 normal;
layout(location = 2) out vec4 normalSum;
#endif
layout(location = 0) out vec4 colourSum;  // rgb * alpha * w, w
#if TRANSLUCENT
layout(location = 1) out float alphaSum;
#endif
uniform sampler2D frontTexture;
#else
layout(location = 0) out float frontDistance;
#endif
flat in vec3 centre;
flat in vec3 inverse;
flat in vec4 shape;

void main() {
    vec2 d = gl_FragCoord.xy - 0.5 - float(frame.frameSize.w) - centre.xy;
    float depth = centre.z;
    float kernel = 1.0;
#if RULE != 0
    Splat splat;
    splat.small = TWO_BY_TWO || shape.x != 0.0;
    splat.q = inverse;
    float q = squaredRadius(splat, d);
    depth = depthAt(centre.z, shape.zw, d);
#if PASS == 1
    if (q > shape.y) discard;
#else
    kernel = kernelAt(splat, d, q);
    if (!(kernel > 0.0)) discard;
#if TWO_BY_TWO
    if (!worthwhile(kernel, q, shape.y)) discard;
#endif
#endif
#endif
#if PASS == 1
    frontDistance = depth;
#else
    float nearest = texelFetch(frontTexture, ivec2(gl_FragCoord.xy), 0).r;
    vec3 rgb = colour.rgb;
#if TRANSLUCENT
    rgb *= colour.a;
#endif
#if RULE == 0
    if (depth > nearest) discard;
    float weight = 1.0;
#else
    if (!(depth <= nearest * (1.0 + weighing.y))) discard;
    float weight = kernel * weighing.x;
    rgb += d.x * across + d.y * down;
#endif
    colourSum = vec4(rgb * weight, weight);
#if TRANSLUCENT
    alphaSum = colour.a * weight;
#endif
#if NORMALS
    normalSum = vec4(normal * weight, 0.0);
#endif
#endif
}

// The visibility pass (PASS 1: the least distance, by MIN blending) and the blended pass (PASS 2) of
// the raster pipeline. Needs splat_points.glsl.
#if PASS == 2
flat in vec4 colour;
#if NORMALS
flat in vec3 normal;
layout(location = 2) out vec4 normalSum;
#endif
flat in vec2 weighing;
layout(location = 0) out vec4 colourSum;  // rgb * alpha * w, w
#if TRANSLUCENT
layout(location = 1) out float alphaSum;
#endif
layout(binding = 4) uniform sampler2D frontTexture;
#else
layout(location = 0) out float frontDistance;
#endif
flat in vec3 centre;
#if RULE != 0
flat in vec2 slope;
#endif
#if RULE == 1
flat in float core2;
#elif RULE >= 2
flat in vec3 inverse;
flat in float core2;
#endif

void main() {
    vec2 d = gl_FragCoord.xy - 0.5 - float(frameSize.w) - centre.xy;
    float depth = centre.z;
    float kernel = 1.0;
#if RULE >= 2
    float q = squaredRadius(inverse, d);
    depth = max(depth + dot(slope, d), 0.5 * centre.z);
#if PASS == 1
    if (q > core2) discard;
#else
    if (q >= kFaint2) discard;
    kernel = ellipseKernel(q);
#endif
#elif RULE == 1
    depth += dot(slope, d);
#if PASS == 1
    if (dot(d, d) > core2) discard;
#else
    vec2 k = lowPass(min(d * d, vec2(1.0)));
    kernel = k.x * k.y;
    if (!worthwhile(kernel, dot(d, d), core2)) discard;
#endif
#endif
#if PASS == 1
    frontDistance = depth;
#else
    float nearest = texelFetch(frontTexture, ivec2(gl_FragCoord.xy), 0).r;
#if RULE == 0
    if (depth > nearest) discard;
    float weight = 1.0;
#else
    if (!(depth <= nearest * (1.0 + weighing.y))) discard;
    float weight = kernel * weighing.x;
#endif
#if TRANSLUCENT
    colourSum = vec4(colour.rgb * (colour.a * weight), weight);
    alphaSum = colour.a * weight;
#else
    colourSum = vec4(colour.rgb * weight, weight);
#endif
#if NORMALS
    normalSum = vec4(normal * weight, 0.0);
#endif
#endif
}

// PASS 1 keeps the least distance with the depth test, PASS 2 blends all that lies at the front.
#include "formats/viewer/shaders/scene.glsl"
flat in vec3 centre, inverse;
flat in vec4 shape;
flat in vec2 boxReach;
uniform float farthest;  // distances are depths of 0..1 by this
#if PASS == 2
flat in vec4 colour;
flat in vec3 across, down, normal;
flat in vec2 weighing;
uniform sampler2D frontTexture;
layout(location = 0) out vec4 colourSum;  // rgb * alpha * w, w
layout(location = 1) out vec4 normalSum;  // normal * w, alpha * w
#endif

void main() {
    vec2 d = gl_FragCoord.xy - 0.5 - centre.xy;
    Splat splat;
    splat.small = shape.x != 0.0;
    splat.q = inverse;
    if (splat.small && any(greaterThanEqual(abs(d), vec2(1.0)))) discard;
    // A point is a square, larger than the splat's box.
    if (!splat.small && any(greaterThan(abs(d), boxReach))) discard;
    float q = squaredRadius(splat, d);
    float depth = depthAt(centre.z, shape.zw, d);
#if PASS == 1
    if (q > shape.y) discard;
    gl_FragDepth = depth / farthest;
#else
    float kernel = kernelAt(splat, d, q);
    if (!(kernel > 0.0)) discard;
    if (splat.small && !worthwhile(kernel, q, shape.y)) discard;
    float front = texelFetch(frontTexture, ivec2(gl_FragCoord.xy), 0).r * farthest;
    if (!(depth <= front * (1.0 + weighing.y))) discard;
    float weight = kernel * weighing.x;
    vec3 rgb = colour.rgb * colour.a + d.x * across + d.y * down;
    colourSum = vec4(rgb * weight, weight);
    normalSum = vec4(normal * weight, colour.a * weight);
#endif
}

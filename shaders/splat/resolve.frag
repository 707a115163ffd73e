// The picture out of what splat.frag left, drawn by screen.vert.
#include "splat/resolve.glsl"
layout(location = 0) out vec4 colourOut;
layout(location = 1) out float depthOut;
#if NORMALS
layout(location = 2) out vec4 normalOut;
layout(location = 3) out vec4 albedoOut;
#endif

void main() {
    vec4 colour, albedo;
    vec3 normal;
    float dist;
    resolvePixel(ivec2(gl_FragCoord.xy), colour, dist, normal, albedo);
    colourOut = colour;
    depthOut = dist;
#if NORMALS
    normalOut = vec4(normal, 0.0);
    albedoOut = albedo;
#endif
}

// The picture out of what splat.comp left.
#include "splat/resolve.glsl"
layout(local_size_x = 16, local_size_y = 8) in;

layout(std430, binding = 6) writeonly buffer ColourOut { vec4 colourOut[]; };
layout(std430, binding = 7) writeonly buffer DepthOut { float depthOut[]; };
#if NORMALS
layout(std430, binding = 8) writeonly buffer NormalOut { float normalOut[]; };
layout(std430, binding = 9) writeonly buffer AlbedoOut { vec4 albedoOut[]; };
#endif

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, frame.frameSize.xy))) return;
    int index = at.y * frame.frameSize.x + at.x;
    vec4 colour, albedo;
    vec3 normal;
    float dist;
    resolvePixel(at, colour, dist, normal, albedo);
    colourOut[index] = colour;
    depthOut[index] = dist;
#if NORMALS
    albedoOut[index] = albedo;
    normalOut[index * 3] = normal.x;
    normalOut[index * 3 + 1] = normal.y;
    normalOut[index * 3 + 2] = normal.z;
#endif
}

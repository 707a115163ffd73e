// The farthest front distance of each tile of the frame, after the visibility pass: what lies
// behind it is hidden. A group does one tile; pixels where nothing is hide nothing.
#include "splat/splat_frame.glsl"
layout(local_size_x = 64) in;

layout(std430, binding = 3) readonly buffer FrontBuffer { uint front[]; };
layout(std430, binding = 11) writeonly buffer TileBuffer { uint farthest[]; };

shared uint most;

void main() {
    if (gl_LocalInvocationIndex == 0u) most = 0u;
    barrier();
    uint mine = 0u;
    for (uint k = gl_LocalInvocationIndex; k < uint(TILE * TILE); k += 64u) {
        ivec2 at = ivec2(gl_WorkGroupID.xy) * TILE + ivec2(k % uint(TILE), k / uint(TILE));
        // Positive floats sort as their bits do.
        if (all(lessThan(at, frame.frameSize.xy)))
            mine = max(mine, front[(at.y + 1) * frame.frameSize.z + at.x + 1]);
    }
    atomicMax(most, mine);
    barrier();
    if (gl_LocalInvocationIndex == 0u)
        farthest[gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x] = most;
}

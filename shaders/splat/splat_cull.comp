// Which tasks may still show after the visibility pass: those whose nearest possible distance
// does not lie behind the farthest front of every tile that they may touch.
#include "splat/splat_points.glsl"
layout(local_size_x = 64) in;

layout(std430, binding = 10) writeonly buffer VisibleBuffer { uint visible[]; };
layout(std430, binding = 11) readonly buffer TileBuffer { uint farthest[]; };

void main() {
    uint task = gl_GlobalInvocationID.x;
    if (task >= uint(frame.counts.y)) return;
    uint across = (uint(frame.frameSize.x) + uint(TILE - 1)) / uint(TILE);
    TaskEntry t = taskAt(task);
    uvec2 from = uvec2(t.tilesFrom & 0xffffu, t.tilesFrom >> 16u);
    uvec2 to = uvec2(t.tilesTo & 0xffffu, t.tilesTo >> 16u);
    uvec2 size = to - from + 1u;
    // What covers much of the frame is not worth a long look.
    bool seen = size.x * size.y > 256u;
    for (uint y = from.y; y <= to.y && !seen; ++y)
        for (uint x = from.x; x <= to.x && !seen; ++x)
            seen = t.nearest <= uintBitsToFloat(farthest[y * across + x]);
    visible[task] = seen ? 1u : 0u;
}

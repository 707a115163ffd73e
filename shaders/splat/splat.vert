// Lee & Park's vertex shader: no vertex attributes; each vertex fetches its point from the
// textures. Small splats are GL points, others are two triangles.
#include "splat/splat_points.glsl"
#if PASS == 2
flat out vec4 colour;
flat out vec3 across, down;
flat out vec2 weighing;  // quality, tolerance
#if NORMALS
flat out vec3 normal;
#endif
#endif
flat out vec3 centre;  // pixel, distance
flat out vec3 inverse;
flat out vec4 shape;  // small, core2, slope

void main() {
    gl_Position = vec4(0.0, 0.0, -2.0, 1.0);  // outside: clipped
    gl_PointSize = 1.0;
#if BOXES
    uint corner = uint(gl_VertexID) % 6u, id = uint(gl_VertexID) / 6u;
#else
    uint id = uint(gl_VertexID);
#endif
    Point p;
    ivec3 texel;
    if (!fetchPoint((id >> 8u) + uint(frame.counts.z), id & 255u, p, texel)) return;
    Splat splat;
    if (!splatOf(p, texel, splat)) return;
#if BOXES
    // Corners 0 1 2 and 3 4 5: (-,-) (+,-) (+,+) and (-,-) (+,+) (-,+).
    vec2 side = vec2(corner == 1u || corner == 2u || corner == 4u ? 1.0 : -1.0,
                     corner == 2u || corner >= 4u ? 1.0 : -1.0);
    vec2 at = splat.small ? floor(p.pixel) + 1.0 + side : p.pixel + 0.5 + side * splat.reach;
#elif TWO_BY_TWO
    gl_PointSize = 2.0;
    vec2 at = floor(p.pixel) + 1.0;  // the corner that the 2x2 pixels share
#else
    vec2 at = floor(p.pixel + 0.5) + 0.5;
#endif
    centre = vec3(p.pixel, p.dist);
#if BOXES
    inverse = splat.q;
#endif
    shape = vec4(splat.small ? 1.0 : 0.0, splat.core2, splat.slope);
#if PASS == 2
    colour = pointColour(texel);
    weighing = vec2(splat.quality, p.task.tolerance);
#if RULE != 0
    colourGradient(texel, splat.steps, across, down);
#endif
#if NORMALS
    normal = pointNormal(texel);
#endif
#endif
    vec2 target = vec2(frame.frameSize.xy + 2 * frame.frameSize.w);
    gl_Position = vec4((at + float(frame.frameSize.w)) / target * 2.0 - 1.0, 0.5, 1.0);
}

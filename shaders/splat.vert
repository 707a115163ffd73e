// Lee & Park's vertex shader: no vertex attributes; each vertex fetches its point from the textures.
// Small splats are GL points, ellipses are two triangles. Needs splat_points.glsl.
#if PASS == 2
flat out vec4 colour;
#if NORMALS
flat out vec3 normal;
#endif
flat out vec2 weighing;  // quality, tolerance
#endif
flat out vec3 centre;  // pixel, distance
#if RULE != 0
flat out vec2 slope;
#endif
#if RULE == 1
flat out float core2;
#elif RULE >= 2
flat out vec3 inverse;
flat out float core2;
#endif

void main() {
    gl_Position = vec4(0.0, 0.0, -2.0, 1.0);  // outside: clipped
    gl_PointSize = 1.0;
#if RULE >= 2
    uint corner = uint(gl_VertexID) % 6u, id = uint(gl_VertexID) / 6u;
#else
    uint id = uint(gl_VertexID);
#endif
    Point p;
    if (!fetchPoint((id >> 8u) + uint(counts.z), id & 255u, p)) return;
    vec2 at = p.pixel + 0.5;
#if RULE >= 2
    Ellipse e;
    if (!ellipseOf(p, e)) return;
    // Corners 0 1 2 and 3 4 5: (-,-) (+,-) (+,+) and (-,-) (+,+) (-,+).
    at += e.reach * vec2(corner == 1u || corner == 2u || corner == 4u ? 1.0 : -1.0,
                        corner == 2u || corner >= 4u ? 1.0 : -1.0);
    inverse = e.q;
    slope = e.slope;
    core2 = e.core2;
#elif RULE == 1
    gl_PointSize = 2.0;
    at = floor(p.pixel) + 1.0;  // the corner that the 2x2 pixels share
    slope = vec2(tasks[p.task].slopeX, tasks[p.task].slopeY) * p.dist;
    core2 = tasks[p.task].core2;
#else
    at = floor(p.pixel + 0.5) + 0.5;
#endif
    centre = vec3(p.pixel, p.dist);
#if PASS == 2
    colour = pointColour(p);
    weighing = vec2(tasks[p.task].quality, tasks[p.task].tolerance);
#if NORMALS
    normal = pointNormal(p);
#endif
#endif
    vec2 target = vec2(frameSize.xy + 2 * frameSize.w);
    gl_Position = vec4((at + float(frameSize.w)) / target * 2.0 - 1.0, 0.5, 1.0);
}

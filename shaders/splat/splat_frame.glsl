// What all passes of a frame share. The twin of the structures in lib/render/splat/gpu/splat_frame.hpp.
// RASTER: for OpenGL 3.3, where tables are texture buffers and the program binds by name.
#if RASTER
#define AT(n)
layout(std140) uniform FrameBlock {
#else
#define AT(n) layout(binding = n)
layout(std140, binding = 0) uniform FrameBlock {
#endif
    ivec4 frameSize;     // width, height, width of the padded buffers, margin of the raster targets
    ivec4 counts;        // reference views, tasks of this draw, first task of this draw, lights
    vec4 novelLens;      // 1 / fx, 1 / fy, cx, cy
    vec4 novelAxisX;     // world; w = 1 when orthographic
    vec4 novelAxisY;     // world
    vec4 novelAxisZ;     // world
    vec4 novelPosition;  // world; w = diameter of the paper's splat in pixels times distance
    vec4 scales;         // weight, colour, nearest and farthest distance (raster depth)
    vec4 ambient;        // rgb
    vec4 specular;       // rgb; w = shininess
};

// Where the pixels of a reference view land: with (u, v) a pixel and z its distance,
// H = (a0 + au u + av v) z + b0 + bu u + bv v, the novel pixel H.xy / H.z (orthographic: H.xy) with
// pixel centres at whole numbers, and the novel distance H.z.
struct View {
    vec4 a0;   // w = 1 when the reference is orthographic
    vec4 au;   // w = fx
    vec4 av;   // w = fy
    vec4 b0, bu, bv;
};
#if RASTER
uniform samplerBuffer viewBuffer;
View viewAt(uint i) {
    int at = int(i) * 6;
    return View(texelFetch(viewBuffer, at), texelFetch(viewBuffer, at + 1),
                texelFetch(viewBuffer, at + 2), texelFetch(viewBuffer, at + 3),
                texelFetch(viewBuffer, at + 4), texelFetch(viewBuffer, at + 5));
}
#else
layout(std430, binding = 0) readonly buffer ViewBuffer { View views[]; };
View viewAt(uint i) { return views[i]; }
#endif

// What all passes of a frame share. The twin of the structures in lib/render/gpu/splat_frame.hpp.
layout(std140, binding = 0) uniform FrameBlock {
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
layout(std430, binding = 0) readonly buffer ViewBuffer { View views[]; };

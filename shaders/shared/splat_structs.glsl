// The buffers of splat mode (std140, std430): what C++ writes and shaders read. C++ checks the layout
// in lib/render/splat/gpu/splat_frame.hpp.

struct FrameUniforms {
    ivec4 frameSize;     // width, height, width of the padded buffers, margin of the raster targets
    ivec4 counts;        // reference views, tasks of this draw, first task of this draw, lights
    vec4 novelLens;      // 1 / fx, 1 / fy, cx, cy
    vec4 novelAxisX;     // world; w = 1 when orthographic
    vec4 novelAxisY;     // world; w = the linear light at which lit sRGB-coded colours stop
    vec4 novelAxisZ;     // world
    vec4 novelPosition;  // world; w = diameter of the paper's splat in pixels times distance
    vec4 scales;         // weight, colour, how far splats reach at most in pixels
    vec4 ambient;        // rgb; w: 1 an environment lights, 2 with gloss, too
    vec4 specular;       // rgb; w = shininess
};

// Where the pixels of a reference view are in the frame: with (u, v) a pixel and z its distance,
// H = (a0 + au u + av v) z + b0 + bu u + bv v, the novel pixel H.xy / H.z (orthographic: H.xy) with
// pixel centres at whole numbers, and the novel distance H.z.
struct ViewEntry {
    vec4 a0;  // w = 1 when the reference is orthographic
    vec4 au;  // w = fx
    vec4 av;  // w = fy
    vec4 b0, bu, bv;
};

// A block of a reference view to be drawn.
struct TaskEntry {
    uint uv;         // u0 | v0 << 16, pixel of the view
    uint count;      // columns | rows << 16
    uint atlasXY;    // x | y << 16 of that pixel in the textures
    uint viewLayer;  // view | layer << 20
    float slopeX, slopeY;  // relative distance per novel pixel (small splats)
    float core2;           // squared radius in which a splat hides what is behind (small ones)
    float tolerance;       // relative distance behind the front that still blends
    float quality;         // weight among views
    float uAcross, vAcross, uDown, vDown;  // half the source pixels that go by per novel pixel
    uint tilesFrom, tilesTo;  // column | row << 16 of the tiles of the frame that it may touch
    float nearest;            // nothing of its splats is nearer to the camera
};

struct LightEntry {
    vec4 vector;  // w = 0: the way the light travels, w = 1: its position; world
    vec4 colour;
};

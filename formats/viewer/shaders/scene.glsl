// Where the points of the object are: Lee & Park's vertex texture fetch from the merged textures. The shape
// of a splat is the code that stx itself draws with.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;
precision highp usampler2DArray;
precision highp isampler2DArray;
#include "shaders/shared/language.glsl"
#include "shaders/shared/splat_constants.glsl"
#include "shaders/shared/splat_structs.glsl"
const float kSlopeScale = 2048.0;
#include "shaders/shared/splat_shape.glsl"

const int kTableRows = 1024;  // a table goes on beside its first columns
const int kEntry = 8;         // texels of a rectangle

uniform sampler2DArray colourTexture;
uniform usampler2DArray depthTexture;  // DepthImage codes, 0 = no point
uniform sampler2D rectangleTable;

vec4 rectangleEntry(int rectangle, int k) {
    return texelFetch(rectangleTable, ivec2(rectangle / kTableRows * kEntry + k, rectangle % kTableRows), 0);
}

// Distance of a code (ISO/IEC 14496-16): dmax is the near plane, 1 the far plane.
float distanceOf(uint code, float near, float far, float dmax) {
    return near + (1.0 - (float(code) - 1.0) / (dmax - 1.0)) * (far - near);
}

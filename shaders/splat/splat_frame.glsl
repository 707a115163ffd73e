// What all passes of a frame share. RASTER: for OpenGL 3.3, where tables are texture buffers and the
// program binds by name.
#include "shared/language.glsl"
#include "shared/splat_constants.glsl"
#include "shared/splat_structs.glsl"
#if RASTER
#define AT(n)
layout(std140) uniform FrameBlock { FrameUniforms frame; };
uniform samplerBuffer viewBuffer;
ViewEntry viewAt(uint i) {
    int at = int(i) * 6;
    return ViewEntry(texelFetch(viewBuffer, at), texelFetch(viewBuffer, at + 1),
                     texelFetch(viewBuffer, at + 2), texelFetch(viewBuffer, at + 3),
                     texelFetch(viewBuffer, at + 4), texelFetch(viewBuffer, at + 5));
}
#else
#define AT(n) layout(binding = n)
layout(std140, binding = 0) uniform FrameBlock { FrameUniforms frame; };
layout(std430, binding = 0) readonly buffer ViewBuffer { ViewEntry views[]; };
ViewEntry viewAt(uint i) { return views[i]; }
#endif
bool orthographic() { return frame.novelAxisX.w != 0.0; }

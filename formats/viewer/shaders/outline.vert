// Each solid point, over the 3x3 pixels around it: lib/render/outline/outlines.cpp.
#include "formats/viewer/shaders/points.glsl"

layout(location = 0) in uvec3 block;  // u0 | v0 << 16, columns | rows << 16, rectangle; a number is behind

flat out vec2 centre;  // pixel

void main() {
    gl_Position = vec4(0.0, 0.0, -2.0, 1.0);  // outside: not drawn
    gl_PointSize = 3.0;
    uint u, v;
    ivec3 texel;
    if (!texelOf(block, u, v, texel)) return;
    uint code = texelFetch(depthTexture, texel, 0).r;
    float alpha = texelFetch(colourTexture, texel, 0).a;
    if (code == 0u || !hides(texel, alpha)) return;
    Point p = pointOf(int(block.z), code, alpha);
    if (!placePoint(p, float(u), float(v))) return;
    centre = p.pixel;
    gl_Position = vec4((floor(p.pixel + 0.5) + 0.5) / frameSize * 2.0 - 1.0, 0.0, 1.0);
}

// For vertex shaders: a vertex is a pixel of a reference view, an instance a block of 16x16 of them.
#include "formats/viewer/shaders/scene.glsl"

uniform vec2 frameSize;
uniform isampler2DArray slopeTexture;

// Whether a point of an alpha hides what is behind it: glass does whatever its alpha is, and has the bit that
// says of opaque points that they are linked (prepare.frag).
bool hides(ivec3 texel, float alpha) { return alpha >= kHides || (texelFetch(slopeTexture, texel, 0).x & 1) != 0; }

// The pixel of a block that a vertex is, u and v in its rectangle; false outside the block.
bool texelOf(uvec3 block, out uint u, out uint v, out ivec3 texel) {
    uint dx = uint(gl_VertexID) & 15u, dy = uint(gl_VertexID) >> 4u;
    u = (block.x & 0xffffu) + dx;
    v = (block.x >> 16u) + dy;
    vec4 place = rectangleEntry(int(block.z), 6), placeY = rectangleEntry(int(block.z), 7);
    int atX = int(place.w);
    texel = ivec3((atX & 0xffff) + int(u), int(placeY.w) + int(v), atX >> 16);
    return dx < (block.y & 0xffffu) && dy < (block.y >> 16u);
}

// A point of a rectangle before it is placed in the frame, of an alpha.
Point pointOf(int rectangle, uint code, float alpha) {
    Point p;
    p.view.a0 = rectangleEntry(rectangle, 0);
    p.view.au = rectangleEntry(rectangle, 1);
    p.view.av = rectangleEntry(rectangle, 2);
    p.view.b0 = rectangleEntry(rectangle, 3);
    p.view.bu = rectangleEntry(rectangle, 4);
    p.view.bv = rectangleEntry(rectangle, 5);
    p.source = distanceOf(code, p.view.b0.w, p.view.bu.w, p.view.bv.w);
    p.flatFrame = false;
    p.opaque = alpha >= 1.0;
    p.largest = max(kLargest, kLargestShare * max(frameSize.x, frameSize.y));
    return p;
}

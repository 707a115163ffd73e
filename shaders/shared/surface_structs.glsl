// The buffers of surface mode (std430, std140): what C++ writes and shaders read. C++ checks the
// layout in lib/render/surface/prepare/structs.hpp.

// A source in one frame.
struct SourceEntry {
    vec4 warpX, warpY, warpQ, warpW;  // rows of sourceFromPixel
    vec4 rayX, rayY, rayZ;            // rows of the vector from its eye to a point of the frame
    ivec4 size;                       // width, height, has alpha, blocks in a row
    vec4 axis;                        // 1 = q is 1/dist, 1/unit, step, share of q that is clearly behind
    // Layer of a source that fills one, else -1; then, in the table of places: its blocks; its bits of
    // pixels outside of all rectangles, -1 = none are set; 1 = its views were pruned.
    ivec4 place;
    // How far to the side noise may put points, pixels; q at its camera; its pixels in parts of kFinePixel;
    // their side as a share of the distance, of orthographic ones in scene units.
    vec4 doubt;
    vec4 unwarp[3];  // the first columns of pixelFromSource
};
struct FrameEntry {
    vec4 axis;              // 1 = q is 1/dist, 1/unit, largest q
    vec4 eyeX, eyeY, eyeZ;  // rows of the vector from the eye to a point of the frame
    vec4 fit;               // squared radius, ridge, 1 = colours are at most 1, weight on edges
    ivec4 size;             // width, height, blocks with cells, blocks with edges
};
// One source in one tile.
struct SlotEntry {
    vec4 warpX, warpY, warpQ, warpW;  // rows of samples of the tile from pixels of the source
    ivec4 source;                     // its number
};
struct TileEntry {
    int x, y;           // first pixel, which may lie before the frame
    uint first, count;  // its sources in locals[]
    float step;         // coarsest depth code of its sources, scene units
    uint core;          // so many of its sources, the first, tell what it shows by themselves, too
    float pad0, pad1;
};
// A part of a surface in one pixel, to be shaded.
struct Piece {
    float x, y;       // position in the frame of its middle, pixels
    float q, qx, qy;  // depth and its slope per pixel
    float share;      // of the pixel, 0..1
    uint seenBy;      // bit i: source i of its tile sees it
    uint at;          // pixel of the batch: tile * kTile² + row * kTile + column
};

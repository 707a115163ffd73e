// A source drawn as a surface into a tile: the nearest q at each sample. The processor does the same
// with vectors in lib/render/surface/cpu/raster.cpp; a test holds both against this. From outside:
//   vec4 toSamples(x, y, q)      a position in the source as sample position and q, homogeneous
//   int SIDE, float qLimit()     samples along a side of the tile, the largest q: what is nearer is behind an
//                                orthographic camera
//   Axis frameAxis(), float relativeScale(Axis, q)  of the frame: see surface_votes.glsl
//   bool mayDraw(x, y, behind)   whether a sample is free or holds less than `behind`: extensions are
//                                drawn only there
//   placed(), cutInFront()       of surface_cut.glsl
//   void raise(x, y, value)      makes a sample at least as near as `value`, bits of q and flags

// Samples of the convex polygon with these edges (ex x + ey y + e0 >= 0), this plane of q and this
// range, inside a box.
void scan(vec4 ex, vec4 ey, vec4 e0, vec3 plane, float qMin, float qMax, vec2 low, vec2 high, uint flags) {
    // What is behind it by so much is another surface.
    float apart = (flags & kRimBit) != 0u ? kBehindRim : kLinkedSamples;
    float behind = (flags & kCoversBit) != 0u ? qMin - apart * relativeScale(frameAxis(), qMin) : 0.0f;
    vec2 from = max(low, vec2(0.0f)), to = min(high, vec2(float(SIDE - 1)));
    if (!(from.x <= to.x && from.y <= to.y) || !(qMin > 0.0f) || !(qMin <= qLimit())) return;
    ivec2 first = ivec2(ceil(from)), last = ivec2(floor(to));
    // All of the box is outside of one edge, as of most that reach far beyond the frame.
    vec4 most = max(ex * float(first.x), ex * float(last.x)) + (max(ey * float(first.y), ey * float(last.y)) + e0);
    if (min(min(most.x, most.y), min(most.z, most.w)) < 0.0f) return;
    for (int y = first.y; y <= last.y; ++y) {
        for (int x = first.x; x <= last.x; ++x) {
            vec4 e = ex * float(x) + (ey * float(y) + e0);
            if (min(min(e.x, e.y), min(e.z, e.w)) < 0.0f || !mayDraw(x, y, behind)) continue;
            float q = clamp(plane.x * float(x) + (plane.y * float(y) + plane.z), qMin, qMax);
            if (!(q <= qLimit())) continue;
            raise(x, y, (floatBitsToUint(q) & ~kSampleFlags) | (flags & kSampleFlags));
        }
    }
}

// Polygons that turn the right way, whose corners are sample positions and q; `grow` moves their edges
// out, in samples.
void fillPolygon(vec3 a, vec3 b, vec3 c, vec3 d, float grow, uint flags) {
    // The diagonals span the plane; its z component is twice the signed area.
    vec3 ac = c - a, bd = d - b;
    float area = ac.x * bd.y - ac.y * bd.x;
    if (!(area > 0.0f)) return;
    float px = (ac.z * bd.y - ac.y * bd.z) / area, py = (ac.x * bd.z - ac.z * bd.x) / area;
    vec3 middle = 0.25f * (a + b + c + d);
    vec4 xs = vec4(a.x, b.x, c.x, d.x), ys = vec4(a.y, b.y, c.y, d.y);
    vec4 ex = ys - vec4(b.y, c.y, d.y, a.y), ey = vec4(b.x, c.x, d.x, a.x) - xs;
    vec4 e0 = grow * (abs(ex) + abs(ey)) - (ex * xs + ey * ys);
    vec3 low = min(min(a, b), min(c, d)), high = max(max(a, b), max(c, d));
    scan(ex, ey, e0, vec3(px, py, middle.z - px * middle.x - py * middle.y), low.z, high.z,
         vec2(low) - grow, vec2(high) + grow, flags);
}

// The same from corners of toSamples(). What reaches behind the camera is cut, and drawn as triangles.
void fillQuad(vec4 a, vec4 b, vec4 c, vec4 d, float grow, uint flags) {
    if (min(min(a.w, b.w), min(c.w, d.w)) > 0.0f) {
        fillPolygon(placed(a), placed(b), placed(c), placed(d), grow, flags);
        return;
    }
    vec3 kept[5];
    int count = cutInFront(a, b, c, d, kept);
    for (int k = 2; k < count; ++k) fillPolygon(kept[0], kept[k - 1], kept[k], kept[0], grow, flags);
}

// A quad whose last corner is its first again: that edge holds everywhere, the plane is the same.
void fillTriangle(vec4 a, vec4 b, vec4 c, uint flags) { fillQuad(a, b, c, a, kCrack, flags); }

// A cell that is not a leaf, by its shape; the corners clockwise from the upper left.
void drawCell(uint shape, vec4 a, vec4 b, vec4 c, vec4 d, uint flags) {
    if (shape == kQuadCell) {
        fillQuad(a, b, c, d, kCrack, flags);
    } else if (shape == kFallingSplit) {
        fillTriangle(a, b, c, flags);
        fillTriangle(a, c, d, flags);
    } else if (shape == kRisingSplit) {
        fillTriangle(a, b, d, flags);
        fillTriangle(b, c, d, flags);
    } else if (shape == kUpperLeft) {
        fillTriangle(a, b, d, flags);
    } else if (shape == kUpperRight) {
        fillTriangle(b, c, a, flags);
    } else if (shape == kLowerRight) {
        fillTriangle(c, d, b, flags);
    } else if (shape == kLowerLeft) {
        fillTriangle(d, a, c, flags);
    }
}

// Part of a plane: q at its upper left corner, the middle of a pixel, and its slopes per pixel.
void drawLeaf(float x, float y, float size, float q0, float qx, float qy) {
    fillQuad(toSamples(x, y, q0), toSamples(x + size, y, q0 + size * qx),
             toSamples(x + size, y + size, q0 + size * (qx + qy)), toSamples(x, y + size, q0 + size * qy),
             kLeafGrow * float(S), 0u);
}

// The square around an edge pixel, whose middle is at (x, y), with the slope (gx, gy) of its q.
// `scale` is what a relative difference of 1 is in q there.
void drawExtension(float x, float y, float q, float gx, float gy, float scale, bool besideBackground, bool rim) {
    float side = besideBackground ? kHalfBesideBackground : kHalfInside;
    float reach = kExtensionReach * scale;
    bool covers = (besideBackground || rim) && (abs(gx) + abs(gy)) * side < kExtensionCovers * scale;
    float plus = clamp(gx * side + gy * side, -reach, reach);
    float minus = clamp(gx * side - gy * side, -reach, reach);
    fillQuad(toSamples(x - side, y - side, q - plus), toSamples(x + side, y - side, q + minus),
             toSamples(x + side, y + side, q + plus), toSamples(x - side, y + side, q - minus), kCrack,
             kExtensionBit | kNearEdgeBit | (covers ? kCoversBit : 0u) | (rim ? kRimBit : 0u));
}

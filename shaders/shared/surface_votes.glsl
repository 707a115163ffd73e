// Free-space votes: does a source see past a point of space?
// From outside: Axis, float relativeScale(Axis, q) (what a relative depth difference of 1 is in q),
// float qPerUnit(Axis, q) (how much q changes over one scene unit); of source s:
//   vec4 warp(s, x, y, q)      the point in the source, homogeneous
//   vec4 warpChange(s, d)      the same of a change of homogeneous points of the frame
//   vec4 unwarpColumn(s, i)    column i of what maps homogeneous points of the source to those of the frame
//   float texelAt(s, q)        scene units between points of neighbouring pixels
//   ivec2 sizeOf(s), bool hasAlpha(s), float freeLevelOf(s), Axis axisOf(s)
//   float nearestOf(s)         q at its camera: what is beyond is behind it
//   float clearlyBehindOf(s)   share of q by which a surface must be behind a point, with its noise
//   float coarseOf(s)          what its pixels are, in parts of kFinePixel
//   float stepOf(s)            of its depth code, scene units
//   float besideOf(s)          how far to the side its points and those of others may be off, pixels
//   Place placeOf(s, corner)   where the 2x2 pixels from `corner` on are kept, and in that place
//   float qAt(s, place, i, j), vec2 gradientAt(s, place, i, j), float levelOf(s, place, i, j)
// Pixels of a place that are not inside the source are never asked for.
//   Taps tapPlaceOf(s, corner), a Place of the 4x4 pixels from `corner` on, around a point among the
//   middle four, and bool canRead(place, pixel) which of them are there

// What a source says of a point, in halves of a vote.
CONSTANT int kNoVote = 0;  // the point is hidden from it, on its surface, or out of its frame
// It sees past the point, but where its own surfaces end or jump, or are so steep that noise may do it.
CONSTANT int kHalfVote = 1;
CONSTANT int kWholeVote = 2;  // it sees a surface clearly behind the point, or background there
// It sees background there and its depth is noisy: alpha is not.
CONSTANT int kTwoVotes = 4;

bool inside(ivec2 at, ivec2 size) {
    return at.x >= 0 && at.y >= 0 && at.x < size.x && at.y < size.y;
}

// Bilinear outline level at `t` (0..1) between the middles of the 2x2 pixels from `corner` on: see
// lib/render/surface/prepare/outline_levels.hpp.
float levelAmong(int s, Place place, ivec2 corner, vec2 t) {
    ivec2 size = sizeOf(s);
    int i0 = corner.x < 0 ? 1 : 0, i1 = corner.x + 1 < size.x ? 1 : 0;
    int j0 = corner.y < 0 ? 1 : 0, j1 = corner.y + 1 < size.y ? 1 : 0;
    return (levelOf(s, place, i0, j0) * (1.0f - t.x) + levelOf(s, place, i1, j0) * t.x) * (1.0f - t.y) +
           (levelOf(s, place, i0, j1) * (1.0f - t.x) + levelOf(s, place, i1, j1) * t.x) * t.y;
}

// The same of a source at a position inside it, pixels; 1 when it has no alpha.
float levelAt(int s, vec2 at) {
    if (!hasAlpha(s)) return 1.0f;
    vec2 f = floor(at - 0.5f);
    ivec2 corner = ivec2(f);
    return levelAmong(s, placeOf(s, corner), corner, at - 0.5f - f);
}

// The largest level of the 4x4 pixels around the 2x2 from `corner` on.
float largestLevelAround(int s, ivec2 corner) {
    Taps place = tapPlaceOf(s, corner - 1);
    float largest = 0.0f;
    for (int t = 0; t < 16; ++t)
        if (canRead(place, corner - 1 + ivec2(t % 4, t / 4)))
            largest = max(largest, levelOf(s, place, t % 4, t / 4));
    return largest;
}

// The vote of a source that sees background.
int backgroundVoteOf(int s) { return besideOf(s) > 0.0f ? kTwoVotes : kWholeVote; }

// Whether a source with this bilinear level between the 2x2 pixels from `corner` on sees background
// there. Only beside what covers a pixel in full does a part of its level tell: thin parts and leaves
// never reach a level of 1.
bool isBackground(int s, ivec2 corner, float level) {
    if (!(level < freeLevelOf(s))) return false;
    return !(level > 0.0f) || !(largestLevelAround(s, corner) < kSolidAlpha);
}

// Where a surface has a crease between the middle two of four pixels in line, `t` (0..1) from one to the other: there
// the surfaces of both sides go on until they meet. 0 where they do not tell, or within `limit` are not linked.
float creaseBetween(float a, float b, float c, float d, float t, float limit) {
    bool linked = min(min(a, b), min(c, d)) > 0.0f && abs(b - a) < limit && abs(c - d) < limit;
    return linked ? min(b + (b - a) * t, c + (c - d) * (1.0f - t)) : 0.0f;
}

// How near a source's surface may come at `t` between the middles of the 2x2 pixels from `corner` on, where it may
// have a crease that none of them shows.
float creaseAmong(int s, ivec2 corner, vec2 t, float limit) {
    Taps place = tapPlaceOf(s, corner - 1);
    float q[16];
    for (int k = 0; k < 16; ++k)
        q[k] = canRead(place, corner - 1 + ivec2(k % 4, k / 4)) ? qAt(s, place, k % 4, k / 4) : 0.0f;
    float along[4];
    for (int k = 0; k < 2; ++k) {
        along[k] = creaseBetween(q[4 * k + 4], q[4 * k + 5], q[4 * k + 6], q[4 * k + 7], t.x, limit);
        along[k + 2] = creaseBetween(q[k + 1], q[k + 5], q[k + 9], q[k + 13], t.y, limit);
    }
    return max(min(along[0], along[1]), min(along[2], along[3]));
}

// The vote of a source on the point `at` in its image, at depth p, where it does not see background.
int voteOnDepth(int s, Place place, ivec2 corner, vec2 at, float p) {
    ivec2 size = sizeOf(s);
    float margin = clearlyBehindOf(s) * coarseOf(s) * relativeScale(axisOf(s), p) + stepOf(s) * qPerUnit(axisOf(s), p);
    float least = 3.0e38f, most = 0.0f;
    bool gaps = false, doubtful = false;
    for (int j = 0; j < 2; ++j) {
        for (int i = 0; i < 2; ++i) {
            ivec2 c = corner + ivec2(i, j);
            if (!inside(c, size)) continue;
            float there = qAt(s, place, i, j);
            // What was pruned from here may be the very surface that is asked about.
            if (there < 0.0f) return kNoVote;
            if (!(there > 0.0f)) {
                gaps = true;
                continue;
            }
            least = min(least, there);
            most = max(most, there);
            // The cheap half of the test first: most surfaces are not behind the point at all.
            float reach = 4.0f * kLinkedSamples * coarseOf(s) * relativeScale(axisOf(s), there);
            if (p < there + margin - reach) return kNoVote;
            vec2 g = gradientAt(s, place, i, j);
            float predicted = there + g.x * (at.x - 0.5f - float(c.x)) + g.y * (at.y - 0.5f - float(c.y));
            float slope = abs(g.x) + abs(g.y);
            if (p < predicted + margin + kSlopeDoubt * slope) return kNoVote;
            doubtful = doubtful || p < predicted + margin + besideOf(s) * slope;
        }
    }
    if (!(most > 0.0f)) return kNoVote;
    float limit = kLinkedSamples * coarseOf(s) * relativeScale(axisOf(s), most);
    bool linked = !(most - least > limit);
    if (linked && !gaps && p < creaseAmong(s, corner, at - 0.5f - vec2(float(corner.x), float(corner.y)), limit) + margin)
        return kNoVote;
    return linked && !gaps && !doubtful ? kWholeVote : kHalfVote;
}

// The vote of a source on a point of it, homogeneous. `outline`: an outline may be near, and another vote
// beyond it: not where nothing is around.
int voteAt(int s, vec4 h, OUT(bool) outline) {
    outline = true;
    if (!(h.w > 0.0f)) return kNoVote;
    float inverse = 1.0f / h.w;
    vec2 at = vec2(h.x * inverse, h.y * inverse);
    float p = h.z * inverse;
    ivec2 size = sizeOf(s);
    if (!(at.x >= 0.0f && at.y >= 0.0f && at.x < float(size.x) && at.y < float(size.y) && p > 0.0f &&
          p < nearestOf(s)))
        return kNoVote;
    vec2 f = floor(at - 0.5f);
    ivec2 corner = ivec2(f);
    Place place = placeOf(s, corner);
    if (hasAlpha(s)) {
        float level = levelAmong(s, place, corner, at - 0.5f - f);
        outline = level > 0.0f;
        if (isBackground(s, corner, level)) return backgroundVoteOf(s);
    }
    bool amid = corner.x > 0 && corner.y > 0 && corner.x + 2 < size.x && corner.y + 2 < size.y;
    if (amid && !(edgeDistanceOf(s, place, 0, 0) < float(kFarFromEdge - 1))) outline = false;
    return voteOnDepth(s, place, corner, at, p);
}

// A pixel of a source as the frame has it: homogeneous steps of that pixel along its surface, and of q.
struct Facet {
    bool any;
    vec4 along, across, into;
    float area;     // of the pixel, square scene units, if it faced the source
    float perUnit;  // how much q changes over a scene unit
    float off;      // how far in front of it noise may put a point of it
    float edgeOn;   // seen this small or smaller, as a share of its own pixel, it is seen edge on
    float behind;   // and so far behind it background must be, pixels of who sees it edge on
    float grazing;  // seen this small or smaller it is seen at a grazing angle; at least `edgeOn`
};

// The one that a source shows at the point (x, y, q) of the frame. `measured`: between the middles of its
// pixels, not by an extension.
Facet facetOf(int s, float x, float y, float q, bool measured) {
    vec4 h = warp(s, x, y, q);
    float inverse = 1.0f / h.w, p = h.z * inverse;
    vec2 at = vec2(h.x, h.y) * inverse;
    ivec2 size = sizeOf(s);
    Facet facet;
    facet.any = h.w > 0.0f && at.x >= 0.0f && at.y >= 0.0f && at.x < float(size.x) && at.y < float(size.y);
    if (!facet.any) return facet;
    ivec2 pixel = ivec2(min(int(at.x), size.x - 1), min(int(at.y), size.y - 1));
    Place own = placeOf(s, pixel);
    bool shown = qAt(s, own, 0, 0) > 0.0f;
    vec2 g = shown ? gradientAt(s, own, 0, 0) : vec2(0.0f, 0.0f);
    // An extension is beside the pixel that it extends.
    ivec2 corner = ivec2(floor(at - 0.5f));
    Place place = placeOf(s, corner);
    float nearest = 3.0e38f;
    for (int t = 0; t < 4 && !shown; ++t) {
        ivec2 c = corner + ivec2(t % 2, t / 2);
        if (!inside(c, size) || !(qAt(s, place, t % 2, t / 2) > 0.0f)) continue;
        vec2 apart = at - 0.5f - vec2(float(c.x), float(c.y));
        float square = apart.x * apart.x + apart.y * apart.y;
        if (!(square < nearest)) continue;
        nearest = square;
        g = gradientAt(s, place, t % 2, t / 2);
    }
    facet.into = unwarpColumn(s, 2) * h.w;
    facet.along = unwarpColumn(s, 0) * h.w + facet.into * g.x;
    facet.across = unwarpColumn(s, 1) * h.w + facet.into * g.y;
    float texel = texelAt(s, p);
    facet.area = texel * texel;
    facet.perUnit = qPerUnit(axisOf(s), p);
    // Noise tilts facets, and puts points in front of them.
    facet.off = kBehindNoises * (clearlyBehindOf(s) - kClearlyBehind) * relativeScale(axisOf(s), p);
    float slope = length(g) / (facet.perUnit * texel);
    float least = kEdgeOn * (measured ? sqrt(1.0f + slope * slope) : 1.0f);
    float tilt = facet.off / (facet.perUnit * texel);
    facet.edgeOn = least + tilt;
    facet.grazing = least * (measured ? max(coarseOf(s), 1.0f) : 1.0f) + tilt;
    facet.behind = measured ? kBehindMeasured : kBehindTexel;
    return facet;
}

// How large a source sees a facet at a point of the source, homogeneous, as a share of what the facet's own
// source sees.
float sizeIn(int s, IN(Facet) facet, vec4 h) {
    vec4 a = warpChange(s, facet.along), b = warpChange(s, facet.across);
    float inverse = 1.0f / h.w;
    float u = h.x * inverse, v = h.y * inverse, texel = texelAt(s, h.z * inverse);
    float area = ((a.x - u * a.w) * (b.y - v * b.w) - (a.y - v * a.w) * (b.x - u * b.w)) * inverse * inverse;
    return abs(area) * texel * texel / facet.area;
}

// How many times as large a source must see what another source's extension continues to know better where it is.
float betterThan(int s) { return max(kSeesBetter / max(coarseOf(s), 1.0f), 1.0f); }

// Whether a point of the frame lies beyond the outermost pixel centres of a source. What the source shows
// there continues its outermost pixels: a tangent, beside which round surfaces lie behind.
bool beyondCentres(int s, float x, float y, float q) {
    vec4 h = warp(s, x, y, q);
    float u = h.x / h.w, v = h.y / h.w;
    ivec2 size = sizeOf(s);
    return min(min(u, float(size.x) - u), min(v, float(size.y) - v)) < 0.5f;
}

// A source whose vote on a point is of an outline, beside what it sees edge on, where all is outline, and where
// that is its pixels tell to a part of one only: it must see past what is so far behind the point, too. Of coarse
// views the same is so of what is seen at a grazing angle, to a smaller part.
bool seesEdgeOn(int s, IN(Facet) facet, vec4 h) { return facet.any && sizeIn(s, facet, h) < facet.grazing; }
vec4 behindFacet(int s, IN(Facet) facet, vec4 h) {
    float pixels = sizeIn(s, facet, h) < facet.edgeOn ? facet.behind : kBehindGrazing;
    float behind = pixels * texelAt(s, h.z / h.w) * facet.perUnit + facet.off;
    return h - warpChange(s, facet.into) * behind;
}

// The vote of a source that votes on the point (x, y, q) of the frame, which is of this facet.
int voteOnOutline(int s, IN(Facet) facet, float x, float y, float q, int vote) {
    vec4 h = warp(s, x, y, q);
    bool outline;
    return seesEdgeOn(s, facet, h) ? min(vote, voteAt(s, behindFacet(s, facet, h), outline)) : vote;
}

// The vote of a source on the point (x, y, q) of the frame, of which nobody shows a surface.
int voteOf(int s, float x, float y, float q) {
    bool outline;
    return voteAt(s, warp(s, x, y, q), outline);
}

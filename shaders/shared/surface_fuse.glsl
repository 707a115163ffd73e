// What a pixel shows: the surfaces of the sources fused, and checked against what others see.
// Needs surface_votes.glsl and surface_slope.glsl. From outside: TileEntry tile; Axis frameAxis(); S and SIDE, samples
// along a side of a pixel and of a tile; SAMPLES, at least S * S;
//   uint sampleOf(k, i, j)  bits of the q of source k of the tile at sample (i, j), flags in the
//                           lowest two; 0 = nothing there
//   int sourceOf(k)         what the votes know source k by

// The samples of a pixel that show a surface, nearest first: q, who sees it, number in the pixel.
float shownQ[SAMPLES];
uint shownTo[SAMPLES];
int shownAt[SAMPLES];
int shownCount;

// Surfaces that are no further apart than this in q are one.
float sameWithin(float q) {
    return kSame * relativeScale(frameAxis(), q) + tile.step * qPerUnit(frameAxis(), q);
}

// Samples of a pixel are one piece while they differ by no more than this.
float oneWithin(float q) {
    return kJump * relativeScale(frameAxis(), q) + tile.step * qPerUnit(frameAxis(), q);
}

// dq/dx, dq/dy per pixel of a source's surface at a sample.
vec2 slopeAt(int k, int i, int j) {
    float here = uintBitsToFloat(sampleOf(k, i, j));
    float limit = kLinkedSamples * relativeScale(frameAxis(), here);
    float left = i > 0 ? uintBitsToFloat(sampleOf(k, i - 1, j)) : 0.0f;
    float right = i < SIDE - 1 ? uintBitsToFloat(sampleOf(k, i + 1, j)) : 0.0f;
    float up = j > 0 ? uintBitsToFloat(sampleOf(k, i, j - 1)) : 0.0f;
    float down = j < SIDE - 1 ? uintBitsToFloat(sampleOf(k, i, j + 1)) : 0.0f;
    return vec2(chooseSlope(left > 0.0f && abs(here - left) < limit, here - left,
                            right > 0.0f && abs(right - here) < limit, right - here),
                chooseSlope(up > 0.0f && abs(here - up) < limit, here - up,
                            down > 0.0f && abs(down - here) < limit, down - here)) *
           float(S);
}

// The same of a pixel whose samples, S > 1 a side, are all of one surface; (i, j) is its first.
vec2 slopeInside(int k, int i, int j) {
    float left = uintBitsToFloat(sampleOf(k, i, j + S / 2));
    float right = uintBitsToFloat(sampleOf(k, i + S - 1, j + S / 2));
    float up = uintBitsToFloat(sampleOf(k, i + S / 2, j));
    float down = uintBitsToFloat(sampleOf(k, i + S / 2, j + S - 1));
    return vec2(right - left, down - up) * (float(S) / float(max(S - 1, 1)));
}

// Whether the point (x, y, q), which source `own` shows, is left out; (i, j) is its sample. It is when
// more sources see past it than show it. An extension is also when a source that looks less aside
// shows something closely behind by more than an extension and cannot tell the two apart: an extension of
// what turns away is a guess.
// The flags are an argument of their own: the bits of a computed q mean nothing.
bool rejected(float q, uint flags, int own, float x, float y, int i, int j) {
    bool nearEdge = (flags & kNearEdgeBit) != 0u;
    bool silhouette = false;  // beside background in its own source, not at an edge inside the object
    int self = sourceOf(own);
    if (nearEdge && hasAlpha(self)) {
        vec4 h = warp(self, x, y, q);
        ivec2 size = sizeOf(self);
        vec2 at = vec2(clamp(h.x / h.w, 0.0f, float(size.x)), clamp(h.y / h.w, 0.0f, float(size.y)));
        float level = levelAt(self, at);
        if (isBackground(self, ivec2(floor(at - 0.5f)), level)) return true;
        silhouette = level < kSolidAlpha;
    }
    int votes = 0, enough = kWholeVote * (nearEdge ? kVotesNearEdge : kVotesElsewhere);
    uint others = 0u;  // do not show it
    uint guesses = 0u;  // show it by an extension
    uint closelyBehind = 0u;  // show something there, and not by an extension
    bool guess = (flags & kExtensionBit) != 0u;
    Facet facet = facetOf(self, x, y, q, !guess);
    bool outermost = guess && beyondCentres(self, x, y, q);
    float within = sameWithin(q), close = kLinkedSamples * relativeScale(frameAxis(), q);
    // Four at a time: llvmpipe ends all loops of a thread together after 65535 rounds.
    for (int n = 0; n < int(tile.count); n += 4) {
        for (int m = 0; m < 4; ++m) {
            int k = n + m;
            if (k == own || k >= int(tile.count)) continue;
            uint value = sampleOf(k, i, j);
            float apart = q - uintBitsToFloat(value);
            bool extension = (value & kExtensionBit) != 0u;
            if (value == 0u || !(abs(apart) < within)) {
                others |= 1u << k;
                if (!extension && apart > 0.0f && apart < close) closelyBehind |= 1u << k;
            } else if (extension) {
                guesses |= 1u << k;
            } else {
                enough += kWholeVote;
                guess = false;
            }
        }
    }
    // The rims of thin parts are extensions in all sources, which show them where they do not see past them.
    // Extensions inside the object are guesses, which support nothing. Then the others vote until it is decided. In
    // one loop, in which a source that votes twice (see seesEdgeOn()) comes twice: drivers put every call of a
    // function in its place, and voteAt() twice takes one 20 s to compile.
    bool first = guesses != 0u, again = false;
    uint left = first ? guesses : others;
    int before = kNoVote;
    vec4 h;
    while (left != 0u && (first || votes < enough)) {
        int k = findLSB(left), s = sourceOf(k);
        if (!again) h = warp(s, x, y, q);
        bool outline;
        int vote = voteAt(s, h, outline);
        if (!again && vote != kNoVote && outline && seesEdgeOn(s, facet, h)) {
            before = vote;
            h = behindFacet(s, facet, h);
            again = true;
            continue;
        }
        if (again) vote = min(vote, before);
        again = false;
        votes += vote;
        left &= left - 1u;
        if (vote == kNoVote && first) enough += silhouette ? kWholeVote : 0;
        if (vote == kNoVote && !first && guess && (closelyBehind >> k & 1u) != 0u && facet.any &&
            (outermost || sizeIn(s, facet, warp(s, x, y, q)) > betterThan(self)))
            return true;
        if (left == 0u && first) {
            first = false;
            left = others;
        }
    }
    return votes >= enough;
}

// Whether sources that show the same are enough to need no votes: two far from their edges, or one and
// two others that are no extensions.
bool agreed(int sure, int mesh) { return sure > 1 || (sure > 0 && mesh > 2); }

// The first surface at a sample that is not rejected: its q and who sees it.
bool fuseSample(int i, int j, OUT(float) q, OUT(uint) seenBy) {
    // Nearest first; equal ones in the order of the sources.
    uint values[kMostTileSources];
    int owners[kMostTileSources];
    int count = 0;
    for (int k = 0; k < int(tile.count); ++k) {
        uint value = sampleOf(k, i, j);
        if (value == 0u) continue;
        int at = count++;
        for (; at > 0 && values[at - 1] < value; --at) {
            values[at] = values[at - 1];
            owners[at] = owners[at - 1];
        }
        values[at] = value;
        owners[at] = k;
    }
    q = 0.0f;
    seenBy = 0u;
    float scale = 1.0f / float(S);
    float x = float(tile.x) + (float(i) + 0.5f) * scale;
    float y = float(tile.y) + (float(j) + 0.5f) * scale;
    for (int c = 0; c < count; ++c) {
        float front = uintBitsToFloat(values[c]), behind = front - sameWithin(front);
        int sure = 0, mesh = 0;  // sources that show it far from their edges, and not by an extension
        for (int o = c; o < count && uintBitsToFloat(values[o]) > behind; ++o) {
            sure += (values[o] & kSampleFlags) == 0u ? 1 : 0;
            mesh += (values[o] & kExtensionBit) == 0u ? 1 : 0;
        }
        if (!agreed(sure, mesh) && rejected(front, values[c] & kSampleFlags, owners[c], x, y, i, j)) continue;
        float sum = 0.0f, weights = 0.0f;
        uint meshes = 0u, extensions = 0u;
        for (int o = c; o < count && uintBitsToFloat(values[o]) > behind; ++o) {
            bool extension = (values[o] & kExtensionBit) != 0u;
            float weight = extension ? kExtensionWeight : 1.0f;
            sum += weight * (uintBitsToFloat(values[o]) - front);
            weights += weight;
            if (extension)
                extensions |= 1u << owners[o];
            else
                meshes |= 1u << owners[o];
        }
        q = front + sum / weights;
        seenBy = meshes != 0u ? meshes : extensions;
        return true;
    }
    return false;
}

// Fuses all samples of a pixel of the tile, one by one, into shownQ and its companions.
void fuseSamples(int column, int row) {
    shownCount = 0;
    for (int k = 0; k < S * S; ++k) {
        float q;
        uint seenBy;
        if (!fuseSample(column * S + k % S, row * S + k / S, q, seenBy)) continue;
        int at = shownCount++;
        for (; at > 0 && shownQ[at - 1] < q; --at) {
            shownQ[at] = shownQ[at - 1];
            shownTo[at] = shownTo[at - 1];
            shownAt[at] = shownAt[at - 1];
        }
        shownQ[at] = q;
        shownTo[at] = seenBy;
        shownAt[at] = k;
    }
}

// The end of the piece that begins at one of those samples: where q jumps.
int pieceEnd(int begin) {
    int end = begin + 1;
    for (; end < shownCount; ++end) {
        float before = shownQ[end - 1];
        if (before - shownQ[end] > oneWithin(before)) break;
    }
    return end;
}

// dq/dx, dq/dy of the plane that fits the samples begin..end of a pixel best, which are n with this
// mean position in the pixel and this mean q; false when they do not tell.
bool fitSlope(int begin, int end, vec2 middle, float q, OUT(vec2) slope) {
    float scale = 1.0f / float(S);
    float xx = 0.0f, xy = 0.0f, yy = 0.0f, xq = 0.0f, yq = 0.0f;
    for (int k = begin; k < end; ++k) {
        float dx = (float(shownAt[k] % S) + 0.5f) * scale - middle.x;
        float dy = (float(shownAt[k] / S) + 0.5f) * scale - middle.y;
        float dq = shownQ[k] - q;
        xx += dx * dx;
        xy += dx * dy;
        yy += dy * dy;
        xq += dx * dq;
        yq += dy * dq;
    }
    float det = xx * yy - xy * xy;
    if (!(det > 0.01f * xx * yy)) return false;
    slope = vec2(xq * yy - yq * xy, yq * xx - xq * xy) / det;
    return true;
}

// The piece of the samples begin..end of a pixel.
Piece pieceOf(int column, int row, int begin, int end) {
    float scale = 1.0f / float(S);
    float x = 0.0f, y = 0.0f, q = 0.0f;
    uint seenBy = 0u;
    for (int k = begin; k < end; ++k) {
        x += (float(shownAt[k] % S) + 0.5f) * scale;
        y += (float(shownAt[k] / S) + 0.5f) * scale;
        q += shownQ[k];
        seenBy |= shownTo[k];
    }
    float n = 1.0f / float(end - begin);
    vec2 g;
    if (end - begin < kFittedSamples || !fitSlope(begin, end, vec2(x, y) * n, q * n, g)) {
        int middle = (begin + end) / 2;
        g = slopeAt(findLSB(shownTo[middle]), column * S + shownAt[middle] % S,
                    row * S + shownAt[middle] / S);
    }
    Piece piece;
    piece.x = float(tile.x + column) + x * n;
    piece.y = float(tile.y + row) + y * n;
    piece.q = q * n;
    piece.qx = g.x;
    piece.qy = g.y;
    piece.share = float(end - begin) * scale * scale;
    piece.seenBy = seenBy;
    piece.at = uint(row * kTile + column);
    return piece;
}

// A pixel as a whole. A source is sure there when its samples are all of one surface far from its
// edges. Where the nearest surface is shown by two sure sources, or by the only source that shows
// anything, and no source has anything before it, there is no need to look at each sample.
struct WholePixel {
    bool any;      // some source has something there
    float front;   // q of the first source that shows the nearest sure surface
    float sum;     // of q over those that do
    uint shown;    // they: bit k is source k of the tile
    bool steep;    // one of them changes by more than samples of one piece may
    int first;
    uint behind;   // sure sources that show what is behind it
    uint others;   // sources that are not sure
    float nearest; // q of them
};

WholePixel startPixel() {
    WholePixel p;
    p.any = false;
    p.front = 0.0f;
    p.sum = 0.0f;
    p.shown = 0u;
    p.steep = false;
    p.first = -1;
    p.behind = 0u;
    p.others = 0u;
    p.nearest = 0.0f;
    return p;
}

// Adds a source: the least and the greatest of its samples, and the flags of all.
void addSource(INOUT(WholePixel) p, int k, float low, float high, uint flags) {
    if (!(high > 0.0f)) return;
    p.any = true;
    if (!(low > 0.0f) || (flags & kSampleFlags) != 0u ||
        high - low > kOneSurface * relativeScale(frameAxis(), high)) {
        p.others |= 1u << k;
        p.nearest = max(p.nearest, high);
        return;
    }
    float mean = 0.5f * (high + low);
    if (p.first >= 0 && mean < p.front - sameWithin(p.front)) {
        p.behind |= 1u << k;
        return;
    }
    if (p.first < 0 || mean > p.front + sameWithin(p.front)) {
        p.behind |= p.shown;
        p.shown = 0u;
        p.sum = 0.0f;
        p.steep = false;
        p.front = mean;
        p.first = k;
    }
    p.shown |= 1u << k;
    p.sum += mean;
    p.steep = p.steep || high - low > oneWithin(high);
}

bool isSimple(WholePixel p) {
    if (p.first < 0) return false;
    if (p.behind == 0u && p.others == 0u) return true;
    return bitCount(p.shown) > 1 && !p.steep && !(p.nearest > p.front + sameWithin(p.front));
}

// Whether a simple pixel shows the surface of a source that is not sure: some of its samples are on
// that surface, and not all of them are extensions. `flags` are those that all of them have.
bool alsoShows(WholePixel p, float high, uint flags) {
    return high > p.front - sameWithin(p.front) && (flags & kExtensionBit) == 0u;
}

// The piece of a simple pixel, to which `also` belong, sources that are not sure; false when it is
// rejected.
bool simplePiece(WholePixel p, uint also, int column, int row, OUT(Piece) piece) {
    int count = bitCount(p.shown);
    piece.x = float(tile.x + column) + 0.5f;
    piece.y = float(tile.y + row) + 0.5f;
    piece.q = p.sum / float(count);
    piece.share = 1.0f;
    piece.seenBy = p.shown | also;
    piece.at = uint(row * kTile + column);
    if (count == 1 && tile.count > 1u &&
        rejected(piece.q, 0u, p.first, piece.x, piece.y, column * S + S / 2, row * S + S / 2))
        return false;
    vec2 g = S > 1 ? slopeInside(p.first, column * S, row * S) : slopeAt(p.first, column, row);
    piece.qx = g.x;
    piece.qy = g.y;
    return true;
}

// The colour of a piece: a quadratic fitted to the samples of the sources that see it, mapped into
// the frame along its tangent plane, and read in the middle (moving least squares). The processor
// does the same with vectors in lib/render/surface/cpu/shade.cpp; a test holds both against this.
// Needs surface_votes.glsl. From outside: FrameEntry frame; SourceEntry sources[]; MOST, sources
// that a piece takes colours from; int sourceOf(k), source k of the piece's tile; in a place
//   float ownColourOf(s, place, i, j), how far from edges, 0 on creases, bool mixesColours(s, place, i, j), whether
//   two surfaces have a part in the colour, and vec4 colourOf(s, place, i, j); bool depthMayBeUnknown(s)
// Taps tapPlaceOf(s, corner), a Place of 4x4 pixels around a point, and bool canRead(place, pixel) which of
// them are there

// A source under a piece.
struct SourceView {
    vec2 at;               // position in it, pixels
    float xu, xv, yu, yv;  // d(x, y in the frame) / d(u, v)
    float weight;          // 0 = does not see it
    bool plain;            // far from edges, on no crease: all taps are on one surface, fully covered
    float reach;           // pixels from `at` to the farthest taps that count, along either axis
};

float rowAt(vec4 row, float x, float y, float q) { return row.x * x + row.y * y + row.z * q + row.w; }

SourceView viewOf(int s, Piece piece) {
    SourceView view;
    view.weight = 0.0f;
    float x = piece.x, y = piece.y, q = piece.q;
    vec4 mx = sources[s].warpX, my = sources[s].warpY, mw = sources[s].warpW;
    float w = rowAt(mw, x, y, q), inverse = 1.0f / w;
    float u = rowAt(mx, x, y, q) * inverse, v = rowAt(my, x, y, q) * inverse;
    ivec2 size = sizeOf(s);
    view.at = vec2(u, v);
    if (!(w > 0.0f && u >= -kBesidePicture && v >= -kBesidePicture && u < float(size.x) + kBesidePicture &&
          v < float(size.y) + kBesidePicture))
        return view;
    // Along the tangent plane the denominator and the numerators change with q as well.
    float wx = mw.x + mw.z * piece.qx, wy = mw.y + mw.z * piece.qy;
    float ux = (mx.x + mx.z * piece.qx - u * wx) * inverse;
    float uy = (mx.y + mx.z * piece.qy - u * wy) * inverse;
    float vx = (my.x + my.z * piece.qx - v * wx) * inverse;
    float vy = (my.y + my.z * piece.qy - v * wy) * inverse;
    float det = ux * vy - uy * vx;
    float inverseDet = 1.0f / max(det, 1e-4f);
    // A plane that is turned away says nothing of how pixels lie to each other.
    bool turned = !(det > 0.0f);
    float step = max(ux * ux + uy * uy, vx * vx + vy * vy);
    view.reach = turned || !(step > kNarrowStep) ? kNarrowReach : 2.0f;
    view.xu = turned ? 1.0f : vy * inverseDet;
    view.xv = turned ? 0.0f : -uy * inverseDet;
    view.yu = turned ? 0.0f : -vx * inverseDet;
    view.yv = turned ? 1.0f : ux * inverseDet;
    vec3 a = vec3(rowAt(frame.eyeX, x, y, q), rowAt(frame.eyeY, x, y, q), rowAt(frame.eyeZ, x, y, q));
    vec3 b = vec3(rowAt(sources[s].rayX, x, y, q), rowAt(sources[s].rayY, x, y, q),
                  rowAt(sources[s].rayZ, x, y, q));
    float cosine = dot(a, b) / sqrt(dot(a, a) * dot(b, b));
    // exp(-kAngleFalloff angle), as one over the first terms of its inverse.
    float t = kAngleFalloff * sqrt(max(2.0f - 2.0f * cosine, 0.0f));
    float series = t * (t * (t / 6.0f + 0.5f) + 1.0f) + 1.0f;
    ivec2 pixel = ivec2(min(int(u), size.x - 1), min(int(v), size.y - 1));
    float edge = ownColourOf(s, placeOf(s, pixel), 0, 0);
    view.weight = min(1.0f, sqrt(max(det, kLeastArea))) / series *
                  (frame.fit.w + (1.0f - frame.fit.w) * min(edge / kEdgeFade, 1.0f));
    view.plain = edge >= kEdgeFade;
    return view;
}

// The first of the 4x4 taps around a position.
ivec2 firstTap(SourceView view) { return ivec2(floor(view.at - 1.5f)); }

// Which taps are on the surface of the piece, bit row * 4 + column, and 16 bits above which mix its colours with others.
uint tapsOnSurface(int s, Piece piece, SourceView view) {
    vec4 mq = sources[s].warpQ, mw = sources[s].warpW;
    float inverse = 1.0f / rowAt(mw, piece.x, piece.y, piece.q);
    float p = rowAt(mq, piece.x, piece.y, piece.q) * inverse;
    float wx = mw.x + mw.z * piece.qx, wy = mw.y + mw.z * piece.qy;
    float px = (mq.x + mq.z * piece.qx - p * wx) * inverse;
    float py = (mq.y + mq.z * piece.qy - p * wy) * inverse;
    float pu = px * view.xu + py * view.yu, pv = px * view.xv + py * view.yv;
    float all = coarseOf(s) * relativeScale(axisOf(s), p);
    float allowed = kOnSurface * all + kOnSlope * min(abs(pu) + abs(pv), kSteepestTap * all) +
                    stepOf(s) * qPerUnit(axisOf(s), p);
    ivec2 base = firstTap(view);
    Taps place = tapPlaceOf(s, base);
    uint taps = 0u;
    for (int k = 0; k < 16; ++k) {
        ivec2 c = base + ivec2(k % 4, k / 4);
        if (!canRead(place, c)) continue;
        float there = qAt(s, place, k % 4, k / 4);
        float du = float(c.x) + 0.5f - view.at.x, dv = float(c.y) + 0.5f - view.at.y;
        float predicted = p + clamp(pu * du + pv * dv, -kFarthestTap * all, kFarthestTap * all);
        if (!(there > 0.0f) || abs(there - predicted) > allowed) continue;
        taps |= (mixesColours(s, place, k % 4, k / 4) ? 0x10001u : 1u) << k;
    }
    return taps;
}

// What a tap counts that mixes colours, see kMixedTap.
float mixedTap(int s, SourceView view) {
    float least = max(kMixedTap, frame.fit.w);
    if (depthMayBeUnknown(s)) return least;
    return clamp(1.0f / sqrt(max(abs(view.xu * view.yv - view.xv * view.yu), 1e-12f)), least, 1.0f);
}

// r² = x dx² + y dx dy + z dy² of offsets in the frame, 1 where the kernel ends. Its size is that of a
// pixel of the frame, and by a share of kOwn that of a pixel of the source as the frame has it. The larger
// that is even where it is narrowest, the more it decides: there the taps lie so far apart that a pixel of
// the frame holds none, and each would colour what is nearest to it.
vec3 metricOf(SourceView v) {
    float jxx = v.xu * v.xu + v.xv * v.xv, jyy = v.yu * v.yu + v.yv * v.yv;
    float jxy = v.xu * v.yu + v.xv * v.yv, apart = 0.5f * (jxx - jyy);
    float least = 0.5f * (jxx + jyy) - sqrt(apart * apart + jxy * jxy);
    float rest = (1.0f - kOwn) / max(least, 1.0f), own = 1.0f - rest;
    float sxx = own * jxx + rest, syy = own * jyy + rest, sxy = own * jxy;
    float scale = 1.0f / (frame.fit.x * max(sxx * syy - sxy * sxy, 1e-6f));
    return vec3(syy * scale, -2.0f * sxy * scale, sxx * scale);
}

// A tap: its offset in the frame and its weight, (1 - r²)^8 times the source's.
struct Tap {
    float dx, dy, weight;
};
Tap tapOf(SourceView view, vec3 metric, ivec2 at) {
    float du = float(at.x) + 0.5f - view.at.x, dv = float(at.y) + 0.5f - view.at.y;
    Tap tap;
    tap.dx = view.xu * du + view.xv * dv;
    tap.dy = view.yu * du + view.yv * dv;
    float r2 = metric.x * tap.dx * tap.dx + metric.y * tap.dx * tap.dy + metric.z * tap.dy * tap.dy;
    float k = max(abs(du), abs(dv)) > view.reach ? 0.0f : max(1.0f - r2, 0.0f);
    k *= k;
    k *= k;
    k *= k;
    tap.weight = k * view.weight;
    return tap;
}

// The first row of the inverse of the normal matrix of 1, dx, dy, dx², dx dy, dy². Moments by power:
// 0:1 1:x 2:y 3:xx 4:xy 5:yy 6:xxx 7:xxy 8:xyy 9:yyy 10:x4 11:x3y 12:x2y2 13:xy3 14:y4
void solveFirstRow(INOUT_ARRAY(float, m, 15), OUT_ARRAY(float, row, 6)) {
    const int index[25] = {3, 4, 6,  7, 8,  4,  5, 7, 8,  9,  6, 7, 10,
                           11, 12, 7, 8, 11, 12, 13, 8, 9, 12, 13, 14};
    float hold = m[0] * frame.fit.y;
    // How far taps spread: the mean square of their distance, 1 where they lie as close as the kernel allows, close to
    // a Gaussian of a sixteenth of its squared radius.
    float spread = max(8.0f * (m[3] + m[5]) / (m[0] * frame.fit.x), 1.0f);
    float holdSquares = hold * (1.0f + kSpreadRidge * (spread * spread - 1.0f));
    float lower[25], inverse[5], z[5], y[5];
    for (int i = 0; i < 5; ++i) {
        for (int j = 0; j <= i; ++j) {
            float sum = m[index[i * 5 + j]];
            float held = i < 2 ? hold : holdSquares;
            if (i == j) sum += held;
            for (int k = 0; k < j; ++k) sum -= lower[i * 5 + k] * lower[j * 5 + k] * z[k];
            if (i == j) {
                z[i] = max(sum, held * 0.01f);
                inverse[i] = 1.0f / z[i];
            } else {
                lower[i * 5 + j] = sum * inverse[j];
            }
        }
    }
    for (int i = 0; i < 5; ++i) {
        float sum = m[i + 1];
        for (int k = 0; k < i; ++k) sum -= lower[i * 5 + k] * y[k];
        y[i] = sum;
    }
    for (int i = 0; i < 5; ++i) y[i] *= inverse[i];
    for (int i = 4; i >= 0; --i)
        for (int k = i + 1; k < 5; ++k) y[i] -= lower[k * 5 + i] * y[k];
    float schur = m[0];
    for (int i = 0; i < 5; ++i) schur -= m[i + 1] * y[i];
    row[0] = 1.0f / max(schur, m[0] * 1e-4f);
    for (int i = 0; i < 5; ++i) row[i + 1] = -y[i] * row[0];
}

// The colour of a piece, and in w the source that weighs most, -1 = none.
vec4 shadePiece(Piece piece) {
    // The best few, heaviest first, and the first that is left out.
    float topWeight[MOST + 1];
    int top[MOST + 1];
    for (int k = 0; k <= MOST; ++k) {
        topWeight[k] = 0.0f;
        top[k] = -1;
    }
    for (uint left = piece.seenBy; left != 0u; left &= left - 1u) {
        int s = sourceOf(findLSB(left));
        float weight = viewOf(s, piece).weight;
        for (int k = 0; k <= MOST; ++k) {
            if (weight > topWeight[k]) {
                float w = topWeight[k];
                int t = top[k];
                topWeight[k] = weight;
                top[k] = s;
                weight = w;
                s = t;
            }
        }
    }
    // Those that stay fade to nothing where another takes their place, as the camera moves on.
    for (int k = 0; k < MOST; ++k) {
        float ratio = topWeight[MOST] / max(topWeight[k], 1e-20f);
        topWeight[k] *= max(1.0f - ratio * ratio, kLeastKeptWeight);
    }

    float m[15];
    for (int i = 0; i < 15; ++i) m[i] = 0.0f;
    uint taps[MOST];
    for (int k = 0; k < MOST; ++k) {
        if (top[k] < 0) break;
        SourceView view = viewOf(top[k], piece);
        view.weight = topWeight[k];
        ivec2 base = firstTap(view);
        Taps place = tapPlaceOf(top[k], base);
        taps[k] = view.plain ? 0xffffu : tapsOnSurface(top[k], piece, view);
        bool weigh = !view.plain && hasAlpha(top[k]);
        float mixed = mixedTap(top[k], view);
        vec3 metric = metricOf(view);
        for (int t = 0; t < 16; ++t) {
            if ((taps[k] >> t & 1u) == 0u) continue;
            Tap tap = tapOf(view, metric, base + ivec2(t % 4, t / 4));
            float dx = tap.dx, dy = tap.dy, w = tap.weight * ((taps[k] >> (16 + t) & 1u) != 0u ? mixed : 1.0f);
            if (weigh) w *= alphaOf(top[k], place, t % 4, t / 4);
            float wx = w * dx, wy = w * dy, wxx = wx * dx, wyy = wy * dy;
            float xx = dx * dx, xy = dx * dy, yy = dy * dy;
            m[0] += w;
            m[1] += wx;
            m[2] += wy;
            m[3] += wxx;
            m[4] += wx * dy;
            m[5] += wyy;
            m[6] += wxx * dx;
            m[7] += wxx * dy;
            m[8] += wyy * dx;
            m[9] += wyy * dy;
            m[10] += wxx * xx;
            m[11] += wxx * xy;
            m[12] += wxx * yy;
            m[13] += wyy * xy;
            m[14] += wyy * yy;
        }
    }
    m[0] = max(m[0], 1e-12f);
    float row[6];
    solveFirstRow(m, row);

    vec3 sum = vec3(0.0f);
    float total = 0.0f;
    for (int k = 0; k < MOST; ++k) {
        if (top[k] < 0) break;
        SourceView view = viewOf(top[k], piece);
        view.weight = topWeight[k];
        ivec2 base = firstTap(view);
        Taps place = tapPlaceOf(top[k], base);
        bool weigh = !view.plain && hasAlpha(top[k]);
        float mixed = mixedTap(top[k], view);
        vec3 metric = metricOf(view);
        for (int t = 0; t < 16; ++t) {
            if ((taps[k] >> t & 1u) == 0u) continue;
            Tap tap = tapOf(view, metric, base + ivec2(t % 4, t / 4));
            float dx = tap.dx, dy = tap.dy;
            vec4 texel = colourOf(top[k], place, t % 4, t / 4);
            float w = tap.weight * ((taps[k] >> (16 + t) & 1u) != 0u ? mixed : 1.0f) * (weigh ? texel.w : 1.0f);
            w *= row[0] + row[1] * dx + row[2] * dy + dx * (row[3] * dx + row[4] * dy) + row[5] * dy * dy;
            sum += w * vec3(texel);
            total += w;
        }
    }
    vec3 colour = vec3(0.0f);
    if (total > 0.5f) {
        colour = max(sum / total, vec3(0.0f));
        if (frame.fit.z != 0.0f) colour = min(colour, vec3(1.0f));
    } else if (top[0] >= 0) {
        // No tap on the surface: the nearest pixel that is one.
        vec2 at = viewOf(top[0], piece).at;
        ivec2 last = sizeOf(top[0]) - 1;
        ivec2 pixel = ivec2(clamp(int(at.x), 0, last.x), clamp(int(at.y), 0, last.y));
        colour = vec3(colourOf(top[0], placeOf(top[0], pixel), 0, 0));
    }
    return vec4(colour, float(top[0]));
}

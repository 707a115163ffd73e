// Surface mode, pass D: the colour of each piece, a quadratic fitted to the samples of the sources
// that see it and read in the middle. A thread does one piece. The twin is
// lib/render/surface/cpu/shade.cpp. MOST = sources that one piece takes colours from.
layout(local_size_x = 128) in;
layout(std430, binding = 10) writeonly buffer PieceColourBuffer { vec4 pieceColours[]; };

struct View {
    vec2 uv;
    vec4 jacobian;  // xu, xv, yu, yv: d(x, y in the frame) / d(u, v)
    float weight;
    bool plain;
};

Piece piece;

View place(int s) {
    View view;
    view.weight = 0.0;
    vec4 p = vec4(piece.x, piece.y, piece.q, 1.0);
    vec4 mx = sources[s].warpX, my = sources[s].warpY, mw = sources[s].warpW;
    float w = dot(mw, p), inverse = 1.0 / w;
    vec2 uv = vec2(dot(mx, p), dot(my, p)) * inverse;
    view.uv = uv;
    if (!(w > 0.0 && uv.x >= 0.0 && uv.y >= 0.0 && uv.x < float(sources[s].size.x) &&
          uv.y < float(sources[s].size.y)))
        return view;
    float wx = mw.x + mw.z * piece.qx, wy = mw.y + mw.z * piece.qy;
    float ux = (mx.x + mx.z * piece.qx - uv.x * wx) * inverse;
    float uy = (mx.y + mx.z * piece.qy - uv.x * wy) * inverse;
    float vx = (my.x + my.z * piece.qx - uv.y * wx) * inverse;
    float vy = (my.y + my.z * piece.qy - uv.y * wy) * inverse;
    float det = ux * vy - uy * vx;
    view.jacobian = vec4(vy, -uy, -vx, ux) / max(det, 1e-4);
    vec3 a = vec3(dot(eyeX, p), dot(eyeY, p), dot(eyeZ, p));
    vec3 b = vec3(dot(sources[s].rayX, p), dot(sources[s].rayY, p), dot(sources[s].rayZ, p));
    float cosine = dot(a, b) / sqrt(dot(a, a) * dot(b, b));
    float t = kAngleFalloff * sqrt(max(2.0 - 2.0 * cosine, 0.0));
    float series = t * (t * (t / 6.0 + 0.5) + 1.0) + 1.0;
    uint code = texelFetch(surfaces, ivec3(min(ivec2(uv), sources[s].size.xy - 1), s), 0).w;
    float edge = float(code >> 8 & 7u);
    view.weight = min(1.0, sqrt(max(det, 0.0))) / series * (kEdgeWeight + (1.0 - kEdgeWeight) * min(edge / kEdgeFade, 1.0));
    view.plain = edge >= kEdgeFade;
    return view;
}

// Which taps lie on the surface of the piece, bit row * 4 + column.
uint maskTaps(int s, View view, ivec2 base) {
    vec4 at = vec4(piece.x, piece.y, piece.q, 1.0);
    vec4 mq = sources[s].warpQ, mw = sources[s].warpW;
    float inverse = 1.0 / dot(mw, at), p = dot(mq, at) * inverse;
    float wx = mw.x + mw.z * piece.qx, wy = mw.y + mw.z * piece.qy;
    float px = (mq.x + mq.z * piece.qx - p * wx) * inverse;
    float py = (mq.y + mq.z * piece.qy - p * wy) * inverse;
    vec2 g = px * view.jacobian.xy + py * view.jacobian.zw;
    float all = whole(sources[s].axis, p);
    float allowed = kOnSurface * all + kOnSlope * min(abs(g.x) + abs(g.y), kSteepestTap * all);
    uint mask = 0u;
    for (int k = 0; k < 16; ++k) {
        ivec2 c = base + ivec2(k & 3, k >> 2);
        if (!inside(s, c)) continue;
        float there = uintBitsToFloat(texelFetch(surfaces, ivec3(c, s), 0).x);
        float predicted = p + clamp(dot(g, vec2(c) + 0.5 - view.uv), -kFarthestTap * all, kFarthestTap * all);
        if (there > 0.0 && !(abs(there - predicted) > allowed)) mask |= 1u << k;
    }
    return mask;
}

// r² = x du² + y du dv + z dv² of offsets in the frame: a coarse source spreads.
vec3 metricOf(vec4 j) {
    float sxx = kOwn * dot(j.xy, j.xy) + (1.0 - kOwn), syy = kOwn * dot(j.zw, j.zw) + (1.0 - kOwn);
    float sxy = kOwn * dot(j.xy, j.zw);
    float scale = 1.0 / (fit.x * max(sxx * syy - sxy * sxy, 1e-6));
    return vec3(syy, -2.0 * sxy, sxx) * scale;
}

// The first row of the inverse of the normal matrix of 1, dx, dy, dx², dxdy, dy².
void solveFirstRow(float m[15], out float first, out float row[5]) {
    const int index[25] = int[25](3, 4, 6, 7, 8, 4, 5, 7, 8, 9, 6, 7, 10, 11, 12, 7, 8, 11, 12, 13,
                                  8, 9, 12, 13, 14);
    float hold = m[0] * fit.y;
    float lower[25], inverse[5], z[5];
    for (int i = 0; i < 5; ++i) {
        for (int j = 0; j <= i; ++j) {
            float sum = m[index[i * 5 + j]];
            if (i == j) sum += hold;
            for (int k = 0; k < j; ++k) sum -= lower[i * 5 + k] * lower[j * 5 + k] * z[k];
            if (i == j) {
                z[i] = max(sum, hold * 0.01);
                inverse[i] = 1.0 / z[i];
            } else {
                lower[i * 5 + j] = sum * inverse[j];
            }
        }
    }
    float y[5];
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
    first = 1.0 / max(schur, m[0] * 1e-4);
    for (int i = 0; i < 5; ++i) row[i] = -y[i] * first;
}

void main() {
    uint index = gl_WorkGroupID.x * 128u + gl_LocalInvocationID.x;
    if (index >= pieceCount) return;
    piece = pieces[index];
    uint firstLocal = tiles[piece.at / uint(TILE * TILE)].first;

    // The best few, heaviest first.
    float topWeight[MOST];
    int top[MOST];
    for (int k = 0; k < MOST; ++k) {
        topWeight[k] = 0.0;
        top[k] = -1;
    }
    for (uint left = piece.seenBy; left != 0u; left &= left - 1u) {
        int s = int(locals[firstLocal + uint(findLSB(left))].x);
        float weight = place(s).weight;
        for (int k = 0; k < MOST; ++k) {
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

    float m[15];
    for (int i = 0; i < 15; ++i) m[i] = 0.0;
    uint masks[MOST];
    for (int k = 0; k < MOST; ++k) {
        if (top[k] < 0) break;
        int s = top[k];
        View view = place(s);
        ivec2 base = ivec2(floor(view.uv - 1.5));
        masks[k] = view.plain ? 0xffffu : maskTaps(s, view, base);
        bool weigh = !view.plain && sources[s].size.z != 0;
        vec3 metric = metricOf(view.jacobian);
        for (int t = 0; t < 16; ++t) {
            if ((masks[k] >> t & 1u) == 0u) continue;
            ivec2 c = base + ivec2(t & 3, t >> 2);
            vec2 d = vec2(c) + 0.5 - view.uv;
            float dx = dot(view.jacobian.xy, d), dy = dot(view.jacobian.zw, d);
            float kernel = max(1.0 - (metric.x * dx * dx + metric.y * dx * dy + metric.z * dy * dy), 0.0);
            kernel *= kernel;
            kernel *= kernel;
            kernel *= kernel;
            float w = kernel * view.weight;
            if (weigh) w *= texelFetch(colours, ivec3(c, s), 0).a;
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
    m[0] = max(m[0], 1e-12);
    float constant, row[5];
    solveFirstRow(m, constant, row);

    vec3 sum = vec3(0.0);
    float total = 0.0;
    for (int k = 0; k < MOST; ++k) {
        if (top[k] < 0) break;
        int s = top[k];
        View view = place(s);
        ivec2 base = ivec2(floor(view.uv - 1.5));
        bool weigh = !view.plain && sources[s].size.z != 0;
        vec3 metric = metricOf(view.jacobian);
        for (int t = 0; t < 16; ++t) {
            if ((masks[k] >> t & 1u) == 0u) continue;
            ivec2 c = base + ivec2(t & 3, t >> 2);
            vec2 d = vec2(c) + 0.5 - view.uv;
            float dx = dot(view.jacobian.xy, d), dy = dot(view.jacobian.zw, d);
            float kernel = max(1.0 - (metric.x * dx * dx + metric.y * dx * dy + metric.z * dy * dy), 0.0);
            kernel *= kernel;
            kernel *= kernel;
            kernel *= kernel;
            vec4 texel = texelFetch(colours, ivec3(c, s), 0);
            float w = kernel * view.weight * (weigh ? texel.a : 1.0);
            w *= constant + row[0] * dx + row[1] * dy + dx * (row[2] * dx + row[3] * dy) + row[4] * dy * dy;
            sum += w * texel.rgb;
            total += w;
        }
    }
    vec3 colour = vec3(0.0);
    if (total > 0.5) {
        colour = max(sum / total, vec3(0.0));
        if (fit.z != 0.0) colour = min(colour, vec3(1.0));
    } else if (top[0] >= 0) {
        // No tap on the surface: the nearest pixel that is one.
        int s = top[0];
        ivec2 c = clamp(ivec2(place(s).uv), ivec2(0), sources[s].size.xy - 1);
        colour = texelFetch(colours, ivec3(c, s), 0).rgb;
    }
    pieceColours[index] = vec4(colour, float(top[0]));
}

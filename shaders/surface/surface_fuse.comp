// Surface mode, pass B: what each pixel shows. The surfaces of the sources are fused and checked
// against what the others see; samples of one depth become one piece. A thread does one pixel. The
// twin is lib/render/surface/cpu/fuse.cpp.
layout(local_size_x = 16, local_size_y = 16) in;
layout(std430, binding = 4) readonly buffer SampleBuffer { uint samples[]; };

Tile tile;
ivec2 pixel;

float same(float q) { return kSame * whole(axis, q) + tile.step * perUnit(axis, q); }
int sourceOf(uint k) { return int(locals[tile.first + k].x); }

uint sampleOf(uint k, int i, int j) {
    uint slot = locals[tile.first + k].y;
    return slot == NO_SLOT ? 0u : samples[slot * uint(SIDE * SIDE) + uint(j * SIDE + i)];
}

float chooseSlope(bool hasA, float a, bool hasB, float b) {
    if (hasA && hasB) {
        if (abs(a) < 0.5 * abs(b)) return a;
        if (abs(b) < 0.5 * abs(a)) return b;
        return 0.5 * (a + b);
    }
    return hasA ? a : hasB ? b : 0.0;
}

vec2 slope(uint k, int i, int j) {
    float here = uintBitsToFloat(sampleOf(k, i, j));
    float limit = kLinkedSamples * whole(axis, here);
    float left = i > 0 ? uintBitsToFloat(sampleOf(k, i - 1, j)) : 0.0;
    float right = i < SIDE - 1 ? uintBitsToFloat(sampleOf(k, i + 1, j)) : 0.0;
    float up = j > 0 ? uintBitsToFloat(sampleOf(k, i, j - 1)) : 0.0;
    float down = j < SIDE - 1 ? uintBitsToFloat(sampleOf(k, i, j + 1)) : 0.0;
    return vec2(chooseSlope(left > 0.0 && abs(here - left) < limit, here - left,
                            right > 0.0 && abs(right - here) < limit, right - here),
                chooseSlope(up > 0.0 && abs(here - up) < limit, here - up,
                            down > 0.0 && abs(down - here) < limit, down - here)) * float(S);
}

#if S > 1
// The same of a pixel whose samples are all of one surface; `at` is its first.
vec2 slopeInside(uint k, ivec2 at) {
    vec2 low = vec2(uintBitsToFloat(sampleOf(k, at.x, at.y + S / 2)),
                    uintBitsToFloat(sampleOf(k, at.x + S / 2, at.y)));
    vec2 high = vec2(uintBitsToFloat(sampleOf(k, at.x + S - 1, at.y + S / 2)),
                     uintBitsToFloat(sampleOf(k, at.x + S / 2, at.y + S - 1)));
    return (high - low) * (float(S) / float(S - 1));
}
#endif

float alphaAt(int s, vec2 uv) {
    if (sources[s].size.z == 0) return 1.0;
    vec2 f = floor(uv - 0.5), t = uv - 0.5 - f;
    ivec2 a = max(ivec2(f), ivec2(0)), b = min(ivec2(f) + 1, sources[s].size.xy - 1);
    return mix(mix(texelFetch(colours, ivec3(a, s), 0).a,
                   texelFetch(colours, ivec3(b.x, a.y, s), 0).a, t.x),
               mix(texelFetch(colours, ivec3(a.x, b.y, s), 0).a,
                   texelFetch(colours, ivec3(b, s), 0).a, t.x), t.y);
}

// 0 = none, 1 = free by depth, 2 = free by alpha.
int opinionOf(int s, float x, float y, float q) {
    vec4 h = warp(s, x, y, q);
    if (!(h.w > 0.0)) return 0;
    vec2 uv = h.xy / h.w;
    float p = h.z / h.w;
    if (!(uv.x >= 0.0 && uv.y >= 0.0 && uv.x < float(sources[s].size.x) &&
          uv.y < float(sources[s].size.y) && p > 0.0))
        return 0;
    if (alphaAt(s, uv) < kFreeAlpha) return 2;
    ivec2 corner = ivec2(floor(uv - 0.5));
    vec4 ownAxis = sources[s].axis;
    float margin = ownAxis.w * whole(ownAxis, p) + ownAxis.z * perUnit(ownAxis, p);
    bool any = false;
    for (int k = 0; k < 4; ++k) {
        ivec2 c = corner + ivec2(k & 1, k >> 1);
        if (!inside(s, c)) continue;
        uvec3 texel = texelFetch(surfaces, ivec3(c, s), 0).xyz;
        float there = uintBitsToFloat(texel.x);
        if (there < 0.0) return 0;  // pruned
        if (!(there > 0.0)) continue;
        any = true;
        float reach = 4.0 * kLinkedSamples * whole(ownAxis, there);
        if (p < there + margin - reach) return 0;
        vec2 g = vec2(uintBitsToFloat(texel.y), uintBitsToFloat(texel.z));
        float predicted = there + dot(g, uv - 0.5 - vec2(c));
        if (p < predicted + margin + kSlopeDoubt * (abs(g.x) + abs(g.y))) return 0;
    }
    return any ? 1 : 0;
}

bool rejected(uint value, uint source, vec2 at, int i, int j) {
    float q = uintBitsToFloat(value);
    int enough = (value & NEAR_EDGE) != 0u ? 1 : 2, votes = 0;
    for (uint k = 0u; k < tile.count; ++k) {
        int s = sourceOf(k);
        if (k == source) {
            if (sources[s].size.z == 0 || (value & NEAR_EDGE) == 0u) continue;
            vec4 h = warp(s, at.x, at.y, q);
            if (alphaAt(s, clamp(h.xy / h.w, vec2(0.0), vec2(sources[s].size.xy))) < kFreeAlpha)
                return true;
            continue;
        }
        uint other = sampleOf(k, i, j);
        if (other != 0u && (other & EXTENSION) == 0u && abs(uintBitsToFloat(other) - q) < same(q))
            continue;
        int opinion = opinionOf(s, at.x, at.y, q);
        if (opinion == 2) return true;
        if (opinion == 1 && ++votes >= enough) return true;
    }
    return false;
}

// The first surface of a sample that survives: q and who sees it; seenBy 0 = none.
bool fuseSample(int i, int j, out float q, out uint seenBy) {
    vec2 at = vec2(tile.x, tile.y) + (vec2(i, j) + 0.5) / float(S);
    uint lastValue = 0xffffffffu, lastSource = 0u;
    seenBy = 0u;
    q = 0.0;
    for (uint tries = 0u; tries < tile.count; ++tries) {
        // The next candidate behind the last one; equal ones in the order of the sources.
        uint value = 0u, source = 0u;
        for (uint k = 0u; k < tile.count; ++k) {
            uint v = sampleOf(k, i, j);
            bool after = v < lastValue || (v == lastValue && k > lastSource);
            if (after && v > value) {
                value = v;
                source = k;
            }
        }
        if (value == 0u) return false;
        lastValue = value;
        lastSource = source;
        float front = uintBitsToFloat(value), behind = front - same(front);
        float sum = 0.0, weights = 0.0;
        uint meshes = 0u, extensions = 0u;
        bool sure = false;
        for (uint k = 0u; k < tile.count; ++k) {
            uint v = sampleOf(k, i, j);
            bool after = v < value || (v == value && k >= source);
            float f = uintBitsToFloat(v);
            if (v == 0u || !after || (k != source && !(f > behind))) continue;
            bool extension = (v & EXTENSION) != 0u;
            float weight = extension ? kExtensionWeight : 1.0;
            sum += weight * (f - front);
            weights += weight;
            if (extension) extensions |= 1u << k;
            else meshes |= 1u << k;
            sure = sure || (k != source && (v & 3u) == 0u);
        }
        if (!(sure && (value & 3u) == 0u) && rejected(value, source, at, i, j)) continue;
        q = front + sum / weights;
        seenBy = meshes != 0u ? meshes : extensions;
        return true;
    }
    return false;
}

shared uint groupCount, groupFirst;

void main() {
    uint t = gl_WorkGroupID.x / uint(TILE * TILE / 256);
    uint part = gl_WorkGroupID.x % uint(TILE * TILE / 256);
    tile = tiles[t];
    pixel = ivec2(part % uint(TILE / 16), part / uint(TILE / 16)) * 16 + ivec2(gl_LocalInvocationID.xy);
    if (gl_LocalInvocationIndex == 0u) groupCount = 0u;
    barrier();

    float qs[S * S];
    uint seen[S * S];
    int at[S * S];
    int count = 0;       // samples with a surface, nearest first
    uint clusters = 0u;
    bool whole_ = false;  // one piece fills the pixel
    uint present = 0u;
    int first = -1;
    float q = 0.0;
    if (tile.x + pixel.x < frameSize.x && tile.y + pixel.y < frameSize.y) {
        bool simple = true, any = false;
        float lowMean = 3e38, highMean = 0.0, sum = 0.0;
        for (uint k = 0u; k < tile.count && simple; ++k) {
            if (locals[tile.first + k].y == NO_SLOT) continue;
            uint low = 0xffffffffu, high = 0u, remarks = 0u;
            for (int j = 0; j < S; ++j) {
                for (int i = 0; i < S; ++i) {
                    uint v = sampleOf(k, pixel.x * S + i, pixel.y * S + j);
                    low = min(low, v);
                    high = max(high, v);
                    remarks |= v;
                }
            }
            if (high == 0u) continue;
            any = true;
            float l = uintBitsToFloat(low), h = uintBitsToFloat(high);
            if (low == 0u || (remarks & 3u) != 0u || h - l > kOneSurface * whole(axis, h)) simple = false;
            float mean = 0.5 * (h + l);
            lowMean = min(lowMean, mean);
            highMean = max(highMean, mean);
            sum += mean;
            present |= 1u << k;
            if (first < 0) first = int(k);
        }
        if (any && simple && !(highMean - lowMean > same(highMean))) {
            int n = bitCount(present);
            q = sum / float(n);
            whole_ = n > 1 || tile.count == 1u ||
                     !rejected(floatBitsToUint(q) & ~3u, uint(first),
                               vec2(tile.x, tile.y) + vec2(pixel) + 0.5, pixel.x * S + S / 2,
                               pixel.y * S + S / 2);
            clusters = whole_ ? 1u : 0u;
        } else if (any) {
            for (int k = 0; k < S * S; ++k) {
                float f;
                uint by;
                if (!fuseSample(pixel.x * S + k % S, pixel.y * S + k / S, f, by)) continue;
                int place = count++;
                for (; place > 0 && qs[place - 1] < f; --place) {
                    qs[place] = qs[place - 1];
                    seen[place] = seen[place - 1];
                    at[place] = at[place - 1];
                }
                qs[place] = f;
                seen[place] = by;
                at[place] = k;
            }
            for (int k = 0; k < count; ++k)
                if (k == 0 || qs[k - 1] - qs[k] > kJump * whole(axis, qs[k - 1]) +
                                                      tile.step * perUnit(axis, qs[k - 1]))
                    ++clusters;
        }
    }
    // Room for the pieces of all pixels of the group at once.
    uint mine = clusters > 0u ? atomicAdd(groupCount, clusters) : 0u;
    barrier();
    if (gl_LocalInvocationIndex == 0u && groupCount > 0u) {
        groupFirst = atomicAdd(pieceCount, groupCount);
        atomicMax(groups[0], (groupFirst + groupCount + 127u) / 128u);
    }
    barrier();
    mine += groupFirst;
    uint index = t * uint(TILE * TILE) + uint(pixel.y * TILE + pixel.x);
    ranges[index] = uvec2(mine, clusters);
    if (whole_) {
#if S > 1
        vec2 g = slopeInside(uint(first), pixel * S);
#else
        vec2 g = slope(uint(first), pixel.x, pixel.y);
#endif
        pieces[mine] = Piece(float(tile.x + pixel.x) + 0.5, float(tile.y + pixel.y) + 0.5, q, g.x,
                             g.y, 1.0, present, index);
        return;
    }
    for (int begin = 0; begin < count;) {
        int end = begin + 1;
        while (end < count && !(qs[end - 1] - qs[end] > kJump * whole(axis, qs[end - 1]) +
                                                            tile.step * perUnit(axis, qs[end - 1])))
            ++end;
        vec3 sum = vec3(0.0);
        uint by = 0u;
        for (int k = begin; k < end; ++k) {
            sum += vec3((float(at[k] % S) + 0.5) / float(S), (float(at[k] / S) + 0.5) / float(S), qs[k]);
            by |= seen[k];
        }
        float n = 1.0 / float(end - begin);
        int middle = (begin + end) / 2;
        vec2 g = slope(uint(findLSB(seen[middle])), pixel.x * S + at[middle] % S,
                       pixel.y * S + at[middle] / S);
        pieces[mine++] = Piece(float(tile.x + pixel.x) + sum.x * n, float(tile.y + pixel.y) + sum.y * n,
                               sum.z * n, g.x, g.y, float(end - begin) / float(S * S), by, index);
        begin = end;
    }
}

#include "lib/render/splat/cpu/kernels.hpp"

#include <hwy/cache_control.h>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lib/render/splat/cpu/kernels.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#include "lib/render/splat/cpu/accumulate-inl.hpp"
#include "lib/render/splat/cpu/patch-inl.hpp"
#include "lib/render/splat/cpu/point_colour-inl.hpp"
#include "lib/render/splat/cpu/rows-inl.hpp"
#include "lib/render/splat/cpu/shape-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace stx::splat::HWY_NAMESPACE {

// Fetches a row of a block that comes later, `colours` too when the pass needs them.
HWY_INLINE void fetchRow(const Ahead& ahead, int row, bool colours) {
    if (!ahead.source) return;
    const RectangleImages& s = *ahead.source;
    const BlockTask& t = *ahead.task;
    // The end of a row: its beginning may be in the line that the block to the left has fetched.
    const std::size_t pixel = static_cast<std::size_t>(std::min(t.v0 + row, t.v1 - 1)) * s.stride +
                              static_cast<std::size_t>(t.u1 - 1);
    hwy::Prefetch(s.depth + pixel);
    if (!t.uniform) hwy::Prefetch(s.slopes + pixel);
    if (!colours && t.opaque) return;
    if (s.rgba8)
        hwy::Prefetch(s.rgba8 + 4 * pixel);
    else
        hwy::Prefetch(s.rgbaFloat + 4 * pixel);
    if (colours && s.normals) hwy::Prefetch(s.normals + 4 * pixel);
}

HWY_INLINE bool inPatches(const Ellipse& e) {
    return kPatches && e.x1 - e.x0 < kMostPatches * kPatch && e.y1 - e.y0 < kMostPatches * kPatch;
}

// Calls draw(patch) for each part of an ellipse.
template <class F>
HWY_INLINE void forPatches(const Ellipse& e, const Region& region, const F& draw) {
    Ellipse patch = e;
    for (patch.y0 = e.y0; patch.y0 <= e.y1; patch.y0 += kPatch) {
        patch.y1 = std::min(e.y1, patch.y0 + kPatch - 1);
        for (patch.x0 = e.x0; patch.x0 <= e.x1; patch.x0 += kPatch) {
            patch.x1 = std::min(e.x1, patch.x0 + kPatch - 1);
            draw(patchOf(patch, region));
        }
    }
}

HWY_INLINE void depthEllipse(DF d, const Ellipse& e, const Region& region) {
    if (inPatches(e))
        return forPatches(e, region, [&](const Patch& p) HWY_ATTR { depthPatch(p, region); });
    const int lanes = static_cast<int>(hn::Lanes(d));
    forRows(e, [&](int x0, int x1, int y) HWY_ATTR {
        float* row = region.depth + region.element(x0, y);
        for (int x = x0; x <= x1; x += lanes, row += lanes) {
            const Across a = across(d, e, x, x1, y);
            const auto core = hn::And(a.in, hn::Le(a.q, hn::Set(d, e.core2)));
            const VF old = hn::LoadU(d, row);
            hn::StoreU(hn::IfThenElse(core, hn::Min(old, a.z), old), d, row);
        }
    });
}

template <bool kOpaque, bool kNormals>
HWY_INLINE void colourEllipse(DF d, const Ellipse& e, const PointColour& point, float tolerance,
                              const Region& region) {
    if (inPatches(e))
        return forPatches(e, region, [&](const Patch& p) HWY_ATTR {
            colourPatch<kOpaque, kNormals>(p, point, tolerance, region);
        });
    const int lanes = static_cast<int>(hn::Lanes(d));
    HWY_ALIGN float weights[kBlock];
    forRows(e, [&](int x0, int x1, int y) HWY_ATTR {
        std::size_t start = region.element(x0, y);
        for (int x = x0; x <= x1; x += lanes, start += static_cast<std::size_t>(lanes)) {
            const Across a = across(d, e, x, x1, y);
            const VF front = hn::LoadU(d, region.depth + start);
            const auto near = hn::And(hn::And(a.in, hn::Lt(a.q, hn::Set(d, kReach2))),
                                      hn::Le(a.z, hn::Mul(front, hn::Set(d, 1.0f + tolerance))));
            std::uint32_t bits = bitsOf(d, near);
            if (!bits) continue;
            // Falls off like a Gaussian and reaches zero at kReach2.
            const VF fall = hn::MulAdd(a.q, hn::Set(d, -1.0f / kReach2), hn::Set(d, 1.0f));
            hn::Store(hn::Mul(hn::Mul(fall, fall), hn::Mul(fall, hn::Set(d, e.quality))), d,
                      weights);
            while (bits) {
                const int k = __builtin_ctz(bits);
                bits &= bits - 1;
                const std::size_t at = start + static_cast<std::size_t>(k);
                const Four colour =
                    plus(plus(point.colour, x + k - e.x, point.across), y - e.y, point.down);
                addTo(region.colour + 4 * at, weights[k], colour);
                if (!kOpaque) region.missing[at] += weights[k] * point.missing;
                if (kNormals) addTo(region.normals + 4 * at, weights[k], point.normal);
            }
        }
    });
}

template <bool kUniform>
void depthBlock(const RectangleImages& s, const BlockTask& t, const Ahead& ahead,
                const Region& region) {
    const DF d;
    const DI di;
    const int lanes = static_cast<int>(hn::Lanes(d));
    const VF one = hn::Set(d, 1.0f), infinity = hn::Set(d, kInfinity);
    HWY_ALIGN std::int32_t offset[kBlock];
    HWY_ALIGN float above[2 * kBlock], below[2 * kBlock];
    RowMap map(s.map, t.u0, t.v0);
    for (int v = t.v0; v < t.v1; ++v, map.next()) {
        fetchRow(ahead, v - t.v0, false);
        if (!halvesOf(t, v - t.v0)) continue;
        for (int i = 0; i < t.u1 - t.u0; i += lanes) {
            const std::size_t pixel = static_cast<std::size_t>(v) * s.stride + t.u0 + i;
            const int count = t.u1 - t.u0 - i;
            Splats p = splatsOf<kUniform, false>(d, s, t, map, v - t.v0, i, pixel, count, region);
            if (!t.opaque) {
                auto solid = hides(d, alphaOf(d, s, pixel, count));
                if (t.glass) solid = hn::Or(solid, glassOf(d, s, pixel, count));
                p.small = hn::And(p.small, solid);
                p.large = hn::And(p.large, solid);
            }
            if (!kUniform) {
                if (const std::uint32_t large = bitsOf(d, p.large))
                    forLarge<false>(
                        d, p, large, region,
                        [&](int, const Patch& patch, const Steps&)
                            HWY_ATTR { depthPatch(patch, region); },
                        [&](int, const Ellipse& e, const Steps&)
                            HWY_ATTR { depthEllipse(d, e, region); });
            }
            std::uint32_t bits = bitsOf(d, p.small);
            if (!bits) continue;
            hn::Store(p.at.offset, di, offset);
            const VF fx = p.at.fx, fy = p.at.fy;
            const VF gx = hn::Sub(one, fx), gy = hn::Sub(one, fy);
            const VF fx2 = hn::Mul(fx, fx), gx2 = hn::Mul(gx, gx);
            const VF fy2 = hn::Mul(fy, fy), gy2 = hn::Mul(gy, gy);
            // The plane of the splat at the four pixel centres.
            const VF zx = hn::Mul(p.at.z, p.slopeX), zy = hn::Mul(p.at.z, p.slopeY);
            const VF z = hn::NegMulAdd(fx, zx, hn::NegMulAdd(fy, zy, p.at.z));
            const auto core = [&](VF x2, VF y2, VF depth) HWY_ATTR {
                return hn::IfThenElse(hn::Le(hn::Add(x2, y2), p.core2), depth, infinity);
            };
            storePairs(d, core(fx2, fy2, z), core(gx2, fy2, hn::Add(z, zx)), above);
            storePairs(d, core(fx2, gy2, hn::Add(z, zy)),
                       core(gx2, gy2, hn::Add(hn::Add(z, zx), zy)), below);
            forBits(bits, [&](int k) HWY_ATTR {
                float* to = region.depth + offset[k];
                leastOfPair(to, above + 2 * k);
                leastOfPair(to + region.stride, below + 2 * k);
            });
        }
    }
}

// The low-pass filter over an output pixel: close to a Gaussian of sigma 0.35, zero from 1 on.
HWY_INLINE VF lowPass(DF d, VF x2) {
    const VF a = hn::Sub(hn::Set(d, 1.0f), x2);
    const VF b = hn::Mul(a, a);
    return hn::Mul(b, b);
}

// Whether a vector of 8-bit colours and what surrounds it may be read from a pixel on.
HWY_INLINE bool canReadAround(const RectangleImages& s, std::size_t pixel, int count, int lanes) {
    const auto at = static_cast<std::ptrdiff_t>(pixel);
    return s.rgba8 && count >= lanes && at - s.stride >= -s.before && at >= 1 - s.before &&
           at + s.stride + lanes <= s.after;
}

// The small splats of a row of points, lane by lane.
struct SmallSplats {
    HWY_ALIGN std::int32_t offset[kBlock];  // of the upper left of their four pixels
    HWY_ALIGN float w00[kBlock], w10[kBlock], w01[kBlock], w11[kBlock];
    HWY_ALIGN float fractionX[kBlock], fractionY[kBlock];
    HWY_ALIGN float uAcross[kBlock], vAcross[kBlock], uDown[kBlock], vDown[kBlock];
};

// Weights of small splats on their four pixels; the lanes that add to any.
HWY_INLINE hn::Mask<DF> weighSmall(DF d, const Splats& p, VF tolerance, const Region& region,
                                   RowOfPoints& r) {
    const DI di;
    const VF one = hn::Set(d, 1.0f);
    const VI stride = hn::Set(di, region.stride), nextPixel = hn::Set(di, 1);
    const VF fx = p.at.fx, fy = p.at.fy;
    const VF gx = hn::Sub(one, fx), gy = hn::Sub(one, fy);
    const VF zx = hn::Mul(p.at.z, p.slopeX), zy = hn::Mul(p.at.z, p.slopeY);
    const VF z = hn::NegMulAdd(fx, zx, hn::NegMulAdd(fy, zy, p.at.z));
    const auto weigh = [&](VF wx, VF wy, VF depth, VI at, VF& weight) HWY_ATTR {
        const VF front = hn::GatherIndex(d, region.depth, at);
        const auto near = hn::And(p.small, hn::Le(depth, hn::Mul(front, tolerance)));
        weight = hn::IfThenElseZero(near, hn::Mul(wx, wy));
        return near;
    };
    const VF x0 = hn::Mul(p.quality, lowPass(d, hn::Mul(fx, fx)));
    const VF x1 = hn::Mul(p.quality, lowPass(d, hn::Mul(gx, gx)));
    const VF y0 = lowPass(d, hn::Mul(fy, fy)), y1 = lowPass(d, hn::Mul(gy, gy));
    const VI below = hn::Add(p.at.offset, stride);
    const VF zRight = hn::Add(z, zx);
    return hn::Or(hn::Or(weigh(x0, y0, z, p.at.offset, r.w00),
                         weigh(x1, y0, zRight, hn::Add(p.at.offset, nextPixel), r.w10)),
                  hn::Or(weigh(x0, y1, hn::Add(z, zy), below, r.w01),
                         weigh(x1, y1, hn::Add(zRight, zy), hn::Add(below, nextPixel), r.w11)));
}

// Adds the small splat of pixel `pixel` + `k` to its four pixels.
template <bool kOpaque, bool kNormals>
HWY_INLINE void addSmall(const RectangleImages& s, std::size_t pixel, const SmallSplats& all, int k,
                         const Region& region) {
    PointColour point = pointColourOf(s, pixel + k, kOpaque);
    if (all.uAcross[k] != 0 || all.vDown[k] != 0)
        addGradient(s, pixel + k, all.uAcross[k], all.vAcross[k], all.uDown[k], all.vDown[k],
                    point);
    const float w00 = all.w00[k], w10 = all.w10[k], w01 = all.w01[k], w11 = all.w11[k];
    const Four c00 =
        plus(plus(point.colour, -all.fractionX[k], point.across), -all.fractionY[k], point.down);
    const Four c01 = plus(c00, point.down);
    const std::size_t at = static_cast<std::size_t>(all.offset[k]);
    const std::size_t under = at + static_cast<std::size_t>(region.stride);
    addToPair(region.colour + 4 * at, w00, c00, w10, plus(c00, point.across));
    addToPair(region.colour + 4 * under, w01, c01, w11, plus(c01, point.across));
    if (!kOpaque) {
        region.missing[at] += w00 * point.missing;
        region.missing[at + 1] += w10 * point.missing;
        region.missing[under] += w01 * point.missing;
        region.missing[under + 1] += w11 * point.missing;
    }
    if (kNormals) {
        addToPair(region.normals + 4 * at, w00, point.normal, w10, point.normal);
        addToPair(region.normals + 4 * under, w01, point.normal, w11, point.normal);
    }
}

// Adds the large splats among those from `pixel` on.
template <bool kOpaque, bool kNormals>
HWY_INLINE void colourLarge(DF d, const RectangleImages& s, const Splats& p, std::size_t pixel,
                            float tolerance, const Region& region) {
    const std::uint32_t large = bitsOf(d, p.large);
    if (!large) return;
    const auto colourOf = [&](int k, const Steps& steps) HWY_ATTR {
        PointColour point = pointColourOf(s, pixel + k, kOpaque);
        if (steps.uAcross != 0 || steps.vDown != 0)
            addGradient(s, pixel + k, steps.uAcross, steps.vAcross, steps.uDown, steps.vDown,
                        point);
        return point;
    };
    forLarge<true>(
        d, p, large, region,
        [&](int k, const Patch& patch, const Steps& steps) HWY_ATTR {
            colourPatch<kOpaque, kNormals>(patch, colourOf(k, steps), tolerance, region);
        },
        [&](int k, const Ellipse& e, const Steps& steps) HWY_ATTR {
            colourEllipse<kOpaque, kNormals>(d, e, colourOf(k, steps), tolerance, region);
        });
}

template <bool kUniform, bool kOpaque, bool kNormals>
void colourBlock(const RectangleImages& s, const BlockTask& t, const Ahead& ahead,
                 const Region& region) {
    const DF d;
    const DI di;
    const int lanes = static_cast<int>(hn::Lanes(d));
    const VF tolerance = hn::Set(d, 1.0f + t.tolerance);
    SmallSplats all;
    if (kUniform) {
        // The same for all pixels.
        for (int i = 0; i < kBlock; ++i) {
            all.uAcross[i] = t.uAcross;
            all.vAcross[i] = t.vAcross;
            all.uDown[i] = t.uDown;
            all.vDown[i] = t.vDown;
        }
    }
    RowMap map(s.map, t.u0, t.v0);
    for (int v = t.v0; v < t.v1; ++v, map.next()) {
        fetchRow(ahead, v - t.v0, true);
        if (!halvesOf(t, v - t.v0)) continue;
        for (int i = 0; i < t.u1 - t.u0; i += lanes) {
            const std::size_t pixel = static_cast<std::size_t>(v) * s.stride + t.u0 + i;
            const int count = t.u1 - t.u0 - i;
            Splats p = splatsOf<kUniform, true>(d, s, t, map, v - t.v0, i, pixel, count, region);
            if (!kOpaque) {
                const auto any = hn::Gt(alphaOf(d, s, pixel, count), hn::Zero(d));
                p.small = hn::And(p.small, any);
                p.large = hn::And(p.large, any);
            }
            if (!kUniform) colourLarge<kOpaque, kNormals>(d, s, p, pixel, t.tolerance, region);
            if (hn::AllFalse(d, p.small)) continue;
            RowOfPoints r;
            const auto any = weighSmall(d, p, tolerance, region, r);
            const std::uint32_t bits = bitsOf(d, any);
            if (!bits) continue;
            hn::Store(p.at.offset, di, all.offset);
            if (kWholeRows && kOpaque && canReadAround(s, pixel, count, lanes)) {
                // Zeros are added for the others: what they hold must be numbers.
                r.fx = hn::IfThenElseZero(any, p.at.fx);
                r.fy = hn::IfThenElseZero(any, p.at.fy);
                r.uAcross = hn::IfThenElseZero(any, p.uAcross);
                r.vAcross = hn::IfThenElseZero(any, p.vAcross);
                r.uDown = hn::IfThenElseZero(any, p.uDown);
                r.vDown = hn::IfThenElseZero(any, p.vDown);
                r.offset = all.offset;
                r.gradient = !kUniform || t.uAcross != 0 || t.vDown != 0;
                addRowOfPoints(s, pixel, bits, r, region);
                if (kNormals) addNormalsOfRow(s, pixel, bits, r, region);
                continue;
            }
            hn::Store(r.w00, d, all.w00);
            hn::Store(r.w10, d, all.w10);
            hn::Store(r.w01, d, all.w01);
            hn::Store(r.w11, d, all.w11);
            hn::Store(p.at.fx, d, all.fractionX);
            hn::Store(p.at.fy, d, all.fractionY);
            if (!kUniform) {
                hn::Store(p.uAcross, d, all.uAcross);
                hn::Store(p.vAcross, d, all.vAcross);
                hn::Store(p.uDown, d, all.uDown);
                hn::Store(p.vDown, d, all.vDown);
            }
            forBits(bits,
                    [&](int k) HWY_ATTR { addSmall<kOpaque, kNormals>(s, pixel, all, k, region); });
        }
    }
}

// --- SplatRule::paper ------------------------------------------------------------------------

// Calls draw(pixel, splat) for each point of a block as a round splat; kHiding: for those that hide
// what is behind.
template <bool kHiding, class F>
HWY_INLINE void forRound(const RectangleImages& s, const BlockTask& t, const Shape& shape,
                         const Region& region, const F& draw) {
    for (int v = t.v0; v < t.v1; ++v) {
        const RowMap map(s.map, t.u0, v);
        for (int u = t.u0; u < t.u1; ++u) {
            const std::size_t pixel = static_cast<std::size_t>(v) * s.stride + u;
            const float alpha =
                s.rgba8 ? s.rgba8[4 * pixel + 3] : s.rgbaFloat[4 * pixel + 3] * 255.0f;
            if (!(s.depth[pixel] < kInfinity)) continue;
            const bool solid =
                alpha >= 255.0f * kHides || (t.glass && s.slopes[pixel].u & Slope::kGlass);
            if (kHiding ? !solid : !(alpha > 0.0f)) continue;
            float h[3];
            for (int k = 0; k < 3; ++k) {
                const float i = static_cast<float>(u - t.u0);
                h[k] = (map.a[k] + i * map.au[k]) * s.depth[pixel] + (map.b[k] + i * map.bu[k]);
            }
            if (!(h[2] > kNearest)) continue;
            const float inverse = region.orthographic ? 1.0f : 1.0f / h[2];
            const float radius =
                std::min(std::max(0.5f, 0.5f * shape.coefficient * inverse), region.largest);
            const float q = kReach2 / (radius * radius);
            const float x = h[0] * inverse, y = h[1] * inverse;
            const DF d;
            const VF half = hn::Set(d, radius);
            const Boxes box = boxesOf(d, hn::Set(d, x), hn::Set(d, y), half, half, region);
            if (hn::AllFalse(d, box.some)) continue;
            draw(pixel, Ellipse{x, y, h[2], 0, 0, q, 0, q, kReach2, 1.0f, hn::GetLane(box.x0),
                                hn::GetLane(box.x1), hn::GetLane(box.y0), hn::GetLane(box.y1)});
        }
    }
}

// --- Points of one pixel ---------------------------------------------------------------------

void pointsImpl(const RectangleImages& s, const BlockTask& t, const Region& region) {
    const DF d;
    const DI di;
    const int lanes = static_cast<int>(hn::Lanes(d));
    HWY_ALIGN std::int32_t offset[kBlock];
    HWY_ALIGN std::uint32_t depth[kBlock];
    const VF half = hn::Set(d, 0.5f);
    const VI one = hn::Set(di, 1), stride = hn::Set(di, region.stride);
    for (int v = t.v0; v < t.v1; ++v) {
        const RowMap map(s.map, t.u0, v);
        for (int i = 0; i < t.u1 - t.u0; i += lanes) {
            const std::size_t pixel = static_cast<std::size_t>(v) * s.stride + t.u0 + i;
            const int count = t.u1 - t.u0 - i;
            Projection p = project(d, map, i, loadDepth(d, s.depth + pixel, count), region);
            if (!t.opaque)
                p.inside = hn::And(p.inside, hn::Gt(alphaOf(d, s, pixel, count), hn::Zero(d)));
            std::uint32_t bits = bitsOf(d, p.inside);
            if (!bits) continue;
            // The nearest of the four pixels.
            VI at = p.offset;
            at = hn::Add(at, hn::IfThenElseZero(hn::RebindMask(di, hn::Ge(p.fx, half)), one));
            at = hn::Add(at, hn::IfThenElseZero(hn::RebindMask(di, hn::Ge(p.fy, half)), stride));
            hn::Store(at, di, offset);
            // Positive floats sort as their bits do.
            hn::Store(hn::BitCast(hn::RebindToUnsigned<DF>(), p.z), hn::RebindToUnsigned<DF>(),
                      depth);
            const std::uint32_t first = s.firstPoint + static_cast<std::uint32_t>(pixel);
            while (bits) {
                const int k = __builtin_ctz(bits);
                bits &= bits - 1;
                const std::uint64_t key = (std::uint64_t{depth[k]} << 32) | (first + k);
                std::uint64_t& to = region.points[offset[k]];
                to = key < to ? key : to;
            }
        }
    }
}

void depthImpl(const RectangleImages& s, const BlockTask& t, const Ahead& ahead, const Shape& shape,
               const Region& region) {
    const DF d;
    if (shape.coefficient > 0) {
        forRound<true>(s, t, shape, region,
                       [&](std::size_t, const Ellipse& e) HWY_ATTR { depthEllipse(d, e, region); });
    } else if (t.uniform) {
        depthBlock<true>(s, t, ahead, region);
    } else {
        depthBlock<false>(s, t, ahead, region);
    }
}

template <bool kUniform>
void colourOfBlock(const RectangleImages& s, const BlockTask& t, const Ahead& ahead,
                   const Region& region) {
    if (t.opaque && !s.normals)
        colourBlock<kUniform, true, false>(s, t, ahead, region);
    else if (t.opaque)
        colourBlock<kUniform, true, true>(s, t, ahead, region);
    else if (!s.normals)
        colourBlock<kUniform, false, false>(s, t, ahead, region);
    else
        colourBlock<kUniform, false, true>(s, t, ahead, region);
}

void colourImpl(const RectangleImages& s, const BlockTask& t, const Ahead& ahead,
                const Shape& shape, const Region& region) {
    const DF d;
    if (shape.coefficient > 0) {
        forRound<false>(s, t, shape, region, [&](std::size_t pixel, const Ellipse& e) HWY_ATTR {
            const PointColour point = pointColourOf(s, pixel, t.opaque);
            if (s.normals)
                colourEllipse<false, true>(d, e, point, t.tolerance, region);
            else
                colourEllipse<false, false>(d, e, point, t.tolerance, region);
        });
    } else if (t.uniform) {
        colourOfBlock<true>(s, t, ahead, region);
    } else {
        colourOfBlock<false>(s, t, ahead, region);
    }
}

void normalsImpl(const float* sums, const glm::vec4* colours, std::size_t count, glm::vec3* to) {
    using D = hn::ScalableTag<float>;
    using V = hn::Vec<D>;
    const D d;
    const std::size_t lanes = hn::Lanes(d);
    const V zero = hn::Zero(d);
    const auto some = [&](const float* sum, const float* colour, float* out) HWY_ATTR {
        V x = zero, y = zero, z = zero, a = zero, r = zero, g = zero, b = zero;
        hn::LoadInterleaved4(d, sum, x, y, z, a);
        hn::LoadInterleaved4(d, colour, r, g, b, a);
        const V length = hn::Sqrt(hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z)));
        const auto has = hn::And(hn::Gt(length, zero), hn::Gt(a, zero));
        hn::StoreInterleaved3(hn::IfThenElseZero(has, hn::Div(x, length)),
                              hn::IfThenElseZero(has, hn::Div(y, length)),
                              hn::IfThenElseZero(has, hn::Div(z, length)), d, out);
    };
    std::size_t i = 0;
    for (; i + lanes <= count; i += lanes) some(sums + 4 * i, &colours[i].x, &to[i].x);
    if (i == count) return;
    float sum[4 * hn::MaxLanes(d)] = {}, colour[4 * hn::MaxLanes(d)] = {}, out[3 * hn::MaxLanes(d)];
    std::copy(sums + 4 * i, sums + 4 * count, sum);
    std::copy(&colours[i].x, &colours[i].x + 4 * (count - i), colour);
    some(sum, colour, out);
    std::copy_n(out, 3 * (count - i), &to[i].x);
}

}  // namespace stx::splat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stx::splat {

HWY_EXPORT(depthImpl);
HWY_EXPORT(colourImpl);
HWY_EXPORT(pointsImpl);
HWY_EXPORT(normalsImpl);

void drawDepth(const RectangleImages& source, const BlockTask& task, const Ahead& ahead,
               const Shape& shape, const Region& region) {
    HWY_DYNAMIC_DISPATCH(depthImpl)(source, task, ahead, shape, region);
}
void drawColour(const RectangleImages& source, const BlockTask& task, const Ahead& ahead,
                const Shape& shape, const Region& region) {
    HWY_DYNAMIC_DISPATCH(colourImpl)(source, task, ahead, shape, region);
}
void drawPoints(const RectangleImages& source, const BlockTask& task, const Region& region) {
    HWY_DYNAMIC_DISPATCH(pointsImpl)(source, task, region);
}
void resolveNormals(const float* sums, const glm::vec4* colours, std::size_t count, glm::vec3* to) {
    HWY_DYNAMIC_DISPATCH(normalsImpl)(sums, colours, count, to);
}

}  // namespace stx::splat
#endif

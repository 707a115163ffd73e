// How a piece gets its colour: a quadratic function of the place is fitted to the texels (taps)
// around the piece in all its sources, by weighted least squares. Here are the moments of the taps,
// the solution, and the weight that it gives to each tap. Included by shade.cpp once for each SIMD
// target.

#if defined(STX_SURFACE_FIT_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef STX_SURFACE_FIT_INL_HPP
#undef STX_SURFACE_FIT_INL_HPP
#else
#define STX_SURFACE_FIT_INL_HPP
#endif

#include <hwy/highway.h>

#include "lib/render/surface/cpu/fetch-inl.hpp"
#include "lib/render/surface/cpu/shade_groups.hpp"
#include "lib/render/surface/prepare/constants.hpp"

HWY_BEFORE_NAMESPACE();
namespace stx::surface::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr int kMoments = 15;

/// The taps of one source under some pieces: offsets (du, dv) from the piece in pixels of the
/// source, (x, y) in the frame, x = xu du + xv dv, y = yu du + yv dv.
template <class D, int T>
struct Taps {
    using V = hn::Vec<D>;
    V xu, xv, yu, yv;
    V du[T], dv[T];

    HWY_INLINE Taps(D d, const GroupSource& view, const Lanes& baseU, const Lanes& baseV, int l) {
        const V half = hn::Set(d, 0.5f);
        du[0] = hn::Sub(hn::Add(hn::LoadU(d, &baseU[l]), half), hn::LoadU(d, &view.u[l]));
        dv[0] = hn::Sub(hn::Add(hn::LoadU(d, &baseV[l]), half), hn::LoadU(d, &view.v[l]));
        for (int i = 1; i < T; ++i) {
            du[i] = hn::Add(du[0], hn::Set(d, static_cast<float>(i)));
            dv[i] = hn::Add(dv[0], hn::Set(d, static_cast<float>(i)));
        }
        xu = hn::LoadU(d, &view.xu[l]);
        xv = hn::LoadU(d, &view.xv[l]);
        yu = hn::LoadU(d, &view.yu[l]);
        yv = hn::LoadU(d, &view.yv[l]);
    }

    /// Turns a quadratic form in x and y into one in du and dv: xx x² + xy x y + yy y² = uu du² +
    /// uv du dv + vv dv².
    HWY_INLINE void quadratic(V xx, V xy, V yy, V& uu, V& uv, V& vv) const {
        const V alongU = hn::MulAdd(xx, xu, hn::Mul(xy, yu)), yyu = hn::Mul(yy, yu);
        const V alongV = hn::MulAdd(xx, xv, hn::Mul(xy, yv)), yyv = hn::Mul(yy, yv);
        uu = hn::MulAdd(alongU, xu, hn::Mul(yyu, yu));
        vv = hn::MulAdd(alongV, xv, hn::Mul(yyv, yv));
        uv = hn::MulAdd(alongU, xv, hn::Mul(yyu, yv));
        uv = hn::Add(uv, hn::MulAdd(alongV, xu, hn::Mul(yyv, yu)));
    }

    /// The kernel of the fit: r² = uu du² + uv du dv + vv dv² is the squared distance, 1 at the
    /// radius where the kernel ends.
    HWY_INLINE void metric(D d, float inverseRadius, V& uu, V& uv, V& vv) const {
        // (1-h) I + h J Jt, inverted; see metricOf() in shaders/shared/surface_shade.glsl.
        const V one = hn::Set(d, 1.0f), half = hn::Set(d, 0.5f);
        const V jxx = hn::MulAdd(xu, xu, hn::Mul(xv, xv));
        const V jyy = hn::MulAdd(yu, yu, hn::Mul(yv, yv));
        const V jxy = hn::MulAdd(xu, yu, hn::Mul(xv, yv));
        const V apart = hn::Mul(half, hn::Sub(jxx, jyy));
        const V least = hn::Sub(hn::Mul(half, hn::Add(jxx, jyy)),
                                hn::Sqrt(hn::MulAdd(apart, apart, hn::Mul(jxy, jxy))));
        const V rest = hn::Div(hn::Set(d, 1.0f - kOwn), hn::Max(least, one));
        const V h = hn::Sub(one, rest);
        const V sxx = hn::MulAdd(h, jxx, rest), syy = hn::MulAdd(h, jyy, rest);
        const V sxy = hn::Mul(h, jxy);
        const V scale =
            hn::Div(hn::Set(d, inverseRadius),
                    hn::Max(hn::NegMulAdd(sxy, sxy, hn::Mul(sxx, syy)), hn::Set(d, 1e-6f)));
        quadratic(hn::Mul(syy, scale), hn::Mul(hn::Set(d, -2.0f), hn::Mul(sxy, scale)),
                  hn::Mul(sxx, scale), uu, uv, vv);
    }

    /// The weights of all taps, to `kernels` row by row, kTaps apart, and their moments in the
    /// frame added to `m`. `masks`: shares of the taps that count, like `kernels`, or null.
    HWY_INLINE void addMoments(D d, float inverseRadius, V weight, V reach, const Lanes* masks,
                               Lanes* kernels, int l, V* m) const {
        V uu, uv, vv, alongU[T], squareU[T], u2[T], u3[T], u4[T];
        metric(d, inverseRadius, uu, uv, vv);
        const auto beyond = [&](V offset) HWY_ATTR { return hn::Gt(hn::Abs(offset), reach); };
        for (int i = 0; i < T; ++i) {
            u2[i] = hn::Mul(du[i], du[i]);
            u3[i] = hn::Mul(u2[i], du[i]);
            u4[i] = hn::Mul(u2[i], u2[i]);
            alongU[i] = hn::Mul(uv, du[i]);
            squareU[i] = hn::NegMulAdd(uu, u2[i], hn::Set(d, 1.0f));
            if (T == kTaps)
                squareU[i] = hn::IfThenElse(beyond(du[i]), hn::Set(d, -1e9f), squareU[i]);
        }
        // g[a][b] is the moment of du^a dv^b.
        V g00, g10, g20, g30, g40, g01, g11, g21, g31, g02, g12, g22, g03, g13, g04;
        g00 = g10 = g20 = g30 = g40 = g01 = g11 = g21 = g31 = hn::Zero(d);
        g02 = g12 = g22 = g03 = g13 = g04 = hn::Zero(d);
        for (int j = 0; j < T; ++j) {
            const V v = dv[j], v2 = hn::Mul(v, v), v3 = hn::Mul(v2, v), v4 = hn::Mul(v2, v2);
            V squareV = hn::Mul(vv, v2);
            if (T == kTaps) squareV = hn::IfThenElse(beyond(v), hn::Set(d, 1e9f), squareV);
            V s0, s1, s2, s3, s4;
            for (int i = 0; i < T; ++i) {
                // (1 - r²/R²)^8: close to a Gaussian, and cheaper.
                V k = hn::NegMulAdd(alongU[i], v, hn::Sub(squareU[i], squareV));
                k = hn::Max(k, hn::Zero(d));
                k = hn::Mul(k, k);
                k = hn::Mul(k, k);
                k = hn::Mul(hn::Mul(k, k), weight);
                if (masks) k = hn::Mul(k, hn::LoadU(d, &masks[j * kTaps + i].v[l]));
                hn::StoreU(k, d, &kernels[j * kTaps + i].v[l]);
                s0 = i == 0 ? k : hn::Add(s0, k);
                s1 = i == 0 ? hn::Mul(k, du[0]) : hn::MulAdd(k, du[i], s1);
                s2 = i == 0 ? hn::Mul(k, u2[0]) : hn::MulAdd(k, u2[i], s2);
                s3 = i == 0 ? hn::Mul(k, u3[0]) : hn::MulAdd(k, u3[i], s3);
                s4 = i == 0 ? hn::Mul(k, u4[0]) : hn::MulAdd(k, u4[i], s4);
            }
            g00 = hn::Add(g00, s0);
            g10 = hn::Add(g10, s1);
            g20 = hn::Add(g20, s2);
            g30 = hn::Add(g30, s3);
            g40 = hn::Add(g40, s4);
            g01 = hn::MulAdd(s0, v, g01);
            g11 = hn::MulAdd(s1, v, g11);
            g21 = hn::MulAdd(s2, v, g21);
            g31 = hn::MulAdd(s3, v, g31);
            g02 = hn::MulAdd(s0, v2, g02);
            g12 = hn::MulAdd(s1, v2, g12);
            g22 = hn::MulAdd(s2, v2, g22);
            g03 = hn::MulAdd(s0, v3, g03);
            g13 = hn::MulAdd(s1, v3, g13);
            g04 = hn::MulAdd(s0, v4, g04);
        }
        // Turns moments of du and dv into moments of x and y, by one factor after another.
        const auto x = [&](V u, V v) HWY_ATTR { return hn::MulAdd(xu, u, hn::Mul(xv, v)); };
        const auto y = [&](V u, V v) HWY_ATTR { return hn::MulAdd(yu, u, hn::Mul(yv, v)); };
        const auto add = [&](int i, V value) HWY_ATTR { m[i] = hn::Add(m[i], value); };
        add(0, g00);
        add(1, x(g10, g01));
        add(2, y(g10, g01));
        {
            const V xU = x(g20, g11), xV = x(g11, g02), yU = y(g20, g11), yV = y(g11, g02);
            add(3, x(xU, xV));
            add(4, y(xU, xV));
            add(5, y(yU, yV));
        }
        {
            const V x20 = x(g30, g21), x11 = x(g21, g12), x02 = x(g12, g03);
            const V y20 = y(g30, g21), y11 = y(g21, g12), y02 = y(g12, g03);
            const V xxU = x(x20, x11), xxV = x(x11, x02), yyU = y(y20, y11), yyV = y(y11, y02);
            add(6, x(xxU, xxV));
            add(7, y(xxU, xxV));
            add(8, x(yyU, yyV));
            add(9, y(yyU, yyV));
        }
        {
            const V x30 = x(g40, g31), x21 = x(g31, g22), x12 = x(g22, g13), x03 = x(g13, g04);
            const V y30 = y(g40, g31), y21 = y(g31, g22), y12 = y(g22, g13), y03 = y(g13, g04);
            const V xx20 = x(x30, x21), xx11 = x(x21, x12), xx02 = x(x12, x03);
            const V yy20 = y(y30, y21), yy11 = y(y21, y12), yy02 = y(y12, y03);
            const V xxxU = x(xx20, xx11), xxxV = x(xx11, xx02);
            const V xxyU = y(xx20, xx11), xxyV = y(xx11, xx02);
            const V yyyU = y(yy20, yy11), yyyV = y(yy11, yy02);
            add(10, x(xxxU, xxxV));
            add(11, y(xxxU, xxxV));
            add(12, y(xxyU, xxyV));
            add(13, x(yyyU, yyyV));
            add(14, y(yyyU, yyyV));
        }
    }

    /// What each tap counts in the middle of the piece: its kernel times the polynomial `row` of 1,
    /// x, y, x², x y, y². Returns their sum.
    HWY_INLINE V weigh(D d, const V* row, const Lanes* kernels, int l, TapWeights& weights) const {
        V uu, uv, vv, sum = hn::Zero(d);
        quadratic(row[3], row[4], row[5], uu, uv, vv);
        const V alongU = hn::MulAdd(row[1], xu, hn::Mul(row[2], yu));
        const V alongV = hn::MulAdd(row[1], xv, hn::Mul(row[2], yv));
        for (int j = 0; j < T; ++j) {
            const V base = hn::MulAdd(dv[j], hn::MulAdd(vv, dv[j], alongV), row[0]);
            const V slope = hn::MulAdd(uv, dv[j], alongU);
            V taps[kTaps];
            for (int i = 0; i < T; ++i) {
                const V value = hn::MulAdd(du[i], hn::MulAdd(uu, du[i], slope), base);
                taps[i] = hn::Mul(hn::LoadU(d, &kernels[j * kTaps + i].v[l]), value);
                sum = hn::Add(sum, taps[i]);
            }
            for (int i = T; i < kTaps; ++i) taps[i] = hn::Zero(d);
            weights.store(d, j, l, taps);
        }
        return sum;
    }
};

/// The first row of the inverse of the 6x6 normal matrix, terms 1, dx, dy, dx², dxdy, dy².
/// `kernel`: the squared radius of the fit.
template <class D, class V = hn::Vec<D>>
HWY_INLINE void solveFirstRow(D d, const V* m, float kernel, float ridge, V* out) {
    // Moments by power: 0:1 1:x 2:y 3:xx 4:xy 5:yy 6:xxx 7:xxy 8:xyy 9:yyy 10:x4 11:x3y 12:x2y2
    // 13:xy3 14:y4
    const V hold = hn::Mul(m[0], hn::Set(d, ridge)), one = hn::Set(d, 1.0f);
    // See surface_shade.glsl.
    const V squares = hn::Mul(hn::Add(m[3], m[5]), hn::Set(d, 8.0f / kernel));
    const V spread = hn::Max(hn::Div(squares, m[0]), one);
    const V more = hn::MulAdd(hn::Set(d, kSpreadRidge), hn::MulSub(spread, spread, one), one);
    const V holdSquares = hn::Mul(hold, more);
    constexpr int kIndex[5][5] = {{3, 4, 6, 7, 8},
                                  {4, 5, 7, 8, 9},
                                  {6, 7, 10, 11, 12},
                                  {7, 8, 11, 12, 13},
                                  {8, 9, 12, 13, 14}};
    V lower[5][5], inverse[5], z[5];
    for (int i = 0; i < 5; ++i) {
        for (int j = 0; j <= i; ++j) {
            V sum = m[kIndex[i][j]];
            const V held = i < 2 ? hold : holdSquares;
            if (i == j) sum = hn::Add(sum, held);
            for (int k = 0; k < j; ++k)
                sum = hn::NegMulAdd(lower[i][k], hn::Mul(lower[j][k], z[k]), sum);
            if (i == j) {
                z[i] = hn::Max(sum, hn::Mul(held, hn::Set(d, 0.01f)));
                inverse[i] = hn::Div(hn::Set(d, 1.0f), z[i]);
            } else {
                lower[i][j] = hn::Mul(sum, inverse[j]);
            }
        }
    }
    V y[5];
    for (int i = 0; i < 5; ++i) {
        V sum = m[i + 1];
        for (int k = 0; k < i; ++k) sum = hn::NegMulAdd(lower[i][k], y[k], sum);
        y[i] = sum;
    }
    for (int i = 0; i < 5; ++i) y[i] = hn::Mul(y[i], inverse[i]);
    for (int i = 4; i >= 0; --i)
        for (int k = i + 1; k < 5; ++k) y[i] = hn::NegMulAdd(lower[k][i], y[k], y[i]);
    V schur = m[0];
    for (int i = 0; i < 5; ++i) schur = hn::NegMulAdd(m[i + 1], y[i], schur);
    const V first = hn::Div(hn::Set(d, 1.0f), hn::Max(schur, hn::Mul(m[0], hn::Set(d, 1e-4f))));
    out[0] = first;
    for (int i = 0; i < 5; ++i) out[i + 1] = hn::Neg(hn::Mul(y[i], first));
}

}  // namespace stx::surface::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard

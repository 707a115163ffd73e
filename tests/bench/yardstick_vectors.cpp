#include <cstring>

#include "tests/bench/yardstick.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/bench/yardstick_vectors.cpp"
#include <hwy/foreach_target.h>  // NOLINT: must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace stx::bench::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Yardstick::splat() for rows of a view, a vector of points at once up to the test of depth. Its
/// width is a whole number of vectors, as that of the yardstick's views is.
void SplatRows(const ReferenceView& view, const Camera& novel, int from, int to,
               NearestPoints& nearest) {
    const hn::CappedTag<float, 16> d;
    const hn::RebindToSigned<decltype(d)> di;
    const int n = static_cast<int>(hn::Lanes(d));
    const Camera& c = view.camera;
    const glm::mat4 m(novel.cameraFromWorld() * c.worldFromCamera());
    const auto set = [&](double value) HWY_ATTR { return hn::Set(d, static_cast<float>(value)); };
    const auto cx = set(novel.cx), cy = set(novel.cy), fx = set(novel.fx), fy = set(novel.fy);
    const auto width = set(novel.width), height = set(novel.height), zero = hn::Zero(d);
    const auto perX = set(1.0 / c.fx), middleX = set(0.5 - c.cx);
    const auto steps = hn::ConvertTo(d, hn::Iota(di, 0));
    const auto* colours = view.texture.rgba8()->data();
    for (int y = from; y < to; ++y) {
        const float* depths = &view.depth.at(0, y);
        const auto sideY = set(-(y + 0.5 - c.cy) / c.fy);
        for (int x = 0; x < c.width; x += n) {
            const auto z = hn::LoadU(d, depths + x);
            const auto px = hn::Mul(hn::Mul(hn::Add(hn::Add(set(x), steps), middleX), perX), z);
            const auto py = hn::Mul(sideY, z);
            const auto row = [&](int r) HWY_ATTR {
                return hn::MulAdd(
                    set(m[0][r]), px,
                    hn::MulAdd(set(m[1][r]), py, hn::NegMulAdd(set(m[2][r]), z, set(m[3][r]))));
            };
            const auto depth = hn::Neg(row(2)), inverse = hn::Div(hn::Set(d, 1.0f), depth);
            const auto u = hn::MulAdd(hn::Mul(fx, row(0)), inverse, cx);
            const auto v = hn::NegMulAdd(hn::Mul(fy, row(1)), inverse, cy);
            auto there =
                hn::And(hn::And(hn::Gt(z, zero), hn::Lt(z, set(kNoDepth))), hn::Gt(depth, zero));
            there = hn::And(there, hn::And(hn::And(hn::Ge(u, zero), hn::Lt(u, width)),
                                           hn::And(hn::Ge(v, zero), hn::Lt(v, height))));
            const auto place = hn::Add(hn::Mul(hn::ConvertTo(di, v), hn::Set(di, novel.width)),
                                       hn::ConvertTo(di, u));
            alignas(64) float depthOf[16];
            alignas(64) std::int32_t placeOf[16];
            hn::Store(hn::IfThenElseZero(there, depth), d, depthOf);
            hn::Store(hn::IfThenElseZero(hn::RebindMask(di, there), place), di, placeOf);
            const auto* colour = &colours[static_cast<std::size_t>(y) * c.width + x];
            for (int l = 0; l < n; ++l) {
                const auto at = static_cast<std::size_t>(placeOf[l]);
                if (!(depthOf[l] > 0) || depthOf[l] >= nearest.depth[at]) continue;
                nearest.depth[at] = depthOf[l];
                std::memcpy(&nearest.colour[at], colour + l, 4);
            }
        }
    }
}

void KeepNearest(std::span<NearestPoints> all, std::size_t from, std::size_t to) {
    const hn::CappedTag<float, 16> d;
    const hn::RebindToUnsigned<decltype(d)> du;
    const std::size_t n = hn::Lanes(d);
    NearestPoints& out = all.front();
    for (std::size_t at = from; at < to; at += n) {
        auto depth = hn::LoadU(d, &out.depth[at]);
        auto colour = hn::LoadU(du, &out.colour[at]);
        for (const NearestPoints& other : all.subspan(1)) {
            const auto theirs = hn::LoadU(d, &other.depth[at]);
            const auto nearer = hn::Lt(theirs, depth);
            depth = hn::IfThenElse(nearer, theirs, depth);
            colour = hn::IfThenElse(hn::RebindMask(du, nearer), hn::LoadU(du, &other.colour[at]),
                                    colour);
        }
        hn::StoreU(depth, d, &out.depth[at]);
        hn::StoreU(colour, du, &out.colour[at]);
    }
}

}  // namespace stx::bench::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stx::bench {

HWY_EXPORT(SplatRows);
HWY_EXPORT(KeepNearest);

void splatRows(const ReferenceView& view, const Camera& novel, int from, int to,
               NearestPoints& nearest) {
    HWY_DYNAMIC_DISPATCH(SplatRows)(view, novel, from, to, nearest);
}

void keepNearest(std::span<NearestPoints> all, std::size_t from, std::size_t to) {
    HWY_DYNAMIC_DISPATCH(KeepNearest)(all, from, to);
}

}  // namespace stx::bench
#endif

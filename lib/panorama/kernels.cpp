#include "lib/panorama/kernels.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lib/panorama/kernels.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

HWY_BEFORE_NAMESPACE();
namespace stx::panorama::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

static_assert(std::endian::native == std::endian::little, "four distances are one number");

using DB = hn::CappedTag<std::uint8_t, 64>;
#if HWY_TARGET != HWY_SCALAR
using DSums = hn::Repartition<std::uint64_t, DB>;
#endif
using DNear = hn::CappedTag<std::int16_t, 32>;
using DD = hn::CappedTag<double, 8>;

/// What has a Z above this, of a ray of length 1, is taken to be behind the camera while rotations
/// are tried: its position in the picture is far out, and no match is there.
constexpr double kRoughlyBehind = -0.02;

#if HWY_TARGET == HWY_SCALAR

/// The sum of what each of four descriptors has in common with another, 16 bits each.
std::uint64_t fourMinima(const Descriptor& own, const std::array<const Descriptor*, 4>& others) {
    std::uint64_t sums = 0;
    for (std::size_t k = 0; k < 4; ++k)
        for (std::size_t i = 0; i < own.size(); ++i)
            sums += std::uint64_t{std::min(own[i], (*others[k])[i])} << (16 * k);
    return sums;
}

#else

/// In parts, each below 2^16.
HWY_INLINE hn::Vec<DSums> minima(const Descriptor& a, const Descriptor& b) {
    const DB d;
    auto sum = hn::Zero(DSums());
    for (std::size_t i = 0; i < a.size(); i += hn::Lanes(d))
        sum = hn::Add(sum,
                      hn::SumsOf8(hn::Min(hn::LoadU(d, a.data() + i), hn::LoadU(d, b.data() + i))));
    return sum;
}

/// The sum of what each of four descriptors has in common with another, 16 bits each.
HWY_INLINE std::uint64_t fourMinima(const Descriptor& own,
                                    const std::array<const Descriptor*, 4>& others) {
    return hn::GetLane(hn::SumOfLanes(
        DSums(), hn::Or(hn::Or(minima(own, *others[0]), hn::ShiftLeft<16>(minima(own, *others[1]))),
                        hn::Or(hn::ShiftLeft<32>(minima(own, *others[2])),
                               hn::ShiftLeft<48>(minima(own, *others[3]))))));
}

#endif

// |a - b| = a + b - 2 min(a, b). Sums modulo 2^16 come to the right distance.
std::size_t nearImpl(const Descriptor& own, std::int16_t ownSum, const Descriptor* others,
                     const std::int16_t* sums, const std::int16_t* limits, std::size_t count,
                     std::int16_t most, std::int16_t* distances, std::uint8_t* indices) {
    for (std::size_t j = 0; j < count; j += 4) {
        const Descriptor* from = others + j;
        const std::size_t last = std::min<std::size_t>(3, count - 1 - j);
        const std::uint64_t four =
            fourMinima(own, {from, from + std::min<std::size_t>(1, last),
                             from + std::min<std::size_t>(2, last), from + last});
        std::memcpy(distances + j, &four, sizeof four);
    }
    const DNear d;
    const std::size_t lanes = hn::Lanes(d);
    const auto enough = hn::Set(d, most), mine = hn::Set(d, ownSum);
    std::size_t found = 0, j = 0;
    const auto list = [&](std::size_t end) {
        for (; j < end; ++j)
            if (distances[j] < std::max(limits[j], most))
                indices[found++] = static_cast<std::uint8_t>(j);
    };
    while (j + lanes <= count) {
        const auto shared = hn::LoadU(d, distances + j);
        const auto apart = hn::Sub(hn::Add(mine, hn::LoadU(d, sums + j)), hn::Add(shared, shared));
        hn::StoreU(apart, d, distances + j);
        if (hn::AllFalse(d, hn::Lt(apart, hn::Max(hn::LoadU(d, limits + j), enough))))
            j += lanes;
        else
            list(j + lanes);
    }
    for (std::size_t k = j; k < count; ++k)
        distances[k] = static_cast<std::int16_t>(ownSum + sums[k] - 2 * (distances[k] & 0xffff));
    list(count);
    return found;
}

std::size_t countImpl(const RayMatches& m, const glm::dmat3& turn, double focal, double tolerance,
                      std::size_t most) {
    const DD d;
    const std::size_t lanes = hn::Lanes(d);
    const auto behind = hn::Set(d, kRoughlyBehind), length = hn::Set(d, focal),
               limit = hn::Set(d, tolerance * tolerance);
    std::array<hn::Vec<DD>, 9> t;
    for (std::size_t i = 0; i < 9; ++i)
        t[i] = hn::Set(d, turn[static_cast<int>(i / 3)][static_cast<int>(i % 3)]);
    std::size_t count = 0, k = 0;
    for (; k + lanes <= m.count && count + m.count - k > most; k += lanes) {
        const auto x = hn::LoadU(d, m.ax + k), y = hn::LoadU(d, m.ay + k),
                   z = hn::LoadU(d, m.az + k);
        const auto row = [&](std::size_t r) HWY_ATTR {
            return hn::Add(hn::Add(hn::Mul(t[r], x), hn::Mul(t[3 + r], y)), hn::Mul(t[6 + r], z));
        };
        const auto depth = row(2);
        const auto scale = hn::Div(length, hn::Neg(depth));
        const auto dx = hn::Sub(hn::Mul(row(0), scale), hn::LoadU(d, m.bx + k));
        const auto dy = hn::Sub(hn::Mul(row(1), scale), hn::LoadU(d, m.by + k));
        const auto off = hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy));
        count += hn::CountTrue(d, hn::And(hn::Le(depth, behind), hn::Lt(off, limit)));
    }
    for (; k < m.count && count + m.count - k > most; ++k) {
        const glm::dvec3 r = turn * glm::dvec3(m.ax[k], m.ay[k], m.az[k]);
        if (r.z > kRoughlyBehind) continue;
        const glm::dvec2 p = glm::dvec2(r) * (focal / -r.z) - glm::dvec2(m.bx[k], m.by[k]);
        if (glm::dot(p, p) < tolerance * tolerance) ++count;
    }
    return count;
}

void positionsImpl(const RowOfRays& row, double* px, double* py) {
    const DD d;
    const std::size_t lanes = hn::Lanes(d);
    const auto one = hn::Set(d, 1.0), half = hn::Set(d, 0.5), nowhere = hn::Set(d, kNowhere);
    const auto level = hn::Set(d, -row.cosine), up = hn::Set(d, row.sine);
    const glm::dmat3& m = row.worldFromCamera;
    const auto vectors = [&](std::size_t k) HWY_ATTR {
        const auto x = hn::Mul(level, hn::LoadU(d, row.sines + k));
        const auto z = hn::Mul(level, hn::LoadU(d, row.cosines + k));
        const auto along = [&](int axis) HWY_ATTR {
            return hn::Add(
                hn::Add(hn::Mul(hn::Set(d, m[axis].x), x), hn::Mul(hn::Set(d, m[axis].y), up)),
                hn::Mul(hn::Set(d, m[axis].z), z));
        };
        const auto depth = hn::Neg(along(2));
        const auto u = hn::Div(along(0), depth), v = hn::Div(along(1), depth);
        const auto r2 = hn::Add(hn::Mul(u, u), hn::Mul(v, v));
        const auto bend = hn::Mul(hn::Set(d, row.lens.k1), r2);
        const auto seen =
            hn::And(hn::Ge(depth, hn::Set(d, kBehind)),
                    hn::Gt(hn::Add(one, hn::Mul(hn::Set(d, 3.0), bend)), hn::Set(d, kLeastSlope)));
        const auto scale = hn::Mul(hn::Set(d, row.lens.focal), hn::Add(one, bend));
        const auto x2 =
            hn::Mul(hn::Add(half, hn::Div(hn::Mul(scale, u), hn::Set(d, 2 * row.extent.x))),
                    hn::Set(d, row.size.x));
        const auto y2 =
            hn::Mul(hn::Sub(half, hn::Div(hn::Mul(scale, v), hn::Set(d, 2 * row.extent.y))),
                    hn::Set(d, row.size.y));
        hn::StoreU(hn::IfThenElse(seen, x2, nowhere), d, px + k);
        hn::StoreU(hn::IfThenElse(seen, y2, nowhere), d, py + k);
    };
    if (row.count < lanes) {
        // Too few for whole vectors: some more that nobody asked for.
        std::array<double, 4 * hn::MaxLanes(DD())> some{};
        RowOfRays whole = row;
        whole.count = lanes;
        whole.sines = some.data();
        whole.cosines = some.data() + lanes;
        std::copy_n(row.sines, row.count, some.data());
        std::copy_n(row.cosines, row.count, some.data() + lanes);
        positionsImpl(whole, some.data() + 2 * lanes, some.data() + 3 * lanes);
        std::copy_n(some.data() + 2 * lanes, row.count, px);
        std::copy_n(some.data() + 3 * lanes, row.count, py);
        return;
    }
    for (std::size_t k = 0; k + lanes <= row.count; k += lanes) vectors(k);
    vectors(row.count - lanes);
}

void cubicImpl(const Image<glm::u8vec4>& picture, const double* x, const double* y,
               std::size_t count, glm::vec4* out) {
    using DF = hn::CappedTag<float, 4>;
    const DF df;
    constexpr std::size_t kLanes = hn::MaxLanes(DF());
    const hn::Rebind<std::int32_t, DF> di;
    const hn::Rebind<std::uint8_t, DF> db;
    // Catmull and Rom's kernel, at distances of up to 1 and from 1 to 2.
    const auto near = [](float t) { return (1.5f * t - 2.5f) * t * t + 1; };
    const auto far = [](float t) { return ((-0.5f * t + 2.5f) * t - 4) * t + 2; };
    const int w = picture.width(), h = picture.height();
    for (std::size_t k = 0; k < count; ++k) {
        const double px = x[k] - 0.5, py = y[k] - 0.5;
        const int x0 = static_cast<int>(std::floor(px)), y0 = static_cast<int>(std::floor(py));
        const auto tx = static_cast<float>(px - x0), ty = static_cast<float>(py - y0);
        const float wx[4] = {far(1 + tx), near(tx), near(1 - tx), far(2 - tx)};
        const float wy[4] = {far(1 + ty), near(ty), near(1 - ty), far(2 - ty)};
        int xs[4];
        for (int i = 0; i < 4; ++i) xs[i] = std::clamp(x0 - 1 + i, 0, w - 1);
        const glm::u8vec4* rows[4];
        for (int j = 0; j < 4; ++j) rows[j] = picture.row(std::clamp(y0 - 1 + j, 0, h - 1)).data();
        for (std::size_t c = 0; c < 4; c += kLanes) {
            auto sum = hn::Zero(df);
            for (int j = 0; j < 4; ++j)
                for (int i = 0; i < 4; ++i) {
                    const auto pixel =
                        hn::ConvertTo(df, hn::PromoteTo(di, hn::LoadU(db, &rows[j][xs[i]].x + c)));
                    sum = hn::Add(sum, hn::Mul(hn::Set(df, wy[j] * wx[i]), pixel));
                }
            const auto share = hn::Div(sum, hn::Set(df, 255.0f));
            hn::StoreU(hn::Min(hn::Max(share, hn::Zero(df)), hn::Set(df, 1.0f)), df, &out[k].x + c);
        }
    }
}

}  // namespace stx::panorama::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stx::panorama {

HWY_EXPORT(nearImpl);
HWY_EXPORT(countImpl);
HWY_EXPORT(positionsImpl);
HWY_EXPORT(cubicImpl);

std::size_t nearDescriptors(const Descriptor& own, std::int16_t ownSum, const Descriptor* others,
                            const std::int16_t* sums, const std::int16_t* limits, std::size_t count,
                            std::int16_t most, std::int16_t* distances, std::uint8_t* indices) {
    return HWY_DYNAMIC_DISPATCH(nearImpl)(own, ownSum, others, sums, limits, count, most, distances,
                                          indices);
}

std::size_t countAgreeing(const RayMatches& matches, const glm::dmat3& bFromA, double focal,
                          double tolerance, std::size_t most) {
    return HWY_DYNAMIC_DISPATCH(countImpl)(matches, bFromA, focal, tolerance, most);
}

void positionsOf(const RowOfRays& row, double* x, double* y) {
    if (row.count > 0) HWY_DYNAMIC_DISPATCH(positionsImpl)(row, x, y);
}

void cubicColours(const Image<glm::u8vec4>& picture, const double* x, const double* y,
                  std::size_t count, glm::vec4* out) {
    HWY_DYNAMIC_DISPATCH(cubicImpl)(picture, x, y, count, out);
}

}  // namespace stx::panorama
#endif

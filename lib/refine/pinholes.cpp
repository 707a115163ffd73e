#include "lib/refine/pinholes.hpp"

#include <algorithm>
#include <atomic>

#include "lib/base/parallel.hpp"
#include "lib/refine/local_plane.hpp"

namespace stx {
namespace {

// Chosen by trial on the sets of tests/bench/pictures.md with noise added.
/// Neighbours that must be on one surface around a pinhole, within this share of q and so many
/// standard deviations. (Between leaves fewer are not a surface.)
constexpr int kLeastNeighbours = 8;
constexpr float kPinholeBand = 0.004f, kPinholeDeviations = 2.5f;

}  // namespace

std::int64_t closeMissedPixels(Image<float>& q, const Image<std::uint8_t>& covered,
                               const DepthAxis& axis, float noise) {
    std::int64_t missed = 0;
    for (std::size_t i = 0; i < q.count(); ++i)
        missed += static_cast<int>(q.data()[i] == 0.0f) & static_cast<int>(covered.data()[i] != 0);
    if (missed == 0) return 0;
    const Image<float> from = q;
    std::atomic<std::int64_t> closed = 0;
    parallelFor(1, q.height() - 1, 16, [&](int y) {
        for (int x = 1; x + 1 < q.width(); ++x) {
            if (from.at(x, y) != 0.0f || !covered.at(x, y)) continue;
            float around[8];
            int count = 0;
            for (int k = 0; k < 9; ++k) {
                const float there = from.at(x - 1 + k % 3, y - 1 + k / 3);
                if (there > 0.0f) around[count++] = there;
            }
            if (count < kLeastNeighbours) continue;
            std::nth_element(around, around + count / 2, around + count);
            const float middle = around[count / 2];
            const float band =
                (kPinholeBand + kPinholeDeviations * noise) * axis.relativeScale(middle);
            const LocalPlane plane = fitAround(from, x, y, 1, {middle}, band);
            if (plane.points < kLeastNeighbours || !(plane.q0 > 0.0f)) continue;
            q.at(x, y) = plane.q0;
            ++closed;
        }
    });
    return closed;
}

}  // namespace stx

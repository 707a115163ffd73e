#include "lib/render/surface/creases.hpp"

#include <cmath>
#include <vector>

#include "lib/base/parallel.hpp"

namespace stx::surface {
namespace {

// Measured on scenes of tests/sweep, statue, Fox, truck, engine and spheres-miv: half and a quarter
// of the first cost a truck 0.2 dB, three times the second spheres-miv 0.05.

/// A crease bends the surface by this in a pixel: change of depth, in pixels' sizes.
constexpr float kLeastBend = 2.0f;
/// Two pixels away on both sides it is nearly flat: it bends by no more than this share. Surfaces
/// that turn away at outlines bend more and more.
constexpr float kFlatBeside = 0.1f;
/// Steps of a depth code and noise (standard deviations) may bend surfaces by so many of their own
/// size.
constexpr float kSteps = 3.0f, kNoises = 2.0f;

/// How a row or a column of pixels bends, in q.
class PixelRow {
  public:
    /// `count` pixels, `stride` apart; those of `link` are one surface with the next.
    PixelRow(const float* q, const std::uint8_t* info, int count, std::ptrdiff_t stride,
             std::uint8_t link)
        : q_(q), info_(info), count_(count), stride_(stride), link_(link) {}

    [[nodiscard]] float bend(int i) const {
        if (i < 1 || i + 1 >= count_ || !(info_[(i - 1) * stride_] & link_) ||
            !(info_[i * stride_] & link_))
            return 0.0f;
        return std::abs(q_[(i + 1) * stride_] - 2 * q_[i * stride_] + q_[(i - 1) * stride_]);
    }
    [[nodiscard]] bool creased(int i, float least) const {
        const float here = bend(i);
        return here > least && bend(i - 2) < kFlatBeside * here && bend(i + 2) < kFlatBeside * here;
    }

  private:
    const float* q_;
    const std::uint8_t* info_;
    int count_;
    std::ptrdiff_t stride_;
    std::uint8_t link_;
};

}  // namespace

void findCreases(const Source& s, Draft& d) {
    const DepthAxis& axis = s.space.axis;
    // Links are read while rows are looked at, so marks are put in afterwards.
    std::vector<std::vector<int>> found(static_cast<std::size_t>(s.height));
    parallelForBlocks(0, s.height, 32, [&](std::int64_t from, std::int64_t to) {
        for (int y = static_cast<int>(from); y < to; ++y) {
            const PixelRow row(d.q.row(y).data(), d.info.row(y).data(), s.width, 1,
                               Info::kLinkRight);
            for (int x = 0; x < s.width; ++x) {
                const float q = d.q.at(x, y);
                if (!(q > 0.0f)) continue;
                const float least =
                    (kLeastBend * axis.texel(q) + kSteps * s.step) * axis.qPerUnit(q) +
                    kNoises * s.noise * axis.relativeScale(q);
                const PixelRow column(&d.q.at(x, 0), &d.info.at(x, 0), s.height, s.width,
                                      Info::kLinkDown);
                if (row.creased(x, least) || column.creased(y, least))
                    found[static_cast<std::size_t>(y)].push_back(x);
            }
        }
    });
    for (int y = 0; y < s.height; ++y)
        for (const int x : found[static_cast<std::size_t>(y)]) d.info.at(x, y) |= Info::kCrease;
}

}  // namespace stx::surface

#include <fmt/format.h>

#include "tests/sweep/measures.hpp"
#include "tests/sweep/sensor.hpp"

using namespace stx;

namespace measures {

Outcome unknownDepth(Pictures& pictures) {
    const Captured& captured = pictures.captured();
    if (captured.from.shape != SweepCase::room || captured.bundle.views.size() < 3)
        return std::nullopt;
    const std::size_t which = std::size_t(pick(pictures, 301, int(captured.bundle.views.size())));
    Random random(captured.from.seed * 77 + std::uint64_t(captured.from.number));
    Bundle with = captured.bundle, without = captured.bundle;
    sensor::loseDepth(with.views[which], random);
    with.views[which].noDepth = NoDepth::unknown;
    without.views.erase(without.views.begin() + std::ptrdiff_t(which));
    const Drawn how{pick(pictures, 302, 3) == 0 ? RenderMode::splat : RenderMode::surface};
    STX_TRY(const Frame a, drawBundle(with, captured.novel, how));
    STX_TRY(const Frame b, drawBundle(without, captured.novel, how));
    const double psnrWith = pictures.psnr(a), psnrWithout = pictures.psnr(b);
    return Measure{
        worseBy(psnrWith, psnrWithout),
        fmt::format("{}: without the view {:.2f} dB, with it {:.2f} dB",
                    how.mode == RenderMode::splat ? "splat" : "surface", psnrWithout, psnrWith)};
}

}  // namespace measures

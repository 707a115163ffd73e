#include <algorithm>

#include <fmt/format.h>

#include "tests/sweep/measures.hpp"
#include "tests/sweep/random.hpp"

using namespace stx;

namespace {

/// Takes the depth of some pixels away, as sensors do; colours stay. Only of views that are opaque
/// all over: where a picture has alpha, its background is known.
void forget(ReferenceView& view, Random& random) {
    const int width = view.depth.width(), height = view.depth.height();
    const auto lose = [&](int x, int y) { view.depth.at(x, y) = kNoDepth; };
    const Image<float> before = view.depth;
    // Beside edges of depth.
    for (int y = 1; y + 1 < height; ++y)
        for (int x = 1; x + 1 < width; ++x)
            for (const auto& [dx, dy] : {std::pair(-1, 0), {1, 0}, {0, -1}, {0, 1}})
                if (std::abs(before.at(x + dx, y + dy) / before.at(x, y) - 1) > 0.1f) lose(x, y);
    // The border, where the depth camera did not look.
    const int border = random.whole(0, 3);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            if (x < border || y < border || x >= width - border || y >= height - border) lose(x, y);
    // Dark and shiny parts.
    for (int i = random.whole(0, 4); i > 0; --i) {
        const int w = random.whole(2, std::max(2, width / 4));
        const int h = random.whole(2, std::max(2, height / 4));
        const int left = random.whole(0, width - w), top = random.whole(0, height - h);
        for (int y = top; y < top + h; ++y)
            for (int x = left; x < left + w; ++x) lose(x, y);
    }
}

}  // namespace

namespace measures {

Outcome unknownDepth(Pictures& pictures) {
    const Captured& captured = pictures.captured();
    if (captured.from.shape != SweepCase::room || captured.bundle.views.size() < 3)
        return std::nullopt;
    const std::size_t which = std::size_t(pick(pictures, 301, int(captured.bundle.views.size())));
    Random random(captured.from.seed * 77 + std::uint64_t(captured.from.number));
    Bundle with = captured.bundle, without = captured.bundle;
    forget(with.views[which], random);
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

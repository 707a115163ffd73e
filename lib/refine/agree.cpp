#include "lib/refine/agree.hpp"

#include <cmath>
#include <utility>
#include <vector>

#include "lib/refine/noise.hpp"

namespace stx {
namespace {

// Chosen by trial on the sets of tests/bench/pictures.md with noise added.

/// Rounds: in the second one the points of all views are nearer to each other, so that more of them
/// agree.
constexpr int kAgreementRounds = 2;
/// Surfaces further apart than so many standard deviations are not the same.
constexpr float kAgreementBand = 3.0f;
/// The least slope of a surface against the rays of a view, as a share of that of a surface across
/// them: a view that looks along the surface tells nothing of its depth.
constexpr float kFacing = 0.2f;
/// The noise that is left counts as so many times what the formula gives, since points that few
/// views confirm are off by more than the mean.
constexpr float kUnconfirmed = 1.25f;

/// What a partner says of a point: how far it is to move, in q, and the variance of that.
struct Opinion {
    float move = 0, variance = 0;  ///< 0 = says nothing
};

Opinion opinionOf(const Partner& p, const DepthAxis& axis, float x, float y, float q) {
    const ShownSurface s = surfaceShownBy(*p.view, p.warp, x, y, q);
    if (!s.found) return {};
    const float across = p.view->space->axis.qPerUnit(s.shown) / axis.qPerUnit(q);
    if (!(std::abs(s.rate) > kFacing * across)) return {};
    // A view from behind may see the other side of something thick: points on the right side of it
    // stay where they are.
    if (s.rate < 0.0f && s.off >= 0.0f) return {};
    const float doubt = s.doubt / s.rate;
    return {s.off / s.rate, doubt * doubt};
}

/// The new points of one view, and what is left of its noise.
std::pair<Image<float>, float> moved(std::span<const NoisyView> views, std::size_t number,
                                     PixelSpool* spool) {
    const NoisyView& view = views[number];
    const std::vector<Partner> partners = partnersOf(views, number);
    const DepthAxis& axis = view.space->axis;
    Image<float> out = *view.q;
    std::vector<double> left(static_cast<std::size_t>(out.height()), 0.0);
    std::vector<std::int64_t> points(left.size(), 0);
    forRows(out, spool, [&](int y) {
        for (int x = 0; x < out.width(); ++x) {
            const float q = view.q->at(x, y), own = view.surface.at(x, y).z;
            if (!(q > 0.0f) || !(own > 0.0f)) continue;
            float sum = 0, weight = 1.0f / (own * own);
            for (const Partner& p : partners) {
                const Opinion opinion = opinionOf(p, axis, static_cast<float>(x) + 0.5f,
                                                  static_cast<float>(y) + 0.5f, q);
                if (!(opinion.variance > 0.0f) ||
                    opinion.move * opinion.move >
                        kAgreementBand * kAgreementBand * (own * own + opinion.variance))
                    continue;
                sum += opinion.move / opinion.variance;
                weight += 1.0f / opinion.variance;
            }
            const float value = q + sum / weight;
            if (value > 0.0f) out.at(x, y) = value;
            const double scale = axis.relativeScale(q);
            left[y] += 1.0 / (weight * scale * scale);
            ++points[y];
        }
    });
    const auto mean = meanOfRows(left, points);
    return {std::move(out), mean ? kDoubt * static_cast<float>(std::sqrt(*mean)) : view.left};
}

}  // namespace

void agreeOnDepth(std::span<NoisyView> views, PixelSpool* spool) {
    if (views.size() < 2) return;
    for (int round = 0; round < kAgreementRounds; ++round) {
        std::vector<std::pair<Image<float>, float>> results;
        for (std::size_t i = 0; i < views.size(); ++i) {
            results.push_back(moved(views, i, spool));
            results.back().first.moveTo(spool);
        }
        for (std::size_t i = 0; i < views.size(); ++i) {
            *views[i].q = std::move(results[i].first);
            views[i].left = kUnconfirmed * results[i].second;
        }
    }
}

}  // namespace stx

#include "lib/registration/disagreement.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "lib/base/counted.hpp"
#include "lib/base/median.hpp"
#include "lib/base/parallel.hpp"
#include "lib/registration/overlap.hpp"

namespace stx {
namespace registration {
namespace {

/// What counts as one surface when views are drawn, a share of the distance (kSame of
/// shaders/shared/surface_constants.glsl, kSameDepth of lib/render/splat), or of a pixel's width if
/// that is more. Exact cases of tests/sweep come to 0.03 of that width. With one camera moved
/// sideways by 2 % of the distance, 16 of 24 come to more than 0.25, 4 to less, and in 4 no views
/// overlap. Or what surfaces bend by between pixels, if that is more, in all but a quarter of the
/// points: bars three pixels thick have 0.3 to 1.6 %. Of 40 moved cameras 21 are found with it and
/// without; on leaves, one moved by 0.2 % is not found any more.
constexpr double kSameShare = 0.002, kSameOfPixel = 0.25;

/// A pixel's width and half a step of the depth code, shares of the distance.
glm::dvec2 finenessOf(const ViewHeader& view, double dist) {
    const glm::dvec2 spacing = view.camera.sampleSpacing(dist);
    const double step = view.depthBits < 32 ? view.depthCode().step() : 0.0;
    return glm::dvec2(std::max(spacing.x, spacing.y), step / 2) / dist;
}

/// Of the view with that index.
ViewDisagreement ofView(int view, const std::vector<Pair>& pairs,
                        const std::vector<OfPair>& found) {
    ViewDisagreement out;
    std::set<int> partners;
    std::vector<double> values;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        const Pair& pair = pairs[i];
        if ((pair.from != view && pair.to != view) || !found[i].told) continue;
        const int other = pair.from == view ? pair.to : pair.from;
        partners.insert(other);
        values.push_back(found[i].relative);
        out.overlap += pair.overlap;
        out.oneSurface = std::max(out.oneSurface, found[i].oneSurface);
        if (out.farthest >= 0 && found[i].relative <= out.farthestBy) continue;
        out.farthest = other;
        out.farthestBy = found[i].relative;
    }
    if (values.empty()) return out;
    out.partners = static_cast<int>(partners.size());
    out.overlap /= static_cast<double>(values.size());
    // Of three views one of which is off, the other two have one good partner each.
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) / 2);
    std::nth_element(values.begin(), middle, values.end());
    out.relative = *middle;
    return out;
}

/// Views that see past most others, or are seen past by them: one whose depth is too far sees past
/// what others show, and one whose depth is too near has points before it. Either way it is one of
/// the two in most of its pairs, and the others each in a pair with it alone.
std::vector<bool> apartFromMost(std::size_t views, const std::vector<SeenPast>& past) {
    std::map<std::pair<int, int>, bool> pairs;
    for (const SeenPast& p : past) {
        bool& most = pairs[std::minmax(p.from, p.to)];
        most = most || p.most;
    }
    std::vector<int> others(views, 0), apart(views, 0);
    for (const auto& [pair, most] : pairs) {
        for (const int v : {pair.first, pair.second}) {
            ++others[static_cast<std::size_t>(v)];
            apart[static_cast<std::size_t>(v)] += most ? 1 : 0;
        }
    }
    std::vector<bool> out(views);
    for (std::size_t v = 0; v < views; ++v) out[v] = 2 * apart[v] > others[v];
    return out;
}

}  // namespace

OfPair measurePair(const GridOfPoints& from, const ViewHeader& own, const DepthView& to,
                   double tolerance) {
    const CommonPoints common = commonPoints(from, own.camera, to, tolerance);
    if (common.points.size() < kFewestPoints) return {};
    std::vector<double> apart, near, there, bent;
    for (const CommonPoints::CommonPoint& p : common.points) {
        apart.push_back(std::abs(p.at - p.shown) / p.at);
        near.push_back(p.own);
        there.push_back(p.at);
        bent.push_back(p.bent / p.at);
    }
    const auto quarterOf = [](std::vector<double>& values) {
        const auto quarter = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 4);
        std::nth_element(values.begin(), quarter, values.end());
        return *quarter;
    };
    const glm::dvec2 a = finenessOf(own, medianOf(std::move(near))),
                     b = finenessOf(*to.header, medianOf(std::move(there)));
    const double pixel = kSameOfPixel * std::max(a.x, b.x);
    return {true, quarterOf(apart), std::max({kSameShare, pixel, quarterOf(bent)}) + a.y + b.y};
}

DepthDisagreement disagreement(std::span<const DepthView> views, const std::vector<Pair>& pairs,
                               const OverlapSettings& settings, const std::vector<SeenPast>& past) {
    std::vector<OfPair> found(pairs.size());
    parallelFor(0, pairs.size(), [&](std::size_t i) {
        const Pair& pair = pairs[i];
        const DepthView& from = views[pair.from];
        found[i] = measurePair(gridOfPoints(*from.depth, kMeasured), *from.header, views[pair.to],
                               settings.overlapTolerance);
    });
    return togetherOf(pairs, found, views.size(), past, settings);
}

DepthDisagreement togetherOf(const std::vector<Pair>& pairs, const std::vector<OfPair>& found,
                             std::size_t views, const std::vector<SeenPast>& past,
                             const OverlapSettings& settings) {
    DepthDisagreement result;
    std::vector<double> values;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        if (!found[i].told) continue;
        values.push_back(found[i].relative);
        result.overlap += pairs[i].overlap;
    }
    result.pairs = static_cast<int>(values.size());
    if (result.pairs > 0) result.overlap /= result.pairs;
    result.relative = medianOf(std::move(values));
    for (std::size_t v = 0; v < views; ++v)
        result.views.push_back(ofView(static_cast<int>(v), pairs, found));
    const std::vector<bool> apart = apartFromMost(views, past);
    for (std::size_t v = 0; v < views; ++v)
        if (apart[v]) result.views[v].beyond = settings.overlapTolerance;
    return result;
}

}  // namespace registration

bool DepthDisagreement::disagrees() const {
    return std::ranges::any_of(views, &ViewDisagreement::disagrees);
}

std::vector<DepthView> depthViewsOf(const Bundle& bundle) {
    std::vector<DepthView> views;
    for (const ReferenceView& view : bundle.views) views.push_back({&view, &view.depth});
    return views;
}

DepthDisagreement measureDepthDisagreement(std::span<const DepthView> views,
                                           const OverlapSettings& settings) {
    std::vector<registration::SeenPast> past;
    const auto pairs = registration::overlappingPairs(views, settings, &past);
    return registration::disagreement(views, pairs, settings, past);
}

DepthDisagreement measureDepthDisagreement(const Bundle& bundle, const OverlapSettings& settings) {
    return measureDepthDisagreement(depthViewsOf(bundle), settings);
}

std::optional<std::string> disagreementNote(const Bundle& bundle, const DepthDisagreement& found,
                                            bool aligned) {
    constexpr std::size_t kNamed = 3;
    std::vector<std::size_t> worst;
    for (std::size_t v = 0; v < found.views.size(); ++v)
        if (found.views[v].disagrees()) worst.push_back(v);
    if (worst.empty()) return {};
    const auto by = [&](std::size_t v) {
        return std::max(found.views[v].relative, found.views[v].beyond);
    };
    std::ranges::stable_sort(worst, [&](std::size_t a, std::size_t b) { return by(a) > by(b); });
    std::string names;
    for (std::size_t i = 0; i < std::min(kNamed, worst.size()); ++i)
        names +=
            fmt::format("{}'{}' by {}{:.2g} %", i > 0 ? ", " : "", bundle.views[worst[i]].name,
                        found.views[worst[i]].beyond > 0 ? "more than " : "", 100 * by(worst[i]));
    // One that is far off may have nothing in common with any.
    double oneSurface = found.views[worst.front()].oneSurface;
    for (const ViewDisagreement& view : found.views)
        if (found.views[worst.front()].oneSurface == 0)
            oneSurface = std::max(oneSurface, view.oneSurface);
    if (oneSurface == 0) oneSurface = registration::kSameShare;
    if (worst.size() > kNamed) names += fmt::format(" and {} more", worst.size() - kNamed);
    const std::string help =
        aligned ? "other poses did not help: their depth is off, or has another scale or lens than "
                  "was said"
                : "stx refine --with poses aligns cameras and depth; depth of another scale or "
                  "lens than was said needs the options of stx convert";
    return fmt::format(
        "{} of {} disagree{} with what overlaps {} by more of the distance than counts as one "
        "surface "
        "({:.2g} %): {}; edges may show twice; {}",
        worst.size(), counted(found.views.size(), "view"), worst.size() == 1 ? "s" : "",
        worst.size() == 1 ? "it" : "them", 100 * oneSurface, names, help);
}

}  // namespace stx

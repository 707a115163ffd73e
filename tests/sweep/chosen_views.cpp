#include <algorithm>

#include <fmt/format.h>

#include "lib/render/factory.hpp"
#include "tests/some_views.hpp"
#include "tests/sweep/measures.hpp"
#include "tests/sweep/random.hpp"

using namespace stx;

namespace {

/// The case's bundle and others like it, moved: not all of their views have a part in a picture of
/// the case.
Bundle withNeighbours(const Captured& captured, Random& random) {
    Bundle bundle = captured.bundle;
    bundle.bounds.reset();
    for (int n = random.whole(1, 3); n > 0; --n) {
        const glm::dvec3 towards(random.between(-1, 1), random.between(-1, 1),
                                 random.between(-1, 1));
        const glm::dvec3 away =
            random.between(0.5, 12) * towards / std::max(0.1, glm::length(towards));
        for (ReferenceView view : captured.bundle.views) {
            view.name += fmt::format(" {}", n);
            view.camera.position += away;
            bundle.views.push_back(std::move(view));
        }
    }
    return bundle;
}

std::int64_t differences(const Frame& a, const Frame& b) {
    std::int64_t count = 0;
    for (std::size_t i = 0; i < a.colour.count(); ++i)
        count += a.colour.data()[i] != b.colour.data()[i] ||
                 a.depth.data()[i] != b.depth.data()[i] ||
                 (!a.normal.empty() && a.normal.data()[i] != b.normal.data()[i]);
    return count;
}

}  // namespace

namespace measures {

Outcome chosenViews(Pictures& pictures) {
    const Captured& captured = pictures.captured();
    Random random(captured.from.seed * 7919 + static_cast<std::uint64_t>(captured.from.number));
    const Bundle all = withNeighbours(captured, random);
    RenderSettings settings;
    settings.refine = RefineSettings::none();
    if (random.chance(0.4)) settings.mode = RenderMode::splat;
    if (random.chance(0.3)) settings.quality = Quality::best;
    if (random.chance(0.3)) settings.fill = Fill::none;
    settings.normals = random.chance(0.3);
    std::vector<ViewSummary> summaries;
    for (const ReferenceView& view : all.views) summaries.push_back(summaryOfView(view));
    const auto needed = neededViews(Backend::cpu, -1, all.views, summaries, settings,
                                    std::span(&captured.novel, 1));
    const auto count = std::ranges::count(needed, true);
    if (count == std::ssize(all.views)) return std::nullopt;
    const Bundle some = withSomeViews(all, needed);
    Job job;
    STX_TRY(const auto ofAll, makeRenderer(Backend::cpu, all, settings, -1, job));
    STX_TRY(const auto ofSome, makeRenderer(some, summaries, nullptr, settings, job));
    STX_TRY(const Frame a, ofAll->render(captured.novel));
    STX_TRY(const Frame b, ofSome->render(captured.novel));
    const std::int64_t found = differences(a, b);
    return Measure{static_cast<double>(found),
                   fmt::format("{}, {} of {} views: {} pixels differ",
                               settings.mode == RenderMode::splat ? "splat" : "surface", count,
                               all.views.size(), found)};
}

}  // namespace measures

#include "lib/registration/disagreement_by_view.hpp"

#include <algorithm>
#include <mutex>
#include <utility>
#include <vector>

#include "lib/registration/overlap.hpp"

namespace stx {

using registration::GridOfPoints;
using registration::OfPair;
using registration::Pair;

struct DisagreementByView::State {
    struct OfView {
        GridOfPoints probes;    ///< by which it is found who overlaps
        GridOfPoints measured;  ///< by which its pairs are measured
        /// The pairs from it that overlap most of those that have been looked at, widest first.
        std::vector<std::pair<Pair, OfPair>> pairs;
        bool compared = false;
    };
    OverlapSettings settings;
    std::vector<OfView> views;
    /// Which views each is to be compared with: found when all are sampled.
    std::vector<std::vector<std::size_t>> lookFor;
    std::once_flag known;  ///< `lookFor` is
    std::size_t left = 0;  ///< that compare() has not had yet
    std::vector<registration::SeenPast> past;
    std::mutex mutex;  ///< of `pairs`, `compared`, `past` and `left`

    /// Where a pair comes among those of its view: as overlappingPairs() sorts them.
    static bool before(const Pair& a, const Pair& b) {
        return a.overlap != b.overlap ? a.overlap > b.overlap : a.to < b.to;
    }
    /// Whether a pair is among the widest so far.
    bool matters(const OfView& from, const Pair& pair) const {
        return from.pairs.size() < static_cast<std::size_t>(settings.neighbours) ||
               (!from.pairs.empty() && before(pair, from.pairs.back().first));
    }
};

DisagreementByView::DisagreementByView(std::size_t views, const OverlapSettings& settings)
    : state_(std::make_unique<State>()) {
    state_->settings = settings;
    state_->views.resize(views);
    state_->left = views;
}

DisagreementByView::~DisagreementByView() = default;

void DisagreementByView::sample(std::size_t index, const Image<float>& depth) {
    State::OfView& view = state_->views[index];
    view.probes =
        registration::gridOfPoints(depth, registration::probesAmong(state_->views.size()));
    view.measured = registration::gridOfPoints(depth, registration::kMeasured);
    view.measured.points.shrink_to_fit();  // all views have one
}

bool DisagreementByView::compare(std::size_t index, const Image<float>& depth,
                                 const Bundle& bundle) {
    State& state = *state_;
    {
        const std::lock_guard lock(state.mutex);
        if (std::exchange(state.views[index].compared, true)) return false;
    }
    const DepthView to{&bundle.views[index], &depth};
    std::call_once(state.known, [&] {
        const auto camera = [&](std::size_t i) -> const Camera& { return bundle.views[i].camera; };
        state.lookFor = viewsToLookFor(state.views.size(), camera, [&](std::size_t i) {
            return registration::sphereAround(state.views[i].probes, camera(i));
        });
    });
    for (const std::size_t i : state.lookFor[index]) {
        const ViewHeader& own = bundle.views[i];
        if (own.background != to.header->background) continue;
        State::OfView& from = state.views[i];
        const auto common = registration::commonPoints(from.probes, own.camera, to,
                                                       state.settings.overlapTolerance);
        const Pair pair{static_cast<int>(i), static_cast<int>(index), common.overlap()};
        {
            const std::lock_guard lock(state.mutex);
            registration::addSeenPast(pair.from, pair.to, common, state.settings, state.past);
        }
        if (!(pair.overlap >= state.settings.minOverlap)) continue;
        {
            const std::lock_guard lock(state.mutex);
            if (!state.matters(from, pair)) continue;
        }
        const OfPair found =
            registration::measurePair(from.measured, own, to, state.settings.overlapTolerance);
        const std::lock_guard lock(state.mutex);
        const auto place = std::ranges::find_if(
            from.pairs, [&](const auto& other) { return State::before(pair, other.first); });
        from.pairs.emplace(place, pair, found);
        if (from.pairs.size() > static_cast<std::size_t>(state.settings.neighbours))
            from.pairs.pop_back();
    }
    const std::lock_guard lock(state.mutex);
    if (--state.left > 0) return false;
    for (State::OfView& view : state.views) view.probes = view.measured = {};
    return true;
}

DepthDisagreement DisagreementByView::result() const {
    std::vector<Pair> pairs;
    std::vector<OfPair> found;
    for (const State::OfView& view : state_->views) {
        for (const auto& [pair, ofPair] : view.pairs) {
            pairs.push_back(pair);
            found.push_back(ofPair);
        }
    }
    return registration::togetherOf(pairs, found, state_->views.size(), state_->past,
                                    state_->settings);
}

Result<DepthDisagreement> measureDepthDisagreement(const ViewTable& table, Job& job) {
    DisagreementByView found(table.count());
    const PeakMemory nothing{"comparing views", 0};
    STX_CHECK(forEachView(table, nothing, job, [&](std::size_t i, auto view) -> Result<void> {
        found.sample(i, view->depth);
        return {};
    }));
    STX_CHECK(forEachView(table, nothing, job, [&](std::size_t i, auto view) -> Result<void> {
        (void)found.compare(i, view->depth, table.about());
        return {};
    }));
    return found.result();
}

}  // namespace stx

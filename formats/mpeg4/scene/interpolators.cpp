#include "formats/mpeg4/scene/interpolators.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <unordered_set>

#include "formats/mpeg4/scene/events.hpp"
#include "lib/model/sequence.hpp"

namespace stx::mpeg4 {
namespace {

/// What the clocks of a scene send along its routes.
class ClockEvents {
  public:
    ClockEvents(Scene& scene, const ActiveNode& active)
        : clocks_(clocksOf(scene)),
          active_(active),
          events_(scene, [this, &scene](const NodePtr& node, int field, const FieldValue& value) {
              if (isHeld(*node, field, now_, active_)) return false;
              scene.changed.insert(node.get());
              return giveEvent(*node, field, value, now_, active_);
          }) {}
    // The events call back.
    ClockEvents(const ClockEvents&) = delete;
    ClockEvents& operator=(const ClockEvents&) = delete;

    /// What the clocks send after `before` and until `now`, in the order of its times; of each
    /// clock the last. Whether there was any.
    bool run(double before, double now, double slack) {
        std::vector<std::pair<double, const NodePtr*>> events;
        for (const NodePtr& clock : clocks_) {
            const auto run = runOfClock(*clock);
            if (!run || run->start > now + slack || run->end <= before + slack) continue;
            events.emplace_back(run->end <= now + slack ? run->end : std::max(now, run->start),
                                &clock);
        }
        std::ranges::stable_sort(events, {}, [](const auto& event) { return event.first; });
        for (std::size_t i = 0; i < events.size(); ++i) {
            if (i == 0 || events[i].first > events[i - 1].first) events_.nextStamp();
            now_ = events[i].first;
            if (const auto fraction = fractionOf(**events[i].second, events[i].first, slack))
                events_.send(*events[i].second, "fraction_changed", FieldValue(*fraction));
        }
        return !events.empty();
    }

  private:
    std::vector<NodePtr> clocks_;
    ActiveNode active_;
    double now_ = 0;  ///< of the event that is sent
    Events events_;
};

}  // namespace

ClockRun::ClockRun(double startTime, double cycleSeconds, double stopTime, double loopsUntil)
    : start(startTime), cycle(cycleSeconds), end(loopsUntil) {
    if (end != kEver) {
        const double looped = end - start - halfTick(1, end);
        end = start + cycle * std::max(1.0, std::ceil(looped / cycle));
    }
    if (stopTime > start) end = std::min(end, stopTime);
}

double loopsUntil(const Node& node) {
    return node.get<bool>("loop") ? kEver : node.loopedUntil;
}

std::vector<NodePtr> clocksOf(const Scene& scene) {
    std::vector<NodePtr> clocks;
    std::unordered_set<const Node*> seen;
    for (const Route& route : scene.routes)
        if (isField(route.from, route.fromField, "fraction_changed") &&
            route.from->is("TimeSensor") && seen.insert(route.from.get()).second)
            clocks.push_back(route.from);
    return clocks;
}

std::optional<ClockRun> runOfClock(const Node& clock) {
    const double cycle = clock.get<double>("cycleInterval");
    const double start = clock.get<double>("startTime");
    if (!clock.get<bool>("enabled") || !(cycle > 0) || !std::isfinite(start)) return {};
    return ClockRun(start, cycle, clock.get<double>("stopTime"), loopsUntil(clock));
}

std::optional<float> fractionOf(const Node& clock, double now, double slack) {
    const auto run = runOfClock(clock);
    if (!run || now < run->start) return {};
    const double passed = std::min(now, run->end) - run->start;
    const double inCycle = passed - std::floor(passed / run->cycle) * run->cycle;
    // The end of a cycle counts as 1, not as the start of the next.
    const bool atEnd = passed > slack && (inCycle <= slack || run->cycle - inCycle <= slack);
    return static_cast<float>(atEnd ? 1.0 : inCycle / run->cycle);
}

std::set<std::string> routesNotFollowed(const Scene& scene) {
    std::unordered_map<const Node*, std::vector<const Route*>> from;
    std::vector<const Route*> reached;
    for (const Route& route : scene.routes) {
        if (!route.from || !route.to) continue;
        from[route.from.get()].push_back(&route);
        if (route.from->is("TimeSensor")) reached.push_back(&route);
    }
    std::unordered_set<const Route*> seen(reached.begin(), reached.end());
    std::set<std::string> lost;
    while (!reached.empty()) {
        const Route& route = *reached.back();
        reached.pop_back();
        const bool sent = !route.from->is("TimeSensor") ||
                          isField(route.from, route.fromField, "fraction_changed");
        const bool drives =
            isField(route.to, route.toField, "set_fraction") && isInterpolator(*route.to);
        if (!sent || !(drives || keepsValue(route))) {
            lost.insert(textOf(route));
            continue;
        }
        const std::string next =
            drives ? "value_changed" : route.to->info->fields[route.toField].name;
        for (const Route* on : from[route.to.get()])
            if (isField(on->from, on->fromField, next) && seen.insert(on).second)
                reached.push_back(on);
    }
    return lost;
}

void applyInterpolators(Scene& scene, double now) {
    ClockEvents(scene, {}).run(-kEver, now, 0);
}

struct MovingScene::Impl {
    SceneInTime moments;
    std::uint32_t timescale;
    ActiveNode active;
    std::optional<ClockEvents> events;
    std::uint64_t routes = 0;  ///< SceneInTime::Structure::routes that the events are of
    double before = 0;         ///< of which the scene is
    bool moved = false;        ///< by events

    /// Applies the commands until a time. The events of the scene before them must have been sent.
    Result<Scene*> go(std::uint64_t until) {
        auto scene = moments.at(until);
        if (!scene || !events || routes != moments.structure().routes) {
            events.reset();
            if (scene) events.emplace(**scene, active);
            routes = moments.structure().routes;
        }
        return scene;
    }
};

MovingScene::MovingScene(const std::vector<CommandFrame>& frames, std::uint32_t timescale,
                         bool timesFromStart, ActiveNode active)
    : impl_(new Impl{
          SceneInTime(frames, timescale, timesFromStart, active), timescale, active, {}}) {}
MovingScene::MovingScene(MovingScene&&) noexcept = default;
MovingScene& MovingScene::operator=(MovingScene&&) noexcept = default;
MovingScene::~MovingScene() = default;

Result<Scene*> MovingScene::at(double now, std::uint64_t until, double slack) {
    Impl& i = *impl_;
    // What routes have set has no way back.
    if (i.moved && now < i.before) {
        i.moments.restart();
        i.events.reset();
        i.moved = false;
    }
    for (auto next = i.moments.next(); next && *next <= until; next = i.moments.next()) {
        const double time = static_cast<double>(*next) / i.timescale;
        if (i.events && i.events->run(i.before, time, slack)) i.moved = true;
        i.before = time;
        STX_CHECK(i.go(*next));
    }
    STX_TRY(Scene * scene, i.go(until));
    if (i.events->run(i.before, now, slack)) i.moved = true;
    i.before = now;
    return scene;
}

}  // namespace stx::mpeg4

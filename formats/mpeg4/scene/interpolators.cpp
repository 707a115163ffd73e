#include "formats/mpeg4/scene/interpolators.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <unordered_set>

#include "lib/geometry/camera.hpp"

namespace stx::mpeg4 {
namespace {

/// Of two values; rotations along the shorter arc.
float between(float a, float b, float t) {
    return a + (b - a) * t;
}
glm::vec2 between(glm::vec2 a, glm::vec2 b, float t) {
    return glm::mix(a, b, t);
}
glm::vec3 between(glm::vec3 a, glm::vec3 b, float t) {
    return glm::mix(a, b, t);
}
Color between(Color a, Color b, float t) {
    return {between(a.r, b.r, t), between(a.g, b.g, t), between(a.b, b.b, t)};
}
Rotation between(const Rotation& a, const Rotation& b, float t) {
    const auto quat = [](const Rotation& r) {
        return quatFromAxisAngle(glm::dvec4(r.axis, r.angle));
    };
    // glm::slerp takes the shorter arc.
    const glm::dvec4 turn = axisAngleFromQuat(glm::slerp(quat(a), quat(b), static_cast<double>(t)));
    return {glm::vec3(turn), static_cast<float>(turn.w)};
}

/// The value of an interpolator whose keyValue is of type std::vector<T>.
template <class T>
std::optional<FieldValue> valueAt(const Node& node, float fraction) {
    const int key = node.info->find("key");
    const int keyValue = node.info->find("keyValue");
    if (key < 0 || keyValue < 0) return {};
    const auto* keys = std::get_if<std::vector<float>>(&node.value(key));
    const auto* values = std::get_if<std::vector<T>>(&node.value(keyValue));
    if (!keys || !values || keys->empty() || keys->size() != values->size()) return {};
    const auto next = std::upper_bound(keys->begin(), keys->end(), fraction);
    const auto at = static_cast<std::size_t>(next - keys->begin());
    if (at == 0) return FieldValue(values->front());
    if (at == keys->size()) return FieldValue(values->back());
    const float low = (*keys)[at - 1], high = (*keys)[at];
    const float t = high > low ? (fraction - low) / (high - low) : 0.0f;
    return FieldValue(between((*values)[at - 1], (*values)[at], t));
}

/// What computes the value of a node at a fraction; null where nothing does.
using Interpolation = std::optional<FieldValue> (*)(const Node& node, float fraction);
Interpolation interpolationOf(const Node& node) {
    if (node.is("PositionInterpolator")) return valueAt<glm::vec3>;
    if (node.is("OrientationInterpolator")) return valueAt<Rotation>;
    if (node.is("ScalarInterpolator")) return valueAt<float>;
    if (node.is("PositionInterpolator2D")) return valueAt<glm::vec2>;
    if (node.is("ColorInterpolator")) return valueAt<Color>;
    return nullptr;
}

bool isField(const NodePtr& node, int field, std::string_view name) {
    return node && field >= 0 && field < static_cast<int>(node->info->fields.size()) &&
           node->info->fields[field].name == name;
}

/// Whether a route ends in a field that keeps a value of those that are sent here.
bool keepsValue(const Route& route) {
    const auto& fields = route.to->info->fields;
    if (route.toField < 0 || route.toField >= static_cast<int>(fields.size())) return false;
    const FieldInfo& field = fields[route.toField];
    return field.hasValue() && !isMultiple(field.type) && field.type != FieldType::SFNode;
}

/// The routes of a scene, along which clocks send.
class Events {
  public:
    explicit Events(Scene& scene)
        : scene_(scene), clocks_(clocksOf(scene)), done_(scene.routes.size(), 0) {
        if (clocks_.empty()) return;
        for (std::size_t i = 0; i < scene.routes.size(); ++i)
            from_[scene.routes[i].from.get()].push_back(i);
    }

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
            // Routes work once for each time stamp.
            if (i == 0 || events[i].first > events[i - 1].first) ++stamp_;
            if (const auto fraction = fractionOf(**events[i].second, events[i].first))
                send(*events[i].second, "fraction_changed", FieldValue(*fraction));
        }
        return !events.empty();
    }

  private:
    void send(const NodePtr& node, std::string_view event, const FieldValue& value) {
        const auto routes = from_.find(node.get());
        if (routes == from_.end()) return;
        for (const std::size_t i : routes->second) {
            const Route& route = scene_.routes[i];
            if (done_[i] == stamp_ || !isField(route.from, route.fromField, event) || !route.to)
                continue;
            done_[i] = stamp_;
            receive(route, value);
        }
    }

    void receive(const Route& route, const FieldValue& value) {
        if (isField(route.to, route.toField, "set_fraction")) {
            const float* fraction = std::get_if<float>(&value);
            const Interpolation at = interpolationOf(*route.to);
            if (!fraction || !at) return;
            if (const auto result = at(*route.to, *fraction))
                send(route.to, "value_changed", *result);
        } else if (keepsValue(route) && typeOf(value) == typeOf(route.to->value(route.toField))) {
            route.to->set(route.toField, value);
            scene_.changed.insert(route.to.get());
            send(route.to, route.to->info->fields[route.toField].name, value);
        }
    }

    Scene& scene_;
    std::vector<NodePtr> clocks_;
    std::uint64_t stamp_ = 0;
    std::vector<std::uint64_t> done_;  ///< the stamp at which each route has worked last
    std::unordered_map<const Node*, std::vector<std::size_t>> from_;
};

}  // namespace

ClockRun::ClockRun(double startTime, double cycleSeconds, bool loop, double stopTime)
    : start(startTime), cycle(cycleSeconds), end(loop ? kEver : startTime + cycleSeconds) {
    if (stopTime > start) end = std::min(end, stopTime);
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
    return ClockRun(start, cycle, clock.get<bool>("loop"), clock.get<double>("stopTime"));
}

std::optional<float> fractionOf(const Node& clock, double now) {
    const auto run = runOfClock(clock);
    if (!run || now < run->start) return {};
    const double passed = (std::min(now, run->end) - run->start) / run->cycle;
    const double whole = std::floor(passed);
    // The end of a cycle counts as 1, not as the start of the next.
    const bool atEnd = passed == whole && passed > 0 && now >= run->end;
    return static_cast<float>(atEnd ? 1.0 : passed - whole);
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
        const auto nameOf = [](const NodePtr& node, int field) {
            const auto& fields = node->info->fields;
            return field >= 0 && field < static_cast<int>(fields.size()) ? fields[field].name : "";
        };
        const std::string out = nameOf(route.from, route.fromField);
        const std::string in = nameOf(route.to, route.toField);
        const bool sent = !route.from->is("TimeSensor") || out == "fraction_changed";
        const bool drives = in == "set_fraction" && interpolationOf(*route.to);
        if (!sent || !(drives || keepsValue(route))) {
            lost.insert(fmt::format("{}.{} TO {}.{}", route.from->info->name, out,
                                    route.to->info->name, in));
            continue;
        }
        const std::string next = drives ? "value_changed" : in;
        for (const Route* on : from[route.to.get()])
            if (isField(on->from, on->fromField, next) && seen.insert(on).second)
                reached.push_back(on);
    }
    return lost;
}

void applyInterpolators(Scene& scene, double now) {
    Events(scene).run(-kEver, now, 0);
}

struct MovingScene::Impl {
    SceneInTime moments;
    std::uint32_t timescale;
    std::optional<Events> events;
    std::uint64_t routes = 0;  ///< SceneInTime::Structure::routes that the events are of
    double before = 0;         ///< of which the scene is
    bool moved = false;        ///< by events

    /// Applies the commands until a time. The events of the scene before them must have been sent.
    Result<Scene*> go(std::uint64_t until) {
        auto scene = moments.at(until);
        if (!scene || !events || routes != moments.structure().routes) {
            events.reset();
            if (scene) events.emplace(**scene);
            routes = moments.structure().routes;
        }
        return scene;
    }
};

MovingScene::MovingScene(const std::vector<CommandFrame>& frames, std::uint32_t timescale,
                         bool timesFromStart, ActiveNode active)
    : impl_(new Impl{
          SceneInTime(frames, timescale, timesFromStart, std::move(active)), timescale, {}}) {}
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

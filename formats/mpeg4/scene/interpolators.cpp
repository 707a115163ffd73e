#include "formats/mpeg4/scene/interpolators.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
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

std::optional<FieldValue> interpolated(const Node& node, float fraction) {
    if (node.is("PositionInterpolator")) return valueAt<glm::vec3>(node, fraction);
    if (node.is("OrientationInterpolator")) return valueAt<Rotation>(node, fraction);
    if (node.is("ScalarInterpolator")) return valueAt<float>(node, fraction);
    if (node.is("PositionInterpolator2D")) return valueAt<glm::vec2>(node, fraction);
    if (node.is("ColorInterpolator")) return valueAt<Color>(node, fraction);
    return {};
}

bool isField(const NodePtr& node, int field, std::string_view name) {
    return node && field >= 0 && field < static_cast<int>(node->info->fields.size()) &&
           node->info->fields[field].name == name;
}

class Events {
  public:
    explicit Events(Scene& scene) : scene_(scene), done_(scene.routes.size(), false) {
        for (std::size_t i = 0; i < scene.routes.size(); ++i)
            from_[scene.routes[i].from.get()].push_back(i);
    }

    void send(const NodePtr& node, std::string_view event, const FieldValue& value) {
        const auto routes = from_.find(node.get());
        if (routes == from_.end()) return;
        for (const std::size_t i : routes->second) {
            const Route& route = scene_.routes[i];
            if (done_[i] || !isField(route.from, route.fromField, event) || !route.to) continue;
            done_[i] = true;
            receive(route, value);
        }
    }

  private:
    void receive(const Route& route, const FieldValue& value) {
        const auto& fields = route.to->info->fields;
        if (route.toField < 0 || route.toField >= static_cast<int>(fields.size())) return;
        const FieldInfo& field = fields[route.toField];
        if (isField(route.to, route.toField, "set_fraction")) {
            const float* fraction = std::get_if<float>(&value);
            if (!fraction) return;
            if (const auto result = interpolated(*route.to, *fraction))
                send(route.to, "value_changed", *result);
        } else if (field.hasValue() && typeOf(value) == field.type && !isMultiple(field.type) &&
                   field.type != FieldType::SFNode) {
            route.to->set(route.toField, value);
            send(route.to, field.name, value);
        }
    }

    Scene& scene_;
    std::vector<bool> done_;  ///< of routes
    std::unordered_map<const Node*, std::vector<std::size_t>> from_;
};

/// The clocks that routes leave, each once.
std::vector<NodePtr> clocksOf(const Scene& scene) {
    std::vector<NodePtr> clocks;
    std::unordered_set<const Node*> seen;
    for (const Route& route : scene.routes)
        if (isField(route.from, route.fromField, "fraction_changed") &&
            route.from->is("TimeSensor") && seen.insert(route.from.get()).second)
            clocks.push_back(route.from);
    return clocks;
}

}  // namespace

std::optional<float> fractionOf(const Node& clock, double now) {
    const double cycle = clock.get<double>("cycleInterval");
    const double start = clock.get<double>("startTime");
    const double stop = clock.get<double>("stopTime");
    if (!clock.get<bool>("enabled") || !(cycle > 0) || !std::isfinite(start) || now < start)
        return {};
    double end = clock.get<bool>("loop") ? std::numeric_limits<double>::infinity() : start + cycle;
    if (stop > start) end = std::min(end, stop);
    const double passed = (std::min(now, end) - start) / cycle;
    const double whole = std::floor(passed);
    // The end of a cycle counts as 1, not as the start of the next.
    const bool atEnd = passed == whole && passed > 0 && now >= end;
    return static_cast<float>(atEnd ? 1.0 : passed - whole);
}

std::vector<ClockSpan> clockSpans(const Scene& scene) {
    std::vector<ClockSpan> spans;
    for (const NodePtr& clock : clocksOf(scene)) {
        const double cycle = clock->get<double>("cycleInterval");
        const double start = std::max(0.0, clock->get<double>("startTime"));
        if (clock->get<bool>("enabled") && cycle > 0 && std::isfinite(cycle) &&
            std::isfinite(start))
            spans.push_back({start, start + cycle, !clock->get<bool>("loop")});
    }
    return spans;
}

void applyInterpolators(Scene& scene, double now) {
    const auto clocks = clocksOf(scene);
    if (clocks.empty()) return;
    Events events(scene);
    for (const NodePtr& clock : clocks)
        if (const auto fraction = fractionOf(*clock, now))
            events.send(clock, "fraction_changed", FieldValue(*fraction));
}

}  // namespace stx::mpeg4

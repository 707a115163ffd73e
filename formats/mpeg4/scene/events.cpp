#include "formats/mpeg4/scene/events.hpp"

#include <algorithm>
#include <optional>

#include "formats/mpeg4/scene/interpolators.hpp"
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

std::string nameOf(const NodePtr& node, int field) {
    const auto& fields = node->info->fields;
    return field >= 0 && field < static_cast<int>(fields.size()) ? fields[field].name : "";
}

/// A movie that has ended shows its last picture on, whatever else it shall do when it starts anew
/// (ISO/IEC 14772-1, 6.28).
void keepEndedRun(Node& node, int field, double now, const ActiveNode& active) {
    const std::string& name = node.info->fields[field].name;
    if (!active || node.proto || !node.is("MovieTexture") ||
        (name != "startTime" && name != "stopTime" && name != "speed" && name != "loop"))
        return;
    if (active(node, now)) {
        node.ended.reset();
        return;
    }
    const Node::EndedRun run{node.get<double>("startTime"), node.get<double>("stopTime"),
                             node.get<float>("speed"), loopsUntil(node)};
    const bool hasRun = run.start <= now && run.speed != 0;
    // What events since have made of its fields did not run.
    const bool isKept = node.ended && node.ended->start == run.start && run.loopsUntil != kEver;
    if (hasRun && !isKept) node.ended = run;
}

}  // namespace

bool isHeldWhileActive(const NodeInfo& node, int field) {
    if (field < 0 || field >= static_cast<int>(node.fields.size())) return false;
    const std::string& name = node.fields[field].name;
    return name == "startTime" || name == "cycleInterval" || name == "speed";
}

bool isHeld(const Node& node, int field, double now, const ActiveNode& active) {
    return isHeldWhileActive(*node.info, field) && active && active(node, now);
}

bool giveEvent(Node& node, int field, const FieldValue& value, double now,
               const ActiveNode& active) {
    if (typeOf(node.value(field)) == typeOf(value)) keepEndedRun(node, field, now, active);
    const bool* loops = std::get_if<bool>(&node.value(field));
    if (loops && *loops && isLoop(node, field)) node.loopedUntil = now;
    return node.set(field, value);
}

bool isInterpolator(const Node& node) {
    return interpolationOf(node) != nullptr;
}

std::string brokenKeys(const Node& node) {
    const auto& keys = node.get<std::vector<float>>("key");
    const std::size_t values = itemCount(node.value("keyValue"));
    if (keys.size() != values) return fmt::format("{} keys and {} keyValues", keys.size(), values);
    const auto down = std::ranges::adjacent_find(keys, [](float a, float b) { return !(a <= b); });
    if (down == keys.end()) return {};
    return fmt::format("the key {:g} after {:g}", *(down + 1), *down);
}

std::set<std::string> brokenKeys(const std::vector<CommandFrame>& frames) {
    std::set<std::string> broken;
    // A walk that ends before all is seen ends reading, too.
    (void)forEachNodeInside(frames, [&](const NodePtr& node) {
        if (!isInterpolator(*node)) return;
        const std::string wrong = brokenKeys(*node);
        if (wrong.empty()) return;
        const std::string name = node->defName.empty() ? "" : " '" + node->defName + "'";
        broken.insert(fmt::format("{}{} has {}", node->info->name, name, wrong));
    });
    return broken;
}

bool isField(const NodePtr& node, int field, std::string_view name) {
    return node && field >= 0 && field < static_cast<int>(node->info->fields.size()) &&
           node->info->fields[field].name == name;
}

bool keepsValue(const Route& route) {
    const auto& fields = route.to->info->fields;
    if (route.toField < 0 || route.toField >= static_cast<int>(fields.size())) return false;
    const FieldInfo& field = fields[route.toField];
    return field.hasValue() && !isMultiple(field.type) && field.type != FieldType::SFNode;
}

std::string textOf(const Route& route) {
    return fmt::format("{}.{} TO {}.{}", route.from->info->name,
                       nameOf(route.from, route.fromField), route.to->info->name,
                       nameOf(route.to, route.toField));
}

Events::Events(const Scene& scene, Give give, std::set<std::string>* lost)
    : scene_(scene), give_(std::move(give)), lost_(lost) {
    for (std::size_t i = 0; i < scene.routes.size(); ++i) add(i);
}

void Events::add(std::size_t route) {
    done_.resize(std::max(done_.size(), route + 1));
    from_[scene_.routes[route].from.get()].push_back(route);
}

std::size_t Events::send(const NodePtr& node, std::string_view event, const FieldValue& value) {
    // Not by recursion: a chain of routes may be long.
    std::vector<Sent> open{{node, std::string(event), value}};
    std::size_t count = 0;
    while (!open.empty()) {
        const Sent sent = std::move(open.back());
        open.pop_back();
        const auto routes = from_.find(sent.node.get());
        if (routes == from_.end()) continue;
        std::vector<Sent> next;
        for (const std::size_t i : routes->second) {
            ++count;
            const Route& route = scene_.routes[i];
            if (done_[i] == stamp_ || !isField(route.from, route.fromField, sent.event) ||
                !route.to)
                continue;
            done_[i] = stamp_;
            if (!receive(route, sent.value, next) && lost_ != nullptr) lost_->insert(textOf(route));
        }
        // What the first route leads to comes first.
        std::move(next.rbegin(), next.rend(), std::back_inserter(open));
    }
    return count;
}

bool Events::receive(const Route& route, const FieldValue& value, std::vector<Sent>& next) {
    if (isField(route.to, route.toField, "set_fraction")) {
        const float* fraction = std::get_if<float>(&value);
        const Interpolation at = interpolationOf(*route.to);
        if (!fraction || !at) return false;
        if (auto result = at(*route.to, *fraction))
            next.push_back({route.to, "value_changed", std::move(*result)});
        return true;
    }
    if (!keepsValue(route) || typeOf(value) != typeOf(route.to->value(route.toField))) return false;
    if (give_(route.to, route.toField, value))
        next.push_back({route.to, nameOf(route.to, route.toField), value});
    return true;
}

std::size_t Events::setFraction(const NodePtr& interpolator, float fraction) {
    const Interpolation at = interpolationOf(*interpolator);
    const auto result = at ? at(*interpolator, fraction) : std::nullopt;
    return result ? send(interpolator, "value_changed", *result) : 0;
}

}  // namespace stx::mpeg4

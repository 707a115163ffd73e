#pragma once

#include <functional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "formats/mpeg4/scene/scene.hpp"

namespace stx::mpeg4 {

/// Whether a node is an interpolator that is computed here: Position-, Orientation-, Scalar-,
/// Color- and PositionInterpolator2D.
[[nodiscard]] bool isInterpolator(const Node& node);

/// What is wrong with the keys of such an interpolator, so that it sends nothing or something that
/// nobody can tell ("3 keys and 2 keyValues"); empty where they fit.
[[nodiscard]] std::string brokenKeys(const Node& interpolator);

/// The same of all interpolators of a document, each with its type and name.
[[nodiscard]] std::set<std::string> brokenKeys(const std::vector<CommandFrame>& frames);

[[nodiscard]] bool isField(const NodePtr& node, int field, std::string_view name);

/// Whether a route ends in a field that keeps a value of those that are sent here.
[[nodiscard]] bool keepsValue(const Route& route);

/// Whether a field takes no event while its node is active.
[[nodiscard]] bool isHeldWhileActive(const NodeInfo& node, int field);

/// Whether a field takes no event now, since its node is active (ISO/IEC 14772-1, 6.28 and 6.50).
/// `active` may be empty: nothing is active then.
[[nodiscard]] bool isHeld(const Node& node, int field, double now, const ActiveNode& active);

/// Gives a field a value that comes to it as an event at `now` seconds of the scene, and keeps in
/// the node what its earlier value means for what is shown then. False where it takes none.
[[nodiscard]] bool giveEvent(Node& node, int field, const FieldValue& value, double now,
                             const ActiveNode& active);

/// A route or a part of one, as `TYPE.event TO TYPE.field`.
[[nodiscard]] std::string textOf(const Route& route);

/// Sends events along the routes of a scene: into fields, and through interpolators. Each route
/// works once for a time stamp, so that circles of routes end (ISO/IEC 14772-1, 4.10.4). Values of
/// another type than the field's, and interpolators with broken keys, are passed over.
class Events {
  public:
    /// Gives a field a value; false where it does not take it.
    using Give = std::function<bool(const NodePtr& node, int field, const FieldValue& value)>;
    /// `lost`: takes the text of each route that was to be followed and is not.
    Events(const Scene& scene, Give give, std::set<std::string>* lost = nullptr);

    /// The routes have one more, at their end.
    void addLast() { add(scene_.routes.size() - 1); }
    void nextStamp() { ++stamp_; }
    /// A node sends the value of a field, or an event. How many routes that took.
    std::size_t send(const NodePtr& node, std::string_view event, const FieldValue& value);
    /// A fraction comes to an interpolator; as send().
    std::size_t setFraction(const NodePtr& interpolator, float fraction);

  private:
    struct Sent {
        NodePtr node;
        std::string event;
        FieldValue value;
    };
    void add(std::size_t route);
    /// What a node sends on after what came to it.
    bool receive(const Route& route, const FieldValue& value, std::vector<Sent>& next);

    const Scene& scene_;
    Give give_;
    std::set<std::string>* lost_;
    std::uint64_t stamp_ = 1;
    std::vector<std::uint64_t> done_;  ///< the stamp at which each route has worked last
    std::unordered_map<const Node*, std::vector<std::size_t>> from_;
};

}  // namespace stx::mpeg4

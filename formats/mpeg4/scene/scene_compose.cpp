#include <algorithm>
#include <numeric>
#include <unordered_map>
#include <unordered_set>

#include "formats/mpeg4/scene/events.hpp"

// Commands applied to copies of their nodes.

namespace stx::mpeg4 {
namespace {

bool isNodes(const FieldValue& value) {
    return std::holds_alternative<NodePtr>(value) || std::holds_alternative<NodeList>(value);
}

/// Node visits that all commands together may cost, so that a small hostile file cannot keep us
/// busy: a scene of 10,000 nodes may be restructured some thousand times.
constexpr std::uint64_t kMaxVisits = 20'000'000;
/// Pointers that are compared in the time that a node is visited.
constexpr std::uint64_t kComparedPerVisit = 20;

class Composer {
  public:
    Composer(const ActiveNode& active, SceneInTime::Structure& structure)
        : active_(active), structure_(structure) {}

    /// Applies commands of the time `now` to what earlier calls left. `begin`: seconds that the
    /// times in their nodes count from.
    Result<void> run(std::vector<Command> commands, double now, double begin) {
        now_ = now;
        begin_ = begin;
        findActive(commands);
        copyAll(commands);
        for (Command& command : commands) {
            ++count_;
            STX_CHECK(within(fmt::format("command {}", count_),
                             std::visit([&](auto& c) { return apply(c); }, command)));
        }
        return {};
    }
    Scene& scene() { return scene_; }

  private:
    /// Which nodes are active before commands of one time change them: what makes a node active
    /// among these does so for them all.
    void findActive(const std::vector<Command>& commands) {
        wereActive_.clear();
        if (!active_) return;
        for (const Command& command : commands)
            if (const auto* c = std::get_if<ReplaceField>(&command);
                c != nullptr && c->target && isHeldWhileActive(*c->target->info, c->field))
                if (const auto copy = copies_.find(c->target.get());
                    copy != copies_.end() && active_(*copy->second, now_))
                    wereActive_.insert(copy->second.get());
    }

    // ---- copies

    void relink(NodePtr& node) const {
        if (node) node = copies_.at(node.get());
    }
    void relink(FieldValue& value) const {
        if (NodePtr* child = std::get_if<NodePtr>(&value)) relink(*child);
        if (NodeList* list = std::get_if<NodeList>(&value))
            for (NodePtr& child : *list) relink(child);
    }
    void relink(Route& route) const {
        relink(route.from);
        relink(route.to);
    }

    void copyAll(std::vector<Command>& commands) {
        std::vector<Node*> fresh;
        for (const Command& command : commands)
            walkNodes(command, [&](const NodePtr& node) {
                auto& copy = copies_[node.get()];
                if (copy) return false;  // so is all below it
                copy = std::make_shared<Node>(*node);
                shiftTimes(*copy, begin_);
                fresh.push_back(copy.get());
                return true;
            });
        for (Node* copy : fresh)
            for (Node::SetField& field : copy->setFields) relink(field.value);
        if (indexed_)
            for (Node* copy : fresh) indexChildren(copy);
        else
            nodes_.insert(nodes_.end(), fresh.begin(), fresh.end());
        for (Command& command : commands)
            std::visit(
                [&](auto& c) {
                    if constexpr (requires { c.target; }) relink(c.target);
                    if constexpr (requires { c.root; }) {
                        relink(c.root);
                        for (Route& r : c.routes) relink(r);
                    }
                    if constexpr (requires { c.replacement; }) relink(c.replacement);
                    if constexpr (requires { c.node; }) relink(c.node);
                    if constexpr (requires { c.value; }) relink(c.value);
                    if constexpr (requires { c.route; }) relink(c.route);
                },
                command);
    }

    // ---- checks

    Result<void> useBudget(std::uint64_t visits) {
        visits_ += visits;
        if (visits_ + compared_ / kComparedPerVisit > kMaxVisits)
            return fail(ErrorCode::unsupported,
                        "the commands restructure the scene too often (more than {} node visits)",
                        kMaxVisits);
        return {};
    }

    Result<std::unordered_set<const Node*>> below(const FieldValue& value) {
        std::unordered_set<const Node*> nodes;
        const auto collect = [&](const NodePtr& root) {
            forEachNode(root, [&](const NodePtr& node) { nodes.insert(node.get()); });
        };
        if (const NodePtr* node = std::get_if<NodePtr>(&value)) collect(*node);
        if (const NodeList* list = std::get_if<NodeList>(&value))
            for (const NodePtr& node : *list) collect(node);
        STX_CHECK(useBudget(nodes.size()));
        return nodes;
    }

    Result<void> checkNotInside(const NodePtr& target, const FieldValue& value) {
        STX_TRY(const auto nodes, below(value));
        if (nodes.contains(target.get()))
            return fail(ErrorCode::invalidInput,
                        "the value put into {} '{}' contains that node itself", target->info->name,
                        target->defName);
        return {};
    }

    static Result<void> checkField(const NodePtr& target, int field) {
        if (!target) return fail(ErrorCode::invalidInput, "the command has no target");
        if (field < 0 || field >= static_cast<int>(target->info->fields.size()) ||
            !target->info->fields[field].hasValue())
            return fail(ErrorCode::invalidInput, "{} has no field {} that holds a value",
                        target->info->name, field);
        return {};
    }

    // ---- where nodes are

    void indexChild(const NodePtr& child, Node* parent) {
        if (child) parents_[child.get()].push_back(parent);
    }
    void indexValue(const FieldValue& value, Node* parent) {
        if (const NodePtr* child = std::get_if<NodePtr>(&value)) indexChild(*child, parent);
        if (const NodeList* list = std::get_if<NodeList>(&value))
            for (const NodePtr& child : *list) indexChild(child, parent);
    }
    void indexChildren(Node* parent) {
        for (const Node::SetField& field : parent->setFields) indexValue(field.value, parent);
    }
    /// Remembers that nodes came into a field. Those that go are found out when they are asked for.
    void indexAdded(const FieldValue& value, Node* parent) {
        if (indexed_) indexValue(value, parent);
    }

    bool holds(const FieldValue& value, const Node* child) {
        const auto is = [&](const NodePtr& node) { return node.get() == child; };
        ++compared_;
        if (const NodePtr* node = std::get_if<NodePtr>(&value)) return is(*node);
        const NodeList* list = std::get_if<NodeList>(&value);
        if (list == nullptr) return false;
        const auto found = std::ranges::find_if(*list, is);
        compared_ += static_cast<std::uint64_t>(found - list->begin());
        return found != list->end();
    }

    /// The nodes that have `child` in a field, each once.
    const std::vector<Node*>& parentsOf(const Node* child) {
        if (!indexed_) {
            for (Node* node : nodes_) indexChildren(node);
            nodes_ = {};
            indexed_ = true;
        }
        std::vector<Node*>& parents = parents_[child];
        std::unordered_set<const Node*> seen;
        visits_ += parents.size();
        std::erase_if(parents, [&](const Node* parent) {
            return !seen.insert(parent).second ||
                   std::ranges::none_of(parent->setFields, [&](const Node::SetField& field) {
                       return holds(field.value, child);
                   });
        });
        return parents;
    }

    /// Whether the root leads to a node.
    Result<bool> isInScene(const Node* node) {
        std::vector<const Node*> open{node};
        std::unordered_set<const Node*> seen{node};
        while (!open.empty()) {
            const Node* next = open.back();
            open.pop_back();
            if (next == scene_.root.get()) return true;
            for (const Node* parent : parentsOf(next))
                if (seen.insert(parent).second) open.push_back(parent);
            STX_CHECK(useBudget(1));
        }
        return false;
    }

    // ---- what changed

    /// Notes that nodes came or went. `views`: whether a view or a part of one may be among them.
    void noteNodes(bool views) {
        scene_.restructured = true;
        if (views) ++structure_.views;
    }
    void noteRoutes() {
        ++structure_.routes;
        events_.reset();
    }

    /// Whether what is in a field of grouping nodes matters by the views in it alone; what is in
    /// all others may be part of a view.
    static bool isInSpace(Ndt type) { return type == Ndt::SF3DNode || type == Ndt::SF2DNode; }
    Result<bool> holdsViews(const FieldValue& value) {
        STX_TRY(const auto nodes, below(value));
        return std::ranges::any_of(nodes, [&](const Node* node) {
            return isDepthImage(*node) || (node->proto && holdsViews(*node->proto));
        });
    }
    bool holdsViews(const Proto& proto) {
        const auto known = protosWithViews_.try_emplace(&proto, false);
        bool& holds = known.first->second;
        if (known.second)
            forEachNodeOf(proto,
                          [&](const NodePtr& node) { holds = holds || isDepthImage(*node); });
        return holds;
    }

    // ---- events

    /// Gives a field a value that comes to it as an event. False where it takes none.
    bool give(const NodePtr& node, int field, const FieldValue& value) {
        if (!giveEvent(*node, field, value, now_, active_)) return false;
        scene_.changed.insert(node.get());
        // The copies of its body are others then.
        if (isNodes(value) || (node->proto && isOfMedia(*node, field))) noteNodes(true);
        return true;
    }
    bool giveByRoute(const NodePtr& node, int field, const FieldValue& value) {
        return !isHeld(*node, field, now_, active_) && give(node, field, value);
    }
    /// Follows the routes of an event that a command makes: `send` tells how many there were.
    template <class Send>
    Result<void> follow(const Send& send) {
        if (scene_.routes.empty()) return {};
        if (!events_) {
            events_.emplace(
                scene_,
                [this](const auto& node, int field, const auto& value) {
                    return giveByRoute(node, field, value);
                },
                &scene_.lostEvents);
            STX_CHECK(useBudget(scene_.routes.size()));
        }
        events_->nextStamp();
        return useBudget(send(*events_));
    }

    // ---- commands

    Result<void> apply(ReplaceScene& c) {
        noteNodes(true);
        noteRoutes();
        routed_.clear();
        for (const Route& route : c.routes) noteEnds(route);
        scene_.root = c.root;
        scene_.routes = c.routes;
        scene_.useNames = c.useNames;
        return {};
    }

    void noteEnds(const Route& route) {
        routed_.insert(route.from.get());
        routed_.insert(route.to.get());
    }

    /// Puts `replacement` wherever `target` is in the scene; null takes it out of lists.
    Result<void> exchange(const NodePtr& target, const NodePtr& replacement) {
        STX_TRY(const auto inside, below(replacement));
        std::vector<std::pair<Node*, int>> places;
        bool views = false;
        const std::vector<Node*> parents = parentsOf(target.get());
        for (Node* node : parents) {
            STX_TRY(const bool shown, isInScene(node));
            if (!shown) continue;
            for (const Node::SetField& field : node->setFields) {
                if (!holds(field.value, target.get())) continue;
                places.emplace_back(node, field.index);
                const FieldInfo& info = node->info->fields[field.index];
                if (inside.contains(node))
                    return fail(ErrorCode::invalidInput,
                                "the node that replaces {} '{}' contains its parent",
                                target->info->name, target->defName);
                if (!mayStandIn(replacement.get(), info.nodeType))
                    return fail(ErrorCode::invalidInput, "{} is not allowed in {}.{}",
                                replacement->info->name, node->info->name, info.name);
                views = views || !isInSpace(info.nodeType);
            }
        }
        if (!views) STX_SET(views, holdsViews(target));
        if (!views) STX_SET(views, holdsViews(replacement));
        if (scene_.root == target) {
            if (!mayStandIn(replacement.get(), Ndt::SFTopNode))
                return fail(ErrorCode::invalidInput, "{} may not be the root of a scene",
                            replacement->info->name);
            scene_.root = replacement;
            views = true;
        } else if (places.empty()) {
            return fail(ErrorCode::invalidInput,
                        "the command names {} '{}' (id {}), which is not in the scene",
                        target->info->name, target->defName, target->defId);
        }
        for (auto& [node, index] : places) {
            FieldValue& value = node->edit(index);
            if (NodePtr* child = std::get_if<NodePtr>(&value)) *child = replacement;
            if (NodeList* list = std::get_if<NodeList>(&value)) {
                compared_ += list->size();
                if (replacement)
                    std::replace(list->begin(), list->end(), target, replacement);
                else
                    std::erase(*list, target);
            }
            indexAdded(replacement, node);
        }
        noteNodes(views);
        exchangeInRoutes(target, replacement);
        return useBudget(0);
    }

    /// Routes stay where the new node has the same fields.
    void exchangeInRoutes(const NodePtr& target, const NodePtr& replacement) {
        if (routed_.erase(target.get()) == 0) return;
        const bool keeps = replacement && sameType(*replacement->info, *target->info);
        if (keeps) routed_.insert(replacement.get());
        compared_ += scene_.routes.size();
        std::erase_if(scene_.routes, [&](Route& r) {
            if (r.from != target && r.to != target) return false;
            if (!keeps) return true;
            if (r.from == target) r.from = replacement;
            if (r.to == target) r.to = replacement;
            return false;
        });
        noteRoutes();
    }

    Result<void> apply(ReplaceNode& c) { return exchange(c.target, c.replacement); }
    Result<void> apply(DeleteNode& c) { return exchange(c.target, nullptr); }

    Result<void> apply(ReplaceField& c) {
        // An event into the scene (addChildren, set_bind) leaves no value behind.
        if (c.target && c.field >= 0 && c.field < static_cast<int>(c.target->info->fields.size()) &&
            !c.target->info->fields[c.field].hasValue())
            return applyEvent(c);
        STX_CHECK(checkField(c.target, c.field));
        STX_CHECK(checkNotInside(c.target, c.value));
        // One that a command before this has stopped takes it.
        if (isHeldWhileActive(*c.target->info, c.field) && wereActive_.contains(c.target.get()) &&
            active_(*c.target, now_))
            return {};
        if (double* time = std::get_if<double>(&c.value);
            time != nullptr && isMoment(*c.target, c.field))
            *time += begin_;
        const std::string& name = c.target->info->fields[c.field].name;
        if (!give(c.target, c.field, c.value))
            return fail(ErrorCode::invalidInput, "{}.{} does not take this value",
                        c.target->info->name, name);
        indexAdded(c.value, c.target.get());
        return follow([&](Events& events) { return events.send(c.target, name, c.value); });
    }

    Result<void> applyEvent(ReplaceField& c) {
        const std::string& event = c.target->info->fields[c.field].name;
        const int children = c.target->info->find("children");
        const NodeList* nodes = std::get_if<NodeList>(&c.value);
        const float* fraction = std::get_if<float>(&c.value);
        if (children >= 0 && nodes != nullptr && event == "addChildren") {
            STX_CHECK(checkNotInside(c.target, c.value));
            NodeList& list = std::get<NodeList>(c.target->edit(children));
            list.insert(list.end(), nodes->begin(), nodes->end());
            indexAdded(c.value, c.target.get());
            noteNodes(true);
        } else if (children >= 0 && nodes != nullptr && event == "removeChildren") {
            std::erase_if(std::get<NodeList>(c.target->edit(children)), [&](const NodePtr& node) {
                return std::find(nodes->begin(), nodes->end(), node) != nodes->end();
            });
            noteNodes(true);
        } else if (fraction != nullptr && event == "set_fraction" && isInterpolator(*c.target)) {
            return follow([&](Events& events) { return events.setFraction(c.target, *fraction); });
        } else {
            scene_.lostEvents.insert(fmt::format("{}.{}", c.target->info->name, event));
        }
        return {};
    }

    Result<void> apply(InsertNode& c) {
        const int field = c.target ? c.target->info->find("children") : -1;
        if (field < 0)
            return fail(ErrorCode::invalidInput,
                        "a node is inserted into one that has no children");
        return change(c.target, field, c.position, FieldValue(c.node), Change::insert);
    }
    Result<void> apply(InsertIndexed& c) {
        return change(c.target, c.field, c.position, c.value, Change::insert);
    }
    Result<void> apply(ReplaceIndexed& c) {
        return change(c.target, c.field, c.position, c.value, Change::replace);
    }
    Result<void> apply(DeleteIndexed& c) {
        return change(c.target, c.field, c.position, FieldValue(false), Change::remove);
    }

    enum class Change { insert, replace, remove };

    Result<void> change(const NodePtr& target, int field, Position position, const FieldValue& item,
                        Change what) {
        STX_CHECK(checkField(target, field));
        STX_CHECK(checkNotInside(target, item));
        const FieldInfo& info = target->info->fields[field];
        if (!isMultiple(info.type) ||
            (what != Change::remove && typeOf(item) != itemType(info.type)))
            return fail(ErrorCode::invalidInput, "{}.{} is {}, which does not take this item",
                        target->info->name, info.name, name(info.type));
        if (const NodePtr* node = std::get_if<NodePtr>(&item);
            node && !mayStandIn(node->get(), info.nodeType))
            return fail(ErrorCode::invalidInput, "{} is not allowed in {}.{}", (*node)->info->name,
                        target->info->name, info.name);
        FieldValue gone;
        auto done = std::visit(
            [&](auto& list) -> Result<void> {
                if constexpr (kIsList<std::decay_t<decltype(list)>>) {
                    using Item = typename std::decay_t<decltype(list)>::value_type;
                    const auto size = static_cast<std::int64_t>(list.size());
                    const std::int64_t last = what == Change::insert ? size : size - 1;
                    const std::int64_t at =
                        position.index == Position::kLast ? last : position.index;
                    if (at < 0 || at > last)
                        return fail(ErrorCode::invalidInput,
                                    "index {} is outside {}.{}, which has {} items", at,
                                    target->info->name, info.name, size);
                    if constexpr (std::is_same_v<Item, NodePtr>)
                        if (what != Change::insert) gone = list[at];
                    // Those behind it are moved.
                    if (what != Change::replace) compared_ += static_cast<std::uint64_t>(size - at);
                    if (what == Change::remove)
                        list.erase(list.begin() + at);
                    else if (what == Change::insert)
                        list.insert(list.begin() + at, std::get<Item>(item));
                    else
                        list[at] = std::get<Item>(item);
                }
                return {};
            },
            target->edit(field));
        STX_CHECK(done);
        STX_CHECK(useBudget(0));
        scene_.changed.insert(target.get());
        if (!isNodes(item) && !isNodes(gone)) return {};
        indexAdded(item, target.get());
        bool views = !isInSpace(info.nodeType);
        if (!views) STX_SET(views, holdsViews(gone));
        if (!views) STX_SET(views, holdsViews(item));
        noteNodes(views);
        return {};
    }

    Result<void> apply(InsertRoute& c) {
        STX_CHECK(useBudget(1));
        ++structure_.routes;
        noteEnds(c.route);
        scene_.routes.push_back(c.route);
        if (events_) events_->addLast();
        return {};
    }
    Result<void> apply(DeleteRoute& c) {
        STX_CHECK(useBudget(scene_.routes.size()));
        noteRoutes();
        std::erase_if(scene_.routes, [&](const Route& r) { return r.id == c.routeId; });
        return {};
    }
    Result<void> apply(ReplaceRoute& c) {
        STX_CHECK(useBudget(scene_.routes.size()));
        noteRoutes();
        noteEnds(c.route);
        for (Route& route : scene_.routes)
            if (route.id == c.routeId) route = c.route;
        return {};
    }

    Scene scene_;
    std::unordered_map<const Node*, NodePtr> copies_;
    std::vector<Node*> nodes_;  ///< all copies, as they came, until they are indexed
    bool indexed_ = false;      ///< scenes of which no node is exchanged never are
    /// The nodes that have one in a field, and some that had it there.
    std::unordered_map<const Node*, std::vector<Node*>> parents_;
    std::unordered_set<const Node*> routed_;  ///< ends of routes, and some that were
    std::unordered_map<const Proto*, bool> protosWithViews_;
    std::optional<Events> events_;  ///< of the routes, where a command has made some
    std::uint64_t visits_ = 0, compared_ = 0;
    std::size_t count_ = 0;  ///< of commands
    double now_ = 0, begin_ = 0;
    const ActiveNode& active_;
    SceneInTime::Structure& structure_;
    std::unordered_set<const Node*> wereActive_;
};

}  // namespace

Result<Scene> composeScene(const std::vector<CommandFrame>& frames, std::uint64_t until) {
    SceneInTime moments(frames);
    STX_TRY(Scene * scene, moments.at(until));
    return std::move(*scene);
}

struct SceneInTime::Impl {
    const std::vector<CommandFrame>& frames;
    std::uint32_t timescale;
    bool timesFromStart;
    ActiveNode active;
    std::vector<std::size_t> order;  ///< of frames, by time
    std::size_t next = 0;            ///< in order
    Structure structure;
    std::unique_ptr<Composer> composer;
};

SceneInTime::SceneInTime(const std::vector<CommandFrame>& frames, std::uint32_t timescale,
                         bool timesFromStart, ActiveNode active)
    : impl_(std::make_unique<Impl>(
          Impl{frames, timescale, timesFromStart, std::move(active), {}, 0, {}, nullptr})) {
    impl_->order.resize(frames.size());
    std::iota(impl_->order.begin(), impl_->order.end(), std::size_t{0});
    std::ranges::stable_sort(impl_->order, {}, [&](std::size_t i) { return frames[i].time; });
}
SceneInTime::SceneInTime(SceneInTime&&) noexcept = default;
SceneInTime& SceneInTime::operator=(SceneInTime&&) noexcept = default;
SceneInTime::~SceneInTime() = default;

void SceneInTime::restart() {
    impl_->composer.reset();
    impl_->next = 0;
}

std::optional<std::uint64_t> SceneInTime::next() const {
    if (impl_->next >= impl_->order.size()) return {};
    return impl_->frames[impl_->order[impl_->next]].time;
}

SceneInTime::Structure SceneInTime::structure() const {
    return impl_->structure;
}

Result<Scene*> SceneInTime::at(std::uint64_t until) {
    Impl& i = *impl_;
    const bool back = i.next > 0 && i.frames[i.order[i.next - 1]].time > until;
    if (!i.composer || back) {
        i.composer = std::make_unique<Composer>(i.active, i.structure);
        i.next = 0;
        ++i.structure.views;
        ++i.structure.routes;
    }
    for (; i.next < i.order.size() && i.frames[i.order[i.next]].time <= until; ++i.next) {
        const CommandFrame& frame = i.frames[i.order[i.next]];
        const double now = i.timescale == 0 ? 0 : static_cast<double>(frame.time) / i.timescale;
        if (auto done = i.composer->run(frame.commands, now, i.timesFromStart ? 0 : now); !done) {
            restart();
            return tl::unexpected(done.error());
        }
    }
    return &i.composer->scene();
}

}  // namespace stx::mpeg4

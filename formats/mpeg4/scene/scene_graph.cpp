#include <algorithm>
#include <cstring>
#include <set>
#include <unordered_map>
#include <unordered_set>

#include "formats/mpeg4/scene/scene.hpp"

// Walking, copying and numbering. Nothing here recurses: graphs may be deep.

namespace stx::mpeg4 {
namespace {

/// Whether the walk goes on below a node.
using Visit = std::function<bool(const NodePtr&)>;
using VisitAll = std::function<void(const NodePtr&)>;

/// Calls `take` with each node of a value, NULLs included.
template <class Take>
void eachChild(const FieldValue& value, const Take& take) {
    if (const NodePtr* node = std::get_if<NodePtr>(&value)) take(*node);
    if (const NodeList* list = std::get_if<NodeList>(&value))
        for (const NodePtr& node : *list) take(node);
}

template <class Take>
void eachChild(const Node& node, const Take& take) {
    for (const Node::SetField& field : node.setFields) eachChild(field.value, take);
}

/// Calls `take` with the nodes that a command names directly, in the order they are coded.
template <class Take>
void eachRoot(const Command& command, const Take& take) {
    const auto route = [&](const Route& r) {
        take(r.from);
        take(r.to);
    };
    std::visit(
        [&](const auto& c) {
            if constexpr (requires { c.target; }) take(c.target);
            if constexpr (requires { c.root; }) {
                take(c.root);
                for (const Route& r : c.routes) route(r);
            }
            if constexpr (requires { c.replacement; }) take(c.replacement);
            if constexpr (requires { c.node; }) take(c.node);
            if constexpr (requires { c.value; }) eachChild(c.value, take);
            if constexpr (requires { c.route; }) route(c.route);
        },
        command);
}

class Walk {
  public:
    explicit Walk(const Visit& visit) : visit_(visit) {}

    void from(const NodePtr& root) {
        push(root);
        while (!stack_.empty()) {
            const NodePtr* node = stack_.back();
            stack_.pop_back();
            if (!seen_.insert(node->get()).second) continue;
            if (!visit_(*node)) continue;
            // Reversed, so that the first child is on top of the stack.
            const std::size_t bottom = stack_.size();
            eachChild(**node, [&](const NodePtr& child) { push(child); });
            std::reverse(stack_.begin() + static_cast<std::ptrdiff_t>(bottom), stack_.end());
        }
    }

  private:
    void push(const NodePtr& node) {
        if (node && !seen_.contains(node.get())) stack_.push_back(&node);
    }

    const Visit& visit_;
    std::vector<const NodePtr*> stack_;
    std::unordered_set<const Node*> seen_;
};

template <class T>
bool sameBits(const T& a, const T& b) {
    if constexpr (std::is_same_v<T, float> || std::is_same_v<T, double> ||
                  std::is_same_v<T, glm::vec2> || std::is_same_v<T, glm::vec3> ||
                  std::is_same_v<T, glm::vec4> || std::is_same_v<T, Color> ||
                  std::is_same_v<T, Rotation>) {
        // -0 and NaN count as what they are.
        // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison)
        return std::memcmp(&a, &b, sizeof(T)) == 0;
    } else {
        return a == b;
    }
}

template <class T>
bool sameBits(const std::vector<T>& a, const std::vector<T>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](const T& x, const T& y) { return sameBits(x, y); });
}

}  // namespace

namespace {

void walkAll(const std::vector<CommandFrame>& frames, const Visit& visit) {
    Walk walk(visit);
    for (const CommandFrame& frame : frames)
        for (const Command& command : frame.commands)
            eachRoot(command, [&](const NodePtr& root) { walk.from(root); });
}

Visit andAllBelow(const VisitAll& visit) {
    return [&visit](const NodePtr& node) {
        visit(node);
        return true;
    };
}

}  // namespace

void forEachNode(const NodePtr& root, const VisitAll& visit) {
    const Visit each = andAllBelow(visit);
    Walk(each).from(root);
}

void forEachNode(const Command& command, const VisitAll& visit) {
    walkNodes(command, andAllBelow(visit));
}

void forEachNode(const std::vector<CommandFrame>& frames, const VisitAll& visit) {
    walkAll(frames, andAllBelow(visit));
}

void walkNodes(const Command& command, const Visit& visit) {
    Walk walk(visit);
    eachRoot(command, [&](const NodePtr& root) { walk.from(root); });
}

void walkNodes(const NodePtr& root, const Visit& visit) {
    Walk(visit).from(root);
}

bool sameValue(const FieldValue& a, const FieldValue& b) {
    if (a.index() != b.index()) return false;
    return std::visit(
        [&](const auto& x) {
            using T = std::decay_t<decltype(x)>;
            if constexpr (std::is_same_v<T, NodePtr> || std::is_same_v<T, NodeList>)
                return true;
            else
                return sameBits(x, std::get<T>(b));
        },
        a);
}

Result<int> nestingDepth(const NodePtr& root) {
    // Post-order: a node is met once to open it (depth 0 in the map) and once more to close it.
    std::unordered_map<const Node*, int> depths;
    std::vector<const Node*> stack;
    if (root) stack.push_back(root.get());
    int deepest = 0;
    while (!stack.empty()) {
        const Node* node = stack.back();
        const auto [entry, fresh] = depths.emplace(node, 0);
        if (fresh) {
            bool cyclic = false;
            eachChild(*node, [&](const NodePtr& child) {
                if (!child) return;
                const auto known = depths.find(child.get());
                if (known == depths.end())
                    stack.push_back(child.get());
                else if (known->second == 0)
                    cyclic = true;
            });
            if (cyclic)
                return fail(ErrorCode::invalidInput, "a node inside {} '{}' is that node itself",
                            node->info->name, node->defName);
            continue;
        }
        stack.pop_back();
        if (entry->second != 0) continue;  // reached a second time before it was opened
        int below = 0;
        bool cyclic = false;
        eachChild(*node, [&](const NodePtr& child) {
            if (!child) return;
            const int depth = depths.at(child.get());
            cyclic |= depth == 0;
            below = std::max(below, depth);
        });
        if (cyclic)
            return fail(ErrorCode::invalidInput, "{} '{}' contains itself", node->info->name,
                        node->defName);
        depths[node] = below + 1;
        deepest = std::max(deepest, below + 1);
    }
    return deepest;
}

namespace {

/// Copies of all nodes below `root`, by their originals, linked like these.
std::unordered_map<const Node*, NodePtr> copiesOf(const NodePtr& root) {
    std::unordered_map<const Node*, NodePtr> copies;
    forEachNode(root,
                [&](const NodePtr& n) { copies.emplace(n.get(), std::make_shared<Node>(*n)); });
    const auto relink = [&](NodePtr& n) {
        if (n) n = copies.at(n.get());
    };
    for (auto& [original, copy] : copies)
        for (Node::SetField& field : copy->setFields) {
            if (NodePtr* child = std::get_if<NodePtr>(&field.value)) relink(*child);
            if (NodeList* list = std::get_if<NodeList>(&field.value))
                for (NodePtr& child : *list) relink(child);
        }
    return copies;
}

}  // namespace

namespace {

/// Whether a field is of a kind, or, of an instance, gives one of that kind its value.
template <class Is>
bool isOrGives(const Node& node, int field, const Is& is) {
    using Field = std::pair<const Node*, int>;
    std::vector<Field> open{{&node, field}};
    std::set<Field> seen;
    while (!open.empty()) {
        const auto [next, index] = open.back();
        open.pop_back();
        if (!next->proto) {
            if (is(*next, next->info->fields[index])) return true;
            continue;
        }
        for (const Proto::Link& link : next->proto->links)
            if (link.protoField == index && seen.emplace(link.node.get(), link.field).second)
                open.emplace_back(link.node.get(), link.field);
    }
    return false;
}

}  // namespace

bool isMoment(const Node& node, int field) {
    return node.info->fields[field].type == FieldType::SFTime &&
           isOrGives(node, field, [](const Node&, const FieldInfo& info) {
               return info.name == "startTime" || info.name == "stopTime";
           });
}

bool isLoop(const Node& node, int field) {
    return node.info->fields[field].type == FieldType::SFBool &&
           isOrGives(node, field,
                     [](const Node&, const FieldInfo& info) { return info.name == "loop"; });
}

bool isOfMedia(const Node& node, int field) {
    return isOrGives(node, field,
                     [](const Node& n, const FieldInfo&) { return n.info->find("url") >= 0; });
}

void forEachNodeOf(const Proto& proto, const VisitAll& visit) {
    std::vector<const Proto*> open{&proto};
    std::unordered_set<const Proto*> seen{&proto};
    while (!open.empty()) {
        const Proto& next = *open.back();
        open.pop_back();
        for (const NodePtr& node : next.body)
            forEachNode(node, [&](const NodePtr& inside) {
                visit(inside);
                if (inside->proto && seen.insert(inside->proto.get()).second)
                    open.push_back(inside->proto.get());
            });
    }
}

void shiftTimes(Node& node, double seconds) {
    if (seconds == 0) return;
    for (std::size_t i = 0; i < node.info->fields.size(); ++i) {
        const int field = static_cast<int>(i);
        if (isMoment(node, field) && node.info->fields[i].hasValue())
            std::get<double>(node.edit(field)) += seconds;
    }
    if (node.proto) node.begin = seconds;
}

NodeList bodyOf(const Node& instance, std::size_t& copied) {
    copied = 0;
    if (!instance.proto) return {};
    const Proto& proto = *instance.proto;
    const NodePtr holder = makeNode("Group");
    holder->set("children", proto.body);
    const auto copies = copiesOf(holder);
    copied = copies.size();
    for (const auto& [original, copy] : copies) {
        shiftTimes(*copy, instance.begin);
        copy->loopedUntil = instance.loopedUntil;
    }
    for (const Proto::Link& link : proto.links) {
        const auto found = copies.find(link.node.get());
        // A field of an event has no value to give.
        if (found != copies.end())
            (void)found->second->set(link.field, instance.value(link.protoField));
    }
    return copies.at(holder.get())->get<NodeList>("children");
}

namespace {

/// Nodes that are visited in the instances of PROTOs in all commands.
constexpr std::int64_t kMostInBodies = 1 << 21;

/// What an instance shows, which may be that of another one. The budget is below 0 where that does
/// not end.
NodePtr shownOf(const NodePtr& instance, std::int64_t& budget, NodeList& instances) {
    NodePtr shown = instance;
    while (shown && shown->proto && budget >= 0) {
        instances.push_back(shown);
        std::size_t copied = 0;
        const NodeList body = bodyOf(*shown, copied);
        budget -= static_cast<std::int64_t>(copied) + 1;
        shown = body.empty() ? nullptr : body.front();
    }
    return shown;
}

/// The nodes from which one of `below` can be reached.
std::unordered_set<const Node*> nodesAbove(const NodePtr& root, const NodeList& below) {
    std::unordered_map<const Node*, std::vector<const Node*>> parents;
    forEachNode(root, [&](const NodePtr& node) {
        eachChild(*node, [&](const NodePtr& child) { parents[child.get()].push_back(node.get()); });
    });
    std::vector<const Node*> open;
    for (const NodePtr& node : below) open.push_back(node.get());
    std::unordered_set<const Node*> above;
    while (!open.empty()) {
        const Node* node = open.back();
        open.pop_back();
        for (const Node* parent : parents[node])
            if (above.insert(parent).second) open.push_back(parent);
    }
    return above;
}

}  // namespace

NodePtr withoutInstances(NodePtr root, std::int64_t& budget, NodeList& instances) {
    if (root && root->proto) root = shownOf(root, budget, instances);
    // What an instance shows may have others in it.
    for (;;) {
        NodeList found;
        forEachNode(root, [&](const NodePtr& node) {
            --budget;
            if (node->proto) found.push_back(node);
        });
        if (budget < 0) return nullptr;
        if (found.empty()) return root;
        std::unordered_map<const Node*, NodePtr> inPlace;
        for (const NodePtr& node : found)
            inPlace.emplace(node.get(), shownOf(node, budget, instances));
        std::vector<NodePtr> copies;
        const auto above = nodesAbove(root, found);
        forEachNode(root, [&](const NodePtr& node) {
            if (node->proto || !above.contains(node.get())) return;
            inPlace.emplace(node.get(), copies.emplace_back(std::make_shared<Node>(*node)));
        });
        const auto exchange = [&](NodePtr& node) {
            if (const auto other = inPlace.find(node.get()); other != inPlace.end())
                node = other->second;
        };
        for (const NodePtr& copy : copies)
            for (Node::SetField& field : copy->setFields) {
                if (NodePtr* child = std::get_if<NodePtr>(&field.value)) exchange(*child);
                if (NodeList* list = std::get_if<NodeList>(&field.value)) {
                    for (NodePtr& child : *list) exchange(child);
                    std::erase(*list, nullptr);
                }
            }
        exchange(root);
    }
}

bool forEachNodeInside(const std::vector<CommandFrame>& frames, const VisitAll& visit) {
    std::int64_t budget = kMostInBodies;
    NodeList instances;
    const Visit each = [&](const NodePtr& node) {
        if (node->proto)
            instances.push_back(node);
        else
            visit(node);
        return !node->proto;
    };
    walkAll(frames, each);
    const Visit eachInBody = [&](const NodePtr& node) { return --budget >= 0 && each(node); };
    while (!instances.empty() && budget >= 0) {
        const NodePtr instance = std::move(instances.back());
        instances.pop_back();
        std::size_t copied = 0;
        const NodeList body = bodyOf(*instance, copied);
        Walk walk(eachInBody);
        for (const NodePtr& node : body) walk.from(node);
    }
    return budget >= 0;
}

namespace {

/// What the commands of a scene say about its nodes and routes, in the order in which they come.
struct Mentions {
    std::vector<const Node*> inOrder;
    std::unordered_map<const Node*, int> uses;
    std::unordered_set<const Node*> named;  ///< by a route or as a target
    /// A node that replaces another under its name takes its id, too, so that later commands find
    /// it: the other by the one.
    std::unordered_map<const Node*, const Node*> predecessors;
    std::vector<const Route*> routes;

    void add(const Command& command) {
        std::visit(
            [&](const auto& c) {
                if constexpr (requires { c.target; }) named.insert(c.target.get());
                if constexpr (requires { c.root; }) {
                    use(c.root);
                    if (c.root)
                        for (const Route& r : c.routes) routes.push_back(&r);
                }
                if constexpr (requires { c.route; }) routes.push_back(&c.route);
                if constexpr (requires { c.replacement; }) {
                    use(c.replacement);
                    if (c.replacement && c.target && c.target != c.replacement &&
                        !c.target->defName.empty() && c.target->defName == c.replacement->defName)
                        predecessors[c.replacement.get()] = c.target.get();
                }
                if constexpr (requires { c.node; }) use(c.node);
                if constexpr (requires { c.value; })
                    eachChild(c.value, [&](const NodePtr& n) { use(n); });
            },
            command);
    }

    void use(const NodePtr& node) {
        if (node) ++uses[node.get()];
    }

    [[nodiscard]] bool needsId(const Node* node) const {
        const auto used = uses.find(node);
        return !node->defName.empty() || (used != uses.end() && used->second > 1) ||
               named.contains(node);
    }
};

Mentions mentionsOf(const std::vector<CommandFrame>& frames) {
    Mentions m;
    const Visit visit = [&](const NodePtr& node) {
        m.inOrder.push_back(node.get());
        eachChild(*node, [&](const NodePtr& child) { m.use(child); });
        return true;
    };
    Walk walk(visit);
    for (const CommandFrame& frame : frames)
        for (const Command& command : frame.commands) {
            eachRoot(command, [&](const NodePtr& root) { walk.from(root); });
            m.add(command);
        }
    for (const Route* route : m.routes) {
        m.named.insert(route->from.get());
        m.named.insert(route->to.get());
    }
    return m;
}

/// Ids that nodes have already stay; others take the lowest that are free.
void numberNodes(const Mentions& m, NodeIds& ids) {
    std::unordered_set<std::uint32_t> taken;
    for (const Node* node : m.inOrder)
        if (node->defId != 0) {
            taken.insert(node->defId);
            ids.nodes.emplace(node, node->defId);
        }
    std::uint32_t next = 1;
    for (const Node* node : m.inOrder) {
        if (node->defId != 0 || !m.needsId(node)) continue;
        // Targets are walked before what replaces them.
        const auto before = m.predecessors.find(node);
        const auto known =
            before == m.predecessors.end() ? ids.nodes.end() : ids.nodes.find(before->second);
        if (known != ids.nodes.end()) {
            ids.nodes.emplace(node, known->second);
            continue;
        }
        while (taken.contains(next)) ++next;
        ids.nodes.emplace(node, next++);
    }
    for (const auto& [node, id] : ids.nodes) ids.highestNode = std::max(ids.highestNode, id);
}

/// The same for routes with names.
void numberRoutes(const std::vector<const Route*>& routes, NodeIds& ids) {
    std::unordered_set<std::uint32_t> taken;
    for (const Route* route : routes) {
        if (route->id == 0) continue;
        taken.insert(route->id);
        if (!route->name.empty()) ids.routesByName.emplace(route->name, route->id);
        ids.highestRoute = std::max(ids.highestRoute, route->id);
    }
    std::uint32_t next = 1;
    for (const Route* route : routes) {
        if (route->id != 0 || route->name.empty() || ids.routesByName.contains(route->name))
            continue;
        while (taken.contains(next)) ++next;
        ids.highestRoute = std::max(ids.highestRoute, next);
        ids.routesByName.emplace(route->name, next++);
    }
}

NodeIds nodeIdsOf(const std::vector<CommandFrame>& frames) {
    const Mentions m = mentionsOf(frames);
    NodeIds ids;
    numberNodes(m, ids);
    numberRoutes(m.routes, ids);
    return ids;
}

/// Gives ids to PROTOs and all in their bodies, and counts what their bodies need.
void addProtos(const std::vector<ProtoPtr>& protos, NodeIds& ids,
               std::unordered_set<std::uint32_t>& taken) {
    for (const ProtoPtr& proto : protos) {
        if (ids.protos.contains(proto.get())) continue;
        std::uint32_t id = proto->id;
        while (!taken.insert(id).second) ++id;
        ids.protos.emplace(proto.get(), id);
        ids.highestProto = std::max(ids.highestProto, id);
        const NodeIds body = idsOfBody(*proto);
        ids.highestNode = std::max(ids.highestNode, body.highestNode);
        ids.highestRoute = std::max(ids.highestRoute, body.highestRoute);
        addProtos(proto->protos, ids, taken);
    }
}

}  // namespace

NodeIds assignNodeIds(const std::vector<CommandFrame>& frames) {
    NodeIds ids = nodeIdsOf(frames);
    std::unordered_set<std::uint32_t> taken;
    for (const CommandFrame& frame : frames)
        for (const Command& command : frame.commands)
            if (const auto* scene = std::get_if<ReplaceScene>(&command))
                addProtos(scene->protos, ids, taken);
    return ids;
}

NodeIds idsOfBody(const Proto& proto) {
    const NodePtr holder = makeNode("Group");
    holder->set("children", proto.body);
    return nodeIdsOf({{0, {ReplaceScene{false, holder, proto.routes}}}});
}

}  // namespace stx::mpeg4

#include <algorithm>
#include <cstring>
#include <unordered_map>
#include <unordered_set>

#include "formats/mpeg4/scene/proto_links.hpp"
#include "formats/mpeg4/scene/scene.hpp"

// Walking, comparing, copying and numbering. Nothing here recurses: graphs may be deep.

namespace stx::mpeg4 {
namespace {

using Visit = std::function<void(const NodePtr&)>;

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
            visit_(*node);
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

/// Compares two sets of graphs pair by pair, remembering which node answers to which.
class GraphComparison {
  public:
    explicit GraphComparison(SameOptions options) : options_(options) {}

    bool nodes(const NodePtr& a, const NodePtr& b) {
        if (!pair(a, b)) return false;
        while (!open_.empty()) {
            const auto [x, y] = open_.back();
            open_.pop_back();
            if (!contents(*x, *y)) return false;
        }
        return true;
    }

    bool values(const FieldValue& a, const FieldValue& b) {
        if (!shallow(a, b)) return false;
        return nodes(nullptr, nullptr);
    }

    bool routes(const Route& a, const Route& b) {
        return (!options_.ids || a.id == b.id) && (!options_.names || a.name == b.name) &&
               a.fromField == b.fromField && a.toField == b.toField && nodes(a.from, b.from) &&
               nodes(a.to, b.to);
    }

    bool protos(const std::vector<ProtoPtr>& a, const std::vector<ProtoPtr>& b) {
        return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                          [&](const ProtoPtr& x, const ProtoPtr& y) { return proto(*x, *y); });
    }

  private:
    bool proto(const Proto& a, const Proto& b) {
        const auto nodesOf = [&](const NodePtr& x, const NodePtr& y) { return nodes(x, y); };
        const auto routesOf = [&](const Route& x, const Route& y) { return routes(x, y); };
        if ((options_.names && a.name != b.name) || a.type.fields.size() != b.type.fields.size() ||
            a.isExtern != b.isExtern || a.urls != b.urls || !protos(a.protos, b.protos))
            return false;
        for (std::size_t i = 0; i < a.type.fields.size(); ++i) {
            const FieldInfo& x = a.type.fields[i];
            const FieldInfo& y = b.type.fields[i];
            if (x.kind != y.kind || x.type != y.type || (options_.names && x.name != y.name) ||
                !values(defaultValue(a.type, x.index), defaultValue(b.type, y.index)))
                return false;
        }
        return std::equal(a.body.begin(), a.body.end(), b.body.begin(), b.body.end(), nodesOf) &&
               std::equal(a.routes.begin(), a.routes.end(), b.routes.begin(), b.routes.end(),
                          routesOf) &&
               sameLinks(a, b);
    }

    /// The nodes of the bodies answer to each other already; links may be in any order.
    bool sameLinks(const Proto& a, const Proto& b) const {
        if (a.links.size() != b.links.size()) return false;
        const ProtoLinks other = linksOf(b);
        return std::all_of(a.links.begin(), a.links.end(), [&](const Proto::Link& link) {
            const auto node = bOfA_.find(link.node.get());
            if (node == bOfA_.end()) return false;
            const auto& links = linksOf(other, *node->second);
            const auto found = links.find(link.field);
            return found != links.end() && found->second == link.protoField;
        });
    }

    bool pair(const NodePtr& a, const NodePtr& b) {
        if (!a || !b) return !a && !b;
        const auto [forth, fresh] = bOfA_.emplace(a.get(), b.get());
        const auto [back, freshBack] = aOfB_.emplace(b.get(), a.get());
        if (forth->second != b.get() || back->second != a.get()) return false;
        if (fresh) open_.emplace_back(a.get(), b.get());
        return true;
    }

    bool shallow(const FieldValue& a, const FieldValue& b) {
        if (a.index() != b.index()) return false;
        if (const NodePtr* node = std::get_if<NodePtr>(&a))
            return pair(*node, std::get<NodePtr>(b));
        if (const NodeList* list = std::get_if<NodeList>(&a)) {
            const NodeList& other = std::get<NodeList>(b);
            return std::equal(list->begin(), list->end(), other.begin(), other.end(),
                              [&](const NodePtr& x, const NodePtr& y) { return pair(x, y); });
        }
        return sameValue(a, b);
    }

    bool contents(const Node& a, const Node& b) {
        if (!sameType(*a.info, *b.info) || (options_.ids && a.defId != b.defId) ||
            (options_.names && a.defName != b.defName))
            return false;
        for (const FieldInfo& field : a.info->fields)
            if ((a.isSet(field.index) || b.isSet(field.index)) &&
                !shallow(a.value(field.index), b.value(field.index)))
                return false;
        return true;
    }

    SameOptions options_;
    std::unordered_map<const Node*, const Node*> bOfA_;
    std::unordered_map<const Node*, const Node*> aOfB_;
    std::vector<std::pair<const Node*, const Node*>> open_;
};

template <class C>
bool sameCommand(const C& a, const C& b, GraphComparison& compare, SameOptions options) {
    if constexpr (requires { a.target; })
        if (!compare.nodes(a.target, b.target)) return false;
    if constexpr (requires { a.field; })
        if (a.field != b.field) return false;
    if constexpr (requires { a.position; })
        if (a.position != b.position) return false;
    if constexpr (requires { a.routeId; })
        if (options.ids && a.routeId != b.routeId) return false;
    if constexpr (requires { a.root; }) {
        if (!compare.nodes(a.root, b.root) || a.routes.size() != b.routes.size()) return false;
        for (std::size_t i = 0; i < a.routes.size(); ++i)
            if (!compare.routes(a.routes[i], b.routes[i])) return false;
        if (options.names && a.useNames != b.useNames) return false;
        if (!compare.protos(a.protos, b.protos)) return false;
    }
    if constexpr (requires { a.replacement; })
        if (!compare.nodes(a.replacement, b.replacement)) return false;
    if constexpr (requires { a.node; })
        if (!compare.nodes(a.node, b.node)) return false;
    if constexpr (requires { a.value; })
        if (!compare.values(a.value, b.value)) return false;
    if constexpr (requires { a.route; })
        if (!compare.routes(a.route, b.route)) return false;
    return true;
}

}  // namespace

void forEachNode(const NodePtr& root, const Visit& visit) {
    Walk(visit).from(root);
}

void forEachNode(const Command& command, const Visit& visit) {
    Walk walk(visit);
    eachRoot(command, [&](const NodePtr& root) { walk.from(root); });
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

bool sameNode(const NodePtr& a, const NodePtr& b, SameOptions options) {
    return GraphComparison(options).nodes(a, b);
}

bool sameFrames(const std::vector<CommandFrame>& a, const std::vector<CommandFrame>& b,
                SameOptions options) {
    GraphComparison compare(options);
    if (a.size() != b.size()) return false;
    for (std::size_t i = 0; i < a.size(); ++i) {
        if (a[i].time != b[i].time || a[i].commands.size() != b[i].commands.size() ||
            a[i].coded != b[i].coded)
            return false;
        for (std::size_t k = 0; k < a[i].commands.size(); ++k) {
            const Command& x = a[i].commands[k];
            const Command& y = b[i].commands[k];
            if (x.index() != y.index()) return false;
            const bool same = std::visit(
                [&](const auto& c) {
                    return sameCommand(c, std::get<std::decay_t<decltype(c)>>(y), compare, options);
                },
                x);
            if (!same) return false;
        }
    }
    return true;
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

NodePtr bodyOf(const Node& instance, std::size_t& copied) {
    copied = 0;
    if (!instance.proto || instance.proto->body.empty()) return nullptr;
    const Proto& proto = *instance.proto;
    const NodePtr holder = makeNode("Group");
    holder->set("children", proto.body);
    const auto copies = copiesOf(holder);
    copied = copies.size();
    for (const Proto::Link& link : proto.links) {
        const auto found = copies.find(link.node.get());
        // A field of an event has no value to give.
        if (found != copies.end())
            (void)found->second->set(link.field, instance.value(link.protoField));
    }
    return copies.at(proto.body.front().get());
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
    const std::function<void(const NodePtr&)> visit = [&](const NodePtr& node) {
        m.inOrder.push_back(node.get());
        eachChild(*node, [&](const NodePtr& child) { m.use(child); });
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

#pragma once

#include <algorithm>
#include <unordered_map>
#include <utility>
#include <variant>
#include <vector>

#include "formats/mpeg4/scene/proto_links.hpp"
#include "formats/mpeg4/scene/scene.hpp"

/// Whether two scenes are the same. Nothing here recurses: graphs may be deep.
namespace stx::mpeg4 {

/// What else than types, sharing and values counts in a comparison.
struct SameOptions {
    bool ids = true;    ///< DEF ids of nodes and routes
    bool names = true;  ///< DEF names of nodes and routes
};

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

/// Whether two graphs are the same. Values are compared bit for bit; a field set to its default is
/// the same as one not set.
[[nodiscard]] inline bool sameNode(const NodePtr& a, const NodePtr& b, SameOptions options = {}) {
    return GraphComparison(options).nodes(a, b);
}

[[nodiscard]] inline bool sameFrames(const std::vector<CommandFrame>& a,
                                     const std::vector<CommandFrame>& b, SameOptions options = {}) {
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

}  // namespace stx::mpeg4

#pragma once

#include <map>
#include <unordered_map>

#include "formats/mpeg4/scene/scene.hpp"

namespace stx::mpeg4 {

/// The links of a PROTO by node: field of the node → field of the interface.
using ProtoLinks = std::unordered_map<const Node*, std::map<int, int>>;

[[nodiscard]] inline ProtoLinks linksOf(const Proto& proto) {
    ProtoLinks links;
    for (const Proto::Link& link : proto.links)
        links[link.node.get()][link.field] = link.protoField;
    return links;
}

/// The links of one node; none where there is no entry.
[[nodiscard]] inline const std::map<int, int>& linksOf(const ProtoLinks& links, const Node& node) {
    static const std::map<int, int> none;
    const auto found = links.find(&node);
    return found == links.end() ? none : found->second;
}

}  // namespace stx::mpeg4

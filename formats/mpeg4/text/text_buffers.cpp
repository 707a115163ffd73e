#include "formats/mpeg4/text/text_buffers.hpp"

#include <algorithm>
#include <map>

namespace stx::mpeg4 {
namespace {

/// Gives the nodes of `frames` the ids that they are coded with.
void keepIds(const std::vector<CommandFrame>& frames, const NodeIds& ids) {
    forEachNode(frames, [&](const NodePtr& node) {
        if (const auto id = ids.nodes.find(node.get()); id != ids.nodes.end())
            node->defId = id->second;
    });
}

/// The ids of a scene or of the body of a PROTO, of which buffers bring more.
struct BufferIds {
    NodeIds ids;

    void bring(const std::vector<NodePtr>& nodes, const std::vector<Command>& commands) {
        for (const NodePtr& node : nodes) {
            if (node->defId == 0) node->defId = ++ids.highestNode;
            ids.highestNode = std::max(ids.highestNode, node->defId);
            ids.nodes[node.get()] = node->defId;
        }
        const auto route = [&](const Route& r) {
            if (r.id == 0 && !r.name.empty() && !ids.routesByName.contains(r.name))
                ids.routesByName[r.name] = ++ids.highestRoute;
            ids.highestRoute = std::max(ids.highestRoute, r.id);
        };
        for (const Command& command : commands) {
            if (const auto* insert = std::get_if<InsertRoute>(&command)) route(insert->route);
            if (const auto* replace = std::get_if<ReplaceRoute>(&command))
                ids.highestRoute = std::max(ids.highestRoute, replace->routeId);
            if (const auto* erase = std::get_if<DeleteRoute>(&command))
                ids.highestRoute = std::max(ids.highestRoute, erase->routeId);
            if (const auto* scene = std::get_if<ReplaceScene>(&command))
                for (const Route& r : scene->routes) route(r);
        }
    }
};

}  // namespace

std::size_t TextBuffers::add(NodePtr node, int field, const Proto* proto) {
    Buffer buffer;
    buffer.node = std::move(node);
    buffer.field = field;
    buffer.proto = proto;
    buffers_.push_back(std::move(buffer));
    return last();
}

FieldValue TextBuffers::addValue(const Proto* proto) {
    const std::size_t number = add(nullptr, 0, proto);
    // Its number, until fill() puts the commands there.
    CommandBuffer stands;
    for (int i = 0; i < 8; ++i)
        stands.bytes.push_back(static_cast<std::uint8_t>(std::uint64_t{number} >> (8 * i)));
    return stands;
}

void TextBuffers::put(std::size_t number, std::vector<Command> commands, const NodeNames& names) {
    buffers_[number].commands = std::move(commands);
    buffers_[number].brought = names.named();
}

void TextBuffers::fill(std::vector<Command>& commands) const {
    for (Command& command : commands) {
        auto* replace = std::get_if<ReplaceField>(&command);
        auto* value = replace ? std::get_if<CommandBuffer>(&replace->value) : nullptr;
        if (value == nullptr || value->bytes.size() != 8) continue;
        std::uint64_t number = 0;
        for (int i = 0; i < 8; ++i) number |= std::uint64_t{value->bytes[i]} << (8 * i);
        *value = buffers_[number].coded;
    }
}

Result<void> TextBuffers::encode(Document& document) {
    if (buffers_.empty()) return {};
    std::map<const Proto*, BufferIds> scopes;
    NodeIds& all = (scopes[nullptr].ids = assignNodeIds(document.frames));
    keepIds(document.frames, all);
    for (const Buffer& buffer : buffers_) {
        const auto [scope, isNew] = scopes.try_emplace(buffer.proto);
        if (isNew) {
            scope->second.ids = idsOfBody(*buffer.proto);
            const NodePtr holder = makeNode("Group");
            holder->set("children", buffer.proto->body);
            keepIds({{0, {ReplaceScene{false, holder, buffer.proto->routes}}}}, scope->second.ids);
            scope->second.ids.protos = all.protos;
        }
        scope->second.bring(buffer.brought, buffer.commands);
    }
    for (const auto& [proto, scope] : scopes) {
        all.highestNode = std::max(all.highestNode, scope.ids.highestNode);
        all.highestRoute = std::max(all.highestRoute, scope.ids.highestRoute);
    }
    document.bifsConfig = fitBifsConfig(document.bifsConfig, all);
    bool useNames = false;
    for (const CommandFrame& frame : document.frames)
        for (const Command& command : frame.commands)
            if (const auto* scene = std::get_if<ReplaceScene>(&command))
                useNames = useNames || scene->useNames;
    std::map<const Proto*, BifsEncoder> encoders;
    for (const auto& [proto, scope] : scopes)
        encoders.try_emplace(proto, document.bifsConfig, BifsStyle::maskAndVector(), scope.ids);
    // Those that a buffer holds come behind it.
    for (auto buffer = buffers_.rbegin(); buffer != buffers_.rend(); ++buffer) {
        fill(buffer->commands);
        std::unordered_set<const Node*> brought;
        for (const NodePtr& node : buffer->brought) brought.insert(node.get());
        STX_TRY(buffer->coded,
                encoders.at(buffer->proto).encodeBuffer(buffer->commands, brought, useNames));
        if (buffer->node) buffer->node->set(buffer->field, buffer->coded);
    }
    for (CommandFrame& frame : document.frames) fill(frame.commands);
    return {};
}

}  // namespace stx::mpeg4

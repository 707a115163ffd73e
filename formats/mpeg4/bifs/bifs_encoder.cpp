#include "formats/mpeg4/bifs/bifs_writer.hpp"

namespace stx::mpeg4 {

/// The commands of access units (ISO/IEC 14496-11 clause 8).
struct BifsEncoder::Impl : BifsNodeWriter {
    using BifsNodeWriter::BifsNodeWriter;
    using BifsNodeWriter::write;

    // ---- commands

    void writePosition(Position position, int explicitBits) {
        if (position.index == Position::kLast) return out.write(3, 2);
        if (position.index == 0) return out.write(2, 2);
        out.write(0, 2);
        out.write(static_cast<std::uint32_t>(position.index), explicitBits);
    }
    static Result<void> checkPosition(Position position, int explicitBits) {
        if (position.index < Position::kLast || position.index >> explicitBits > 0)
            return error("position {} of a command has no code in {} bits", position.index,
                         explicitBits);
        return {};
    }

    Result<void> write(const ReplaceScene& c) {
        out.write(3, 2);
        out.write(0, 6);
        useNames = c.useNames;
        out.flag(useNames);
        written.clear();
        STX_CHECK(writeProtos(c.protos, 1));
        STX_CHECK(writeNode(c.root, Ndt::SFTopNode, 1));
        return writeRoutes(c.routes);
    }

    Result<void> write(const ReplaceNode& c) {
        out.write(2 << 2 | 0, 4);
        STX_CHECK(writeTarget(c.target));
        return writeNode(c.replacement, Ndt::SFWorldNode, 1);
    }
    Result<void> write(const ReplaceField& c) {
        out.write(2 << 2 | 1, 4);
        STX_CHECK(writeTarget(c.target));
        STX_CHECK(writeInField(*c.target, c.field));
        return writeField(c.target->info->fields[c.field], c.value, 1);
    }
    Result<void> write(const ReplaceRoute& c) {
        out.write(2 << 2 | 3, 4);
        STX_CHECK(writeRouteId(c.routeId));
        return writeEnds(c.route);
    }
    Result<void> write(const InsertNode& c) {
        out.write(0 << 2 | 0, 4);
        STX_CHECK(writeTarget(c.target));
        const int children = c.target->info->find("children");
        if (children < 0)
            return error("a node is inserted into {}, which has no children", c.target->info->name);
        if (!c.node) return error("NULL is inserted as a child");
        STX_CHECK(checkPosition(c.position, 8));
        writePosition(c.position, 8);
        return writeNode(c.node, c.target->info->fields[children].nodeType, 1);
    }
    Result<void> write(const InsertRoute& c) {
        out.write(0 << 2 | 3, 4);
        return writeRoute(c.route);
    }
    Result<void> write(const DeleteNode& c) {
        out.write(1 << 2 | 0, 4);
        return writeTarget(c.target);
    }
    Result<void> write(const DeleteRoute& c) {
        out.write(1 << 2 | 3, 4);
        return writeRouteId(c.routeId);
    }
    Result<void> write(const InsertIndexed& c) { return writeIndexed(c, 0); }
    Result<void> write(const ReplaceIndexed& c) { return writeIndexed(c, 2); }
    Result<void> write(const DeleteIndexed& c) { return writeIndexed(c, 1); }

    template <class C>
    Result<void> writeIndexed(const C& c, std::uint32_t kind) {
        out.write(kind << 2 | 2, 4);
        STX_CHECK(writeTarget(c.target));
        STX_CHECK(writeInField(*c.target, c.field));
        STX_CHECK(checkPosition(c.position, 16));
        writePosition(c.position, 16);
        const FieldInfo& field = c.target->info->fields[c.field];
        if (!isMultiple(field.type))
            return error("{}.{} is not a list", c.target->info->name, field.name);
        if constexpr (requires { c.value; }) {
            if (typeOf(c.value) != itemType(field.type))
                return error("an item of {}.{} is {}, but its value is {}", c.target->info->name,
                             field.name, name(itemType(field.type)), name(typeOf(c.value)));
            return std::visit(
                [&](const auto& v) -> Result<void> {
                    if constexpr (kIsList<std::decay_t<decltype(v)>>)
                        return {};
                    else
                        return writeItem(field, v, 1);
                },
                c.value);
        }
        return {};
    }

    Result<Bytes> encode(const std::vector<Command>& commands) {
        if (commands.empty()) return error("an access unit without commands");
        if (config.nodeIdBits > 31 || config.routeIdBits > 31 ||
            ids.highestNode > (std::uint64_t{1} << config.nodeIdBits) - 1)
            return error("node id {} does not fit into {} bits", ids.highestNode,
                         config.nodeIdBits);
        out = BitWriter();
        for (std::size_t i = 0; i < commands.size(); ++i) {
            definedNow.clear();
            STX_CHECK(std::visit([&](const auto& c) { return write(c); }, commands[i]));
            out.flag(i + 1 < commands.size());
        }
        return out.finish();
    }
};

BifsEncoder::BifsEncoder(BifsConfig config, BifsStyle style, NodeIds ids)
    : impl_(std::make_unique<Impl>(config, style, std::move(ids))) {}
BifsEncoder::~BifsEncoder() = default;
BifsEncoder::BifsEncoder(BifsEncoder&&) noexcept = default;

Result<Bytes> BifsEncoder::encode(const std::vector<Command>& commands) {
    return impl_->encode(commands);
}

double BifsEncoder::mostRounded() const {
    return impl_->mostRounded;
}

Result<CommandBuffer> BifsEncoder::encodeBuffer(const std::vector<Command>& commands,
                                                const std::unordered_set<const Node*>& brought,
                                                bool useNames) {
    CommandBuffer buffer;
    buffer.coding = codingOf(impl_->config, useNames);
    if (commands.empty()) return buffer;
    impl_->written.clear();
    impl_->brought = &brought;
    impl_->useNames = useNames;
    impl_->quantisation = {};
    auto bytes = impl_->encode(commands);
    impl_->brought = nullptr;
    if (!bytes) return propagate(bytes);
    const auto* first = reinterpret_cast<const std::uint8_t*>(bytes->data());
    buffer.bytes.assign(first, first + bytes->size());
    return buffer;
}

}  // namespace stx::mpeg4

#include <algorithm>
#include <bit>
#include <unordered_set>

#include "formats/mpeg4/bifs/bifs.hpp"
#include "formats/mpeg4/bifs/bifs_quantisation.hpp"
#include "formats/mpeg4/bifs/bit_stream.hpp"

namespace stx::mpeg4 {

struct BifsEncoder::Impl {
    Impl(BifsConfig c, BifsStyle s, NodeIds i) : config(c), style(s), ids(std::move(i)) {}

    BifsConfig config;
    BifsStyle style;
    NodeIds ids;
    std::unordered_map<std::uint32_t, const Node*> written;  ///< the node that has each id by now
    bool useNames = false;
    QuantisationScope quantisation;
    BitWriter out;
    int maxNesting = Limits().maxNesting;

    template <class... Args>
    static tl::unexpected<Error> error(fmt::format_string<Args...> format, Args&&... args) {
        return fail(ErrorCode::invalidInput, format, std::forward<Args>(args)...);
    }

    [[nodiscard]] std::uint32_t idOf(const Node& node) const {
        const auto found = ids.nodes.find(&node);
        return found == ids.nodes.end() ? 0 : found->second;
    }

    // ---- single values

    void writeFloat(float value) {
        if (quantisation.usesEfficientFloats())
            writeEfficientFloat(out, value);
        else
            out.write(std::bit_cast<std::uint32_t>(value), 32);
    }

    Result<void> writeString(const std::string& text) {
        const int bits = significantBits(text.size());
        if (bits > 31) return error("a string of {} bytes is too long for BIFS", text.size());
        out.write(static_cast<std::uint32_t>(bits), 5);
        out.write(static_cast<std::uint32_t>(text.size()), bits);
        for (const char c : text) out.write(static_cast<unsigned char>(c), 8);
        return {};
    }

    Result<void> writeName(const std::string& text) {
        if (text.find('\0') != std::string::npos)
            return error("the name '{}' contains a zero byte", text);
        for (const char c : text) out.write(static_cast<unsigned char>(c), 8);
        out.write(0, 8);
        return {};
    }

    using Coding = std::optional<QuantisedCoding>;

    Result<void> write(bool value, const Coding&) { return out.flag(value), Result<void>{}; }
    Result<void> write(std::int32_t value, const Coding& coding) {
        if (!coding) return out.write(static_cast<std::uint32_t>(value), 32), Result<void>{};
        const std::int64_t above =
            std::int64_t{value} - static_cast<std::int64_t>(coding->minimum[0]);
        if (above < 0 || above >> coding->bits != 0)
            return error(
                "the value {} does not fit into the {} bits that it has while a "
                "QuantizationParameter is active",
                value, coding->bits);
        return out.write(static_cast<std::uint32_t>(above), coding->bits), Result<void>{};
    }
    Result<void> write(float value, const Coding& coding) {
        if (coding)
            writeQuantised(out, *coding, 0, value);
        else
            writeFloat(value);
        return {};
    }
    Result<void> write(double value, const Coding&) {
        return out.write64(std::bit_cast<std::uint64_t>(value)), Result<void>{};
    }
    Result<void> write(const std::string& value, const Coding&) { return writeString(value); }
    Result<void> write(const Url& value, const Coding&) {
        if (value.objectDescriptorId < 0 || value.objectDescriptorId > 1023)
            return error("od:{} has no code in BIFS; object descriptor ids are 1 to 1022",
                         value.objectDescriptorId);
        out.flag(value.objectDescriptorId > 0);
        if (value.objectDescriptorId == 0) return writeString(value.text);
        out.write(static_cast<std::uint32_t>(value.objectDescriptorId), 10);
        return {};
    }
    Result<void> write(const glm::vec2& value, const Coding& coding) {
        for (int i = 0; i < 2; ++i) {
            if (coding)
                writeQuantised(out, *coding, i, value[i]);
            else
                writeFloat(value[i]);
        }
        return {};
    }
    Result<void> write(const glm::vec3& value, const Coding& coding) {
        if (coding && coding->kind == QuantisedCoding::Kind::normal) {
            writeQuantisedNormal(out, *coding, value);
            return {};
        }
        for (int i = 0; i < 3; ++i) {
            if (coding)
                writeQuantised(out, *coding, i, value[i]);
            else
                writeFloat(value[i]);
        }
        return {};
    }
    Result<void> write(const Color& value, const Coding& coding) {
        return write(glm::vec3(value.r, value.g, value.b), coding);
    }
    Result<void> write(const Rotation& value, const Coding& coding) {
        if (coding) {
            writeQuantisedRotation(out, *coding, value);
            return {};
        }
        for (int i = 0; i < 3; ++i) writeFloat(value.axis[i]);
        writeFloat(value.angle);
        return {};
    }
    Result<void> write(const glm::vec4& value, const Coding&) {
        for (int i = 0; i < 4; ++i) writeFloat(value[i]);
        return {};
    }
    Result<void> write(const CommandBuffer& value, const Coding&) {
        return writeString(std::string(value.bytes.begin(), value.bytes.end()));
    }
    Result<void> write(const ScriptText&, const Coding&) {
        return fail(ErrorCode::unsupported,
                    "the program of a Script cannot be written as BIFS; write a text (.bt, .xmt)");
    }
    Result<void> write(const AttributeReference&, const Coding&) {
        return fail(ErrorCode::unsupported, "a reference to a field cannot be written");
    }
    Result<void> write(const PixelImage& image, const Coding&) {
        if (image.width < 0 || image.width > 4095 || image.height < 0 || image.height > 4095)
            return error("an image of {}x{} has no code in BIFS; 4095x4095 is the largest",
                         image.width, image.height);
        const auto size = static_cast<std::size_t>(image.width) *
                          static_cast<std::size_t>(image.height) *
                          static_cast<std::size_t>(std::clamp(image.components, 1, 4));
        if (image.components < 1 || image.components > 4 || image.pixels.size() != size)
            return error("an image of {}x{} with {} components has {} bytes", image.width,
                         image.height, image.components, image.pixels.size());
        out.write(static_cast<std::uint32_t>(image.width), 12);
        out.write(static_cast<std::uint32_t>(image.height), 12);
        out.write(static_cast<std::uint32_t>(image.components - 1), 2);
        for (const std::uint8_t value : image.pixels) out.write(value, 8);
        return {};
    }

    // ---- fields

    // writeField comes after what it calls: clang 14 does not define templates that a generic
    // lambda needs before they were seen.
    template <class T>
    Result<void> writeItem(const FieldInfo& field, const T& value, int depth) {
        if constexpr (std::is_same_v<T, NodePtr>) {
            return writeNode(value, field.nodeType, depth + 1);
        } else {
            STX_TRY(const Coding coding, quantisation.codingOf(field));
            return write(value, coding);
        }
    }

    template <class T>
    Result<void> writeList(const FieldInfo& field, const std::vector<T>& items, int depth) {
        if (config.usePredictiveMFField) out.flag(false);
        out.flag(false);
        const int bits = significantBits(items.size());
        if (bits > 31) return error("{} has {} items, too many for BIFS", field.name, items.size());
        const bool asList =
            style.shorterOfMaskAndList && static_cast<std::size_t>(bits) + 5 > items.size() + 1;
        out.flag(asList);
        if (!asList) {
            out.write(static_cast<std::uint32_t>(bits), 5);
            out.write(static_cast<std::uint32_t>(items.size()), bits);
        }
        QuantisationScope::ListGuard guard(quantisation);
        for (const T& item : items) {
            if (asList) out.flag(false);
            if constexpr (std::is_same_v<T, NodePtr>)
                if (!item)
                    return error("{} has a NULL among its nodes, which BIFS cannot code",
                                 field.name);
            STX_CHECK(writeItem(field, item, depth));
            if constexpr (std::is_same_v<T, NodePtr>) guard.coded(item);
        }
        if (asList) out.flag(true);
        return {};
    }

    Result<void> writeField(const FieldInfo& field, const FieldValue& value, int depth) {
        if (typeOf(value) != field.type)
            return error("{} is {}, but its value is {}", field.name, name(field.type),
                         name(typeOf(value)));
        return std::visit(
            [&](const auto& v) -> Result<void> {
                using T = std::decay_t<decltype(v)>;
                if constexpr (kIsList<T>)
                    return writeList(field, v, depth);
                else
                    return writeItem(field, v, depth);
            },
            value);
    }

    // ---- nodes

    Result<void> writeNode(const NodePtr& node, Ndt expected, int depth) {
        if (depth > maxNesting) return error("nodes are nested more than {} deep", maxNesting);
        if (!node) {
            out.flag(true);
            out.write(~std::uint32_t{0}, config.nodeIdBits);
            return {};
        }
        const NodeCode* code = node->info->codeIn(expected);
        if (code == nullptr)
            return error("{} may not stand where {} is expected", node->info->name, name(expected));
        const std::uint32_t id = idOf(*node);
        if (id != 0) {
            const auto known = written.find(id);
            if (known != written.end() && known->second == node.get()) {
                out.flag(true);
                out.write(id - 1, config.nodeIdBits);
                return {};
            }
        }
        out.flag(false);
        for (int version = 1; version < code->version; ++version)
            out.write(0, *codeBits(expected, version));
        out.write(static_cast<std::uint32_t>(code->code), *codeBits(expected, code->version));
        out.flag(id != 0);
        if (id != 0) {
            if (!definedNow.insert(id).second)
                return error("node id {} stands for two nodes of one scene", id);
            out.write(id - 1, config.nodeIdBits);
            if (useNames) STX_CHECK(writeName(node->defName));
        }
        STX_CHECK(writeFields(*node, depth));
        if (id != 0) written[id] = node.get();
        return {};
    }

    /// The fields that are coded: the set ones, without NULLs and, where the style says so,
    /// defaults.
    std::vector<const Node::SetField*> fieldsToWrite(const Node& node) const {
        std::vector<const Node::SetField*> fields;
        for (const Node::SetField& set : node.setFields) {
            const NodePtr* child = std::get_if<NodePtr>(&set.value);
            if (child != nullptr && !*child) continue;
            const FieldValue& byDefault = defaultValue(*node.info, set.index);
            // Equal in bits, too: -0 is not left out for 0.
            if (style.omitDefaults && set.value == byDefault && sameValue(set.value, byDefault))
                continue;
            fields.push_back(&set);
        }
        return fields;
    }

    Result<void> writeFields(const Node& node, int depth) {
        const NodeInfo& info = *node.info;
        const std::vector<const Node::SetField*> fields = fieldsToWrite(node);
        const std::size_t listCost =
            1 + fields.size() * (1 + static_cast<std::size_t>(info.defBits));
        const bool asMask = !style.shorterOfMaskAndList || info.defFields.size() < listCost;
        out.flag(asMask);
        auto next = fields.begin();
        for (const int index : info.defFields) {
            const bool present = next != fields.end() && (*next)->index == index;
            const FieldInfo& field = info.fields[static_cast<std::size_t>(index)];
            if (asMask) {
                out.flag(present);
            } else if (present) {
                out.flag(false);
                out.write(static_cast<std::uint32_t>(field.defId), info.defBits);
            }
            if (!present) continue;
            auto done = writeField(field, (*next++)->value, depth);
            if (!done)
                return tl::unexpected(done.error().at(fmt::format("{}.{}", info.name, field.name)));
        }
        if (!asMask) out.flag(true);
        return {};
    }

    // ---- commands

    Result<void> writeTarget(const NodePtr& target) {
        if (!target) return error("a command or route names no node");
        const std::uint32_t id = idOf(*target);
        const auto known = written.find(id);
        if (id == 0 || known == written.end() || known->second != target.get())
            return error("a command or route names {} '{}', which is not in the scene by then",
                         target->info->name, target->defName);
        out.write(id - 1, config.nodeIdBits);
        return {};
    }

    Result<void> writeFieldId(const Node& node, int index, int FieldInfo::*mode, int bits,
                              std::string_view what) {
        const bool exists = index >= 0 && index < static_cast<int>(node.info->fields.size());
        const int id = exists ? node.info->fields[static_cast<std::size_t>(index)].*mode : -1;
        if (id < 0)
            return error("{}.{} cannot be {}; it has no id for that", node.info->name,
                         exists ? node.info->fields[static_cast<std::size_t>(index)].name : "?",
                         what);
        out.write(static_cast<std::uint32_t>(id), bits);
        return {};
    }
    Result<void> writeInField(const Node& node, int index) {
        return writeFieldId(node, index, &FieldInfo::inId, node.info->inBits,
                            "changed by a command or a route (replace the node instead)");
    }

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

    Result<void> writeEnds(const Route& route) {
        STX_CHECK(writeTarget(route.from));
        STX_CHECK(writeFieldId(*route.from, route.fromField, &FieldInfo::outId,
                               route.from->info->outBits, "the source of a route"));
        STX_CHECK(writeTarget(route.to));
        return writeInField(*route.to, route.toField);
    }

    Result<void> writeRoute(const Route& route) {
        std::uint32_t id = route.id;
        if (const auto named = ids.routesByName.find(route.name);
            id == 0 && named != ids.routesByName.end())
            id = named->second;
        out.flag(id != 0);
        if (id != 0) {
            STX_CHECK(writeRouteId(id));
            if (useNames) STX_CHECK(writeName(route.name));
        }
        return writeEnds(route);
    }

    Result<void> writeRouteId(std::uint32_t id) {
        if (id == 0 || (std::uint64_t{id} - 1) >> config.routeIdBits != 0)
            return error("route id {} does not fit into {} bits", id, config.routeIdBits);
        out.write(id - 1, config.routeIdBits);
        return {};
    }

    Result<void> write(const ReplaceScene& c) {
        out.write(3, 2);
        out.write(0, 6);
        useNames = c.useNames;
        out.flag(useNames);
        out.flag(false);  // no PROTOs
        written.clear();
        STX_CHECK(writeNode(c.root, Ndt::SFTopNode, 1));
        out.flag(!c.routes.empty());
        if (c.routes.empty()) return {};
        const int bits = significantBits(c.routes.size());
        const bool asList =
            style.shorterOfMaskAndList && static_cast<std::size_t>(bits) + 5 > c.routes.size() + 1;
        out.flag(asList);
        if (!asList) {
            out.write(static_cast<std::uint32_t>(bits), 5);
            out.write(static_cast<std::uint32_t>(c.routes.size()), bits);
        }
        for (std::size_t i = 0; i < c.routes.size(); ++i) {
            STX_CHECK(writeRoute(c.routes[i]));
            if (asList) out.flag(i + 1 < c.routes.size());
        }
        return {};
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
        return writeField(c.target->info->fields[static_cast<std::size_t>(c.field)], c.value, 1);
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
        return writeNode(c.node,
                         c.target->info->fields[static_cast<std::size_t>(children)].nodeType, 1);
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
        const FieldInfo& field = c.target->info->fields[static_cast<std::size_t>(c.field)];
        if (!isMultiple(field.type))
            return error("{}.{} is no list", c.target->info->name, field.name);
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

    /// Ids defined by the command that is being written.
    std::unordered_set<std::uint32_t> definedNow;

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

}  // namespace stx::mpeg4

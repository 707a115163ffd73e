#pragma once

#include <algorithm>
#include <unordered_map>
#include <unordered_set>

#include "formats/mpeg4/bifs/bifs.hpp"
#include "formats/mpeg4/bifs/bifs_quantisation.hpp"
#include "formats/mpeg4/bifs/bit_stream.hpp"
#include "formats/mpeg4/scene/proto_links.hpp"

namespace stx::mpeg4 {

/// Writes nodes, fields and values of BIFS (ISO/IEC 14496-11 clause 8): what the commands of access
/// units are made of. Remembers which node has which id from command to command.
struct BifsNodeWriter {
    BifsNodeWriter(BifsConfig c, BifsStyle s, NodeIds i) : config(c), style(s), ids(std::move(i)) {}

    BifsConfig config;
    BifsStyle style;
    NodeIds ids;
    std::unordered_map<std::uint32_t, const Node*> written;  ///< the node that has each id by now
    std::unordered_set<std::uint32_t> definedNow;  ///< ids defined by the command that is written
    /// Of a buffer of commands: nodes that come with it; all others are there by then.
    const std::unordered_set<const Node*>* brought = nullptr;
    const Proto* proto = nullptr;  ///< whose body is being written
    ProtoLinks links;              ///< of that PROTO
    bool useNames = false;
    QuantisationScope quantisation;
    double mostRounded = 0;  ///< BifsEncoder::mostRounded()
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

    /// Whether a node of this id is there already, so that it can be named.
    [[nodiscard]] bool isThere(const Node& node, std::uint32_t id) const {
        if (id == 0) return false;
        const auto known = written.find(id);
        if (known != written.end() && known->second == &node) return true;
        return brought != nullptr && !brought->contains(&node);
    }

    // ---- single values

    using Coding = std::optional<QuantisedCoding>;

    void writeFloat(float value);
    /// A value that is read back as another, or as the same.
    void addRounding(float value, float readBack);
    void addRounding(const Rotation& value, const Rotation& readBack);
    Result<void> writeComponent(const Coding& coding, int component, float value);
    Result<void> writeString(const std::string& text);
    Result<void> writeName(const std::string& text);
    Result<void> write(bool value, const Coding&);
    Result<void> write(std::int32_t value, const Coding& coding);
    Result<void> write(float value, const Coding& coding);
    Result<void> write(double value, const Coding&);
    Result<void> write(const std::string& value, const Coding&);
    Result<void> write(const Url& value, const Coding&);
    Result<void> write(const glm::vec2& value, const Coding& coding);
    Result<void> write(const glm::vec3& value, const Coding& coding);
    Result<void> write(const glm::vec4& value, const Coding&);
    Result<void> write(const Color& value, const Coding& coding);
    Result<void> write(const Rotation& value, const Coding& coding);
    Result<void> write(const CommandBuffer& value, const Coding&);
    Result<void> write(const ScriptText&, const Coding&);
    Result<void> write(const AttributeReference&, const Coding&);
    Result<void> write(const PixelImage& image, const Coding&);

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
        STX_TRY(const bool asList, beginList(field.name, items.size()));
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

    /// The head of a list: whether it is written item by item, and else its count.
    Result<bool> beginList(std::string_view name, std::size_t count) {
        if (config.usePredictiveMFField) out.flag(false);
        out.flag(false);
        const int bits = significantBits(count);
        if (bits > 31) return error("{} has {} items, too many for BIFS", name, count);
        const bool asList =
            style.shorterOfMaskAndList && static_cast<std::size_t>(bits) + 5 > count + 1;
        out.flag(asList);
        if (!asList) {
            out.write(static_cast<std::uint32_t>(bits), 5);
            out.write(static_cast<std::uint32_t>(count), bits);
        }
        return asList;
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

    Result<void> writeNode(const NodePtr& node, Ndt expected, int depth);
    Result<void> writeNodeCode(const Node& node, Ndt expected);

    /// The fields that are coded: the set ones, without NULLs and, where the style says so,
    /// defaults. Fields that a Script has of its own come with its program.
    [[nodiscard]] std::vector<Node::SetField> fieldsToWrite(const Node& node) const;
    Result<void> writeFields(const Node& node, int depth);
    Result<void> writeFieldOf(const Node& node, const Node::SetField& set, int depth);
    /// The same in the body of a PROTO, where all fields may be linked to those of the interface.
    Result<void> writeBodyFields(const Node& node, int depth);

    Result<void> writeScripts(const Node& node, const std::vector<ScriptText>& scripts, int depth);

    // ---- routes

    Result<void> writeTarget(const NodePtr& target);
    Result<void> writeFieldId(const Node& node, int index, int FieldInfo::*mode, int bits,
                              std::string_view what);
    Result<void> writeInField(const Node& node, int index);
    Result<void> writeEnds(const Route& route);
    Result<void> writeRouteId(std::uint32_t id);
    Result<void> writeRoute(const Route& route);
    /// All routes of a scene or a body.
    Result<void> writeRoutes(const std::vector<Route>& routes);

    // ---- PROTOs

    Result<void> writeProtos(const std::vector<ProtoPtr>& protos, int depth);
    Result<void> writeProto(const Proto& declared, int depth);
    Result<void> writeBody(const Proto& declared, int depth);
    Result<void> writeInterfaceQuantisation(const Proto& declared);
};

}  // namespace stx::mpeg4

#pragma once

#include <optional>
#include <unordered_map>

#include "formats/mpeg4/bifs/bifs.hpp"
#include "formats/mpeg4/bifs/bifs_quantisation.hpp"
#include "formats/mpeg4/bifs/bit_stream.hpp"

namespace stx::mpeg4 {

/// Nodes, fields and values of BIFS (ISO/IEC 14496-11 clause 8): what the commands of access units
/// are made of. Remembers which node has which id from command to command.
struct BifsNodeReader {
    BifsNodeReader(BifsConfig c, const Limits& l) : config(c), limits(l) {}

    /// The node that has an id. Height 0: the node is still being read, so a USE of it is a cycle.
    struct Defined {
        NodePtr node;
        int height = 0;
        std::uint64_t command = 0;
    };

    BifsConfig config;
    Limits limits;
    std::unordered_map<std::uint32_t, Defined> defined;
    /// What else can be named: the nodes around a buffer of commands.
    const BufferScene* around = nullptr;
    bool useNames = false;
    QuantisationScope quantisation;
    std::uint64_t command = 0;  ///< counts commands over all access units
    std::uint64_t memory = 0;   ///< an estimate of what the nodes hold
    std::size_t renamed = 0;    ///< names in Scripts that none can have
    BitReader in{ByteSpan{}};

    // ---- errors and budgets

    template <class... Args>
    tl::unexpected<Error> error(ErrorCode code, fmt::format_string<Args...> format,
                                Args&&... args) const {
        return failAt(fmt::format("bit {}", in.position()), code, format,
                      std::forward<Args>(args)...);
    }

    Result<void> check(std::string_view what) const {
        if (in.failed())
            return error(ErrorCode::invalidInput, "the access unit ends inside {}", what);
        return {};
    }

    Result<void> useBudget(std::uint64_t bytes) {
        memory += bytes;
        if (memory > limits.maxMemoryBytes)
            return error(ErrorCode::invalidInput,
                         "the scene needs more than the {} bytes that are allowed",
                         limits.maxMemoryBytes);
        return {};
    }

    // ---- single values

    float readFloat();
    glm::vec3 readVec3();

    Result<std::string> readString();

    Result<std::string> readName();

    Result<PixelImage> readImage();

    /// One value of the C++ type T.
    template <class T>
    Result<T> readItem(const std::optional<QuantisedCoding>& coding);

    /// The fewest bits that one item can take, so that a count is checked before memory is.
    std::uint64_t fewestBits(FieldType item, const std::optional<QuantisedCoding>& coding) const;

    // ---- fields

    Result<FieldValue> readField(const NodeInfo& node, const FieldInfo& field, int depth);

    /// One SF value, or one item of an MF field.
    Result<FieldValue> readSingle(const NodeInfo& node, const FieldInfo& field, int depth);

    template <class T>
    Result<T> located(Result<T> result) const {
        if (!result) return tl::unexpected(result.error().at(fmt::format("bit {}", in.position())));
        return result;
    }

    /// Calls `readOne` for each item of an MF field in either form.
    template <class ReadOne>
    Result<void> readEach(const NodeInfo& node, const FieldInfo& field, std::uint64_t fewest,
                          const ReadOne& readOne);

    template <class T>
    Result<void> readItems(const NodeInfo& node, const FieldInfo& field, std::vector<T>& items);

    Result<void> readNodes(const NodeInfo& node, const FieldInfo& field, NodeList& items,
                           int depth);

    Result<FieldValue> readList(const NodeInfo& node, const FieldInfo& field, int depth);

    // ---- nodes

    /// The height of the highest child that the fields read so far brought (see readNode).
    int deepest = 0;

    /// A node where `expected` is expected; null for NULL. `height` is how far it reaches down.
    Result<NodePtr> readNode(Ndt expected, int depth, int& height);

    /// Null: no node has this id.
    [[nodiscard]] NodePtr nodeOfId(std::uint32_t id, int& height) const;
    Result<NodePtr> readUse(Ndt expected, int depth, int& height);

    /// A node of the type that its code says.
    Result<NodePtr> readNodeCode(Ndt expected);

    Result<void> readFields(Node& node, int depth);
    /// Calls readOne(index) for each DEF field that a mask or a list has.
    template <class ReadOne>
    Result<void> readEachField(const NodeInfo& info, const ReadOne& readOne);

    Result<void> readInto(Node& node, int index, int depth);

    /// The programs of a Script, with the fields that it has of its own.
    Result<void> readScripts(Node& script, int index, int depth);
    Result<ScriptText> readScriptItem(Node& script, int depth);
    Result<std::string> readScriptField(Node& script, int depth);

    // ---- targets and routes

    Result<NodePtr> readTarget();
    Result<int> readFieldId(const NodeInfo& node, int bits, const std::vector<int>& fields,
                            std::string_view mode);
    Result<int> readInField(const Node& node) {
        return readFieldId(*node.info, node.info->inBits, node.info->inFields, "IN");
    }
    Result<void> readEnds(Route& route);
    Result<Route> readRoute();
    /// All routes of a scene or a body.
    Result<std::vector<Route>> readRoutes();

    // ---- PROTOs

    /// The declarations of the scene, and of the bodies around what is read, innermost last.
    std::vector<std::vector<ProtoPtr>> protoScopes = std::vector<std::vector<ProtoPtr>>(1);
    Proto* proto = nullptr;  ///< whose interface or body is being read
    std::size_t protoCount = 0;

    /// Adds declarations to the innermost scope.
    Result<void> readProtos(int depth);
    Result<ProtoPtr> readProto(int depth);
    Result<void> readInterface(Proto& declared, int depth);
    Result<void> readBody(Proto& declared, int depth);
    Result<void> readInterfaceQuantisation(Proto& declared);
    /// `IS`: the number of a field of the interface that `node`'s field is linked to.
    Result<void> readLink(const NodePtr& node, int field);
    Result<void> readBodyFields(const NodePtr& node, int depth);
};

template <class ReadOne>
Result<void> BifsNodeReader::readEachField(const NodeInfo& info, const ReadOne& readOne) {
    if (in.flag()) {
        for (const int index : info.defFields)
            if (in.flag()) STX_CHECK(readOne(index));
        return check(info.name);
    }
    while (!in.flag()) {
        if (in.failed() || info.defFields.empty()) break;
        const std::uint32_t id = in.read(info.defBits);
        STX_CHECK(check(info.name));
        if (id >= info.defFields.size())
            return error(ErrorCode::invalidInput, "{} has no field with DEF id {}", info.name, id);
        STX_CHECK(readOne(info.defFields[id]));
    }
    return check(info.name);
}

template <class ReadOne>
Result<void> BifsNodeReader::readEach(const NodeInfo& node, const FieldInfo& field,
                                      std::uint64_t fewest, const ReadOne& readOne) {
    const auto place = [&] { return fmt::format("{}.{}", node.name, field.name); };
    if (in.flag()) {
        while (!in.flag()) {
            if (in.failed()) break;
            STX_CHECK(readOne(0));
        }
        return check(place());
    }
    const int bits = static_cast<int>(in.read(5));
    const std::uint64_t count = in.read(bits);
    if (in.failed() || count * fewest > in.left())
        return error(ErrorCode::invalidInput,
                     "{} has {} items, which do not fit into the {} bits left", place(), count,
                     in.left());
    for (std::uint64_t i = 0; i < count; ++i) STX_CHECK(readOne(count - i));
    return check(place());
}

}  // namespace stx::mpeg4

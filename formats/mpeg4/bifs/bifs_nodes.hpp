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
    bool useNames = false;
    QuantisationScope quantisation;
    std::uint64_t command = 0;  ///< counts commands over all access units
    std::uint64_t memory = 0;   ///< an estimate of what the nodes hold
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

    Result<NodePtr> readUse(Ndt expected, int depth, int& height);

    Result<const NodeInfo*> readNodeCode(Ndt expected);

    Result<void> readFields(Node& node, int depth);

    Result<void> readInto(Node& node, int index, int depth);
};

}  // namespace stx::mpeg4

#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/files/no_case.hpp"
#include "formats/mpeg4/text/bt.hpp"
#include "formats/mpeg4/text/bt_lexer.hpp"
#include "formats/mpeg4/text/text_descriptors.hpp"
#include "formats/mpeg4/text/text_reader.hpp"
#include "formats/mpeg4/text/text_values.hpp"

namespace stx::mpeg4 {

/// Reads a BT document by descent, a token ahead. Structure, nodes and descriptors are in
/// bt_reader.cpp, the commands of `AT time { ... }` in bt_commands.cpp.
class BtReader : private TextReader {
  public:
    BtReader(std::string_view text, const std::string& fileName, Job& job)
        : TextReader(job), lexer_(text, fileName) {}

    Result<Document> read();

  private:
    // ---- Tokens
    tl::unexpected<Error> unexpected(std::string_view expected) {
        return failAt(lexer_.where(), ErrorCode::invalidInput, "found {}, expected {}",
                      lexer_.peek().describe(), expected);
    }
    bool isWord(std::string_view word) const {
        return lexer_.peek().kind == BtToken::Kind::word && equalNoCase(lexer_.peek().text, word);
    }
    Result<bool> takeIf(std::string_view word) {
        if (!isWord(word)) return false;
        STX_TRY([[maybe_unused]] const auto taken, lexer_.take());
        return true;
    }
    Result<void> take(BtToken::Kind kind, std::string_view expected) {
        if (lexer_.peek().kind != kind) return unexpected(expected);
        STX_TRY([[maybe_unused]] const auto taken, lexer_.take());
        return {};
    }
    Result<void> takeWord(std::string_view word) {
        STX_TRY(const bool taken, takeIf(word));
        if (!taken) return unexpected(fmt::format("{}", word));
        return {};
    }
    Result<std::string> takeName(std::string_view expected) {
        if (lexer_.peek().kind != BtToken::Kind::word) return unexpected(expected);
        STX_TRY(const auto token, lexer_.take());
        return std::string(token.text);
    }

    // ---- Structure
    Result<void> readTopLevel();

    Result<void> readTopNode(const std::string& defName, const std::string& where);

    Result<void> readSceneRoute(const std::string& defName);

    /// `A.x TO B.y`, with ROUTE already taken.
    Result<Route> readRoute(const std::string& defName);
    Result<void> readRouteEnd(NodePtr& node, int& field, FieldUse use);

    /// [RAP] AT time [IN stream] { commands }
    Result<void> readBlock();
    Result<void> readBlockCommands(std::uint64_t time);

    // ---- Commands
    Result<void> readCommand(std::uint64_t time);

    /// NODE, NODE.field or NODE.field[position], as the target of a command.
    struct Target {
        NodePtr node;
        int field = -1;
        std::optional<Position> position;
        std::string where;
    };
    Result<Target> readTarget();

    /// A value for a field that a command sets; one item of it when `item`.
    Result<FieldValue> readCommandValue(const Target& target, bool item);

    Result<void> readReplace(std::uint64_t time);

    Result<void> readInsert(std::uint64_t time, bool atEnd);

    Result<void> readDelete(std::uint64_t time);

    Result<std::uint32_t> readRouteName();

    // ---- Object descriptors
    Result<void> readOdUpdate(std::uint64_t time);
    Result<void> readOdRemove(std::uint64_t time);

    /// `Type { field value ... }`; values are words, strings, descriptors or lists of these.
    Result<TextDescriptor> readDescriptor(int depth);
    Result<void> readDescriptorValue(TextDescriptor& descriptor, const std::string& fieldName,
                                     const std::string& where, int depth);
    /// A descriptor that has no place in the document: passed over, and said.
    Result<void> skipBraces(const std::string& type, const std::string& where);

    Result<void> readDescriptors();

    // ---- Nodes
    /// NULL, USE name, or [DEF name] Type { ... }. With an owner, a USE of a name that comes later
    /// is remembered for its field; null is given then.
    Result<NodePtr> readNode(int depth, int& height, NodePtr owner, int field, int item);

    Result<NodePtr> readNodeBody(const std::string& defName, const std::string& where, int depth,
                                 int& height);

    // ---- PROTOs, and the fields of Scripts that are declared like theirs (bt_protos.cpp)
    /// The type of a name: that of a PROTO around here, else of the table. Null: there is none.
    NodePtr makeNamedNode(std::string_view type) const;
    [[nodiscard]] bool isDeclaration() const;
    /// `field SFInt32 size`, without a value.
    Result<FieldInfo> readDeclaration();
    /// Adds `eventIn SFBool start` to a Script; gives its index.
    Result<int> readOwnField(Node& script);
    /// PROTO or EXTERNPROTO with all that is in it, into the innermost scope.
    Result<void> readProto(int depth);
    Result<void> readInterface(Proto& proto, int depth);
    Result<void> readProtoBody(Proto& proto, int depth);
    /// `IS name`: links a field to one of the PROTO's interface.
    Result<void> readLink(const NodePtr& node, int field);
    /// The value of a field of any type; with an owner as readNode.
    Result<void> readValueInto(const NodePtr& node, int index, int depth, int& height);

    /// `{ REPLACE ... }`, passed over until the nodes that it may name are known.
    Result<void> passBuffer(std::size_t number);

    Result<void> readNodeList(const NodePtr& owner, int index, int depth, int& height, bool waits);

    struct OdUpdate {
        std::uint64_t time;
        std::vector<TextDescriptor> descriptors;
        RemoveObjectDescriptors remove;
        bool randomAccess;
    };

    BtLexer lexer_;
    std::optional<TextDescriptor> iod_;
    std::vector<OdUpdate> odUpdates_;
    std::uint64_t lastTime_ = 0;
    bool haveScene_ = false;
    bool rap_ = false;  ///< the block that is read is a place where a reader may begin
};

}  // namespace stx::mpeg4

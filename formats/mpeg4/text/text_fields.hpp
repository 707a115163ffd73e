#pragma once

#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "formats/mpeg4/scene/scene.hpp"
#include "formats/mpeg4/text/bt_lexer.hpp"
#include "lib/base/job.hpp"

/// What BT and XMT-A share: the spelling of field values, and the names of nodes.
namespace stx::mpeg4 {

/// Reads the value of a field that is not a node. In BT, `[` ... `]` holds the items of an MF field
/// and a single item may be without; in the attribute of XMT-A (`wholeText`) items run to the
/// end of the text and brackets are optional. Errors name the place, what was found and what is
/// expected.
[[nodiscard]] Result<FieldValue> readFieldValue(BtLexer& lexer, FieldType type, bool wholeText);

/// Spelling of values.
enum class TextStyle { bt, xmt };

/// Adds a value that holds no nodes: `1 2 3`, `[od:10 "a.png"]`. MF fields get brackets in BT only.
/// Values read back exactly with readFieldValue.
void appendFieldValue(std::string& out, const FieldValue& value, TextStyle style);

/// What a text has as the value of a field that holds no nodes: the value, but for
/// BitWrapper.buffer, whose bytes are "data:application/octet-string;base64,...".
[[nodiscard]] FieldValue toText(const NodeInfo& node, int field, const FieldValue& value);
/// The way back: of any "data:...;base64,". Nothing when it is not base64.
[[nodiscard]] std::optional<FieldValue> fromText(const NodeInfo& node, int field, FieldValue value);

/// The DEF name of a node in a text: its own, or `N<id-1>` when it has only an id. Empty: none.
[[nodiscard]] std::string textNameOf(const Node& node);
/// The same for routes, with R; a name that would be the number of another route is left out.
[[nodiscard]] std::string textNameOf(const Route& route);
/// The id of the name `N12`: 13; 0 for all other names.
[[nodiscard]] std::uint32_t idFromTextName(std::string_view name, char letter);
/// Whether a name can be written as a word of BT and as an attribute of XMT-A.
[[nodiscard]] bool isPlainName(std::string_view name);

/// The ROUTEs of a text by their DEF names, while it is read. Commands reach them by number in
/// BIFS, so those that commands name get one at the end.
class RouteNames {
  public:
    void define(const Route& route);
    /// A number for a command that names a route, to be its id until number() gives the final one.
    /// Errors when no route has the name.
    [[nodiscard]] Result<std::uint32_t> idOf(const std::string& name, const std::string& where);
    /// Gives each route that idOf() was asked for an id that no other route has.
    void number(std::vector<CommandFrame>& frames) const;

  private:
    std::map<std::string, std::uint32_t> ids_;  ///< 0: has a name only
    std::vector<std::string> reached_;
};

/// The nodes of a text by their DEF names, while it is read.
class NodeNames {
  public:
    explicit NodeNames(const Limits& limits) : limits_(&limits) {}

    /// Names inside of a buffer of commands. Its commands may also use the names that `outer` has
    /// by now; names that they give are known in the buffer alone.
    [[nodiscard]] static NodeNames inside(const NodeNames& outer) {
        NodeNames names = outer.ofBody();
        names.outer_ = &outer;
        return names;
    }
    /// Counts what a buffer named, too, once it has been read.
    void goOn(const NodeNames& buffer) {
        count_ = buffer.count_;
        nameCount_ += buffer.nameCount_;
    }
    /// The nodes that were named, in the order in which their texts end.
    [[nodiscard]] const std::vector<NodePtr>& named() const { return named_; }

    /// Names of a PROTO's body, which are apart, but count as part of the same text.
    [[nodiscard]] NodeNames ofBody() const {
        NodeNames names(*limits_);
        names.count_ = count_;
        names.time_ = time_;
        return names;
    }
    /// Says when what the text goes on with happens, ticks. Its times may go back.
    void goTo(std::uint64_t time) { time_ = time; }
    /// Counts what a body named, too, once it has been read.
    void countOn(const NodeNames& body) { count_ = body.count_; }

    /// DEF: from here on `node` is open until closed() is called with the height of its tree.
    /// Errors when the name is that of another node, unless `again`: commands may bring a node that
    /// takes over a name. Names like N12 become ids.
    [[nodiscard]] Result<void> define(const std::string& name, const NodePtr& node,
                                      const std::string& where, bool again);
    void closed(const NodePtr& node, int height);

    /// Texts write a node that replaces `m0` as `m0_2`, and the next as `m0_3`: other programs take
    /// a second DEF of one name for another node. Such a node has the name and the id of the one
    /// that it replaces, unless that is in it. `namedBefore`: how many named() there were before it
    /// was read.
    void succeed(const Node& target, const NodePtr& replacement, std::size_t namedBefore);

    /// USE of a name at a nesting depth. Null: not defined yet, call useLater(). Errors when the
    /// node is open (it would hold itself) or its tree would nest too deeply here. Gives the tree's
    /// height.
    [[nodiscard]] Result<NodePtr> use(const std::string& name, int depth, const std::string& where,
                                      int& height) const;
    /// Remembers that `owner`'s field (item `item` of a list, or -1) waits for a name.
    void useLater(std::string name, NodePtr owner, int field, int item, std::string where);

    /// The node of a name that a route or a command mentions. Errors when there is none at its
    /// time.
    [[nodiscard]] Result<NodePtr> target(const std::string& name, const std::string& where) const;

    /// Fills in what useLater() remembered. Errors when a name never came, its node may not be
    /// there, or nodes then hold themselves or nest too deeply.
    [[nodiscard]] Result<void> resolve();

    /// Errors when the nodes made so far are more than memory allows.
    [[nodiscard]] Result<void> countNode();
    /// Whether a DEF name was given that is not of the form N12.
    [[nodiscard]] bool anyNames() const { return nameCount_ > 0; }

  private:
    struct Entry {
        NodePtr node;
        std::string where;
        std::uint64_t time;
    };
    struct Pending {
        std::string name;
        NodePtr owner;
        int field;
        int item;
        std::string where;
    };
    Result<int> heightOf(const NodePtr& node, int depth,
                         std::unordered_map<const Node*, int>& known) const;

    /// The node that a DEF gave this name, in this scope or in one around it; null when there is
    /// none.
    [[nodiscard]] const Entry* find(const std::string& name) const;
    [[nodiscard]] std::optional<int> heightOfNamed(const Node& node) const;

    const Limits* limits_;
    const NodeNames* outer_ = nullptr;
    std::unordered_map<std::string, Entry> byName_;
    std::vector<NodePtr> named_;
    std::unordered_map<const Node*, int> heights_;  ///< of DEF'd nodes; absent while open
    std::vector<Pending> pending_;
    std::uint64_t time_ = 0;
    std::uint64_t count_ = 0;
    std::uint64_t nameCount_ = 0;  ///< DEF names that are not of the form N12
};

}  // namespace stx::mpeg4

#pragma once

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

/// The DEF name of a node in a text: its own, or `N<id-1>` when it has only an id. Empty: none.
[[nodiscard]] std::string textNameOf(const Node& node);
/// The same for routes, with R; a name that would be the number of another route is left out.
[[nodiscard]] std::string textNameOf(const Route& route);
/// The id of the name `N12`: 13; 0 for all other names.
[[nodiscard]] std::uint32_t idFromTextName(std::string_view name, char letter);
/// Whether a name can be written as a word of BT and as an attribute of XMT-A.
[[nodiscard]] bool isPlainName(std::string_view name);

/// The nodes of a text by their DEF names, while it is read.
class NodeNames {
  public:
    explicit NodeNames(const Limits& limits) : limits_(&limits) {}

    /// Names inside of a buffer of commands, which may use all of `outer`, too, as it is then. What
    /// is named in the buffer stays in it.
    [[nodiscard]] static NodeNames inside(const NodeNames& outer) {
        NodeNames names = outer.ofBody();
        names.outer_ = &outer;
        return names;
    }
    /// Goes on where the names of a buffer ended.
    void goOn(const NodeNames& buffer) {
        count_ = buffer.count_;
        anyNames_ = anyNames_ || buffer.anyNames_;
    }
    /// The nodes that were named, in the order in which they ended.
    [[nodiscard]] const std::vector<NodePtr>& named() const { return named_; }

    /// Names of a PROTO's body, which are apart, but count as part of the same text.
    [[nodiscard]] NodeNames ofBody() const {
        NodeNames names(*limits_);
        names.count_ = count_;
        return names;
    }
    /// Goes on counting where the names of a body ended.
    void countOn(const NodeNames& body) { count_ = body.count_; }

    /// DEF: from here on `node` is open until closed() is called with the height of its tree.
    /// Errors when the name is that of another node, unless `again`: commands may bring a node that
    /// takes over a name. Names like N12 become ids.
    [[nodiscard]] Result<void> define(const std::string& name, const NodePtr& node,
                                      const std::string& where, bool again);
    void closed(const NodePtr& node, int height);

    /// USE of a name at a nesting depth. Null: not defined yet, call useLater(). Errors when the
    /// node is open (it would hold itself) or its tree would nest too deeply here. Gives the tree's
    /// height.
    [[nodiscard]] Result<NodePtr> use(const std::string& name, int depth, const std::string& where,
                                      int& height) const;
    /// Remembers that `owner`'s field (item `item` of a list, or -1) waits for a name.
    void useLater(std::string name, NodePtr owner, int field, int item, std::string where);

    /// The node of a name that a route or a command mentions. Errors when there is none.
    [[nodiscard]] Result<NodePtr> target(const std::string& name, const std::string& where) const;

    /// Fills in what useLater() remembered. Errors when a name never came, its node may not be
    /// there, or nodes then hold themselves or nest too deeply.
    [[nodiscard]] Result<void> resolve();

    /// Errors when the nodes made so far are more than memory allows.
    [[nodiscard]] Result<void> countNode();
    /// Whether a DEF name was given that is not of the form N12.
    [[nodiscard]] bool anyNames() const { return anyNames_; }

  private:
    struct Entry {
        NodePtr node;
        std::string where;
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
    std::uint64_t count_ = 0;
    bool anyNames_ = false;
};

}  // namespace stx::mpeg4

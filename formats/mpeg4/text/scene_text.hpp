#pragma once

#include <string>
#include <unordered_map>
#include <unordered_set>

#include "formats/mpeg4/bifs/bifs.hpp"
#include "formats/mpeg4/scene/document.hpp"
#include "formats/mpeg4/scene/proto_links.hpp"
#include "formats/mpeg4/text/text_buffers.hpp"
#include "formats/mpeg4/text/text_fields.hpp"

/// Steps that the readers of BT and XMT-A share.
namespace stx::mpeg4 {

/// A node with this one field, to read a value into.
[[nodiscard]] NodePtr holderOf(FieldInfo field);

/// Adds a command to the frame of its time, keeping frames in order of time and commands of one
/// time in order of the text.
void addCommand(std::vector<CommandFrame>& frames, std::uint64_t time, Command command);
void addCommand(std::vector<OdFrame>& frames, std::uint64_t time, OdCommand command);

/// The field that a command, or one end of a ROUTE, names. Errors when the node has no such field
/// or it is not of the kind: a target of commands (`in`), the source (`out`) of a ROUTE.
enum class FieldUse { in, out };
[[nodiscard]] Result<int> fieldOfCommand(const Node& node, std::string_view fieldName, FieldUse use,
                                         const std::string& where);

/// Errors with where, the owner's field and what may be there when `child` may not.
[[nodiscard]] Result<void> checkNodePlace(const Node* child, Ndt expected, std::string_view owner,
                                          std::string_view fieldName, const std::string& where);

/// The commands at the time that the text is at, and a mark on them as a place where a reader may
/// begin.
template <class Frame>
[[nodiscard]] std::size_t commandsAt(const std::vector<Frame>& frames, std::uint64_t time) {
    return frames.empty() || frames.back().time != time ? 0 : frames.back().commands.size();
}
template <class Frame>
void markRandomAccess(std::vector<Frame>& frames, std::uint64_t time) {
    if (!frames.empty() && frames.back().time == time) frames.back().randomAccess = true;
}

/// Frames in the order of time, names resolved, streams and ids filled in as writers need them.
[[nodiscard]] Result<void> finishDocument(Document& document, NodeNames& names);

/// The DEF names that a writer gives: each node that has a name or id, or needs one, has one, and
/// no two nodes have the same.
class TextNames {
  public:
    /// Errors when nodes nest too deeply or contain themselves, or hold what texts cannot.
    [[nodiscard]] static Result<TextNames> make(const Document& document, const Limits& limits);

    /// The names in the body of a PROTO, which are apart from those of the scene.
    [[nodiscard]] static TextNames ofBody(const Proto& proto);

    /// The names in a buffer of commands: nodes of `outer` have theirs and are there already; nodes
    /// that the commands bring get one when they are first asked for. ROUTEs that `commands` bring
    /// and reach again have numbers for names: text has no other way in buffers.
    [[nodiscard]] static TextNames inside(const TextNames& outer,
                                          const std::vector<Command>& commands);
    /// The commands of a buffer in the scene that is being written.
    [[nodiscard]] Result<std::vector<Command>> commandsOf(const CommandBuffer& buffer) const;
    /// To be called before a scene is written (ReplaceScene), once for each.
    void beginScene();

    /// Null: the node has no name.
    [[nodiscard]] const std::string* find(const Node& node) const;
    /// Whether a node is met for the first time, and is written as DEF; later ones are USE.
    [[nodiscard]] bool firstTime(const Node& node);
    /// The DEF name of a ROUTE that is written now; empty: none.
    [[nodiscard]] std::string define(const Route& route);
    /// The name that a command reaches a ROUTE by.
    [[nodiscard]] std::string routeOf(std::uint32_t id) const;

  private:
    void nameAll(const std::vector<CommandFrame>& frames);
    [[nodiscard]] std::string uniqueName(std::string text) const;

    Limits limits_;
    const TextNames* outer_ = nullptr;
    mutable std::unordered_map<const Node*, std::string> names_;
    mutable std::unordered_map<std::string, int> taken_;
    /// For buffers: what each scene has, in order; empty for a presentation without buffers.
    std::vector<BufferScene> scenes_;
    std::size_t scene_ = 0;  ///< scenes begun
    std::unordered_set<const Node*> written_;
    std::unordered_map<std::uint32_t, std::string> routes_;  ///< names of those that were defined
    std::unordered_map<std::string, std::uint32_t> routeIds_;
    std::unordered_set<std::uint32_t> reached_;  ///< by commands of this buffer
};

/// Where a writer is: the names there, and the PROTO whose body it writes.
struct WritingScope {
    TextNames names;
    const Proto* proto = nullptr;
    ProtoLinks links;

    [[nodiscard]] static WritingScope ofBody(const Proto& proto) {
        return {TextNames::ofBody(proto), &proto, linksOf(proto)};
    }
    /// Of a buffer of commands; `outer` must stay where it is meanwhile.
    [[nodiscard]] static WritingScope inside(const WritingScope& outer,
                                             const std::vector<Command>& commands) {
        return {TextNames::inside(outer.names, commands), nullptr, {}};
    }
};

/// The commands of a buffer that is nested in `depth` others. Where they have no text they are left
/// out and `fits` says why, unless it does already for another.
[[nodiscard]] std::vector<Command> commandsToWrite(const TextNames& names,
                                                   const CommandBuffer& buffer, int depth,
                                                   Result<void>& fits);

}  // namespace stx::mpeg4

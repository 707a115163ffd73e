#pragma once

#include <string>

#include "formats/mpeg4/document.hpp"
#include "formats/mpeg4/text_fields.hpp"

/// Steps that the readers of BT and XMT-A share.
namespace stx::mpeg4 {

/// Adds a command to the frame of its time, keeping frames in order of time and commands of one time
/// in order of the text.
void addCommand(std::vector<CommandFrame>& frames, std::uint64_t time, Command command);
void addCommand(std::vector<OdFrame>& frames, std::uint64_t time, OdCommand command);

/// The field that a command, or one end of a ROUTE, names. Errors when the node has no such field or
/// it is not of the kind: a target of commands (`in`), the source (`out`) of a ROUTE.
enum class FieldUse { in, out };
[[nodiscard]] Result<int> fieldOfCommand(const Node& node, std::string_view fieldName, FieldUse use,
                                         const std::string& where);

/// Errors with where, the owner's field and what may stand there when `child` may not.
[[nodiscard]] Result<void> checkNodePlace(const Node* child, Ndt expected, std::string_view owner,
                                          std::string_view fieldName, const std::string& where);

/// What every text ends with: names resolved, streams and ids filled in as writers need them.
[[nodiscard]] Result<void> finishDocument(Document& document, NodeNames& names);

}  // namespace stx::mpeg4

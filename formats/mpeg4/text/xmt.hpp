#pragma once

#include <string>
#include <string_view>

#include "formats/mpeg4/scene/document.hpp"

/// XMT-A, the XML form of BIFS (ISO/IEC 14496-11, the clauses on XMT-A).
namespace stx::mpeg4 {

/// Reads a presentation: Header with InitialObjectDescriptor (may be missing), Body with Replace,
/// Insert, Delete, ObjectDescriptorUpdate and `par begin="seconds"`. The DEF name N12 is node
/// id 13. Streams get their file names, not their bytes: see loadMedia() in media_files.hpp. DTDs
/// are passed over: no entity but the five of XML is known, none is expanded. The encoding is
/// that of the byte order mark (UTF-8, UTF-16, UTF-32), or the one that is declared (UTF-8,
/// ISO-8859-1). `name` is for errors, which are at `'name':line:column`, columns being bytes of
/// UTF-8. Errors (invalidInput): XML that is not well-formed or not in its encoding, what the
/// schema or the node table does not have, with what was found and what expected; (unsupported)
/// another encoding.
[[nodiscard]] Result<Document> readXmt(std::string_view text, const std::string& name, Job& job);

/// The text of a presentation: well-formed XML in UTF-8; readXmt() gives it back, floats to the
/// bit. Errors (invalidInput) when nodes nest deeper than the job allows. Characters that XML
/// cannot hold are replaced, with a note.
[[nodiscard]] Result<std::string> writeXmt(const Document& document, Job& job);

}  // namespace stx::mpeg4

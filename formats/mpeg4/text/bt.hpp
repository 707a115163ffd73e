#pragma once

#include <string>
#include <string_view>

#include "formats/mpeg4/scene/document.hpp"

/// BT, the textual form of BIFS that the MPEG-4 community writes by hand (bifs.md section 6.1).
namespace stx::mpeg4 {

/// Reads a presentation: InitialObjectDescriptor (may be missing), scene, ROUTEs, `AT t { ... }`
/// blocks with commands and UPDATE OD / REMOVE OD. The words of descriptors and the names of fields
/// are taken in any case of letters. Times are ticks of the stream (milliseconds unless its
/// SLConfigDescriptor has another timeStampResolution). DEF names like N12 stand for node ids.
/// Streams get their file names, not their bytes: see loadMedia() in mpeg4.hpp.
/// `name` is for errors, which are at `'name':line:column`. Errors (invalidInput): what the syntax
/// or the node table does not have, with what was found and what expected; (unsupported) PROTO.
[[nodiscard]] Result<Document> readBt(std::string_view text, const std::string& name, Job& job);

/// The text of a presentation; readBt() gives it back, floats to the bit. Errors (invalidInput)
/// when nodes nest deeper than the job allows.
[[nodiscard]] Result<std::string> writeBt(const Document& document, Job& job);

}  // namespace stx::mpeg4

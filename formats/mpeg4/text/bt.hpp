#pragma once

#include <string>
#include <string_view>

#include "formats/mpeg4/scene/document.hpp"

/// BT, the textual form of BIFS that people write by hand. It is what the reference software
/// (ISO/IEC 14496-5) and GPAC read.
namespace stx::mpeg4 {

/// Reads a presentation: InitialObjectDescriptor (may be missing), scene, ROUTEs, `AT t { ... }`
/// blocks with commands and UPDATE OD / REMOVE OD. The words of descriptors and the names of fields
/// are taken in any case of letters. Times are ticks of the stream (milliseconds unless its
/// SLConfigDescriptor has another timeStampResolution). The DEF name N12 is node id 13.
/// Streams get their file names, not their bytes: see loadMedia() in media_files.hpp.
/// A byte order mark (UTF-8, UTF-16, UTF-32) tells the encoding. `name` is for errors, which are at
/// `'name':line:column`. Errors (invalidInput): what the syntax or the node table does not have,
/// with what was found and what expected; (unsupported) an interface with a field of a type that
/// none can have, a command to a ROUTE whose name is not R and a number.
[[nodiscard]] Result<Document> readBt(std::string_view text, const std::string& name, Job& job);

/// The text of a presentation; readBt() gives it back, floats to the bit. Errors (invalidInput)
/// when nodes nest deeper than the job allows.
[[nodiscard]] Result<std::string> writeBt(const Document& document, Job& job);

}  // namespace stx::mpeg4

#pragma once

#include <string>
#include <vector>

#include "formats/images/codec_table.hpp"
#include "lib/base/result.hpp"

namespace stx {

/// Where a module of ours may be: the file that the environment's `variable` names; else beside the
/// library or program that this is linked into, as loadCodecs() says.
[[nodiscard]] std::vector<std::string> placesOfModule(const char* variable, const char* module);

/// OpenImageIO's decoder and encoder; the first call loads the module and the eighty libraries
/// behind it (about 190 ms). Nothing that reads or writes PNG, JPEG or OpenEXR calls this. Looked
/// for at $STX_CODECS, else beside the library or program that this is linked into: in stx/ beside
/// lib/libstx.so, in
/// ../lib/stx beside bin/stx, and the same in the build tree. Error (unsupported) with every place
/// that was tried.
[[nodiscard]] Result<const codecs::Table*> loadCodecs();

}  // namespace stx

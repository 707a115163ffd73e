#pragma once

#include "formats/images/codec_table.hpp"
#include "lib/base/result.hpp"

namespace stx {

/// OpenImageIO's decoder; the first call loads the module and the eighty libraries behind it (about
/// 190 ms). Nothing that decodes PNG, JPEG or OpenEXR calls this. Looked for at $STX_CODECS, in
/// ../lib/stx beside the running program, then where it was installed and built. Error
/// (unsupported) with every place that was tried.
[[nodiscard]] Result<const codecs::Table*> loadCodecs();

}  // namespace stx

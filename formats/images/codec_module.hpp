#pragma once

#include "formats/images/codec_table.hpp"
#include "lib/base/result.hpp"

namespace stx {

/// OpenImageIO's encoder; the first call loads the module and the eighty libraries behind it (about
/// 190 ms). Nothing that reads, or writes PNG, JPEG or OpenEXR, calls this. Looked for at
/// $STX_CODECS first. Error (unsupported) with every place that was tried.
[[nodiscard]] Result<const codecs::Table*> loadCodecs();

}  // namespace stx

#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "lib/base/result.hpp"

namespace stx::mpeg4 {

/// The text of an XML file as UTF-8, where it is not already: by its byte order mark (UTF-8, UTF-16
/// and UTF-32), else by the encoding that it declares (ISO-8859-1). Errors with the place in
/// `fileName`: (unsupported) another encoding is declared; (invalidInput) bytes that are no UTF-8.
[[nodiscard]] Result<std::optional<std::string>> utf8FromXml(std::string_view xml,
                                                             const std::string& fileName);

}  // namespace stx::mpeg4

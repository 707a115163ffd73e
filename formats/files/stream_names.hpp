#pragma once

#include <filesystem>
#include <optional>

namespace stx {

/// The open descriptor of this process that a name leads to, by links, too: /dev/stdout,
/// /dev/stderr, /dev/fd/N and /proc/self/fd/N. Whether N is open is not looked at. Nothing of other
/// names.
[[nodiscard]] std::optional<int> descriptorNamed(const std::filesystem::path& path);

/// Whether bytes for that name go straight to where it leads, since there is nothing to rename: a
/// descriptor's name, or what is there and is neither a file nor a folder (a device, a pipe).
[[nodiscard]] bool isStream(const std::filesystem::path& path);

}  // namespace stx

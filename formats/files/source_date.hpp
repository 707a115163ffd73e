#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "lib/base/result.hpp"

namespace stx {

/// The moment that outputs may be stamped with: the seconds since 1970 in the environment variable
/// SOURCE_DATE_EPOCH (reproducible-builds.org/specs/source-date-epoch). Nothing without it, when it
/// is not a whole number, or behind the year 9999 (checkSourceDate()): then outputs carry no time,
/// so that the same input gives the same bytes.
[[nodiscard]] std::optional<std::uint64_t> sourceDate();

/// Error (usage) when SOURCE_DATE_EPOCH says something that sourceDate() cannot take.
[[nodiscard]] Result<void> checkSourceDate();

/// Seconds since 1970 as OpenEXR's capDate has them, in UTC: "1970:01:02 03:04:05".
[[nodiscard]] std::string exrDate(std::uint64_t seconds);

}  // namespace stx

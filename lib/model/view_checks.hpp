#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "lib/model/reference_view.hpp"

/// Rules that bundles and atlases share.
namespace stx {

struct Atlas;

/// Errors (invalidInput): a camera that fails check(), planes or depth bits that cannot be.
[[nodiscard]] Result<void> checkNumbers(const ViewHeader& view);

/// Errors (invalidInput): what a model's coordinates count from is not three finite numbers.
[[nodiscard]] Result<void> checkOrigin(const glm::dvec3& origin);

/// Pixels that are points. Errors (invalidInput): a depth that is NaN or below 0.
[[nodiscard]] Result<std::int64_t> countPoints(const Image<float>& depth);

/// Errors (invalidInput) when two of a model's views have one name. Several may have none: files
/// number these.
[[nodiscard]] Result<void> checkNames(const std::vector<std::string_view>& names);
/// Those of views, which must outlive this.
template <class Views>
[[nodiscard]] std::vector<std::string_view> viewNamesOf(const Views& views) {
    std::vector<std::string_view> names;
    for (const ViewHeader& view : views) names.push_back(view.name);
    return names;
}
/// The same of each model in an atlas whose objects are right (checkObjects()).
[[nodiscard]] Result<void> checkNames(const Atlas& atlas);

}  // namespace stx

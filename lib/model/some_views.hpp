#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "lib/model/view_table.hpp"

namespace stx {

/// Some views of a table, whose others are not read, by their numbers in it. What is said of all
/// (title, bounds, environment) stays. The table must outlive it.
[[nodiscard]] std::unique_ptr<ViewTable> someViewsOf(const ViewTable& table,
                                                     std::vector<std::size_t> numbers);

}  // namespace stx

#pragma once

#include <vector>

#include "lib/base/parallel.hpp"
#include "lib/base/result.hpp"

namespace stx {

/// As parallelFor(), of bodies that may fail: all run, and the error is that of the first by
/// number.
template <class Body>
[[nodiscard]] Result<void> parallelTry(std::int64_t begin, std::int64_t end, const Body& body) {
    std::vector<Result<void>> done(static_cast<std::size_t>(end > begin ? end - begin : 0));
    parallelFor(begin, end, [&](std::int64_t i) { done[i - begin] = body(i); });
    for (Result<void>& one : done) STX_CHECK(std::move(one));
    return {};
}

}  // namespace stx

#pragma once

#include <algorithm>
#include <cstddef>

namespace stx {

/// Calls call(x) for each value of a row that `test` is true of, from the left. Rows where few are
/// cost little.
template <class Row, class Test, class Call>
void forWhere(const Row& row, const Test& test, const Call& call) {
    constexpr std::size_t kAtOnce = 32;
    for (std::size_t first = 0; first < row.size(); first += kAtOnce) {
        const std::size_t end = std::min(row.size(), first + kAtOnce);
        // Without branches, so that compilers make vectors of it.
        unsigned any = 0;
        for (std::size_t x = first; x < end; ++x) any |= test(row[x]) ? 1u : 0u;
        if (!any) continue;
        for (std::size_t x = first; x < end; ++x)
            if (test(row[x])) call(static_cast<int>(x));
    }
}

}  // namespace stx

#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "lib/base/parallel.hpp"

namespace stx::behind {

/// Unknown values between known ones: the smoothest that fit, each the mean of its neighbours.
/// Solved by successive over-relaxation, the two colours of a chessboard in turn, so that any
/// number of threads gives the same bytes.
template <class Value>
struct Membrane {
    struct Unknown {
        std::array<std::int32_t, 4> to{-1, -1, -1, -1};  ///< unknown neighbours; -1: none
        Value known{};                                   ///< sum of known neighbours
        float count = 0;                                 ///< neighbours of both kinds
    };
    std::array<std::vector<std::int32_t>, 2> turn;  ///< numbers of the white and the black fields
    std::vector<Unknown> unknowns;
    std::vector<Value> values;  ///< the first guess, then what was found

    void add(const Unknown& unknown, const Value& guess, bool black) {
        turn[black].push_back(static_cast<std::int32_t>(unknowns.size()));
        unknowns.push_back(unknown);
        values.push_back(guess);
    }

    /// `relaxation`: 1 to below 2, the nearer to 2, the farther a round carries.
    void solve(int rounds, float relaxation) {
        constexpr std::int64_t kGrain = 1 << 13;
        for (int round = 0; round < 2 * rounds; ++round) {
            const auto& fields = turn[round % 2];
            parallelFor(0, fields.size(), kGrain, [&](std::size_t i) {
                const std::int32_t at = fields[i];
                const Unknown& u = unknowns[at];
                if (!(u.count > 0)) return;
                Value sum = u.known;
                for (const std::int32_t n : u.to)
                    if (n >= 0) sum += values[n];
                Value& value = values[at];
                value += relaxation * (sum / u.count - value);
            });
        }
    }
};

}  // namespace stx::behind

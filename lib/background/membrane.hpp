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

    /// `relaxation`: 1 to below 2, the nearer to 2, the farther a round carries. What no known
    /// value reaches keeps its first guess.
    void solve(int rounds, float relaxation) {
        leaveOutLoose();
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

  private:
    /// Unknowns that are linked to no known value, not even through others, have no solution of
    /// their own, and over-relaxation would carry them anywhere: they take no part.
    void leaveOutLoose() {
        // Who has an unknown as its k-th neighbour: one at most, since they are fields of a board.
        std::vector<std::array<std::int32_t, 4>> from(unknowns.size(), {-1, -1, -1, -1});
        std::vector<std::uint8_t> held(unknowns.size(), 0);
        std::vector<std::int32_t> next;
        for (std::size_t i = 0; i < unknowns.size(); ++i) {
            float links = 0;
            for (std::size_t k = 0; k < 4; ++k) {
                const std::int32_t to = unknowns[i].to[k];
                if (to < 0) continue;
                links += 1;
                from[static_cast<std::size_t>(to)][k] = static_cast<std::int32_t>(i);
            }
            if (!(unknowns[i].count > links)) continue;
            held[i] = 1;
            next.push_back(static_cast<std::int32_t>(i));
        }
        while (!next.empty()) {
            const auto at = static_cast<std::size_t>(next.back());
            next.pop_back();
            for (const std::int32_t n : from[at]) {
                if (n < 0 || held[static_cast<std::size_t>(n)]) continue;
                held[static_cast<std::size_t>(n)] = 1;
                next.push_back(n);
            }
        }
        for (std::size_t i = 0; i < unknowns.size(); ++i)
            if (!held[i]) unknowns[i].count = 0;
    }
};

}  // namespace stx::behind

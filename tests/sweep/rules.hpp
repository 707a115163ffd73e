#pragma once

#include <cmath>
#include <optional>
#include <vector>

#include "tests/sweep/pictures.hpp"

/// What a rule measured in a case: `amount()` must not be above `allowed`.
struct Measure {
    double found = 0;  ///< may be negative: by how much more than asked the rule holds
    std::string what;  ///< for people: what was compared, "normal 41.20 dB, splat 44.10 dB"
    /// The two must agree: better is a fault as much as worse.
    bool eitherWay = false;

    [[nodiscard]] double amount() const { return eitherWay ? std::abs(found) : found; }
};

/// Something that must hold for every case.
struct SweepRule {
    const char* name;
    const char* sentence;  ///< what must hold
    double allowed;        ///< the largest `found` that is no finding
    const char* unit;
    const char* reason;  ///< for the bound
    /// The share of cases that are asked.
    double share;
    /// Nothing where the rule says nothing about this case. Errors are findings, too.
    stx::Result<std::optional<Measure>> (*measure)(Pictures& pictures);
};

[[nodiscard]] const std::vector<SweepRule>& rules();

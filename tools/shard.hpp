#pragma once

#include <cstddef>
#include <cstdint>

#include <nlohmann/json_fwd.hpp>

#include "tools/command_line.hpp"

namespace stx::tools {

/// The part of a list or a sequence that one of several runs does (`--shard K/N`). The parts depend
/// on nothing but K, N and the length, so that runs on many machines need not speak to each other;
/// together they are the whole, and none has anything of another.
struct Shard {
    std::int64_t number = 1, count = 1;  ///< K and N, 1 <= K <= N
    /// The same for all runs of one command line on the same inputs, see Command::jobOf().
    std::string job;
    bool given = false;

    /// Makes the job that of these inputs, too: what a list holds may change between the runs.
    void addInputs(const std::vector<std::string>& names);

    /// Of lists: each N-th, since neighbours in a list are often alike and cost the same.
    [[nodiscard]] bool takes(std::size_t index) const {
        return static_cast<std::int64_t>(index) % count == number - 1;
    }
    /// Of sequences: [first, end), neighbours together, since they share what is read.
    struct Range {
        std::size_t first, end;
    };
    [[nodiscard]] Range rangeOf(std::size_t length) const;
};

/// Adds --shard K/N. `what`: "inputs".
void addShardOption(Command command, Shard& shard, const char* what);

/// {"number": K, "count": N, "total": length, "job": job}, for reports.
[[nodiscard]] nlohmann::ordered_json shardJson(const Shard& shard, std::size_t total);

}  // namespace stx::tools

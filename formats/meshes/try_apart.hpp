#pragma once

#include <functional>

#include "lib/base/job.hpp"

namespace stx {

/// Runs `work` in a process of its own (fork) to see whether it comes to an end: for parsers that
/// crash on damaged files. Nothing that it does there is seen here but its error, which is this
/// one's. Errors (invalidInput): it crashed, took more than two minutes of processor time or more
/// than limits.maxMemoryBytes beside what this process has, even if it catches that; (failed) no
/// process can be made. Safe to call from several threads, as
/// long as `work` takes no lock that another thread may hold (the C library sees to its own).
[[nodiscard]] Result<void> tryApart(const std::function<Result<void>()>& work,
                                    const Limits& limits);

}  // namespace stx

#pragma once

#include <atomic>

namespace stx::tools {

/// Makes SIGINT and SIGTERM set `cancelled`, so that the work stops at its next look, and ends the
/// process with exit code 130 or 143 when that takes longer than `patienceMs` or the signal comes
/// again; temporary files are removed first. `ulimit -f` (SIGXFSZ) becomes an error of writing.
/// Called once in each process, again after a fork(). False when no thread can be had for it: then
/// the signals end the process as they always do.
bool watchStopSignals(std::atomic<bool>& cancelled, int patienceMs = 700);

/// The signal that came, or 0.
[[nodiscard]] int stopSignal();

}  // namespace stx::tools

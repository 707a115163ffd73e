#pragma once

#include <ctime>

namespace stx {

/// Milliseconds that processors have worked so far, for all threads of this process or for this
/// one: unlike those on the wall they are the same however many threads share a piece of work.
[[nodiscard]] inline double processMilliseconds() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}
[[nodiscard]] inline double threadMilliseconds() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

}  // namespace stx

#pragma once

#include <sys/resource.h>

/// The most memory that this process has ever held, in MiB.
inline long peakMiB() {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss >> 10;
}

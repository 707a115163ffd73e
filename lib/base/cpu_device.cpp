#include "lib/base/cpu_device.hpp"

#include <cstring>

#include <fmt/format.h>
#include <hwy/highway.h>
#include <hwy/targets.h>

#if defined(__x86_64__)
#include <cpuid.h>
#endif

namespace stx {
namespace {

/// The target that Highway's dispatch takes: the best that is compiled in and supported.
const char* simdTarget() {
    const auto usable = hwy::SupportedTargets() & HWY_TARGETS;
    return hwy::TargetName(usable & -usable);
}

std::string processorName() {
#if defined(__x86_64__)
    unsigned words[12] = {};
    bool ok = true;
    for (unsigned i = 0; i < 3; ++i)
        ok = ok && __get_cpuid(0x80000002u + i, &words[4 * i], &words[4 * i + 1], &words[4 * i + 2],
                               &words[4 * i + 3]);
    if (ok) {
        char text[49] = {};
        std::memcpy(text, words, 48);
        std::string name = text;
        while (!name.empty() && name.back() == ' ') name.pop_back();
        return name;
    }
#endif
    return "CPU";
}

}  // namespace

std::string cpuDeviceName() {
    return fmt::format("{} ({})", processorName(), simdTarget());
}

}  // namespace stx

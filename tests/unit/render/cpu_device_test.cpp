// Reports name the processor, not the kind of vectors that it has.

#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "lib/base/cpu_device.hpp"

namespace stx {
namespace {

TEST(CpuDevice, IsTheProcessorsName) {
    std::ifstream file("/proc/cpuinfo");
    std::string line, model;
    bool isVirtual = false;
    while (std::getline(file, line)) {
        if (model.empty() && line.rfind("model name", 0) == 0)
            model = line.substr(line.find(':') + 2);
        isVirtual = isVirtual || line.find(" hypervisor") != std::string::npos;
    }
    while (!model.empty() && model.back() == ' ') model.pop_back();
    if (model.empty()) GTEST_SKIP() << "the system does not tell the processor's name";
    // The system keeps the name that it saw when it started.
    if (isVirtual && cpuDeviceName().find(model) == std::string::npos)
        GTEST_SKIP() << "a virtual machine that moved from '" << model << "' to '"
                     << cpuDeviceName() << "'";
    EXPECT_NE(cpuDeviceName().find(model), std::string::npos) << cpuDeviceName();
}

}  // namespace
}  // namespace stx

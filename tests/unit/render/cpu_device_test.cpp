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
    while (model.empty() && std::getline(file, line))
        if (line.rfind("model name", 0) == 0) model = line.substr(line.find(':') + 2);
    while (!model.empty() && model.back() == ' ') model.pop_back();
    if (model.empty()) GTEST_SKIP() << "the system does not tell the processor's name";
    EXPECT_NE(cpuDeviceName().find(model), std::string::npos) << cpuDeviceName();
}

}  // namespace
}  // namespace stx

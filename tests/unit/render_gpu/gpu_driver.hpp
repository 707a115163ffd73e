#pragma once

#include <string>

#include <gtest/gtest.h>

namespace stx::test {

/// What the environment's STX_TEST_DRIVER asks the tests to draw on: Mesa's "llvmpipe", "zink"
/// (over lavapipe) or "softpipe", "hardware", or "" for whatever is here.
[[nodiscard]] const std::string& askedDriver();

/// Why tests cannot draw on it.
struct DriverState {
    std::string missing;  ///< not installed, with the package that brings it
    std::string wrong;    ///< installed, and another driver answers, or none
};
[[nodiscard]] const DriverState& driverState();

}  // namespace stx::test

/// Skips with a line that names the package where the driver that is asked for is not installed;
/// fails where another one answers.
#define REQUIRE_GPU()                                                                              \
    do {                                                                                           \
        if (!::stx::test::driverState().wrong.empty()) FAIL() << ::stx::test::driverState().wrong; \
        if (!::stx::test::driverState().missing.empty())                                           \
            GTEST_SKIP() << ::stx::test::driverState().missing;                                    \
    } while (false)

/// For what only some devices have: skips on a device that was not chosen by name, fails on one
/// that was, since ctest asks only those drivers that have it.
#define REQUIRE_ABILITY(has, what)                                  \
    do {                                                            \
        if (!(has)) {                                               \
            if (const auto& asked = ::stx::test::askedDriver();     \
                !asked.empty() && asked != "hardware")              \
                FAIL() << asked << " has lost " << (what);          \
            GTEST_SKIP() << "this device does not have " << (what); \
        }                                                           \
    } while (false)

#pragma once

#include <cstdlib>
#include <filesystem>

#include <gtest/gtest.h>

/// The folder of real inputs beside the checkout (STX_SHARED_DIR in the environment wins).
inline std::filesystem::path sharedDir() {
    if (const char* dir = std::getenv("STX_SHARED_DIR")) return dir;
    return STX_SHARED_DIR;
}

/// Skips the test with a clear line when a shared file or folder is missing.
#define REQUIRE_SHARED(var, relative)                           \
    const std::filesystem::path var = sharedDir() / (relative); \
    if (!std::filesystem::exists(var))                          \
    GTEST_SKIP() << "needs " << var.string() << ", which is not here"

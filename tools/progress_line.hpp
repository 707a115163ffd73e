#pragma once

#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>

namespace stx::tools {

/// One line on a terminal that says how far the work is and how long it still takes: written over
/// itself, and gone before anything else is said. Safe to use from several threads.
class ProgressLine {
  public:
    /// "rendering 40/120, 12 s left", a few times a second. The time left is shown from the second
    /// second on, by the speed so far.
    void show(std::int64_t done, std::int64_t total, std::string_view what);
    /// Takes the line away, when there is one.
    void erase();
    /// Another process shows the line from here on: erase() takes away what that one shows.
    void leaveToParent(bool terminal);

  private:
    using Clock = std::chrono::steady_clock;
    std::mutex mutex_;
    bool shown_ = false, ofParent_ = false;
    std::string what_;
    std::int64_t firstDone_ = 0;
    Clock::time_point start_, lastShown_ = Clock::now();
};

}  // namespace stx::tools

#include "tools/progress_line.hpp"

#include <cmath>

#include <fmt/format.h>

#include "tools/program.hpp"
#include "tools/standard_streams.hpp"

namespace stx::tools {

void ProgressLine::show(std::int64_t done, std::int64_t total, std::string_view what) {
    const std::lock_guard lock(mutex_);
    const auto now = Clock::now();
    if (what != what_) {
        what_ = what;
        start_ = now;
        firstDone_ = done;
    }
    if (now - lastShown_ < std::chrono::milliseconds(200)) return;
    lastShown_ = now;
    shown_ = true;
    std::string left;
    const double elapsed = std::chrono::duration<double>(now - start_).count();
    if (elapsed > 1 && done > firstDone_ && done < total)
        left = fmt::format(", {} left",
                           humanSeconds(std::ceil(elapsed * static_cast<double>(total - done) /
                                                  static_cast<double>(done - firstDone_))));
    writeToStderr(fmt::format("\r\033[K{} {}/{}{}", what, done, total, left));
}

void ProgressLine::erase() {
    const std::lock_guard lock(mutex_);
    if (shown_ || ofParent_) writeToStderr("\r\033[K");
    shown_ = false;
}

void ProgressLine::leaveToParent(bool terminal) {
    const std::lock_guard lock(mutex_);
    shown_ = false;
    ofParent_ = terminal;
}

}  // namespace stx::tools

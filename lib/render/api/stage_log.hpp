#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "lib/base/cpu_clock.hpp"
#include "lib/base/image.hpp"

#include <glm/glm.hpp>

namespace stx {

/// What each stage took and changed, for people who ask (stx render --explain). May be written by
/// several threads.
class StageLog {
  public:
    struct Entry {
        std::string name;  ///< of a stage, a step of refining, or one of "prepare", "plan", "draw",
                           ///< "behind" (what is drawn where a frame is open), "light"
        double milliseconds = 0;  ///< of processors, all threads together
        std::int64_t pixels = 0;  ///< that it changed: of views (before drawing) or of frames
        bool once = false;        ///< for all frames
    };
    void add(std::string_view name, double milliseconds, std::int64_t pixels, bool once);
    /// In the order in which they began to be told.
    [[nodiscard]] std::vector<Entry> entries() const;

  private:
    mutable std::mutex mutex_;
    std::vector<Entry> entries_;
};

/// Tells a log, which may be null, what the processors did until its end. `once`: for all frames.
class StageTimer {
  public:
    enum class Of { process, thread };
    StageTimer(StageLog* log, std::string_view name, bool once = false, Of of = Of::process)
        : log_(log), name_(name), once_(once), of_(of), start_(log ? now() : 0) {}
    ~StageTimer() {
        if (log_) log_->add(name_, now() - start_, pixels_, once_);
    }
    StageTimer(const StageTimer&) = delete;
    StageTimer& operator=(const StageTimer&) = delete;
    void changed(std::int64_t pixels) { pixels_ += pixels; }

  private:
    [[nodiscard]] double now() const {
        return of_ == Of::process ? processMilliseconds() : threadMilliseconds();
    }
    StageLog* log_;
    std::string_view name_;
    bool once_;
    Of of_;
    double start_;
    std::int64_t pixels_ = 0;
};

/// Runs a stage that finishes pictures; with a log also counts the pixels that it changes.
template <class Run>
void finishStage(StageLog* log, std::string_view name, const Image<glm::vec4>& colour, Run&& run) {
    if (!log) return run();
    const Image<glm::vec4> before = colour;  // NOLINT: run() changes colour
    StageTimer timer(log, name);
    run();
    std::int64_t changed = 0;
    for (std::size_t i = 0; i < before.count(); ++i)
        changed += before.data()[i] != colour.data()[i];
    timer.changed(changed);
}

}  // namespace stx

#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "lib/base/result.hpp"

namespace stx {

/// What a request may cost. Each number from a file is held against these before memory is taken.
struct Limits {
    std::uint64_t maxMemoryBytes = 4ull << 30;  ///< `--max-memory`
    int maxImageSide = 65535;                   ///< pixels
    int maxViews = 65536;
    int maxNesting = 256;  ///< nodes, boxes, groups
    /// Image and buffer names may leave the folder of the file that names them (`--allow-outside`).
    bool allowOutside = false;
    /// Given, a damaged JPEG is drawn as far as it goes and this is called, from any thread, with
    /// which and why (`--damaged keep`). Empty: it is an error.
    std::function<void(std::string note)> keepDamaged;

    /// Errors with the claim, the size and the limit when `count * bytesEach` is more than allowed.
    /// Never overflows.
    [[nodiscard]] Result<void> checkAllocation(std::uint64_t count, std::uint64_t bytesEach,
                                               std::string_view what) const;
};

/// What a caller gives to every longer operation: limits, a place for notes, progress,
/// cancelling. Safe to use from several threads.
class Job {
  public:
    Limits limits;

    /// Something a person should know: lossy, dropped, clamped. Said once each, in order.
    void note(std::string text);
    /// Makes this the job of a part of another's work: of the same limits, stopped with it. Its
    /// notes are its own, until they are passed on or dropped. `whole` must outlive it.
    void workFor(Job& whole);
    /// Passes the notes so far on to the job that this one works for.
    void passNotesOn();
    /// A note that must not be dropped: it goes to the job that this one works for, at once.
    void noteAbove(std::string text);
    /// The same, of what many parts of the work meet: it is said once, and not how often.
    void noteOnce(std::string text);
    /// "NAMES are OF and not used: WHY" where there are names; `of` as in "of films", or empty.
    void noteUnused(const std::vector<std::string>& names, std::string_view of,
                    std::string_view why);
    /// The notes so far, sorted by first mention; duplicates counted as `text (3 times)`.
    [[nodiscard]] std::vector<std::string> takeNotes();

    /// Called with (done, total, what) from any thread; may be empty.
    std::function<void(std::int64_t done, std::int64_t total, std::string_view what)> onProgress;
    void progress(std::int64_t done, std::int64_t total, std::string_view what) const {
        if (onProgress) onProgress(done, total, what);
    }

    /// Set (by a signal handler) to stop soon; loops over views or tiles look at it.
    std::atomic<bool> cancelled = false;
    /// Errors when cancelled.
    [[nodiscard]] Result<void> checkCancelled() const;

  private:
    struct Note {
        std::string text;
        int count = 1;
    };
    std::mutex mutex_;
    std::vector<Note> notes_;
    Job* whole_ = nullptr;  ///< that this one works for
};

}  // namespace stx

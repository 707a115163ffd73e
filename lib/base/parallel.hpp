#pragma once

#include <cstdint>
#include <functional>
#include <memory>

namespace stx {

/// Runs body(i) for each i in [begin, end) on the threads allowed by ThreadLimit, in no particular
/// order. Results must not depend on that order: each i writes only what is its own.
void parallelFor(std::int64_t begin, std::int64_t end,
                 const std::function<void(std::int64_t)>& body);

/// The same in pieces: body(from, to) with to - from <= grain.
void parallelForBlocks(std::int64_t begin, std::int64_t end, std::int64_t grain,
                       const std::function<void(std::int64_t, std::int64_t)>& body);

/// As parallelFor() for short bodies: `grain` of them one after the other on a thread.
template <class Body>
void parallelFor(std::int64_t begin, std::int64_t end, std::int64_t grain, const Body& body) {
    parallelForBlocks(begin, end, grain, [&](std::int64_t from, std::int64_t to) {
        for (std::int64_t i = from; i < to; ++i) body(i);
    });
}

/// Holds the number of threads down while it lives (`--threads`); 0 = all processors.
class ThreadLimit {
  public:
    explicit ThreadLimit(int threads);
    ~ThreadLimit();
    ThreadLimit(const ThreadLimit&) = delete;
    ThreadLimit& operator=(const ThreadLimit&) = delete;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Threads that parallelFor may use now, at least 1.
[[nodiscard]] int threadCount();

}  // namespace stx

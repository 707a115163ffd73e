#include "lib/base/parallel.hpp"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#ifdef STX_THREAD_SANITIZER
#include <sanitizer/tsan_interface.h>
#endif

namespace stx {
namespace {

/// Tells ThreadSanitizer what TBB promises: the pieces of a loop begin after what came before the
/// loop, and end before what comes after it. Debian's TBB is not instrumented, so it cannot see
/// that; this file is not, either (CMakeLists.txt), lest it looks at TBB's own tasks. Pieces of one
/// loop stay unordered among each other: their races are seen.
class LoopEdges {
  public:
#ifdef STX_THREAD_SANITIZER
    LoopEdges() {
        __tsan_release(&begin_);
    }
    ~LoopEdges() {
        __tsan_acquire(&end_);
    }
    void beginPiece() {
        __tsan_acquire(&begin_);
    }
    void endPiece() {
        __tsan_release(&end_);
    }

  private:
    char begin_ = 0, end_ = 0;
#else
    LoopEdges() {}
    void beginPiece() {}
    void endPiece() {}
#endif
};

}  // namespace

void parallelFor(std::int64_t begin, std::int64_t end,
                 const std::function<void(std::int64_t)>& body) {
    parallelForBlocks(begin, end, 1, [&](std::int64_t from, std::int64_t to) {
        for (auto i = from; i < to; ++i) body(i);
    });
}

void parallelForBlocks(std::int64_t begin, std::int64_t end, std::int64_t grain,
                       const std::function<void(std::int64_t, std::int64_t)>& body) {
    if (begin >= end) return;
    LoopEdges edges;
    tbb::parallel_for(
        tbb::blocked_range<std::int64_t>(begin, end, static_cast<std::size_t>(grain)),
        [&](const auto& r) {
            edges.beginPiece();
            body(r.begin(), r.end());
            edges.endPiece();
        },
        tbb::simple_partitioner());
}

struct ThreadLimit::Impl {
    tbb::global_control control;
};

ThreadLimit::ThreadLimit(int threads) {
    const int count = threads > 0 ? threads : tbb::info::default_concurrency();
    impl_.reset(
        new Impl{{tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(count)}});
}

ThreadLimit::~ThreadLimit() = default;

int threadCount() {
    const auto allowed =
        tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
    return static_cast<int>(allowed < 1 ? 1 : allowed);
}

}  // namespace stx

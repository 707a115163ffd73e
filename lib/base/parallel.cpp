#include "lib/base/parallel.hpp"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace stx {

void parallelFor(std::int64_t begin, std::int64_t end,
                 const std::function<void(std::int64_t)>& body) {
    parallelForBlocks(begin, end, 1, [&](std::int64_t from, std::int64_t to) {
        for (auto i = from; i < to; ++i) body(i);
    });
}

void parallelForBlocks(std::int64_t begin, std::int64_t end, std::int64_t grain,
                       const std::function<void(std::int64_t, std::int64_t)>& body) {
    if (begin >= end) return;
    tbb::parallel_for(
        tbb::blocked_range<std::int64_t>(begin, end, static_cast<std::size_t>(grain)),
        [&](const auto& r) { body(r.begin(), r.end()); }, tbb::simple_partitioner());
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

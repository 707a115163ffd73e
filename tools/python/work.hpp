#pragma once

#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <pybind11/pybind11.h>

#include "formats/stx/stx.hpp"

/// How calls of the library are made from Python: beside the interpreter, so that other threads run
/// and Ctrl-C is heard, with errors as stx.Error and notes as warnings.
namespace stx::python {

namespace py = pybind11;

/// stx.Job: what calls may cost, whom they tell how far they are, and what they noted.
struct JobHandle {
    Job job;
    int threads = 0;
    py::object progress = py::none();
    std::vector<std::string> notes;
};

/// Text of the library, where names of files may have any bytes: those that are not UTF-8 become
/// `\xff`, as the program shows them.
[[nodiscard]] py::str textFrom(std::string_view text);

/// Throws an error as stx.Error.
[[noreturn]] void raise(const Error& error);
/// Throws stx.Error (usage) of a sentence.
template <class... Args>
[[noreturn]] void refuse(fmt::format_string<Args...> format, Args&&... args) {
    raise({ErrorCode::usage, fmt::format(format, std::forward<Args>(args)...), {}});
}

template <class T>
T valueOf(Result<T> result) {
    if (!result) raise(result.error());
    if constexpr (!std::is_void_v<T>) return std::move(*result);
}

/// Gives notes to the job, or where there is none as warnings.
void tell(JobHandle* handle, const std::vector<std::string>& notes);

/// Waits, without the interpreter's lock, until ready(time) says so. Meanwhile signals are looked
/// for and `handle` is told of progress; what a handler of these throws stops the job, and so does
/// the handle's own flag, which is not that of the job: several calls may work for one handle.
void waitFor(Job& job, JobHandle* handle,
             const std::function<bool(std::chrono::milliseconds)>& ready);

/// Has another thread do work(), which must not throw, beside what others do. With the
/// interpreter's lock.
void startWork(std::function<void()> work);

/// The value of work(), which another thread does for `job`.
template <class F>
auto runFor(Job& job, JobHandle* handle, F work) {
    if (handle) valueOf(handle->job.checkCancelled());
    // Of both threads: one may still leave it when the other has its value.
    const auto task = std::make_shared<std::packaged_task<decltype(work())()>>([&] {
        const ThreadLimit threads(handle ? handle->threads : 0);
        return work();
    });
    auto coming = task->get_future();
    startWork([task] { (*task)(); });
    waitFor(job, handle, [&](std::chrono::milliseconds time) {
        return coming.wait_for(time) == std::future_status::ready;
    });
    auto result = coming.get();
    tell(handle, job.takeNotes());
    return valueOf(std::move(result));
}

/// The value of work(job), of a job that only this call has.
template <class F>
auto run(JobHandle* handle, F work) {
    Job job;
    if (handle) job.limits = handle->job.limits;
    return runFor(job, handle, [&] { return work(job); });
}

void bindJob(py::module_& module);

}  // namespace stx::python

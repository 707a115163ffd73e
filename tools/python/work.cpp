#include "tools/python/work.hpp"

#include <condition_variable>
#include <deque>
#include <optional>
#include <thread>

#include <pybind11/stl.h>
#include <unistd.h>

namespace stx::python {
namespace {

/// How long a signal, or news for a progress function, may wait: too short to be felt.
constexpr std::chrono::milliseconds kPatience{50};

struct Progress {
    std::int64_t done = 0, total = 0;
    std::string what;
};

/// What a job last said of its progress, from any thread.
class LastProgress {
  public:
    LastProgress(Job& job, bool wanted) : job_(job) {
        if (wanted)
            job.onProgress = [this](std::int64_t done, std::int64_t total, std::string_view what) {
                const std::lock_guard lock(mutex_);
                last_ = {done, total, std::string(what)};
            };
    }
    ~LastProgress() { job_.onProgress = nullptr; }
    LastProgress(const LastProgress&) = delete;
    LastProgress& operator=(const LastProgress&) = delete;

    /// Each news once.
    std::optional<Progress> take() {
        const std::lock_guard lock(mutex_);
        return std::exchange(last_, std::nullopt);
    }

  private:
    Job& job_;
    std::mutex mutex_;
    std::optional<Progress> last_;
};

/// Says what is new; an exception of Python's signal handlers or of the progress function.
void tellInterpreter(JobHandle* handle, LastProgress& progress) {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (const auto news = progress.take()) handle->progress(news->done, news->total, news->what);
}

/// As many threads as calls worked at once. They stay: TBB does not use the memory of a thread that
/// ended again, so that one for each call took 5 KiB of each.
class Workers {
  public:
    void start(std::function<void()> work) {
        const std::lock_guard lock(mutex_);
        if (idle_ <= waiting_.size()) std::thread([this] { serve(); }).detach();
        waiting_.push_back(std::move(work));
        wake_.notify_one();
    }

  private:
    [[noreturn]] void serve() {
        std::unique_lock lock(mutex_);
        for (;;) {
            ++idle_;
            wake_.wait(lock, [this] { return !waiting_.empty(); });
            --idle_;
            auto work = std::move(waiting_.front());
            waiting_.pop_front();
            lock.unlock();
            work();
            work = nullptr;
            lock.lock();
        }
    }

    std::mutex mutex_;
    std::condition_variable wake_;
    std::deque<std::function<void()>> waiting_;
    std::size_t idle_ = 0;  ///< threads
};

std::unique_ptr<JobHandle> makeJob(double maxMemory, int threads, bool allowOutside,
                                   py::object progress) {
    // MiB that still are bytes in 64 bits.
    constexpr double kMost = 1e12;
    if (!(maxMemory >= 1 && maxMemory <= kMost))
        refuse("max_memory is {:g}; MiB from 1 are expected", maxMemory);
    if (threads < 0) refuse("threads is {}; 0 (all processors) or more are expected", threads);
    if (!progress.is_none() && PyCallable_Check(progress.ptr()) == 0)
        throw py::type_error("progress is not a function; progress(done, total, what) is called");
    auto handle = std::make_unique<JobHandle>();
    handle->job.limits.maxMemoryBytes = static_cast<std::uint64_t>(maxMemory * (1 << 20));
    handle->job.limits.allowOutside = allowOutside;
    handle->threads = threads;
    handle->progress = std::move(progress);
    return handle;
}

}  // namespace

void raise(const Error& error) {
    const py::object type = py::module_::import("stx.errors").attr("Error");
    const py::object value = type(static_cast<int>(error.code), error.message, error.where);
    PyErr_SetObject(type.ptr(), value.ptr());
    throw py::error_already_set();
}

void startWork(std::function<void()> work) {
    // Never deleted: its threads end with the process. A forked one has none of its parent's.
    static Workers* workers = nullptr;
    static pid_t process = 0;
    if (const pid_t now = getpid(); process != now) {
        workers = new Workers;
        process = now;
    }
    workers->start(std::move(work));
}

void tell(JobHandle* handle, const std::vector<std::string>& notes) {
    if (notes.empty()) return;
    if (handle)
        handle->notes.insert(handle->notes.end(), notes.begin(), notes.end());
    else
        py::module_::import("stx.errors").attr("warn")(notes);
}

void waitFor(Job& job, JobHandle* handle,
             const std::function<bool(std::chrono::milliseconds)>& ready) {
    LastProgress progress(job, handle && !handle->progress.is_none());
    std::optional<py::error_already_set> thrown;
    {
        const py::gil_scoped_release others;
        while (!ready(kPatience)) {
            if (handle && handle->job.cancelled) job.cancelled = true;
            if (thrown) continue;
            const py::gil_scoped_acquire lock;
            try {
                tellInterpreter(handle, progress);
            } catch (py::error_already_set& error) {
                thrown.emplace(error);
                job.cancelled = true;
            }
        }
    }
    if (!thrown) return;
    job.cancelled = false;
    throw py::error_already_set(*thrown);
}

void bindJob(py::module_& module) {
    py::class_<JobHandle>(module, "Job",
                          R"(What calls may cost, how far they are, and what they noted.

max_memory: MiB that a file's claims may take, from 1. threads: processors to use, 0 = all.
allow_outside: names inside a file may leave its folder. progress: a function that is called as
progress(done, total, what) while a call works; what it raises stops the call.
One job may serve any number of calls, from any thread.)")
        .def(py::init(&makeJob), py::kw_only(), py::arg("max_memory") = 4096.0,
             py::arg("threads") = 0, py::arg("allow_outside") = false,
             py::arg("progress") = py::none())
        .def_property_readonly(
            "notes", [](const JobHandle& h) { return py::tuple(py::cast(h.notes)); },
            "What a person should know of the calls so far (lossy, dropped), a tuple of sentences.")
        .def(
            "cancel", [](JobHandle& h) { h.job.cancelled = true; },
            "Stops the calls that work for this job, and those to come, with stx.Error (failed). "
            "From any thread.");
    module.def("note", [](const std::string& sentence, JobHandle* job) { tell(job, {sentence}); });
}

}  // namespace stx::python

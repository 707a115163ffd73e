#include "tools/python/work.hpp"

#include <cxxabi.h>
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

/// Whether the main thread ends the interpreter. Other threads never get its lock again then.
bool interpreterEnds() {
#if PY_VERSION_HEX >= 0x030D0000
    return Py_IsFinalizing() != 0;
#else
    return _Py_IsFinalizing() != 0;
#endif
}

/// For a thread that the interpreter would end: it ends with the process.
[[noreturn]] void waitForTheEnd() {
    for (;;) pause();
}

/// Does what may wait for the interpreter's lock. A thread that waits for it while the interpreter
/// ends is unwound by pthread_exit(), which frames of C++ do not survive (destructors, and Python's
/// objects without the lock): it waits here instead.
template <class F>
void withoutBeingEnded(F work) {
    try {
        work();
    } catch (const abi::__forced_unwind&) {
        // To leave this handler would end the process.
        waitForTheEnd();
    }
}

/// Gives the interpreter's lock to others while it lives, but for the time between take() and
/// giveBack().
class Unlocked {
  public:
    Unlocked() : endsItself_(interpreterEnds()), thread_(PyEval_SaveThread()) {}
    ~Unlocked() {
        if (thread_) take();
    }
    Unlocked(const Unlocked&) = delete;
    Unlocked& operator=(const Unlocked&) = delete;

    /// Whether the lock will not be had again.
    [[nodiscard]] bool lost() const { return !endsItself_ && interpreterEnds(); }
    void take() {
        if (lost()) waitForTheEnd();
        withoutBeingEnded([&] { PyEval_RestoreThread(thread_); });
        thread_ = nullptr;
    }
    void giveBack() { thread_ = PyEval_SaveThread(); }

  private:
    /// This is the thread that ends the interpreter, as where __del__() calls: it had the lock
    /// then.
    bool endsItself_;
    PyThreadState* thread_;
};

void tellProgress(JobHandle* handle, LastProgress& progress) {
    const auto news = progress.take();
    if (!news) return;
    const py::tuple arguments = py::make_tuple(news->done, news->total, textFrom(news->what));
    // Python's own function, so that no object is between it and who waits.
    PyObject* answer = nullptr;
    withoutBeingEnded(
        [&] { answer = PyObject_CallObject(handle->progress.ptr(), arguments.ptr()); });
    if (!answer) throw py::error_already_set();
    Py_DECREF(answer);
}

/// Says what is new; an exception of Python's signal handlers or of the progress function.
void tellInterpreter(JobHandle* handle, LastProgress& progress) {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    tellProgress(handle, progress);
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

py::tuple textsOf(const std::vector<std::string>& sentences) {
    py::tuple texts(sentences.size());
    for (std::size_t i = 0; i < sentences.size(); ++i) texts[i] = textFrom(sentences[i]);
    return texts;
}

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

py::str textFrom(std::string_view text) {
    const auto size = static_cast<Py_ssize_t>(text.size());
    PyObject* decoded = PyUnicode_DecodeUTF8(text.data(), size, "backslashreplace");
    if (!decoded) throw py::error_already_set();
    return py::reinterpret_steal<py::str>(decoded);
}

void raise(const Error& error) {
    const py::object type = py::module_::import("stx.errors").attr("Error");
    const py::object value =
        type(static_cast<int>(error.code), textFrom(error.message), textFrom(error.where));
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
        py::module_::import("stx.errors").attr("warn")(textsOf(notes));
}

void waitFor(Job& job, JobHandle* handle,
             const std::function<bool(std::chrono::milliseconds)>& ready) {
    LastProgress progress(job, handle && !handle->progress.is_none());
    std::optional<py::error_already_set> thrown;
    const auto tellNow = [&](auto say) {
        try {
            say(handle, progress);
        } catch (py::error_already_set& error) {
            thrown.emplace(error);
        }
    };
    {
        Unlocked others;
        while (!ready(kPatience)) {
            if ((handle && handle->job.cancelled) || others.lost()) job.cancelled = true;
            if (thrown) continue;
            others.take();
            tellNow(tellInterpreter);
            if (thrown) job.cancelled = true;
            others.giveBack();
        }
    }
    // How it ended, and what a call had to say that was done before it was first asked.
    if (!thrown) tellNow(tellProgress);
    if (!thrown) return;
    job.cancelled = false;
    throw py::error_already_set(*thrown);
}

void bindJob(py::module_& module) {
    py::class_<JobHandle>(module, "Job",
                          R"(What calls may cost, how far they are, and what they noted.

max_memory: MiB that a file's claims may take, from 1. threads: processors to use, 0 = all.
allow_outside: names inside a file may leave its folder. progress: a function that is called as
progress(done, total, what) while a call works, and with its last news when it is done; what it raises
stops the call.
One job may serve any number of calls, from any thread.)")
        .def(py::init(&makeJob), py::kw_only(), py::arg("max_memory") = 4096.0,
             py::arg("threads") = 0, py::arg("allow_outside") = false,
             py::arg("progress") = py::none())
        .def_property_readonly(
            "notes", [](const JobHandle& h) { return textsOf(h.notes); },
            "What a person should know of the calls so far (lossy, dropped), a tuple of sentences.")
        .def(
            "cancel", [](JobHandle& h) { h.job.cancelled = true; },
            "Stops the calls that work for this job, and those to come, with stx.Error (failed). "
            "From any thread.");
    module.def("note", [](const std::string& sentence, JobHandle* job) { tell(job, {sentence}); });
}

}  // namespace stx::python

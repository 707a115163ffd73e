#include "formats/meshes/try_apart.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <string>

#include "formats/files/pipes.hpp"
#include "formats/files/temporaries.hpp"

namespace stx {
namespace {

constexpr rlim_t kMostSeconds = 120;
constexpr int kDone = 0, kNoMemory = 3, kFailed = 4;

/// Bytes of address space that this process has.
std::uint64_t addressSpace() {
    unsigned long long pages = 0;
    if (std::FILE* file = std::fopen("/proc/self/statm", "r")) {
        if (std::fscanf(file, "%llu", &pages) != 1) pages = 0;
        std::fclose(file);
    }
    return pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

void limit(int resource, rlim_t most) {
    rlimit now{};
    if (::getrlimit(resource, &now) != 0) return;
    now.rlim_cur = now.rlim_max == RLIM_INFINITY ? most : std::min(most, now.rlim_max);
    ::setrlimit(resource, &now);
}

/// A byte of the code, then the text; of a text longer than a pipe holds what fits.
void tell(int fd, const Error& error) {
    std::string text = error.text();
    constexpr std::size_t kMost = 4000;
    if (text.size() > kMost) text.resize(kMost);
    text.insert(text.begin(), static_cast<char>(error.code));
    (void)sendAll(fd, text.data(), text.size());
}

/// What the child that has ended told. Its end of the pipe may still be open in a child that
/// another thread made, so that there is no waiting for the end.
std::string heard(int fd) {
    char text[4096];
    ::fcntl(fd, F_SETFL, O_NONBLOCK);
    const auto n = ::read(fd, text, sizeof(text));
    return {text, n > 0 ? static_cast<std::size_t>(n) : 0};
}

}  // namespace

Result<void> tryApart(const std::function<Result<void>()>& work, const Limits& limits) {
    [[maybe_unused]] const std::uint64_t space = addressSpace();
    int ends[2] = {-1, -1};
    if (::pipe2(ends, O_CLOEXEC) != 0)
        return fail(ErrorCode::failed, "no process can be made to read the model in: {}",
                    std::strerror(errno));
    const Descriptor out(ends[0]);
    const Descriptor in(ends[1]);
    const pid_t child = ::fork();
    if (child < 0)
        return fail(ErrorCode::failed, "no process can be made to read the model in: {}",
                    std::strerror(errno));
    if (child == 0) {
        limit(RLIMIT_CORE, 0);
        limit(RLIMIT_CPU, kMostSeconds);
#ifndef __SANITIZE_ADDRESS__
        if (space > 0) limit(RLIMIT_AS, space + limits.maxMemoryBytes);
#endif
        // Parsers catch what allocations throw, and take the file for read or for damaged.
        std::set_new_handler([] { ::_exit(kNoMemory); });
        Result<void> done;
        try {
            done = work();
        } catch (const std::exception& e) {
            done = fail(ErrorCode::invalidInput, "the file is damaged: {}", e.what());
        } catch (...) {
            done = fail(ErrorCode::invalidInput, "the file is damaged");
        }
        if (!done) tell(in.get(), done.error());
        ::_exit(done ? kDone : kFailed);
    }
    int status = 0;
    while (::waitpid(child, &status, 0) < 0) {
        if (errno != EINTR)  // somebody else took its end
            return fail(ErrorCode::failed, "the process that reads the model in was lost");
    }
    if (WIFEXITED(status) && WEXITSTATUS(status) == kDone) return {};
    const std::string told = heard(out.get());
    if (WIFEXITED(status) && WEXITSTATUS(status) == kFailed && !told.empty())
        return tl::unexpected(Error{static_cast<ErrorCode>(told[0]), told.substr(1), {}});
    if (WIFEXITED(status) && WEXITSTATUS(status) == kNoMemory)
        return fail(ErrorCode::invalidInput,
                    "the model needs more than the memory limit of {} MiB; raise it with "
                    "--max-memory if the file is to be trusted",
                    limits.maxMemoryBytes >> 20);
    if (WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL))
        return fail(ErrorCode::invalidInput,
                    "the model cannot be read in {} seconds; is it damaged?", kMostSeconds);
    return fail(ErrorCode::invalidInput, "the file is damaged: its reader crashes on it");
}

}  // namespace stx

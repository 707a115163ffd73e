#include "formats/meshes/try_apart.hpp"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <new>

namespace stx {
namespace {

constexpr rlim_t kMostSeconds = 120;
constexpr int kDone = 0, kNoMemory = 3;

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

}  // namespace

Result<void> tryApart(const std::function<void()>& work, const Limits& limits) {
    const std::uint64_t space = addressSpace();
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
        int code = kDone;
        try {
            work();
        } catch (const std::bad_alloc&) {
            code = kNoMemory;
        } catch (...) {
            // The caller meets it again, and says what it is.
        }
        ::_exit(code);
    }
    int status = 0;
    while (::waitpid(child, &status, 0) < 0) {
        if (errno != EINTR) return {};  // somebody else took its end: nothing is known
    }
    if (WIFEXITED(status) && WEXITSTATUS(status) == kDone) return {};
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

#include "formats/files/child_process.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <mutex>

namespace stx {
namespace {

/// Data pages of this process now, as RLIMIT_DATA counts them; 0 when unknown.
std::uint64_t dataBytes() {
    const Descriptor fd(::open("/proc/self/statm", O_RDONLY | O_CLOEXEC));
    char text[256] = {};
    unsigned long size = 0, resident = 0, shared = 0, code = 0, libraries = 0, data = 0;
    if (fd.get() < 0 || ::read(fd.get(), text, sizeof(text) - 1) <= 0) return 0;
    if (std::sscanf(text, "%lu %lu %lu %lu %lu %lu", &size, &resident, &shared, &code, &libraries,
                    &data) != 6)
        return 0;
    return std::uint64_t{data} * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

}  // namespace

Result<std::unique_ptr<ChildProcess>> ChildProcess::start(
    const std::function<void(int socket)>& work) {
    // A child gets copies of all descriptors. While one is made, no other may be: it would hold the
    // child's end of the first one's socket open, and the parent would not see that child die.
    static std::mutex making;
    const std::lock_guard lock(making);
    int ends[2] = {-1, -1};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
        return fail(ErrorCode::failed, "no connection to a decoder can be made");
    Descriptor here(ends[0]);
    const Descriptor there(ends[1]);
    const pid_t pid = ::fork();
    if (pid < 0) return fail(ErrorCode::failed, "no process for a decoder can be made");
    if (pid == 0) {
        work(there.get());
        ::_exit(1);
    }
    std::unique_ptr<ChildProcess> child(new ChildProcess());
    child->pid_ = pid;
    child->socket_ = std::move(here);
    return child;
}

ChildProcess::~ChildProcess() {
    ::kill(pid_, SIGKILL);
    while (::waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
    }
}

void confineChild(std::uint64_t moreBytes) {
    for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGPIPE, SIGXCPU, SIGTERM})
        ::signal(signal, SIG_DFL);
    const rlimit noCore = {0, 0};
    ::setrlimit(RLIMIT_CORE, &noCore);
    const std::uint64_t now = dataBytes();
    const rlimit memory = {now + moreBytes, now + moreBytes};
    if (now) ::setrlimit(RLIMIT_DATA, &memory);
    // Libraries and the C library print about what kills them.
    const int null = ::open("/dev/null", O_RDWR);
    if (null >= 0)
        for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) ::dup2(null, fd);
}

}  // namespace stx

#include "formats/video/video_process.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <climits>
#include <cstdio>
#include <mutex>

#include "formats/video/video_module.hpp"

namespace stx {
namespace {

constexpr int kPatienceMs = 30000;
/// Beside the limit: what the libraries need before they decode.
constexpr std::uint64_t kOwnMemory = 256u << 20;

/// Data pages of this process now, as RLIMIT_DATA counts them; 0 when unknown.
std::uint64_t dataPages() {
    const Descriptor fd(::open("/proc/self/statm", O_RDONLY | O_CLOEXEC));
    char text[256] = {};
    unsigned long size = 0, resident = 0, shared = 0, code = 0, libraries = 0, data = 0;
    if (fd.get() < 0 || ::read(fd.get(), text, sizeof(text) - 1) <= 0) return 0;
    if (std::sscanf(text, "%lu %lu %lu %lu %lu %lu", &size, &resident, &shared, &code, &libraries,
                    &data) != 6)
        return 0;
    return std::uint64_t{data} * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

/// Closes all descriptors from 3 on but these.
void closeOthers(std::initializer_list<int> keep) {
    std::vector<int> kept(keep);
    std::erase_if(kept, [](int fd) { return fd < 3; });
    std::ranges::sort(kept);
    unsigned first = 3;
    for (const int fd : kept) {
        const auto here = static_cast<unsigned>(fd);
        if (here > first) ::close_range(first, here - 1, 0);
        first = here + 1;
    }
    ::close_range(first, UINT_MAX, 0);
}

[[noreturn]] void runVideo(const video::Table& table, int socket, int file,
                           std::uint64_t maxMemoryBytes) {
    for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGPIPE, SIGTERM})
        ::signal(signal, SIG_DFL);
    // Ctrl-C goes to the whole group; the parent sees to this process.
    ::signal(SIGINT, SIG_IGN);
    const rlimit noCore = {0, 0};
    ::setrlimit(RLIMIT_CORE, &noCore);
    const std::uint64_t now = dataPages();
    const std::uint64_t allowed = now + maxMemoryBytes + kOwnMemory;
    const rlimit memory = {allowed, allowed};
    if (now) ::setrlimit(RLIMIT_DATA, &memory);
    const int null = ::open("/dev/null", O_RDWR);
    if (null >= 0)
        for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) ::dup2(null, fd);
    closeOthers({socket, file});
    table.serve(socket, file);
    ::_exit(0);
}

}  // namespace

Result<std::unique_ptr<VideoProcess>> VideoProcess::start(const Limits& limits, Descriptor file) {
    STX_TRY(const video::Table* table, loadVideo());
    // While it is made, no other process of ours gets copies of these ends.
    static std::mutex making;
    const std::lock_guard lock(making);
    // A socket, not a pipe: writing to a process that died must not be a signal for this one.
    int ends[2] = {-1, -1};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
        return fail(ErrorCode::failed, "no connection to a video decoder can be made");
    Descriptor here(ends[0]);
    const Descriptor there(ends[1]);
    const pid_t pid = ::fork();
    if (pid < 0) return fail(ErrorCode::failed, "no process for a video decoder can be made");
    if (pid == 0) runVideo(*table, there.get(), file.get(), limits.maxMemoryBytes);
    std::unique_ptr<VideoProcess> process(new VideoProcess());
    process->pid_ = pid;
    process->socket_ = std::move(here);
    process->most_ = limits.maxMemoryBytes;
    return process;
}

VideoProcess::~VideoProcess() {
    ::kill(pid_, SIGKILL);
    while (::waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
    }
}

Result<Bytes> VideoProcess::ask(video::Tag request, ByteSpan bytes, video::Tag expected) {
    const auto died = [&]() -> tl::unexpected<Error> {
        broken_ = true;
        return fail(ErrorCode::invalidInput,
                    "its decoder crashed or did not end; the video is damaged, or needs more "
                    "memory than --max-memory allows");
    };
    if (broken_) return died();
    if (!video::sendMessage(socket_.get(), request, bytes)) return died();
    video::Tag tag{};
    Bytes answer;
    if (!video::receiveMessage(socket_.get(), tag, answer, most_, kPatienceMs)) return died();
    if (tag == expected) return answer;
    video::Unpacker failure(answer);
    if (tag != video::Tag::failure) return died();
    const auto code = failure.get<std::int32_t>();
    std::string text = failure.getText();
    if (!failure.ok() || text.empty()) return died();
    const bool known = code == static_cast<int>(ErrorCode::io) ||
                       code == static_cast<int>(ErrorCode::unsupported) ||
                       code == static_cast<int>(ErrorCode::failed);
    return fail(known ? static_cast<ErrorCode>(code) : ErrorCode::invalidInput, "{}", text);
}

}  // namespace stx

// stx-decode: loads one module of decoders, then makes a process for each file that is to be
// decoded. This one never sees a byte of any, has one thread and no other work, so that each of its
// copies begins as if it had just been started.

#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "formats/decoders/decoder_module.hpp"
#include "formats/decoders/program/confine.hpp"
#include "formats/decoders/wire.hpp"
#include "formats/files/module.hpp"

namespace {

using namespace stx::decoders;

/// What a process has open beside the three streams: in this order, whoever made them.
constexpr int kControl = 3, kSocket = 4, kFile = 5;
/// Room for the few that decoding opens.
constexpr int kMostDescriptors = 16;

bool loading = true;

[[noreturn]] void onEnd(int signal) {
    const MessageHead head = {kMagic, signal == SIGXCPU ? Tag::timeUp : Tag::crashed, 0};
    (void)!::write(kSocket, &head, sizeof(head));
    ::_exit(1);
}

/// Says to who asked why this process ends. Where the kernel kills it, nothing does.
void sayWhyItEnds() {
    static char room[1 << 16];  // where the stack itself has run over
    const stack_t other = {room, 0, sizeof(room)};
    ::sigaltstack(&other, nullptr);
    struct sigaction how = {};
    how.sa_handler = onEnd;
    how.sa_flags = SA_ONSTACK | static_cast<int>(SA_RESETHAND);
    for (const int signal : {SIGXCPU, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT})
        ::sigaction(signal, &how, nullptr);
    std::atexit([] { onEnd(0); });  // of libraries: this process ends by _exit()
}

struct Request {
    Launch launch;
    int socket = -1, file = -1;
};

/// False when nobody asks any more.
bool receive(Request& asked) {
    alignas(cmsghdr) char room[CMSG_SPACE(2 * sizeof(int))] = {};
    iovec bytes = {&asked.launch, sizeof(asked.launch)};
    msghdr message = {};
    message.msg_iov = &bytes;
    message.msg_iovlen = 1;
    message.msg_control = room;
    message.msg_controllen = sizeof(room);
    ssize_t n = 0;
    while ((n = ::recvmsg(kControl, &message, MSG_CMSG_CLOEXEC)) < 0 && errno == EINTR) {
    }
    if (n <= 0) return false;
    const cmsghdr* attached = CMSG_FIRSTHDR(&message);
    int descriptors[2] = {-1, -1};
    if (attached && attached->cmsg_type == SCM_RIGHTS)
        std::memcpy(descriptors, CMSG_DATA(attached), attached->cmsg_len - CMSG_LEN(0));
    asked.socket = descriptors[0];
    asked.file = descriptors[1];
    return n == sizeof(asked.launch) && asked.launch.magic == kMagic && asked.socket >= 0;
}

/// The first byte, with what this process is known by.
bool greet() {
    const int self = static_cast<int>(::syscall(SYS_pidfd_open, ::getpid(), 0));
    alignas(cmsghdr) char room[CMSG_SPACE(sizeof(int))] = {};
    char first = 0;
    iovec bytes = {&first, 1};
    msghdr message = {};
    message.msg_iov = &bytes;
    message.msg_iovlen = 1;
    if (self >= 0) {
        message.msg_control = room;
        message.msg_controllen = sizeof(room);
        cmsghdr* attached = CMSG_FIRSTHDR(&message);
        attached->cmsg_level = SOL_SOCKET;
        attached->cmsg_type = SCM_RIGHTS;
        attached->cmsg_len = CMSG_LEN(sizeof(int));
        std::memcpy(CMSG_DATA(attached), &self, sizeof(self));
    }
    const bool sent = ::sendmsg(kSocket, &message, MSG_NOSIGNAL) == 1;
    if (self >= 0) ::close(self);
    return sent;
}

/// What all processes share.
struct Held {
    Filter filter{kSocket};
    std::uint64_t data = dataBytes();
    bool landlock = false;
    pid_t maker = ::getpid();
};

[[noreturn]] void decode(const Module& module, const Request& asked, const Held& held) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != held.maker) ::_exit(1);
    // Numbers that the filter knows.
    const int socket = ::fcntl(asked.socket, F_DUPFD_CLOEXEC, kMostDescriptors);
    const int file = asked.file < 0 ? -1 : ::fcntl(asked.file, F_DUPFD_CLOEXEC, kMostDescriptors);
    ::dup2(socket, kSocket);
    if (file >= 0) ::dup2(file, kFile);
    ::close(kControl);
    ::close_range(file < 0 ? kFile : kFile + 1, UINT_MAX, 0);
    sayWhyItEnds();
    ::signal(SIGCHLD, SIG_DFL);
    answerFiltered(file < 0 ? -1 : kFile);
    if (!greet()) ::_exit(1);
    const rlimit few = {kMostDescriptors, kMostDescriptors};
    ::setrlimit(RLIMIT_NOFILE, &few);
    if (asked.launch.cpuSeconds > 0) limitSeconds(asked.launch.cpuSeconds);
    if (held.data > 0) limitMemory(held.data + asked.launch.memoryBytes);
    Hello hello;
    hello.landlock = held.landlock;
    hello.seccomp = held.filter.apply();
    if (!hello.seccomp && asked.launch.mustFilter) {
        (void)sendFailure(kSocket, static_cast<int>(stx::ErrorCode::unsupported),
                          "system calls of decoders cannot be filtered here (seccomp), which "
                          "--decoder-isolation required asks for; allow it in this container, or "
                          "leave the option out");
        ::_exit(1);
    }
    Packer greeting;
    greeting.put(hello);
    greeting.putText(module.libraries());
    if (!sendMessage(kSocket, Tag::hello, greeting.bytes)) ::_exit(1);
    module.serve(kSocket, file < 0 ? -1 : kFile);
    ::_exit(0);
}

void refuse(int socket, stx::ErrorCode code, const std::string& why) {
    const char first = 0;
    (void)(stx::sendAll(socket, &first, 1) && sendFailure(socket, static_cast<int>(code), why));
}

}  // namespace

/// Some libraries start threads when they are loaded (log4cplus, behind OpenImageIO). The threads
/// wait for work, which they never get here, and a copy of this process would not have them. While
/// modules are loaded this answers as if a thread had been started, and starts none; later it
/// refuses.
extern "C" __attribute__((visibility("default"))) int pthread_create(pthread_t* thread,
                                                                     const pthread_attr_t*,
                                                                     void* (*)(void*), void*) {
    if (!loading) return EAGAIN;
    *thread = ::pthread_self();
    return 0;
}

int main(int count, char** arguments) {
    // Ctrl-C goes to the whole group; the end of the parent is seen at the connection.
    ::signal(SIGINT, SIG_IGN);
    ::signal(SIGPIPE, SIG_IGN);
    ::signal(SIGCHLD, SIG_IGN);  // who ends is gone
    const auto module = stx::openModule<Module>(
        std::vector<std::string>(arguments + std::min(count, 1), arguments + count), kModuleSymbol,
        kModuleVersion);
    if (module && (*module)->prepare) (*module)->prepare();
    loading = false;
    Held held;
    forbidCommon();
    held.landlock = forbidFiles();
    for (Request asked; receive(asked); asked = {}) {
        const pid_t made = module ? ::fork() : -1;
        if (made == 0) decode(**module, asked, held);
        if (!module)  // the one error of reading: who asks knows what the module is for
            refuse(asked.socket, stx::ErrorCode::io, module.error().message);
        else if (made < 0)
            refuse(asked.socket, stx::ErrorCode::failed, "no process for a decoder can be made");
        ::close(asked.socket);
        if (asked.file >= 0) ::close(asked.file);
    }
    ::_exit(0);
}

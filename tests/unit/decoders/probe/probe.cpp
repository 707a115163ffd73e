// A decoder that tries what none may: a module for stx-decode that only tests have.

#include <arpa/inet.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>
#include <atomic>

#include <cerrno>
#include <cstdlib>
#include <functional>
#include <map>

#include "formats/decoders/decoder_module.hpp"
#include "formats/decoders/wire.hpp"

namespace {

using namespace stx::decoders;

int parent = 0, ownFile = -1;
char* none[] = {nullptr};

int overflow(int depth) {
    volatile char room[4096] = {};
    room[depth % 4096] = static_cast<char>(depth);
    return depth < 0 ? 0 : overflow(depth + 1) + room[1];
}

bool opens(const char* name, int how) {
    return ::open(name, how, 0600) >= 0;
}

/// Each is true when it succeeds.
const std::map<std::string, std::function<bool()>> kTries = {
    {"open a file", [] { return opens("/etc/passwd", O_RDONLY); }},
    {"open a folder", [] { return opens("/", O_RDONLY | O_DIRECTORY); }},
    {"create a file", [] { return opens("/tmp/stx-probe", O_RDWR | O_CREAT); }},
    {"open the other's memory",
     [] { return opens(("/proc/" + std::to_string(parent) + "/mem").c_str(), O_RDONLY); }},
    {"look at a file",
     [] {
         struct stat facts;
         return ::stat("/etc/passwd", &facts) == 0;
     }},
    {"make a TCP socket", [] { return ::socket(AF_INET, SOCK_STREAM, 0) >= 0; }},
    {"make a local socket", [] { return ::socket(AF_UNIX, SOCK_DGRAM, 0) >= 0; }},
    {"connect",
     [] {
         sockaddr_in to = {};
         to.sin_family = AF_INET;
         to.sin_port = htons(80);
         to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
         return ::connect(4, reinterpret_cast<sockaddr*>(&to), sizeof(to)) == 0;
     }},
    {"fork",
     [] {
         const pid_t made = static_cast<pid_t>(::syscall(SYS_clone, SIGCHLD, 0, 0, 0, 0));
         if (made == 0) ::_exit(0);
         return made > 0;
     }},
    {"run a program", [] { return ::execve("/bin/true", none, none) == 0; }},
    {"start a program",
     [] {
         pid_t made = 0;
         char* arguments[] = {const_cast<char*>("true"), nullptr};
         return ::posix_spawn(&made, "/bin/true", nullptr, nullptr, arguments, none) == 0;
     }},
    {"start a thread",
     [] {
         pthread_t made{};
         return ::pthread_create(
                    &made, nullptr, [](void*) -> void* { return nullptr; }, nullptr) == 0;
     }},
    {"trace the other", [] { return ::ptrace(PTRACE_ATTACH, parent, nullptr, nullptr) == 0; }},
    {"read the other's memory",
     [] {
         char byte = 0;
         iovec to = {&byte, 1}, from = {&parent, 1};
         return ::process_vm_readv(parent, &to, 1, &from, 1, 0) == 1;
     }},
    {"signal the other", [] { return ::kill(parent, 0) == 0; }},
    {"bound the other",
     [] {
         rlimit bound = {};
         return ::syscall(SYS_prlimit64, parent, RLIMIT_CORE, nullptr, &bound) == 0;
     }},
    {"make memory that runs",
     [] {
         return ::mmap(nullptr, 4096, PROT_READ | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) !=
                MAP_FAILED;
     }},
    {"share memory",
     [] {
         return ::mmap(nullptr, 4096, PROT_READ, MAP_SHARED | MAP_ANONYMOUS, -1, 0) != MAP_FAILED;
     }},
    {"make a file in memory", [] { return ::memfd_create("more", 0) >= 0; }},
    {"write to its input", [] { return ::write(ownFile, "x", 1) == 1; }},
    // What it may do.
    {"take memory",
     [] {
         return ::mmap(nullptr, 1 << 20, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1,
                       0) != MAP_FAILED;
     }},
    {"take much memory",
     [] {
         return ::mmap(nullptr, 1 << 30, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1,
                       0) != MAP_FAILED;
     }},
    {"read its input",
     [] {
         char byte = 0;
         return ::pread(ownFile, &byte, 1, 0) == 1 && byte == 'i';
     }},
    {"open its input by name",
     [] {
         char byte = 0;
         const int fd = ::open(("/proc/self/fd/" + std::to_string(ownFile)).c_str(), O_RDONLY);
         return fd >= 0 && ::read(fd, &byte, 1) == 1 && byte == 'i';
     }},
    {"be the first to come",
     [] {
         static int came = 0;
         return ++came == 1;
     }},
    {"crash", []() -> bool { std::abort(); }},
    {"overflow its stack", [] { return overflow(1) > 0; }},
    {"exit as libraries do", []() -> bool { std::exit(1); }},
    {"end", []() -> bool { ::_exit(0); }},
    {"go on for ever",
     [] {
         for (std::atomic<int> i = 0;; ++i) {
         }
         return true;
     }},
    {"say rubbish", [] { return stx::sendAll(4, "no message has this head, whatever it is", 40); }},
};

/// Text: what is tried; answers done with a byte: whether it could. Text "parent": whose memory.
void serve(int socket, int file) {
    ownFile = file;
    Tag tag{};
    std::vector<std::byte> request;
    while (receiveMessage(socket, tag, request, 1 << 20, -1)) {
        Unpacker in(request);
        const std::string name = in.getText();
        parent = in.get<std::int32_t>();
        const auto found = kTries.find(name);
        if (found == kTries.end()) ::_exit(2);
        Packer answer;
        answer.put(static_cast<std::uint8_t>(found->second()));
        if (!sendMessage(socket, Tag::done, answer.bytes)) return;
    }
}

}  // namespace

extern "C" __attribute__((visibility("default"))) const Module* stxDecoder() {
    static const Module module = {kModuleVersion, [] { return "a probe"; }, nullptr, serve};
    return &module;
}

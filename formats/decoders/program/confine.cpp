#include "formats/decoders/program/confine.hpp"

#include <fcntl.h>
#include <linux/filter.h>
#include <linux/landlock.h>
#include <linux/seccomp.h>
#include <seccomp.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <ucontext.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

namespace stx::decoders {
namespace {

/// What decoding needs: memory, the time, open files, its own threads' locks, and its end.
constexpr int kAllowed[] = {SCMP_SYS(read),
                            SCMP_SYS(readv),
                            SCMP_SYS(pread64),
                            SCMP_SYS(lseek),
                            SCMP_SYS(close),
                            SCMP_SYS(fstat),
                            SCMP_SYS(dup),
                            SCMP_SYS(poll),
                            SCMP_SYS(ppoll),
                            SCMP_SYS(brk),
                            SCMP_SYS(munmap),
                            SCMP_SYS(mremap),
                            SCMP_SYS(madvise),
                            SCMP_SYS(futex),
                            SCMP_SYS(sched_yield),
                            SCMP_SYS(sched_getaffinity),
                            SCMP_SYS(getcpu),
                            SCMP_SYS(getrandom),
                            SCMP_SYS(clock_gettime),
                            SCMP_SYS(clock_getres),
                            SCMP_SYS(gettimeofday),
                            SCMP_SYS(time),
                            SCMP_SYS(times),
                            SCMP_SYS(getrusage),
                            SCMP_SYS(sysinfo),
                            SCMP_SYS(uname),
                            SCMP_SYS(getpid),
                            SCMP_SYS(gettid),
                            SCMP_SYS(rt_sigaction),
                            SCMP_SYS(rt_sigprocmask),
                            SCMP_SYS(rt_sigreturn),
                            SCMP_SYS(sigaltstack),
                            SCMP_SYS(restart_syscall),
                            SCMP_SYS(set_robust_list),
                            SCMP_SYS(rseq),
                            SCMP_SYS(membarrier),
                            SCMP_SYS(exit),
                            SCMP_SYS(exit_group)};

void limit(int resource, std::uint64_t most) {
    const rlimit bound = {most, most};
    ::setrlimit(static_cast<__rlimit_resource>(resource), &bound);
}

#if defined(__x86_64__) || defined(__aarch64__)
#define STX_ANSWERS_FILTERED 1

struct Asked {
    long first, second, third, fourth;
};

#ifdef __x86_64__
Asked askedIn(const ucontext_t& at) {
    const auto& r = at.uc_mcontext.gregs;
    return {static_cast<long>(r[REG_RDI]), static_cast<long>(r[REG_RSI]),
            static_cast<long>(r[REG_RDX]), static_cast<long>(r[REG_R10])};
}
void answer(ucontext_t& at, long value) {
    at.uc_mcontext.gregs[REG_RAX] = value;
}
#else
Asked askedIn(const ucontext_t& at) {
    const auto& r = at.uc_mcontext.regs;
    return {static_cast<long>(r[0]), static_cast<long>(r[1]), static_cast<long>(r[2]),
            static_cast<long>(r[3])};
}
void answer(ucontext_t& at, long value) {
    at.uc_mcontext.regs[0] = static_cast<unsigned long long>(value);
}
#endif

int ownFile = -1;
char ownName[32] = {};

/// The system call that was stopped, with what it may do of it. Changes errno of nobody: it
/// answers for the kernel.
void onFiltered(int, siginfo_t* what, void* context) {
    auto& at = *static_cast<ucontext_t*>(context);
    const Asked asked = askedIn(at);
    const bool own = [&] {
        const char* name = reinterpret_cast<const char*>(
            what->si_syscall == SYS_openat || what->si_syscall == SYS_newfstatat ? asked.second
                                                                                 : asked.first);
        return ownFile >= 0 && name && std::strcmp(name, ownName) == 0;
    }();
    const int before = errno;
    long done = -EPERM;
    const auto result = [](long value) { return value < 0 ? -static_cast<long>(errno) : value; };
    if (what->si_syscall == SYS_newfstatat) {
        const char* name = reinterpret_cast<const char*>(asked.second);
        const bool byNumber = (asked.fourth & AT_EMPTY_PATH) != 0 && (!name || *name == 0);
        if (byNumber || own)
            done = result(::syscall(SYS_fstat, own ? ownFile : static_cast<int>(asked.first),
                                    reinterpret_cast<struct stat*>(asked.third)));
    } else if (own) {  // to be opened
        done = result(::syscall(SYS_dup, ownFile));
        if (done >= 0) ::lseek(static_cast<int>(done), 0, SEEK_SET);
    }
    errno = before;
    answer(at, done);
}
#endif

}  // namespace

Filter::Filter(int socket) {
    const scmp_filter_ctx rules = ::seccomp_init(SCMP_ACT_ERRNO(EPERM));
    if (!rules) return;
    bool good = true;
    const auto add = [&](std::uint32_t action, int call) {
        // A call that this processor does not have cannot be made either.
        if (call >= 0) good = good && ::seccomp_rule_add(rules, action, call, 0) == 0;
    };
    for (const int call : kAllowed) add(SCMP_ACT_ALLOW, call);
#ifdef STX_ANSWERS_FILTERED
    for (const int call : {SCMP_SYS(openat), SCMP_SYS(open), SCMP_SYS(newfstatat)})
        add(SCMP_ACT_TRAP, call);
#endif
    // Answers go out of this one only; nothing is mapped that others see, or that can be run.
    const scmp_arg_cmp answer[] = {SCMP_A0(SCMP_CMP_EQ, static_cast<scmp_datum_t>(socket)),
                                   SCMP_A4(SCMP_CMP_EQ, 0)};
    const scmp_arg_cmp memory[] = {SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0),
                                   SCMP_A3(SCMP_CMP_MASKED_EQ, MAP_SHARED, 0)};
    const auto allow = [&](int call, unsigned count, const scmp_arg_cmp* conditions) {
        good =
            good && ::seccomp_rule_add_array(rules, SCMP_ACT_ALLOW, call, count, conditions) == 0;
    };
    allow(SCMP_SYS(sendto), 2, answer);
    allow(SCMP_SYS(write), 1, answer);
    allow(SCMP_SYS(mmap), 2, memory);
    allow(SCMP_SYS(mprotect), 1, memory);
    const int file = ::memfd_create("filter", MFD_CLOEXEC);
    good = good && file >= 0 && ::seccomp_export_bpf(rules, file) == 0;
    ::seccomp_release(rules);
    static_assert(sizeof(sock_filter) == sizeof(std::uint64_t));
    const off_t size = good ? ::lseek(file, 0, SEEK_END) : 0;
    program_.resize(static_cast<std::size_t>(size) / sizeof(sock_filter));
    if (good && ::pread(file, program_.data(), static_cast<std::size_t>(size), 0) != size)
        program_.clear();
    if (file >= 0) ::close(file);
}

bool Filter::apply() const {
    if (program_.empty()) return false;
    const sock_fprog program = {
        static_cast<unsigned short>(program_.size()),
        reinterpret_cast<sock_filter*>(const_cast<std::uint64_t*>(program_.data()))};
    return ::syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, 0, &program) == 0;
}

std::string nameOf(int file) {
    return "/proc/self/fd/" + std::to_string(file);
}

void answerFiltered([[maybe_unused]] int file) {
#ifdef STX_ANSWERS_FILTERED
    ownFile = file;
    if (file >= 0) std::snprintf(ownName, sizeof(ownName), "%s", nameOf(file).c_str());
    struct sigaction how = {};
    how.sa_sigaction = onFiltered;
    how.sa_flags = SA_SIGINFO | SA_NODEFER;
    ::sigaction(SIGSYS, &how, nullptr);
#endif
}

bool forbidFiles() {
    // All that the first version knows; none is given back by a rule.
    landlock_ruleset_attr handled = {};
    handled.handled_access_fs = (LANDLOCK_ACCESS_FS_MAKE_SYM << 1) - 1;
    const auto rules =
        static_cast<int>(::syscall(SYS_landlock_create_ruleset, &handled, sizeof(handled), 0));
    if (rules < 0) return false;
    const bool done = ::syscall(SYS_landlock_restrict_self, rules, 0) == 0;
    ::close(rules);
    return done;
}

void forbidCommon() {
    ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
    limit(RLIMIT_CORE, 0);
    limit(RLIMIT_FSIZE, 0);
}

std::uint64_t dataBytes() {
    unsigned long size = 0, resident = 0, shared = 0, code = 0, libraries = 0, data = 0;
    std::FILE* file = std::fopen("/proc/self/statm", "r");
    if (!file) return 0;
    if (std::fscanf(file, "%lu %lu %lu %lu %lu %lu", &size, &resident, &shared, &code, &libraries,
                    &data) != 6)
        data = 0;
    std::fclose(file);
    return std::uint64_t{data} * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

void limitMemory(std::uint64_t bytes) {
    limit(RLIMIT_DATA, bytes);
}

void limitSeconds(std::uint32_t seconds) {
    // At the second one the kernel kills.
    const rlimit bound = {seconds, std::uint64_t{seconds} + 1};
    ::setrlimit(RLIMIT_CPU, &bound);
}

}  // namespace stx::decoders

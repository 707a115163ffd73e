#include "formats/images/isolated_decode.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <string>
#include <vector>

#include "formats/files/temporaries.hpp"
#include "lib/base/result.hpp"

namespace stx {

namespace {

using codecs::DecodeRequest;
using codecs::Failure;
using codecs::Header;

enum class Tag : std::uint32_t { header = 1, pixels = 2, failure = 3 };

constexpr int kPatienceMs = 30000;

std::size_t bytesOf(const Header& header) {
    return static_cast<std::size_t>(header.width) * header.height * header.channels *
           (header.bits / 8);
}

bool sendAll(int fd, const void* bytes, std::size_t size) {
    const auto* from = static_cast<const char*>(bytes);
    while (size > 0) {
        const auto n = ::write(fd, from, size);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return false;
        from += n;
        size -= static_cast<std::size_t>(n);
    }
    return true;
}

/// False at the end, an error, or when nothing comes for too long.
bool receiveAll(int fd, void* bytes, std::size_t size) {
    auto* to = static_cast<char*>(bytes);
    while (size > 0) {
        pollfd ready = {fd, POLLIN, 0};
        const int polled = ::poll(&ready, 1, kPatienceMs);
        if (polled < 0 && errno == EINTR) continue;
        if (polled <= 0) return false;
        const auto n = ::read(fd, to, size);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return false;
        to += n;
        size -= static_cast<std::size_t>(n);
    }
    return true;
}

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

/// What the child's allocate() needs.
struct Child {
    const DecodeRequest& outer;
    int fd;
    Header header;
    void* values = nullptr;
};

void* allocateAndTell(void* context, const Header& header, Failure& failure) {
    auto& child = *static_cast<Child*>(context);
    child.header = header;
    child.values = child.outer.allocate(child.outer.context, header, failure);
    if (!child.values) return nullptr;
    const Tag tag = Tag::header;
    bool sent = sendAll(child.fd, &tag, sizeof(tag)) && sendAll(child.fd, &header, sizeof(header));
    for (int i = 0; sent && i < header.channels; ++i) {
        const auto length = static_cast<std::uint32_t>(std::strlen(header.channelNames[i]));
        sent = sendAll(child.fd, &length, sizeof(length)) &&
               sendAll(child.fd, header.channelNames[i], length);
    }
    if (!sent) ::_exit(1);
    return child.values;
}

[[noreturn]] void runChild(const codecs::Table& table, const DecodeRequest& request, int fd,
                           std::uint64_t maxMemoryBytes) {
    for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGPIPE, SIGXCPU, SIGTERM})
        ::signal(signal, SIG_DFL);
    const rlimit noCore = {0, 0};
    const rlimit time = {kPatienceMs / 1000, kPatienceMs / 1000 + 1};
    ::setrlimit(RLIMIT_CORE, &noCore);
    ::setrlimit(RLIMIT_CPU, &time);
    const std::uint64_t dataNow = dataBytes();
    const std::uint64_t allowed = dataNow + maxMemoryBytes + (maxMemoryBytes >> 1) + (256u << 20);
    const rlimit memory = {allowed, allowed};
    if (dataNow) ::setrlimit(RLIMIT_DATA, &memory);
    // Libraries and the C library print about what kills them.
    const int null = ::open("/dev/null", O_WRONLY);
    if (null >= 0) ::dup2(null, STDERR_FILENO);

    Child child{request, fd, {}};
    DecodeRequest inner = request;
    inner.context = &child;
    inner.allocate = allocateAndTell;
    Failure failure;
    const bool good = table.decode(inner, failure);
    const Tag tag = good ? Tag::pixels : Tag::failure;
    bool sent = sendAll(fd, &tag, sizeof(tag));
    sent = sent && (good ? sendAll(fd, child.values, bytesOf(child.header))
                         : sendAll(fd, &failure, sizeof(failure)));
    ::_exit(sent ? 0 : 1);
}

/// Ends and buries the child whatever happens.
class ChildGuard {
  public:
    explicit ChildGuard(pid_t pid) : pid_(pid) {}
    ~ChildGuard() {
        ::kill(pid_, SIGKILL);
        while (::waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
        }
    }
    ChildGuard(const ChildGuard&) = delete;
    ChildGuard& operator=(const ChildGuard&) = delete;

  private:
    pid_t pid_;
};

bool failWith(Failure& failure, ErrorCode code, const std::string& message) {
    failure.code = static_cast<int>(code);
    const std::size_t length = std::min(message.size(), sizeof(failure.message) - 1);
    std::memcpy(failure.message, message.data(), length);
    failure.message[length] = 0;
    return false;
}

}  // namespace

bool decodeIsolated(const codecs::Table& table, const DecodeRequest& request,
                    std::uint64_t maxMemoryBytes, Failure& failure) {
    // A child gets copies of all descriptors, also of other children's pipes, whose ends it would
    // hold open: so there is only its own while it is made. The decoding itself runs side by side.
    static std::mutex making;
    std::unique_lock lock(making);
    int ends[2] = {-1, -1};
    if (::pipe2(ends, O_CLOEXEC) != 0)
        return failWith(failure, ErrorCode::failed, "no pipe to a decoder can be made");
    const Descriptor in(ends[0]);
    Descriptor out(ends[1]);
    const pid_t pid = ::fork();
    if (pid < 0)
        return failWith(failure, ErrorCode::failed, "no process for a decoder can be made");
    if (pid == 0) runChild(table, request, out.get(), maxMemoryBytes);
    const ChildGuard guard(pid);
    out.close();
    lock.unlock();

    const auto died = [&] {
        return failWith(failure, ErrorCode::invalidInput,
                        "its decoder crashed or did not end; the file is damaged");
    };
    Header header;
    void* values = nullptr;
    for (;;) {
        Tag tag{};
        if (!receiveAll(in.get(), &tag, sizeof(tag))) return died();
        if (tag == Tag::failure) {
            if (!receiveAll(in.get(), &failure, sizeof(failure))) return died();
            failure.message[sizeof(failure.message) - 1] = 0;
            return false;
        }
        if (tag == Tag::pixels && values)
            return receiveAll(in.get(), values, bytesOf(header)) || died();
        if (tag != Tag::header || values || !receiveAll(in.get(), &header, sizeof(header)))
            return died();
        if (header.channels < 1 || header.channels > 1024) return died();
        std::vector<std::string> names(static_cast<std::size_t>(header.channels));
        std::vector<const char*> pointers;
        for (auto& name : names) {
            std::uint32_t length = 0;
            if (!receiveAll(in.get(), &length, sizeof(length)) || length > 65536) return died();
            name.resize(length);
            if (!receiveAll(in.get(), name.data(), length)) return died();
            pointers.push_back(name.c_str());
        }
        header.channelNames = pointers.data();
        values = request.allocate(request.context, header, failure);
        if (!values) return false;
    }
}

}  // namespace stx

#include "formats/decoders/decoder_process.hpp"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <map>
#include <mutex>

#include "formats/files/module.hpp"

extern char** environ;

namespace stx {
namespace {

using decoders::Tag;

constexpr int kControl = 3;  ///< descriptor of stx-decode on which it is asked for processes
constexpr std::uint64_t kLargestNews = 1 << 16;  ///< a greeting or an error

std::atomic<bool> unfiltered = false, mustFilter = false;

tl::unexpected<Error> noConnection() {
    return fail(ErrorCode::failed,
                "no connection to a decoder can be made: {}; close other programs, or raise what "
                "bounds open files here (ulimit -n)",
                std::strerror(errno));
}

/// What to do where no process begins.
std::string wayToABeginning() {
    std::string bounds;
    for (const auto& [resource, name] :
         {std::pair{RLIMIT_AS, "memory (ulimit -v)"}, std::pair{RLIMIT_DATA, "data (ulimit -d)"},
          std::pair{RLIMIT_FSIZE, "sizes of files (ulimit -f)"}}) {
        rlimit bound = {};
        if (::getrlimit(resource, &bound) == 0 && bound.rlim_cur != RLIM_INFINITY)
            bounds += fmt::format("{}{}", bounds.empty() ? "" : " and ", name);
    }
    if (bounds.empty()) return "install the stx package anew";
    return fmt::format("this shell bounds {}: raise that, or install the stx package anew", bounds);
}

/// A running stx-decode with the libraries of one module.
struct Template {
    Descriptor control;
    pid_t pid = -1;
    std::string program;
};

/// stx-decode in the first of its places, and its end of a connection. All other descriptors are
/// closed in it, whoever opened them.
Result<Template> startTemplate(const std::vector<std::string>& modulePlaces) {
    std::string tried;
    Template made;
    for (const auto& place : placesOfDecoder()) {
        tried += fmt::format("{}'{}'", tried.empty() ? "" : ", ", place);
        if (made.program.empty() && ::access(place.c_str(), F_OK) == 0) made.program = place;
    }
    if (made.program.empty())
        return fail(ErrorCode::unsupported,
                    "the program stx-decode, which reads foreign files, is not at {}; install the "
                    "stx package whole, or name the program in STX_DECODE",
                    tried);
    int ends[2] = {-1, -1};
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) return noConnection();
    made.control = Descriptor(ends[0]);
    const Descriptor low(ends[1]);
    // Above what is opened below for it.
    const Descriptor there(::fcntl(low.get(), F_DUPFD_CLOEXEC, kControl + 1));
    posix_spawn_file_actions_t files;
    posix_spawnattr_t how;
    ::posix_spawn_file_actions_init(&files);
    ::posix_spawnattr_init(&how);
    // Libraries and the C library print about what kills them.
    for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        ::posix_spawn_file_actions_addopen(&files, fd, "/dev/null", O_RDWR, 0);
    // It may end a moment after this process, and must not keep a disk busy.
    ::posix_spawn_file_actions_addchdir_np(&files, "/");
    ::posix_spawn_file_actions_adddup2(&files, there.get(), kControl);
    ::posix_spawn_file_actions_addclosefrom_np(&files, kControl + 1);
    sigset_t none, all;
    ::sigemptyset(&none);
    ::sigfillset(&all);
    ::posix_spawnattr_setsigmask(&how, &none);
    ::posix_spawnattr_setsigdefault(&how, &all);
    ::posix_spawnattr_setflags(&how, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    std::error_code ec;
    std::string program = std::filesystem::absolute(made.program, ec).string();
    std::vector<char*> arguments = {program.data()};
    auto places = modulePlaces;
    for (auto& place : places) place = std::filesystem::absolute(place, ec).string();
    for (auto& place : places) arguments.push_back(place.data());
    arguments.push_back(nullptr);
    const int error =
        ::posix_spawn(&made.pid, program.c_str(), &files, &how, arguments.data(), environ);
    ::posix_spawn_file_actions_destroy(&files);
    ::posix_spawnattr_destroy(&how);
    if (error != 0)
        return fail(ErrorCode::failed, "the decoder '{}' cannot be started: {}", made.program,
                    std::strerror(error));
    return made;
}

/// One stx-decode for each module, for the life of this process: it ends when its connections do.
class Templates {
  public:
    /// Asks for a process at the other end of `socket`, of another one than `gone`. Gives the one
    /// that was asked.
    Result<std::shared_ptr<const Template>> launch(const DecoderKind& kind,
                                                   const decoders::Launch& launch, int socket,
                                                   int file, std::shared_ptr<const Template> gone) {
        // One that has been killed since it was used last is noticed here, or when nothing answers.
        for (int i = 0; i < 2; ++i) {
            STX_TRY(gone, find(kind, gone));
            if (ask(gone->control.get(), launch, socket, file)) break;
        }
        return gone;
    }

    /// The one that is there, or a new one where that is `gone`.
    Result<std::shared_ptr<const Template>> find(const DecoderKind& kind,
                                                 const std::shared_ptr<const Template>& gone = {}) {
        const std::lock_guard lock(mutex_);
        const auto places = placesOfModule(kind.variable, kind.module);
        auto& one = templates_[fmt::format("{}:{}", fmt::join(placesOfDecoder(), ":"),
                                           fmt::join(places, ":"))];
        if (one && one == gone) {
            ::waitpid(one->pid, nullptr, WNOHANG);
            one.reset();
        }
        if (!one) {
            STX_TRY(auto made, startTemplate(places));
            one = std::make_shared<const Template>(std::move(made));
        }
        return one;
    }

  private:
    static bool ask(int control, const decoders::Launch& launch, int socket, int file) {
        const int descriptors[2] = {socket, file};
        const std::size_t count = file < 0 ? 1 : 2;
        alignas(cmsghdr) char room[CMSG_SPACE(sizeof(descriptors))] = {};
        iovec bytes = {const_cast<decoders::Launch*>(&launch), sizeof(launch)};
        msghdr message = {};
        message.msg_iov = &bytes;
        message.msg_iovlen = 1;
        message.msg_control = room;
        message.msg_controllen = CMSG_SPACE(count * sizeof(int));
        cmsghdr* attached = CMSG_FIRSTHDR(&message);
        attached->cmsg_level = SOL_SOCKET;
        attached->cmsg_type = SCM_RIGHTS;
        attached->cmsg_len = CMSG_LEN(count * sizeof(int));
        std::memcpy(CMSG_DATA(attached), descriptors, count * sizeof(int));
        for (;;) {
            if (::sendmsg(control, &message, MSG_NOSIGNAL) == sizeof(launch)) return true;
            if (errno != EINTR) return false;
        }
    }

    std::mutex mutex_;
    std::map<std::string, std::shared_ptr<const Template>> templates_;
};

/// Never taken down: threads may still decode while the process ends.
Templates& templates() {
    static auto* const all = new Templates;
    return *all;
}

enum class First { came, ended, late };

/// The first byte from a new process, and its pidfd when there is one.
First receiveFirst(int socket, Descriptor& process, int patienceMs) {
    pollfd ready = {socket, POLLIN, 0};
    int polled = 0;
    while ((polled = ::poll(&ready, 1, patienceMs)) < 0 && errno == EINTR) {
    }
    char first = 0;
    alignas(cmsghdr) char room[CMSG_SPACE(sizeof(int))] = {};
    iovec bytes = {&first, 1};
    msghdr message = {};
    message.msg_iov = &bytes;
    message.msg_iovlen = 1;
    message.msg_control = room;
    message.msg_controllen = sizeof(room);
    if (polled <= 0) return First::late;
    if (::recvmsg(socket, &message, MSG_CMSG_CLOEXEC) != 1) return First::ended;
    const cmsghdr* attached = CMSG_FIRSTHDR(&message);
    if (attached && attached->cmsg_type == SCM_RIGHTS &&
        attached->cmsg_len == CMSG_LEN(sizeof(int))) {
        int fd = -1;
        std::memcpy(&fd, CMSG_DATA(attached), sizeof(fd));
        process = Descriptor(fd);
    }
    return First::came;
}

}  // namespace

std::vector<std::string> placesOfDecoder() {
    return placesOfHelper("STX_DECODE", "stx-decode");
}

Result<std::unique_ptr<DecoderProcess>> DecoderProcess::start(const DecoderKind& kind,
                                                              const DecoderBounds& bounds,
                                                              int file) {
    decoders::Launch launch;
    launch.cpuSeconds = static_cast<std::uint32_t>(bounds.cpuSeconds);
    launch.memoryBytes = bounds.memoryBytes;
    launch.mustFilter = mustFilter;
    std::unique_ptr<DecoderProcess> process;
    std::shared_ptr<const Template> from;
    for (bool again = false;; again = true) {
        int ends[2] = {-1, -1};
        if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) return noConnection();
        process = over(Descriptor(ends[0]), bounds);
        Descriptor there(ends[1]);
        STX_TRY(from, templates().launch(kind, launch, there.get(), file, from));
        there.close();  // so that the end of the other one is seen
        const First first =
            receiveFirst(process->socket_.get(), process->process_, bounds.patienceMs);
        if (first == First::came) break;
        if (again || first == First::late)
            return fail(ErrorCode::failed,
                        "the decoder '{}' ended before it began, or does not answer; {}",
                        from->program, wayToABeginning());
    }
    STX_CHECK(process->meet(kind, from->program));
    return process;
}

Result<std::unique_ptr<DecoderProcess>> DecoderProcess::start(const DecoderKind& kind,
                                                              const DecoderBounds& bounds,
                                                              ByteSpan file) {
    const Descriptor copy(::memfd_create("stx", MFD_CLOEXEC));
    const bool written = [&, left = file]() mutable {
        while (!left.empty()) {
            const auto n = ::write(copy.get(), left.data(), left.size());
            if (n < 0 && errno == EINTR) continue;
            if (n <= 0) return false;
            left = left.subspan(static_cast<std::size_t>(n));
        }
        return true;
    }();
    if (written) return start(kind, bounds, copy.get());
    // A bound on the size of files (ulimit -f) is one on this, too.
    STX_TRY(auto process, start(kind, bounds));
    process->send(Tag::fileIs, file);
    return process;
}

std::unique_ptr<DecoderProcess> DecoderProcess::over(Descriptor socket,
                                                     const DecoderBounds& bounds) {
    std::unique_ptr<DecoderProcess> process(new DecoderProcess());
    process->socket_ = std::move(socket);
    process->bounds_ = bounds;
    return process;
}

Result<void> DecoderProcess::meet(const DecoderKind& kind, const std::string& program) {
    Tag tag{};
    Bytes news;
    if (!receiveMessage(tag, news, kLargestNews) && end_ != End::senseless) return lost();
    if (end_ == End::senseless)
        return fail(ErrorCode::failed,
                    "the decoder '{}' is of another version; install the stx package anew",
                    program);
    if (tag == Tag::failure) {
        const Error error = errorIn(news);
        if (error.code != ErrorCode::io) return tl::unexpected(error);
        return fail(ErrorCode::unsupported, "{}: {}; {}", kind.missing, error.message, kind.wayOut);
    }
    decoders::Unpacker in(news);
    isolation_ = in.get<decoders::Hello>();
    libraries_ = in.getText();
    if (tag != Tag::hello || !in.ok())
        return fail(ErrorCode::failed, "the decoder '{}' answers what has no sense", program);
    if (!isolation_.seccomp) unfiltered = true;
    return {};
}

DecoderProcess::~DecoderProcess() {
    if (process_.get() >= 0) ::syscall(SYS_pidfd_send_signal, process_.get(), SIGKILL, nullptr, 0);
}

bool DecoderProcess::heard(bool well) {
    if (well) return true;
    pollfd ready = {socket_.get(), POLLIN, 0};
    char next = 0;
    if (::poll(&ready, 1, 0) == 0)
        end_ = End::silent;
    else
        end_ = ::recv(socket_.get(), &next, 1, MSG_DONTWAIT) == 1 ? End::senseless : End::killed;
    return false;
}

void DecoderProcess::send(Tag tag, ByteSpan bytes) {
    if (end_ == End::none) (void)decoders::sendMessage(socket_.get(), tag, bytes);
}

bool DecoderProcess::receive(void* bytes, std::size_t size) {
    return end_ == End::none && heard(receiveAll(socket_.get(), bytes, size, bounds_.patienceMs));
}

bool DecoderProcess::receiveHead(decoders::MessageHead& head) {
    if (end_ != End::none ||
        !heard(receiveAll(socket_.get(), &head, sizeof(head), bounds_.patienceMs)))
        return false;
    if (head.magic != decoders::kMagic) end_ = End::senseless;
    if (head.tag == Tag::timeUp) end_ = End::timeUp;
    if (head.tag == Tag::crashed) end_ = End::crashed;
    return end_ == End::none;
}

bool DecoderProcess::receiveMessage(Tag& tag, Bytes& bytes, std::uint64_t most) {
    decoders::MessageHead head;
    if (!receiveHead(head)) return false;
    if (head.size > most) {
        end_ = End::senseless;
        return false;
    }
    tag = head.tag;
    bytes.resize(head.size);
    return receive(bytes.data(), bytes.size());
}

tl::unexpected<Error> DecoderProcess::lost() const {
    switch (end_) {
        case End::killed:
            return fail(ErrorCode::failed,
                        "its decoder was killed, perhaps for lack of memory; try again while less "
                        "else runs");
        case End::silent:
            return fail(ErrorCode::failed,
                        "its decoder did not answer for {:g} s; try again while less else runs",
                        bounds_.patienceMs / 1000.0);
        case End::timeUp:
            return fail(ErrorCode::failed,
                        "its decoder did not end within {} s of processor time; is the file "
                        "damaged?",
                        bounds_.cpuSeconds);
        case End::crashed:
            return fail(ErrorCode::invalidInput, "the file is damaged: its decoder crashes on it");
        case End::senseless:
        case End::none:  // what came was well formed, and not what was asked for
            break;
    }
    return fail(ErrorCode::invalidInput,
                "the file is damaged: what its decoder answers has no sense");
}

void prepareDecoder(const DecoderKind& kind) {
    (void)templates().find(kind);
}

Error errorIn(ByteSpan failure) {
    decoders::Unpacker in(failure);
    const auto code = in.get<std::int32_t>();
    std::string text = in.getText();
    if (!in.ok() || text.empty())
        return {ErrorCode::invalidInput, "the file is damaged: its decoder crashes on it", {}};
    const bool known = code == static_cast<int>(ErrorCode::io) ||
                       code == static_cast<int>(ErrorCode::unsupported) ||
                       code == static_cast<int>(ErrorCode::failed);
    return {known ? static_cast<ErrorCode>(code) : ErrorCode::invalidInput, std::move(text), {}};
}

void requireFiltered() {
    mustFilter = true;
}

bool ranUnfiltered() {
    return unfiltered;
}

}  // namespace stx

#include "tools/standard_streams.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <vector>

namespace stx::tools {
namespace {

constexpr const char* kStandardInput = "/dev/stdin";
std::atomic<bool> standardInputWanted = false;

}  // namespace

void openClosedStreams() {
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
        if (::fcntl(stream, F_GETFD) >= 0 || errno != EBADF) continue;
        // Gets the lowest number that is free, which is this one; the wrong way round, so that
        // using it fails as it did.
        (void)::open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY);
    }
}

std::string inputNamed(std::string input) {
    if (input == "-") input = kStandardInput;
    if (input == kStandardInput) standardInputWanted = true;
    return input;
}

Result<void> takeStandardInput(const Limits& limits) {
    struct stat facts = {};
    if (!standardInputWanted || (::fstat(STDIN_FILENO, &facts) == 0 && S_ISREG(facts.st_mode)))
        return {};
    const auto failed = [] {
        return fail(ErrorCode::io, "cannot read standard input: {}", std::strerror(errno));
    };
    const int memory = ::memfd_create("stdin", MFD_CLOEXEC);
    if (memory < 0) return failed();
    std::vector<char> block(1 << 20);
    for (std::uint64_t taken = 0;;) {
        const auto n = ::read(STDIN_FILENO, block.data(), block.size());
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) return failed();
        if (n == 0) break;
        taken += static_cast<std::uint64_t>(n);
        STX_CHECK(limits.checkAllocation(taken, 1, "standard input"));
        for (ssize_t done = 0; done < n;) {
            const auto put =
                ::write(memory, block.data() + done, static_cast<std::size_t>(n - done));
            if (put < 0 && errno != EINTR) return failed();
            if (put > 0) done += put;
        }
    }
    if (::dup2(memory, STDIN_FILENO) < 0) return failed();
    ::close(memory);
    return {};
}

void writeToStderr(std::string_view text) noexcept {
    (void)std::fwrite(text.data(), 1, text.size(), stderr);
}

}  // namespace stx::tools

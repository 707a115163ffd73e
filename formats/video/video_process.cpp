#include "formats/video/video_process.hpp"

#include <unistd.h>

#include <algorithm>
#include <climits>
#include <csignal>

#include "formats/video/video_module.hpp"

namespace stx {
namespace {

/// Beside the limit: what the libraries need before they decode.
constexpr std::uint64_t kOwnMemory = 256u << 20;

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
    confineChild(maxMemoryBytes + kOwnMemory);
    // Ctrl-C goes to the whole group; the parent ends this process.
    ::signal(SIGINT, SIG_IGN);
    closeOthers({socket, file});
    table.serve(socket, file);
    ::_exit(0);
}

}  // namespace

Result<std::unique_ptr<VideoProcess>> VideoProcess::start(const Limits& limits, Descriptor file) {
    STX_TRY(const video::Table* table, loadVideo());
    std::unique_ptr<VideoProcess> process(new VideoProcess());
    STX_TRY(process->child_, ChildProcess::start([&](int socket) {
                runVideo(*table, socket, file.get(), limits.maxMemoryBytes);
            }));
    process->most_ = limits.maxMemoryBytes;
    return process;
}

Result<Bytes> VideoProcess::ask(video::Tag request, ByteSpan bytes, video::Tag expected) {
    const auto died = [&]() -> tl::unexpected<Error> {
        broken_ = true;
        return fail(ErrorCode::invalidInput,
                    "its decoder crashed or did not end; the video is damaged, or needs more "
                    "memory than --max-memory allows");
    };
    if (broken_) return died();
    if (!video::sendMessage(child_->socket(), request, bytes)) return died();
    video::Tag tag{};
    Bytes answer;
    if (!video::receiveMessage(child_->socket(), tag, answer, most_, ChildProcess::kPatienceMs))
        return died();
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

// What a process that decodes foreign files may say of a picture or a model, when a file has taken
// it over. The first byte chooses; the rest is what comes over the socket.

#include <sys/socket.h>

#include <algorithm>

#include "formats/images/foreign_decode.hpp"
#include "formats/meshes/foreign_scene.hpp"
#include "formats/video/video_picture.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace stx;
    constexpr std::size_t kMost = 100'000;  // what a socket takes without a reader
    if (size < 1) return 0;
    const int which = data[0] % 3;
    const auto said = std::as_bytes(std::span(data + 1, std::min(size - 1, kMost)));
    Limits limits;
    limits.maxMemoryBytes = 16 << 20;
    if (which == 2) {
        (void)VideoPicture::from(Bytes(said.begin(), said.end()), limits);
        return 0;
    }
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_STREAM, 0, ends) != 0) return 0;
    const Descriptor other(ends[1]);
    (void)sendAll(other.get(), said.data(), said.size());
    ::shutdown(other.get(), SHUT_WR);
    const auto process = DecoderProcess::over(Descriptor(ends[0]), DecoderBounds{});
    if (which == 0) {
        (void)receivePicture(*process, 1000, limits);
        return 0;
    }
    decoders::Tag tag{};
    Bytes scene;
    if (process->receiveMessage(tag, scene, limits.maxMemoryBytes) && tag == decoders::Tag::scene)
        (void)receiveScene(*process, scene, limits);
    return 0;
}

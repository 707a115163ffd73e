#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "formats/files/pipes.hpp"

/// What is said between this process and one that decodes (formats/decoders/README.md): messages,
/// each behind a head that tells the protocol's version, what it is and its length. Both ends are
/// of one machine, so values go as they are in memory. A header alone, for modules too.
namespace stx::decoders {

/// Changes with every change of what is said.
inline constexpr std::uint32_t kWireVersion = 6;
inline constexpr std::uint32_t kMagic = 0x57585453 + (kWireVersion << 24);  ///< "STX", version

enum class Tag : std::uint32_t {
    // Of all decoders, to this process.
    hello = 1,  ///< Hello, then the text of Module::libraries
    failure,    ///< int32 ErrorCode, text
    timeUp,     ///< it has taken the seconds that it has, and ends
    crashed,    ///< it ends by a signal of its own making
    noMemory,   ///< it needs more memory than it has
    done,
    // Pictures.
    decodePicture = 100,  ///< text: a name with the ending of the format
    pictureHeader,        ///< PictureFacts (formats/images/picture_wire.hpp), names of channels
    pixels,
    decodeItem,  ///< uint32: an item of a HEIF file; uint8: as grey; answered like decodePicture
    // Models.
    readModel = 200,  ///< text: a name with the ending of the format
    askExists,        ///< text: does the model have this file?
    askFile,          ///< text: what is in it?
    fileIs,           ///< uint8: whether it is there; its bytes, when they were asked for
    scene,            ///< ForeignScene (formats/meshes), then its meshes, one message each
    mesh,
    // Video: requests.
    openFilm = 300,  ///< text: name of the container's reader
    selectTrack,     ///< int32: a track of the film
    readOn,          ///< reads the next part of the track, for where its pictures are
    seek,            ///< int64, int64: where to read on, in the track's ticks: seconds by dts, pts
    step,            ///< int64: feed the next access unit of the track; the time that is wanted
    openStream,      ///< int32 objectTypeIndication; bytes: the decoder's configuration
    push,            ///< int64 time, int64 wanted, bytes: feed this access unit
    end,             ///< int64 wanted: nothing comes after; gives what waits in the decoder
    flush,           ///< forget what came so far
    take,            ///< int64: the picture of that time, which is ready
    openEncoder,     ///< EncoderRequest
    encode,          ///< int32 encoder, int64 time, bytes: planes
    finishEncoder,   ///< int32 encoder
    // Video: answers, beside `done`.
    film = 400,  ///< tracks, attachments
    index,       ///< of a part of a track: whether it is the last, text: why pictures may be
                 ///< missing, access units (pts, dts, duration, whether decoding can begin there,
                 ///< whether it is hidden)
    ready,       ///< uint8: the track has ended; then the times of pictures that can be taken
    picture,     ///< PictureHeader, then its samples
    encoder,     ///< bytes: the decoder's configuration
    coded,       ///< access units
};

/// How a decoder's process is held, as it says of itself.
struct Hello {
    std::uint8_t seccomp = 0;   ///< system calls are filtered
    std::uint8_t landlock = 0;  ///< no file can be opened, by the kernel's own rules
    std::uint8_t unused[6] = {};
};

/// What is sent with the descriptors of a socket and, at times, a file, for a process to be
/// started.
struct Launch {
    std::uint32_t magic = kMagic;
    std::uint32_t cpuSeconds = 0;  ///< 0: as many as it likes
    std::uint64_t memoryBytes =
        0;                        ///< of data, beside what the libraries have when they are loaded
    std::uint8_t mustFilter = 0;  ///< fails where system calls cannot be filtered
    std::uint8_t unused[7] = {};
};

/// Puts values behind each other.
class Packer {
  public:
    template <class T>
    void put(const T& value) {
        static_assert(std::is_trivially_copyable_v<T>);
        add(&value, sizeof(T));
    }
    void putBytes(std::span<const std::byte> from) {
        put(static_cast<std::uint64_t>(from.size()));
        add(from.data(), from.size());
    }
    void putText(std::string_view text) { putBytes(std::as_bytes(std::span(text))); }

    /// Bytes without their number: the last of a message.
    void add(const void* from, std::size_t size) {
        const std::size_t at = bytes.size();
        bytes.resize(at + size);
        if (size > 0) std::memcpy(bytes.data() + at, from, size);
    }

    std::vector<std::byte> bytes;
};

/// Takes them apart again; what is not there is 0 or empty, and ok() false.
class Unpacker {
  public:
    explicit Unpacker(std::span<const std::byte> bytes) : bytes_(bytes) {}
    template <class T>
    T get() {
        static_assert(std::is_trivially_copyable_v<T>);
        T value{};
        if (bytes_.size() < sizeof(T)) {
            ok_ = false;
            return value;
        }
        std::memcpy(&value, bytes_.data(), sizeof(T));
        bytes_ = bytes_.subspan(sizeof(T));
        return value;
    }
    std::span<const std::byte> getBytes() {
        const auto size = get<std::uint64_t>();
        if (size > bytes_.size()) {
            ok_ = false;
            return {};
        }
        const auto out = bytes_.first(size);
        bytes_ = bytes_.subspan(size);
        return out;
    }
    std::string getText() {
        const auto bytes = getBytes();
        return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
    }
    [[nodiscard]] bool ok() const { return ok_; }
    [[nodiscard]] std::span<const std::byte> rest() const { return bytes_; }

  private:
    std::span<const std::byte> bytes_;
    bool ok_ = true;
};

struct MessageHead {
    std::uint32_t magic = kMagic;
    Tag tag{};
    std::uint64_t size = 0;
};

/// The head alone: `size` bytes must follow.
inline bool sendHead(int fd, Tag tag, std::uint64_t size) {
    const MessageHead head{kMagic, tag, size};
    return sendAll(fd, &head, sizeof(head));
}

inline bool sendMessage(int fd, Tag tag, std::span<const std::byte> bytes = {}) {
    return sendHead(fd, tag, bytes.size()) && sendAll(fd, bytes.data(), bytes.size());
}

inline bool sendFailure(int fd, int code, std::string_view text) {
    Packer out;
    out.put(static_cast<std::int32_t>(code));
    out.putText(text);
    return sendMessage(fd, Tag::failure, out.bytes);
}

/// False also for a head of another version.
inline bool receiveHead(int fd, MessageHead& head, int patienceMs) {
    return receiveAll(fd, &head, sizeof(head), patienceMs) && head.magic == kMagic;
}

/// Messages of more than `most` bytes are refused.
inline bool receiveMessage(int fd, Tag& tag, std::vector<std::byte>& bytes, std::uint64_t most,
                           int patienceMs) {
    MessageHead head;
    if (!receiveHead(fd, head, patienceMs) || head.size > most) return false;
    tag = head.tag;
    bytes.resize(head.size);
    return receiveAll(fd, bytes.data(), bytes.size(), patienceMs);
}

}  // namespace stx::decoders

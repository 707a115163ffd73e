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

/// What is said between this process and the one that decodes video: a request and its answer, one
/// after the other. Both ends are of one build and one machine, so values go as they are in memory.
namespace stx::video {

enum class Tag : std::uint32_t {
    // Requests.
    openFilm = 1,   ///< text: name of the container's reader
    selectTrack,    ///< int32: a track of the film
    readOn,         ///< reads the next part of the track, for where its pictures are
    seek,           ///< int64, int64: where to read on, in the track's ticks: seconds by dts, pts
    step,           ///< int64: feed the next access unit of the track; the time that is wanted
    openStream,     ///< int32 objectTypeIndication; bytes: the decoder's configuration
    push,           ///< int64 time, int64 wanted, bytes: feed this access unit
    end,            ///< int64 wanted: nothing comes after; gives what waits in the decoder
    flush,          ///< forget what came so far
    take,           ///< int64: the picture of that time, which is ready
    openEncoder,    ///< EncoderRequest
    encode,         ///< int32 encoder, int64 time, bytes: planes
    finishEncoder,  ///< int32 encoder
    // Answers.
    film = 100,  ///< tracks, attachments
    index,       ///< of a part of a track: whether it is the last, access units (pts, dts,
                 ///< duration, whether decoding can begin there, whether it is hidden)
    done,
    ready,    ///< uint8: the track has ended; then the times of pictures that can be taken
    picture,  ///< PictureHeader, then its samples
    encoder,  ///< bytes: the decoder's configuration
    coded,    ///< access units
    failure,  ///< int32 ErrorCode, text
};

/// How the samples of a picture lie behind this header: planes Y, Cb, Cr from the top, without
/// gaps, or 8-bit RGBA.
struct PictureHeader {
    std::int32_t width = 0, height = 0;
    std::int32_t bits = 8;  ///< of a sample; above 8 in two bytes, little-endian
    std::int32_t chromaShiftX = 0, chromaShiftY = 0;
    std::uint8_t chroma = 0, chromaLeft = 0, bt601 = 0, fullRange = 0, rgba = 0;
    std::uint8_t limitedSaid = 0;  ///< the stream itself says that its range is limited
    std::uint8_t unused[2] = {};
};

struct EncoderRequest {
    std::int32_t width = 0, height = 0;
    std::int32_t bits = 8;  ///< 8 or 10
    /// H.264's chroma_format_idc: 0 is luma alone, 1 4:2:0, 3 4:4:4.
    std::int32_t chromaFormat = 1;
    std::int32_t crf = -1;        ///< 0..51; -1: lossless
    std::uint32_t timescale = 0;  ///< ticks a second
    double rate = 25;             ///< pictures a second, on average
};

/// How players turn and mirror the pictures of a track: what is at (x, y) is shown at (ax + cy,
/// bx + dy), moved into the picture (ISO/IEC 14496-12, 8.3.2). Phones write it.
struct Turn {
    std::int8_t a = 1, b = 0, c = 0, d = 1;
    [[nodiscard]] bool none() const { return a == 1 && d == 1; }
    [[nodiscard]] bool sideways() const { return a == 0; }
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
    Tag tag{};
    std::uint32_t unused = 0;
    std::uint64_t size = 0;
};

inline bool sendMessage(int fd, Tag tag, std::span<const std::byte> bytes = {}) {
    const MessageHead head{tag, 0, bytes.size()};
    return sendAll(fd, &head, sizeof(head)) && sendAll(fd, bytes.data(), bytes.size());
}

/// Messages of more than `most` bytes are refused.
inline bool receiveMessage(int fd, Tag& tag, std::vector<std::byte>& bytes, std::uint64_t most,
                           int patienceMs) {
    MessageHead head;
    if (!receiveAll(fd, &head, sizeof(head), patienceMs) || head.size > most) return false;
    tag = head.tag;
    bytes.resize(head.size);
    return receiveAll(fd, bytes.data(), bytes.size(), patienceMs);
}

}  // namespace stx::video

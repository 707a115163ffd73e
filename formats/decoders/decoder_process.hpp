#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "formats/decoders/wire.hpp"
#include "formats/files/files.hpp"
#include "formats/files/temporaries.hpp"
#include "lib/base/job.hpp"

namespace stx {

/// A library that decodes foreign files, in a module of its own.
struct DecoderKind {
    const char* name;      ///< for people: "the image codecs"
    const char* variable;  ///< of the environment, that names another module
    const char* module;
    /// What cannot be done without it, up to the reason, and how to get it.
    const char *missing, *wayOut;
};

/// A new kind is a row here and a module (formats/decoders/README.md).
namespace decoders {
inline constexpr DecoderKind kImages = {
    "image codecs", "STX_CODECS", "stx_codecs.so",
    "the image codecs (stx_codecs.so, with OpenImageIO) cannot be loaded",
    "install the stx package whole, or name the module in STX_CODECS"};
inline constexpr DecoderKind kModels = {
    "model readers", "STX_MODELS", "stx_models.so",
    "the readers of OBJ, STL, COLLADA and FBX (stx_models.so, with Assimp) cannot be loaded",
    "install the stx package whole, or name the module in STX_MODELS"};
inline constexpr DecoderKind kVideo = {
    "video", "STX_VIDEO", "stx_video.so",
    "compressed video needs the module stx_video.so, which cannot be loaded",
    "install the Debian packages libavformat59, libavcodec59 and libswscale6, and stx with its "
    "module"};
inline constexpr DecoderKind kHeif = {
    "HEIC", "STX_HEIF", "stx_heif.so",
    "HEIC needs the module stx_heif.so (with libheif), which cannot be loaded",
    "install the Debian packages libheif1 and libde265-0, and stx with its module"};
}  // namespace decoders

/// What a decoder may take.
struct DecoderBounds {
    std::uint64_t memoryBytes = 0;  ///< of data, beside what its libraries have by themselves
    int cpuSeconds = 0;             ///< for all of its life; 0: no bound
    int patienceMs = 30000;         ///< that it may keep us waiting
};

/// A process that decodes one file, away from this one: decoders crash on damaged files, and
/// hostile ones take them over. It is a copy of the program `stx-decode`, which has the libraries
/// loaded and has seen no file, so nothing of one file can change what is read of another. It can
/// open, connect to, start and see nothing, has bounded memory, and dies with this object.
class DecoderProcess {
  public:
    /// `file` is what it decodes, open for reading; none (-1) where it gets all by messages. Safe
    /// from several threads, whose processes run side by side. Errors: (unsupported) stx-decode or
    /// the module is not here, or system calls cannot be filtered where they must be; (failed) no
    /// process, or it ended before it began.
    [[nodiscard]] static Result<std::unique_ptr<DecoderProcess>> start(const DecoderKind& kind,
                                                                       const DecoderBounds& bounds,
                                                                       int file = -1);
    /// The same, for bytes in memory.
    [[nodiscard]] static Result<std::unique_ptr<DecoderProcess>> start(const DecoderKind& kind,
                                                                       const DecoderBounds& bounds,
                                                                       ByteSpan file);
    /// The other end of `socket` speaks: for tests of what it may say.
    [[nodiscard]] static std::unique_ptr<DecoderProcess> over(Descriptor socket,
                                                              const DecoderBounds& bounds);

    ~DecoderProcess();
    DecoderProcess(const DecoderProcess&) = delete;
    DecoderProcess& operator=(const DecoderProcess&) = delete;

    /// Where nobody hears it, what is received next tells.
    void send(decoders::Tag tag, ByteSpan bytes = {});

    // Each is false when it is gone, says nothing for too long, or what it says has no sense; from
    // then on they all are, and lost() says why.
    /// Bytes of a message whose head has come.
    [[nodiscard]] bool receive(void* bytes, std::size_t size);
    [[nodiscard]] bool receiveHead(decoders::MessageHead& head);
    /// A message of at most so many bytes.
    [[nodiscard]] bool receiveMessage(decoders::Tag& tag, Bytes& bytes, std::uint64_t most);

    /// Why nothing more comes, in the words of who asked for a picture or a model: (invalidInput)
    /// it crashed, or answered what has no sense; (failed) it was killed, or took too long.
    [[nodiscard]] tl::unexpected<Error> lost() const;

    /// What it runs: "libavformat 59.27.100, libavcodec 59.37.100".
    [[nodiscard]] const std::string& libraries() const { return libraries_; }
    [[nodiscard]] const decoders::Hello& isolation() const { return isolation_; }

  private:
    enum class End { none, crashed, timeUp, killed, silent, senseless };
    DecoderProcess() = default;
    /// Whether all went well; else remembers why not.
    bool heard(bool well);
    [[nodiscard]] Result<void> meet(const DecoderKind& kind, const std::string& program);

    Descriptor socket_;
    Descriptor process_;  ///< a pidfd; none where the kernel has none
    DecoderBounds bounds_;
    std::string libraries_;
    decoders::Hello isolation_;
    End end_ = End::none;
};

/// Begins to load the libraries of a kind, beside what this process does.
void prepareDecoder(const DecoderKind& kind);

/// Where stx-decode may be: $STX_DECODE, else below libexec/ beside this program or library.
[[nodiscard]] std::vector<std::string> placesOfDecoder();

/// The error in a message of Tag::failure; (invalidInput) when that makes no sense.
[[nodiscard]] Error errorIn(ByteSpan failure);

/// From now on, in this process: no decoding where the kernel filters no system calls
/// (`--decoder-isolation required`), as the person who runs it says once for all files.
void requireFiltered();
/// Whether some decoder of this process ran without a filter of system calls.
[[nodiscard]] bool ranUnfiltered();

}  // namespace stx

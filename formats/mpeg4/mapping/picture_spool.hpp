#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "formats/files/byte_source.hpp"
#include "formats/files/temporaries.hpp"

namespace stx::mpeg4 {

/// Encoded pictures on their way into a file: films and large captures do not
/// fit memory. The bytes are in a file
/// that is gone when this is.
class PictureSpool {
  public:
    /// Errors (io): no file can be made in `folder`.
    [[nodiscard]] static Result<PictureSpool> create(const std::filesystem::path& folder);

    /// Where the bytes will be, in a range without a source. Errors (io): a full disk.
    [[nodiscard]] Result<ByteRange> add(const Bytes& bytes);
    /// All bytes that were added: the source of those ranges. It serves when this is gone, too.
    [[nodiscard]] Result<ByteSource> source() const;

  private:
    struct File {
        Temporary file;
        std::uint64_t size = 0;
        ~File();
    };
    std::unique_ptr<File> file_;
};

}  // namespace stx::mpeg4

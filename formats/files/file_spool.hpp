#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "lib/base/pixels.hpp"
#include "lib/base/result.hpp"

namespace stx {

/// Pixels in a file without a name, which is gone with this. It is mapped: what is read or written
/// comes into memory page by page, and all of it is given back there whenever it takes more than a
/// budget, to the file, from where it comes again. So whatever goes over the pixels takes no more
/// memory than that, however many there are. The file is as large as what is kept at a time.
class FileSpool final : public PixelSpool {
  public:
    /// `budget`: bytes in memory. `room`: bytes of the file that must be free on the disk, taken at
    /// once. Errors (io): no file can be made in `folder`, or it has no such room.
    [[nodiscard]] static Result<std::unique_ptr<FileSpool>> create(
        const std::filesystem::path& folder, std::uint64_t budget, std::uint64_t room = 0);
    /// Whether a file in `folder` costs little: it is on a disk of this machine, and not in memory
    /// or on another machine.
    [[nodiscard]] static bool costsLittle(const std::filesystem::path& folder) noexcept;
    ~FileSpool() override;

    /// Where the file cannot grow, on a full disk, the error is a std::system_error.
    [[nodiscard]] void* take(std::size_t bytes) override;
    /// Writes to the file, which costs a tenth of what writing through the mapping does.
    [[nodiscard]] void* keep(const void* data, std::size_t bytes) override;
    void give(void* room, std::size_t bytes) noexcept override;
    void settle() noexcept override;

  private:
    struct File;
    explicit FileSpool(std::unique_ptr<File> file);

    std::unique_ptr<File> file_;
};

}  // namespace stx

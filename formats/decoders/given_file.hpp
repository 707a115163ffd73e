#pragma once

#include <sys/mman.h>
#include <sys/stat.h>

#include <cstdint>
#include <span>
#include <vector>

#include "formats/decoders/wire.hpp"

namespace stx::decoders {

/// The bytes of the file that a module was given: open, or as the first message. A header alone,
/// for modules.
class GivenFile {
  public:
    GivenFile(int socket, int file) {
        struct stat facts = {};
        Tag tag{};
        if (file < 0) {
            there_ = receiveMessage(socket, tag, told_, UINT64_MAX, -1) && tag == Tag::fileIs;
            bytes_ = told_;
        } else if (::fstat(file, &facts) == 0) {
            const auto size = static_cast<std::size_t>(facts.st_size);
            void* const mapped = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file, 0);
            there_ = mapped != MAP_FAILED;
            if (there_) bytes_ = {static_cast<const std::byte*>(mapped), size};
        }
    }
    [[nodiscard]] bool there() const { return there_; }
    [[nodiscard]] std::span<const std::byte> bytes() const { return bytes_; }

  private:
    bool there_ = false;
    std::vector<std::byte> told_;
    std::span<const std::byte> bytes_;
};

}  // namespace stx::decoders

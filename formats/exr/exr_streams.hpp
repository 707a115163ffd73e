#pragma once

#include <OpenEXR/ImfIO.h>

#include <cstring>
#include <vector>

#include "formats/files/files.hpp"
#include "formats/files/temporaries.hpp"

/// OpenEXR's streams over our bytes and files. They throw, as that library wants them to; the
/// exceptions end in exr_file.cpp.
namespace stx::exr {

/// Reads bytes in memory.
class MemoryStream final : public Imf::IStream {
  public:
    MemoryStream(ByteSpan bytes, const char* name) : Imf::IStream(name), bytes_(bytes) {}
    [[nodiscard]] bool isMemoryMapped() const override { return true; }
    bool read(char* to, int count) override {
        std::memcpy(to, take(count), static_cast<std::size_t>(count));
        return at_ < bytes_.size();
    }
    char* readMemoryMapped(int count) override { return const_cast<char*>(take(count)); }
    std::uint64_t tellg() override { return at_; }
    void seekg(std::uint64_t position) override { at_ = position; }

  private:
    const char* take(int count) {
        if (count < 0 || at_ > bytes_.size() ||
            static_cast<std::uint64_t>(count) > bytes_.size() - at_)
            throw std::runtime_error("the file ends too early; it is cut off or damaged");
        const char* from = reinterpret_cast<const char*>(bytes_.data()) + at_;
        at_ += static_cast<std::uint64_t>(count);
        return from;
    }
    ByteSpan bytes_;
    std::uint64_t at_ = 0;
};

/// Reads a file in blocks: the library asks for single bytes of headers.
class FileStream final : public Imf::IStream {
  public:
    FileStream(int fd, std::uint64_t size, const char* name)
        : Imf::IStream(name), fd_(fd), size_(size), block_(1 << 16) {}
    bool read(char* to, int count) override;
    std::uint64_t tellg() override { return at_; }
    void seekg(std::uint64_t position) override { at_ = position; }

  private:
    int fd_;
    std::uint64_t size_;
    std::uint64_t at_ = 0;
    std::vector<char> block_;
    std::uint64_t blockAt_ = 0;
    std::size_t blockSize_ = 0;
};

/// Writes a file of that name; errors of the system, a full disk too, are thrown.
class OutputStream final : public Imf::OStream {
  public:
    explicit OutputStream(const std::filesystem::path& path);
    void write(const char* from, int count) override;
    std::uint64_t tellp() override { return at_ + filled_; }
    void seekp(std::uint64_t position) override;
    /// Writes what is left and closes.
    void finish();

  private:
    void flush();
    void put(const char* from, std::size_t count);
    Descriptor fd_;
    std::vector<char> block_;
    std::size_t filled_ = 0;
    std::uint64_t at_ = 0;  ///< where the block goes in the file
    int error_ = 0;
};

}  // namespace stx::exr

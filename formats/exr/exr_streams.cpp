#include "formats/exr/exr_streams.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <stdexcept>
#include <system_error>

namespace stx::exr {

namespace {

[[noreturn]] void throwSystem(int error) {
    throw std::runtime_error(std::generic_category().message(error));
}

}  // namespace

bool FileStream::read(char* to, int count) {
    auto left = static_cast<std::size_t>(std::max(count, 0));
    if (at_ > size_ || left > size_ - at_)
        throw std::runtime_error("the file ends too early; it is cut off or damaged");
    while (left > 0) {
        if (at_ < blockAt_ || at_ >= blockAt_ + blockSize_) {
            blockAt_ = at_;
            const auto n = ::pread(fd_, block_.data(), block_.size(), static_cast<off_t>(at_));
            if (n <= 0) throwSystem(n < 0 ? errno : EIO);
            blockSize_ = static_cast<std::size_t>(n);
        }
        const auto offset = static_cast<std::size_t>(at_ - blockAt_);
        const std::size_t n = std::min(left, blockSize_ - offset);
        std::memcpy(to, block_.data() + offset, n);
        to += n;
        at_ += n;
        left -= n;
    }
    return at_ < size_;
}

OutputStream::OutputStream(const std::filesystem::path& path)
    : Imf::OStream(path.c_str()),
      fd_(::open(path.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC)),
      block_(1 << 18) {
    if (fd_.get() < 0) throwSystem(errno);
}

void OutputStream::write(const char* from, int count) {
    auto left = static_cast<std::size_t>(std::max(count, 0));
    if (left >= block_.size() / 4) {
        flush();
        put(from, left);
        return;
    }
    while (left > 0) {
        if (filled_ == block_.size()) flush();
        const std::size_t n = std::min(left, block_.size() - filled_);
        std::memcpy(block_.data() + filled_, from, n);
        filled_ += n;
        from += n;
        left -= n;
    }
}

void OutputStream::flush() {
    put(block_.data(), filled_);
    filled_ = 0;
}

void OutputStream::put(const char* from, std::size_t count) {
    std::size_t done = 0;
    while (done < count) {
        const auto n =
            ::pwrite(fd_.get(), from + done, count - done, static_cast<off_t>(at_ + done));
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) {
            error_ = errno;
            throwSystem(error_);
        }
        done += static_cast<std::size_t>(n);
    }
    at_ += count;
}

void OutputStream::seekp(std::uint64_t position) {
    flush();
    at_ = position;
}

void OutputStream::finish() {
    // The library's destructors swallow what was thrown while they wrote.
    if (error_) throwSystem(error_);
    flush();
    if (const int error = fd_.close()) throwSystem(error);
}

}  // namespace stx::exr

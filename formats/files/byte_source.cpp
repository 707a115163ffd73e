#include "formats/files/byte_source.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "formats/files/file_stamp.hpp"

namespace stx {

struct ByteSource::Impl {
    std::string name;
    int file = -1;  ///< -1: memory
    std::uint64_t size = 0;
    FileStamp stamp;
    std::shared_ptr<const Bytes> owned;
    ByteSpan memory;

    ~Impl() {
        if (file >= 0) ::close(file);
    }
};

Result<ByteSource> ByteSource::open(const std::filesystem::path& path) {
    auto impl = std::make_shared<Impl>();
    impl->name = path.string();
    // Opening without O_NONBLOCK would wait for ever on a FIFO that nobody writes.
    impl->file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    struct stat status {};
    if (impl->file < 0 || ::fstat(impl->file, &status) != 0)
        return fail(ErrorCode::io, "cannot open '{}': {}", impl->name, std::strerror(errno));
    if (!S_ISREG(status.st_mode))
        return fail(ErrorCode::io, "'{}' is not a regular file", impl->name);
    impl->size = static_cast<std::uint64_t>(status.st_size);
    impl->stamp = FileStamp::of(status);
    ByteSource source;
    source.impl_ = std::move(impl);
    return source;
}

ByteSource ByteSource::fromBytes(Bytes bytes) {
    return fromShared(std::make_shared<const Bytes>(std::move(bytes)));
}

ByteSource ByteSource::fromShared(std::shared_ptr<const Bytes> bytes) {
    auto impl = std::make_shared<Impl>();
    impl->memory = *bytes;
    impl->size = bytes->size();
    impl->owned = std::move(bytes);
    ByteSource source;
    source.impl_ = std::move(impl);
    return source;
}

std::uint64_t ByteSource::size() const {
    return impl_ ? impl_->size : 0;
}

ByteSpan ByteSource::view() const {
    return impl_ ? impl_->memory : ByteSpan{};
}

const std::string& ByteSource::name() const {
    static const std::string kNone;
    return impl_ ? impl_->name : kNone;
}

Result<void> ByteSource::read(std::uint64_t offset, std::span<std::byte> out) const {
    if (out.empty()) return {};
    if (offset > size() || out.size() > size() - offset)
        return fail(ErrorCode::invalidInput, "bytes {} to {} are wanted of a file of {} bytes",
                    offset, offset + out.size(), size());
    if (impl_->file < 0) {
        std::memcpy(out.data(), impl_->memory.data() + offset, out.size());
        return {};
    }
    std::size_t done = 0;
    while (done < out.size()) {
        const ssize_t n = ::pread(impl_->file, out.data() + done,
                                  std::min<std::size_t>(out.size() - done, 1u << 30),
                                  static_cast<off_t>(offset + done));
        if (n < 0 && errno == EINTR) continue;
        if (n < 0)
            return fail(ErrorCode::io, "cannot read '{}': {}", impl_->name, std::strerror(errno));
        if (n == 0) return changedError(impl_->name);
        done += static_cast<std::size_t>(n);
    }
    if (!impl_->stamp.holds(impl_->file)) return changedError(impl_->name);
    return {};
}

ByteRange ByteRange::of(Bytes bytes) {
    const std::uint64_t size = bytes.size();
    return {ByteSource::fromBytes(std::move(bytes)), 0, size};
}

Result<Bytes> ByteRange::load(const Limits& limits) const {
    if (offset > source.size() || size > source.size() - offset)
        return fail(ErrorCode::invalidInput,
                    "{} bytes at byte {} reach past the end of the file ({} bytes)", size, offset,
                    source.size());
    STX_CHECK(limits.checkAllocation(size, 1, "a sample"));
    Bytes bytes(static_cast<std::size_t>(size));
    STX_CHECK(source.read(offset, bytes));
    return bytes;
}

}  // namespace stx

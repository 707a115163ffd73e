#include "formats/mpeg4/mapping/picture_spool.hpp"

#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace stx::mpeg4 {

Result<PictureSpool> PictureSpool::create(const std::filesystem::path& folder) {
    auto made = createTemporaryFile(folder);
    if (!made)
        return fail(ErrorCode::io, "cannot make a file in '{}': {}", folder.string(),
                    std::generic_category().message(made.error()));
    PictureSpool spool;
    spool.file_ = std::make_unique<File>();
    spool.file_->file = std::move(*made);
    return spool;
}

PictureSpool::File::~File() {
    std::error_code ignored;
    std::filesystem::remove(file.path, ignored);
}

Result<ByteRange> PictureSpool::add(const Bytes& bytes) {
    std::size_t done = 0;
    while (done < bytes.size()) {
        const auto n = ::write(file_->file.fd.get(), bytes.data() + done, bytes.size() - done);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0)
            // Its own name means nothing to anybody.
            return fail(ErrorCode::io, "cannot write in the folder '{}': {}",
                        file_->file.path.parent_path().string(),
                        std::generic_category().message(n < 0 ? errno : ENOSPC));
        done += static_cast<std::size_t>(n);
    }
    const ByteRange range({}, file_->size, bytes.size());
    file_->size += bytes.size();
    return range;
}

Result<ByteSource> PictureSpool::source() const {
    return ByteSource::open(file_->file.path);
}

}  // namespace stx::mpeg4

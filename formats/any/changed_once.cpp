#include "formats/any/changed_once.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <vector>

#include "formats/files/temporaries.hpp"
#include "lib/model/same_pictures.hpp"

namespace stx {
namespace {

using Pixels = std::span<std::byte>;

Pixels pixelsOf(Image<float>& depth) {
    return std::as_writable_bytes(depth.pixels());
}

Pixels pixelsOf(Texture& texture) {
    if (Rgba8Image* bytes = texture.rgba8()) return std::as_writable_bytes(bytes->pixels());
    return std::as_writable_bytes(texture.rgbaFloat()->pixels());
}

/// Pixels one after another in a file without readers but this process.
class PixelFile {
  public:
    explicit PixelFile(std::filesystem::path folder) : folder_(std::move(folder)) {}
    ~PixelFile() {
        std::error_code ignored;
        if (file_) std::filesystem::remove(file_->path, ignored);
    }
    PixelFile(const PixelFile&) = delete;
    PixelFile& operator=(const PixelFile&) = delete;

    /// Where they are from now on.
    Result<std::uint64_t> add(Pixels pixels) {
        if (!file_) {
            auto made = createTemporaryFile(folder_);
            if (!made) return failed("make a file in", folder_, made.error());
            file_ = std::move(*made);
        }
        const std::uint64_t at = size_;
        for (std::size_t done = 0; done < pixels.size();) {
            const auto n = ::pwrite(file_->fd.get(), pixels.data() + done, pixels.size() - done,
                                    static_cast<off_t>(size_));
            if (n < 0 && errno == EINTR) continue;
            if (n <= 0) return failed("write", file_->path, n < 0 ? errno : ENOSPC);
            done += static_cast<std::size_t>(n);
            size_ += static_cast<std::uint64_t>(n);
        }
        return at;
    }
    Result<void> read(std::uint64_t from, Pixels pixels) const {
        for (std::size_t done = 0; done < pixels.size();) {
            const auto n = ::pread(file_->fd.get(), pixels.data() + done, pixels.size() - done,
                                   static_cast<off_t>(from + done));
            if (n < 0 && errno == EINTR) continue;
            if (n <= 0) return failed("read", file_->path, n < 0 ? errno : EIO);
            done += static_cast<std::size_t>(n);
        }
        return {};
    }

  private:
    static tl::unexpected<Error> failed(const char* what, const std::filesystem::path& path,
                                        int error) {
        return fail(ErrorCode::io, "cannot {} '{}': {}", what, path.string(),
                    std::generic_category().message(error));
    }

    std::filesystem::path folder_;
    std::optional<Temporary> file_;
    std::uint64_t size_ = 0;
};

class ChangedOnce : public Sequence {
  public:
    ChangedOnce(std::unique_ptr<Sequence> frames, std::function<Result<void>(Bundle&, Job&)> change,
                std::filesystem::path folder)
        : frames_(std::move(frames)), change_(std::move(change)), file_(std::move(folder)) {
        timeline_ = frames_->timeline();
    }

    Result<Bundle> frame(std::size_t index, Job& job) override {
        STX_TRY(auto bundle, frames_->frame(index, job));
        if (const auto kept = kept_.find(index); kept != kept_.end()) {
            STX_CHECK(restore(kept->second, bundle));
            for (const std::string& note : kept->second.notes) job.note(note);
            return bundle;
        }
        std::vector<std::size_t> before;
        for (ReferenceView& view : bundle.views)
            before.insert(before.end(),
                          {hashOf(pixelsOf(view.depth)), hashOf(pixelsOf(view.texture))});
        Job own;
        own.workFor(job);
        STX_CHECK(change_(bundle, own));
        STX_TRY(Kept kept, keep(bundle, before));
        kept.notes = own.takeNotes();
        for (const std::string& note : kept.notes) job.note(note);
        kept_.emplace(index, std::move(kept));
        return bundle;
    }

  private:
    struct KeptView {
        ViewHeader header;
        std::optional<std::uint64_t> depth, texture;  ///< where; nothing: as they were
    };
    struct Kept {
        std::vector<KeptView> views;
        std::optional<Bounds> bounds;
        std::vector<std::string> notes;
    };

    Result<Kept> keep(Bundle& bundle, const std::vector<std::size_t>& before) {
        Kept kept;
        kept.bounds = bundle.bounds;
        for (std::size_t k = 0; k < bundle.views.size(); ++k) {
            ReferenceView& view = bundle.views[k];
            KeptView v{view, {}, {}};
            if (const Pixels depth = pixelsOf(view.depth); hashOf(depth) != before[2 * k])
                STX_SET(v.depth, file_.add(depth));
            if (const Pixels colour = pixelsOf(view.texture); hashOf(colour) != before[2 * k + 1])
                STX_SET(v.texture, file_.add(colour));
            kept.views.push_back(std::move(v));
        }
        return kept;
    }

    Result<void> restore(const Kept& kept, Bundle& bundle) const {
        bundle.bounds = kept.bounds;
        for (std::size_t k = 0; k < kept.views.size(); ++k) {
            ReferenceView& view = bundle.views[k];
            static_cast<ViewHeader&>(view) = kept.views[k].header;
            if (const auto at = kept.views[k].depth)
                STX_CHECK(file_.read(*at, pixelsOf(view.depth)));
            if (const auto at = kept.views[k].texture)
                STX_CHECK(file_.read(*at, pixelsOf(view.texture)));
        }
        return {};
    }

    std::unique_ptr<Sequence> frames_;
    std::function<Result<void>(Bundle&, Job&)> change_;
    PixelFile file_;
    std::map<std::size_t, Kept> kept_;
};

}  // namespace

std::unique_ptr<Sequence> changedOnce(std::unique_ptr<Sequence> frames,
                                      std::function<Result<void>(Bundle&, Job&)> change,
                                      std::filesystem::path folder) {
    return std::make_unique<ChangedOnce>(std::move(frames), std::move(change), std::move(folder));
}

}  // namespace stx

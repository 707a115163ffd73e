#include "formats/any/changed_once.hpp"

#include <unistd.h>

#include <array>
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

/// All images of a view, in the order of PicturesKey::hashes; those that it lacks are empty.
constexpr std::size_t kImages = std::tuple_size_v<decltype(PicturesKey::hashes)>;
std::array<Pixels, kImages> imagesOf(ReferenceView& view) {
    const auto bytes = [](auto& image) { return std::as_writable_bytes(image.pixels()); };
    Rgba8Image* colour = view.texture.rgba8();
    return {colour ? bytes(*colour) : bytes(*view.texture.rgbaFloat()),
            bytes(view.depth),
            bytes(view.normal),
            bytes(view.splatU),
            bytes(view.splatV),
            bytes(view.metallicRoughness),
            bytes(view.emissive)};
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
        std::vector<PicturesKey> before;
        for (const ReferenceView& view : bundle.views) before.push_back(PicturesKey::of(view));
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
        std::array<std::optional<std::uint64_t>, kImages> at;  ///< where; nothing: as they were
    };
    struct Kept {
        std::vector<KeptView> views;
        std::optional<Bounds> bounds;
        std::vector<std::string> notes;
    };

    Result<Kept> keep(Bundle& bundle, const std::vector<PicturesKey>& before) {
        Kept kept;
        kept.bounds = bundle.bounds;
        for (std::size_t k = 0; k < bundle.views.size(); ++k) {
            ReferenceView& view = bundle.views[k];
            KeptView v{view, {}};
            const auto images = imagesOf(view);
            for (std::size_t i = 0; i < kImages; ++i)
                if (hashOf(images[i]) != before[k].hashes[i])
                    STX_SET(v.at[i], file_.add(images[i]));
            kept.views.push_back(std::move(v));
        }
        return kept;
    }

    Result<void> restore(const Kept& kept, Bundle& bundle) const {
        bundle.bounds = kept.bounds;
        for (std::size_t k = 0; k < kept.views.size(); ++k) {
            ReferenceView& view = bundle.views[k];
            static_cast<ViewHeader&>(view) = kept.views[k].header;
            const auto images = imagesOf(view);
            for (std::size_t i = 0; i < kImages; ++i)
                if (const auto at = kept.views[k].at[i]) STX_CHECK(file_.read(*at, images[i]));
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

#pragma once

#include <filesystem>
#include <memory>

#include "formats/files/temporaries.hpp"
#include "formats/mpeg4/mapping/mapping.hpp"
#include "lib/model/sequence.hpp"

namespace stx::mpeg4 {

/// Encoded pictures on their way into a file: a film does not fit memory. The bytes are in a file
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

/// A presentation of a sequence: sceneFromBundle() of its first frame, in which images that change
/// are MovieTextures of PNG or JPEG access units with the sequence's times, and views whose camera
/// changes are replaced by commands (REPLACE of the DepthImage, which keeps its id). One depth
/// range and one range of splats serve a view for the whole sequence, so that what stands still
/// keeps its codes; every frame is read twice for it. A picture that repeats the one before it
/// lasts longer, colour and depth of a view alike. With options.h264 colour and depth that change
/// are H.264 tracks of full range in place of pictures. Errors: those of sceneFromBundle() and of
/// the frames, with the frame's time; (unsupported) PointTexture and OctreeImage, which cannot
/// move, and JPEG colour of pruned views; (invalidInput) views that come, go or change their size.
[[nodiscard]] Result<Document> sceneFromSequence(Sequence& frames, const SceneWriteOptions& options,
                                                 PictureSpool& spool, Job& job);

}  // namespace stx::mpeg4

#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>
#include <unordered_set>

#include "formats/mpeg4/mapping/mapping.hpp"
#include "formats/mpeg4/mapping/media_clock.hpp"
#include "formats/mpeg4/mapping/picture_cache.hpp"
#include "formats/mpeg4/mapping/stream_video.hpp"

namespace stx::mpeg4 {

/// The images that texture nodes name: streams by object descriptor, files by name, PixelTextures;
/// of a stream with several pictures the one of a moment.
class StreamImages {
  public:
    /// What is in a picture of video: colours, or codes of depth, which are luma as it is.
    enum class Samples { colours, codes };

    /// Object descriptors as they are at the scene's start; ones that come later serve where
    /// there is none then. The document must outlive this.
    [[nodiscard]] static Result<StreamImages> make(const Document& document,
                                                   const std::filesystem::path& folder,
                                                   const Limits& limits);

    /// The moment of the scene, in seconds, and how far times of that moment may be off: 0 at
    /// first.
    void setTime(double now, double slack = 0);
    [[nodiscard]] const Limits& limits() const { return limits_; }
    /// Pictures of streams that were decoded are kept, in so many bytes: for sequences.
    void keepPictures(std::uint64_t bytes) { cache_ = std::make_shared<PictureCache>(bytes); }

    /// The bytes of an ImageTexture's or MovieTexture's first usable URL (of a movie, the picture
    /// of the moment). Errors: no URL, an unknown descriptor, a stream without samples, a URL that
    /// is not a file in the folder.
    [[nodiscard]] Result<Bytes> load(const Node& texture, const Limits& limits) const;
    /// The decoded picture, PixelTexture included. Errors: those of load() and of the decoder, an
    /// empty PixelTexture, a node of another type, a stream that neither an image codec nor the
    /// module of video reads.
    [[nodiscard]] Result<DecodedImage> decode(const Node& texture, const ImageDecoder& decoder,
                                              const Limits& limits,
                                              Samples samples = Samples::colours) const;
    /// The header of the picture. Errors as load().
    [[nodiscard]] Result<ImageInfo> probe(const Node& texture) const;

    /// Whether probe() tells size and bits as decode() will find them: of PNG, JPEG and
    /// PixelTexture; not of video and of what has no readable header.
    [[nodiscard]] bool probesAsDecoded(const Node& texture) const;

    /// The stream that load() takes its bytes from; null for files and PixelTexture.
    [[nodiscard]] const ElementaryStream* stream(const Node& texture) const;
    /// When its samples are shown; found once for each stream.
    [[nodiscard]] const Presentation& presentation(const ElementaryStream& stream) const;

  private:
    /// Where the first usable URL leads: to a stream; to a file where that is null.
    struct Source {
        const Url* url = nullptr;
        const ElementaryStream* stream = nullptr;
    };
    /// Errors as load(), but for those of reading.
    [[nodiscard]] Result<Source> sourceOf(const Node& texture) const;
    [[nodiscard]] Result<const ElementaryStream*> streamOf(const Url& url) const;
    [[nodiscard]] Result<std::filesystem::path> fileOf(const Url& url) const;
    [[nodiscard]] Result<Bytes> bytesOf(const Node& texture, const Source& source,
                                        const Limits& limits) const;
    /// The sample that a texture shows at the moment. The stream must have one.
    [[nodiscard]] std::size_t sampleAt(const Node& texture, const ElementaryStream& stream) const;
    [[nodiscard]] Result<DecodedImage> decodeVideo(const ElementaryStream& stream,
                                                   std::size_t sample, Samples samples,
                                                   const Limits& limits) const;

    const Document* document_ = nullptr;
    double now_ = 0, slack_ = 0;
    /// Shared by copies: they are of one document.
    std::shared_ptr<std::unordered_map<const ElementaryStream*, Presentation>> presentations_ =
        std::make_shared<std::unordered_map<const ElementaryStream*, Presentation>>();
    /// What file each text of a URL means: each moment asks which stream a texture shows.
    struct Files {
        std::mutex mutex;
        std::unordered_map<std::string, Result<std::filesystem::path>> byText;
    };
    std::shared_ptr<Files> files_ = std::make_shared<Files>();
    std::shared_ptr<PictureCache> cache_;
    std::shared_ptr<StreamVideo> video_ = std::make_shared<StreamVideo>();
    std::unordered_map<int, const ObjectDescriptor*> byId_;
    std::unordered_set<int> removed_;   ///< by commands until then; some may be in byId_ again
    std::vector<std::size_t> odOrder_;  ///< of the document's frames of descriptors, by time
    std::size_t nextOd_ = 0;            ///< in that order: the first that is not in byId_
    std::uint64_t odTicks_ = 0;         ///< of byId_
    bool begun_ = false;
    std::filesystem::path folder_;
    Limits limits_;
};

}  // namespace stx::mpeg4

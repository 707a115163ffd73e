#pragma once

#include <filesystem>
#include <string>
#include <unordered_map>

#include "formats/mpeg4/mapping/mapping.hpp"

namespace stx::mpeg4 {

/// The images that texture nodes name: streams by object descriptor, files by name, PixelTextures.
class StreamImages {
  public:
    /// Object descriptors as they are at the scene's start; ones that come later serve where
    /// there is none then. The document must outlive this.
    [[nodiscard]] static Result<StreamImages> make(const Document& document,
                                                   const std::filesystem::path& folder,
                                                   const Limits& limits);

    /// The bytes of an ImageTexture's or MovieTexture's first usable URL (of a movie, its first
    /// picture). Errors: no URL, an unknown descriptor, a stream without samples, a URL that is not
    /// a file in the folder.
    [[nodiscard]] Result<Bytes> load(const Node& texture, const Limits& limits) const;
    /// The decoded picture, PixelTexture included. Errors: those of load() and of the decoder, an
    /// empty PixelTexture, a node of another type, a stream that is neither JPEG nor PNG.
    [[nodiscard]] Result<DecodedImage> decode(const Node& texture, const ImageDecoder& decoder,
                                              const Limits& limits) const;
    /// The header of the picture. Errors as load().
    [[nodiscard]] Result<ImageInfo> probe(const Node& texture) const;

    /// The stream behind the first URL that has one; null for files and PixelTexture.
    [[nodiscard]] const ElementaryStream* stream(const Node& texture) const;

  private:
    std::unordered_map<int, const ObjectDescriptor*> byId_;
    std::filesystem::path folder_;
    Limits limits_;
};

}  // namespace stx::mpeg4

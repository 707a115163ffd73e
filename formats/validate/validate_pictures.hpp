#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/mpeg4/mapping/stream_images.hpp"
#include "formats/mpeg4/scene/scene_walk.hpp"
#include "formats/validate/findings.hpp"

/// The pictures of a presentation: their headers and, where they are decoded, their pixels.
namespace stx {

/// "object descriptor 7": where a finding of rules 2020 to 2026 is.
[[nodiscard]] std::string descriptorText(int id);

/// Reads pictures as a renderer would, and adds a finding of rule 4005 for each that cannot be
/// read. `what`: the field that has the picture.
struct PictureReader {
    const mpeg4::StreamImages& images;
    const mpeg4::ImageDecoder& decoder;
    const ValidateOptions& options;
    const Limits& limits;
    Findings& findings;

    /// The header. Adds nothing where the rule on descriptors that it breaks was found before.
    [[nodiscard]] std::optional<ImageInfo> probe(const mpeg4::Node& image, std::string_view what,
                                                 const std::string& where) const;
    /// The pixels, those of "depth" as codes. Nothing without a finding: the options do without
    /// pixels, probe() fails, which adds its own, or it is video that this build does not read.
    [[nodiscard]] std::optional<DecodedImage> decode(const mpeg4::Node& image,
                                                     std::string_view what,
                                                     const std::string& where) const;
};

/// Rules 4005, 4010, 6007 and 6008 on the images of a view; of an octree's image, which has no
/// depth, 4005 only. Gives the highest depth code; nothing where there is none to be had.
[[nodiscard]] std::optional<std::uint32_t> checkViewPixels(const mpeg4::Node& depthImage,
                                                           const mpeg4::Node& texture,
                                                           const std::string& where, bool inOctree,
                                                           const PictureReader& pictures);

/// Whether a later picture of the stream that has a view's depth shows a point (`texture` is its
/// SimpleTexture). Decodes them until one does; false where one cannot be decoded, too.
[[nodiscard]] bool anyPointLater(const mpeg4::Node& texture, const PictureReader& pictures,
                                 const Job& job);

/// Rule 4005 on the masks that WorldInfo has of pixels without depth (see ViewNotes).
void checkMasks(const std::vector<mpeg4::ShownInfo>& infos, const PictureReader& pictures);

}  // namespace stx

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "formats/files/files.hpp"
#include "formats/photos/file_colours.hpp"
#include "lib/base/image.hpp"
#include "lib/geometry/camera.hpp"
#include "lib/model/texture.hpp"

/// Photographs with depth as phones write them: one file, with the depth somewhere in it. Formats
/// and their sources: formats/photos/README.md.
namespace stx::photos {

/// A picture inside a photo, not decoded yet.
struct PhotoImage {
    enum class Coding {
        none,
        file,  ///< a whole file: JPEG, PNG
        grey,  ///< width * height bytes
        heif,  ///< an item of a HEIF file, which is decoded upright
    };
    Coding coding = Coding::none;
    ByteSpan bytes;  ///< of the file or of what `owner` holds; heif: the whole file
    std::shared_ptr<const Bytes> owner;
    std::uint32_t item = 0;     ///< of a HEIF file
    int width = 0, height = 0;  ///< as it is decoded; 0: only decoding tells
};

/// What a stored value v, an integer divided by its largest one, is: a, the distance in scene
/// units, or 1 / distance where `inverse`, goes evenly from `zero` (where v is `first`) to `one`
/// (`last`).
struct PhotoDepthCode {
    bool inverse = true;
    double zero = 0, one = 0;  ///< both 0: the file tells no scale
    double first = 0, last = 1;
    /// 1 / distance is not taken below it; 0: not below half a step.
    double least = 0;
    /// Without a scale: the value 0 is what is nearest.
    bool zeroIsNear = false;
    bool alongRay = false;  ///< the distance is the length of the ray, not along the axis

    [[nodiscard]] bool scaled() const { return zero != 0 || one != 0; }
    /// Takes `near` and `far` for the distances of the nearest and the farthest value.
    void setRange(double near, double far);
    /// The same of a code without a scale: of the nearest and the farthest of `values` (integers of
    /// at most `largest`); where all are alike, of 0 and `largest`. `lossy`: they were coded as a
    /// JPEG, and ends that are next to 0 or `largest` were these.
    void setRange(double near, double far, const Image<float>& values, int largest, bool lossy);
    /// For codes without a scale: the farthest of `values` (see setRange()) is four times as far as
    /// the nearest, and their median is at distance 1.
    void assumeRange(const Image<float>& values, int largest, bool lossy = false);
    /// Makes planar distances of integers with the largest `largest`, which may have a fraction.
    void toDistances(Image<float>& values, const Camera& camera, int largest) const;
};

/// In pixels of a picture, (0, 0) at its corner.
struct PhotoIntrinsics {
    double fx = 0, fy = 0, cx = 0, cy = 0;
};

/// A photo before a pixel of it is decoded.
struct Photo {
    std::string format;  ///< "Apple HEIC", "Apple JPEG", "GDepth", "Dynamic Depth", "Samsung" …
    std::shared_ptr<const Bytes> file;
    PhotoImage colour, depth;
    /// What of the picture belongs to a person, of the same shape; none in most photos.
    PhotoImage matte;
    /// "original" and "portrait" where the file has both pictures, the sharp one and the blurred
    /// one; else "only".
    std::string colourIs = "only";
    /// How both pictures are turned when they are decoded, as EXIF counts it (1..8).
    int orientation = 1;

    PhotoDepthCode code;
    std::string coding;                ///< as the file calls it: "disparity", "RangeInverse" …
    std::string accuracy = "unknown";  ///< "absolute", "relative", "unscaled", "unknown"
    /// Of a matrix that the file tells, of the upright picture.
    std::optional<PhotoIntrinsics> intrinsics;
    double focal35 = 0;   ///< EXIF: mm, of a 36x24 mm camera with the same diagonal; 0 = none
    FileColours colours;  ///< of HEIF's picture; other files have theirs in their own bytes
    std::vector<std::string> mattes;  ///< "portraiteffectsmatte" …
    std::vector<std::string> others;  ///< what else is in it: "a gain map" …

    /// Both pictures turned upright; 0 where only decoding tells it.
    [[nodiscard]] glm::ivec2 uprightSize(const PhotoImage& image) const;
};

/// What is asked for.
struct PhotoOptions {
    bool portrait = false;   ///< the blurred picture where there is a sharp one, too
    bool needsDepth = true;  ///< else the picture alone is found, of any format
};

/// Whether bytes begin as a HEIF picture with HEVC (ISO/IEC 23008-12), not as a film.
[[nodiscard]] bool isHeif(ByteSpan head);

/// Finds the pictures in a file and reads what it tells of them. Decodes nothing; counts and
/// offsets are checked against the file, and sizes against the limits. Errors: (invalidInput) no
/// depth, with what there is instead; damaged; (unsupported) a known layout that is not read.
[[nodiscard]] Result<Photo> openPhoto(const std::shared_ptr<const Bytes>& file,
                                      const PhotoOptions& options, const Limits& limits);

/// The colour picture, upright, 8-bit sRGB; `profileNote` tells what became of its colour profile.
/// Of files whose first bytes say what they are; what more than 8 bits lose is not said. Errors as
/// decodeImage(); (unsupported) a HEIF picture without libheif.
[[nodiscard]] Result<Rgba8Image> decodeColour(const Photo& photo, std::string& profileNote,
                                              Job& job);

/// The stored values of the depth, upright.
struct PhotoDepthValues {
    Image<float> values;
    int bits = 8;  ///< 8 or 16
};
[[nodiscard]] Result<PhotoDepthValues> decodeDepth(const Photo& photo, Job& job);

/// The matte of a portrait, upright, 0..255 (all of a pixel belongs to the person). Errors as
/// decodeImage(); of a photo that has one.
[[nodiscard]] Result<Image<std::uint8_t>> decodeMatte(const Photo& photo, Job& job);

}  // namespace stx::photos

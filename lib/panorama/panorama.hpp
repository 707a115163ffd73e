#pragma once

#include <array>
#include <cmath>
#include <vector>

#include <glm/gtc/quaternion.hpp>

#include "lib/base/job.hpp"
#include "lib/panorama/picture_source.hpp"

/// Panoramas: pictures of a camera that only turned become one picture of all that is around it
/// (Szeliski and Shum, "Creating full view panoramic image mosaics and environment maps", SIGGRAPH
/// 1997, and what came after).
namespace stx {

enum class PanoramaUp {
    level,  ///< the horizon is level: cameras are held so that their sides or tops are, mostly
    first,  ///< the first picture's frame
};

struct PanoramaSettings {
    /// Full angle across the width of the first picture, radians; 0 = found from the pictures (and
    /// from what the camera wrote down). One that is given is kept.
    double fieldOfView = 0;
    bool closeLoop = true;  ///< pictures that close a full turn may pull it together
    PanoramaUp up = PanoramaUp::level;
};

/// Where a picture looked.
struct PanoramaCamera {
    bool used = false;  ///< part of the panorama
    glm::dquat worldFromCamera{1.0, 0.0, 0.0, 0.0};
    glm::ivec2 size{0};    ///< pixels
    double focal = 0;      ///< pixels; each its own when the camera focused anew
    glm::dvec3 gain{1.0};  ///< its linear light is multiplied by this
};

/// What two pictures have in common.
struct PanoramaPair {
    int a = 0, b = 0;
    int found = 0;        ///< places that look alike in both, more or less where they should be
    int matches = 0;      ///< those that one rotation explains, and the adjustment used
    double rms = 0;       ///< of the latter, pixels of the full pictures
    double parallax = 0;  ///< nine tenths of what was found differs by no more than this, pixels
};

/// How much darker a lens is away from the middle of its pictures: the logarithm of its linear
/// light against the middle's is second * r^2 + fourth * r^4 at distance r, halves of the diagonal.
/// The same for all pictures of a series.
struct Vignetting {
    double second = 0, fourth = 0;

    [[nodiscard]] bool none() const { return second == 0 && fourth == 0; }
    /// By which linear light is to be multiplied, from the square of the distance.
    [[nodiscard]] float clearing(double r2) const {
        return static_cast<float>(std::exp(-r2 * (second + fourth * r2)));
    }
};

struct PanoramaAlignment {
    std::vector<PanoramaCamera> cameras;  ///< of each picture
    std::vector<PanoramaPair> pairs;
    /// Of all together, halves of a picture's diagonal; PanoramaCamera has that of each in pixels.
    double focal = 0;
    double k1 = 0;        ///< radial distortion, OpenCV's first coefficient, with that focal length
    double rms = 0;       ///< of all matches that fit, pixels of the full pictures
    bool closed = false;  ///< the pictures go all around
    /// Closed: what is missing when the pictures' measured turns are put one after the other with
    /// the focal length that pairs alone tell, and after all were adjusted together; radians.
    double gapBefore = 0, gapAfter = 0;
    Vignetting vignetting;  ///< found by composePanorama(), where pictures tell it clearly

    [[nodiscard]] int used() const;
};

/// Finds how the pictures look: features and pairs among all of them in any order, rotations, one
/// focal length, radial distortion, all adjusted together, closed around, and level. The world is
/// that of Camera: -Z is the middle of the panorama, +Y up. Notes name pictures that fit nowhere,
/// and parallax. Errors: those of the source; invalidInput when fewer than two different pictures
/// fit together; cancelled.
[[nodiscard]] Result<PanoramaAlignment> alignPanorama(PictureSource& source,
                                                      const PanoramaSettings& settings, Job& job);

/// An equirectangular picture, 2 N x N: the middle looks along -Z, the left half is -X, the upper
/// one +Y; pixels are areas (their centres are half a pixel inside). 8-bit sRGB; alpha 0 where no
/// picture looked.
struct PanoramaImage {
    Rgba8Image pixels;

    [[nodiscard]] int width() const { return pixels.width(); }
    [[nodiscard]] int height() const { return pixels.height(); }
    /// Unit direction of a position (pixels).
    [[nodiscard]] static glm::dvec3 direction(glm::dvec2 position, int width);
    /// Position (pixels) of a direction.
    [[nodiscard]] static glm::dvec2 position(glm::dvec3 direction, int width);
    /// sRGB-coded colour, 0..1, premultiplied with its alpha, in a direction (Catmull-Rom).
    [[nodiscard]] glm::vec4 sample(glm::dvec3 direction) const;
};

struct ComposeSettings {
    int width = 0;  ///< pixels, even; 0 = as dense as the pictures are, at most kMaxPanoramaWidth
    /// Movers are drawn once, where pictures disagree; else the nearest picture is taken.
    bool hideSeams = true;
};
inline constexpr int kMaxPanoramaWidth = 8192;

/// The width of a panorama where ComposeSettings::width is 0.
[[nodiscard]] int naturalWidth(const PanoramaAlignment& alignment);

/// Draws the panorama: gains in linear light and vignetting (put into the alignment), one picture
/// for each direction with seams where pictures agree, softened. Pictures are read once more, one
/// after the other. Errors: those of the source; invalidInput when it needs more memory than
/// allowed; cancelled.
[[nodiscard]] Result<PanoramaImage> composePanorama(PictureSource& source,
                                                    PanoramaAlignment& alignment,
                                                    const ComposeSettings& settings, Job& job);

/// How well the others show what one picture shows.
struct LeftOutPicture {
    double covered = 0;  ///< share of it that they show
    double psnr = 0;     ///< dB, over that share, after one gain for each channel; 0 = nothing
};

/// Draws each used picture again out of a panorama of all others (at most 4096 pixels wide). Takes
/// as long as composePanorama() for each of them. Errors: those of composePanorama().
[[nodiscard]] Result<std::vector<LeftOutPicture>> leaveEachOut(PictureSource& source,
                                                               const PanoramaAlignment& alignment,
                                                               const ComposeSettings& settings,
                                                               Job& job);

}  // namespace stx

#pragma once

#include <memory>
#include <vector>

#include <glm/glm.hpp>

#include "lib/base/job.hpp"
#include "lib/model/environment.hpp"

namespace stx {

/// A piece of the sphere of directions, and the light that comes from it.
struct EnvironmentPiece {
    glm::vec3 direction{0.0f};  ///< its middle, unit, in the world
    float solidAngle = 0;       ///< of what was added up, steradians
    glm::vec3 light{0.0f};      ///< linear light times steradians, added up; none where nothing is
};

/// An environment made ready to be looked up: pictures with smaller ones for wide footprints
/// (averaged in linear light) and borders from across their edges, so that faces join without a
/// seam and poles have none. Safe to use from several threads.
class EnvironmentMap {
  public:
    /// Errors: Environment::check(), memory over the limit.
    [[nodiscard]] static Result<std::shared_ptr<const EnvironmentMap>> make(
        const Environment& environment, const Limits& limits);
    ~EnvironmentMap();

    /// The environment it was made from, without its pictures.
    [[nodiscard]] const Environment& description() const { return description_; }
    /// Turns directions of the world into the environment's, for sampleTurned().
    [[nodiscard]] const glm::mat3& environmentFromWorld() const { return environmentFromWorld_; }

    /// Premultiplied colour seen in a direction of the world (any length but 0): linear light where
    /// `linear`, else sRGB-coded. `footprintRad`: the angle over which it is averaged, as wide as
    /// a pixel; 0: none.
    [[nodiscard]] glm::vec4 sample(glm::vec3 direction, float footprintRad, bool linear) const;
    /// The same for loops over pixels: `d` is in the environment's own axes and ends on the plane
    /// of the pixels, whose distance there is `spacing` (camera space: (x, y, -1) and one over the
    /// focal length).
    [[nodiscard]] glm::vec4 sampleTurned(glm::vec3 d, float spacing, bool linear) const;

    /// Pictures only, with a sharper filter (Catmull-Rom) at full size: straight alpha in the
    /// pictures' own coding, 0..1 for 8 bits. `d` is in the environment's own axes.
    [[nodiscard]] glm::vec4 pictureAt(glm::vec3 d) const;
    /// Pictures only, averaged over an angle; else as pictureAt().
    [[nodiscard]] glm::vec4 pictureAt(glm::vec3 d, float footprintRad) const;

    /// All the light that there is, by where it comes from: six faces (faceDirection()) of the
    /// world's axes in side x side pieces, row by row. Each texel counts once or more, with its
    /// solid angle, so that a sun of a single texel gives what it has. The solid angles of a piece
    /// may differ a little from its own; of all they add up to the sphere. The same on any number
    /// of threads. Takes 32 bytes for each piece, and 10 MiB.
    [[nodiscard]] std::vector<EnvironmentPiece> pieces(int side) const;

  private:
    struct Pictures;
    EnvironmentMap();
    [[nodiscard]] glm::vec3 skyAndGround(float heightOfUnit, float& alpha) const;

    Environment description_;
    glm::mat3 environmentFromWorld_{1.0f};
    bool linear_ = false;
    bool behind_ = false;  ///< there is sky or ground
    std::unique_ptr<Pictures> pictures_;
};

/// Whether a picture lets nothing through; false of an empty one.
[[nodiscard]] bool isOpaque(const Texture& picture);
/// The environment as six faces of size x size, or as a picture of width x height all around.
/// Resampled with a sharp filter where that is not coarser than it was, else averaged. What it has
/// already is kept as it is. Errors: those of EnvironmentMap::make(), memory, (usage) a size
/// below 1.
[[nodiscard]] Result<Environment> asCube(const Environment& environment, int size,
                                         const Limits& limits);
[[nodiscard]] Result<Environment> asEquirectangular(const Environment& environment, int width,
                                                    int height, const Limits& limits);
/// The environment in the axes of the world with sky and ground in its pictures: for files that
/// hold pictures only. Itself where nothing changes. Errors: those of EnvironmentMap::make().
[[nodiscard]] Result<Environment> flattened(const Environment& environment, const Limits& limits);
/// The size that keeps what a picture has: in the middle of faces (width / pi, even) for a picture
/// all around; four faces around for a cube.
[[nodiscard]] int cubeSizeOf(const Environment& environment);
[[nodiscard]] glm::ivec2 equirectangularSizeOf(const Environment& environment);

}  // namespace stx

#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <glm/glm.hpp>

#include "lib/base/image.hpp"
#include "lib/base/result.hpp"
#include "lib/geometry/bounds.hpp"
#include "lib/geometry/camera.hpp"
#include "lib/geometry/depth_code.hpp"
#include "lib/model/texture.hpp"

namespace stx {

/// The error of a depth that is NaN or below 0.
[[nodiscard]] inline tl::unexpected<Error> depthError(float depth) {
    return fail(ErrorCode::invalidInput, "depth holds {}; distances are 0 or more", depth);
}

/// What a pixel without a depth is.
enum class NoDepth : std::uint8_t {
    empty,    ///< nothing is there: one sees past all that others put in front
    unknown,  ///< with full alpha a surface whose distance is not known; with none, nothing
};

/// "empty" or "unknown".
[[nodiscard]] inline const char* nameOf(NoDepth noDepth) {
    return noDepth == NoDepth::unknown ? "unknown" : "empty";
}
/// What a name says; none for other names.
[[nodiscard]] inline std::optional<NoDepth> noDepthNamed(std::string_view name) {
    for (const NoDepth value : {NoDepth::empty, NoDepth::unknown})
        if (name == nameOf(value)) return value;
    return std::nullopt;
}

/// How a camera was moved from where it was given.
struct CameraMove {
    glm::dvec3 shift{0.0};  ///< was added to its position, scene units
    glm::dquat turn{1.0, 0.0, 0.0,
                    0.0};  ///< unit; its orientation was multiplied by it from the left

    bool operator==(const CameraMove&) const = default;
};

/// What refining has done to a view (lib/refine/refine.hpp).
struct Refined {
    /// Those that changed something in its set: names with commas between them; empty: none.
    std::string steps;
    /// How far off points may be: share of the distance (of orthographic views: of the depth range
    /// of their DepthAxis), one standard deviation; 0 of depth that was exact.
    float doubt = 0;
    std::optional<CameraMove> moved = {};  ///< by the step poses

    /// As containers keep it: "noise,agree 0.0031"; of a camera that was moved with the shift and
    /// x, y, z, w of the turn behind it.
    [[nodiscard]] std::string text() const;
    /// Of such a text; none of others.
    [[nodiscard]] static std::optional<Refined> from(std::string_view text);
    bool operator==(const Refined&) const = default;
};

/// The JPEG file that colours were decoded from, where a reader was asked to keep it, for writers
/// that would rather copy it than code the colours again. Whoever changes the colours need not
/// know of it: writers compare what it decodes to.
struct ColourFile {
    std::shared_ptr<const std::vector<std::byte>> jpeg;  ///< null: none
    int x = 0, y = 0;  ///< where the first pixel of the colours is in its picture
};

/// What is said of a view beside its images.
struct ViewHeader {
    std::string name;  ///< becomes part and file names, which number what comes twice
    Camera camera;

    /// Scene units from the viewpoint; bounds the object. What writes depth as codes (8 or 16 bits:
    /// MPEG-4, atlases in folders) clamps depth beyond the planes to them, with a note.
    double nearPlane = 10.0;
    double farPlane = 100.0;
    /// How the depth is coded in MPEG-4 files: 8 or 16 bits; 32 = float distances, only in .exr.
    int depthBits = 16;
    /// Of a mesh: empty; of a photograph whose depth was measured: mostly unknown.
    NoDepth noDepth = NoDepth::empty;
    /// In an atlas, of a view with NoDepth::unknown: whether the whole view is masked as
    /// lacksDepthByMask() says (lib/packing/packing.hpp), of which rectangles show a part. Nothing:
    /// that is not known, or all of the view is there.
    std::optional<bool> masked{};
    /// Depth was taken away where other views show the same (see prune()). Those pixels have full
    /// alpha and are unknown, whatever noDepth says.
    bool pruned = false;
    /// What is behind everything that moves, remembered from other times (TemporalBackground).
    /// Renderers use it only where no other view shows a surface.
    bool background = false;
    Refined refined;
    ColourFile colourFile;

    /// Whether a pixel of full alpha without a depth is a surface whose distance is not known.
    [[nodiscard]] bool depthMayBeUnknown() const { return pruned || noDepth == NoDepth::unknown; }
    [[nodiscard]] DepthCode depthCode() const {
        return {nearPlane, farPlane, depthBits == 8 ? 255u : 65535u};
    }
    /// What a step of its depth code is of a pixel's size at the near plane; 0 of floats.
    [[nodiscard]] double depthStepInPixels() const {
        if (depthBits == 32) return 0;
        const glm::dvec2 pixel = camera.sampleSpacing(nearPlane);
        return depthCode().step() / std::min(pixel.x, pixel.y);
    }
    /// Codes are fine enough where a step is at most this. Two spheres before a far value: steps of
    /// 0.1 give 42.9 dB (floats 42.7), of 1 31.2 dB, of 60 25.9 dB.
    static constexpr double kFineStep = 0.25;
};

/// One reference image of an object: a DepthImage with its SimpleTexture or SimpleTextureV2
/// (ISO/IEC 14496-16, 4.5.4). All images of a view have the camera's width and height.
struct ReferenceView : ViewHeader {
    Texture texture;     ///< colour with coverage in alpha
    Image<float> depth;  ///< planar distance in scene units; kNoDepth where there is no point

    /// SimpleTextureV2. Empty when absent; else one value per pixel, zero where there is no point,
    /// but for pruned pixels beside kept ones, which keep their normal (keepOnly()). Unit, in the
    /// world, towards the camera, but for those of bent or mapped surfaces that a mesh has at rims
    /// and steep bumps.
    Image<glm::vec3> normal;
    Image<glm::vec3> splatU;  ///< tangent vectors in the world, scene units: half axes of the splat
    Image<glm::vec3> splatV;

    /// How the surface answers to light (glTF 2.0, 3.9.2 and 3.9.3), for engines: nothing here
    /// draws it. Empty when absent; else one value per pixel, zero for pixels without a point, but
    /// for pruned ones beside kept ones, and for views that had none (unpack()).
    Image<glm::vec2> metallicRoughness;  ///< metallic, roughness, 0..1
    Image<glm::vec3> emissive;  ///< linear light that `texture` does not hold; may exceed 1

    [[nodiscard]] bool hasMaterial() const {
        return !metallicRoughness.empty() || !emissive.empty();
    }
    [[nodiscard]] bool hasNormals() const { return !normal.empty(); }
    [[nodiscard]] bool hasSplats() const { return !splatU.empty() && !splatV.empty(); }

    /// Moves all images into a spool; see Image::moveTo().
    void moveTo(PixelSpool* spool);

    /// Pixels that are points of the object.
    [[nodiscard]] std::int64_t pointCount() const;
    /// The same, and the error of check() when a depth is NaN or below 0.
    [[nodiscard]] Result<std::int64_t> checkedPointCount() const;
    /// World bounds of all points, of worldPoint() of each; empty when there are none.
    [[nodiscard]] Bounds computeBounds() const;
    /// World position of the point of pixel (x, y), whose depth must be one.
    [[nodiscard]] glm::dvec3 worldPoint(int x, int y) const {
        return camera.position +
               camera.orientation * camera.unproject(x + 0.5, y + 0.5, depth.at(x, y));
    }
    /// Errors when sizes disagree, or the camera, the planes or the depth bits make no sense. Looks
    /// at no pixel.
    [[nodiscard]] Result<void> checkHeader() const;
    /// checkHeader(), and errors when a depth is NaN or below 0. Looks at every pixel.
    [[nodiscard]] Result<void> check() const;
};

}  // namespace stx

#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string_view>
#include <vector>

#include "formats/images/images.hpp"
#include "formats/mpeg4/scene/document.hpp"
#include "lib/model/bundle.hpp"
#include "lib/model/view_table.hpp"

// clang-format off
/// Scenes and bundles (ISO/IEC 14496-16, 4.5.4).
///
/// What the standard leaves open, and these functions decide:
///  - Pixel (i, j), row 0 on top, samples u = (i+1/2)/W*2-1, v = 1-(j+1/2)/H*2 of the window.
///  - Rows of a PixelTexture and of a PointTexture run from the bottom to the top.
///  - Beside a depth image, the alpha of the texture is coverage; without alpha, coverage is full
///    where the depth has a point. Without a depth image, alpha is the depth code.
///  - Normals: n = 2c/cmax - 1, in the frame of the DepthImage's parent; 0 0 0 means "no normal".
///  - splatU and splatV hold the half axes of the splat, each component scaled from [0, cmax] to
///    [splatMinMax.x, splatMinMax.y], in the same frame. Where splatMinMax.x is 0 or more (as in
///    the default) components could not be negative; then s = 2c/cmax - 1 gives the direction, and
///    the length is splatMinMax.x + (splatMinMax.y - splatMinMax.x) * min(1, |s|). What is written
///    has splatMinMax = (-L, L), L the largest component of the view.
// clang-format on
namespace stx::mpeg4 {

/// Decodes an image file; the default is decodeImage().
using ImageDecoder = std::function<Result<DecodedImage>(ByteSpan bytes, std::string_view name,
                                                        const Limits& limits)>;

struct SceneReadOptions {
    /// Images that the scene names by a string are looked for in here; empty: they are errors.
    std::filesystem::path folder;
    ImageDecoder decode = decodeImage;
    /// Without pixels only headers are read: the views have cameras, planes and depthBits, but
    /// empty images. A view that cannot be read is left out then with a note, and one that no
    /// camera can show, for its Transforms, is as it would be without them.
    bool pixels = true;
    /// Whether the Background is read, too; without pixels it never is.
    bool environment = true;
    /// A scene that shows no view gives a bundle without any, instead of an error.
    bool mayBeEmpty = false;
    /// startTime and stopTime that come with a later access unit count from the scene's start; see
    /// SceneInTime.
    bool timesFromStart = false;
    /// Views keep the JPEG files that their colours come from.
    bool keepColourFiles = false;
    /// A note of what moves, and is read as it is at its start.
    bool noteMotion = true;
};

/// The object of a presentation as it is at its first moment: a view for each DepthImage (and
/// DepthImageV2) that is shown. Transforms are folded into the cameras; of a Switch only the chosen
/// child counts; a node used twice gives two views. A PointTexture gives as many views with the
/// same camera as a pixel has depths; an OctreeImage gives a view for each of its images, with the
/// depths of the voxels that it sees first. Views are named by DEF name. Title, bounds and
/// origin come from WorldInfo; bounds are left out where a view sees nothing of them between its
/// planes. Errors (invalidInput) name the view and what is wrong; Transforms
/// that scale unevenly, shear or mirror are refused. Notes say what is left out.
[[nodiscard]] Result<Bundle> bundleFromScene(const Document& document,
                                             const SceneReadOptions& options, Job& job);

/// The same as a table, whose pictures are decoded when a view is asked for; all are in memory of a
/// PointTexture, an OctreeImage, of video, and of what only its pixels tell (pictures other than
/// PNG and JPEG, masks). It keeps the document.
[[nodiscard]] Result<std::unique_ptr<ViewTable>> viewsFromScene(
    std::shared_ptr<const Document> document, const SceneReadOptions& options, Job& job);

/// Whether pictures of its views are video: H.264 or another coding that needs a decoder of video.
[[nodiscard]] bool holdsVideo(const Document& document);

/// What the scene's objects are: "SimpleTexture", "SimpleTextureV2", "PointTexture", "OctreeImage",
/// or "none"; the richest where there are several.
[[nodiscard]] const char* nodeKindOf(const Document& document);

/// The first string of the WorldInfo of scenes that are made from bundles.
inline constexpr const char* kMadeByUs = "made by stx";

struct PictureLoss;

struct SceneWriteOptions {
    enum class Texture { png, jpeg };
    enum class Nodes { automatic, v1, v2 };  ///< automatic: V2 for views with normals or splats
    Texture texture = Texture::png;
    int jpegQuality = 92;  ///< 1..100
    int depthBits = 0;     ///< 8 or 16; 0: as each view says (32 becomes 16)
    int normalBits = 16;   ///< 8 or 16, of normal, splatU and splatV
    Nodes nodes = Nodes::automatic;
    /// PointTexture instead of SimpleTexture; the colours are in the scene itself.
    bool pointTexture = false;
    /// OctreeImage of so many levels instead of depth images, see octree_write.hpp; 0: none.
    int octreeLevels = 0;
    /// Of sequences: pictures that change become H.264 video, colour of this quality (0..51), depth
    /// lossless in 8 or 10 bits; -1: PNG or JPEG pictures.
    int h264 = -1;
    /// Range of each view's splats in scene units, of a sequence whose frames share it; empty or 0:
    /// the largest that the view has.
    std::vector<float> splatRanges;
    /// Where each view's depth is unknown, of a sequence without alpha (see UnknownPixels::text());
    /// empty: as its picture says.
    std::vector<std::string> unknownWhere;
    /// Of sequences: hears what pictures lose, which is then noted for all frames; null: noted.
    PictureLoss* loss = nullptr;
};

/// A presentation of a bundle: Group { WorldInfo, DepthImage..., Background, Viewpoint,
/// NavigationInfo } (background.hpp), the WorldInfo with title and bounds (computed where the
/// bundle has none); with octreeLevels Group { WorldInfo, OctreeImage }, under a Transform where
/// the object is not in the unit cube. Field values are rounded to float, planes outwards. A
/// principal point off the centre is centred by padding with pixels without a point (see
/// placement.hpp) and noted; reading the scene back here undoes it. What is lossy is noted: float
/// depth and 8 bits with the largest error, JPEG, linear colour, what V1 cannot hold. Errors:
/// (unsupported) more images than MPEG-4 has object descriptors for, or images that padding makes
/// too large; (usage) options out of range; what Bundle::check() says.
[[nodiscard]] Result<Document> sceneFromBundle(const Bundle& bundle,
                                               const SceneWriteOptions& options, Job& job);
/// Notes that views count from another origin than they did `before` (originOf()), if they do.
void noteOrigin(const glm::dvec3& origin, const Bundle& before, Job& job);
class PictureSpool;
/// The same of views that are encoded when they come, into `spool`, or into memory when it is null.
/// All views are in memory, and their pictures in the scene, of PointTexture and OctreeImage.
[[nodiscard]] Result<Document> sceneFromViews(const ViewTable& table,
                                              const SceneWriteOptions& options, PictureSpool* spool,
                                              Job& job);

}  // namespace stx::mpeg4

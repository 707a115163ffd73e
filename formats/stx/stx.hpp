#pragma once

/// The library stx: reference views with depth (ISO/IEC 14496-16, depth image-based representation)
/// from models and photographs, packed, baked, drawn and measured. This is the only header to
/// include; it does what the program `stx` does, a call for each command:
///
///     stx::Job job;
///     auto model = stx::open("amphora.obj", {}, job);              // Result<Model>
///     auto bundle = stx::convert(std::move(*model), {}, job);      // 16 views of 512x512
///     stx::bake(*bundle, {}, job);                                 // normals and splats
///     auto atlas = stx::pack(*bundle, {}, job);                    // at most four textures
///     auto camera = stx::cameraAt({1.5, 1.2, 2.5}, {0, 0.5, 0}, {});
///     auto frame = stx::render(*bundle, *camera, {}, job);
///     stx::save(*frame, "novel.png", {}, job);
///
/// Each call gives a Result: the value, or one Error with a code, a sentence and where it happened.
/// A call that runs out of memory throws std::bad_alloc, as the standard library does. Calls are
/// safe from several threads as long as each has its own objects; one Job may serve all of them.
/// Work runs on all processors, or on as many threads as a ThreadLimit allows.
///
/// Units: lengths are in scene units, angles in radians, sizes and positions in images in pixels.
/// Cameras look along -Z with +X right and +Y up; pixel (0, 0) is the top-left one and its centre
/// is (0.5, 0.5); depth is planar (Camera).

#if __cplusplus < 202002L
#error "stx needs C++20: compile with -std=c++20"
#endif

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "formats/any/given_options.hpp"
#include "formats/any/options.hpp"
#include "formats/environment/environment_files.hpp"
#include "formats/validate/validate.hpp"
#include "lib/background/still.hpp"
#include "lib/base/job.hpp"
#include "lib/base/parallel.hpp"
#include "lib/metrics/compare.hpp"
#include "lib/model/atlas.hpp"
#include "lib/model/bundle.hpp"
#include "lib/model/from_origin.hpp"
#include "lib/model/mesh.hpp"
#include "lib/model/sequence.hpp"
#include "lib/packing/packing.hpp"
#include "lib/packing/prune.hpp"
#include "lib/render/api/renderer.hpp"
#include "lib/surface/normals.hpp"

namespace stx {

/// The version of the library that runs, as "0.1.0".
[[nodiscard]] const char* version();

// ---- Files ----

/// What a file or a folder holds.
using Model = std::variant<Mesh, Bundle, Atlas>;

/// Opens a mesh (glTF, GLB, OBJ, PLY, STL, DRC, SPZ), a bundle (.mp4, .xmt, .bt, .exr), an image
/// set, or an atlas (its folder, its atlas.json, or .exr). The content decides, then the name's
/// ending. What is opened has passed check(). What is lossy or left out is in job.takeNotes().
/// Errors: io, invalidInput (with the byte offset, line or key), usage (an option that the set does
/// not have), unsupported (the module of image codecs is not there).
[[nodiscard]] Result<Model> open(const std::filesystem::path& path, const OpenOptions& options,
                                 Job& job);

/// Writes a bundle, whole or not at all, in the container of the target's ending: .exr (nothing is
/// lost), .mp4, .xmt or .bt (depth in 8 or 16 bits, colour as PNG or JPEG). Errors: usage (another
/// ending, JPEG or video in .exr), invalidInput (a bundle that fails check()), io.
[[nodiscard]] Result<void> save(const Bundle& bundle, const std::filesystem::path& target,
                                const SaveOptions& options, Job& job);

/// Writes an atlas, whole or not at all: one OpenEXR file when the name ends in .exr, else a folder
/// of atlas.json and at most four images. Errors: usage ("-": the standard output is the
/// program's), invalidInput (Atlas::check()), unsupported (JPEG where OpenEXR is needed), io.
[[nodiscard]] Result<void> save(const Atlas& atlas, const std::filesystem::path& target,
                                const SaveOptions& options, Job& job);

/// Opens what holds views in time: an .mp4, .xmt or .bt with pictures that move, an image set with
/// time, `name_%04d.exr`, `atlas_%04d`, Azure Kinect's .mkv; whatever stands still is one frame. No
/// picture is read before a frame is asked for: timeline() tells when they are shown,
/// timeline().frameAt(seconds) which is shown then, frame(number, job) gives it as a bundle.
/// Errors: as open().
[[nodiscard]] Result<std::unique_ptr<Sequence>> openSequence(const std::filesystem::path& path,
                                                             const OpenOptions& options, Job& job);

/// Writes a film, frame by frame in bounded memory and whole or not at all: .mp4, .xmt, .bt, or
/// `name_%04d.exr`. One frame is saved as its bundle. Errors: as those of a bundle; (usage) a
/// target that holds one frame only, a name with several numbers, or the name of a film of numbered
/// files that is open: these are read when frames are asked for, and nothing replaces them.
[[nodiscard]] Result<void> save(Sequence& frames, const std::filesystem::path& target,
                                const SaveOptions& options, Job& job);

// sequenceOf(Bundle), someFrames(frames, numbers), changed(frames, change), fromOrigin(frames,
// origin), and
// noteUnusedOptions(), checkFrameOf()         options of open() that do not matter to an input
// validateFile(path, ValidateOptions, Job&)   every rule that a bundle or an atlas breaks
// openEnvironment(path, Job&)                 what is far behind a bundle (Bundle::environment);
//                                             saveEnvironment() writes it alone
// are declared in the headers above.

// ---- Bundles ----

/// How a model becomes reference views. What is said of views applies to meshes.
struct ConvertSettings {
    /// `cube` (6), `ring:N`, `sphere:N`, `octahedral:N` (N x N),
    /// `hemi-octahedral:N` (N x N, from above), `auto:N` (the N best), N from 1,
    /// or `auto:DBdB` (the fewest that reach this PSNR, as in auto:38dB).
    std::string views = "sphere:16";
    /// The views themselves, in the model's coordinates (see originOf()), when there are any: then
    /// neither `views` nor the framing below, from width to elevationRad, counts.
    std::vector<Camera> cameras{};
    /// Names of the views, one for each of `cameras`; empty: view000, view001, ...
    std::vector<std::string> names{};
    int width = 512, height = 512;             ///< pixels of each view
    std::optional<bool> orthographic{};        ///< without a value: only the faces of a cube are
    double fovRad = glm::radians(35.0);        ///< the angle that the whole object fills
    double elevationRad = glm::radians(15.0);  ///< of a ring above the horizon
    int supersampling = 4;                     ///< colour samples per pixel and axis, 1..8
    bool meshNormals = false;                  ///< keeps the mesh's own normals (SimpleTextureV2)
    /// Keeps metallic-roughness, of a model that was opened with OpenOptions::materials, and
    /// emissive as images of the views; colour is then without the light that is given off.
    bool materials = false;
    std::string title{};  ///< of the bundle
    /// 8, 16 or 32 (float distances, only .exr holds them). Without a value meshes get 16 and
    /// bundles keep theirs.
    std::optional<int> depthBits{};
    /// The up axis of the mesh, around which views are placed; need not be unit. Without a value:
    /// upOf().
    std::optional<glm::dvec3> up{};
};

/// Captures a mesh from all sides; takes the views out of an atlas; gives a bundle the depth bits
/// that are asked for. A note names the settings of meshes that were given for one of the latter.
/// Errors: usage (settings), invalidInput (a mesh that fails check(), no view sees the object),
/// failed (cancelled), and memory over the limit.
[[nodiscard]] Result<Bundle> convert(Model model, const ConvertSettings& settings, Job& job);

// bake(Bundle&, BakeSettings, Job&)           normals and splat axes from depth
// prune(Bundle&, PruneSettings, Job&)         takes away pixels that other views show as well
// pack(Bundle, PackSettings, Job&) -> Atlas   at most four textures; unpack(Atlas, Job&) -> Bundle
// are declared in the headers above.

/// The box around a model's surface or points; empty when there is none.
[[nodiscard]] Bounds boundsOf(const Model& model);

/// What a model's coordinates count from: positions and cameras here, and those of novel cameras,
/// plus this are the world's. 0 but for models whose coordinates are too large for floats.
[[nodiscard]] glm::dvec3 originOf(const Model& model);

/// A camera that was given beside those of a model's views, where the step `poses` of refining
/// would have moved it: as the ones near it (lib/registration/camera_moves.hpp). Both in the
/// model's coordinates. It stays, to the bit, where no view was moved.
[[nodiscard]] Camera alignedCamera(const Model& model, const Camera& camera);

/// The up axis of a model, unit: the axis of its reference views, of a cloud of splats what is up
/// by the habits of its format, else +Y.
[[nodiscard]] glm::dvec3 upOf(const Model& model);

// ---- What is behind those who pass ----

struct BackgroundSettings {
    double support = 0.04;  ///< share of the frames that must show a surface, above 0, at most 1
    int keyViews = 8;       ///< poses of moving cameras that get a background, at most; 1..64
};

/// The frames of a film with a view more for each camera that stands still, and for a few poses of
/// those that move: what is behind everything that passes. All frames are read. Errors:
/// invalidInput (one frame, nothing that stays), usage (settings), those of reading.
[[nodiscard]] Result<std::unique_ptr<Sequence>> background(std::unique_ptr<Sequence> frames,
                                                           const BackgroundSettings& settings,
                                                           Job& job);

/// The background of plain video of a camera that stands still: pictures, a folder of them,
/// `frame_%04d.png`, or a film (.y4m; .mp4, .mov, .mkv, .webm and .avi by the module of video).
/// Frames in memory: stillBackground(). Errors: io, unsupported, those of stillBackground().
[[nodiscard]] Result<StillBackground> background(const std::vector<std::filesystem::path>& inputs,
                                                 const StillSettings& settings, Job& job);

// ---- Pictures ----

/// The lens and the frame of novel cameras.
struct CameraSettings {
    int width = 512, height = 512;       ///< pixels
    double fovRad = glm::radians(40.0);  ///< vertical, above 0 and below pi
    double orthoHeight = 0;  ///< above 0: orthographic, with a window of this height in scene units
    glm::dvec3 up{0, 1, 0};  ///< what is up in the picture; need not be orthogonal
};

/// A camera at `eye` that looks at `target`, both in the world. Errors (usage): they coincide,
/// are not finite or lie 1e150 and more apart, or settings out of range.
[[nodiscard]] Result<Camera> cameraAt(glm::dvec3 eye, glm::dvec3 target,
                                      const CameraSettings& settings);

/// Cameras on a circle around an object, whose axis is CameraSettings::up.
struct OrbitSettings {
    int count = 1;                        ///< from 1
    double elevationRad = 0;              ///< above the horizon
    double startRad = 0;                  ///< of the first, from the front (+Z when +Y is up)
    double arcRad = glm::radians(360.0);  ///< counter-clockwise from above; less than a whole
                                          ///< circle: the last camera is at its end
    double distance = 0;  ///< from the centre, scene units; 0: the sphere just fills
                          ///< the narrower side of the frame
};

/// The cameras of an orbit around a sphere. Errors (usage): settings out of range, or a radius that
/// is not finite.
[[nodiscard]] Result<std::vector<Camera>> orbitCameras(glm::dvec3 centre, double radius,
                                                       const OrbitSettings& orbit,
                                                       const CameraSettings& settings);

/// The same for `count` cameras on a whole circle, the first in front.
[[nodiscard]] Result<std::vector<Camera>> orbitCameras(glm::dvec3 centre, double radius, int count,
                                                       double elevationRad,
                                                       const CameraSettings& settings);

/// The renderer of any model, which it keeps: for more than one picture. A mesh is rasterised
/// itself, on the processor: the truth to compare with. Backend::automatic takes a hardware GPU
/// when there is one, else cpu; `device` chooses among the GPUs (-1 = the best). The job must
/// outlive the renderer. Errors: a model that fails check(); unsupported, with what was tried.
[[nodiscard]] Result<std::unique_ptr<Renderer>> rendererOf(Model model,
                                                           const RenderSettings& settings, Job& job,
                                                           Backend backend = Backend::automatic,
                                                           int device = -1);

/// The same of a model that others use, too.
[[nodiscard]] Result<std::unique_ptr<Renderer>> rendererOf(std::shared_ptr<const Model> model,
                                                           const RenderSettings& settings, Job& job,
                                                           Backend backend = Backend::automatic,
                                                           int device = -1);

/// One picture of camera.width x camera.height by the best backend of this machine. Errors: a
/// camera that fails check(), memory over the limit, and those of rendererOf().
[[nodiscard]] Result<Frame> render(const Model& model, const Camera& camera,
                                   const RenderSettings& settings, Job& job);

/// A picture as files hold it, straight alpha.
struct Picture {
    Rgba8Image coded;         ///< 8-bit sRGB, always
    RgbaFloatImage linear{};  ///< linear light, of files of floats (OpenEXR, HDR); else empty
    RgbaFloatImage fine{};    ///< 0..1, coded as the file is, of integers of 16 bits; else empty
    int pictures = 1;         ///< that the file holds, of which this is the first (OpenEXR)
    /// Channels of the file that are no colours of this, as "Z".
    std::vector<std::string> others{};

    [[nodiscard]] bool isLinear() const { return !linear.empty(); }
};

/// Two pictures as they are compared: as floats when both are linear; by codes of 16 bits, as
/// floats of 0..1, when one is of 16 bits (`fine`, the other one's 8 bits spread, and linear light
/// coded as sRGB); else by those of 8 bits, and both are null. They must outlive this.
class PicturePair {
  public:
    PicturePair(const Picture& a, const Picture& b);
    PicturePair(const PicturePair&) = delete;  // it may point to what it holds
    PicturePair& operator=(const PicturePair&) = delete;
    [[nodiscard]] const RgbaFloatImage* first() const { return first_; }
    [[nodiscard]] const RgbaFloatImage* second() const { return second_; }
    /// Settings for the floats, or the codes, of those whose background is sRGB-coded.
    [[nodiscard]] CompareSettings settings(CompareSettings asked) const;
    /// Whether codes of 16 bits are compared: differences of the floats are for inCodes16().
    [[nodiscard]] bool codes16() const { return first_ && !linear_; }
    /// errorPicture() of what is compared; the background of `asked` is sRGB-coded.
    [[nodiscard]] Result<Rgba8Image> errorPicture(const CompareSettings& asked, double gain) const;

  private:
    const Picture &a_, &b_;
    const RgbaFloatImage *first_ = nullptr, *second_ = nullptr;
    RgbaFloatImage made_;
    bool linear_ = false;
};

/// A difference of floats of 0..1 in codes of 16 bits; a hundredth of one is rounding.
[[nodiscard]] double inCodes16(double difference);

/// Opens a picture of any format that the codecs know (PNG, JPEG, TIFF, OpenEXR, ...), and of HEIC
/// without its depth; turned upright, as the EXIF of a JPEG, PNG or HEIC says. OpenEXR is its
/// display window; what is not stored of it is black, and transparent where the file has alpha.
/// Errors: io, invalidInput, unsupported (the module of image codecs is not there).
[[nodiscard]] Result<Picture> openPicture(const std::filesystem::path& path, Job& job);

/// What save() would put into a PNG.
[[nodiscard]] Picture pictureOf(const Frame& frame,
                                const std::optional<glm::vec3>& background = {});

struct PictureOptions {
    /// Put behind the picture, sRGB-coded 0..1. Without it PNG and EXR keep their alpha, and JPEG
    /// has black behind.
    std::optional<glm::vec3> background{};
    int jpegQuality = 92;            ///< 1..100
    bool noClobber = false;          ///< error (io) when the target exists
    std::optional<Camera> camera{};  ///< OpenEXR: goes into its standard attributes
    glm::dvec3 origin{0.0};          ///< OpenEXR: what the camera counts from, as originOf() says
};

/// Writes a picture, whole or not at all, as .png, .jpg, .tif or .webp (8-bit sRGB) or .exr
/// (linear, with depth, and normals where the frame has them). Errors: usage (another ending; "-":
/// the standard output is the program's; options out of range), io.
[[nodiscard]] Result<void> save(const Frame& frame, const std::filesystem::path& target,
                                const PictureOptions& options, Job& job);

/// PSNR, SSIM and the worst pixel of two pictures of one size, as PicturePair says, with a note
/// when only one is linear; of 16 bits the worst pixel is in their codes. The background is
/// sRGB-coded, as that of PictureOptions. Pictures in memory: compare() of two images. Errors:
/// invalidInput when sizes disagree, the mask leaves nothing or it takes more memory than the
/// limits allow; usage (a background that is not of 0..1); failed (cancelled).
[[nodiscard]] Result<Comparison> compare(const Picture& a, const Picture& b,
                                         const CompareSettings& settings, Job& job);

}  // namespace stx

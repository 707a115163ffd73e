#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/yuv/yuv_colour.hpp"
#include "lib/base/job.hpp"
#include "lib/model/bundle.hpp"
#include "lib/model/sequence.hpp"
#include "lib/refine/refine.hpp"

/// Photographs with depth and cameras, as other programs leave them. Axes, pixel centres and the
/// meaning of depth of every kind: formats/imagesets/README.md.
namespace stx {

/// What is nearest in a grey picture of depth that has no scale: two customs exist.
enum class NearIs { unknown, white, black };

/// Of photographs with depth, beside depthPattern (the depth's picture where the file has none),
/// depthMin and depthMax (the distances of its nearest and farthest value), depthUnit and
/// intrinsics (of the upright picture, from its corner).
struct PhotoSetOptions {
    NearIs nearIs = NearIs::unknown;
    bool portrait = false;  ///< the blurred picture, where the file has a sharp one, too
    double fovRad = 0;      ///< vertical, of the upright picture; 0 = as the file tells
    /// A background view of what is hidden is invented (addBehind()), for eyes that go as many
    /// percent of the median distance to the side; 0: none is.
    double behindPercent = 0;
};

struct ImageSetOptions {
    std::string from;  ///< one of imageSetKinds(); empty = recognise
    int frame = 0;     ///< of sets that have time, from 0
    /// Pictures with times are of a scene that moves; else all are views of one moment. Without a
    /// value: as the kind of set usually is (recordings of a moving camera are of one moment).
    std::optional<bool> moving;
    int every = 1;  ///< takes each N-th view, for recordings of thousands
    /// A view whose files are missing (transforms, TUM, 7-Scenes), whose pose is of lost tracking
    /// (TUM, 7-Scenes, Open3D) or of which no pixel has a usable depth is an error, not a note, and
    /// so is a picture of a film that is missing or damaged.
    bool strict = false;
    /// The set is one of many, which may be of other kinds: options that its kind does not take are
    /// noted and not refused.
    bool manyKinds = false;
    /// Depth range that the set itself does not have (MSR, films), scene units; 0, 0 = not given.
    double depthMin = 0, depthMax = 0;
    /// Scene units of one step of integer depth, of films, depth beside photographs, and sets that
    /// hold distances; 0: as the set says, or as is usual of its kind.
    double depthUnit = 0;
    /// Names of the images relative to the set's folder with {name} {w} {h} {format} {frame}
    /// {frame:04} in them (MIV); empty = the usual names. Names of films (.mp4, .mov, .mkv, .webm,
    /// .avi): their frames are those of the cameras in `path`, a JSON file.
    std::string texturePattern, depthPattern;
    /// Pictures of what belongs to the object, white on black, as large as the colour pictures:
    /// file names with {stem} (of the colour picture's file), {name}, or {frame} of sets whose
    /// frames are files by number, beside the set or in the current folder; empty: none.
    std::string maskPattern;
    /// What pixels without depth are. Without a value: what the depth itself says (1e9 and more or
    /// infinity somewhere: nothing is there, 0 and NaN are not known), else empty where the picture
    /// has transparent pixels or a mask and all that is opaque has depth, and unknown where not.
    std::optional<NoDepth> noDepth;
    /// Older Middlebury sets: focal length in pixels, and scene units from the first to the last
    /// view that has disparities; 0 = not given.
    double focal = 0, baseline = 0;
    /// What is added to their disparities, in pixels. Without a value: dmin.txt, or 0.
    std::optional<double> disparityOffset;
    /// Stored value of one pixel of disparity (Middlebury 2001: 8, 2003: 4 at quarter size).
    double disparityScale = 1;
    /// fx, fy, cx, cy of TUM and 7-Scenes recordings whose folder does not have them, in pixels as
    /// these sets count them (the first pixel's centre is 0, 0); fx = 0: not given.
    double intrinsics[4] = {0, 0, 0, 0};
    PhotoSetOptions photo;
    /// Of TUM and 7-Scenes recordings whose depth comes from a camera of its own: its fx, fy, cx,
    /// cy, counted as in `intrinsics`. Without a value: 7-Scenes' published ones, TUM's colour.
    std::optional<glm::dvec4> depthIntrinsics;
    /// A text file with the rows of R | t: a point of the depth camera is R p + t in the colour
    /// camera (x right, y down, z forward, scene units). "none": the depth lies on the pixels of
    /// its picture. Empty: 7-Scenes' published one, where `intrinsics` are not given; else none.
    std::string depthToColour;
    /// What is repaired at the import: steps of RefineWhen::import and both. Where `raise` is left
    /// out, pictures that are larger than their depth are reduced to its size.
    RefineSettings refine;
    /// Is told what they did, once for each moment that is read; null: nobody asks.
    std::function<void(const RefineReport&)> refined;
    /// Called with the error of each view that cannot be read, in their order; reading ends with
    /// that of the first all the same. Null: the others are not looked at then.
    std::function<void(const Error&)> failedView;
    YuvColour yuv;
    /// Of the bundle's views: 8, 16 or 32 (float distances). 0: what an export of ours had, else
    /// 16, or 32 where 16 would round by more than an eighth of a pixel's size.
    int depthBits = 0;
    /// Of a set that moves: depth is rounded to codes between the planes of its own frame. Whoever
    /// rounds it between those of all frames wants it as it was: rounded twice, it would be off by
    /// half a step of both.
    bool roundFrames = true;
    /// The views are those of a moment of a film, of which others show more: a picture that says
    /// that nothing is there is a view without a point. Readers of films set it themselves.
    bool ofFilm = false;
    /// Pictures of 16-bit integers become linear floats, of which they come back to the bit (then
    /// all pictures of the set do); else they are rounded to 8 bits, with a note.
    bool deepColour = false;
};

/// A kind of image set, for `--from` and its help.
struct ImageSetKind {
    std::string_view name;
    std::string_view description;
};
[[nodiscard]] const std::vector<ImageSetKind>& imageSetKinds();

/// The kind of the set that a file or folder is. Looks at names and the first bytes only. Errors:
/// io when there is nothing, invalidInput when it is not an image set, with what was looked for.
[[nodiscard]] Result<std::string> recogniseImageSet(const std::filesystem::path& path);

/// Reads one frame of a set; of a set that moves frame 0, with a note, when none is asked for.
/// Cameras are exact; lens distortion and skew are undone (views have the pixels of a pinhole that
/// the picture shows all of) and rotations repaired, with a note of their size in pixels. Pixels
/// without depth are what ImageSetOptions::noDepth says; nearPlane and farPlane of each view are
/// fitted. Several views at a time, in the memory of one per thread beside the bundle. Errors: io,
/// usage (an option that this kind needs or does not have), invalidInput with file and line or key.
[[nodiscard]] Result<Bundle> readImageSet(const std::filesystem::path& path,
                                          const ImageSetOptions& options, Job& job);

/// All frames of a set, one of a set without time. Which pictures belong to one camera the set says
/// (`camera` of transforms.json); else those of one pose do, and where no pose comes back after
/// another, one camera moves. Reads no pixel before a frame is asked for. Errors as readImageSet();
/// (usage) the step `poses` of a set that moves: it is of one moment.
[[nodiscard]] Result<std::unique_ptr<Sequence>> openImageSet(const std::filesystem::path& path,
                                                             const ImageSetOptions& options,
                                                             Job& job);

/// Frames of a set that has time, 1 for others.
[[nodiscard]] Result<int> imageSetFrameCount(const std::filesystem::path& path,
                                             const ImageSetOptions& options, Job& job);

}  // namespace stx

#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "formats/imagesets/image_sets.hpp"
#include "formats/imagesets/lens.hpp"
#include "formats/imagesets/panorama.hpp"
#include "formats/yuv/yuv.hpp"
#include "lib/model/bundle.hpp"

namespace stx {
class Film;
namespace photos {
struct Photo;
}
}  // namespace stx

/// What the readers of the kinds hand to the common way from files to reference views.
namespace stx::imagesets {

/// What most depth is counted in, metres.
inline constexpr double kMillimetre = 0.001;

/// Where an image's values lie.
struct PictureSource {
    std::filesystem::path path;
    std::string name;              ///< for messages, not quoted
    std::optional<YuvFormat> yuv;  ///< raw planes; else by the file (images, PFM)
    std::shared_ptr<Film> film;    ///< the picture is one of a film
    int frame = 0;                 ///< of raw planes and films
    std::optional<Error> missing;  ///< why there is no such file; reading it then ends with this
    bool colmap = false;           ///< COLMAP's depth maps: `w&h&c&` and floats
};

/// Colour and depth of a view as they were stored, before anything is undone.
struct StoredView {
    Texture texture;
    bool alpha = false;  ///< the texture's alpha is the set's own coverage
    Image<float> depth;  ///< as stored; see SetView::distances
    int largest = 0;     ///< integer that depth can be stored as; 0: it is floats
    /// What of the picture belongs to a person (255: all of a pixel), of the picture's shape;
    /// empty: nobody tells.
    Image<std::uint8_t> matte;
};

/// Turns stored values into planar distances (panoramas: ray lengths) in scene units, 0 where not
/// known, kNoDepth (or 1e9 and more) where nothing is there. The camera has the size of the image.
/// Stored integers, of which `largest` is the last that can be (0: they are floats), may come with
/// a fraction.
using Distances =
    std::function<Result<void>(Image<float>& values, const Camera& camera, int largest, Job& job)>;

/// How far a view lies beside others of its set; 0 where they do not tell.
struct SetShift {
    float values = 0;  ///< what all stored values are too small by, in their own unit
    double down = 0;   ///< by how many rows the first picture shows lower what it shows
};

/// One picture with depth of a set.
struct SetView {
    std::string name;
    /// In our axes. Width 0: as large as the images; see cameraOf().
    Camera camera;
    Pinhole told;  ///< what the set says of a camera without a size
    Lens lens;
    /// Of depth that a camera of its own took, in our axes, without lens; width 0: as large as the
    /// depth.
    std::optional<Camera> depthCamera;
    std::optional<Panorama> panorama;  ///< then `camera` has position and orientation only

    PictureSource texture, depth;
    /// A picture of what belongs to the object, as ImageSetOptions::maskPattern; name empty: none.
    PictureSource mask;
    /// Reads both, for kinds whose images are not files of their own.
    std::function<Result<StoredView>(const SetView&, Job&)> load;

    /// Why one of its files or its pose is not there; the view is left out then, unless the set is
    /// read strictly.
    std::optional<Error> missing;
    bool lost = false;  ///< with `missing`: what is not there is its pose

    Distances distances;  ///< null: the stored values are distances already
    /// What other pictures of the set show of it. The values come without stairs. Null: none can
    /// tell.
    std::function<SetShift(const Image<float>& values, const Texture& texture, Job& job)> shift;

    /// When it was taken, in seconds, and by which camera (empty: the set does not say).
    std::optional<double> time;
    std::string taker;

    bool sizeGuessed = false;  ///< the camera's, from its principal point
    bool stretched = false;    ///< its depth covers the picture, whatever the shapes of both are
    bool sensor = false;       ///< mixed pixels at depth edges are to be expected
    bool measured = false;     ///< stereo's disparities: gaps, and edges beside the picture's
    /// Planes and code of an export of ours; used when they hold all points.
    std::optional<DepthCode> planes;
    int depthBits = 0;                        ///< with planes: 8, 16, 32
    std::optional<glm::dvec3> localPosition;  ///< of an export of ours that has an origin
    std::optional<NoDepth> noDepth;           ///< of an export of ours; see ReferenceView::noDepth
    Refined refined;                          ///< the same
    bool pruned = false;                      ///< see ReferenceView::pruned
    bool background = false;                  ///< see ReferenceView::background
    bool absent = false;    ///< its camera has no picture yet: what it sees is not known
    std::string exactName;  ///< where `name` had to be changed to be a file's; else empty

    /// The camera; one without a size as one of images of this size.
    [[nodiscard]] Camera cameraOf(glm::ivec2 size) const {
        Camera out = camera;
        if (out.width > 0) return out;
        out.width = size.x;
        out.height = size.y;
        told.fill(out);
        return out;
    }
};

struct SetDescription {
    std::string title;
    std::optional<glm::dvec3>
        origin;  ///< of an export of ours; cameras are in the world all the same
    std::vector<SetView> views;
    /// Of an export of ours: the OpenEXR file of Bundle::environment; empty: none.
    std::filesystem::path environment;
    /// Of sets whose views are those of ImageSetOptions::frame; of others, motionOf() finds them.
    int frames = 1;
    std::optional<double> end;  ///< when its last picture ends, by the clock of the views' times
    double rate = 25;           ///< frames a second, where the set has frames without times
    /// What the one view's file says of itself, of a photograph with depth; else null.
    std::shared_ptr<const photos::Photo> photo;
    std::string cameraFrom;  ///< what a photo's camera follows from: "matrix", "focal35" …
    /// Its cameras stand still or are given, so that its pictures are of a scene that moves even
    /// where a sensor took them.
    bool film = false;
};

/// Reads the images of one view and does what is common to all kinds: sizes, lens, mixed pixels,
/// coverage, planes. A panorama gives its cube faces, others one view. `report` gets what the steps
/// of refining did. `showsNothing` becomes true where the error is that no pixel has a valid depth.
[[nodiscard]] Result<std::vector<ReferenceView>> loadSetView(const SetView& set,
                                                             const ImageSetOptions& options,
                                                             RefineReport& report,
                                                             bool& showsNothing, Job& job);

/// Distances of integers in steps of `unit`; 0 and `alsoNone` are not known.
[[nodiscard]] Distances scaledIntegers(double unit, float alsoNone = 0);

/// The same of sensors, of 16 bits: their largest code, 65535, is not known either. It is what they
/// write for "too far" or "no answer"; in millimetres it would be a wall at 65.5 m.
[[nodiscard]] inline Distances sensorIntegers(double unit) {
    return scaledIntegers(unit, 65535);
}

/// Distances of normalised disparity: s = code / largest, 1 at `nearest` and 0 at `farthest`
/// (scene units; infinity: 1 / distance from 0). 0 is not known where `zeroIsNone`. Floats are
/// distances already.
[[nodiscard]] Distances normalisedDisparity(double nearest, double farthest, bool zeroIsNone);

}  // namespace stx::imagesets

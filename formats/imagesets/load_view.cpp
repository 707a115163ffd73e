#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <vector>

#include "formats/files/messages.hpp"
#include "formats/images/images.hpp"
#include "formats/imagesets/no_depth.hpp"
#include "formats/imagesets/patterns.hpp"
#include "formats/imagesets/pictures.hpp"
#include "formats/imagesets/resample.hpp"
#include "formats/imagesets/set_view.hpp"
#include "lib/base/cpu_clock.hpp"
#include "lib/base/median.hpp"
#include "lib/capture/capture.hpp"
#include "lib/model/depth_values.hpp"
#include "lib/refine/align.hpp"
#include "lib/refine/gaps.hpp"
#include "lib/refine/mixed.hpp"
#include "lib/refine/raise.hpp"
#include "lib/refine/reproject.hpp"
#include "lib/refine/steps.hpp"

namespace stx::imagesets {
namespace {

/// A smaller share of a picture that undoing its lens cuts away is not told.
constexpr double kCutWorthTelling = 0.005;

/// Fills in a camera that has no size, and errors when sizes disagree.
Result<Camera> cameraOfSize(const SetView& set, int width, int height) {
    Camera c = set.cameraOf({width, height});
    // Principal points are near the middle of pictures.
    constexpr double kNearMiddle = 0.1;
    if (set.sizeGuessed && std::abs(c.width - width) <= kNearMiddle * width &&
        std::abs(c.height - height) <= kNearMiddle * height) {
        c.width = width;
        c.height = height;
    }
    if (c.width != width || c.height != height)
        return fail(ErrorCode::invalidInput,
                    "'{}' is {}x{}, but the camera '{}' has {}x{} pixels{}; both must match",
                    set.texture.name, width, height, set.name, c.width, c.height,
                    set.sizeGuessed ? " by its principal point, as 'w' and 'h' are missing" : "");
    if (auto ok = c.check(); !ok)
        return tl::unexpected(ok.error().at(fmt::format("camera '{}'", set.name)));
    return c;
}

bool anyPoint(const Image<float>& depth) {
    return std::ranges::any_of(depth.pixels(), hasPoint);
}

/// Takes away what a mask does not show, as maskFrom() has it.
Result<void> applyMask(const SetView& set, const std::filesystem::path& file, StoredView& stored,
                       Job& job) {
    const std::string name = file.string(), where = fmt::format("'{}'", name);
    STX_TRY(const auto bytes, readFile(file, job.limits));
    STX_TRY(const auto picture, decodeImage(bytes, name, job.limits));
    std::string note;
    const Image<std::uint8_t> mask = picture.bits() == 16 ? maskFrom(rgbaFloatFrom(picture), note)
                                                          : maskFrom(rgba8From(picture), note);
    // Once for all masks of a set, and in films where the notes of later frames are dropped.
    if (!note.empty()) job.noteOnce(note);
    if (mask.width() != stored.texture.width() || mask.height() != stored.texture.height())
        return failAt(where, ErrorCode::invalidInput,
                      "the mask is {}x{}, but its picture '{}' has {}x{} pixels; both must match",
                      mask.width(), mask.height(), set.texture.name, stored.texture.width(),
                      stored.texture.height());
    for (std::size_t i = 0; i < mask.count(); ++i) {
        const int share = mask.data()[i];
        if (auto* coded = stored.texture.rgba8()) {
            auto& alpha = coded->data()[i].a;
            const int own = stored.alpha ? alpha : 255;
            alpha = static_cast<std::uint8_t>((own * share + 127) / 255);
        } else {
            auto& alpha = stored.texture.rgbaFloat()->data()[i].a;
            alpha = (stored.alpha ? alpha : 1.0f) * static_cast<float>(share) / 255.0f;
        }
    }
    stored.alpha = true;
    return {};
}

Result<StoredView> readStored(const SetView& set, const ImageSetOptions& options, Job& job) {
    if (set.load) return set.load(set, job);
    StoredView stored;
    STX_TRY(auto colour, readColour(set.texture, options.yuv, options.deepColour, job));
    stored.texture = std::move(colour.texture);
    stored.alpha = colour.alpha;
    STX_TRY(auto depth, readDepth(set.depth, job));
    stored.depth = std::move(depth.values);
    stored.largest = depth.largest;
    return stored;
}

Result<StoredView> readImages(const SetView& set, const ImageSetOptions& options, Job& job) {
    STX_TRY(auto stored, readStored(set, options, job));
    if (!set.mask.path.empty()) STX_CHECK(applyMask(set, set.mask.path, stored, job));
    return stored;
}

/// Sets nearPlane, farPlane and depthBits.
void setPlanes(ReferenceView& view, const SetView& set, const ImageSetOptions& options, Job& job) {
    if (set.planes && set.depthBits != 0 &&
        (options.depthBits == 0 || set.depthBits == options.depthBits)) {
        const bool holdsAll =
            std::all_of(view.depth.pixels().begin(), view.depth.pixels().end(), [&](float d) {
                return !hasPoint(d) || (d >= static_cast<float>(set.planes->nearPlane) &&
                                        d <= static_cast<float>(set.planes->farPlane));
            });
        if (holdsAll) {
            view.nearPlane = set.planes->nearPlane;
            view.farPlane = set.planes->farPlane;
            view.depthBits = set.depthBits;
            if (set.depthBits == 32) return;
            roundToCode(view.depth.pixels(), view.depthCode());
            return;
        }
    }
    view.depthBits = 32;  // nothing is rounded before the planes tell how coarse codes would be
    fitDepthRange(view);
    view.depthBits = options.depthBits == 0 ? 16 : options.depthBits;
    if (options.depthBits == 0 && view.depthStepInPixels() > ViewHeader::kFineStep)
        view.depthBits = 32;
    if (view.depthBits < 32 && options.roundFrames)
        roundToCode(view.depth.pixels(), view.depthCode());
    if (view.depthBits == 8 && options.roundFrames)
        job.note(fmt::format(
            "view '{}': depth in 8 bits is exact to {:.3g} scene units (16 bits: "
            "{:.2g})",
            view.name, view.depthCode().step() / 2, (view.farPlane - view.nearPlane) / 65534 / 2));
}

Result<ReferenceView> finish(const SetView& set, std::string name, const Camera& camera,
                             Texture texture, Image<float> depth, bool ownAlpha, NoDepth noDepth,
                             const ImageSetOptions& options, Job& job) {
    ReferenceView view;
    view.noDepth = noDepth;
    // Without alpha of its own, a picture does not say where points were pruned.
    view.pruned = set.pruned && ownAlpha;
    coverOnlyPoints(texture, depth, ownAlpha, view.depthMayBeUnknown());
    view.background = set.background;
    view.refined = set.refined;
    view.name = std::move(name);
    view.camera = camera;
    view.texture = std::move(texture);
    view.depth = std::move(depth);
    if (!anyPoint(view.depth)) {
        // No point says where planes are. The bits are those of the film's other pictures.
        if (set.planes) {
            view.nearPlane = set.planes->nearPlane;
            view.farPlane = set.planes->farPlane;
            if (set.depthBits != 0) view.depthBits = set.depthBits;
        }
        if (options.depthBits != 0) view.depthBits = options.depthBits;
        return view;
    }
    bleedColour(view.texture);
    setPlanes(view, set, options, job);
    return view;
}

/// What a step of refining did to a view, with its time, until the end.
class StepOfView {
  public:
    StepOfView(RefineReport& report, RefineStep step) : report_(report.of(step)) {}
    ~StepOfView() { report_.milliseconds += threadMilliseconds() - start_; }
    StepOfView(const StepOfView&) = delete;
    StepOfView& operator=(const StepOfView&) = delete;
    void changed(std::int64_t pixels) {
        report_.views += pixels > 0;
        report_.pixels += pixels;
    }
    void moved(std::int64_t pixels, double sumOfShares) {
        changed(pixels);
        report_.moved = pixels;
        report_.meanMove = pixels > 0 ? sumOfShares / static_cast<double>(pixels) : 0;
    }

  private:
    RefineStepReport& report_;
    double start_ = threadMilliseconds();
};

/// Moves all depth by what other pictures of the set show, and the camera's rows to theirs.
/// `values`: as stored, without stairs.
Result<void> shiftTogether(const SetView& set, const ImageSetOptions& options, Camera& camera,
                           const Image<float>& values, StoredView& stored, RefineReport& report,
                           Job& job) {
    if (!set.shift || !options.refine.atImport(RefineStep::shift, true)) return {};
    StepOfView step(report, RefineStep::shift);
    const SetShift shift = set.shift(values, stored.texture, job);
    if (shift.down != 0) {
        camera.cy -= shift.down;
        if (shift.values == 0.0f) step.changed(static_cast<std::int64_t>(stored.depth.count()));
        job.note(
            fmt::format("view '{}': its camera looks {:.2f} pixels {}, as other pictures of "
                        "the set show",
                        set.name, std::abs(shift.down), shift.down > 0 ? "lower" : "higher"));
    }
    if (shift.values == 0.0f) return {};
    Image<float> moved = values;
    for (float& v : moved.pixels())
        if (hasPoint(v)) v += shift.values;
    Job notesAgain;
    STX_CHECK(set.distances(moved, camera, stored.largest, notesAgain));
    dropImpossible(moved);
    std::int64_t pixels = 0;
    double shares = 0;
    for (std::size_t i = 0; i < moved.count(); ++i) {
        float& was = stored.depth.data()[i];
        const float now = moved.data()[i];
        if (!hasPoint(was) || !hasPoint(now)) continue;
        ++pixels;
        shares += std::abs(static_cast<double>(now) / was - 1);
        was = now;
    }
    step.moved(pixels, shares);
    job.note(fmt::format(
        "view '{}': {:.2f} are added to its stored depth, which other pictures of the set show",
        set.name, shift.values));
    return {};
}

/// Stairs of depth codes are smoothed where one step, as a share of the distance, is larger. Of 15
/// pictures from six views of a room or of what is in it, with 10 bits and steps of 0.5 to 2 % or
/// 12 bits and 0.4 %, the mean is 1.8 dB better and one 11 dB; with steps of 0.2 % three are 0.1 dB
/// worse. Codes of 8 bits always are: 1.2 dB better.
constexpr float kCoarseStep = 0.003f;
/// Codes of more bits are finer.
constexpr int kMostCoarseBits = 12;

/// The share of the distance that a step of the codes is: the median of neighbours that are one
/// step apart, 0 where few are.
float stepShare(const Image<float>& codes, const Image<float>& distances) {
    constexpr std::size_t kFewestSteps = 30;
    std::vector<float> shares;
    for (std::size_t i = 1; i < codes.count(); ++i) {
        const float was = distances.data()[i - 1], is = distances.data()[i];
        if (std::abs(codes.data()[i] - codes.data()[i - 1]) == 1 && hasPoint(was) && hasPoint(is))
            shares.push_back(std::abs(is - was) / std::min(is, was));
    }
    return shares.size() < kFewestSteps ? 0.0f : medianOf(std::move(shares));
}

/// Makes distances of the stored values, and smooths the stairs of coarse ones. `noDepth`: what
/// pixels without one are; those of nothing are made transparent. The camera's rows may move, too
/// (shiftTogether()).
Result<void> toDistances(const SetView& set, const ImageSetOptions& options, Camera& camera,
                         StoredView& stored, NoDepth& noDepth, RefineReport& report, Job& job) {
    const int largest = stored.largest, bits = std::bit_width(static_cast<unsigned>(largest));
    // What we exported ourselves comes back as it was.
    const bool mayBeCoarse = largest > 0 && bits <= kMostCoarseBits && !set.planes;
    const bool maySmooth =
        set.distances && largest > 0 && options.refine.atImport(RefineStep::steps, mayBeCoarse);
    Image<float> codes = maySmooth ? stored.depth : Image<float>();
    if (set.distances) STX_CHECK(set.distances(stored.depth, camera, largest, job));
    noDepth = noDepthOf(set, options, stored);
    dropImpossible(stored.depth);
    if (!maySmooth ||
        !options.refine.atImport(
            RefineStep::steps,
            mayBeCoarse && (bits <= 8 || stepShare(codes, stored.depth) > kCoarseStep)))
        return {};

    std::optional<StepOfView> step(std::in_place, report, RefineStep::steps);
    for (std::size_t i = 0; i < codes.count(); ++i)
        if (!hasPoint(stored.depth.data()[i])) codes.data()[i] = kNoDepth;
    smoothDepthSteps(codes);
    const Image<float> smoothed = set.shift ? codes : Image<float>();
    Job notesAgain;
    STX_CHECK(set.distances(codes, camera, largest, notesAgain));
    dropImpossible(codes);
    double most = 0, shares = 0;
    std::int64_t pixels = 0;
    for (std::size_t i = 0; i < codes.count(); ++i) {
        float& was = stored.depth.data()[i];
        const float now = codes.data()[i];
        if (!hasPoint(was) || !hasPoint(now) || now == was) continue;
        const double move = std::abs(static_cast<double>(now) - was);
        most = std::max(most, move);
        shares += move / was;
        ++pixels;
        was = now;
    }
    step->moved(pixels, shares);
    step.reset();
    job.note(
        fmt::format("view '{}': the stairs of its {}-bit depth are smoothed within half a step, "
                    "{:.3g} scene units at most",
                    set.name, bits, most));
    return shiftTogether(set, options, camera, smoothed, stored, report, job);
}

/// Errors where no pixel has a depth, and `showsNothing` becomes true then.
Result<void> needDepth(const Image<float>& depth, bool& showsNothing,
                       const std::string& otherwise) {
    if (anyPoint(depth)) return {};
    showsNothing = true;
    return fail(ErrorCode::invalidInput, "{}", otherwise);
}

/// The same of depth as it was stored.
Result<void> needDepth(const Image<float>& depth, bool& showsNothing) {
    return needDepth(depth, showsNothing,
                     fmt::format("not one of its {}x{} pixels has a valid depth; at least one is "
                                 "needed",
                                 depth.width(), depth.height()));
}

/// Makes distances of the values of a depth camera, seen by the camera of the picture: on its
/// pixels, or on fewer and larger ones where the depth has fewer.
Result<void> takeToPicture(const SetView& set, const ImageSetOptions& options, StoredView& stored,
                           NoDepth& noDepth, RefineReport& report, bool& showsNothing, Job& job) {
    const int tw = stored.texture.width(), th = stored.texture.height();
    STX_TRY(Camera to, cameraOfSize(set, tw, th));
    Camera from = *set.depthCamera;
    from.width = stored.depth.width();
    from.height = stored.depth.height();
    STX_CHECK(toDistances(set, options, from, stored, noDepth, report, job));
    STX_CHECK(needDepth(stored.depth, showsNothing));
    if (from.width < tw)
        to = to.resized(from.width,
                        std::max(1, static_cast<int>(std::lround(1.0 * th * from.width / tw))));
    StepOfView step(report, RefineStep::reproject);
    RealFromIdeal lens;
    if (!set.lens.ideal())
        lens = [&](glm::dvec2 pixel) { return set.lens.realFromIdeal(to, pixel); };
    STX_TRY(stored.depth, depthSeenBy(to, lens, stored.depth, from, job));
    step.changed(static_cast<std::int64_t>(stored.depth.count()));
    return needDepth(stored.depth, showsNothing,
                     "nothing of it is in the picture of the colour camera; see --depth-intrinsics "
                     "and --depth-to-colour");
}

/// The steps of refining on the pixels of the picture, as the set needs them.
Result<void> repair(const SetView& set, const ImageSetOptions& options, StoredView& stored,
                    RefineReport& report, bool& showsNothing, Job& job) {
    const auto does = [&](RefineStep step, bool known) {
        return options.refine.atImport(step, known);
    };
    const auto share = [&](std::int64_t pixels) {
        return 100.0 * static_cast<double>(pixels) / static_cast<double>(stored.depth.count());
    };
    if (does(RefineStep::mixed, set.sensor)) {
        StepOfView step(report, RefineStep::mixed);
        const std::int64_t dropped = dropMixedPixels(stored.depth);
        step.changed(dropped);
        if (dropped > 0)
            job.note(fmt::format("view '{}': {} mixed pixels at depth edges are dropped ({:.2g} %)",
                                 set.name, dropped, share(dropped)));
        STX_CHECK(within(
            fmt::format("'{}'", set.depth.name),
            needDepth(stored.depth, showsNothing,
                      "all of its pixels look like noise at depth edges; keep them, if they are "
                      "not")));
    }
    const Texture& picture = stored.texture;
    if (stored.depth.width() != picture.width()) {
        StepOfView step(report, RefineStep::raise);
        stored.depth = raiseDepth(stored.depth, picture, &stored.matte);
        step.changed(static_cast<std::int64_t>(stored.depth.count()));
    }
    if (does(RefineStep::gaps, set.measured)) {
        StepOfView step(report, RefineStep::gaps);
        const std::int64_t closed = closeDepthGaps(stored.depth, picture);
        step.changed(closed);
        if (closed > 0)
            job.note(
                fmt::format("view '{}': {} pixels without depth ({:.2g} %) get that of the surface "
                            "whose colours lead there",
                            set.name, closed, share(closed)));
    }
    if (does(RefineStep::align, set.measured)) {
        StepOfView step(report, RefineStep::align);
        const std::int64_t moved = alignDepthEdges(stored.depth, picture);
        step.changed(moved);
        if (moved > 0)
            job.note(
                fmt::format("view '{}': {} pixels ({:.2g} %) are taken to the surface in front, "
                            "whose colour they have",
                            set.name, moved, share(moved)));
    }
    return {};
}

}  // namespace

Distances scaledIntegers(double unit, float alsoNone) {
    return [unit, alsoNone](Image<float>& values, const Camera&, int, Job&) -> Result<void> {
        for (float& v : values.pixels()) {
            // No branch: compilers make vectors of it.
            const auto dist = static_cast<float>(v * unit);
            const bool none = static_cast<int>(v == 0) | static_cast<int>(v == alsoNone);
            v = none ? 0.0f : dist;
        }
        return {};
    };
}

Distances normalisedDisparity(double nearest, double farthest, bool zeroIsNone) {
    return [=](Image<float>& values, const Camera&, int most, Job& job) -> Result<void> {
        if (most == 0) return {};
        const double largest = most;
        const bool endless = std::isinf(farthest);
        bool atInfinity = false;
        for (float& v : values.pixels()) {
            if (v == 0 && zeroIsNone) continue;
            double s = v / largest;
            if (endless && s == 0) {
                // The nearest distance that has this code.
                s = 0.5 / largest;
                atInfinity = true;
            }
            v = static_cast<float>(
                endless ? nearest / s : nearest * farthest / (nearest + s * (farthest - nearest)));
        }
        if (atInfinity)
            job.note(fmt::format("points at infinity are put to {:g} scene units",
                                 2 * largest * nearest));
        return {};
    };
}

namespace {

/// Where depth has another size than its picture, the picture becomes as small as the depth, unless
/// the depth is to be raised to the picture's size.
Result<void> matchSizes(const SetView& set, bool raise, StoredView& stored, Camera& camera,
                        Job& job) {
    const int tw = stored.texture.width(), th = stored.texture.height();
    const int dw = stored.depth.width(), dh = stored.depth.height();
    if (tw == dw && th == dh) return {};
    if (!set.stretched && !sameShape({tw, th}, {dw, dh}))
        return fail(ErrorCode::invalidInput,
                    "'{}' is {}x{} but its depth '{}' is {}x{}; both must match, or have the "
                    "same shape",
                    set.texture.name, tw, th, set.depth.name, dw, dh);
    if (raise) {
        job.note(fmt::format(
            "depth of {}x{} is raised to the size of its picture, {}x{}, along the picture's "
            "edges{}",
            dw, dh, tw, th, stored.matte.count() > 0 ? " and its portrait matte" : ""));
        return {};
    }
    job.note(fmt::format("images of {}x{} are resampled to the size of their depth, {}x{}", tw, th,
                         dw, dh));
    stored.texture = resizeTexture(stored.texture, dw, dh);
    camera = camera.resized(dw, dh);
    return {};
}

/// Resamples picture and depth as a pinhole sees them. The camera becomes that of what the picture
/// shows all of: what a pinhole sees around it is not known, and nothing may say that it is empty.
Result<void> undoLens(const SetView& set, Camera& camera, StoredView& stored, Job& job) {
    if (!set.lens.invertible(camera))
        return failAt(fmt::format("camera '{}'", set.name), ErrorCode::invalidInput,
                      "the lens distortion folds the picture; k1 = {:g}, k2 = {:g}, k3 = {:g}, "
                      "p1 = {:g}, p2 = {:g} cannot be undone",
                      set.lens.k1, set.lens.k2, set.lens.k3, set.lens.p1, set.lens.p2);
    const double shift = set.lens.largestShift(camera);
    const char* what = !set.lens.distorts() ? "skew"
                       : set.lens.skew != 0 ? "lens distortion and skew"
                                            : "lens distortion";
    const PixelRectangle part = set.lens.shownPart(camera);
    if (part.width <= 0)
        return failAt(
            fmt::format("camera '{}'", set.name), ErrorCode::invalidInput,
            "the lens distortion moves all {}x{} pixels out of the picture; the middle is "
            "expected to stay inside (see the principal point and the coefficients)",
            camera.width, camera.height);
    const double cut = set.lens.cutShare(camera, part);
    const bool whole = part.width == camera.width && part.height == camera.height;
    std::string away;
    if (!whole)
        away = fmt::format(
            "; its border is cut off with {:.2g} % of the picture, as a pinhole sees "
            "past the picture there: {}x{} of {}x{} pixels are left",
            100.0 * cut, part.width, part.height, camera.width, camera.height);
    else if (cut >= kCutWorthTelling)
        away = fmt::format(
            "; {:.0f} % of the picture lie outside a pinhole's of the same focal "
            "length and size and are cut away",
            100.0 * cut);
    job.note(fmt::format("view '{}': {} of up to {:.2f} pixels undone by resampling{}", set.name,
                         what, shift, away));
    auto [texture, depth] = undistort(stored.texture, stored.depth, camera, set.lens, part);
    stored.texture = std::move(texture);
    stored.depth = std::move(depth);
    camera.cx -= part.x;
    camera.cy -= part.y;
    camera.width = part.width;
    camera.height = part.height;
    return {};
}

/// Whether a picture of a film may be one in which nothing is to be seen: what it shows may have
/// left it. Depth that is missing everywhere though something is there is damage, as a sensor has
/// it that lost a frame. `stored`: with distances.
bool mayBeEmpty(const SetView& set, const ImageSetOptions& options, NoDepth noDepth,
                const StoredView& stored) {
    // A depth camera's pixels are not the picture's, and empty faces of panoramas are left out.
    if (!options.ofFilm || set.depthCamera || set.panorama) return false;
    return noDepth == NoDepth::empty || set.noDepth || openEverywhere(stored);
}

}  // namespace

Result<std::vector<ReferenceView>> loadSetView(const SetView& set, const ImageSetOptions& options,
                                               RefineReport& report, bool& showsNothing, Job& job) {
    STX_CHECK(job.checkCancelled());
    STX_TRY(StoredView stored, readImages(set, options, job));
    NoDepth noDepth = NoDepth::empty;
    if (set.depthCamera)
        STX_CHECK(within(fmt::format("'{}'", set.depth.name),
                         takeToPicture(set, options, stored, noDepth, report, showsNothing, job)));
    const int tw = stored.texture.width(), th = stored.texture.height();
    const int dw = stored.depth.width(), dh = stored.depth.height();
    STX_TRY(Camera camera, cameraOfSize(set, tw, th));
    const bool raise = options.refine.atImport(RefineStep::raise, true) && dw < tw && dh < th;
    STX_CHECK(matchSizes(set, raise, stored, camera, job));
    if (!set.depthCamera) {
        Camera ofDepth = raise ? camera.resized(dw, dh) : camera;
        STX_CHECK(within(fmt::format("'{}'", set.depth.name),
                         toDistances(set, options, ofDepth, stored, noDepth, report, job)));
        if (!raise) camera = ofDepth;
    }
    const bool mayShowNothing = mayBeEmpty(set, options, noDepth, stored);
    if (mayShowNothing && !anyPoint(stored.depth)) {
        stored.depth = Image<float>(stored.texture.width(), stored.texture.height(), kNoDepth);
    } else {
        STX_CHECK(
            within(fmt::format("'{}'", set.depth.name), needDepth(stored.depth, showsNothing)));
        STX_CHECK(repair(set, options, stored, report, showsNothing, job));
    }

    std::vector<ReferenceView> views;
    if (set.panorama) {
        static constexpr const char* kFaces[6] = {"front", "left", "back", "right", "up", "down"};
        const auto faces =
            cubeFaces(camera, *set.panorama, stored.depth.width(), stored.depth.height());
        for (std::size_t i = 0; i < faces.size(); ++i) {
            auto [texture, depth] =
                faceOfPanorama(stored.texture, stored.depth, faces[i], camera, *set.panorama);
            STX_TRY(auto view,
                    finish(set, fmt::format("{}_{}", set.name, kFaces[i]), faces[i],
                           std::move(texture), std::move(depth), true, noDepth, options, job));
            if (anyPoint(view.depth)) views.push_back(std::move(view));
        }
        showsNothing = views.empty();
        if (showsNothing)
            return failAt(fmt::format("'{}'", set.depth.name), ErrorCode::invalidInput,
                          "no cube face of the panorama has a valid depth");
        return views;
    }
    if (!set.lens.ideal()) STX_CHECK(undoLens(set, camera, stored, job));
    STX_TRY(auto view, finish(set, set.name, camera, std::move(stored.texture),
                              std::move(stored.depth), stored.alpha, noDepth, options, job));
    if (!mayShowNothing)
        STX_CHECK(within(
            fmt::format("'{}'", set.depth.name),
            needDepth(view.depth, showsNothing,
                      "every pixel with a valid depth is transparent or outside the picture")));
    views.push_back(std::move(view));
    return views;
}

}  // namespace stx::imagesets

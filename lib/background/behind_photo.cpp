#include "lib/background/behind_photo.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "lib/background/behind_draw.hpp"
#include "lib/background/behind_layer.hpp"
#include "lib/background/behind_patches.hpp"
#include "lib/capture/capture.hpp"
#include "lib/model/median_distance.hpp"

namespace stx {
namespace {

using namespace behind;

/// The longer side of the photograph in blocks at most: what is invented has no more detail of its
/// own than this; fine detail is copied at full size. Time and memory grow with its square.
constexpr int kMostBlocks = 1300;
/// Memory of a block while sources are looked for: that of Layer, and of the finest level twice.
constexpr std::uint64_t kBytesPerBlock = 240;
/// Pixels of the border beyond what the eye can see, for the half pixels of drawing.
constexpr double kBorderMargin = 4;
/// Share of the pixels at an edge of the frame whose parallax the border is wide enough for; single
/// wrong ones must not widen it.
constexpr double kBorderShare = 0.98;
/// The widest border, share of the picture's side.
constexpr double kMostBorder = 0.25;

/// How far from the median parallax what lies on one line of pixels is.
double farthestFrom(double median, const Image<float>& depth, double scale, glm::ivec2 from,
                    glm::ivec2 step, int count) {
    std::vector<double> off;
    for (int i = 0; i < count; ++i) {
        const float z = depth.at(from.x + i * step.x, from.y + i * step.y);
        if (hasPoint(z)) off.push_back(std::abs(scale / z - median));
    }
    if (off.empty()) return 0;
    const auto at = static_cast<std::size_t>(kBorderShare * static_cast<double>(off.size() - 1));
    std::nth_element(off.begin(), off.begin() + static_cast<std::ptrdiff_t>(at), off.end());
    return off[at];
}

/// Border that comes into the frame when the eye moves by the largest shift, a share of the median
/// distance, and looks at what is in the middle of the frame at that distance: what parallax moves
/// relatively to that, and what turning the camera adds towards the edges. With t the tangent from
/// the axis to an edge, the farther one, that has (t + s) / (1 - t s) when it is turned away by the
/// shift s.
glm::ivec2 borderOf(const ReferenceView& view, double scale, double median, double shift,
                    int step) {
    const int w = view.depth.width(), h = view.depth.height();
    const Camera& camera = view.camera;
    const auto side = [&](double off, int size, double f, double c) {
        const double t = std::max(c, size - c) / f;
        const double turned =
            t * shift < 1 ? (1 + t * t) / (1 - t * shift) - 1 : kMostBorder * size;
        const double wanted = off + median * turned + kBorderMargin;
        const double most = kMostBorder * size;
        return static_cast<int>(std::ceil(std::min(wanted, most) / step)) * step;
    };
    const double across = std::max(farthestFrom(median, view.depth, scale, {0, 0}, {0, 1}, h),
                                   farthestFrom(median, view.depth, scale, {w - 1, 0}, {0, 1}, h));
    const double down = std::max(farthestFrom(median, view.depth, scale, {0, 0}, {1, 0}, w),
                                 farthestFrom(median, view.depth, scale, {0, h - 1}, {1, 0}, w));
    return {side(across, w, camera.fx, camera.cx), side(down, h, camera.fy, camera.cy)};
}

/// The larger picture: pixels at the left and above, and its size. The principal point comes into
/// its middle, to half a pixel, where that takes no more than kMostBorder: containers that know no
/// other would have to make it larger themselves.
struct Frame {
    glm::ivec2 border, size;
};
Frame frameOf(const ReferenceView& view, glm::ivec2 border, int step) {
    const glm::dvec2 principal(view.camera.cx, view.camera.cy);
    Frame frame{border, view.depth.size()};
    for (int k = 0; k < 2; ++k) {
        int more = static_cast<int>(std::lround(2 * principal[k])) - frame.size[k];
        if (std::abs(more) > kMostBorder * frame.size[k]) more = 0;
        int after = border[k] + more;
        if (more < 0) {
            frame.border[k] += (-more + step - 1) / step * step;
            after = frame.border[k] + more;
        }
        frame.size[k] += frame.border[k] + after;
    }
    return frame;
}

Result<void> checkPhoto(const ReferenceView& view, const BehindSettings& settings) {
    STX_CHECK(view.check());
    if (!(settings.shiftPercent > 0 && settings.shiftPercent <= kMostBehindPercent))
        return fail(ErrorCode::usage,
                    "the shift is {:g} percent of the median distance; it must be above 0 and at "
                    "most {:g}",
                    settings.shiftPercent, kMostBehindPercent);
    if (view.camera.orthographic)
        return fail(ErrorCode::invalidInput,
                    "view '{}' is orthographic; what a photograph hides is invented for "
                    "perspective views",
                    view.name);
    return {};
}

}  // namespace

Result<BehindPhoto> behindPhoto(const ReferenceView& view, const BehindSettings& settings,
                                Job& job) {
    STX_CHECK(checkPhoto(view, settings));
    const double distance = medianDistance(view);
    if (!(distance > 0))
        return fail(ErrorCode::invalidInput, "view '{}' shows nothing that has a depth", view.name);
    const double median =
        std::max(view.camera.fx, view.camera.fy) * settings.shiftPercent / 100;  // parallax
    const double scale = median * distance;
    const int step =
        (std::max(view.depth.width(), view.depth.height()) + kMostBlocks - 1) / kMostBlocks;
    const Frame frame =
        frameOf(view, borderOf(view, scale, median, settings.shiftPercent / 100, step), step);
    const std::uint64_t larger =
        static_cast<std::uint64_t>(frame.size.x) * static_cast<std::uint64_t>(frame.size.y);
    const auto blocks = static_cast<std::uint64_t>(step) * static_cast<std::uint64_t>(step);
    STX_CHECK(job.limits.checkAllocation(
        larger, kBytesPerBlock / blocks + (view.texture.isLinear() ? 20 : 8),
        "what a photograph hides"));

    Layer layer = blocksOf(view, scale, step, frame.border, frame.size);
    STX_CHECK(job.checkCancelled());
    inventDepth(layer);
    // Colours go by the depth that things have, drawn is what has no steps.
    Image<float> closed = closeSteps(layer);
    STX_CHECK(job.checkCancelled());
    inventColour(layer);
    STX_CHECK(job.checkCancelled());
    STX_TRY(Sources sources, findSources(layer, job));
    STX_CHECK(job.checkCancelled());

    layer.parallax = std::move(closed);
    growUnder(layer, sources);
    layer.far = {};
    layer.shown = {};
    BehindPhoto out;
    out.border = frame.border;
    static_cast<ViewHeader&>(out.view) = view;
    out.view.colourFile = {};
    out.view.background = true;
    out.view.noDepth = NoDepth::empty;
    out.view.pruned = false;
    Camera& camera = out.view.camera;
    camera.width = frame.size.x;
    camera.height = frame.size.y;
    camera.cx += out.border.x;
    camera.cy += out.border.y;
    out.hidden = drawBehind(layer, sources, view, scale, out.view);
    fitDepthRange(out.view);
    return out;
}

std::string AddedBehind::note(const BehindSettings& settings) const {
    // Two digits, and whole percents from 10 on.
    const double percent = 100 * hidden;
    const std::string share =
        percent < 10 ? fmt::format("{:.2g}", percent) : fmt::format("{:.0f}", percent);
    return fmt::format(
        "what the photograph hides from an eye that goes up to {:g} % of the median distance to "
        "the side was invented: {} % of its pixels, and a border of {}x{}",
        settings.shiftPercent, share, border.x, border.y);
}

Result<AddedBehind> addBehind(Bundle& bundle, const BehindSettings& settings, Job& job) {
    const auto isBackground = [](const ReferenceView& view) { return view.background; };
    const auto photos = bundle.views.size() -
                        static_cast<std::size_t>(std::ranges::count_if(bundle.views, isBackground));
    if (photos != 1)
        return fail(ErrorCode::invalidInput,
                    "it has {} views of one moment; what is behind is invented for one photograph "
                    "(a film shows it, and other views do)",
                    photos);
    if (std::erase_if(bundle.views, isBackground) > 0 && bundle.bounds)
        bundle.bounds = bundle.computeBounds();
    const ReferenceView& photo = bundle.views.front();
    STX_TRY(BehindPhoto behind, behindPhoto(photo, settings, job));
    AddedBehind added;
    added.name = behind.view.name = photo.name + "_behind";
    added.border = behind.border;
    added.hidden = static_cast<double>(behind.hidden) / static_cast<double>(photo.depth.count());
    added.seen = static_cast<double>(behind.view.pointCount()) /
                 static_cast<double>(behind.view.depth.count());
    if (const Bounds more = behind.view.computeBounds(); bundle.bounds && !more.empty()) {
        bundle.bounds->add(more.min);
        bundle.bounds->add(more.max);
    }
    bundle.views.push_back(std::move(behind.view));
    return added;
}

}  // namespace stx

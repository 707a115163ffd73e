#include "lib/background/behind_photo.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "lib/background/behind_layer.hpp"
#include "lib/base/parallel.hpp"
#include "lib/capture/capture.hpp"
#include "lib/model/median_distance.hpp"

namespace stx {
namespace {

using namespace behind;

/// The longer side of the photograph in blocks at most: what is invented has no more detail of its
/// own than this; fine detail is copied at full size. Time and memory grow with its square.
constexpr int kMostBlocks = 1300;
/// Pixels of the border beyond what the eye can see, for the half pixels of drawing.
constexpr double kBorderMargin = 4;
/// Share of the pixels at an edge of the frame whose parallax the border is wide enough for; single
/// wrong ones must not widen it.
constexpr double kBorderShare = 0.98;
/// The widest border, share of the picture's side.
constexpr double kMostBorder = 0.25;
/// Pixels by which what is behind goes on under what is beside it, so that no crack is between.
constexpr int kOverlap = 2;

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

/// Border that comes into the frame when the eye moves by the largest shift and looks at what is in
/// the middle of the frame at the median distance: what parallax moves relatively to that, and what
/// turning the camera adds towards the edges.
glm::ivec2 borderOf(const ReferenceView& view, double scale, double median, int step) {
    const int w = view.depth.width(), h = view.depth.height();
    const Camera& camera = view.camera;
    const auto side = [&](double off, int size, double f) {
        const double slope = 0.5 * size / f;
        const double wanted = off + median * slope * slope + kBorderMargin;
        const double most = kMostBorder * size;
        return static_cast<int>(std::ceil(std::min(wanted, most) / step)) * step;
    };
    const double across = std::max(farthestFrom(median, view.depth, scale, {0, 0}, {0, 1}, h),
                                   farthestFrom(median, view.depth, scale, {w - 1, 0}, {0, 1}, h));
    const double down = std::max(farthestFrom(median, view.depth, scale, {0, 0}, {1, 0}, w),
                                 farthestFrom(median, view.depth, scale, {0, h - 1}, {1, 0}, w));
    return {side(across, w, camera.fx), side(down, h, camera.fy)};
}

/// The blocks of which pixels are drawn: hidden ones and those around, and kOverlap pixels beside.
Image<std::uint8_t> drawnBlocks(const Layer& layer) {
    Image<std::uint8_t> drawn(layer.width(), layer.height(), 0);
    const int reach = (kOverlap + layer.step - 1) / layer.step;
    for (int y = 0; y < layer.height(); ++y) {
        for (int x = 0; x < layer.width(); ++x) {
            const Part part = layer.part.at(x, y);
            if (part == Part::around) drawn.at(x, y) = 1;
            if (part != Part::hidden) continue;
            for (int v = std::max(0, y - reach); v <= std::min(layer.height() - 1, y + reach); ++v)
                for (int u = std::max(0, x - reach); u <= std::min(layer.width() - 1, x + reach);
                     ++u)
                    if (layer.made(static_cast<std::size_t>(v) * layer.width() + u))
                        drawn.at(u, v) = 1;
        }
    }
    return drawn;
}

/// What is behind at a pixel, between the middles of blocks of one surface.
struct Sample {
    float parallax = kNoParallax;
    glm::vec3 colour{0};
};
Sample sampleAt(const Layer& layer, glm::ivec2 block, int x, int y) {
    const int step = layer.step;
    const std::size_t own = static_cast<std::size_t>(block.y) * layer.width() + block.x;
    const float parallax = layer.parallax.data()[own], tolerance = surfaceTolerance(layer, own);
    if (step == 1) return {parallax, layer.colour.data()[own]};
    const float bx = (static_cast<float>(x) + 0.5f) / static_cast<float>(step) - 0.5f;
    const float by = (static_cast<float>(y) + 0.5f) / static_cast<float>(step) - 0.5f;
    const int x0 = static_cast<int>(std::floor(bx)), y0 = static_cast<int>(std::floor(by));
    const bool around = layer.part.data()[own] == Part::around;
    float weights = 0, sum = 0;
    glm::vec3 colours(0);
    for (int k = 0; k < 4; ++k) {
        const int u = x0 + k % 2, v = y0 + k / 2;
        if (!layer.part.contains(u, v)) continue;
        const Part part = layer.part.at(u, v);
        if (part == Part::shown || (part == Part::around) != around) continue;
        const float there = layer.parallax.at(u, v);
        if (std::abs(there - parallax) > tolerance) continue;
        const float weight =
            (1 - std::abs(bx - static_cast<float>(u))) * (1 - std::abs(by - static_cast<float>(v)));
        weights += weight;
        sum += weight * there;
        colours += weight * layer.colour.at(u, v);
    }
    if (!(weights > 0)) return {parallax, layer.colour.data()[own]};
    return {sum / weights, colours / weights};
}

/// The block that a pixel is drawn from; nothing where it is not drawn. Blocks around go on under
/// the edge of the photograph, and over the rest of a block that the edge cuts.
std::optional<glm::ivec2> blockToDraw(const Layer& layer, const Image<std::uint8_t>& drawn,
                                      glm::ivec2 size, int x, int y) {
    const glm::ivec2 block(x / layer.step, y / layer.step);
    if (drawn.at(block.x, block.y)) return block;
    const glm::ivec2 at = glm::ivec2(x, y) - layer.border * layer.step;
    glm::ivec2 outer = block;
    for (int k = 0; k < 2; ++k) {
        if (at[k] < kOverlap) outer[k] = std::min(outer[k], layer.border[k] - 1);
        if (at[k] >= size[k] - kOverlap)
            outer[k] = std::max(outer[k], layer.border[k] + layer.photo[k]);
    }
    if (outer == block || !drawn.at(outer.x, outer.y)) return std::nullopt;
    return outer;
}

/// Writes a colour of the texture's own space.
void put(Texture& texture, int x, int y, glm::vec3 colour) {
    if (auto* bytes = texture.rgba8()) {
        const glm::vec3 coded = glm::clamp(colour, 0.0f, 1.0f) * 255.0f + 0.5f;
        bytes->at(x, y) = glm::u8vec4(glm::u8vec3(coded), 255);
    } else {
        texture.rgbaFloat()->at(x, y) = glm::vec4(glm::max(colour, 0.0f), 1.0f);
    }
}

/// The view of full size, with what was invented in blocks.
void drawFull(const Layer& layer, const ReferenceView& photo, double scale, BehindPhoto& out) {
    const Image<std::uint8_t> drawn = drawnBlocks(layer);
    const int w = out.view.depth.width();
    std::vector<std::int64_t> hidden(static_cast<std::size_t>(out.view.depth.height()), 0);
    parallelFor(0, out.view.depth.height(), [&](std::int64_t row) {
        const int y = static_cast<int>(row);
        for (int x = 0; x < w; ++x) {
            const auto block = blockToDraw(layer, drawn, photo.depth.size(), x, y);
            if (!block) continue;
            const Sample sample = sampleAt(layer, *block, x, y);
            if (!(sample.parallax > 0)) continue;
            float depth = static_cast<float>(scale / sample.parallax);
            const int u = x - out.border.x, v = y - out.border.y;
            if (photo.depth.contains(u, v)) {
                // Never before what is there.
                if (hasPoint(photo.depth.at(u, v))) depth = std::max(depth, photo.depth.at(u, v));
                ++hidden[static_cast<std::size_t>(y)];
            }
            out.view.depth.at(x, y) = depth;
            put(out.view.texture, x, y, sample.colour);
        }
    });
    for (const std::int64_t count : hidden) out.hidden += count;
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
    const int w = view.depth.width(), h = view.depth.height();
    const int step = (std::max(w, h) + kMostBlocks - 1) / kMostBlocks;
    BehindPhoto out;
    out.border = borderOf(view, scale, median, step);

    Layer layer = blocksOf(view, scale, step, out.border);
    STX_CHECK(job.checkCancelled());
    inventDepth(layer);
    STX_CHECK(job.checkCancelled());
    inventColour(layer);
    STX_CHECK(job.checkCancelled());

    static_cast<ViewHeader&>(out.view) = view;
    out.view.colourFile = {};
    out.view.background = true;
    out.view.noDepth = NoDepth::empty;
    out.view.pruned = false;
    Camera& camera = out.view.camera;
    camera.width += 2 * out.border.x;
    camera.height += 2 * out.border.y;
    camera.cx += out.border.x;
    camera.cy += out.border.y;
    out.view.depth = Image<float>(camera.width, camera.height, kNoDepth);
    if (view.texture.isLinear())
        out.view.texture = RgbaFloatImage(camera.width, camera.height, glm::vec4(0));
    else
        out.view.texture = Rgba8Image(camera.width, camera.height, glm::u8vec4(0));
    drawFull(layer, view, scale, out);
    bleedColour(out.view.texture);
    fitDepthRange(out.view);
    return out;
}

std::string AddedBehind::note(const BehindSettings& settings) const {
    return fmt::format(
        "what the photograph hides from an eye that goes up to {:g} % of the median distance to "
        "the side was invented: {:.2g} % of its pixels, and a border of {}x{}",
        settings.shiftPercent, 100 * hidden, border.x, border.y);
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
    std::erase_if(bundle.views, isBackground);
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

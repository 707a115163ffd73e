#include "lib/background/temporal.hpp"

#include <algorithm>
#include <cmath>
#include <variant>

#include "lib/background/background_vote.hpp"
#include "lib/background/depth_layers.hpp"
#include "lib/background/frame_gauge.hpp"
#include "lib/background/mixed_pixels.hpp"
#include "lib/base/parallel.hpp"
#include "lib/capture/capture.hpp"
#include "lib/render/scene/page_set.hpp"

namespace stx {
namespace {

using temporal::Measurement;
using temporal::Worth;

/// Nothing moves where brightness, averaged over 3x3 pixels, changed by less than this many times
/// what it does in the middle of the picture's pixels, and these steps.
constexpr float kQuietTimes = 2, kQuietSteps = 1.5f;
/// Rows that are worked on together.
constexpr std::int64_t kRows = 8;
/// Alpha of a pixel that its surface covers in full.
constexpr float kFullAlpha = 0.999f;

float alphaOf(const ReferenceView& frame, std::size_t pixel) {
    return frame.texture.alpha(pixel);
}

}  // namespace

struct TemporalBackground::Impl {
    ReferenceView like;  ///< the first frame without its images
    bool linear = false;
    TemporalBackgroundSettings settings;
    int rows = 0;  ///< of a pass
    int pass = 0, passCount = 1;

    // Of one pass.
    temporal::Gauge gauge;
    std::variant<std::vector<temporal::PixelLayers<temporal::ByteSample>>,
                 std::vector<temporal::PixelLayers<temporal::HalfSample>>>
        pixels;
    Image<std::uint8_t> before;  ///< brightness in the frame before, of these rows and one around
    double firstTime = 0, lastTime = 0;
    int frames = 0;
    std::int64_t points = 0;  ///< of all frames

    int framesOfPass = 0;  ///< of the first pass, once it is over
    BackgroundModel model;
    temporal::InFront inFront;

    explicit Impl(const ReferenceView& first) : gauge(first.camera) {}

    [[nodiscard]] int width() const { return like.camera.width; }
    [[nodiscard]] int height() const { return like.camera.height; }
    [[nodiscard]] int firstRow() const { return pass * rows; }
    [[nodiscard]] int endRow() const { return std::min(firstRow() + rows, height()); }

    void beginPass();
    [[nodiscard]] Result<void> checkFrame(const ReferenceView& frame, double time) const;
    /// 1 where brightness changed since the frame before, of the rows of the pass.
    [[nodiscard]] Image<std::uint8_t> movingPixels(const ReferenceView& frame,
                                                   const temporal::FrameGauge& light);
    void insert(const ReferenceView& frame, const temporal::FrameGauge& light, float time);
};

void TemporalBackground::Impl::beginPass() {
    gauge = temporal::Gauge(like.camera);
    const auto count = static_cast<std::size_t>(endRow() - firstRow()) * width();
    if (linear)
        pixels = std::vector<temporal::PixelLayers<temporal::HalfSample>>(count);
    else
        pixels = std::vector<temporal::PixelLayers<temporal::ByteSample>>(count);
    before = {};
    frames = 0;
    points = 0;
}

Result<void> TemporalBackground::Impl::checkFrame(const ReferenceView& frame, double time) const {
    STX_CHECK(frame.checkHeader());
    if (frame.camera.width != width() || frame.camera.height != height())
        return fail(ErrorCode::invalidInput, "the frame has {}x{} pixels, those before have {}x{}",
                    frame.camera.width, frame.camera.height, width(), height());
    if (!sameCamera(frame.camera, like.camera))
        return fail(ErrorCode::invalidInput,
                    "the camera moved; a background that remembers needs a still camera");
    if (frame.texture.isLinear() != linear)
        return fail(ErrorCode::invalidInput, "the frame has {} colours, those before have {} ones",
                    linear ? "sRGB" : "linear", linear ? "linear" : "sRGB");
    if (!std::isfinite(time) || (frames > 0 && !(time > lastTime)))
        return fail(ErrorCode::invalidInput, "the frame is of {:g} s, the one before of {:g} s",
                    time, lastTime);
    return {};
}

Image<std::uint8_t> TemporalBackground::Impl::movingPixels(const ReferenceView& frame,
                                                           const temporal::FrameGauge& light) {
    const int w = width();
    const int from = std::max(firstRow() - 1, 0), to = std::min(endRow() + 1, height());
    const bool first = before.empty();
    if (first) before = Image<std::uint8_t>(w, to - from, std::uint8_t{0});
    // Changes of brightness, summed over three pixels of a row.
    Image<std::uint16_t> sums(w, to - from);
    const glm::vec3 weights = glm::vec3(0.3f, 0.59f, 0.11f) / light.gain;
    parallelForBlocks(from, to, kRows, [&](std::int64_t begin, std::int64_t end) {
        std::vector<std::uint8_t> changed(static_cast<std::size_t>(w) + 2, 0);
        for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
            std::uint8_t* was = before.row(y - from).data();
            for (int x = 0; x < w; ++x) {
                const float bright = glm::dot(
                    weights, temporal::stepsOf(frame.texture, static_cast<std::size_t>(y) * w + x));
                const auto now = static_cast<std::uint8_t>(std::clamp(bright + 0.5f, 0.0f, 255.0f));
                changed[static_cast<std::size_t>(x) + 1] =
                    first ? std::uint8_t{0} : static_cast<std::uint8_t>(std::abs(now - was[x]));
                was[x] = now;
            }
            std::uint16_t* sum = sums.row(y - from).data();
            for (std::size_t x = 0; x < static_cast<std::size_t>(w); ++x)
                sum[x] = static_cast<std::uint16_t>(changed[x] + changed[x + 1] + changed[x + 2]);
        }
    });
    const float quiet = kQuietTimes * light.noise + kQuietSteps;
    Image<std::uint8_t> moving(w, endRow() - firstRow());
    parallelFor(firstRow(), endRow(), kRows, [&](int y) {
        const int above = std::max(y - 1, from), below = std::min(y + 1, to - 1);
        const int rowsHere = below - above + 1;
        const std::uint16_t* a = sums.row(above - from).data();
        const std::uint16_t* b = sums.row(below - from).data();
        // Of three rows the middle one, of two none besides.
        const std::uint16_t* m = sums.row(y - from).data();
        std::uint8_t* out = moving.row(y - firstRow()).data();
        const auto isMoving = [&](int x, int count) {
            const int sum = rowsHere == 3 ? a[x] + m[x] + b[x] : rowsHere == 2 ? a[x] + b[x] : m[x];
            return static_cast<float>(sum) > quiet * static_cast<float>(count);
        };
        for (int x = 0; x < w; ++x) out[x] = isMoving(x, 3 * rowsHere);
        for (const int x : {0, w - 1}) out[x] = isMoving(x, std::min(w, 2) * rowsHere);
    });
    return moving;
}

void TemporalBackground::Impl::insert(const ReferenceView& frame, const temporal::FrameGauge& light,
                                      float time) {
    const int w = width(), top = firstRow();
    const auto step = static_cast<float>(frame.depthBits == 32 ? 0.0 : frame.depthCode().step());
    const Image<float> inverse = temporal::inverseOf(frame.depth);
    const Image<std::uint8_t> mixed =
        temporal::mixedPixels(inverse, gauge.noise(), step, top, endRow());
    const Image<std::uint8_t> moving = movingPixels(frame, light);
    const auto frameNumber = static_cast<std::uint32_t>(frames);
    const glm::vec3 unlit = 1.0f / light.gain;
    std::visit(
        [&](auto& all) {
            parallelFor(top, endRow(), kRows, [&](int y) {
                for (int x = 0; x < w; ++x) {
                    const std::size_t pixel = static_cast<std::size_t>(y) * w + x;
                    auto& layers = all[static_cast<std::size_t>(y - top) * w + x];
                    const float q = inverse.data()[pixel];
                    const float alpha = alphaOf(frame, pixel);
                    if (!(q > 0)) {
                        if (!(alpha > 0)) ++layers.empty;
                        continue;
                    }
                    Measurement m;
                    m.q = q;
                    m.tolerance = gauge.noise().tolerance(frame.depth.data()[pixel], step);
                    m.weak = mixed.at(x, y - top) != 0 || alpha < kFullAlpha;
                    const auto worth = static_cast<Worth>((m.weak ? 2 : 0) + moving.at(x, y - top));
                    const std::uint32_t random = temporal::randomOf(pixel, frameNumber);
                    m.key = temporal::keyOf(worth, random);
                    m.heads = random & 1;
                    m.time = time;
                    m.colour = temporal::stepsOf(frame.texture, pixel) * unlit;
                    layers.add(m);
                }
            });
        },
        pixels);
}

TemporalBackground::TemporalBackground(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
TemporalBackground::TemporalBackground(TemporalBackground&&) noexcept = default;
TemporalBackground& TemporalBackground::operator=(TemporalBackground&&) noexcept = default;
TemporalBackground::~TemporalBackground() = default;

Result<TemporalBackground> TemporalBackground::start(const ReferenceView& first,
                                                     const TemporalBackgroundSettings& settings,
                                                     Job& job) {
    STX_CHECK(first.checkHeader());
    auto impl = std::make_unique<Impl>(first);
    impl->like.name = first.name;
    impl->like.camera = first.camera;
    impl->like.nearPlane = first.nearPlane;
    impl->like.farPlane = first.farPlane;
    impl->like.depthBits = first.depthBits;
    impl->linear = first.texture.isLinear();
    impl->settings = settings;
    const int w = impl->width(), h = impl->height();
    // The model itself, and marks of one frame.
    const std::uint64_t fixed = static_cast<std::uint64_t>(w) * h * (impl->linear ? 48 : 36);
    const std::uint64_t row = w * (impl->linear ? kBytesPerLinearPixel : kBytesPerPixel);
    Limits limits = job.limits;
    if (settings.maxMemoryBytes)
        limits.maxMemoryBytes = std::min(limits.maxMemoryBytes, settings.maxMemoryBytes);
    STX_CHECK(limits.checkAllocation(1, fixed + row, "the background"));
    const std::uint64_t fitting = (limits.maxMemoryBytes - fixed) / row;
    impl->passCount = static_cast<int>((h + fitting - 1) / std::min<std::uint64_t>(fitting, h));
    if (fitting >= static_cast<std::uint64_t>(h)) impl->passCount = 1;
    impl->rows = (h + impl->passCount - 1) / impl->passCount;
    impl->passCount = (h + impl->rows - 1) / impl->rows;

    BackgroundModel& model = impl->model;
    model.view = impl->like;
    model.view.background = true;
    model.view.depth = Image<float>(w, h, kNoDepth);
    if (impl->linear)
        model.view.texture = RgbaFloatImage(w, h, glm::vec4(0));
    else
        model.view.texture = Rgba8Image(w, h, glm::u8vec4(0));
    impl->inFront = temporal::InFront(w, h, glm::vec2(0.0f));
    model.confidence = Image<float>(w, h, 0.0f);
    model.lastSeen = Image<float>(w, h, 0.0f);
    impl->beginPass();
    return TemporalBackground(std::move(impl));
}

int TemporalBackground::passes() const {
    return impl_->passCount;
}

Result<void> TemporalBackground::add(const ReferenceView& frame, double time, Job& job) {
    Impl& s = *impl_;
    STX_CHECK(job.checkCancelled());
    STX_CHECK(s.checkFrame(frame, time));
    if (s.frames == 0) s.firstTime = time;
    s.lastTime = time;
    s.points += frame.pointCount();
    const temporal::FrameGauge light = s.gauge.measure(frame);
    s.insert(frame, light, static_cast<float>(time - s.firstTime));
    ++s.frames;
    return {};
}

Result<void> TemporalBackground::endPass(Job& job) {
    Impl& s = *impl_;
    STX_CHECK(job.checkCancelled());
    if (s.frames == 0)
        return fail(ErrorCode::invalidInput,
                    "no frame was added; a background is made of at least two");
    if (s.pass > 0 && s.frames != s.framesOfPass)
        return fail(ErrorCode::invalidInput, "there are {} frames where there were {} before",
                    s.frames, s.framesOfPass);
    s.framesOfPass = s.frames;
    temporal::Vote vote;
    vote.frames = s.frames;
    vote.support = s.settings.support;
    const double places = static_cast<double>(s.width()) * s.height() * s.frames;
    vote.fillsFrame = temporal::fillsFrame(s.points, places);
    vote.gain = s.gauge.meanGain();
    vote.noise = s.gauge.meanNoise();
    vote.firstTime = s.firstTime;
    std::visit(
        [&](const auto& all) {
            parallelFor(s.firstRow(), s.endRow(), kRows, [&](int y) {
                for (int x = 0; x < s.width(); ++x)
                    vote.decide(all[static_cast<std::size_t>(y - s.firstRow()) * s.width() + x],
                                static_cast<std::size_t>(y) * s.width() + x, s.model, s.inFront);
            });
        },
        s.pixels);
    ++s.pass;
    if (s.pass < s.passCount) s.beginPass();
    return {};
}

Result<BackgroundModel> TemporalBackground::finish(Job& job) {
    Impl& s = *impl_;
    if (s.pass < s.passCount)
        return fail(ErrorCode::failed, "only {} of {} passes were made", s.pass, s.passCount);
    STX_CHECK(job.checkCancelled());
    s.pixels = {};
    BackgroundModel& model = s.model;
    model.frames = s.framesOfPass;
    const auto step = static_cast<float>(s.like.depthBits == 32 ? 0.0 : s.like.depthCode().step());
    temporal::dropGhosts(model, s.inFront, s.gauge.noise(), step);
    temporal::checkNeighbours(model, s.gauge.noise(), step);
    if (model.view.pointCount() > 0) {
        bleedColour(model.view.texture);
        fitDepthRange(model.view);
    }
    return std::move(model);
}

}  // namespace stx

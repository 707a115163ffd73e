#include "lib/background/key_background.hpp"

#include <algorithm>
#include <cmath>
#include <variant>
#include <vector>

#include "lib/background/background_vote.hpp"
#include "lib/background/depth_layers.hpp"
#include "lib/base/median.hpp"
#include "lib/base/parallel.hpp"
#include "lib/capture/capture.hpp"
#include "lib/model/light_ratio.hpp"

namespace stx::temporal {
namespace {

/// Points of a pose that a frame is measured at: enough for medians.
constexpr double kMeasured = 6000;
/// Depths that disagree by more are of different surfaces.
constexpr float kSameSurface = 0.05f;
/// A point of a frame is drawn as a square in the pose's pixels: half as wide as the frame's pixel
/// is there and this much more to either side, at most the second (pixels of the pose).
constexpr float kOverlap = 0.15f, kMostReach = 4;
/// A ray is followed to what a frame sees in at most so many steps, and has met it when the two
/// distances differ by less than this share.
constexpr int kSteps = 4;
constexpr float kMet = 2e-4f;
/// Rays that run along a frame's picture plane are left out.
constexpr float kLeastSlope = 0.1f;
/// Nearest and farthest guesses that differ by less are one.
constexpr float kTwoGuesses = 0.02f;
/// Frames whose pixels are coarser by this are worth less.
constexpr float kCoarser = 1.25f;
/// What looks through a place is farther than this many tolerances.
constexpr float kThrough = 3;
constexpr std::int64_t kRowsAtOnce = 8;

using Misses = std::array<std::uint16_t, kLayers>;

}  // namespace

struct KeyBackground::Impl {
    ReferenceView key;
    double support = 0.04;
    bool linear = false;
    std::variant<std::vector<PixelLayers<ByteSample>>, std::vector<PixelLayers<HalfSample>>> pixels;
    std::vector<Misses> misses;
    // Sums over all frames that were seen.
    double noises = 0;
    glm::dvec3 gains{0.0};
    int seen = 0;

    [[nodiscard]] int width() const { return key.camera.width; }
    [[nodiscard]] int height() const { return key.camera.height; }

    /// Where frames' points fall: nearest and farthest distance in each pixel, 0 = none.
    struct Guesses {
        Image<float> nearest, farthest;

        /// The nearest here; where nothing fell, beside it.
        [[nodiscard]] float near(int x, int y) const {
            if (const float own = nearest.at(x, y); own > 0) return own;
            for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}})
                if (nearest.contains(x + dx, y + dy) && nearest.at(x + dx, y + dy) > 0)
                    return nearest.at(x + dx, y + dy);
            return 0;
        }
    };
    /// One frame as it is looked up.
    struct Look {
        const WarpFrame& frame;
        const CameraPair& pair;  ///< from this pose to the frame's
        const DepthNoise& noise;
        glm::vec3 gain;
        float focal;  ///< this pose's focal length over the frame's
        float seconds;
    };
    [[nodiscard]] Guesses guess(const WarpFrame& frame) const;
    /// Calls `visit(pixels, pixel, x, y, ray)` for the rays of all pixels in the axes of `pair`'s
    /// other camera; rows at the same time.
    template <class Visit>
    void forEachRay(const CameraPair& pair, const Visit& visit);
    template <class Sample>
    void follow(PixelLayers<Sample>& layers, const Look& look, const CameraPair::Ray& ray,
                float guess, std::uint32_t random, float& before) const;
    template <class Sample>
    void decide(const PixelLayers<Sample>& layers, std::size_t pixel, const Vote& vote,
                BackgroundModel& model, InFront& inFront) const;
};

KeyBackground::KeyBackground(ReferenceView key, double support) : impl_(std::make_unique<Impl>()) {
    impl_->key = std::move(key);
    impl_->support = support;
    impl_->linear = impl_->key.texture.isLinear();
    const std::size_t count = impl_->key.depth.count();
    if (impl_->linear)
        impl_->pixels = std::vector<PixelLayers<HalfSample>>(count);
    else
        impl_->pixels = std::vector<PixelLayers<ByteSample>>(count);
    impl_->misses.resize(count);
}
KeyBackground::KeyBackground(KeyBackground&&) noexcept = default;
KeyBackground& KeyBackground::operator=(KeyBackground&&) noexcept = default;
KeyBackground::~KeyBackground() = default;

FrameGauge KeyBackground::measure(const ReferenceView& view, const Camera& camera,
                                  DepthNoise& noise) const {
    const Impl& s = *impl_;
    const int w = s.width(), h = s.height();
    const int step =
        std::max(1, static_cast<int>(std::sqrt(static_cast<double>(w) * h / kMeasured)));
    const CameraPair pair(s.key.camera, camera);
    std::vector<LitPair> pairs;
    for (int y = step / 2; y < h; y += step) {
        for (int x = step / 2; x < w; x += step) {
            const float dist = s.key.depth.at(x, y);
            if (!hasPoint(dist) || !(dist > 0)) continue;
            const auto ray = pair.ray(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
            const glm::vec3 at = pair.at(ray, dist);
            if (!(at.z > 0 && at.x >= 0 && at.y >= 0 && at.x < static_cast<float>(camera.width) &&
                  at.y < static_cast<float>(camera.height)))
                continue;
            const int ix = static_cast<int>(at.x), iy = static_cast<int>(at.y);
            const float there = view.depth.at(ix, iy);
            if (!hasPoint(there) || !(std::abs(there - at.z) < kSameSurface * at.z)) continue;
            noise.add(at.z, there);
            const std::size_t a = static_cast<std::size_t>(y) * w + x;
            const std::size_t b = static_cast<std::size_t>(iy) * camera.width + ix;
            pairs.push_back(
                {stepsOf(s.key.texture, a) / 255.0f, stepsOf(view.texture, b) / 255.0f});
        }
    }
    FrameGauge gauge;
    gauge.gain = lightRatio(pairs);
    std::vector<float> differences;
    differences.reserve(pairs.size());
    for (const LitPair& p : pairs)
        differences.push_back(255 * std::abs(brightness(p.b / gauge.gain) - brightness(p.a)));
    gauge.noise = medianOf(std::move(differences));
    return gauge;
}

KeyBackground::Impl::Guesses KeyBackground::Impl::guess(const WarpFrame& frame) const {
    const int w = width(), h = height();
    Guesses g{Image<float>(w, h), Image<float>(w, h)};
    const CameraPair pair(frame.camera, key.camera);
    const Camera& c = frame.camera;
    const auto focal = static_cast<float>(std::max(key.camera.fx / c.fx, key.camera.fy / c.fy));
    for (int y = 0; y < c.height; ++y) {
        for (int x = 0; x < c.width; ++x) {
            const float inverse = frame.inverse.at(x, y);
            if (!(inverse > 0)) continue;
            const auto ray = pair.ray(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
            const glm::vec3 at = pair.at(ray, 1 / inverse);
            if (!(at.z > 0)) continue;
            // Half of the frame's pixel in this pose's, on a surface that faces both.
            const float half = 0.5f * focal / (inverse * at.z);
            const float reach = std::clamp(half + kOverlap, 0.5f, kMostReach);
            if (!(at.x > -reach && at.y > -reach && at.x < static_cast<float>(w) + reach &&
                  at.y < static_cast<float>(h) + reach))
                continue;
            const int x0 = std::max(static_cast<int>(std::ceil(at.x - 0.5f - reach)), 0);
            const int x1 = std::min(static_cast<int>(std::floor(at.x - 0.5f + reach)), w - 1);
            const int y0 = std::max(static_cast<int>(std::ceil(at.y - 0.5f - reach)), 0);
            const int y1 = std::min(static_cast<int>(std::floor(at.y - 0.5f + reach)), h - 1);
            for (int j = y0; j <= y1; ++j) {
                for (int i = x0; i <= x1; ++i) {
                    float& near = g.nearest.at(i, j);
                    float& far = g.farthest.at(i, j);
                    near = near > 0 ? std::min(near, at.z) : at.z;
                    far = std::max(far, at.z);
                }
            }
        }
    }
    return g;
}

template <class Visit>
void KeyBackground::Impl::forEachRay(const CameraPair& pair, const Visit& visit) {
    const int w = width();
    std::visit(
        [&](auto& all) {
            parallelFor(0, height(), kRowsAtOnce, [&](int y) {
                for (int x = 0; x < w; ++x)
                    visit(all, static_cast<std::size_t>(y) * w + x, x, y,
                          pair.ray(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f));
            });
        },
        pixels);
}

/// Follows a ray from a guess to what the frame sees on it, and takes that in; `before`: the
/// distance of what was taken in of this frame, 0 = nothing yet.
template <class Sample>
void KeyBackground::Impl::follow(PixelLayers<Sample>& layers, const Look& look,
                                 const CameraPair::Ray& ray, float guess, std::uint32_t random,
                                 float& before) const {
    const WarpFrame& frame = look.frame;
    float distance = guess;
    for (int k = 1; k <= kSteps; ++k) {
        const glm::vec3 at = look.pair.at(ray, distance);
        if (!(at.z > 0)) return;
        const Spot spot = spotAt(frame, at.x, at.y);
        if (!(spot.inverse > 0)) return;
        const float found = 1 / spot.inverse, off = std::abs(at.z - found);
        distance = look.pair.back(ray, found);
        if (!(distance > 0)) return;
        if (off > kMet * found && k < kSteps) continue;
        Measurement m;
        m.tolerance = look.noise.tolerance(found, frame.step);
        if (off > m.tolerance * found) return;
        if (before > 0 && std::abs(distance - before) <= 2 * m.tolerance * distance) return;
        before = distance;
        m.q = 1 / distance;
        m.weak = !spot.whole || frame.mixed.at(spot.x, spot.y) != 0;
        const float coarser = found * look.focal / distance;
        const auto worth = static_cast<Worth>((m.weak ? 2 : 0) + (coarser > kCoarser ? 1 : 0));
        m.key = keyOf(worth, random);
        m.heads = random & 1;
        m.time = look.seconds;
        m.colour = colourAt(frame, spot, at.x, at.y) / look.gain;
        layers.add(m);
        return;
    }
}

void KeyBackground::see(const WarpFrame& frame, const FrameGauge& light, const DepthNoise& noise,
                        std::uint32_t number, float seconds) {
    Impl& s = *impl_;
    const Impl::Guesses guesses = s.guess(frame);
    const CameraPair pair(s.key.camera, frame.camera);
    const Impl::Look look{
        frame,  pair, noise, light.gain, static_cast<float>(s.key.camera.fx / frame.camera.fx),
        seconds};
    s.forEachRay(pair, [&](auto& all, std::size_t pixel, int x, int y, const auto& ray) {
        const float near = guesses.near(x, y);
        if (!(near > 0) || !(ray.slope > kLeastSlope)) return;
        const std::uint32_t random = randomOf(pixel, number);
        const float far = guesses.farthest.at(x, y);
        float before = 0;
        s.follow(all[pixel], look, ray, near, random, before);
        if (far > near * (1 + kTwoGuesses)) s.follow(all[pixel], look, ray, far, random, before);
    });
    s.gains += glm::dvec3(light.gain);
    s.noises += light.noise;
    ++s.seen;
}

void KeyBackground::carve(const WarpFrame& frame, const DepthNoise& noise) {
    Impl& s = *impl_;
    const CameraPair pair(s.key.camera, frame.camera);
    s.forEachRay(pair, [&](auto& all, std::size_t pixel, int, int, const auto& ray) {
        for (std::size_t k = 0; k < kLayers; ++k) {
            const auto& layer = all[pixel].layers[k];
            std::uint16_t& misses = s.misses[pixel][k];
            if (layer.count() == 0 || misses == 0xffff) continue;
            const glm::vec3 at = pair.at(ray, 1 / layer.q);
            if (!(at.z > 0)) continue;
            misses += clearView(frame, at, kThrough * noise.tolerance(at.z, frame.step));
        }
    });
}

template <class Sample>
void KeyBackground::Impl::decide(const PixelLayers<Sample>& layers, std::size_t pixel,
                                 const Vote& vote, BackgroundModel& model, InFront& inFront) const {
    // The background is the nearest layer that two frames saw and that not too many looked
    // through. Beside edges of still things all samples are weak: a layer of weak samples alone
    // must have been seen half as often as the layer that was seen most.
    std::array<bool, kLayers> moved{}, stays{};
    double most = 0;
    for (std::size_t k = 0; k < kLayers; ++k) {
        const Layer<Sample>& layer = layers.layers[k];
        if (layer.count() == 0) continue;
        const double through = misses[pixel][k];
        moved[k] = through >= std::max(2.0, support * (through + layer.count()));
        stays[k] = !moved[k] && layer.strong + kWeakShare * layer.weak >= 2;
        if (stays[k]) most = std::max<double>(most, layer.count());
    }
    const Layer<Sample>* found = nullptr;
    for (std::size_t k = 0; k < kLayers; ++k) {
        const Layer<Sample>& layer = layers.layers[k];
        if (!stays[k] || (layer.strong == 0 && 2 * layer.count() < most)) continue;
        if (!found || layer.q > found->q) found = &layer;
    }
    int others = 0;
    for (std::size_t k = 0; k < kLayers; ++k) {
        const Layer<Sample>& layer = layers.layers[k];
        if (moved[k] && others < 2 && layer.strong > layer.weak && (!found || layer.q > found->q))
            inFront.data()[pixel][others++] = layer.q;
    }
    if (found) vote.set(*found, pixel, model);
}

BackgroundModel KeyBackground::finish(int frames, double firstTime, const DepthNoise& noise) {
    Impl& s = *impl_;
    const int w = s.width(), h = s.height();
    BackgroundModel model;
    model.frames = frames;
    model.view.name = s.key.name;
    model.view.camera = s.key.camera;
    model.view.nearPlane = s.key.nearPlane;
    model.view.farPlane = s.key.farPlane;
    model.view.depthBits = s.key.depthBits;
    model.view.background = true;
    model.view.depth = Image<float>(w, h, kNoDepth);
    if (s.linear)
        model.view.texture = RgbaFloatImage(w, h, glm::vec4(0));
    else
        model.view.texture = Rgba8Image(w, h, glm::u8vec4(0));
    model.confidence = Image<float>(w, h, 0.0f);
    model.lastSeen = Image<float>(w, h, 0.0f);
    InFront inFront(w, h, glm::vec2(0.0f));
    Vote vote;
    vote.frames = frames;
    vote.support = s.support;
    vote.firstTime = firstTime;
    if (s.seen > 0) {
        vote.gain = glm::vec3(s.gains / static_cast<double>(s.seen));
        vote.noise = static_cast<float>(s.noises / s.seen);
    }
    std::visit(
        [&](const auto& all) {
            parallelFor(0, s.key.depth.count(), 4096,
                        [&](std::size_t i) { s.decide(all[i], i, vote, model, inFront); });
        },
        s.pixels);
    s.pixels = {};
    const auto step = static_cast<float>(s.key.depthBits == 32 ? 0.0 : s.key.depthCode().step());
    dropGhosts(model, inFront, noise, step);
    checkNeighbours(model, noise, step);
    if (model.view.pointCount() > 0) {
        bleedColour(model.view.texture);
        fitDepthRange(model.view);
    }
    return model;
}

}  // namespace stx::temporal

#include "lib/background/background_vote.hpp"

#include <algorithm>
#include <numeric>

#include "lib/base/parallel.hpp"

namespace stx::temporal {
namespace {

/// Brightness of two groups of samples that differ by more is that of light and shadow: steps of
/// 0..255, and times what brightness differs by from frame to frame.
constexpr float kShadow = 6, kShadowTimes = 6;
/// The lighter group must have this share of the samples, and two of them.
constexpr float kLightShare = 0.25f;
/// Samples of the best worth are enough by themselves when there are these.
constexpr int kEnough = 3;
/// Neighbours whose distances differ by less than this share, or by less than this many tolerances
/// of DepthNoise, belong to one piece of surface.
constexpr float kSurfaceShare = 0.03f, kSurfaceTolerances = 2;
/// A piece goes on beyond its outline where a neighbouring pixel had something before its
/// background at the same distance, within this share. A piece that does so along this share of its
/// outline is a part of something that moves.
constexpr float kGhostShare = 0.08f, kGhostOutline = 0.5f;
/// For a piece of fewer pixels than this one place of its outline is enough.
constexpr std::uint32_t kSpeck = 24;
/// Fewer pixels than these, which nothing beside them agrees with, are flying ones of the sensor.
constexpr std::uint32_t kFlying = 4;
/// Neighbours within this many tolerances are of one surface.
constexpr float kNeighbour = 3;

template <class Sample>
const Layer<Sample>* backgroundOf(const PixelLayers<Sample>& pixel, const Vote& vote) {
    const double wanted = std::max(2.0, vote.support * vote.frames);
    // Where nothing is behind the object, that is the background.
    if (pixel.empty >= (vote.fillsFrame ? std::max(wanted, 0.5 * vote.frames) : wanted))
        return nullptr;
    const Layer<Sample>* farthest = nullptr;
    for (const auto& layer : pixel.layers)
        if (layer.strong > 0 && layer.strong + kWeakShare * layer.weak >= wanted &&
            (!farthest || layer.q < farthest->q))
            farthest = &layer;
    // Beside an edge between still things depth flickers from one to the other: of what was only
    // seen there, that which was seen most, if it is behind everything else.
    const Layer<Sample>* mixed = nullptr;
    for (const auto& layer : pixel.layers)
        if (layer.count() >= wanted && (!farthest || layer.q < farthest->q) &&
            (!mixed || layer.count() > mixed->count()))
            mixed = &layer;
    return mixed ? mixed : farthest;
}

/// The middle of a layer's samples, without those in shadow and those of lesser worth.
template <class Sample>
glm::vec3 colourOf(const Layer<Sample>& layer, float noise) {
    struct Value {
        glm::vec3 colour;
        float brightness;
    };
    std::array<Value, kSamples> values;
    const int known = layer.sampleCount();
    int count = 0;
    for (int worth = 0; worth < 4 && count < kEnough; ++worth) {
        for (int i = 0; i < known; ++i) {
            const Sample& s = layer.samples[i];
            if (s.key >> 6 != worth) continue;
            const glm::vec3 c = s.colour();
            values[count++] = {c, brightness(c)};
        }
    }
    const auto begin = values.begin();
    std::sort(begin, begin + count,
              [](const Value& a, const Value& b) { return a.brightness < b.brightness; });
    // Two groups: the split of the largest difference between their means, weighed by size.
    float total = 0;
    for (int i = 0; i < count; ++i) total += values[i].brightness;
    int split = 0;
    float below = 0, most = 0, apart = 0;
    for (int i = 1; i < count; ++i) {
        below += values[i - 1].brightness;
        const auto n = static_cast<float>(i), m = static_cast<float>(count - i);
        const float difference = (total - below) / m - below / n;
        if (difference * difference * n * m <= most) continue;
        most = difference * difference * n * m;
        split = i;
        apart = difference;
    }
    const auto lighter = static_cast<float>(count - split);
    const int first = apart > std::max(kShadow, kShadowTimes * noise) &&
                              lighter >= std::max(2.0f, kLightShare * static_cast<float>(count))
                          ? split
                          : 0;
    // The mean of the middle half: as steady as a median against what does not belong, with less
    // noise.
    glm::vec3 colour;
    const int used = count - first, cut = used / 4;
    for (int channel = 0; channel < 3; ++channel) {
        std::array<float, kSamples> sorted{};
        for (int i = 0; i < used; ++i) sorted[i] = values[first + i].colour[channel];
        std::sort(sorted.begin(), sorted.begin() + used);
        float sum = 0;
        for (int i = cut; i < used - cut; ++i) sum += sorted[i];
        colour[channel] = sum / static_cast<float>(used - 2 * cut);
    }
    return colour;
}

/// `steps` as stepsOf() gives them.
void setColour(Texture& texture, std::size_t pixel, glm::vec3 steps) {
    if (auto* bytes = texture.rgba8()) {
        bytes->data()[pixel] =
            glm::u8vec4(glm::u8vec3(glm::clamp(steps + 0.5f, 0.0f, 255.0f)), 255);
        return;
    }
    const glm::vec3 root = steps / 255.0f;
    texture.rgbaFloat()->data()[pixel] = glm::vec4(root * root, 1.0f);
}

void clearPixel(BackgroundModel& model, std::size_t pixel) {
    model.view.depth.data()[pixel] = kNoDepth;
    if (auto* bytes = model.view.texture.rgba8()) bytes->data()[pixel] = glm::u8vec4(0);
    if (auto* floats = model.view.texture.rgbaFloat()) floats->data()[pixel] = glm::vec4(0.0f);
    model.confidence.data()[pixel] = 0;
    model.lastSeen.data()[pixel] = 0;
}

}  // namespace

template <class Sample>
void Vote::decide(const PixelLayers<Sample>& layers, std::size_t pixel, BackgroundModel& model,
                  InFront& inFront) const {
    const Layer<Sample>* layer = backgroundOf(layers, *this);
    // Beside edges depth flickers, and where the sensor mostly saw nothing it is not to be trusted.
    float farthest = layer ? layer->q : 0;
    if (!layer) {
        // The farthest layer may be the background, seen by too few frames to be believed.
        for (const auto& other : layers.layers)
            if (other.count() > 0 && (farthest == 0 || other.q < farthest)) farthest = other.q;
    }
    int others = 0;
    for (const auto& other : layers.layers)
        if (others < 2 && other.strong > other.weak &&
            2 * layers.empty < static_cast<std::uint32_t>(frames) && (!layer || other.q > layer->q))
            inFront.data()[pixel][others++] = other.q;
    if (layer) set(*layer, pixel, model);
}

template <class Sample>
void Vote::set(const Layer<Sample>& layer, std::size_t pixel, BackgroundModel& model) const {
    model.view.depth.data()[pixel] = 1 / layer.q;
    setColour(model.view.texture, pixel, colourOf(layer, noise) * gain);
    model.confidence.data()[pixel] =
        std::min(1.0f, static_cast<float>(layer.count()) / static_cast<float>(frames));
    model.lastSeen.data()[pixel] = static_cast<float>(firstTime + layer.last);
}

template void Vote::decide(const PixelLayers<ByteSample>&, std::size_t, BackgroundModel&,
                           InFront&) const;
template void Vote::decide(const PixelLayers<HalfSample>&, std::size_t, BackgroundModel&,
                           InFront&) const;
template void Vote::set(const Layer<ByteSample>&, std::size_t, BackgroundModel&) const;
template void Vote::set(const Layer<HalfSample>&, std::size_t, BackgroundModel&) const;

void dropGhosts(BackgroundModel& model, const InFront& inFront, const DepthNoise& noise,
                float step) {
    const Image<float>& depth = model.view.depth;
    const int w = depth.width(), h = depth.height();
    const auto tolerance = [&](float dist) {
        return std::max(kSurfaceShare, kSurfaceTolerances * noise.tolerance(dist, step));
    };
    // Pieces of surface: numbers of pixels that lead to the first of their piece.
    std::vector<std::uint32_t> first(depth.count());
    std::iota(first.begin(), first.end(), 0u);
    const auto find = [&](std::uint32_t i) {
        while (first[i] != i) i = first[i] = first[first[i]];
        return i;
    };
    const auto linked = [&](float a, float b) {
        return hasPoint(a) && hasPoint(b) && std::abs(a - b) <= std::max(a, b) * tolerance(a);
    };
    for (int y = 0; y < h; ++y) {
        for (int x = 0; x < w; ++x) {
            const auto i = static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(w) +
                           static_cast<std::uint32_t>(x);
            for (const auto& [ok, other] : {std::pair{x > 0, i - 1}, {y > 0, i - w}}) {
                if (!ok || !linked(depth.data()[i], depth.data()[other])) continue;
                const std::uint32_t a = find(i), b = find(other);
                first[std::max(a, b)] = std::min(a, b);
            }
        }
    }
    // How long the outline of each piece is, where something farther is beside it, and along how
    // much of it the piece goes on in what was before that.
    struct Outline {
        std::uint32_t pixels = 0, length = 0, goesOn = 0;
    };
    std::vector<Outline> outlines(depth.count());
    for (int y = 0; y < h; ++y) {
        for (int x = 0; x < w; ++x) {
            const float here = depth.at(x, y);
            if (!hasPoint(here)) continue;
            const auto i = static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(w) +
                           static_cast<std::uint32_t>(x);
            ++outlines[find(i)].pixels;
            for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
                if (!depth.contains(x + dx, y + dy)) continue;
                const float there = depth.at(x + dx, y + dy);
                if (there <= here || linked(here, there)) continue;
                Outline& outline = outlines[find(i)];
                ++outline.length;
                const glm::vec2 before = inFront.at(x + dx, y + dy);
                for (int k = 0; k < 2; ++k) {
                    if (!(before[k] > 0) || std::abs(before[k] * here - 1) > kGhostShare) continue;
                    ++outline.goesOn;
                    break;
                }
            }
        }
    }
    for (std::uint32_t i = 0; i < first.size(); ++i) {
        if (!hasPoint(depth.data()[i])) continue;
        const Outline& outline = outlines[find(i)];
        const float least =
            outline.pixels < kSpeck ? 0.0f : kGhostOutline * static_cast<float>(outline.length);
        if (outline.pixels < kFlying ||
            (outline.goesOn > 0 && static_cast<float>(outline.goesOn) >= least))
            clearPixel(model, i);
    }
}

void checkNeighbours(BackgroundModel& model, const DepthNoise& noise, float step) {
    const Image<float> depth = model.view.depth;
    const int w = depth.width(), h = depth.height();
    const auto agree = [&](float a, float b) {
        return hasPoint(a) && hasPoint(b) &&
               std::abs(a - b) <= kNeighbour * std::max(a, b) * noise.tolerance(a, step);
    };
    const auto at = [&](int x, int y) { return depth.contains(x, y) ? depth.at(x, y) : kNoDepth; };
    struct Closed {
        std::size_t pixel;
        float depth;
        glm::vec3 colour;
        float confidence, lastSeen;
    };
    std::vector<std::vector<Closed>> closed(static_cast<std::size_t>(h));
    std::vector<std::vector<std::size_t>> dropped(static_cast<std::size_t>(h));
    parallelFor(0, h, 8, [&](int y) {
        for (int x = 0; x < w; ++x) {
            const std::size_t pixel = static_cast<std::size_t>(y) * w + x;
            const float here = depth.at(x, y);
            if (hasPoint(here)) {
                if (!agree(here, at(x - 1, y)) && !agree(here, at(x + 1, y)) &&
                    !agree(here, at(x, y - 1)) && !agree(here, at(x, y + 1)))
                    dropped[y].push_back(pixel);
                continue;
            }
            for (const auto& [dx, dy] : {std::pair{1, 0}, {0, 1}}) {
                const float a = at(x - dx, y - dy), b = at(x + dx, y + dy);
                if (!agree(a, b)) continue;
                const std::size_t offset = static_cast<std::size_t>(dy) * w + dx;
                const std::size_t p = pixel - offset, q = pixel + offset;
                const Texture& t = model.view.texture;
                closed[y].push_back(
                    {pixel, 2 / (1 / a + 1 / b), 0.5f * (stepsOf(t, p) + stepsOf(t, q)),
                     std::min(model.confidence.data()[p], model.confidence.data()[q]),
                     std::min(model.lastSeen.data()[p], model.lastSeen.data()[q])});
                break;
            }
        }
    });
    for (const auto& row : dropped)
        for (const std::size_t pixel : row) clearPixel(model, pixel);
    for (const auto& row : closed) {
        for (const Closed& c : row) {
            model.view.depth.data()[c.pixel] = c.depth;
            setColour(model.view.texture, c.pixel, c.colour);
            model.confidence.data()[c.pixel] = c.confidence;
            model.lastSeen.data()[c.pixel] = c.lastSeen;
        }
    }
}

}  // namespace stx::temporal

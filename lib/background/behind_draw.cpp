#include "lib/background/behind_draw.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "lib/base/parallel.hpp"

namespace stx::behind {
namespace {

/// Pixels by which what is behind goes on under what is beside it, so that no crack is between.
constexpr int kOverlap = 2;

/// How much of the photograph's detail is put on the smooth colours: of the finest, and of what is
/// coarser than a block. Invented detail is never where the true one is, so all of it costs a
/// decibel; of aloe (view 1 alone, views 3 and 5 the truth) 1.07 and 0.61 keep 0.6 of the truth's
/// gradient energy and more, at the SSIM and within 0.1 dB of smooth colours. Around the frame,
/// where there is nothing on the other side to fit it to, 1 and 0.4 are as near as smooth colours.
struct Detail {
    float fine, coarse;
};
constexpr Detail kHiddenDetail = {1.07f, 0.61f}, kAroundDetail = {1.0f, 0.4f};

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
    const float parallax = layer.parallax.data()[own];
    // Between diagonal neighbours, and some more.
    const float tolerance =
        std::max(surfaceTolerance(layer, own), 2 * steepestBehind(layer) * parallax);
    if (step == 1) return {parallax, layer.colour.data()[own]};
    const float bx = (static_cast<float>(x) + 0.5f) / static_cast<float>(step) - 0.5f;
    const float by = (static_cast<float>(y) + 0.5f) / static_cast<float>(step) - 0.5f;
    const int x0 = static_cast<int>(std::floor(bx)), y0 = static_cast<int>(std::floor(by));
    const bool around = layer.part.data()[own] == Part::around;
    float weights = 0, sum = 0, colourWeights = 0;
    glm::vec3 colours(0);
    for (int k = 0; k < 4; ++k) {
        const int u = x0 + k % 2, v = y0 + k / 2;
        if (!layer.part.contains(u, v)) continue;
        const Part part = layer.part.at(u, v);
        if (part == Part::shown) continue;
        const float there = layer.parallax.at(u, v);
        if (std::abs(there - parallax) > tolerance) continue;
        const float weight =
            (1 - std::abs(bx - static_cast<float>(u))) * (1 - std::abs(by - static_cast<float>(v)));
        weights += weight;
        sum += weight * there;
        if ((part == Part::around) != around) continue;
        colourWeights += weight;
        colours += weight * layer.colour.at(u, v);
    }
    return {weights > 0 ? sum / weights : parallax,
            colourWeights > 0 ? colours / colourWeights : layer.colour.data()[own]};
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
void put(Texture& texture, int x, int y, glm::vec3 colour, bool covered = true) {
    if (auto* bytes = texture.rgba8()) {
        const glm::vec3 coded = glm::clamp(colour, 0.0f, 1.0f) * 255.0f + 0.5f;
        bytes->at(x, y) = glm::u8vec4(glm::u8vec3(coded), covered ? 255 : 0);
    } else {
        texture.rgbaFloat()->at(x, y) = glm::vec4(glm::max(colour, 0.0f), covered ? 1.0f : 0.0f);
    }
}

/// Means of the photograph's colours between the middles of blocks.
glm::vec3 smoothAt(const Layer& layer, const Image<glm::vec3>& smooth, int x, int y) {
    if (layer.step == 1) return smooth.at(x, y);
    const float bx = (static_cast<float>(x) + 0.5f) / static_cast<float>(layer.step) - 0.5f;
    const float by = (static_cast<float>(y) + 0.5f) / static_cast<float>(layer.step) - 0.5f;
    const int x0 = static_cast<int>(std::floor(bx)), y0 = static_cast<int>(std::floor(by));
    const float fx = bx - static_cast<float>(x0), fy = by - static_cast<float>(y0);
    return glm::mix(glm::mix(smooth.at(x0, y0), smooth.at(x0 + 1, y0), fx),
                    glm::mix(smooth.at(x0, y0 + 1), smooth.at(x0 + 1, y0 + 1), fx), fy);
}

/// Colours of blocks, and under what is not drawn those of the nearest that are (bleedColour()):
/// with alpha 0, as what is not drawn is written.
Texture bledColours(const Layer& layer, const Image<std::uint8_t>& drawn, bool linear) {
    RgbaFloatImage colours(layer.width(), layer.height());
    for (std::size_t i = 0; i < colours.count(); ++i)
        colours.data()[i] = glm::vec4(layer.colour.data()[i], drawn.data()[i] != 0 ? 1.0f : 0.0f);
    Texture bled = std::move(colours);
    bleedColour(bled);
    // In a quarter of the memory where it becomes bytes anyway.
    Texture out = linear ? Texture(RgbaFloatImage(layer.width(), layer.height()))
                         : Texture(Rgba8Image(layer.width(), layer.height()));
    for (int y = 0; y < layer.height(); ++y)
        for (int x = 0; x < layer.width(); ++x) put(out, x, y, glm::vec3(bled.at(x, y)), false);
    return out;
}

/// What detail a pixel gets of a block's source.
glm::vec3 detailAt(const Layer& layer, const Sources& sources, const ReferenceView& photo,
                   glm::ivec2 block, glm::ivec2 pixel) {
    const glm::ivec2 source = sources.at(block.x, block.y);
    if (source.x < 0) return glm::vec3(0);
    const glm::ivec2 from = pixel + layer.step * (source - block);
    const glm::ivec2 at = from - layer.step * layer.border;
    if (!photo.depth.contains(at.x, at.y)) return glm::vec3(0);
    const Detail& much =
        layer.part.at(block.x, block.y) == Part::around ? kAroundDetail : kHiddenDetail;
    const glm::vec3 middle = smoothAt(layer, layer.smooth, from.x, from.y);
    return much.fine * (glm::vec3(photo.texture.at(at.x, at.y)) - middle) +
           much.coarse * (middle - smoothAt(layer, layer.base, from.x, from.y));
}

}  // namespace

std::int64_t drawBehind(const Layer& layer, const Sources& sources, const ReferenceView& photo,
                        double scale, ReferenceView& out) {
    const Image<std::uint8_t> drawn = drawnBlocks(layer);
    const Texture bled = bledColours(layer, drawn, photo.texture.isLinear());
    const int w = out.camera.width, h = out.camera.height;
    out.depth = Image<float>(w, h, kNoDepth);
    if (photo.texture.isLinear())
        out.texture = RgbaFloatImage(w, h, glm::vec4(0));
    else
        out.texture = Rgba8Image(w, h, glm::u8vec4(0));
    const glm::ivec2 border = layer.border * layer.step;
    std::vector<std::int64_t> hidden(static_cast<std::size_t>(h), 0);
    parallelFor(0, h, [&](int y) {
        for (int x = 0; x < w; ++x) {
            const auto block = blockToDraw(layer, drawn, photo.depth.size(), x, y);
            const Sample sample = block ? sampleAt(layer, *block, x, y) : Sample();
            if (!(sample.parallax > 0)) {
                const int step = layer.step;
                if (auto* bytes = out.texture.rgba8())
                    bytes->at(x, y) = bled.rgba8()->at(x / step, y / step);
                else
                    out.texture.rgbaFloat()->at(x, y) = bled.rgbaFloat()->at(x / step, y / step);
                continue;
            }
            float depth = static_cast<float>(scale / sample.parallax);
            const int u = x - border.x, v = y - border.y;
            if (photo.depth.contains(u, v)) {
                // Never before what is there.
                if (hasPoint(photo.depth.at(u, v))) depth = std::max(depth, photo.depth.at(u, v));
                ++hidden[y];
            }
            out.depth.at(x, y) = depth;
            put(out.texture, x, y, sample.colour + detailAt(layer, sources, photo, *block, {x, y}));
        }
    });
    std::int64_t all = 0;
    for (const std::int64_t count : hidden) all += count;
    return all;
}

}  // namespace stx::behind

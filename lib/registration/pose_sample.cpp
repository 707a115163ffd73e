#include "lib/registration/pose_sample.hpp"

#include <algorithm>

#include "lib/base/parallel.hpp"
#include "lib/registration/overlap.hpp"

namespace stx {
namespace {

/// An image with a shorter side than this is not halved.
constexpr int kLeastSide = 32;
/// Of all samples of a bundle, and of each.
constexpr std::uint64_t kBytes = 32'000'000, kMostPixels = 640 * 480, kFewestPixels = 4096;
/// Depth, and grey values with all smaller levels: 4 + 4 * 4/3, rounded up.
constexpr std::uint64_t kBytesOfPixel = 10;

Image<float> greyOf(const Texture& texture) {
    Image<float> grey(texture.width(), texture.height());
    for (int y = 0; y < grey.height(); ++y) {
        for (int x = 0; x < grey.width(); ++x) {
            const glm::vec4 c = texture.at(x, y);
            const float mean = (c.r + c.g + c.b) / 3;
            grey.at(x, y) =
                texture.isLinear() ? srgbFromLinear(std::clamp(mean, 0.0f, 1.0f)) : mean;
        }
    }
    return grey;
}

Image<float> halved(const Image<float>& fine) {
    Image<float> coarse(fine.width() / 2, fine.height() / 2);
    for (int y = 0; y < coarse.height(); ++y)
        for (int x = 0; x < coarse.width(); ++x)
            coarse.at(x, y) = (fine.at(2 * x, 2 * y) + fine.at(2 * x + 1, 2 * y) +
                               fine.at(2 * x, 2 * y + 1) + fine.at(2 * x + 1, 2 * y + 1)) /
                              4;
    return coarse;
}

bool canBeHalved(const Image<float>& image) {
    return image.width() >= kLeastSide && image.height() >= kLeastSide;
}

}  // namespace

PoseSample poseSampleOf(const ReferenceView& view, std::uint64_t mostPixels) {
    PoseSample out;
    out.header = view;
    out.header.colourFile = {};
    Image<float> grey = greyOf(view.texture);
    int factor = 1;
    while (canBeHalved(grey) && static_cast<std::uint64_t>(grey.pixels().size()) > mostPixels) {
        grey = halved(grey);
        factor *= 2;
    }
    out.grey.push_back(std::move(grey));
    while (out.grey.size() < static_cast<std::size_t>(kPoseLevels) && canBeHalved(out.grey.back()))
        out.grey.push_back(halved(out.grey.back()));
    if (factor == 1) {
        out.depth = view.depth;
        return out;
    }
    Camera& camera = out.header.camera;
    camera.width = out.grey.front().width();
    camera.height = out.grey.front().height();
    for (double* value : {&camera.fx, &camera.fy, &camera.cx, &camera.cy}) *value /= factor;
    out.depth = Image<float>(camera.width, camera.height);
    for (int y = 0; y < camera.height; ++y) {
        for (int x = 0; x < camera.width; ++x) {
            const auto found =
                registration::sampleDepth(view.depth, (x + 0.5) * factor, (y + 0.5) * factor);
            out.depth.at(x, y) = found ? static_cast<float>(found->distance) : kNoDepth;
        }
    }
    return out;
}

std::vector<PoseSample> poseSamplesOf(const std::vector<ReferenceView>& views,
                                      std::uint64_t mostPixels) {
    std::vector<PoseSample> samples(views.size());
    parallelFor(0, samples.size(),
                [&](std::size_t at) { samples[at] = poseSampleOf(views[at], mostPixels); });
    return samples;
}

std::uint64_t samplePixels(std::size_t views) {
    return std::clamp(kBytes / (kBytesOfPixel * std::max<std::size_t>(views, 1)), kFewestPixels,
                      kMostPixels);
}

}  // namespace stx

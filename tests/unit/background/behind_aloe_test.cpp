// What view 1 of a real set hides, beside its views 3 and 5: the background that is invented
// against what drawing fills without one. Ratios only. And what a photograph of a phone hides.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "formats/files/files.hpp"
#include "formats/images/images.hpp"
#include "formats/imagesets/image_sets.hpp"
#include "lib/background/behind_photo.hpp"
#include "lib/metrics/compare.hpp"
#include "lib/render/api/frame_picture.hpp"
#include "lib/render/factory.hpp"
#include "tests/shared_data.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

using Mask = Image<std::uint8_t>;

Rgba8Image photographed(const std::filesystem::path& file) {
    Job job;
    const auto bytes = readFile(file, job.limits);
    EXPECT_TRUE(bytes);
    const auto image = decodeImage(*bytes, file.string(), job.limits);
    EXPECT_TRUE(image);
    Rgba8Image out = rgba8From(*image);
    for (auto& c : out.pixels()) c.a = 255;
    return out;
}

Rgba8Image drawnFrom(const Bundle& bundle, const Camera& camera, Fill fill) {
    Job job;
    RenderSettings settings;
    settings.fill = fill;
    auto renderer = makeRenderer(Backend::cpu, bundle, settings, -1, job);
    if (!renderer) {
        ADD_FAILURE() << renderer.error().text();
        return {};
    }
    return rgba8From(*(*renderer)->render(camera));
}

/// What view 1 does not show: between things that it shows in a row, and beyond all of them.
struct Uncovered {
    Mask inside, strip;
};
Uncovered uncoveredOf(const Rgba8Image& covered) {
    const int w = covered.width();
    Uncovered out{Mask(w, covered.height(), 0), Mask(w, covered.height(), 0)};
    for (int y = 0; y < covered.height(); ++y) {
        const auto row = covered.row(y);
        const auto isThere = [](glm::u8vec4 c) { return c.a == 255; };
        const auto first = std::ranges::find_if(row, isThere) - row.begin();
        std::ptrdiff_t last = w - 1;
        while (last >= 0 && !isThere(row[static_cast<std::size_t>(last)])) --last;
        for (int x = 0; x < w; ++x) {
            if (isThere(row[static_cast<std::size_t>(x)])) continue;
            (x > first && x < last ? out.inside : out.strip).at(x, y) = 255;
        }
    }
    return out;
}

struct LikeTruth {
    double decibels = 0, ssim = 0, gradients = 0;
};
LikeTruth likeTruth(const Rgba8Image& picture, const Rgba8Image& truth, const Mask& mask) {
    CompareSettings settings;
    settings.mask = &mask;
    const auto compared = compare(picture, truth, settings);
    if (!compared) {
        ADD_FAILURE() << compared.error().text();
        return {};
    }
    const auto energy = [&](const Rgba8Image& of) {
        const auto luma = [&](int x, int y) {
            const glm::u8vec4 c = of.at(x, y);
            return 0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b;
        };
        double sum = 0;
        for (int y = 0; y + 1 < of.height(); ++y)
            for (int x = 0; x + 1 < of.width(); ++x)
                if (mask.at(x, y) > 0)
                    sum += std::pow(luma(x + 1, y) - luma(x, y), 2) +
                           std::pow(luma(x, y + 1) - luma(x, y), 2);
        return sum;
    };
    return {*compared->psnrRgb, compared->ssimY, energy(picture) / energy(truth)};
}

/// View 1 alone, without what other pictures would tell of it.
Result<Bundle> viewOne(const std::filesystem::path& set, Job& job) {
    const TemporaryFolder alone;
    for (const char* name : {"disp1.png", "view1.png"})
        std::filesystem::copy_file(set / name, alone / name);
    ImageSetOptions options;
    options.focal = 3740;
    options.baseline = 160;
    options.disparityOffset = 270;
    return readImageSet(alone.path(), options, job);
}

/// The colour of a point of a view in another camera's picture, between pixels that all are in the
/// mask; nothing where they are not.
std::optional<glm::dvec3> colourOf(const ReferenceView& view, int x, int y, const Camera& camera,
                                   const Rgba8Image& picture, const Mask& mask) {
    const glm::dvec3 inCamera =
        glm::conjugate(camera.orientation) * (view.worldPoint(x, y) - camera.position);
    const glm::dvec2 at = glm::dvec2(camera.project(inCamera)) - 0.5;
    const glm::ivec2 first(glm::floor(at));
    glm::dvec3 sum(0);
    for (int k = 0; k < 4; ++k) {
        const glm::ivec2 n = first + glm::ivec2(k % 2, k / 2);
        if (!mask.contains(n.x, n.y) || mask.at(n.x, n.y) == 0) return std::nullopt;
        const glm::dvec2 off = 1.0 - glm::abs(at - glm::dvec2(n));
        sum += off.x * off.y * glm::dvec3(glm::u8vec3(picture.at(n.x, n.y)));
    }
    return sum;
}

/// Of one place that several eyes see uncovered, its colours.
struct Seen {
    glm::dvec3 sum{0}, squares{0};
    int count = 0;

    void add(const glm::dvec3& c) {
        sum += c;
        squares += c * c;
        ++count;
    }
    [[nodiscard]] double variance() const {
        const glm::dvec3 mean = sum / static_cast<double>(count);
        const glm::dvec3 v = squares / static_cast<double>(count) - mean * mean;
        return (v.x + v.y + v.z) / 3;
    }
};
/// How far places stray from their mean colour, levels.
double swimming(const std::vector<Seen>& all) {
    double sum = 0;
    int count = 0;
    for (const Seen& seen : all) {
        if (seen.count < 3) continue;
        sum += std::max(0.0, seen.variance());
        ++count;
    }
    EXPECT_GT(count, 1000);
    return std::sqrt(sum / count);
}

}  // namespace

TEST(BehindAloe, WhatIsInventedIsAsNearAsTheFillAndHasTexture) {
    REQUIRE_SHARED(set, "data/imagesets/middlebury2006-aloe");
    Job job;
    const auto bundle = viewOne(set, job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    Bundle behind = *bundle;
    // View 5 is as far away as this.
    const auto added = addBehind(behind, {10.7}, job);
    ASSERT_TRUE(added) << added.error().text();
    for (const int number : {3, 5}) {
        Camera camera = bundle->views[0].camera;
        camera.position.x = 160.0 * (number - 1) / 4;
        // The pictures are cropped such that disparity 0 is at Z = f B / 270.
        camera.cx += 270.0 * (number - 1) / 4;
        const Rgba8Image truth = photographed(set / fmt::format("view{}.png", number));
        const Uncovered uncovered = uncoveredOf(drawnFrom(*bundle, camera, Fill::none));
        const Rgba8Image before = drawnFrom(*bundle, camera, Fill::background);
        const Rgba8Image now = drawnFrom(behind, camera, Fill::background);
        const LikeTruth filled = likeTruth(before, truth, uncovered.inside);
        const LikeTruth invented = likeTruth(now, truth, uncovered.inside);
        const LikeTruth stripFilled = likeTruth(before, truth, uncovered.strip);
        const LikeTruth strip = likeTruth(now, truth, uncovered.strip);
        std::printf(
            "  view %d, filled and invented: %.2f %.2f dB, SSIM %.3f %.3f, gradients %.2f %.2f; "
            "strip %.2f %.2f dB\n",
            number, filled.decibels, invented.decibels, filled.ssim, invented.ssim,
            filled.gradients, invented.gradients, stripFilled.decibels, strip.decibels);
        EXPECT_GE(invented.decibels, filled.decibels - 0.3);
        EXPECT_GE(invented.ssim, filled.ssim);
        EXPECT_GE(invented.gradients, 0.6);
        EXPECT_GE(strip.decibels, stripFilled.decibels);
    }
}

TEST(BehindAloe, WhatIsUncoveredKeepsItsColourWhileTheEyeMoves) {
    REQUIRE_SHARED(set, "data/imagesets/middlebury2006-aloe");
    Job job;
    const auto bundle = viewOne(set, job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    Bundle behind = *bundle;
    ASSERT_TRUE(addBehind(behind, {10.7}, job));
    const ReferenceView& hidden = behind.views[1];
    std::vector<Seen> before, now;
    for (int eye = 1; eye <= 8; ++eye) {
        Camera camera = bundle->views[0].camera;
        camera.position.x = 160.0 * eye / 8;
        camera.cx += 270.0 * eye / 8;
        // Rows that leaves are in, which is enough.
        camera.height = 400;
        camera.cy -= 350;
        const Mask inside = uncoveredOf(drawnFrom(*bundle, camera, Fill::none)).inside;
        const Rgba8Image filled = drawnFrom(*bundle, camera, Fill::background);
        const Rgba8Image invented = drawnFrom(behind, camera, Fill::background);
        std::size_t number = 0;
        for (int y = 0; y < hidden.depth.height(); y += 3) {
            for (int x = 0; x < hidden.depth.width(); x += 3, ++number) {
                if (eye == 1) {
                    before.emplace_back();
                    now.emplace_back();
                }
                if (!hasPoint(hidden.depth.at(x, y))) continue;
                const auto was = colourOf(hidden, x, y, camera, filled, inside);
                if (!was) continue;
                before[number].add(*was);
                now[number].add(*colourOf(hidden, x, y, camera, invented, inside));
            }
        }
    }
    const double swamFilled = swimming(before), swamInvented = swimming(now);
    std::printf("  colours stray by %.2f levels where they are filled, %.2f invented\n", swamFilled,
                swamInvented);
    EXPECT_LT(swamInvented, 0.5 * swamFilled);
}

// Depth of phones, whose hidden places are smoothed over long ways.
TEST(BehindPhone, NothingIsBehindAllThatThePhotographShows) {
    REQUIRE_SHARED(photo, "data/phones/apple-jpeg/bikes-rot90.jpg");
    Job job;
    ImageSetOptions options;
    options.refine = *RefineSettings::from("auto,-raise");
    const auto bundle = readImageSet(photo, options, job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    const auto behind = behindPhoto(bundle->views[0], {}, job);
    ASSERT_TRUE(behind) << behind.error().text();
    const auto farthest = [](const Image<float>& depth) {
        float most = 0;
        for (const float value : depth.pixels())
            if (hasPoint(value)) most = std::max(most, value);
        return most;
    };
    EXPECT_LE(farthest(behind->view.depth), 1.001f * farthest(bundle->views[0].depth));
}

}  // namespace stx

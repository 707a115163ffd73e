// Backgrounds of real video (SBI's sequences) against what was really behind. Figures are AGE and
// pEPs as tests/bench/background_table.py prints them, of the pixels whose background is known.

#include <cmath>

#include <gtest/gtest.h>

#include "formats/images/images.hpp"
#include "formats/video/video_frames.hpp"
#include "lib/background/still.hpp"
#include "tests/shared_data.hpp"

namespace stx {
namespace {

Rgba8Image pictureAt(const std::filesystem::path& path) {
    const auto bytes = readFile(path, Limits());
    EXPECT_TRUE(bytes) << path;
    auto picture = decodeRgba8(*bytes, path.string(), Limits());
    EXPECT_TRUE(picture) << path;
    return std::move(*picture);
}

struct StillFigures {
    double age = 0, peps = 0;
};

StillFigures figuresOf(const std::filesystem::path& sequence, const StillSettings& settings) {
    Job job;
    const auto frames = openVideoFrames({sequence / "input"}, job);
    EXPECT_TRUE(frames) << frames.error().text();
    const auto made = stillBackground(**frames, settings, job);
    EXPECT_TRUE(made) << made.error().text();
    const auto truth = pictureAt(sequence / "derived_background.png");
    const auto known = pictureAt(sequence / "derived_known.png");
    StillFigures f;
    double count = 0;
    for (std::size_t i = 0; i < truth.count(); ++i) {
        if (known.pixels()[i].r < 128) continue;
        const auto luma = [](glm::u8vec4 p) {
            return std::lround(0.299 * p.r + 0.587 * p.g + 0.114 * p.b);
        };
        const long error = std::abs(luma(truth.pixels()[i]) - luma(made->colour.pixels()[i]));
        f.age += static_cast<double>(error);
        f.peps += error > 20;
        ++count;
    }
    return {f.age / count, f.peps / count};
}

TEST(StillGolden, SelectReachesItsFigures) {
    REQUIRE_SHARED(folder, "data/motion/background");
    EXPECT_LE(figuresOf(folder / "HallAndMonitor", {}).age, 0.75);
    EXPECT_LE(figuresOf(folder / "Foliage", {}).age, 1.0);
    EXPECT_LE(figuresOf(folder / "Toscana", {}).age, 3.3);
}

TEST(StillGolden, SelectByGradientsStandsSlowLight) {
    REQUIRE_SHARED(folder, "data/motion/background");
    StillSettings settings;
    settings.drift = true;
    EXPECT_LE(figuresOf(folder / "HallAndMonitor", settings).age, 0.75);
    EXPECT_LE(figuresOf(folder / "Foliage", settings).age, 2.1);
}

TEST(StillGolden, N2pgIsRightInMostPixelsFromTenFramesOn) {
    REQUIRE_SHARED(folder, "data/motion/background");
    StillSettings settings;
    settings.method = StillMethod::n2pg;
    const auto all = figuresOf(folder / "HallAndMonitor", settings);
    EXPECT_LE(all.peps, 0.01);
    EXPECT_LE(all.age, 1.3);                                       // MOG2: 1.33
    EXPECT_LE(figuresOf(folder / "Foliage", settings).age, 21.5);  // MOG2: 25.07
    EXPECT_LE(figuresOf(folder / "Toscana", settings).age, 3.2);   // MOG2: 6.37
    for (const int frames : {10, 20, 50}) {
        settings.frames = frames;
        EXPECT_LE(figuresOf(folder / "HallAndMonitor", settings).peps, 0.01) << frames;
    }
}

}  // namespace
}  // namespace stx

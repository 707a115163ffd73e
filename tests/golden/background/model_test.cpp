// The background that is remembered out of frames, against rooms without anything that moves.

#include <gtest/gtest.h>

#include "tests/golden/background/frames_of.hpp"
#include "tests/moving_frames.hpp"
#include "tests/shared_data.hpp"

namespace stx {
namespace {

struct ModelFigures {
    double psnr = 0, open = 0, wrongDepth = 0;
};

ModelFigures against(const ReferenceView& truth, const ReferenceView& model) {
    double sum = 0;
    std::int64_t known = 0, all = 0, wrong = 0;
    for (std::size_t i = 0; i < truth.depth.count(); ++i) {
        ++all;
        const float z = model.depth.data()[i];
        if (!hasPoint(z)) continue;
        ++known;
        wrong += std::abs(z - truth.depth.data()[i]) > 0.02f * truth.depth.data()[i];
        for (int c = 0; c < 3; ++c) {
            const double d = double{model.texture.at(i)[c]} - truth.texture.at(i)[c];
            sum += d * d / 3;
        }
    }
    return {-10 * std::log10(sum / known), double(all - known) / all, double(wrong) / known};
}

void keep(const ReferenceView& view, const std::string& name) {
    const char* out = std::getenv("STX_DEV_OUT");
    if (!out) return;
    auto texture = *view.texture.rgba8();
    for (std::size_t i = 0; i < texture.count(); ++i)
        if (!hasPoint(view.depth.data()[i])) texture.data()[i] = {255, 0, 255, 255};
    const auto bytes =
        encodePng(view.camera.width, view.camera.height, 4, 8, texture.data(), true, 1);
    std::FILE* file = std::fopen(fmt::format("{}/{}.png", out, name).c_str(), "wb");
    std::fwrite(bytes->data(), 1, bytes->size(), file);
    std::fclose(file);
}

TEST(TemporalBackground, Person) {
    REQUIRE_SHARED(folder, "data/motion/uva-person");
    Job job;
    const auto model = backgroundOf([&](int i) { return moving::personFrame(folder, 2 * i); },
                                    [](int i) { return i / 15.0; }, 50, job);
    keep(model.view, "person");
}

TEST(TemporalBackground, MovingRoom) {
    REQUIRE_SHARED(folder, "data/motion/moving-room");
    Job job;
    const moving::MovingRoom room(folder);
    for (const char* v : {"v0", "v1", "v2"}) {
        const auto model =
            backgroundOf([&](int i) { return room.view(v, i); }, moving::MovingRoom::time, 16, job);
        keep(model.view, v);
    }
}

TEST(TemporalBackground, IsTheEmptyRoom) {
    REQUIRE_SHARED(folder, "data/motion/synthetic-room");
    const moving::SyntheticRoom room(folder);
    Job job;
    for (const bool noisy : {false, true}) {
        const auto model = backgroundOf(
            [&](int i) {
                auto view = room.frame(i);
                if (noisy) moving::addSensorNoise(view, i, room.time(i));
                return view;
            },
            moving::SyntheticRoom::time, moving::SyntheticRoom::kFrames, job);
        const ModelFigures f = against(room.empty("ref"), model.view);
        fmt::print("{}: {:.2f} dB, open {:.4f}, wrong depth {:.4f}\n", noisy ? "noisy" : "clean",
                   f.psnr, f.open, f.wrongDepth);
        keep(model.view, fmt::format("room_{}", noisy));
    }
}

}  // namespace
}  // namespace stx

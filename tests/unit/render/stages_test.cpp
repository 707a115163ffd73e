// Each stage of rendering can be left out, and is worth being there: some picture changes.

#include "lib/render/api/stages.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "lib/render/bench/analytic_scene.hpp"
#include "lib/render/factory.hpp"
#include "lib/render/scene/page_set.hpp"
#include "tests/noisy_depth.hpp"
#include "tests/torus_bundle.hpp"

namespace stx {
namespace {

/// A set, and a camera that nobody captured.
struct Shot {
    Bundle bundle;
    Camera camera;
};

Shot ofObject(int views, int side) {
    Shot shot{{}, analyticCamera(AnalyticScene::object, 0.5, views).resized(side, side)};
    for (int i = 0; i < views; ++i)
        shot.bundle.views.push_back(viewOfAnalyticScene(
            AnalyticScene::object, analyticCamera(AnalyticScene::object, i, views).resized(96, 96),
            2));
    return shot;
}

Shot ofRoom() {
    Shot shot{{}, analyticCamera(AnalyticScene::room, 0.5, 3).resized(160, 120)};
    shot.camera.position.x += 0.6;
    for (int i = 0; i < 2; ++i)
        shot.bundle.views.push_back(viewOfAnalyticScene(
            AnalyticScene::room, analyticCamera(AnalyticScene::room, i, 2).resized(160, 120), 2));
    return shot;
}

/// Views that stages look for.
std::vector<Shot> shots() {
    std::vector<Shot> all{ofObject(8, 96), ofObject(3, 150), ofRoom()};
    Shot grid{torusViews(24, glm::dvec3(0), {ViewLayout::Kind::octahedral, 4, 0}), {}};
    // The twins of a noisy set count twice.
    noisy::addNoise(grid.bundle, 0.005);
    for (std::size_t i = 0; i < grid.bundle.views.size(); ++i)
        for (std::size_t k = 0; k < i; ++k)
            if (sameCamera(grid.bundle.views[i].camera, grid.bundle.views[k].camera))
                grid.bundle.views[i].depth = grid.bundle.views[k].depth;
    grid.camera = analyticCamera(AnalyticScene::object, 0.5, 8).resized(150, 150);
    all.push_back(grid);
    Shot small = ofObject(8, 96);
    small.camera = small.camera.resized(32, 32);
    all.push_back(small);
    Shot exposed = ofObject(6, 96);
    noisy::changeLight(exposed.bundle);
    all.push_back(exposed);
    Shot glass = ofObject(6, 96);
    for (ReferenceView& view : glass.bundle.views)
        for (auto& pixel : view.texture.rgba8()->pixels())
            if (pixel.a == 255) pixel.a = 128;
    all.push_back(glass);
    Shot captured = ofRoom();
    for (ReferenceView& view : captured.bundle.views) {
        view.noDepth = NoDepth::unknown;
        for (int y = 30; y < 90; ++y)
            for (int x = 20; x < 140; ++x) view.depth.at(x, y) = kNoDepth;
    }
    all.push_back(captured);
    Shot apart = ofRoom();  // smooth views that disagree
    for (ReferenceView& view : apart.bundle.views) view.noDepth = NoDepth::unknown;
    for (float& depth : apart.bundle.views[1].depth.pixels()) depth *= 1.008f;
    all.push_back(apart);
    Shot mixed = ofObject(8, 96);
    mixed.bundle.views.push_back(viewOfAnalyticScene(
        AnalyticScene::object, analyticCamera(AnalyticScene::object, 2, 8).resized(12, 12), 2));
    all.push_back(mixed);
    Shot alone = ofRoom();
    alone.bundle.views.resize(1);
    all.push_back(alone);
    return all;
}

Image<glm::vec4> drawn(const Shot& shot, const RenderSettings& settings) {
    Job job;
    const auto renderer = makeRenderer(Backend::cpu, shot.bundle, settings, -1, job);
    EXPECT_TRUE(renderer);
    auto frame = (*renderer)->render(shot.camera);
    EXPECT_TRUE(frame);
    return std::move(frame->colour);
}

TEST(Stages, HaveNamesOfTheirOwn) {
    std::set<std::string_view> names;
    for (const StageInfo& stage : stages()) EXPECT_TRUE(names.insert(stage.name).second);
    for (const RefineStepInfo& step : refineSteps()) EXPECT_TRUE(names.insert(step.name).second);
    EXPECT_EQ(names.size(), stages().size() + refineSteps().size());
}

/// The same pictures, in less time.
bool isOnlyFaster(std::string_view stage) {
    return stage == "settle" || stage == "cull";
}

TEST(Stages, AreTheTablesOfThePageOfThePipeline) {
    const std::filesystem::path folder(STX_SOURCE_DIR "/lib/render");
    std::ifstream file(folder / "pipeline.md");
    const std::string page((std::istreambuf_iterator<char>(file)), {});
    const auto pictureOf = [&](std::string_view name) {
        const std::string picture = fmt::format("../../samples/pictures/stages/{}.png", name);
        EXPECT_TRUE(std::filesystem::exists(folder / picture))
            << picture << " is made by samples/make_stage_pictures.py";
        return fmt::format("![]({})", picture);
    };
    const auto sentenceOf = [](const auto& info) {
        return fmt::format("{}{}", info.sentence,
                           info.source.empty() ? "" : fmt::format(" ({})", info.source));
    };
    std::string steps, table;
    for (const RefineStepInfo& s : refineSteps())
        if (s.when == RefineWhen::refine)
            steps += fmt::format("| `{}` | {} | {} |\n", s.name, sentenceOf(s), pictureOf(s.name));
    for (const StageInfo& s : stages()) {
        const char* mode = s.mode == StageMode::both      ? "both"
                           : s.mode == StageMode::surface ? "surface"
                                                          : "splat";
        table +=
            fmt::format("| `{}` | {} | {} | {} |\n", s.name, mode, sentenceOf(s),
                        isOnlyFaster(s.name) ? "the same picture in less time" : pictureOf(s.name));
    }
    EXPECT_NE(page.find(steps), std::string::npos) << steps;
    EXPECT_NE(page.find(table), std::string::npos) << table;
}

TEST(Stages, ChangePicturesOfSomeSet) {
    const std::vector<Shot> all = shots();
    for (const RenderMode mode : {RenderMode::surface, RenderMode::splat}) {
        RenderSettings settings;
        settings.mode = mode;
        settings.quality = Quality::best;  // which has all stages
        std::vector<Image<glm::vec4>> whole;
        for (const Shot& shot : all) whole.push_back(drawn(shot, settings));
        for (const StageInfo& stage : stages()) {
            if (isOnlyFaster(stage.name)) continue;
            RenderSettings without = settings;
            without.without.add(stage.stage);
            const bool ofMode = stage.mode == StageMode::both ||
                                (stage.mode == StageMode::surface) == (mode == RenderMode::surface);
            bool changes = false;
            for (std::size_t i = 0; i < all.size() && !changes; ++i)
                changes = drawn(all[i], without) != whole[i];
            EXPECT_EQ(changes, ofMode) << stage.name;
        }
    }
}

TEST(Stages, SettlingAPixelWithOneSampleGivesItsPicture) {
    const Shot shot = ofObject(8, 96);
    RenderSettings without;
    without.without.add(Stage::settle);
    const auto a = drawn(shot, {}), b = drawn(shot, without);
    double error = 0;
    for (std::size_t i = 0; i < a.count(); ++i) {
        const glm::vec4 d = a.data()[i] - b.data()[i];
        error += static_cast<double>(glm::dot(d, d)) / 4;
    }
    EXPECT_GT(-10 * std::log10(error / static_cast<double>(a.count())), 45.0);
}

TEST(Stages, SettlingChangesSomePixels) {
    RenderSettings without;
    without.without.add(Stage::settle);
    const std::vector<Shot> all = shots();
    EXPECT_TRUE(std::ranges::any_of(
        all, [&](const Shot& shot) { return drawn(shot, {}) != drawn(shot, without); }));
}

TEST(Stages, TellALogWhatTheyTookAndChanged) {
    RenderSettings settings;
    settings.log = std::make_shared<StageLog>();
    settings.lighting.lights.push_back({});
    (void)drawn(ofObject(3, 150), settings);
    std::set<std::string> names;
    for (const StageLog::Entry& e : settings.log->entries()) {
        names.insert(e.name);
        EXPECT_GE(e.milliseconds, 0) << e.name;
        const std::set<std::string> ofPictures{"plan", "draw", "holes", "outlines", "light"};
        EXPECT_NE(e.once, ofPictures.contains(e.name)) << e.name;
        EXPECT_TRUE(e.name != "outlines" || e.pixels > 0);
    }
    for (const char* name : {"prepare", "creases", "levels", "sharpen", "plan", "draw", "holes",
                             "outlines", "noise", "light"})
        EXPECT_TRUE(names.contains(name)) << name;
}

}  // namespace
}  // namespace stx

// What a bundle exports comes back the same.

#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "formats/imagesets/export.hpp"
#include "formats/imagesets/image_sets.hpp"
#include "tests/small_bundle.hpp"
#include "tests/temporary_folder.hpp"

using namespace stx;

namespace {

using Kind = ExportOptions::Kind;

class Export : public ::testing::TestWithParam<std::tuple<Kind, int, bool>> {};

TEST_P(Export, ComesBackEqualToTheBit) {
    const auto [kind, depthBits, linear] = GetParam();
    const Bundle bundle = smallBundle(4, depthBits, false, linear);
    TemporaryFolder folder;
    Job job;
    ExportOptions options;
    options.kind = kind;
    const auto written = exportViews(*viewsOf(bundle), folder / "set", options, job);
    ASSERT_TRUE(written) << written.error().text();
    const auto recognised = recogniseImageSet(folder / "set");
    ASSERT_TRUE(recognised) << recognised.error().text();
    EXPECT_EQ(*recognised, kind == Kind::miv ? "miv" : "transforms");
    const auto back = readImageSet(folder / "set", {}, job);
    ASSERT_TRUE(back) << back.error().text();
    EXPECT_EQ(differenceOf(bundle, *back), "");
    for (std::size_t i = 0; i < bundle.views.size(); ++i) {
        const Camera &a = bundle.views[i].camera, &b = back->views[i].camera;
        EXPECT_TRUE(a == b) << a.fx - b.fx << " " << a.cx - b.cx << " " << a.cy - b.cy;
    }
    // Again into the same folder: it is ours to replace.
    EXPECT_TRUE(exportViews(*viewsOf(bundle), folder / "set", options, job));
    options.noClobber = true;
    EXPECT_FALSE(exportViews(*viewsOf(bundle), folder / "set", options, job));
}

INSTANTIATE_TEST_SUITE_P(All, Export,
                         ::testing::Combine(::testing::Values(Kind::transforms, Kind::miv),
                                            ::testing::Values(8, 16, 32), ::testing::Bool()));

auto exportColmap(const Bundle& bundle, const std::filesystem::path& folder, Job& job) {
    ExportOptions options;
    options.kind = Kind::colmap;
    return exportViews(*viewsOf(bundle), folder, options, job);
}

/// COLMAP has no mark for it: what is opaque without depth says it.
TEST(Export, CutOutsOfColmapKeepWhatIsNotKnown) {
    Bundle bundle = smallBundle(2, 32, false, false);
    std::erase_if(bundle.views, [](const ReferenceView& v) { return v.camera.orthographic; });
    ASSERT_FALSE(bundle.views.empty());
    ReferenceView& view = bundle.views[0];
    view.name = "cut";
    view.noDepth = NoDepth::unknown;
    int hole = -1;
    for (int i = 0; i < static_cast<int>(view.depth.count()); ++i) {
        const bool point = hasPoint(view.depth.data()[i]);
        view.texture.rgba8()->data()[i].a = point ? 255 : 0;
        if (point) hole = i;
    }
    ASSERT_GE(hole, 0);
    view.depth.data()[hole] = kNoDepth;
    view.texture.rgba8()->data()[0].a = 0;
    view.depth.data()[0] = kNoDepth;
    ASSERT_NE(hole, 0);
    TemporaryFolder folder;
    Job job;
    const auto written = exportColmap(bundle, folder / "set", job);
    ASSERT_TRUE(written) << written.error().text();
    ImageSetOptions reading;
    reading.refine = *RefineSettings::from("off");
    const auto back = readImageSet(folder / "set", reading, job);
    ASSERT_TRUE(back) << back.error().text();
    EXPECT_EQ(back->views[0].noDepth, NoDepth::unknown);
    EXPECT_EQ(back->views[0].texture.alpha(static_cast<std::size_t>(hole)), 1.0f);
    EXPECT_EQ(back->views[0].texture.alpha(0), 0.0f);
}

/// What reads a workspace would take them for photographs.
TEST(Export, ColmapHasNoBackgroundViews) {
    Bundle bundle = smallBundle(3, 32, false, false);
    std::erase_if(bundle.views, [](const ReferenceView& v) { return v.camera.orthographic; });
    ASSERT_EQ(bundle.views.size(), 2u);
    bundle.views[0].background = true;
    TemporaryFolder folder;
    Job job;
    const auto written = exportColmap(bundle, folder / "set", job);
    ASSERT_TRUE(written) << written.error().text();
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("1 background view is left out"), std::string::npos) << notes[0];
    ImageSetOptions reading;
    reading.refine = *RefineSettings::from("off");
    const auto back = readImageSet(folder / "set", reading, job);
    ASSERT_TRUE(back) << back.error().text();
    ASSERT_EQ(back->views.size(), 1u);
    EXPECT_EQ(back->views[0].depth.size(), bundle.views[1].depth.size());
    // Of backgrounds alone there is nothing to write.
    bundle.views[1].background = true;
    const auto none = exportColmap(bundle, folder / "none", job);
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().code, ErrorCode::invalidInput);
    EXPECT_FALSE(std::filesystem::exists(folder / "none"));
}

TEST(Export, ColmapSaysWhatLinearColoursLose) {
    for (const bool bright : {false, true}) {
        Bundle bundle = smallBundle(1, 32, false, true);
        // They reach up to 4.
        if (!bright)
            for (glm::vec4& c : bundle.views[0].texture.rgbaFloat()->pixels())
                c = glm::vec4(glm::vec3(c) / 4.0f, c.a);
        TemporaryFolder folder;
        Job job;
        const auto written = exportColmap(bundle, folder / "set", job);
        ASSERT_TRUE(written) << written.error().text();
        EXPECT_EQ(job.takeNotes(),
                  std::vector<std::string>{
                      bright ? "linear colour becomes 8-bit sRGB; values above 1 are clipped"
                             : "linear colour becomes 8-bit sRGB"});
    }
}

/// What other programs see: the same points without the keys that only we know, for perspective
/// and orthographic cameras with principal points off the middle, and for masks.
TEST(Export, ComesBackWithoutOurOwnKeys) {
    const Bundle bundle = smallBundle(4, 32, false, false);
    for (const Kind kind : {Kind::transforms, Kind::miv}) {
        TemporaryFolder folder;
        Job job;
        ExportOptions options;
        options.kind = kind;
        ASSERT_TRUE(exportViews(*viewsOf(bundle), folder / "set", options, job));
        std::filesystem::path file;
        for (const auto& entry : std::filesystem::directory_iterator(folder / "set"))
            if (entry.path().extension() == ".json") file = entry.path();
        auto json = nlohmann::json::parse(std::ifstream(file));
        for (auto& camera : json[kind == Kind::miv ? "cameras" : "frames"])
            for (const char* key :
                 {"stx:name", "stx:quaternion", "stx:window", "nearPlane", "farPlane", "depthBits"})
                camera.erase(key);
        std::ofstream(file) << json;
        ImageSetOptions read;
        read.depthBits = 32;
        const auto back = readImageSet(folder / "set", read, job);
        ASSERT_TRUE(back) << back.error().text();
        ASSERT_EQ(back->views.size(), bundle.views.size());
        int orthographic = 0;
        for (std::size_t i = 0; i < bundle.views.size(); ++i) {
            const auto &a = bundle.views[i], &b = back->views[i];
            ASSERT_EQ(a.depth.size(), b.depth.size());
            EXPECT_EQ(a.camera.orthographic, b.camera.orthographic);
            orthographic += b.camera.orthographic;
            EXPECT_EQ(a.texture, b.texture);
            for (int y = 0; y < a.depth.height(); ++y)
                for (int x = 0; x < a.depth.width(); ++x) {
                    ASSERT_EQ(hasPoint(a.depth.at(x, y)), hasPoint(b.depth.at(x, y)));
                    if (!hasPoint(a.depth.at(x, y))) continue;
                    ASSERT_LT(glm::length(a.worldPoint(x, y) - b.worldPoint(x, y)), 1e-9)
                        << "view " << i << " at " << x << "," << y;
                }
        }
        EXPECT_EQ(orthographic, 2);
    }
}

TEST(Export, IntegerDepthIsRoundedByNoMoreThanItsNoteSays) {
    const Bundle bundle = smallBundle(2, 16, false, false);
    for (const Kind kind : {Kind::transforms, Kind::miv}) {
        TemporaryFolder folder;
        Job job;
        ExportOptions options;
        options.kind = kind;
        options.depth = ExportOptions::Depth::png;
        ASSERT_TRUE(exportViews(*viewsOf(bundle), folder / "set", options, job));
        ASSERT_FALSE(job.takeNotes().empty());
        ImageSetOptions read;
        read.depthBits = 32;
        const auto back = readImageSet(folder / "set", read, job);
        ASSERT_TRUE(back) << back.error().text();
        for (std::size_t i = 0; i < bundle.views.size(); ++i) {
            const auto& a = bundle.views[i];
            const auto& b = back->views[i];
            ASSERT_EQ(a.depth.size(), b.depth.size());
            const double n = a.nearPlane, f = a.farPlane;
            const double allowed =
                kind == Kind::transforms ? 0.0005001 : f * f * (1 / n) / 65535 * 0.51;
            for (std::size_t p = 0; p < a.depth.count(); ++p) {
                const float d = a.depth.data()[p], e = b.depth.data()[p];
                ASSERT_EQ(hasPoint(d), hasPoint(e));
                if (hasPoint(d)) {
                    ASSERT_NEAR(d, e, allowed);
                }
            }
        }
    }
}

/// A bundle of one view whose depth is `scale` times that of smallBundle(), 0.1 to 3.1.
Bundle scaledBundle(double scale) {
    Bundle bundle = smallBundle(1, 32, false, false);
    ReferenceView& view = bundle.views[0];
    for (float& distance : view.depth.pixels())
        if (hasPoint(distance)) distance = static_cast<float>(distance * scale);
    view.nearPlane *= 0.99 * scale;
    view.farPlane *= 1.01 * scale;
    bundle.bounds = bundle.computeBounds();
    return bundle;
}

double unitIn(const std::filesystem::path& folder) {
    return nlohmann::json::parse(std::ifstream(folder / "transforms.json"))
        .at("integer_depth_scale")
        .get<double>();
}

void expectDepth(const ReferenceView& is, const ReferenceView& expected, double unit) {
    for (std::size_t p = 0; p < expected.depth.count(); ++p) {
        const float a = is.depth.data()[p], b = expected.depth.data()[p];
        ASSERT_EQ(hasPoint(a), hasPoint(b));
        if (hasPoint(b)) {
            // Half a step, and what a float rounds.
            ASSERT_NEAR(a, b, 0.5 * unit + 1e-6 * b);
        }
    }
}

TEST(Export, IntegerDepthHasStepsThatFitTheScene) {
    for (const double scale : {1e-4, 1.0, 100.0}) {
        const Bundle bundle = scaledBundle(scale);
        TemporaryFolder folder;
        Job job;
        ExportOptions options;
        options.depth = ExportOptions::Depth::png;
        ASSERT_TRUE(exportViews(*viewsOf(bundle), folder / "set", options, job));
        const auto notes = job.takeNotes();
        ASSERT_EQ(notes.size(), 1u);
        // nerfstudio takes millimetres unless it is asked for others.
        EXPECT_EQ(notes[0].find("nerfstudio") == std::string::npos, scale == 1.0) << notes[0];
        const double unit = unitIn(folder / "set");
        EXPECT_DOUBLE_EQ(unit, scale == 1.0 ? 0.001 : bundle.views[0].farPlane / 65535);
        ImageSetOptions read;
        read.depthBits = 32;
        read.refine = *RefineSettings::from("off");
        const auto back = readImageSet(folder / "set", read, job);
        ASSERT_TRUE(back) << back.error().text();
        expectDepth(back->views[0], bundle.views[0], unit);
    }
}

/// What is small at first and ten times as far away a moment later.
class GoingAway : public Sequence {
  public:
    GoingAway() { timeline_ = steadyTimeline(2, 25); }
    Result<Bundle> frame(std::size_t index, Job&) override {
        Bundle bundle = scaledBundle(index == 0 ? 1e-4 : 1e-3);
        setTime(bundle, index);
        return bundle;
    }
};

TEST(Export, IntegerDepthOfSmallFilmsHasStepsThatFit) {
    GoingAway film;
    TemporaryFolder folder;
    Job job;
    ExportOptions options;
    options.depth = ExportOptions::Depth::png;
    const auto written = exportFrames(film, folder / "set", options, job);
    ASSERT_TRUE(written) << written.error().text();
    const double unit = unitIn(folder / "set");
    EXPECT_DOUBLE_EQ(unit, 16 * film.frame(0, job)->views[0].farPlane / 65535);
    ImageSetOptions read;
    read.depthBits = 32;
    read.refine = *RefineSettings::from("off");
    const auto back = openImageSet(folder / "set", read, job);
    ASSERT_TRUE(back) << back.error().text();
    ASSERT_EQ((*back)->timeline().count(), 2u);
    for (std::size_t i = 0; i < 2; ++i) {
        const auto frame = (*back)->frame(i, job);
        ASSERT_TRUE(frame) << frame.error().text();
        expectDepth(frame->views[0], film.frame(i, job)->views[0], unit);
    }
}

/// From 1000 on MIV takes the farthest distance for infinite: a scene in millimetres has its views
/// there, and so may even its nearest distance be.
TEST(Export, ScenesInMillimetresComeBackFromMiv) {
    Bundle bundle = smallBundle(2, 32, false, false);
    for (ReferenceView& view : bundle.views) {
        for (std::size_t p = 0; p < view.depth.count(); ++p) view.depth.data()[p] *= 2000;
        view.nearPlane *= 2000;
        view.farPlane *= 2000;
        view.camera.position *= 2000;
    }
    bundle.bounds = bundle.computeBounds();
    for (const bool floats : {false, true}) {
        TemporaryFolder folder;
        Job job;
        ExportOptions options;
        options.kind = Kind::miv;
        if (!floats) options.depth = ExportOptions::Depth::png;
        ASSERT_TRUE(exportViews(*viewsOf(bundle), folder / "set", options, job));
        ImageSetOptions read;
        read.depthBits = 32;
        const auto back = readImageSet(folder / "set", read, job);
        ASSERT_TRUE(back) << back.error().text();
        for (std::size_t i = 0; i < bundle.views.size(); ++i) {
            const auto &a = bundle.views[i], &b = back->views[i];
            const double allowed =
                floats ? 0 : a.farPlane * a.farPlane / a.nearPlane / 65535 * 0.51;
            for (std::size_t p = 0; p < a.depth.count(); ++p) {
                const float d = a.depth.data()[p], e = b.depth.data()[p];
                ASSERT_EQ(hasPoint(d), hasPoint(e));
                if (hasPoint(d)) {
                    ASSERT_NEAR(d, e, allowed);
                }
            }
        }
    }
}

TEST(Export, RefusesAForeignFolderAndLeavesItAlone) {
    TemporaryFolder folder;
    std::filesystem::create_directory(folder / "mine");
    std::ofstream(folder / "mine/diary.txt") << "keep";
    Job job;
    EXPECT_FALSE(exportViews(*viewsOf(smallBundle(1, 16, false, false)), folder / "mine", {}, job));
    EXPECT_TRUE(std::filesystem::exists(folder / "mine/diary.txt"));
    EXPECT_FALSE(std::filesystem::exists(folder / "mine/transforms.json"));
}

}  // namespace

// What files cannot hold is refused when it is written, not when it is read.
#include "formats/stx/stx.hpp"
#include "tests/small_bundle.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/sequences/moving_views.hpp"

namespace stx {
namespace {

/// The error of saving `model`, of which nothing is left.
template <class M>
std::string refusal(const M& model, const std::string& name) {
    const TemporaryFolder folder;
    Job job;
    const auto saved = save(model, folder / name, {}, job);
    EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << name;
    return saved ? "" : saved.error().text();
}

TEST(Unsound, AtlasesAreRefused) {
    Job job;
    const auto sound = pack(smallBundle(2, 16, false, false), {}, job);
    ASSERT_TRUE(sound) << sound.error().text();
    const auto check = [&](const std::function<void(Atlas&)>& change, const std::string& text) {
        Atlas atlas = *sound;
        change(atlas);
        const auto checked = atlas.check();
        ASSERT_FALSE(checked) << text;
        EXPECT_EQ(checked.error().text(), text);
        for (const char* name : {"atlas", "atlas.exr"}) EXPECT_EQ(refusal(atlas, name), text);
    };
    check([](Atlas& a) { a.layout = "Tight"; },
          "the atlas' layout is 'Tight'; grid or tight is expected");
    check([](Atlas& a) { a.sourcePixels = -9; },
          fmt::format("sourcePixels is -9 and keptPixels {}; 0 or more are expected",
                      sound->keptPixels));
    check([](Atlas& a) { a.padding = 100000; },
          "the atlas' padding is 100000; 0 to 65535 is expected");
    check([](Atlas& a) { a.origin.x = std::nan(""); },
          "the origin is nan, 0, 0; finite numbers are expected");
    check([](Atlas& a) { a.pages[0].depth.at(5, 5) = -3; },
          "page 0: depth holds -3; distances are 0 or more");
    check([](Atlas& a) { a.pages[0].depth.at(5, 5) = std::nanf(""); },
          "page 0: depth holds nan; distances are 0 or more");
    check([](Atlas& a) { a.views[1].nearPlane = a.views[1].farPlane = 2; },
          "view 1: nearPlane is 2 and farPlane 2; 0 <= nearPlane < farPlane must hold");
}

TEST(Unsound, BundlesAreRefused) {
    Bundle bundle = smallBundle(2, 16, true, false);
    for (ReferenceView& view : bundle.views) view.name.clear();
    for (const char* name : {"a.mp4", "a.exr"}) {
        const TemporaryFolder folder;
        Job job;
        EXPECT_TRUE(save(bundle, folder / name, {}, job)) << name;
        EXPECT_TRUE(open(folder / name, {}, job)) << name;
    }
    bundle.views[0].splatV = {};
    for (const char* name : {"a.mp4", "a.exr"})
        EXPECT_EQ(refusal(bundle, name),
                  "view 0: it has splatU without splatV; both axes of the splats, or none, are "
                  "expected");
    bundle = smallBundle(2, 16, true, false);
    bundle.origin.z = std::numeric_limits<double>::infinity();
    for (const char* name : {"a.mp4", "a.exr"})
        EXPECT_EQ(refusal(bundle, name), "the origin is 0, 0, inf; finite numbers are expected");
}

TEST(Unsound, CamerasBeyondFloatsAreRefusedInMpegFour) {
    const auto check = [&](const std::function<void(Camera&)>& change, const std::string& text) {
        // The second view stays where it is, so that no origin is near both.
        Bundle bundle = smallBundle(2, 16, false, false);
        bundle.bounds.reset();
        Camera& camera = bundle.views[0].camera;
        camera.cx = camera.width * 0.5;
        camera.cy = camera.height * 0.5;
        change(camera);
        EXPECT_EQ(refusal(bundle, "a.mp4"), "view 0 'view 0': " + text);
    };
    check([](Camera& c) { c.position.x = 4e38, c.position.y = 0, c.position.z = 1; },
          "the camera's position (4e+38 0 1) does not fit 32-bit floats; write .exr");
    check([](Camera& c) { c.fx = c.fy = 1e-7; },
          "the camera's fieldOfView would be 3.1415927 3.1415927 in 32-bit floats; angles lie "
          "between 0 and 3.1415927 (both excluded); write .exr");
    check([](Camera& c) { c.orthographic = true, c.fx = c.fy = 1e-40; },
          "the camera's fieldOfView would be inf inf in 32-bit floats; the window of an "
          "orthographic DepthImage has sides above 0; write .exr");
}

TEST(Unsound, FramesOfOneTickAreRefusedInMpegFour) {
    Timeline line;
    line.times = {0, 1e-7, 2e-7};
    line.end = 3e-7;
    const TemporaryFolder folder;
    Job job;
    MovingViews frames(line);
    const auto saved = save(frames, folder / "a.mp4", {}, job);
    ASSERT_FALSE(saved);
    EXPECT_EQ(saved.error().code, ErrorCode::unsupported);
    EXPECT_EQ(
        saved.error().text(),
        "frames 0 and 1 are at 0 and 1e-07 s, and the clock of an MPEG-4 film has 1000000 ticks "
        "a second, so that one would be lost; write .exr");
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
    EXPECT_TRUE(save(frames, folder / "a_%d.exr", {}, job));
}

TEST(Unsound, MomentsKeepTheirTimeInEveryContainer) {
    MovingViews frames(3);
    for (const char* name : {"a.mp4", "a.bt", "a.xmt", "a.exr"}) {
        for (const std::size_t i : {0U, 1U}) {
            const TemporaryFolder folder;
            Job job;
            const Bundle was = *frames.frame(i, job);
            ASSERT_TRUE(save(was, folder / name, {}, job)) << name;
            const auto read = open(folder / name, {}, job);
            ASSERT_TRUE(read) << read.error().text();
            EXPECT_EQ(std::get<Bundle>(*read).time, was.time) << name;
            EXPECT_EQ(std::get<Bundle>(*read).duration, was.duration) << name;
        }
    }
}

}  // namespace
}  // namespace stx

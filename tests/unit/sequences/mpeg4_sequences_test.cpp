// Bundles in time as MPEG-4 presentations: MovieTextures, commands, clocks, interpolators.

#include "formats/any/open.hpp"
#include "formats/any/sequences.hpp"
#include "formats/mpeg4/mapping/media_clock.hpp"
#include "formats/mpeg4/mapping/scene_sequence.hpp"
#include "formats/mpeg4/mapping/sequence_write.hpp"
#include "formats/mpeg4/mapping/view_notes.hpp"
#include "formats/mpeg4/scene/interpolators.hpp"
#include "tests/shared_data.hpp"
#include "tests/unit/sequences/moving_views.hpp"

using namespace stx;
using namespace stx::mpeg4;

namespace {

constexpr double kSlack = 1e-6;  ///< seconds

/// The number of its own that a stream's sample holds, and a second.
ElementaryStream streamOf(std::vector<std::uint64_t> times, std::uint32_t duration = 40) {
    ElementaryStream stream;
    for (const std::uint64_t time : times) {
        Sample sample;
        sample.time = time;
        sample.duration = duration;
        stream.samples.push_back(sample);
    }
    return stream;
}

NodePtr movie(bool loop, float speed = 1, double start = 0, double stop = 0) {
    NodePtr node = makeNode("MovieTexture");
    node->set("loop", loop);
    node->set("speed", speed);
    node->set("startTime", start);
    node->set("stopTime", stop);
    return node;
}

std::size_t samplesOf(const Document& document, int descriptor) {
    return document.findObjectDescriptor(descriptor)->streams[0].samples.size();
}

}  // namespace

class SequenceContainers : public testing::TestWithParam<const char*> {};

TEST_P(SequenceContainers, HoldEveryFrame) {
    TemporaryFolder folder("sequences");
    Job job;
    MovingViews frames(5, 12.5);  // not the rate of files that tell none
    const auto target = folder / GetParam();
    auto saved = saveSequence(frames, target, {}, job);
    ASSERT_TRUE(saved) << saved.error().text();
    auto read = openSequence(target, {}, job);
    ASSERT_TRUE(read) << read.error().text();
    const Timeline& line = (*read)->timeline();
    ASSERT_EQ(line.count(), 5u);
    EXPECT_NEAR(line.end, 0.4, 1e-9);
    EXPECT_NEAR(line.rate(), 12.5, 1e-6);
    // In any order.
    for (const std::size_t i : {0u, 4u, 1u, 3u, 2u}) {
        EXPECT_NEAR(line.times[i], 0.08 * static_cast<double>(i), 1e-9);
        const auto is = (*read)->frame(i, job);
        ASSERT_TRUE(is) << is.error().text();
        EXPECT_NEAR(is->time.value_or(-1), line.times[i], 1e-12);
        const auto expected = frames.frame(i, job);
        expectSameFrame(*is, *expected);
    }
}

INSTANTIATE_TEST_SUITE_P(All, SequenceContainers,
                         testing::Values("a.mp4", "a.bt", "a.xmt", "a_%03d.exr"),
                         [](const auto& kind) {
                             return std::string("number") + std::to_string(kind.index);
                         });

TEST(Mpeg4Sequences, OnlyWhatChangesMoves) {
    TemporaryFolder folder("sequences");
    Job job;
    MovingViews frames(5);
    auto spool = PictureSpool::create(folder.path());
    ASSERT_TRUE(spool);
    const auto document = sceneFromSequence(frames, {}, *spool, job);
    ASSERT_TRUE(document) << document.error().text();
    EXPECT_EQ(samplesOf(*document, 2), 5u);  // colour of the first view
    EXPECT_EQ(samplesOf(*document, 3), 5u);  // its depth
    EXPECT_EQ(samplesOf(*document, 4), 1u) << "the second view stands still";
    EXPECT_EQ(samplesOf(*document, 5), 1u);
    // The first scene and four replacements of the second view.
    ASSERT_EQ(document->frames.size(), 5u);
    for (std::size_t i = 1; i < 5; ++i) EXPECT_EQ(document->frames[i].commands.size(), 1u);
}

TEST(Mpeg4Sequences, ReplacedNodesKeepTheirId) {
    TemporaryFolder folder("sequences");
    Job job;
    MovingViews frames(3);
    const auto target = folder / "a.mp4";
    ASSERT_TRUE(saveSequence(frames, target, {}, job));
    const auto document = readMpeg4(target, job);
    ASSERT_TRUE(document);
    std::set<std::uint32_t> ids;
    for (const CommandFrame& frame : document->frames)
        for (const Command& command : frame.commands)
            if (const auto* replace = std::get_if<ReplaceNode>(&command)) {
                ids.insert(replace->target->defId);
                ids.insert(replace->replacement->defId);
            }
    EXPECT_EQ(ids.size(), 1u);
}

TEST(Mpeg4Sequences, ThroughATextIsTheSameFile) {
    for (const char* text : {"a.bt", "a.xmt"}) {
        TemporaryFolder folder("sequences");
        Job job;
        MovingViews frames(4);
        ASSERT_TRUE(saveSequence(frames, folder / "a.mp4", {}, job));
        auto document = readMpeg4(folder / "a.mp4", job);
        ASSERT_TRUE(document);
        ASSERT_TRUE(writeMpeg4(*document, folder / text, job));
        document = readMpeg4(folder / text, job);
        ASSERT_TRUE(document) << document.error().text();
        ASSERT_TRUE(writeMpeg4(*document, folder / "b.mp4", job));
        EXPECT_EQ(*readFile(folder / "a.mp4", job.limits), *readFile(folder / "b.mp4", job.limits))
            << text;
    }
}

TEST(Mpeg4Sequences, NothingStaysBesideTheTarget) {
    TemporaryFolder folder("sequences");
    Job job;
    MovingViews frames(4);
    ASSERT_TRUE(saveSequence(frames, folder / "a.mp4", {}, job));
    const auto count = std::distance(std::filesystem::directory_iterator(folder.path()), {});
    EXPECT_EQ(count, 1);
}

TEST(Mpeg4Sequences, WhatCannotMoveIsSaid) {
    class Grows : public MovingViews {
      public:
        using MovingViews::MovingViews;
        Result<Bundle> frame(std::size_t index, Job& job) override {
            auto bundle = MovingViews::frame(index, job);
            if (index == 2) bundle->views[1] = makeView(32, 16, 16, 2);
            return bundle;
        }
    };
    TemporaryFolder folder("sequences");
    Job job;
    Grows frames(4);
    const auto saved = saveSequence(frames, folder / "a.mp4", {}, job);
    ASSERT_FALSE(saved);
    EXPECT_EQ(saved.error().code, ErrorCode::unsupported);
    EXPECT_NE(saved.error().text().find("frame 2 (0.08 s)"), std::string::npos);
    EXPECT_NE(saved.error().text().find("write .exr"), std::string::npos) << saved.error().text();
    EXPECT_NE(saved.error().text().find("32x16"), std::string::npos) << saved.error().text();
    EXPECT_FALSE(std::filesystem::exists(folder / "a.mp4"));

    MovingViews fine(4);
    SaveOptions points;
    points.pointTexture = true;
    const auto asPoints = saveSequence(fine, folder / "a.mp4", points, job);
    ASSERT_FALSE(asPoints);
    EXPECT_EQ(asPoints.error().code, ErrorCode::unsupported);
    const auto one = saveSequence(fine, folder / "a.exr", {}, job);
    ASSERT_FALSE(one);
    EXPECT_EQ(one.error().code, ErrorCode::usage);
}

TEST(ExrSequences, FilesOfAFilmHaveTheSameViews) {
    class Shrinks : public MovingViews {
      public:
        using MovingViews::MovingViews;
        Result<Bundle> frame(std::size_t index, Job& job) override {
            auto bundle = MovingViews::frame(index, job);
            if (index == 2) bundle->views.pop_back();
            return bundle;
        }
    };
    TemporaryFolder folder("sequences");
    Job job;
    Shrinks frames(4);
    const auto saved = saveSequence(frames, folder / "a_%03d.exr", {}, job);
    ASSERT_FALSE(saved);
    EXPECT_EQ(saved.error().code, ErrorCode::invalidInput);
    EXPECT_EQ(saved.error().text(),
              "frame 2 (0.08 s): 1 view at 0.08 s, but 2 at the start; the files of a film have "
              "the same views; stx render and stx extract take one whose views change");
    EXPECT_FALSE(std::filesystem::exists(folder / "a_000.exr"));
}

namespace {

/// Two frames at times of its own.
class FarApart : public MovingViews {
  public:
    FarApart(double second, double duration) : MovingViews(2) {
        timeline_.times = {0, second};
        timeline_.end = duration;
    }
};

}  // namespace

TEST(Mpeg4Sequences, ALastPictureStaysAsLongAsASampleCan) {
    TemporaryFolder folder("sequences");
    Job job;
    FarApart frames(1, 1e7);  // ten thousand million milliseconds
    auto spool = PictureSpool::create(folder.path());
    ASSERT_TRUE(spool);
    const auto document = sceneFromSequence(frames, {}, *spool, job);
    ASSERT_TRUE(document) << document.error().text();
    EXPECT_EQ(document->findObjectDescriptor(2)->streams[0].samples.back().duration, 0xFFFFFFFFu);
}

namespace {

/// The first frame of the moving views, again and again; from the second on its camera may be
/// elsewhere.
class RepeatedViews : public MovingViews {
  public:
    RepeatedViews(Timeline line, bool cameraMoves)
        : MovingViews(std::move(line)), cameraMoves_(cameraMoves) {}
    Result<Bundle> frame(std::size_t index, Job& job) override {
        STX_TRY(auto bundle, MovingViews::frame(0, job));
        if (cameraMoves_ && index > 0) bundle.views[1].camera.position.x += 1;
        setTime(bundle, index);
        return bundle;
    }

  private:
    bool cameraMoves_;
};

Timeline endingAt(std::vector<double> times, double end) {
    Timeline line;
    line.times = std::move(times);
    line.end = end;
    line.findTick();
    return line;
}

}  // namespace

TEST(Mpeg4Sequences, TheEndOfAFilmIsKept) {
    TemporaryFolder folder("ends");
    const auto endOf = [&](Sequence& frames, const char* name) {
        Job job;
        const auto saved = saveSequence(frames, folder / name, {}, job);
        EXPECT_TRUE(saved) << saved.error().text();
        const auto read = openSequence(folder / name, {}, job);
        EXPECT_TRUE(read) << read.error().text();
        return read ? (*read)->timeline().end : -1;
    };
    for (const char* name : {"a.mp4", "a.bt", "a.xmt"}) {
        RepeatedViews still(steadyTimeline(5, 10), false);
        EXPECT_NEAR(endOf(still, name), 0.5, 1e-9) << name;
        RepeatedViews moved(steadyTimeline(10, 10), true);
        EXPECT_NEAR(endOf(moved, name), 1.0, 1e-9) << name;
        RepeatedViews late(stx::moved(steadyTimeline(10, 10), 1.5e9), true);
        EXPECT_NEAR(endOf(late, name), 1.5e9 + 1, 1e-6) << name;
        // More ticks than a sample can last.
        MovingViews longer(endingAt({0, 1.000001}, 8001.000001), false);
        EXPECT_NEAR(endOf(longer, name), 8001.000001, 1e-6) << name;
    }
}

TEST(Mpeg4Sequences, AMomentKeepsHowLongItIsShown) {
    TemporaryFolder folder("moments");
    Job job;
    MovingViews moment(endingAt({3}, 10.25));
    ASSERT_TRUE(saveSequence(moment, folder / "a.mp4", {}, job));
    for (const char* name : {"b.mp4", "c.bt", "d.exr"}) {
        const auto read = openSequence(folder / "a.mp4", {}, job);
        ASSERT_TRUE(read) << read.error().text();
        EXPECT_EQ((*read)->timeline().times, std::vector<double>{3});
        EXPECT_EQ((*read)->timeline().end, 10.25);
        ASSERT_TRUE(saveSequence(**read, folder / name, {}, job));
        const auto again = openBundle(folder / name, {}, job);
        ASSERT_TRUE(again) << again.error().text();
        EXPECT_EQ(again->time, 3.0) << name;
        EXPECT_EQ(again->duration, 7.25) << name;
    }
}

TEST(Mpeg4Sequences, TheNoteIsThereWhereTheEndWouldBeLost) {
    TemporaryFolder folder("duration_notes");
    auto spool = PictureSpool::create(folder.path());
    ASSERT_TRUE(spool);
    const auto duration = [&](Sequence& frames) {
        Job job;
        const auto document = sceneFromSequence(frames, {}, *spool, job);
        EXPECT_TRUE(document) << document.error().text();
        const auto& root = std::get<ReplaceScene>(document->frames[0].commands[0]).root;
        const auto& info = root->get<NodeList>("children")[0];
        return ViewNotes::parse(info->get<std::vector<std::string>>("info")).duration;
    };
    MovingViews moving(5);
    EXPECT_EQ(duration(moving), std::nullopt);
    RepeatedViews repeated(steadyTimeline(5, 10), true);
    EXPECT_EQ(duration(repeated), 0.5);
    // The first frame of a film is not shown for all of it.
    Job job;
    const auto document = sceneFromSequence(repeated, {}, *spool, job);
    const auto start = bundleFromScene(*document, {}, job);
    ASSERT_TRUE(start) << start.error().text();
    EXPECT_EQ(start->duration, std::nullopt);
}

TEST(ExrSequences, TimesThatHaveNoEndAreRefused) {
    TemporaryFolder folder("sequences");
    Job job;
    FarApart frames(1e308, 1e308);  // the last lasts as long as the one before
    ASSERT_TRUE(saveSequence(frames, folder / "a_%03d.exr", {}, job));
    const auto read = openSequence(folder / "a_%03d.exr", {}, job);
    ASSERT_FALSE(read);
    EXPECT_EQ(read.error().code, ErrorCode::invalidInput);
    EXPECT_NE(read.error().text().find("a_%03d.exr"), std::string::npos) << read.error().text();
}

TEST(MediaClock, FollowsCompositionTimesAndEdits) {
    // Decoding order is not the order of showing.
    ElementaryStream stream = streamOf({0, 40, 80});
    stream.samples[0].compositionOffset = 40;
    stream.samples[1].compositionOffset = 80;
    stream.samples[2].compositionOffset = 0;
    Presentation shown = presentationOf(stream);
    ASSERT_EQ(shown.shown.size(), 3u);
    EXPECT_EQ(shown.sampleAt(0.04, kSlack), 0u);
    EXPECT_EQ(shown.sampleAt(0.08, kSlack), 2u);
    EXPECT_EQ(shown.sampleAt(0.12, kSlack), 1u);
    EXPECT_NEAR(shown.duration, 0.16, 1e-9);
    // The edit list of the fixtures takes the delay away again.
    stream.edits = {1000, {{120, 40, 0x10000}}};
    shown = presentationOf(stream);
    EXPECT_EQ(shown.sampleAt(0, kSlack), 0u);
    EXPECT_EQ(shown.sampleAt(0.04, kSlack), 2u);
    EXPECT_EQ(shown.sampleAt(0.08, kSlack), 1u);
    EXPECT_NEAR(shown.duration, 0.12, 1e-9);
    // An empty edit first: the first picture stands there already.
    stream.edits = {1000, {{500, -1, 0x10000}, {120, 40, 0x10000}}};
    shown = presentationOf(stream);
    EXPECT_EQ(shown.sampleAt(0.1, kSlack), 0u);
    EXPECT_EQ(shown.sampleAt(0.54, kSlack), 2u);
}

TEST(MediaClock, ADelayIsOneOfTheEditsToo) {
    // A text's startTime before an .mp4 with B pictures.
    ElementaryStream stream = streamOf({1000, 1040, 1080});
    stream.samples[0].compositionOffset = 40;
    stream.samples[1].compositionOffset = 80;
    stream.edits = {1000, {{120, 40, 0x10000}}};
    const Presentation shown = presentationOf(stream);
    ASSERT_EQ(shown.shown.size(), 3u);
    EXPECT_EQ(shown.sampleAt(1.0, kSlack), 0u);
    EXPECT_EQ(shown.sampleAt(1.04, kSlack), 2u);
    EXPECT_EQ(shown.sampleAt(1.08, kSlack), 1u);
    EXPECT_NEAR(shown.duration, 1.12, 1e-9);
}

TEST(MediaClock, ALastEditWithoutADurationIsTheRest) {
    // ISO/IEC 14496-12, 8.6.6.
    ElementaryStream stream = streamOf({0, 40, 80, 120});
    stream.edits = {1000, {{0, 80, 0x10000}}};
    Presentation shown = presentationOf(stream);
    ASSERT_EQ(shown.shown.size(), 2u);
    EXPECT_EQ(shown.sampleAt(0, kSlack), 2u);
    EXPECT_EQ(shown.sampleAt(0.04, kSlack), 3u);
    EXPECT_NEAR(shown.duration, 0.08, 1e-9);
    // Behind a delay, and behind another edit.
    stream.edits = {1000, {{100, -1, 0x10000}, {40, 0, 0x10000}, {0, 120, 0x10000}}};
    shown = presentationOf(stream);
    ASSERT_EQ(shown.shown.size(), 2u);
    EXPECT_EQ(shown.sampleAt(0.1, kSlack), 0u);
    EXPECT_EQ(shown.sampleAt(0.14, kSlack), 3u);
    EXPECT_NEAR(shown.duration, 0.18, 1e-9);
}

TEST(MediaClock, ShortListsDoNotBecomeLongOnes) {
    // Each edit shows all pictures again: nine million of 3000 edits.
    ElementaryStream stream;
    for (std::uint64_t i = 0; i < 3000; ++i) {
        stream.samples.push_back({});
        stream.samples.back().time = i;
        stream.samples.back().duration = 1;
    }
    stream.edits = {1000, std::vector<Edit>(3000, {3000, 0, 0x10000})};
    EXPECT_EQ(presentationOf(stream).shown.size(), 3000u);
    stream.edits.edits.resize(3);
    EXPECT_EQ(presentationOf(stream).shown.size(), 9000u);
}

TEST(MediaClock, TimesThatNoClockCountsAreItsLast) {
    EXPECT_EQ(ticksAt(0.0404, 1000), 40u);
    EXPECT_EQ(ticksAt(-1, 1000), 0u);
    EXPECT_EQ(ticksAt(std::nan(""), 1000), 0u);
    EXPECT_EQ(ticksAt(1e300, 1000), ~std::uint64_t{0});
}

TEST(MediaClock, RunsAsMovieTexturesDo) {
    // 14772-1, 6.28.
    EXPECT_DOUBLE_EQ(mediaTimeOf(*movie(false), 2, 0.5, kSlack), 0.5);
    EXPECT_DOUBLE_EQ(mediaTimeOf(*movie(false), 2, 7, kSlack), 2) << "holds its last picture";
    EXPECT_NEAR(mediaTimeOf(*movie(true), 2, 7, kSlack), 1, 1e-5);
    EXPECT_NEAR(mediaTimeOf(*movie(true, 2), 2, 1.25, kSlack), 0.5, 1e-5);
    EXPECT_DOUBLE_EQ(mediaTimeOf(*movie(false, 1, 3), 2, 1, kSlack), 0) << "has not begun";
    EXPECT_DOUBLE_EQ(mediaTimeOf(*movie(false, 1, 3), 2, 4, kSlack), 1);
    EXPECT_DOUBLE_EQ(mediaTimeOf(*movie(true, 1, 1, 2.5), 4, 9, kSlack), 1.5) << "stopped";
    EXPECT_DOUBLE_EQ(mediaTimeOf(*movie(true, 1, 3, 2), 4, 4, kSlack), 1)
        << "stopTime before the start";
    EXPECT_DOUBLE_EQ(mediaTimeOf(*movie(false, -1), 2, 0.5, kSlack), 1.5);
    EXPECT_DOUBLE_EQ(mediaTimeOf(*movie(false, -1, 3), 2, 0, kSlack), 2)
        << "backwards: the last picture";
    EXPECT_DOUBLE_EQ(mediaTimeOf(*movie(true, 0), 2, 0.5, kSlack), 0);
}

TEST(Interpolators, MoveWhatRoutesReach) {
    Scene scene;
    NodePtr clock = makeNode("TimeSensor");
    clock->set("cycleInterval", 2.0);
    clock->set("startTime", 1.0);
    NodePtr positions = makeNode("PositionInterpolator");
    positions->set("key", std::vector<float>{0, 0.5f, 1});
    positions->set("keyValue", std::vector<glm::vec3>{{0, 0, 0}, {4, 0, 0}, {4, 8, 0}});
    NodePtr turns = makeNode("OrientationInterpolator");
    turns->set("key", std::vector<float>{0, 1});
    // The shorter way from 350 to 10 degrees is over 0.
    turns->set("keyValue", std::vector<Rotation>{{{0, 1, 0}, glm::radians(350.0f)},
                                                 {{0, 1, 0}, glm::radians(10.0f)}});
    NodePtr place = makeNode("Transform");
    scene.root = place;
    const auto route = [&](const NodePtr& from, const char* out, const NodePtr& to,
                           const char* in) {
        scene.routes.push_back({0, "", from, from->info->find(out), to, to->info->find(in)});
    };
    route(clock, "fraction_changed", positions, "set_fraction");
    route(clock, "fraction_changed", turns, "set_fraction");
    route(positions, "value_changed", place, "translation");
    route(turns, "value_changed", place, "rotation");
    // A circle of routes ends.
    route(place, "translation", place, "translation");

    applyInterpolators(scene, 0.5);
    EXPECT_EQ(place->get<glm::vec3>("translation"), glm::vec3(0)) << "the clock has not begun";
    applyInterpolators(scene, 1.5);
    EXPECT_NEAR(place->get<glm::vec3>("translation").x, 2, 1e-5);
    applyInterpolators(scene, 2.5);
    EXPECT_NEAR(place->get<glm::vec3>("translation").y, 4, 1e-5);
    applyInterpolators(scene, 2.0);
    EXPECT_NEAR(
        std::abs(std::remainder(place->get<Rotation>("rotation").angle, glm::radians(360.0f))), 0,
        1e-4);
    applyInterpolators(scene, 9);
    EXPECT_NEAR(place->get<glm::vec3>("translation").y, 8, 1e-5) << "its end stays";

    clock->set("loop", true);
    applyInterpolators(scene, 1 + 2 * 3 + 0.5);
    EXPECT_NEAR(place->get<glm::vec3>("translation").x, 2, 1e-5);
}

namespace {

/// A scene whose clocks, `count` of them, run for `seconds` each, one after the other.
Document clocksOf(int count, double seconds, bool loop = true) {
    NodePtr group = makeNode("Group");
    ReplaceScene scene;
    scene.root = group;
    NodePtr scalar = makeNode("ScalarInterpolator");
    for (int i = 0; i < count; ++i) {
        NodePtr clock = makeNode("TimeSensor");
        clock->set("cycleInterval", seconds);
        clock->set("startTime", i * seconds);
        clock->set("loop", loop);
        group->edit<NodeList>("children").push_back(clock);
        scene.routes.push_back({0, "", clock, clock->info->find("fraction_changed"), scalar,
                                scalar->info->find("set_fraction")});
    }
    Document document;
    document.frames.push_back({0, {Command(std::move(scene))}});
    return document;
}

/// A view of one point, at the origin.
NodePtr viewOfPoint() {
    PixelImage grey;
    grey.width = grey.height = grey.components = 1;
    grey.pixels = {200};
    const NodePtr depth = makeNode("PixelTexture"), texture = makeNode("SimpleTexture"),
                  view = makeNode("DepthImage");
    depth->set("image", grey);
    texture->set("depth", depth);
    view->set("diTexture", texture);
    view->set("orthographic", false);
    view->set("position", glm::vec3(0));
    return view;
}

}  // namespace

TEST(Mpeg4Sequences, ClocksHaveNoMoreMomentsTogether) {
    Job job;
    const auto some = sequenceFromScene(clocksOf(2, 100), {}, job);
    ASSERT_TRUE(some) << some.error().text();
    EXPECT_EQ((*some)->timeline().count(), 5000u);
    // 2.5 million each.
    const auto many = sequenceFromScene(clocksOf(2, 100'000), {}, job);
    ASSERT_FALSE(many);
    EXPECT_EQ(many.error().code, ErrorCode::unsupported);
    EXPECT_NE(many.error().text().find("more than 4000000 moments"), std::string::npos)
        << many.error().text();
}

TEST(Mpeg4Sequences, MomentsBeyondAllClocksAreLeftOut) {
    Document document = clocksOf(1, 0.2);
    document.sceneStream.timescale = 1;
    document.frames.push_back({~std::uint64_t{0}, {}});
    Job job;
    const auto sequence = sequenceFromScene(document, {}, job);
    ASSERT_TRUE(sequence) << sequence.error().text();
    EXPECT_EQ((*sequence)->timeline().count(), 5u);
    EXPECT_NEAR((*sequence)->timeline().end, 0.2, 1e-9);
}

TEST(Mpeg4Sequences, AClockThatStopsHasAMomentAtItsEnd) {
    // 0.3 s are seven and a half pictures: the end is that of the next, so that all last equally
    // long. 0.28 * 25 is a little above 7 in doubles.
    for (const auto& [seconds, last, count] :
         {std::tuple(2.0, 2.0, 51u), {0.3, 0.32, 9u}, {0.28, 0.28, 8u}}) {
        Document document = clocksOf(1, seconds, false);
        auto& scene = std::get<ReplaceScene>(document.frames[0].commands[0]);
        const NodePtr place = makeNode("Transform"), scalar = makeNode("PositionInterpolator");
        scalar->set("key", std::vector<float>{0, 1});
        scalar->set("keyValue", std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}});
        scene.routes[0].to = scalar;
        scene.routes[0].toField = scalar->info->find("set_fraction");
        scene.routes.push_back({0, "", scalar, scalar->info->find("value_changed"), place,
                                place->info->find("translation")});
        place->set("children", NodeList{viewOfPoint()});
        scene.root->edit<NodeList>("children").push_back(place);
        Job job;
        const auto sequence = sequenceFromScene(document, {}, job);
        ASSERT_TRUE(sequence) << sequence.error().text();
        const Timeline& line = (*sequence)->timeline();
        EXPECT_EQ(line.count(), count) << seconds;
        EXPECT_NEAR(line.times.back(), last, 1e-9);
        EXPECT_NEAR(line.rate(), 25, 1e-6) << seconds;
        const auto frame = (*sequence)->frame(line.count() - 1, job);
        ASSERT_TRUE(frame) << frame.error().text();
        EXPECT_EQ(frame->views.at(0).camera.position.x, 1) << seconds;
    }
}

TEST(Mpeg4Sequences, AReferenceFileMovesAsItsTextSays) {
    REQUIRE_SHARED(file, "reference/motion/imgseq.mp4");
    Job job;
    auto read = openSequence(file, {}, job);
    ASSERT_TRUE(read) << read.error().text();
    const Timeline& line = (*read)->timeline();
    EXPECT_EQ(line.count(), 10u);
    EXPECT_NEAR(line.rate(), 25, 1e-6);
    EXPECT_NEAR(line.end, 0.4, 1e-9);
    // anim.bt: a PositionInterpolator moves 0 .. 1 along x in 0.4 s; at 0.2 s the Transform is
    // turned by 0.25 about y and the DepthImage moves to y 0.25.
    for (std::size_t i = 0; i < line.count(); ++i) {
        const auto frame = (*read)->frame(i, job);
        ASSERT_TRUE(frame) << frame.error().text();
        ASSERT_EQ(frame->views.size(), 1u);
        const Camera& c = frame->views[0].camera;
        const double moved = line.times[i] / 0.4;
        const bool later = line.times[i] >= 0.2 - 1e-9;
        EXPECT_NEAR(c.position.y, later ? 0.25 : 0.0, 1e-6) << i;
        EXPECT_NEAR(c.position.x, moved + (later ? 3 * std::sin(0.25) : 0.0), 1e-5) << i;
    }
}

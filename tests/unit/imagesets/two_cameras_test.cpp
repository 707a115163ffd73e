// Colour and depth from two cameras side by side: the depth is taken into the picture.

#include <algorithm>
#include <cmath>

#include "lib/metrics/compare.hpp"
#include "lib/registration/camera_moves.hpp"
#include "lib/render/factory.hpp"
#include "tests/shared_data.hpp"
#include "tests/unit/imagesets/set_writer.hpp"

using namespace stx;
using namespace sets;

namespace {

constexpr int kRoomWidth = 160, kRoomHeight = 120;
constexpr double kStep = 0.001;

/// A point of the depth camera is kTurn * p + kShift in the colour camera, y down, z forward.
const glm::dmat3 kTurn = glm::mat3_cast(quatFromAxisAngle({0.2, 1.0, 0.1, 0.02}));
const glm::dvec3 kShift(-0.06, 0.004, 0.003);

/// A recording of the room: the colour camera's view, and the depth of another camera.
struct Recording {
    ReferenceView colour, depth;
};

Recording recorded(int depthWidth = kRoomWidth, int depthHeight = kRoomHeight) {
    const Camera camera =
        analyticCamera(AnalyticScene::room, 1, 4).resized(kRoomWidth, kRoomHeight);
    Camera other = camera.resized(depthWidth, depthHeight);
    other.fx *= 1.1;
    other.fy *= 1.12;
    other.cx += 2.5;
    // Between our axes and computer vision's y and z change their signs.
    const glm::dmat3 flip(1, 0, 0, 0, -1, 0, 0, 0, -1);
    const glm::dmat3 r = glm::mat3_cast(camera.orientation) * flip;
    other.position = camera.position + r * kShift;
    other.orientation = glm::normalize(glm::quat_cast(r * kTurn * flip));
    Recording out{viewOfAnalyticScene(AnalyticScene::room, camera, 1),
                  viewOfAnalyticScene(AnalyticScene::room, other, 1)};
    return out;
}

std::string numbers(const Camera& c) {
    return fmt::format("{} {} {} {}\n", c.fx, c.fy, c.cx - 0.5, c.cy - 0.5);
}
std::string poseOf(const Camera& c) {
    const glm::dmat3 r = visionRotation(c);
    std::string text;
    for (int row = 0; row < 3; ++row)
        text += fmt::format("{} {} {} {}\n", r[0][row], r[1][row], r[2][row], c.position[row]);
    return text + "0 0 0 1\n";
}
std::string motion() {
    std::string text = "# rows of R t\n";
    for (int row = 0; row < 3; ++row)
        text +=
            fmt::format("{} {} {} {}\n", kTurn[0][row], kTurn[1][row], kTurn[2][row], kShift[row]);
    return text;
}
void writeDepth(const std::filesystem::path& file, const ReferenceView& view, double step) {
    writeCodes(file, view.depth.width(), view.depth.height(), 16, [&](int x, int y) {
        const float d = view.depth.at(x, y);
        return hasPoint(d) ? std::lround(d / step) : 0L;
    });
}

ImageSetOptions optionsOf(const Recording& r, const std::filesystem::path& folder) {
    ImageSetOptions options;
    options.refine.set(RefineStep::mixed, false);
    const Camera &c = r.colour.camera, &d = r.depth.camera;
    const double k[4] = {c.fx, c.fy, c.cx - 0.5, c.cy - 0.5};
    std::copy(k, k + 4, options.intrinsics);
    options.depthIntrinsics = glm::dvec4(d.fx, d.fy, d.cx - 0.5, d.cy - 0.5);
    options.depthToColour = (folder / "motion.txt").string();
    return options;
}

/// Pixels whose depth is not that of the picture's own camera, as a share of those that have one.
double offShare(const Recording& r, const ReferenceView& read) {
    int known = 0, off = 0;
    for (int y = 0; y < kRoomHeight; ++y)
        for (int x = 0; x < kRoomWidth; ++x) {
            const float d = read.depth.at(x, y), truth = r.colour.depth.at(x, y);
            if (!hasPoint(d) || !hasPoint(truth)) continue;
            ++known;
            off += std::abs(d - truth) > 0.01f * truth;
        }
    std::printf("  %d of %d pixels have depth, %d are off\n", known, kRoomWidth * kRoomHeight, off);
    // The border that the depth camera does not see, and what is hidden from it.
    EXPECT_GT(known, kRoomWidth * kRoomHeight * 3 / 4);
    return static_cast<double>(off) / known;
}

/// The depth lies where the picture's own camera would have it, but at outlines, whose pixels go to
/// one side or the other.
void expectTaken(const Recording& r, const ReferenceView& read, double share = 0.012) {
    EXPECT_EQ(read.noDepth, NoDepth::unknown);
    ASSERT_EQ(read.depth.size(), r.colour.depth.size());
    EXPECT_LT(glm::length(read.camera.position - r.colour.camera.position), 1e-9);
    EXPECT_GT(std::abs(glm::dot(read.camera.orientation, r.colour.camera.orientation)), 1 - 1e-12);
    EXPECT_LT(offShare(r, read), share);
}

void writeSevenScenes(const std::filesystem::path& folder, const Recording& r) {
    writeColour(folder / "frame-000000.color.png", r.colour);
    writeDepth(folder / "frame-000000.depth.png", r.depth, kStep);
    // 7-Scenes' poses are those of the depth camera.
    writeText(folder / "frame-000000.pose.txt", poseOf(r.depth.camera));
    writeText(folder / "motion.txt", motion());
}

TEST(TwoCameras, DepthIsTakenIntoThePicture) {
    const Recording r = recorded();
    const TemporaryFolder folder;
    writeSevenScenes(folder.path(), r);
    const auto read = readSet(folder.path(), optionsOf(r, folder.path()));
    ASSERT_TRUE(read) << read.error().text();
    expectTaken(r, read->views[0]);
    // The test would see it otherwise.
    ImageSetOptions asOne = optionsOf(r, folder.path());
    asOne.depthIntrinsics.reset();
    asOne.depthToColour = "none";
    const auto one = readSet(folder.path(), asOne);
    ASSERT_TRUE(one) << one.error().text();
    EXPECT_GT(offShare(r, one->views[0]), 0.1);
}

/// A recording in TUM's layout.
void writeTum(const std::filesystem::path& folder, const Recording& r) {
    writeColour(folder / "rgb/1.png", r.colour);
    writeDepth(folder / "depth/1.png", r.depth, 1.0 / 5000);
    writeText(folder / "rgb.txt", "1 rgb/1.png\n");
    writeText(folder / "depth.txt", "1 depth/1.png\n");
    const glm::dquat q = glm::quat_cast(visionRotation(r.colour.camera));
    const glm::dvec3 c = r.colour.camera.position;
    writeText(folder / "groundtruth.txt",
              fmt::format("1 {} {} {} {} {} {} {}\n", c.x, c.y, c.z, q.x, q.y, q.z, q.w));
    writeText(folder / "intrinsics.txt", numbers(r.colour.camera));
    writeText(folder / "motion.txt", motion());
}

TEST(TwoCameras, OfTumTheColoursPoseIsGiven) {
    const Recording r = recorded();
    const TemporaryFolder folder;
    writeTum(folder.path(), r);
    ImageSetOptions options = optionsOf(r, folder.path());
    options.intrinsics[0] = 0;
    const auto read = readSet(folder.path(), options);
    ASSERT_TRUE(read) << read.error().text();
    expectTaken(r, read->views[0]);
}

TEST(TwoCameras, SizesAndShapesMayDiffer) {
    const Recording r = recorded(200, 120);
    const TemporaryFolder folder;
    writeSevenScenes(folder.path(), r);
    const auto read = readSet(folder.path(), optionsOf(r, folder.path()));
    ASSERT_TRUE(read) << read.error().text();
    expectTaken(r, read->views[0]);
}

/// Depth with fewer pixels is raised along the picture's edges: as well as depth of that size that
/// the colour camera itself took.
TEST(TwoCameras, FewPixelsAreRaised) {
    const Recording r = recorded(80, 80);
    const TemporaryFolder folder;
    writeSevenScenes(folder.path(), r);
    const auto read = readSet(folder.path(), optionsOf(r, folder.path()));
    ASSERT_TRUE(read) << read.error().text();
    Recording own = r;
    own.depth = viewOfAnalyticScene(AnalyticScene::room, r.colour.camera.resized(80, 60), 1);
    const TemporaryFolder aligned;
    writeSevenScenes(aligned.path(), own);
    ImageSetOptions options = optionsOf(own, aligned.path());
    options.depthIntrinsics.reset();
    options.depthToColour = "none";
    const auto same = readSet(aligned.path(), options);
    ASSERT_TRUE(same) << same.error().text();
    expectTaken(r, read->views[0], 1.2 * offShare(r, same->views[0]));
}

TEST(TwoCameras, WrongNumbersAreErrors) {
    const Recording r = recorded();
    const TemporaryFolder folder;
    writeSevenScenes(folder.path(), r);
    ImageSetOptions options = optionsOf(r, folder.path());
    options.depthIntrinsics = glm::dvec4(0, 585, 320, 240);
    auto read = readSet(folder.path(), options);
    expectError(read, {"focal lengths", "0 and 585", "above 0"});
    EXPECT_EQ(read.error().code, ErrorCode::usage);
    options = optionsOf(r, folder.path());
    options.depthToColour = "none";
    read = readSet(folder.path(), options);
    expectError(read, {"--depth-to-colour none", "--depth-intrinsics"});
    EXPECT_EQ(read.error().code, ErrorCode::usage);
    options = optionsOf(r, folder.path());
    writeText(folder / "motion.txt", "1 0 0\n0 1 0\n0 0 1\n");
    expectError(readSet(folder.path(), options), {"motion.txt", "9 numbers", "3 or 4 rows of 4"});
    writeText(folder / "motion.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 1 1\n");
    expectError(readSet(folder.path(), options), {"motion.txt", "0 0 1 1", "0 0 0 1"});
    writeText(folder / "motion.txt", "2 0 0 0\n0 1 0 0\n0 0 1 0\n");
    expectError(readSet(folder.path(), options), {"motion.txt", "scales or shears"});
    writeText(folder / "motion.txt", "1 0 0 50\n0 1 0 0\n0 0 1 0\n");
    expectError(readSet(folder.path(), options), {"nothing of it is in the picture"});
}

/// The notes of a set that must be read.
std::string notesOf(const std::filesystem::path& set, const ImageSetOptions& options) {
    Job job;
    const auto read = readImageSet(set, options, job);
    EXPECT_TRUE(read) << read.error().text();
    std::string all;
    for (const std::string& note : job.takeNotes()) all += note + "\n";
    return all;
}
void expectSaid(const std::string& notes, const char* text) {
    EXPECT_NE(notes.find(text), std::string::npos) << text << " is missing in: " << notes;
}

/// The half that is not given is assumed aloud, where it can be assumed.
TEST(TwoCameras, HalfOfADepthCameraIsToldOrRefused) {
    const Recording r = recorded();
    const TemporaryFolder folder;
    writeTum(folder.path(), r);
    ImageSetOptions both = optionsOf(r, folder.path());
    both.intrinsics[0] = 0;
    const std::string said = notesOf(folder.path(), both);
    expectSaid(said, "depth comes from a camera of its own (f ");
    EXPECT_EQ(said.find("is taken to be"), std::string::npos) << said;
    ImageSetOptions pose = both;
    pose.depthIntrinsics.reset();
    expectSaid(notesOf(folder.path(), pose),
               "the depth camera's intrinsics are taken to be the colour camera's");
    ImageSetOptions lens = both;
    lens.depthToColour.clear();
    expectSaid(notesOf(folder.path(), lens),
               "the depth camera is taken to be at the colour camera's place");
    const TemporaryFolder other;
    writeTum(other.path(), recorded(80, 60));
    pose.depthToColour = (other / "motion.txt").string();
    const auto read = readSet(other.path(), pose);
    expectError(read, {"--depth-to-colour", "--depth-intrinsics", "80x60", "160x120"});
    EXPECT_EQ(read.error().code, ErrorCode::usage);
}

/// Another colour camera is one of another device, whose depth camera nobody knows.
TEST(TwoCameras, OwnIntrinsicsOf7ScenesLeaveTheKnownDepthCameraAloud) {
    const Recording r = recorded();
    const TemporaryFolder folder;
    writeSevenScenes(folder.path(), r);
    ImageSetOptions options = optionsOf(r, folder.path());
    options.depthIntrinsics.reset();
    options.depthToColour.clear();
    const char* left = "depth is taken to lie on the pixels of its picture";
    expectSaid(notesOf(folder.path(), options), left);
    options.depthToColour = "none";
    EXPECT_EQ(notesOf(folder.path(), options).find(left), std::string::npos);
}

TEST(TwoCameras, IntrinsicsOf7ScenesThatAreTheKnownOnesChangeNothing) {
    REQUIRE_SHARED(set, "data/imagesets/7scenes-kitchen");
    const TemporaryFolder folder;
    for (const char* file : {".color.png", ".depth.png", ".pose.txt"})
        std::filesystem::copy_file(set / (std::string("frame-000186") + file),
                                   folder / (std::string("frame-000186") + file));
    const auto as = readSet(folder.path());
    ImageSetOptions same;
    const double k[4] = {525, 525, 319.5, 239.5};  // what the note of the set itself names
    std::copy(k, k + 4, same.intrinsics);
    expectSaid(notesOf(folder.path(), {}), "fx 525, fy 525, cx 319.5, cy 239.5");
    const auto given = readSet(folder.path(), same);
    ASSERT_TRUE(as && given);
    EXPECT_TRUE(std::ranges::equal(as->views[0].depth.pixels(), given->views[0].depth.pixels()));
}

/// A frame of a set drawn from the others, on pixels that both cover.
struct Drawn {
    Rgba8Image picture;
    Image<std::uint8_t> covered;
};

/// A frame that is opaque.
Rgba8Image eightBitsOf(const Frame& frame) {
    Rgba8Image out(frame.colour.width(), frame.colour.height());
    for (std::size_t i = 0; i < out.count(); ++i) {
        out.data()[i] = glm::u8vec4(glm::clamp(frame.colour.data()[i], 0.0f, 1.0f) * 255.0f + 0.5f);
        out.data()[i].a = 255;
    }
    return out;
}

/// The view of that number.
Drawn drawnFromOthers(Bundle bundle, std::size_t which) {
    const Camera to = bundle.views[which].camera;
    bundle.views.erase(bundle.views.begin() + static_cast<std::ptrdiff_t>(which));
    Job job;
    RenderSettings settings;
    settings.fill = Fill::none;
    const auto renderer = makeRenderer(Backend::cpu, bundle, settings, -1, job);
    EXPECT_TRUE(renderer);
    const auto frame = (*renderer)->render(to);
    EXPECT_TRUE(frame);
    Drawn out{eightBitsOf(*frame), Image<std::uint8_t>(to.width, to.height)};
    for (std::size_t i = 0; i < out.covered.count(); ++i)
        out.covered.data()[i] = frame->colour.data()[i].a > 0.999f ? 255 : 0;
    return out;
}

/// Copies frames of 7-Scenes' kitchen.
void copyFrames(const std::filesystem::path& set, const TemporaryFolder& folder,
                std::initializer_list<int> frames) {
    for (const int frame : frames)
        for (const char* file : {".color.png", ".depth.png", ".pose.txt"}) {
            const std::string name = fmt::format("frame-{:06}{}", frame, file);
            std::filesystem::copy_file(set / name, folder / name);
        }
}

/// Its tracker drifted: by 0.6 degrees over the 18 frames that are there. Frames between those that
/// are read, drawn from where they were given.
TEST(SevenScenes, PosesThatDriftedAreAligned) {
    REQUIRE_SHARED(set, "data/imagesets/7scenes-kitchen");
    const TemporaryFolder folder, others;
    copyFrames(set, folder, {180, 186, 192, 198});
    copyFrames(set, others, {183, 189, 195});
    ImageSetOptions asGiven;
    asGiven.refine.set(RefineStep::poses, false);
    const auto aligned = readSet(folder.path()), given = readSet(folder.path(), asGiven),
               truth = readSet(others.path(), asGiven);
    ASSERT_TRUE(aligned && given && truth);
    std::vector<MovedCamera> moved;
    for (const ReferenceView& view : aligned->views) moved.push_back(MovedCamera::of(view));
    double sum = 0;
    for (const ReferenceView& view : truth->views) {
        const auto psnr = [&](const Bundle& bundle, const Camera& camera) {
            Job job;
            const auto renderer = makeRenderer(Backend::cpu, bundle, {}, -1, job);
            EXPECT_TRUE(renderer);
            const auto frame = (*renderer)->render(camera);
            EXPECT_TRUE(frame);
            return *compare(eightBitsOf(*frame), *view.texture.rgba8(), {})->psnrRgb;
        };
        const double now = psnr(*aligned, MovesOfNeighbours(moved).aligned(view.camera)),
                     before = psnr(*given, view.camera);
        std::printf("  %s: %.2f dB of RGB, as given %.2f dB\n", view.name.c_str(), now, before);
        EXPECT_GT(now, before + 0.3);
        sum += now - before;
    }
    EXPECT_GT(sum / 3, 2.0);
}

/// The known calibration of 7-Scenes' Kinect, beside both cameras taken as one.
TEST(TwoCameras, SevenScenesAreDrawnBetter) {
    REQUIRE_SHARED(set, "data/imagesets/7scenes-kitchen");
    const TemporaryFolder folder;
    for (const char* frame : {"frame-000186", "frame-000189", "frame-000192"})
        for (const char* file : {".color.png", ".depth.png", ".pose.txt"})
            std::filesystem::copy_file(set / (std::string(frame) + file),
                                       folder / (std::string(frame) + file));
    const auto two = readSet(folder.path());
    ASSERT_TRUE(two) << two.error().text();
    ImageSetOptions asOne;
    const double k[4] = {585, 585, 319.5, 239.5};
    std::copy(k, k + 4, asOne.intrinsics);
    const auto one = readSet(folder.path(), asOne);
    ASSERT_TRUE(one) << one.error().text();
    const auto file = readFile(set / "frame-000189.color.png", Job().limits);
    ASSERT_TRUE(file);
    const auto truth = decodeRgba8(*file, "truth", Job().limits);
    ASSERT_TRUE(truth);
    Drawn better = drawnFromOthers(*two, 1), before = drawnFromOthers(*one, 1);
    int covered = 0;
    for (std::size_t i = 0; i < better.covered.count(); ++i) {
        better.covered.data()[i] &= before.covered.data()[i];
        covered += better.covered.data()[i] != 0;
    }
    EXPECT_GT(covered, 640 * 480 * 3 / 4);
    CompareSettings settings;
    settings.mask = &better.covered;
    const auto now = compare(better.picture, *truth, settings);
    const auto then = compare(before.picture, *truth, settings);
    ASSERT_TRUE(now && then);
    std::printf("  %.2f dB of RGB, as one camera %.2f dB\n", *now->psnrRgb, *then->psnrRgb);
    // Without the step `agree` and the stage `blend`, which take half a decibel and a quarter of
    // the error back, too: 1.8.
    EXPECT_GE(*now->psnrRgb, *then->psnrRgb + 1.0);
    EXPECT_GE(*now->psnrRgb, 27.0);  // 26.5 if views are not blended
}

}  // namespace

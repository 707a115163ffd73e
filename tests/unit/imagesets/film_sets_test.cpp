// Films as image sets: pairs of colour and depth, and Azure Kinect's recordings.

#include <algorithm>
#include <cmath>
#include <numeric>

#include "formats/imagesets/image_sets.hpp"
#include "tests/ffmpeg.hpp"
#include "tests/shared_data.hpp"
#include "tests/unit/imagesets/set_writer.hpp"

namespace stx {
namespace {

constexpr int kFrames = 8, kWidth = 32, kHeight = 24;

/// colour.mp4 (lossless RGB cannot be: H.264 of high quality) and depth.mkv, 16-bit codes.
void writeFilms(const TemporaryFolder& folder, const std::string& depthOptions = "",
                const std::string& depthRate = "25") {
    films::writePictures(folder.path(), kFrames, kWidth, kHeight);
    films::writeCodes(folder / "codes.raw", kFrames, kWidth, kHeight, 4000);
    films::ffmpeg(folder.path(),
                  "-framerate 25 -i c%d.png -c:v libx264 -crf 4 -pix_fmt yuv444p -g 4 colour.mp4");
    films::ffmpeg(folder.path(), fmt::format("-f rawvideo -pix_fmt gray16le -s {}x{} -r {} -i "
                                             "codes.raw {} -c:v ffv1 depth.mkv",
                                             kWidth, kHeight, depthRate, depthOptions));
}

std::string pose(double x, const std::string& more = "") {
    return fmt::format("{{\"transform_matrix\":[[1,0,0,{}],[0,1,0,0],[0,0,1,0],[0,0,0,1]]{}}}", x,
                       more);
}

std::filesystem::path writeCameras(const TemporaryFolder& folder, const std::string& frames,
                                   const std::string& head = "\"integer_depth_scale\":0.001,") {
    sets::writeText(folder / "camera.json",
                    fmt::format("{{\"w\":{},\"h\":{},\"fl_x\":30,{}\"frames\":[{}]}}", kWidth,
                                kHeight, head, frames));
    return folder / "camera.json";
}

ImageSetOptions filmOptions() {
    ImageSetOptions options;
    options.texturePattern = "colour.mp4";
    options.depthPattern = "depth.mkv";
    return options;
}

TEST(FilmPairs, AreASetInTime) {
    REQUIRE_VIDEO();
    const TemporaryFolder folder;
    writeFilms(folder);
    Job job;
    const auto read = openImageSet(writeCameras(folder, pose(3)), filmOptions(), job);
    ASSERT_TRUE(read) << read.error().text();
    const Timeline& line = (*read)->timeline();
    ASSERT_EQ(line.count(), std::size_t{kFrames});
    EXPECT_NEAR(line.rate(), 25, 0.2);
    for (const int k : {0, 5, 2, 7}) {
        const auto bundle = (*read)->frame(static_cast<std::size_t>(k), job);
        ASSERT_TRUE(bundle) << bundle.error().text();
        ASSERT_EQ(bundle->views.size(), 1u);
        const ReferenceView& view = bundle->views[0];
        EXPECT_EQ(view.camera.position.x, 3);
        EXPECT_EQ(view.camera.fx, 30);
        const auto colours = films::picture(kWidth, kHeight, k);
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x) {
                const int code = films::code(x, y, k, 4000);
                ASSERT_EQ(hasPoint(view.depth.at(x, y)), code > 0) << x << ' ' << y;
                if (code == 0) continue;
                // 16 bits over the span of a frame.
                ASSERT_NEAR(view.depth.at(x, y), code * 0.001, 4.0 / 65534);
                const glm::ivec3 off = glm::abs(glm::ivec3(view.texture.rgba8()->at(x, y)) -
                                                glm::ivec3(colours.at(x, y)));
                ASSERT_LT(std::max({off.r, off.g, off.b}), 14) << x << ' ' << y << " of " << k;
            }
    }
}

TEST(FilmPairs, OneFileMayHoldBothTracks) {
    REQUIRE_VIDEO();
    const TemporaryFolder folder;
    writeFilms(folder);
    const auto set = writeCameras(folder, pose(0));
    Job quiet;
    const auto pair = openImageSet(set, filmOptions(), quiet);
    ASSERT_TRUE(pair) << pair.error().text();
    const auto expected = (*pair)->frame(3, quiet);
    ASSERT_TRUE(expected) << expected.error().text();
    for (const char* order : {"-map 0:v -map 1:v", "-map 1:v -map 0:v"}) {
        SCOPED_TRACE(order);
        films::ffmpeg(folder.path(),
                      fmt::format("-i colour.mp4 -i depth.mkv {} -c copy both.mkv", order));
        ImageSetOptions options;
        options.texturePattern = options.depthPattern = "both.mkv";
        Job job;
        const auto read = openImageSet(set, options, job);
        ASSERT_TRUE(read) << read.error().text();
        const auto notes = job.takeNotes();
        for (const char* said : {"both.mkv' has 2 tracks of video; the grey one is taken for depth",
                                 "the one that is not grey is taken for colour"})
            EXPECT_TRUE(std::ranges::any_of(notes, [&](const std::string& note) {
                return note.find(said) != std::string::npos;
            })) << fmt::format("{}", fmt::join(notes, "\n"));
        const auto bundle = (*read)->frame(3, job);
        ASSERT_TRUE(bundle) << bundle.error().text();
        EXPECT_TRUE(bundle->views[0].depth == expected->views[0].depth);
        EXPECT_EQ(bundle->views[0].texture.at(9, 9), expected->views[0].texture.at(9, 9));
    }
}

TEST(FilmPairs, AlphaOfColourIsTheSetsOwn) {
    REQUIRE_VIDEO();
    const TemporaryFolder folder;
    writeFilms(folder);
    films::ffmpeg(folder.path(),
                  "-i colour.mp4 -vf \"format=rgba,geq=r='r(X,Y)':g='g(X,Y)':b='b(X,Y)':"
                  "a='if(lt(X,8),0,255)'\" -c:v png colour.mov");
    ImageSetOptions options = filmOptions();
    options.texturePattern = "colour.mov";
    Job job;
    const auto read = openImageSet(writeCameras(folder, pose(0)), options, job);
    ASSERT_TRUE(read) << read.error().text();
    const auto bundle = (*read)->frame(2, job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    const ReferenceView& view = bundle->views[0];
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
            const bool point = x >= 8 && films::code(x, y, 2, 4000) > 0;
            // Opaque pixels without depth are those of a surface that was missed.
            ASSERT_EQ(view.texture.rgba8()->at(x, y).a, x >= 8 ? 255 : 0) << x << ' ' << y;
            ASSERT_EQ(hasPoint(view.depth.at(x, y)), point) << x << ' ' << y;
        }
    EXPECT_EQ(view.noDepth, NoDepth::unknown);
}

TEST(FilmPairs, CamerasMoveByTheirTimes) {
    REQUIRE_VIDEO();
    const TemporaryFolder folder;
    writeFilms(folder);
    Job job;
    const auto set = writeCameras(folder, pose(1, ",\"time\":0") + "," + pose(2, ",\"time\":0.13"));
    const auto read = openImageSet(set, filmOptions(), job);
    ASSERT_TRUE(read) << read.error().text();
    EXPECT_EQ((*read)->frame(1, job)->views[0].camera.position.x, 1);
    EXPECT_EQ((*read)->frame(2, job)->views[0].camera.position.x, 2);
    EXPECT_EQ((*read)->frame(7, job)->views[0].camera.position.x, 2);
}

/// Of our cameras.json the film has the poses by their times, and what a step of depth is.
TEST(FilmPairs, CamerasJsonSaysTimesAndUnits) {
    REQUIRE_VIDEO();
    const TemporaryFolder folder;
    writeFilms(folder);
    const auto camera = [](double x, double time, const std::string& depth) {
        return fmt::format(
            R"({{"width":{},"height":{},"position":[{},0,0],"orientation":[0,1,0,0],)"
            R"("fx":30,"time":{}{}}})",
            kWidth, kHeight, x, time, depth);
    };
    const auto open = [&](const std::string& depth, Job& job) {
        sets::writeText(folder / "camera.json", "{\"cameras\":[" + camera(1, 0, depth) + "," +
                                                    camera(2, 0.13, depth) + "]}");
        return openImageSet(folder / "camera.json", filmOptions(), job);
    };
    Job job;
    const auto read = open(",\"depthUnit\":0.002", job);
    ASSERT_TRUE(read) << read.error().text();
    const int code = films::code(9, 9, 2, 4000);
    for (const int k : {1, 2, 7}) {
        const auto frame = (*read)->frame(static_cast<std::size_t>(k), job);
        ASSERT_TRUE(frame) << frame.error().text();
        EXPECT_EQ(frame->views[0].camera.position.x, k == 1 ? 1 : 2);
    }
    EXPECT_NEAR((*read)->frame(2, job)->views[0].depth.at(9, 9), code * 0.002, 8.0 / 65534);
    // The code of DepthImage: 1 is far, the largest near.
    const auto planes = open(",\"nearPlane\":1,\"farPlane\":3", job);
    ASSERT_TRUE(planes) << planes.error().text();
    EXPECT_NEAR((*planes)->frame(2, job)->views[0].depth.at(9, 9),
                1 + (1 - (code - 1) / 65534.0) * 2, 1e-4);
    const auto untold = open("", job);
    ASSERT_FALSE(untold);
    EXPECT_NE(untold.error().text().find("--depth-unit"), std::string::npos);
}

TEST(FilmPairs, FramesAreMatchedByTime) {
    REQUIRE_VIDEO();
    const TemporaryFolder folder;
    // Half as many frames of depth: each has the colour of its time.
    writeFilms(folder, "-frames:v 4", "12.5");
    Job job;
    const auto read = openImageSet(writeCameras(folder, pose(0)), filmOptions(), job);
    ASSERT_TRUE(read) << read.error().text();
    ASSERT_EQ((*read)->timeline().count(), 4u);
    const auto bundle = (*read)->frame(2, job);
    ASSERT_TRUE(bundle);
    const auto colours = films::picture(kWidth, kHeight, 4);
    EXPECT_NEAR(bundle->views[0].texture.rgba8()->at(9, 9).b, colours.at(9, 9).b, 3);
    EXPECT_NEAR(bundle->views[0].depth.at(9, 9), films::code(9, 9, 2, 4000) * 0.001, 1e-3);
    const auto notes = job.takeNotes();
    EXPECT_TRUE(std::ranges::any_of(notes, [](const std::string& note) {
        return note.find(fmt::format("{} of {} frames of colour are left out", kFrames - 4,
                                     kFrames)) != std::string::npos;
    })) << fmt::format("{}", fmt::join(notes, "\n"));
}

/// Films whose colour is turned by what its file says.
class TurnedPair {
  public:
    explicit TurnedPair(int degrees) : across_(degrees != 180) {
        writeFilms(folder_);
        films::ffmpeg(
            folder_.path(),
            fmt::format("-i colour.mp4 -c copy -metadata:s:v:0 rotate={} turned.mp4", degrees));
        // The same depth with a turn of its own, and upright.
        films::ffmpeg(folder_.path(), "-i depth.mkv -c:v rawvideo -pix_fmt gray16be still.mov");
        films::ffmpeg(
            folder_.path(),
            fmt::format("-i still.mov -c copy -metadata:s:v:0 rotate={} own.mov", degrees));
        films::ffmpeg(folder_.path(), "-i own.mov -c:v ffv1 -pix_fmt gray16le upright.mkv");
        sets::writeText(
            folder_ / "camera.json",
            fmt::format("{{\"w\":{},\"h\":{},\"fl_x\":30,\"integer_depth_scale\":0.001,"
                        "\"frames\":[{}]}}",
                        across_ ? kHeight : kWidth, across_ ? kWidth : kHeight, pose(0)));
    }

    /// The depth of a frame; `notes` gets what is said.
    Image<float> depth(const std::string& film, std::string& notes) const {
        ImageSetOptions options = filmOptions();
        options.texturePattern = "turned.mp4";
        options.depthPattern = film;
        Job job;
        const auto read = openImageSet(folder_ / "camera.json", options, job);
        EXPECT_TRUE(read) << read.error().text();
        if (!read) return {};
        const auto bundle = (*read)->frame(3, job);
        EXPECT_TRUE(bundle) << bundle.error().text();
        if (!bundle) return {};
        notes.clear();
        for (const std::string& note : job.takeNotes()) notes += note + "\n";
        return bundle->views[0].depth;
    }

  private:
    TemporaryFolder folder_;
    bool across_;
};

TEST(FilmPairs, DepthLiesAsTheColourThatIsTurned) {
    REQUIRE_VIDEO();
    for (const int degrees : {90, 270, 180}) {
        SCOPED_TRACE(degrees);
        const TurnedPair films(degrees);
        const bool across = degrees != 180;
        std::string notes;
        const auto own = films.depth("own.mov", notes);
        EXPECT_EQ(notes.find("its depth, "), std::string::npos) << notes;
        const auto upright = films.depth("upright.mkv", notes);
        EXPECT_TRUE(std::ranges::equal(upright.pixels(), own.pixels()));
        EXPECT_EQ(notes.find("'upright.mkv', is taken as upright, which its size cannot tell") !=
                      std::string::npos,
                  !across)
            << notes;
        EXPECT_EQ(notes.find("lies as the sensor saw it"), std::string::npos) << notes;
        if (!across) continue;
        const auto stored = films.depth("depth.mkv", notes);
        EXPECT_TRUE(std::ranges::equal(stored.pixels(), own.pixels()));
        EXPECT_NE(notes.find("'depth.mkv', lies as the sensor saw it and is turned as the picture"),
                  std::string::npos)
            << notes;
    }
}

TEST(FilmPairs, GoOnWhereAPictureIsDamaged) {
    REQUIRE_VIDEO();
    const TemporaryFolder folder;
    // Pictures that can be read alone, with a checksum.
    writeFilms(folder, "-level 3 -slicecrc 1 -g 1");
    auto bytes = *readFile(folder / "depth.mkv", {});
    for (std::size_t i = bytes.size() / 2; i < bytes.size() / 2 + 40; ++i)
        bytes[i] ^= std::byte{0x5a};
    ASSERT_TRUE(writeFile(folder / "depth.mkv", bytes));
    Job job;
    const auto set = writeCameras(folder, pose(0));
    const auto read = openImageSet(set, filmOptions(), job);
    ASSERT_TRUE(read) << read.error().text();
    int frozen = 0;
    float last = 0;
    for (std::size_t k = 0; k < kFrames; ++k) {
        const auto bundle = (*read)->frame(k, job);
        ASSERT_TRUE(bundle) << bundle.error().text();
        const float depth = bundle->views[0].depth.at(9, 9);
        frozen += depth == last ? 1 : 0;
        last = depth;
    }
    EXPECT_EQ(frozen, 1);
    std::string notes;
    for (const std::string& note : job.takeNotes()) notes += note + "\n";
    EXPECT_NE(notes.find("cannot be used: the one before it is shown on"), std::string::npos)
        << notes;
    auto options = filmOptions();
    options.strict = true;
    const auto strict = openImageSet(set, options, job);
    ASSERT_TRUE(strict);
    int errors = 0;
    for (std::size_t k = 0; k < kFrames; ++k) errors += (*strict)->frame(k, job) ? 0 : 1;
    EXPECT_EQ(errors, 1);
}

TEST(FilmPairs, WhatIsMissingIsSaid) {
    REQUIRE_VIDEO();
    const TemporaryFolder folder;
    writeFilms(folder);
    const auto errorOf = [&](const std::string& frames, const ImageSetOptions& options,
                             const std::string& head = "") {
        Job job;
        const auto read = openImageSet(writeCameras(folder, frames, head), options, job);
        EXPECT_FALSE(read);
        return read ? std::string() : read.error().text();
    };
    EXPECT_NE(errorOf(pose(0), filmOptions()).find("--depth-unit"), std::string::npos);
    EXPECT_NE(errorOf(pose(0) + "," + pose(1), filmOptions(), "\"integer_depth_scale\":1,")
                  .find("2 cameras for 8 frames"),
              std::string::npos);
    auto options = filmOptions();
    options.depthPattern.clear();
    EXPECT_NE(errorOf(pose(0), options).find("films come in pairs"), std::string::npos);
    options.depthPattern = "gone.mkv";
    options.depthUnit = 1;
    EXPECT_NE(errorOf(pose(0), options).find("'gone.mkv': it exists neither in"),
              std::string::npos);
}

TEST(AzureKinect, ColourIsWarpedToDepth) {
    REQUIRE_SHARED(recording, "data/motion/azure-kinect/recording.mkv");
    if (const auto video = VideoProcess::start(Limits()); !video)
        GTEST_SKIP() << video.error().message;
    Job job;
    const auto read = openImageSet(recording, {}, job);
    ASSERT_TRUE(read) << read.error().text();
    // The shared one is cut after its first frame.
    ASSERT_EQ((*read)->timeline().count(), 1u);
    const auto bundle = (*read)->frame(0, job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    ASSERT_EQ(bundle->views.size(), 1u);
    const ReferenceView& view = bundle->views[0];
    // calibration.json: 0.49278 and 0.4929 of 1024 pixels; 0.51297 and 0.51692 less the crop.
    EXPECT_EQ(view.camera.width, 640);
    EXPECT_EQ(view.camera.height, 576);
    EXPECT_NEAR(view.camera.fx, 504.608, 0.01);
    EXPECT_NEAR(view.camera.fy, 504.733, 0.01);
    EXPECT_NEAR(view.camera.cx, 333.281, 0.01);
    EXPECT_NEAR(view.camera.cy, 349.330, 0.01);
    // Most of the middle has depth and colour.
    std::vector<float> depths;
    for (int y = 200; y < 376; ++y)
        for (int x = 220; x < 420; ++x)
            if (hasPoint(view.depth.at(x, y))) depths.push_back(view.depth.at(x, y));
    ASSERT_GT(depths.size(), 200u * 176u / 2);
    std::nth_element(depths.begin(),
                     depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2), depths.end());
    EXPECT_GT(depths[depths.size() / 2], 0.2f);
    EXPECT_LT(depths[depths.size() / 2], 6.0f);
}

/// A recording of three frames around a real calibration: a wall that goes away by a decimetre a
/// frame.
TEST(AzureKinect, FramesAreThoseOfTheRecording) {
    REQUIRE_SHARED(calibration, "data/motion/azure-kinect/calibration.json");
    REQUIRE_VIDEO();
    const TemporaryFolder folder;
    Bytes codes;
    for (int k = 0; k < 3; ++k)
        for (int i = 0; i < 320 * 288; ++i)
            for (const int byte : {(1000 + 100 * k) >> 8, (1000 + 100 * k) & 255})
                codes.push_back(static_cast<std::byte>(byte));
    ASSERT_TRUE(writeFile(folder / "codes.raw", codes));
    films::ffmpeg(
        folder.path(),
        fmt::format("-f lavfi -i color=c=0x204060:s=1280x720:r=5:d=0.6 -f rawvideo -pix_fmt "
                    "gray16be -s 320x288 -r 5 -i codes.raw -map 0 -map 1 -c:v:0 mjpeg -q:v 2 "
                    "-pix_fmt:v:0 yuvj422p -c:v:1 ffv1 -metadata:s:v:0 title=COLOR "
                    "-metadata:s:v:1 title=DEPTH -attach '{}' -metadata:s:t:0 "
                    "mimetype=application/octet-stream recording.mkv",
                    std::filesystem::absolute(calibration).string()));
    Job job;
    const auto read = openImageSet(folder / "recording.mkv", {}, job);
    ASSERT_TRUE(read) << read.error().text();
    ASSERT_EQ((*read)->timeline().count(), 3u);
    EXPECT_NEAR((*read)->timeline().rate(), 5, 1e-3);
    for (const int k : {2, 0, 1}) {
        const auto bundle = (*read)->frame(static_cast<std::size_t>(k), job);
        ASSERT_TRUE(bundle) << bundle.error().text();
        const ReferenceView& view = bundle->views[0];
        ASSERT_EQ(view.depth.size(), glm::ivec2(320, 288));
        EXPECT_NEAR(view.depth.at(160, 144), 1 + 0.1 * k, 1e-6);
        const auto colour = view.texture.rgba8()->at(160, 144);
        EXPECT_NEAR(colour.r, 0x20, 3);
        EXPECT_NEAR(colour.g, 0x40, 3);
        EXPECT_NEAR(colour.b, 0x60, 3);
        EXPECT_EQ(colour.a, 255);
    }
}

}  // namespace
}  // namespace stx

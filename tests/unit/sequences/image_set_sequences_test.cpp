// Image sets with time: which pictures belong to which camera, and what a moment shows.

#include "formats/imagesets/image_sets.hpp"
#include "tests/shared_data.hpp"
#include "tests/unit/imagesets/set_writer.hpp"

using namespace stx;
using namespace sets;

namespace {

/// A picture of a camera: its depth is 1000 + `depth` mm everywhere.
struct Shot {
    std::string camera;
    double time = 0;
    double x = 0;  ///< of the camera
    int depth = 0;
};

/// transforms.json with pictures of 8x6.
std::filesystem::path writeShots(const TemporaryFolder& folder, const std::vector<Shot>& shots,
                                 const std::string& head = "") {
    std::string frames;
    for (std::size_t i = 0; i < shots.size(); ++i) {
        const Shot& s = shots[i];
        const std::vector<std::uint8_t> rgb(8 * 6 * 3, static_cast<std::uint8_t>(i));
        const std::vector<std::uint16_t> depth(8 * 6, static_cast<std::uint16_t>(1000 + s.depth));
        writeBytes(folder / fmt::format("c{}.png", i), *encodePng(8, 6, 3, 8, rgb.data(), true));
        writeBytes(folder / fmt::format("d{}.png", i),
                   *encodePng(8, 6, 1, 16, depth.data(), false));
        frames += fmt::format(
            "{}{{\"file_path\":\"c{}.png\",\"depth_file_path\":\"d{}.png\",\"time\":{}{},"
            "\"transform_matrix\":[[1,0,0,{}],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}}",
            i ? "," : "", i, i, s.time,
            s.camera.empty() ? "" : fmt::format(",\"camera\":\"{}\"", s.camera), s.x);
    }
    writeText(folder / "transforms.json",
              fmt::format("{{\"w\":8,\"h\":6,\"fl_x\":8,{}\"frames\":[{}]}}", head, frames));
    return folder / "transforms.json";
}

std::unique_ptr<Sequence> opened(const std::filesystem::path& set, ImageSetOptions options = {}) {
    Job job;
    auto sequence = openImageSet(set, options, job);
    EXPECT_TRUE(sequence) << sequence.error().text();
    return sequence ? std::move(*sequence) : nullptr;
}

float depthOf(Sequence& sequence, std::size_t frame, std::size_t view) {
    Job job;
    const auto bundle = sequence.frame(frame, job);
    EXPECT_TRUE(bundle) << bundle.error().text();
    return bundle ? bundle->views.at(view).depth.at(3, 3) : 0;
}

}  // namespace

TEST(MovingSets, CamerasShowTheirLastPicture) {
    TemporaryFolder folder;
    const auto set = writeShots(
        folder, {{"b", 2.5, 1, 4}, {"a", 2.0, 0, 1}, {"a", 3.0, 0, 3}, {"b", 4.0, 1, 5}});
    const auto sequence = opened(set);
    ASSERT_TRUE(sequence);
    EXPECT_EQ(sequence->timeline().times, (std::vector<double>{2, 2.5, 3, 4}));
    // b is the first in the file; before its first picture it shows that one.
    EXPECT_NEAR(depthOf(*sequence, 0, 0), 1.004, 1e-4);
    EXPECT_NEAR(depthOf(*sequence, 0, 1), 1.001, 1e-4);
    EXPECT_NEAR(depthOf(*sequence, 2, 0), 1.004, 1e-4);
    EXPECT_NEAR(depthOf(*sequence, 2, 1), 1.003, 1e-4);
    EXPECT_NEAR(depthOf(*sequence, 3, 0), 1.005, 1e-4);
    EXPECT_NEAR(depthOf(*sequence, 3, 1), 1.003, 1e-4);
    Job job;
    EXPECT_EQ(sequence->frame(1, job)->views[0].name, "b");
}

TEST(MovingSets, TimesThatAreNoneAreNamed) {
    TemporaryFolder folder;
    const auto set = writeShots(folder, {{"a", -1e308, 0, 1}, {"a", 1e308, 0, 2}});
    Job job;
    const auto read = openImageSet(set, {}, job);
    ASSERT_FALSE(read);
    EXPECT_EQ(read.error().code, ErrorCode::invalidInput);
    EXPECT_NE(read.error().text().find("--still"), std::string::npos) << read.error().text();
}

TEST(MovingSets, TimesThatRoundToOneAreOneMoment) {
    TemporaryFolder folder;
    // The spacing of numbers near 1e9 is 1.2e-7.
    const auto set = writeShots(folder, {{"a", -1e9, 0, 1}, {"a", 1, 0, 2}, {"b", 1 + 1e-9, 1, 3}});
    const auto sequence = opened(set);
    ASSERT_TRUE(sequence);
    EXPECT_TRUE(sequence->timeline().check());
    EXPECT_EQ(sequence->timeline().count(), 2u);
}

TEST(MovingSets, PicturesOfOnePoseAreOneCamera) {
    TemporaryFolder folder;
    const auto set =
        writeShots(folder, {{"", 0, 0, 1}, {"", 0, 5, 2}, {"", 1, 0, 3}, {"", 1, 5, 4}});
    const auto sequence = opened(set);
    ASSERT_TRUE(sequence);
    EXPECT_EQ(sequence->timeline().count(), 2u);
    EXPECT_NEAR(depthOf(*sequence, 1, 0), 1.003, 1e-4);
    EXPECT_NEAR(depthOf(*sequence, 1, 1), 1.004, 1e-4);
}

TEST(MovingSets, WhereNoPoseComesTwiceOneCameraMoves) {
    TemporaryFolder folder;
    const auto set = writeShots(folder, {{"", 0, 0, 1}, {"", 1, 5, 2}, {"", 2, 7, 3}});
    const auto sequence = opened(set);
    ASSERT_TRUE(sequence);
    Job job;
    const auto last = sequence->frame(2, job);
    ASSERT_TRUE(last);
    ASSERT_EQ(last->views.size(), 1u);
    EXPECT_DOUBLE_EQ(last->views[0].camera.position.x, 7);
}

TEST(MovingSets, StillTakesAllPicturesAsViews) {
    TemporaryFolder folder;
    const auto set = writeShots(folder, {{"", 0, 0, 1}, {"", 1, 5, 2}, {"", 2, 7, 3}});
    ImageSetOptions options;
    options.moving = false;
    Job job;
    const auto still = readImageSet(set, options, job);
    ASSERT_TRUE(still);
    EXPECT_EQ(still->views.size(), 3u);
    // A moment of it.
    options.moving.reset();
    options.frame = 1;
    const auto moment = readImageSet(set, options, job);
    ASSERT_TRUE(moment);
    ASSERT_EQ(moment->views.size(), 1u);
    EXPECT_DOUBLE_EQ(moment->views[0].camera.position.x, 5);
    EXPECT_EQ(*imageSetFrameCount(set, {}, job), 3);
    options.frame = 3;
    EXPECT_FALSE(readImageSet(set, options, job));
}

TEST(MovingSets, EveryTakesEachNthMoment) {
    TemporaryFolder folder;
    std::vector<Shot> shots;
    for (int i = 0; i < 7; ++i) shots.push_back({"a", 0.1 * i, 0, i});
    ImageSetOptions options;
    options.every = 3;
    const auto sequence = opened(writeShots(folder, shots), options);
    ASSERT_TRUE(sequence);
    ASSERT_EQ(sequence->timeline().count(), 3u);
    EXPECT_NEAR(depthOf(*sequence, 2, 0), 1.006, 1e-4);
}

TEST(MovingSets, BrokenTimesAreErrors) {
    const auto messageOf = [](const std::vector<Shot>& shots, const std::string& replace = "",
                              const std::string& by = "") {
        TemporaryFolder folder;
        const auto set = writeShots(folder, shots);
        if (!replace.empty()) {
            Job job;
            const auto bytes = readFile(set, job.limits);
            std::string text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
            text.replace(text.find(replace), replace.size(), by);
            writeText(set, text);
        }
        Job job;
        const auto sequence = openImageSet(set, {}, job);
        EXPECT_FALSE(sequence);
        if (sequence) return std::string();
        EXPECT_EQ(sequence.error().code, ErrorCode::invalidInput);
        return sequence.error().text();
    };
    EXPECT_NE(messageOf({{"a", 0, 0, 0}, {"a", 1, 0, 0}, {"a", 1, 0, 0}})
                  .find("are both of camera 'a' at 1 s"),
              std::string::npos);
    EXPECT_NE(messageOf({{"a", 0, 0, 0}, {"a", 1, 0, 0}}, "\"time\":1,", "")
                  .find("1 of 2 pictures have a 'time'"),
              std::string::npos);
    EXPECT_NE(messageOf({{"a", 0, 0, 0}, {"a", 1, 0, 0}}, "\"time\":1,", "\"time\":\"x\",")
                  .find("'time'"),
              std::string::npos);
}

TEST(MovingSets, NormalisedDisparityIsRead) {
    TemporaryFolder folder;
    const auto set = writeShots(
        folder, {{"a", 0, 0, 64535}},
        R"("depth_coding":{"normalised_disparity":true,"near":2,"far":20,"bits":16,"none":0},)");
    Job job;
    const auto bundle = readImageSet(set, {}, job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    EXPECT_NEAR(bundle->views[0].depth.at(0, 0), 2, 1e-4) << "the largest code is the near plane";
}

TEST(MovingSets, MasksTakeAwayWhatIsNotTheObject) {
    TemporaryFolder folder;
    const auto set = writeShots(folder, {{"a", 0, 0, 1}, {"a", 1, 0, 2}});
    std::vector<std::uint8_t> mask(8 * 6, 0);
    mask[8 * 2 + 3] = 255;
    for (const char* name : {"m_c0.png", "m_c1.png"})
        writeBytes(folder / name, *encodePng(8, 6, 1, 8, mask.data(), false));
    ImageSetOptions options;
    options.maskPattern = folder / "m_{stem}.png";
    const auto sequence = opened(set, options);
    ASSERT_TRUE(sequence);
    Job job;
    const auto frame = sequence->frame(1, job);
    ASSERT_TRUE(frame) << frame.error().text();
    EXPECT_EQ(frame->views[0].pointCount(), 1);
    EXPECT_TRUE(hasPoint(frame->views[0].depth.at(3, 2)));

    writeBytes(folder / "m_c0.png", *encodePng(4, 4, 1, 8, mask.data(), false));
    const auto wrong = sequence->frame(0, job);
    ASSERT_FALSE(wrong);
    EXPECT_NE(wrong.error().text().find("the mask is 4x4"), std::string::npos);
    std::filesystem::remove(folder / "m_c0.png");
    const auto missing = sequence->frame(0, job);
    ASSERT_FALSE(missing);
    EXPECT_EQ(missing.error().code, ErrorCode::io);
}

TEST(MovingSets, TheMovingRoomHasFourCameras) {
    REQUIRE_SHARED(set, "data/motion/moving-room/transforms.json");
    const auto sequence = opened(set);
    ASSERT_TRUE(sequence);
    EXPECT_EQ(sequence->timeline().count(), 16u);
    EXPECT_NEAR(sequence->timeline().rate(), 25, 1e-6);
    Job job;
    const auto first = sequence->frame(0, job), last = sequence->frame(15, job);
    ASSERT_TRUE(first && last);
    ASSERT_EQ(first->views.size(), 4u);
    for (const std::size_t still : {0u, 1u, 2u})
        EXPECT_EQ(first->views[still].camera, last->views[still].camera);
    EXPECT_NE(first->views[3].camera, last->views[3].camera);
    // Walls of the room, none further than the coded range.
    for (const float depth : first->views[0].depth.pixels()) {
        if (hasPoint(depth)) {
            ASSERT_LE(depth, 20.001f);
        }
    }
}

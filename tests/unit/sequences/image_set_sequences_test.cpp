// Image sets with time: which pictures belong to which camera, and what a moment shows.

#include <cstdio>

#include "formats/any/sequences.hpp"
#include "formats/imagesets/export.hpp"
#include "formats/imagesets/image_sets.hpp"
#include "lib/model/same_pictures.hpp"
#include "tests/shared_data.hpp"
#include "tests/unit/sequences/shots.hpp"

using namespace stx;
using namespace sets;
using namespace shots;

TEST(MovingSets, CamerasShowTheirLastPicture) {
    TemporaryFolder folder;
    const auto set = writeShots(
        folder, {{"b", 2.5, 1, 4}, {"a", 2.0, 0, 1}, {"a", 3.0, 0, 3}, {"b", 4.0, 1, 5}});
    const auto sequence = opened(set);
    ASSERT_TRUE(sequence);
    EXPECT_EQ(sequence->timeline().times, (std::vector<double>{2, 2.5, 3, 4}));
    // b is the first in the file; before its first picture nothing is known of what it sees.
    EXPECT_FALSE(hasPoint(depthOf(*sequence, 0, 0)));
    EXPECT_NEAR(depthOf(*sequence, 1, 0), 1.004, 1e-4);
    EXPECT_NEAR(depthOf(*sequence, 0, 1), 1.001, 1e-4);
    EXPECT_NEAR(depthOf(*sequence, 2, 0), 1.004, 1e-4);
    EXPECT_NEAR(depthOf(*sequence, 2, 1), 1.003, 1e-4);
    EXPECT_NEAR(depthOf(*sequence, 3, 0), 1.005, 1e-4);
    EXPECT_NEAR(depthOf(*sequence, 3, 1), 1.003, 1e-4);
    Job job;
    EXPECT_EQ(sequence->frame(1, job)->views[0].name, "b");
}

TEST(MovingSets, ACameraThatStartsLaterIsNotThereBefore) {
    for (const double start : {0.0, 7.3, -1.0, 1.3e9}) {
        TemporaryFolder folder;
        const auto set = writeShots(folder, {{"a", start, 0, 1},
                                             {"a", start + 1, 0, 2},
                                             {"b", start + 1, 1, 3},
                                             {"a", start + 2, 0, 4}});
        const auto first = opened(set);
        ASSERT_TRUE(first);
        Job job;
        for (const char* target : {"film.mp4", "film.xmt", "film_%02d.exr", "out"}) {
            const auto path = folder / target;
            const auto written = std::string(target) == "out" ? exportFrames(*first, path, {}, job)
                                                              : saveSequence(*first, path, {}, job);
            ASSERT_TRUE(written) << written.error().text();
            const auto read = openSequence(path, {}, job);
            ASSERT_TRUE(read) << read.error().text();
            EXPECT_EQ((*read)->timeline().start(), start) << target;
            EXPECT_NEAR((*read)->timeline().end, start + 3, 1e-6) << target;
            const auto before = (*read)->frame(0, job), since = (*read)->frame(1, job);
            ASSERT_TRUE(before) << target << ": " << before.error().text();
            ASSERT_TRUE(since) << target << ": " << since.error().text();
            ASSERT_EQ(before->views.size(), 2u) << target;
            EXPECT_EQ(before->views[1].pointCount(), 0) << target;
            EXPECT_TRUE(before->views[1].depthMayBeUnknown()) << target;
            EXPECT_EQ(before->views[1].texture.at(3, 3).a, 1.0f) << target << ": it hides nothing";
            EXPECT_EQ(before->views[0].pointCount(), 48) << target;
            EXPECT_EQ(since->views[1].pointCount(), 48) << target;
            EXPECT_NEAR(since->views[1].depth.at(3, 3), 1.003, 1e-3) << target;
        }
    }
}

TEST(MovingSets, ACameraThatStartsLaterKeepsItsPlace) {
    TemporaryFolder folder;
    const auto first = opened(writeShots(folder, {{"b", 1, 1, 3}, {"a", 0, 0, 1}, {"a", 1, 0, 2}}));
    ASSERT_TRUE(first);
    Job job;
    ASSERT_TRUE(exportFrames(*first, folder / "out", {}, job));
    const auto again = opened(folder / "out" / "transforms.json");
    ASSERT_TRUE(again);
    for (std::size_t view = 0; view < 2; ++view)
        EXPECT_EQ(again->frame(0, job)->views[view].name, first->frame(0, job)->views[view].name);
    EXPECT_EQ(again->frame(0, job)->views[0].name, "b");
}

namespace {

std::string notesOf(Job& job) {
    std::string all;
    for (const std::string& note : job.takeNotes()) all += note + "\n";
    return all;
}

}  // namespace

TEST(MovingSets, AMissingPictureIsTheOneBefore) {
    TemporaryFolder folder;
    const auto set = writeShots(
        folder, {{"a", 0, 0, 1}, {"b", 0, 1, 2}, {"a", 1, 0, 3}, {"b", 1, 1, 4}, {"a", 2, 0, 5}});
    std::filesystem::remove(folder / "d2.png");
    Job job;
    auto read = openImageSet(set, {}, job);
    ASSERT_TRUE(read) << read.error().text();
    const auto notes = notesOf(job);
    EXPECT_NE(notes.find("1 of 5 pictures is missing"), std::string::npos) << notes;
    EXPECT_NE(notes.find("d2.png"), std::string::npos) << notes;
    EXPECT_EQ((*read)->timeline().count(), 3u);
    EXPECT_NEAR(depthOf(**read, 1, 0), 1.001, 1e-4);
    EXPECT_NEAR(depthOf(**read, 1, 1), 1.004, 1e-4);
    EXPECT_NEAR(depthOf(**read, 2, 0), 1.005, 1e-4);
    ImageSetOptions options;
    options.strict = true;
    const auto strict = openImageSet(set, options, job);
    ASSERT_FALSE(strict);
    EXPECT_EQ(strict.error().code, ErrorCode::io);
    options.strict = false;
    options.frame = 1;
    const auto moment = readImageSet(set, options, job);
    ASSERT_TRUE(moment) << moment.error().text();
    EXPECT_NEAR(moment->views[0].depth.at(3, 3), 1.001, 1e-4);
}

TEST(MovingSets, AFilmBeginsWithItsFirstPictureThatIsThere) {
    TemporaryFolder folder;
    const auto set = writeShots(folder, {{"a", 7.3, 0, 1}, {"a", 8.3, 0, 2}, {"a", 9.3, 0, 3}});
    std::filesystem::remove(folder / "c0.png");
    const auto read = opened(set);
    ASSERT_TRUE(read);
    EXPECT_EQ(read->timeline().times, (std::vector<double>{8.3, 9.3}));
    EXPECT_NEAR(depthOf(*read, 0, 0), 1.002, 1e-4);
    Job job;
    ImageSetOptions options;
    EXPECT_EQ(imageSetFrameCount(set, options, job), 2);
    options.frame = 1;
    EXPECT_NEAR(readImageSet(set, options, job)->views[0].depth.at(3, 3), 1.003, 1e-4);
    options.frame = 2;
    EXPECT_FALSE(readImageSet(set, options, job));
}

TEST(MovingSets, ADamagedPictureIsTheOneBefore) {
    TemporaryFolder folder;
    const auto set =
        writeShots(folder, {{"a", 0, 0, 1}, {"a", 1, 0, 2}, {"a", 2, 0, 3}, {"a", 3, 0, 4}});
    for (const char* file : {"c1.png", "d2.png"}) {
        auto bytes = *readFile(folder / file, {});
        bytes.resize(bytes.size() / 2);
        writeBytes(folder / file, bytes);
    }
    Job job;
    const auto read = openImageSet(set, {}, job);
    ASSERT_TRUE(read);
    const auto saved = saveSequence(**read, folder / "film.mp4", {}, job);
    ASSERT_TRUE(saved) << saved.error().text();
    const auto notes = notesOf(job);
    EXPECT_NE(notes.find("camera 'a' at 1 s"), std::string::npos) << notes;
    EXPECT_NE(notes.find("c1.png"), std::string::npos) << notes;
    EXPECT_EQ(notes.find("d2.png"), std::string::npos) << "the first says it for all: " << notes;
    const auto film = openSequence(folder / "film.mp4", {}, job);
    ASSERT_TRUE(film);
    for (const double time : {0.0, 1.0, 2.0})
        EXPECT_NEAR(depthOf(**film, (*film)->timeline().frameAt(time), 0), 1.001, 1e-3) << time;
    EXPECT_NEAR(depthOf(**film, (*film)->timeline().frameAt(3), 0), 1.004, 1e-3);
    ImageSetOptions options;
    options.strict = true;
    const auto strict = openImageSet(set, options, job);
    ASSERT_TRUE(strict);
    EXPECT_FALSE(saveSequence(**strict, folder / "strict.mp4", {}, job));
}

TEST(MovingSets, ViewsOnDemandAreThoseOfTheFrame) {
    TemporaryFolder folder;
    const auto set = writeShots(folder, {{"a", 0, 0, 1},
                                         {"b", 0, 1, 2},
                                         {"a", 1, 0, 3},
                                         {"b", 1, 1, 4},
                                         {"c", 2, 1, 5},
                                         {"a", 2, 0, 6}});
    auto bytes = *readFile(folder / "d3.png", {});
    bytes.resize(bytes.size() / 2);
    writeBytes(folder / "d3.png", bytes);
    Job job;
    job.limits.maxMemoryBytes = 8000;  // an eighth is less than three views, of 384 bytes each
    auto each = openImageSet(set, {}, job);
    const auto whole = opened(set);
    ASSERT_TRUE(each) << each.error().text();
    ASSERT_TRUE(whole);
    for (const std::size_t frame : {0u, 1u, 2u, 1u}) {
        const auto table = (*each)->views(frame, job);
        ASSERT_TRUE(table) << table.error().text();
        EXPECT_FALSE((*table)->whole());
        Job quiet;
        const auto expected = whole->frame(frame, quiet);
        ASSERT_TRUE(expected);
        EXPECT_EQ((*table)->about().time, expected->time);
        EXPECT_EQ((*table)->about().duration, expected->duration);
        EXPECT_EQ((*table)->about().bounds->min, expected->bounds->min);
        ASSERT_EQ((*table)->count(), 3u);
        for (std::size_t k = 0; k < 3; ++k) {
            const auto view = (*table)->view(k, job);
            ASSERT_TRUE(view) << view.error().text();
            EXPECT_TRUE(samePictures(**view, expected->views[k])) << frame << ' ' << k;
            EXPECT_EQ((*view)->name, expected->views[k].name);
            EXPECT_EQ((*view)->camera, expected->views[k].camera);
        }
    }
    const auto notes = notesOf(job);
    EXPECT_NE(notes.find("camera 'b' at 1 s cannot be used"), std::string::npos) << notes;
}

TEST(MovingSets, AFirstPictureThatIsDamagedIsNotKnown) {
    TemporaryFolder folder;
    const auto set = writeShots(folder, {{"a", 0, 0, 1}, {"b", 0, 0, 2}, {"a", 1, 0, 3}});
    writeText(folder / "d0.png", "no picture");
    const auto read = opened(set);
    ASSERT_TRUE(read);
    EXPECT_FALSE(hasPoint(depthOf(*read, 0, 0)));
    EXPECT_NEAR(depthOf(*read, 0, 1), 1.002, 1e-4);
    EXPECT_NEAR(depthOf(*read, 1, 0), 1.003, 1e-4);
}

TEST(MovingSets, ACameraOfWhichAllIsDamagedIsAnError) {
    TemporaryFolder folder;
    const auto set =
        writeShots(folder, {{"a", 0, 0, 1}, {"b", 0, 0, 2}, {"a", 1, 0, 3}, {"b", 1, 0, 4}});
    for (const char* file : {"d1.png", "d3.png"}) writeText(folder / file, "no picture");
    const auto read = opened(set);
    ASSERT_TRUE(read);
    Job job;
    const auto first = read->frame(0, job);
    ASSERT_FALSE(first);
    EXPECT_NE(first.error().text().find("d1.png"), std::string::npos) << first.error().text();
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

/// 0.1 * 3 and 0.3 are one moment, of which two cameras have a picture each.
TEST(MovingSets, TimesThatDifferInTheirLastBitAreOneMoment) {
    for (const bool named : {false, true}) {
        TemporaryFolder folder;
        std::vector<Shot> shots;
        for (int i = 1; i < 5; ++i) {
            shots.push_back({named ? "a" : "", 0.1 * i, 0.01 * i, 2 * i});
            shots.push_back({named ? "b" : "", i / 10.0, 5 + 0.01 * i, 2 * i + 1});
        }
        const auto sequence = opened(writeShots(folder, shots));
        ASSERT_TRUE(sequence);
        ASSERT_EQ(sequence->timeline().count(), 4u);
        for (std::size_t k = 0; k < 4; ++k) {
            EXPECT_NEAR(depthOf(*sequence, k, 0), 1.002 + 0.002 * k, 1e-4);
            EXPECT_NEAR(depthOf(*sequence, k, 1), 1.003 + 0.002 * k, 1e-4);
        }
    }
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

TEST(MovingSets, ACameraThatRestsBetweenIsOneCamera) {
    // At the beginning, for three pictures amid its way, and out of the order of time.
    for (const auto& shots : {std::vector<Shot>{{"", 0, 0, 1}, {"", 1, 0, 2}, {"", 2, 5, 3}},
                              std::vector<Shot>{{"", 0, 0, 1},
                                                {"", 1, 1, 2},
                                                {"", 2, 2, 3},
                                                {"", 3, 2, 4},
                                                {"", 4, 2, 5},
                                                {"", 5, 5, 6}},
                              std::vector<Shot>{{"", 2, 5, 3}, {"", 1, 0, 2}, {"", 0, 0, 1}}}) {
        TemporaryFolder folder;
        const auto set = writeShots(folder, shots);
        Job job;
        const auto sequence = openImageSet(set, {}, job);
        ASSERT_TRUE(sequence) << sequence.error().text();
        EXPECT_EQ(notesOf(job), "");
        ASSERT_EQ((*sequence)->timeline().count(), shots.size());
        const auto last = (*sequence)->frame(shots.size() - 1, job);
        ASSERT_TRUE(last) << last.error().text();
        ASSERT_EQ(last->views.size(), 1u);
        EXPECT_DOUBLE_EQ(last->views[0].camera.position.x, 5);
    }
}

TEST(MovingSets, PosesThatComeBackAreCamerasWithANoteWhereThatIsInDoubt) {
    const auto camerasOf = [](const std::vector<double>& x, std::string& notes) {
        TemporaryFolder folder;
        std::vector<Shot> shots;
        for (std::size_t i = 0; i < x.size(); ++i)
            shots.push_back({"", static_cast<double>(i), x[i], static_cast<int>(i)});
        Job job;
        const auto sequence = openImageSet(writeShots(folder, shots), {}, job);
        EXPECT_TRUE(sequence) << sequence.error().text();
        notes = notesOf(job);
        const auto frame = (*sequence)->frame(0, job);
        EXPECT_TRUE(frame) << frame.error().text();
        return frame ? frame->views.size() : 0;
    };
    std::string notes;
    EXPECT_EQ(camerasOf({0, 5, 0, 5}, notes), 2u);
    EXPECT_EQ(notes, "");
    EXPECT_EQ(camerasOf({0, 0, 5, 5}, notes), 2u) << "one after the other";
    EXPECT_EQ(notes, "");
    EXPECT_EQ(camerasOf({0, 1, 2, 1, 0}, notes), 3u);
    EXPECT_EQ(notes,
              "pictures of one pose are taken for those of one camera, which makes 3 cameras; "
              "'camera' of each frame says otherwise\n");
}

TEST(MovingSets, ARecordingIsOfOneCameraEvenWhereItRests) {
    TemporaryFolder folder;
    std::string pictures, poses;
    const double x[] = {0, 0, 0.01, 0.02};
    for (int i = 0; i < 4; ++i) {
        const std::vector<std::uint8_t> rgb(8 * 6 * 3, 90);
        const std::vector<std::uint16_t> depth(8 * 6, static_cast<std::uint16_t>(5000 * (1 + i)));
        writeBytes(folder / fmt::format("c{}.png", i), *encodePng(8, 6, 3, 8, rgb.data(), true));
        writeBytes(folder / fmt::format("d{}.png", i),
                   *encodePng(8, 6, 1, 16, depth.data(), false));
        pictures += fmt::format("{0} c{1}.png {0} d{1}.png\n", 1 + 0.1 * i, i);
        poses += fmt::format("{} {} 0 0 0 0 0 1\n", 1 + 0.1 * i, x[i]);
    }
    writeText(folder / "associations.txt", pictures);
    writeText(folder / "groundtruth.txt", poses);
    writeText(folder / "intrinsics.txt", "8 8 3.5 2.5\n");
    ImageSetOptions options;
    options.moving = true;
    const auto sequence = opened(folder.path(), options);
    ASSERT_TRUE(sequence);
    ASSERT_EQ(sequence->timeline().count(), 4u);
    Job job;
    for (std::size_t k = 0; k < 4; ++k) {
        const auto frame = sequence->frame(k, job);
        ASSERT_TRUE(frame) << frame.error().text();
        ASSERT_EQ(frame->views.size(), 1u);
        EXPECT_DOUBLE_EQ(frame->views[0].camera.position.x, x[k]);
        EXPECT_NEAR(frame->views[0].depth.at(3, 3), 1.0 + k, 1e-4);
    }
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
    EXPECT_NE(messageOf({{"a", 0, 0, 0}, {"a", 0.3, 0, 0}, {"a", 0.1 * 3, 0, 0}})
                  .find("are both of camera 'a' at 0.3 s"),
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
    const auto missing = opened(set, options)->frame(0, job);
    ASSERT_FALSE(missing);
    EXPECT_EQ(missing.error().code, ErrorCode::io);
}

/// Frames whose own depth ranges differ: the codes of a film are those of all frames.
TEST(MovingSets, DepthOfAFilmIsRoundedOnce) {
    constexpr int kWidth = 64, kHeight = 4, kFrames = 4;
    const auto depthAt = [](int frame, int i) { return 1000 + 3 * i + 37 * frame; };
    TemporaryFolder folder;
    std::string frames;
    for (int k = 0; k < kFrames; ++k) {
        std::vector<std::uint16_t> depth(kWidth * kHeight);
        for (std::size_t i = 0; i < depth.size(); ++i)
            depth[i] = static_cast<std::uint16_t>(depthAt(k, static_cast<int>(i)));
        const std::vector<std::uint8_t> rgb(kWidth * kHeight * 3, static_cast<std::uint8_t>(k));
        writeBytes(folder / fmt::format("c{}.png", k),
                   *encodePng(kWidth, kHeight, 3, 8, rgb.data(), true));
        writeBytes(folder / fmt::format("d{}.png", k),
                   *encodePng(kWidth, kHeight, 1, 16, depth.data(), false));
        frames += fmt::format(
            "{}{{\"file_path\":\"c{}.png\",\"depth_file_path\":\"d{}.png\",\"time\":{},"
            "\"camera\":\"a\",\"transform_matrix\":[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}}",
            k ? "," : "", k, k, k * 0.5);
    }
    writeText(
        folder / "transforms.json",
        fmt::format("{{\"w\":{},\"h\":{},\"fl_x\":60,\"frames\":[{}]}}", kWidth, kHeight, frames));
    OpenOptions options;
    options.set.depthBits = 8;
    Job job;
    const auto film = folder / "film.mp4";
    const auto set = openSequence(folder / "transforms.json", options.into(film), job);
    ASSERT_TRUE(set) << set.error().text();
    ASSERT_TRUE(saveSequence(**set, film, {}, job));
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 1u);

    const auto read = openSequence(film, {}, job);
    ASSERT_TRUE(read) << read.error().text();
    double worst = 0;
    for (int k = 0; k < kFrames; ++k) {
        const auto bundle = (*read)->frame(static_cast<std::size_t>(k), job);
        ASSERT_TRUE(bundle) << bundle.error().text();
        const ReferenceView& view = bundle->views[0];
        EXPECT_EQ(view.depthBits, 8);
        for (int i = 0; i < kWidth * kHeight; ++i) {
            const double off =
                std::abs(view.depth.pixels()[static_cast<std::size_t>(i)] - depthAt(k, i) / 1000.0);
            EXPECT_LE(off, view.depthCode().step() / 2 + 1e-6) << "frame " << k << ", pixel " << i;
            worst = std::max(worst, off);
        }
    }
    // The note's bound is that of all frames.
    double said = 0;
    ASSERT_EQ(std::sscanf(notes[0].c_str(), "depth is rounded to 8 bits: at most %lf", &said), 1)
        << notes[0];
    EXPECT_NEAR(said, worst, 1e-3 * worst);
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

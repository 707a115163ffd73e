// Films: any picture at random, exact where the coding is, damage told. ffmpeg makes them.

#include "formats/video/film.hpp"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <thread>

#include "formats/video/video_frames.hpp"
#include "tests/ffmpeg.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

constexpr int kCount = 40, kWide = 48, kHigh = 32;
/// Forwards, backwards, over groups of pictures and within them.
constexpr int kOrder[] = {0, 1, 2, 17, 16, 3, 39, 38, 20, 21, 22, 0, 39, 13, 12, 11};

std::unique_ptr<Film> openedFilm(const std::filesystem::path& path) {
    auto film = Film::open(path, {});
    EXPECT_TRUE(film) << film.error().text();
    if (!film) return nullptr;
    Job job;
    const auto chosen = (*film)->select((*film)->firstVideo(), true, job);
    EXPECT_TRUE(chosen) << chosen.error().text();
    return chosen ? std::move(*film) : nullptr;
}

/// A coding of depth that loses nothing.
struct DepthCoding {
    const char* name;
    const char* input;  ///< of the raw codes
    int bits;
    const char* arguments;
    const char* file;
};

class LosslessDepth : public testing::TestWithParam<DepthCoding> {};

TEST_P(LosslessDepth, ComesBackToTheBitInAnyOrder) {
    REQUIRE_VIDEO();
    const DepthCoding& coding = GetParam();
    const TemporaryFolder folder;
    const int largest = (1 << coding.bits) - 1;
    films::writeCodes(folder / "codes.raw", kCount, kWide, kHigh, largest);
    films::ffmpeg(folder.path(),
                  fmt::format("-f rawvideo -pix_fmt {} -s {}x{} -r 25 -i codes.raw {} {}",
                              coding.input, kWide, kHigh, coding.arguments, coding.file));
    const auto film = openedFilm(folder / coding.file);
    ASSERT_TRUE(film);
    ASSERT_EQ(film->count(), kCount);
    for (int k = 0; k < kCount; ++k)
        EXPECT_NEAR(film->times()[static_cast<std::size_t>(k)], k / 25.0, 0.0011);
    for (const int k : kOrder) {
        const auto picture = film->picture(k);
        ASSERT_TRUE(picture) << picture.error().text();
        ASSERT_TRUE(picture->hasLuma());
        EXPECT_EQ(picture->bits(), coding.bits);
        const auto codes = picture->lumaCodes();
        for (int y = 0; y < kHigh; ++y)
            for (int x = 0; x < kWide; ++x)
                ASSERT_EQ(codes[static_cast<std::size_t>(y) * kWide + static_cast<std::size_t>(x)],
                          films::code(x, y, k, largest))
                    << "frame " << k << ", pixel " << x << ' ' << y;
    }
}

INSTANTIATE_TEST_SUITE_P(
    All, LosslessDepth,
    testing::Values(
        DepthCoding{"ffv1_16", "gray16le", 16, "-c:v ffv1", "d.mkv"},
        DepthCoding{"ffv1_avi", "gray16le", 16, "-c:v ffv1", "d.avi"},
        DepthCoding{"big_endian", "gray16le", 16, "-c:v rawvideo -pix_fmt gray16be", "d.mov"},
        DepthCoding{"h264_8", "gray", 8, "-c:v libx264 -qp 0 -pix_fmt gray -g 15 -bf 3", "d.mp4"},
        DepthCoding{"h264_10", "gray10le", 10, "-c:v libx264 -qp 0 -pix_fmt gray10le -g 15 -bf 3",
                    "d.mkv"},
        DepthCoding{"hevc_12", "gray12le", 12,
                    "-c:v libx265 -x265-params lossless=1:keyint=10:log-level=none -pix_fmt "
                    "gray12le",
                    "d.mp4"}),
    [](const auto& coding) { return std::string(coding.param.name); });

/// Films of phones are stored as the sensor lies; players turn them by what the file says.
TEST(TurnedFilms, AreShownAsPlayersShowThem) {
    REQUIRE_VIDEO();
    const TemporaryFolder folder;
    films::writePictures(folder.path(), 3, kWide, kHigh);
    films::ffmpeg(folder.path(), "-framerate 25 -i c%d.png -c:v png still.mov");
    for (const int degrees : {90, 180, 270}) {
        films::ffmpeg(
            folder.path(),
            fmt::format("-i still.mov -c copy -metadata:s:v:0 rotate={} turned.mov", degrees));
        films::ffmpeg(folder.path(), "-i turned.mov -pix_fmt rgba t%d.png");
        Job job;
        auto frames = openVideoFrames({folder / "turned.mov"}, job);
        ASSERT_TRUE(frames) << frames.error().text();
        const auto bytes = readFile(folder / "t2.png", {});
        const auto expected = decodeRgba8(*bytes, "t2.png", {});
        ASSERT_TRUE(expected);
        const bool across = degrees != 180;
        EXPECT_EQ((*frames)->size(), across ? glm::ivec2(kHigh, kWide) : glm::ivec2(kWide, kHigh));
        const auto is = (*frames)->frame(1);
        ASSERT_TRUE(is) << is.error().text();
        EXPECT_TRUE(std::ranges::equal((*is)->pixels(), expected->pixels())) << degrees;
        const auto film = openedFilm(folder / "turned.mov");
        EXPECT_EQ(film->picture(0)->width(), across ? kHigh : kWide);
    }
}

TEST(TurnedFilms, OfDepthTurnTheirCodes) {
    REQUIRE_VIDEO();
    const TemporaryFolder folder;
    films::writeCodes(folder / "codes.raw", 1, kWide, kHigh, 65535);
    films::ffmpeg(folder.path(), fmt::format("-f rawvideo -pix_fmt gray16le -s {}x{} -i codes.raw "
                                             "-c:v rawvideo -pix_fmt gray16be still.mov",
                                             kWide, kHigh));
    films::ffmpeg(folder.path(), "-i still.mov -c copy -metadata:s:v:0 rotate=90 turned.mov");
    films::ffmpeg(folder.path(), "-i turned.mov -f rawvideo -pix_fmt gray16le turned.raw");
    const auto film = openedFilm(folder / "turned.mov");
    ASSERT_TRUE(film);
    const auto depth = film->picture(0)->luma();
    ASSERT_EQ(depth.width(), kHigh);
    const auto expected = readFile(folder / "turned.raw", {});
    ASSERT_TRUE(expected);
    ASSERT_EQ(expected->size(), 2 * depth.count());
    for (std::size_t i = 0; i < depth.count(); ++i) {
        std::uint16_t code = 0;
        std::memcpy(&code, expected->data() + 2 * i, 2);
        ASSERT_EQ(depth.data()[i], code) << i;
    }
}

/// Colour, against ffmpeg's own decoding, in order, of the same file.
class ColourFilms : public testing::TestWithParam<std::pair<const char*, const char*>> {};

TEST_P(ColourFilms, AreWhatFfmpegDecodes) {
    REQUIRE_VIDEO();
    const auto& [file, arguments] = GetParam();
    const TemporaryFolder folder;
    films::writePictures(folder.path(), kCount, kWide, kHigh);
    films::ffmpeg(folder.path(), fmt::format("-framerate 25 -i c%d.png {} {}", arguments, file));
    // Where VP8 has its chroma nobody says; y4m's usual place is another than that of video.
    films::ffmpeg(folder.path(), fmt::format("-i {} -vsync passthrough {} all.y4m", file,
                                             std::string_view(file).ends_with("webm")
                                                 ? "-chroma_sample_location left"
                                                 : ""));
    Job job;
    const auto film = openVideoFrames({folder / file}, job);
    ASSERT_TRUE(film) << film.error().text();
    const auto expected = openVideoFrames({folder / "all.y4m"}, job);
    ASSERT_TRUE(expected) << expected.error().text();
    ASSERT_EQ((*film)->count(), kCount);
    ASSERT_EQ((*expected)->count(), kCount);
    EXPECT_EQ((*film)->size(), glm::ivec2(kWide, kHigh));
    EXPECT_EQ((*film)->name(7), "f_0007");
    for (const int k : kOrder) {
        const auto is = (*film)->frame(k);
        ASSERT_TRUE(is) << is.error().text();
        const auto wanted = (*expected)->frame(k);
        ASSERT_TRUE(wanted);
        for (std::size_t i = 0; i < (*is)->count(); ++i)
            ASSERT_EQ((*is)->data()[i], (*wanted)->data()[i]) << "frame " << k << ", pixel " << i;
    }
}

INSTANTIATE_TEST_SUITE_P(
    All, ColourFilms,
    testing::Values(
        std::pair{"f.mp4", "-c:v libx264 -pix_fmt yuv420p -g 12 -bf 2"},
        std::pair{"f.mkv", "-c:v libx264 -pix_fmt yuv420p -g 250 -bf 3"},
        // Pictures after a key picture that are shown before it, and need those before it.
        std::pair{"f.mov",
                  "-c:v libx265 -pix_fmt yuv420p -x265-params "
                  "open-gop=1:keyint=8:bframes=3:log-level=none -tag:v hvc1"},
        std::pair{"f.avi", "-c:v mjpeg -q:v 3 -pix_fmt yuvj420p"},
        std::pair{"f.webm", "-c:v libvpx -pix_fmt yuv420p"}),
    [](const auto& coding) { return std::string(coding.param.first).substr(2); });

struct Coefficients {
    const char* matrix;  ///< ffmpeg's name
    double kr, kb;       ///< ITU-T H.273, table 4
};
class MatrixOfFilms : public testing::TestWithParam<Coefficients> {};

/// In planes, and as pixels that libswscale converts.
TEST_P(MatrixOfFilms, IsTheOneThatTheStreamNames) {
    REQUIRE_VIDEO();
    const auto& [matrix, kr, kb] = GetParam();
    const TemporaryFolder folder;
    const glm::dvec3 colour(1, 0.2, 0.1);
    const double y = kr * colour.r + (1 - kr - kb) * colour.g + kb * colour.b;
    const double codes[] = {16 + 219 * y, 128 + 112 * (colour.b - y) / (1 - kb),
                            128 + 112 * (colour.r - y) / (1 - kr)};
    Bytes planes;
    for (const double code : codes)
        planes.insert(planes.end(), std::size_t{kWide} * kHigh,
                      static_cast<std::byte>(std::lround(code)));
    ASSERT_TRUE(writeFile(folder / "c.yuv", planes));
    for (const char* pixels : {"yuv444p", "yuv411p"}) {
        SCOPED_TRACE(pixels);
        films::ffmpeg(folder.path(),
                      fmt::format("-f rawvideo -pix_fmt yuv444p -s {}x{} -i c.yuv -c:v ffv1 "
                                  "-pix_fmt {} -color_range tv -colorspace {} f.mkv",
                                  kWide, kHigh, pixels, matrix));
        Job job;
        const auto film = openVideoFrames({folder / "f.mkv"}, job);
        ASSERT_TRUE(film) << film.error().text();
        const auto frame = (*film)->frame(0);
        ASSERT_TRUE(frame) << frame.error().text();
        const glm::dvec3 got((*frame)->at(20, 10));
        // Codes are rounded: half a step of Y, Cb and Cr each.
        for (int k = 0; k < 3; ++k) EXPECT_NEAR(got[k], colour[k] * 255, 2) << "channel " << k;
        EXPECT_TRUE(job.takeNotes().empty());
    }
}

INSTANTIATE_TEST_SUITE_P(All, MatrixOfFilms,
                         testing::Values(Coefficients{"bt709", 0.2126, 0.0722},
                                         Coefficients{"smpte170m", 0.299, 0.114},
                                         Coefficients{"smpte240m", 0.212, 0.087},
                                         Coefficients{"bt2020nc", 0.2627, 0.0593}),
                         [](const auto& of) { return std::string(of.param.matrix); });

TEST(Films, ColoursThatAreNotConvertedAreNotedOnce) {
    REQUIRE_VIDEO();
    const TemporaryFolder folder;
    films::writePictures(folder.path(), 3, kWide, kHigh);
    const auto notesOf = [&](const std::string& said) {
        films::ffmpeg(folder.path(), "-i c%d.png -c:v libx264 -pix_fmt yuv420p " + said + " f.mp4");
        Job job;
        {
            const auto film = openVideoFrames({folder / "f.mp4"}, job);
            EXPECT_TRUE(film) << film.error().text();
            for (int k = 0; film && k < 3; ++k) EXPECT_TRUE((*film)->frame(k));
        }
        return job.takeNotes();
    };
    constexpr std::string_view kAdvice =
        "; to convert them first: ffmpeg -i IN -vf zscale=p=709:t=709:m=709 -c:v ffv1 OUT.mkv";
    EXPECT_TRUE(
        notesOf("-colorspace smpte170m -color_primaries smpte170m -color_trc smpte170m").empty());
    EXPECT_TRUE(
        notesOf("-colorspace bt709 -color_primaries bt709 -color_trc iec61966-2-1").empty());
    EXPECT_EQ(
        notesOf("-colorspace bt2020nc -color_primaries bt2020 -color_trc arib-std-b67"),
        std::vector<std::string>{fmt::format("'f.mp4': colours of the video are taken as they are, "
                                             "primaries BT.2020 for BT.709, transfer function HLG "
                                             "for sRGB{}",
                                             kAdvice)});
    EXPECT_EQ(
        notesOf("-colorspace ycgco -color_primaries bt709 -color_trc smpte2084"),
        std::vector<std::string>{fmt::format("'f.mp4': colours of the video are taken as they are, "
                                             "transfer function PQ for sRGB, matrix YCgCo for "
                                             "BT.709{}",
                                             kAdvice)});
    EXPECT_EQ(
        notesOf("-colorspace bt2020c -color_primaries bt709 -color_trc bt709"),
        std::vector<std::string>{fmt::format("'f.mp4': colours of the video are taken as they are, "
                                             "matrix BT.2020 with constant luminance for "
                                             "BT.2020{}",
                                             kAdvice)});
}

/// File and arguments of a coding with alpha.
class FilmsWithAlpha : public testing::TestWithParam<std::pair<const char*, const char*>> {};

TEST_P(FilmsWithAlpha, KeepIt) {
    REQUIRE_VIDEO();
    const auto& [file, arguments] = GetParam();
    const TemporaryFolder folder;
    Rgba8Image picture(kWide, kHigh, {200, 100, 40, 255});
    for (int y = 0; y < kHigh; ++y)
        for (int x = 0; x < kWide / 2; ++x) picture.at(x, y).a = x < kWide / 4 ? 0 : 128;
    const auto png = encodePng(kWide, kHigh, 4, 8, picture.data(), true);
    ASSERT_TRUE(writeFile(folder / "c0.png", *png));
    films::ffmpeg(folder.path(), fmt::format("-i c%d.png {} {}", arguments, file));
    const auto film = openedFilm(folder / file);
    ASSERT_TRUE(film);
    const auto decoded = film->picture(0);
    ASSERT_TRUE(decoded) << decoded.error().text();
    EXPECT_TRUE(decoded->hasAlpha());
    const auto colour = decoded->colour({});
    ASSERT_TRUE(colour);
    for (const int x : {5, 18, 40}) {
        const glm::ivec4 is(colour->at(x, 10)), was(picture.at(x, 10));
        EXPECT_NEAR(is.a, was.a, 1) << "column " << x;
        for (int k = 0; k < 3; ++k) EXPECT_NEAR(is[k], was[k], 6) << "column " << x;
    }
}

INSTANTIATE_TEST_SUITE_P(
    All, FilmsWithAlpha,
    testing::Values(std::pair{"bgra.mkv", "-c:v ffv1 -pix_fmt bgra"},
                    std::pair{"png.mov", "-c:v png -pix_fmt rgba"},
                    std::pair{"yuva.mkv", "-c:v ffv1 -pix_fmt yuva420p"},
                    std::pair{"prores.mov",
                              "-c:v prores_ks -profile:v 4444 -pix_fmt yuva444p10le"}),
    [](const auto& coding) {
        const std::string file = coding.param.first;
        return file.substr(0, file.find('.'));
    });

TEST(Films, WithoutAlphaHaveNone) {
    REQUIRE_VIDEO();
    const TemporaryFolder folder;
    films::writePictures(folder.path(), 1, kWide, kHigh);
    for (const char* pixels : {"yuv420p", "bgr0"}) {
        films::ffmpeg(folder.path(), fmt::format("-i c%d.png -c:v ffv1 -pix_fmt {} f.mkv", pixels));
        const auto film = openedFilm(folder / "f.mkv");
        ASSERT_TRUE(film);
        const auto decoded = film->picture(0);
        ASSERT_TRUE(decoded) << decoded.error().text();
        EXPECT_FALSE(decoded->hasAlpha()) << pixels;
        EXPECT_EQ(decoded->colour({})->at(3, 3).a, 255);
    }
}

TEST(Films, TellHowManyBitsTheirColoursHave) {
    REQUIRE_VIDEO();
    const TemporaryFolder folder;
    films::writePictures(folder.path(), 1, kWide, kHigh);
    for (const auto& [pixels, bits] : {std::pair{"bgr0", 8},
                                       {"gbrp10le", 10},
                                       {"rgb48le", 16},
                                       {"yuv420p10le", 10},
                                       {"yuv420p", 8}}) {
        films::ffmpeg(folder.path(), fmt::format("-i c%d.png -c:v ffv1 -pix_fmt {} f.mkv", pixels));
        const auto film = openedFilm(folder / "f.mkv");
        ASSERT_TRUE(film);
        const auto decoded = film->picture(0);
        ASSERT_TRUE(decoded) << decoded.error().text();
        EXPECT_EQ(decoded->bits(), bits) << pixels;
    }
}

// Cut within a group of pictures: an edit list hides those before, which others need.
TEST(Films, HiddenPicturesAreDecodedAndNotShown) {
    REQUIRE_VIDEO();
    const TemporaryFolder folder;
    films::writeCodes(folder / "codes.raw", kCount, kWide, kHigh, 255);
    films::ffmpeg(folder.path(),
                  fmt::format("-f rawvideo -pix_fmt gray -s {}x{} -r 25 -i codes.raw -c:v libx264 "
                              "-qp 0 -pix_fmt gray -g 20 -bf 2 whole.mp4",
                              kWide, kHigh));
    films::ffmpeg(folder.path(), "-ss 0.28 -i whole.mp4 -c copy cut.mp4");
    const auto film = openedFilm(folder / "cut.mp4");
    ASSERT_TRUE(film);
    ASSERT_EQ(film->count(), kCount - 7);
    for (const int k : {0, 20, 3, 32})
        EXPECT_EQ(film->picture(k)->lumaCodes()[5], films::code(5, 0, k + 7, 255)) << k;
}

TEST(Films, ThreadsGetTheSame) {
    REQUIRE_VIDEO();
    const TemporaryFolder folder;
    films::writeCodes(folder / "codes.raw", kCount, kWide, kHigh, 255);
    films::ffmpeg(folder.path(),
                  fmt::format("-f rawvideo -pix_fmt gray -s {}x{} -r 25 -i codes.raw "
                              "-c:v libx264 -qp 0 -pix_fmt gray d.mp4",
                              kWide, kHigh));
    const auto film = openedFilm(folder / "d.mp4");
    ASSERT_TRUE(film);
    std::vector<int> wrong(3, 0);
    std::vector<std::thread> threads;
    for (int t = 0; t < 3; ++t)
        threads.emplace_back([&, t] {
            for (int k = t; k < kCount; k += 3) {
                const auto picture = film->picture(k);
                if (!picture || picture->lumaCodes()[5] != films::code(5, 0, k, 255))
                    ++wrong[static_cast<std::size_t>(t)];
            }
        });
    for (auto& thread : threads) thread.join();
    EXPECT_EQ(wrong, std::vector<int>(3, 0));
}

TEST(Films, DamageIsOneSentence) {
    REQUIRE_VIDEO();
    const TemporaryFolder folder;
    films::writePictures(folder.path(), kCount, kWide, kHigh);
    for (const auto& [file, arguments] :
         {std::pair{"f.mp4", "-c:v libx264 -pix_fmt yuv420p -movflags +faststart"},
          std::pair{"f.mkv", "-c:v ffv1 -slicecrc 1"}}) {
        films::ffmpeg(folder.path(), fmt::format("-i c%d.png {} {}", arguments, file));
        const Bytes whole = *readFile(folder / file, {});
        // Whatever is broken: a sentence of the file, or the picture; never a crash.
        int errors = 0;
        for (int trial = 0; trial < 24; ++trial) {
            Bytes broken = whole;
            if (trial % 3 == 0) {
                broken.resize(whole.size() * static_cast<std::size_t>(trial + 1) / 25);
            } else {
                const std::size_t at = whole.size() * static_cast<std::size_t>(trial + 1) / 26;
                for (std::size_t i = at; i < std::min(at + 40, whole.size()); ++i)
                    broken[i] ^= std::byte{0x5a};
            }
            ASSERT_TRUE(writeFile(folder / "broken", broken));
            std::optional<Error> error;
            Job job;
            if (auto film = Film::open(folder / "broken", {}); !film) {
                error = film.error();
            } else if (auto chosen = (*film)->select((*film)->firstVideo(), true, job); !chosen) {
                error = chosen.error();
            } else {
                for (int k = 0; k < (*film)->count() && !error; ++k)
                    if (const auto picture = (*film)->picture(k); !picture) error = picture.error();
            }
            if (!error) continue;
            ++errors;
            EXPECT_TRUE(error->code == ErrorCode::invalidInput ||
                        error->code == ErrorCode::unsupported)
                << error->text();
            EXPECT_NE(error->text().find("broken'"), std::string::npos) << error->text();
            EXPECT_EQ(error->text().find('\n'), std::string::npos) << error->text();
        }
        EXPECT_GT(errors, 8) << file;
    }
}

/// Readers of containers skip what they do not understand, and pictures with it.
TEST(Films, PicturesThatTheContainerLosesAreTold) {
    REQUIRE_VIDEO();
    const TemporaryFolder folder;
    films::writePictures(folder.path(), kCount, kWide, kHigh);
    struct Coding {
        const char *file, *arguments;
        std::string_view head;  // of a picture, which is overwritten
    };
    for (const auto& [file, arguments, head] :
         {Coding{"f.mkv", "-c:v libx264 -bf 0 -g 10 -cluster_time_limit 400", "\xa3"},
          Coding{"f.avi", "-c:v mjpeg", "00dc"}}) {
        films::ffmpeg(folder.path(), fmt::format("-i c%d.png {} {}", arguments, file));
        EXPECT_TRUE(openedFilm(folder / file)) << file;
        Bytes bytes = *readFile(folder / file, {});
        const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
        // A SimpleBlock of track 1, at a time, without lacing.
        std::size_t at = text.find(head, text.size() / 2);
        while (head.size() == 1 && (text[at + 3] != '\x81' || (text[at + 6] & 0x7f) != 0))
            at = text.find(head, at + 1);
        for (std::size_t i = 0; i < 3; ++i) bytes[at + i] = std::byte{0};
        ASSERT_TRUE(writeFile(folder / file, bytes));
        Job job;
        const auto strict = openVideoFrames({folder / file}, job, true);
        ASSERT_FALSE(strict) << file;
        EXPECT_EQ(strict.error().code, ErrorCode::invalidInput);
        EXPECT_NE(strict.error().text().find("it is damaged"), std::string::npos)
            << strict.error().text();
        EXPECT_TRUE(job.takeNotes().empty());
        const auto frames = openVideoFrames({folder / file}, job);
        ASSERT_TRUE(frames) << frames.error().text();
        EXPECT_LT((*frames)->count(), kCount);
        EXPECT_EQ(job.takeNotes().size(), 1u) << file;
    }
}

// Neither the sample entry nor the track tells a size.
TEST(Films, SizesOfNothingAreAnError) {
    REQUIRE_VIDEO();
    const TemporaryFolder folder;
    films::writePictures(folder.path(), 2, kWide, kHigh);
    films::ffmpeg(folder.path(), "-i c%d.png -c:v mjpeg -pix_fmt yuvj420p f.mov");
    Bytes bytes = *readFile(folder / "f.mov", {});
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    for (const char* name : {"jpeg", "tkhd"}) {
        const auto at = text.find(name);
        ASSERT_NE(at, std::string_view::npos);
        const std::size_t size = at + (name[0] == 'j' ? 28 : 80);
        for (std::size_t i = 0; i < (name[0] == 'j' ? 4u : 8u); ++i) bytes[size + i] = std::byte{0};
    }
    ASSERT_TRUE(writeFile(folder / "f.mov", bytes));
    Job job;
    const auto frames = openVideoFrames({folder / "f.mov"}, job);
    if (frames) {
        EXPECT_GT((*frames)->size().x, 0);
        EXPECT_GT((*frames)->size().y, 0);
    } else {
        EXPECT_NE(frames.error().text().find("each side must be 1 to"), std::string::npos)
            << frames.error().text();
    }
}

TEST(Films, ListsAndAddressesAreNoFilms) {
    const TemporaryFolder folder;
    for (const std::string_view text :
         {"#EXTM3U\n/etc/passwd\n", "ffconcat version 1.0\nfile /etc/passwd\n",
          "<?xml version='1.0'?><MPD></MPD>", "v=0\no=- 0 0 IN IP4 127.0.0.1\n"}) {
        ASSERT_TRUE(writeFile(folder / "list.mp4", std::as_bytes(std::span(text))));
        const auto film = Film::open(folder / "list.mp4", {});
        ASSERT_FALSE(film);
        EXPECT_EQ(film.error().code, ErrorCode::unsupported);
        EXPECT_NE(film.error().text().find("not a .mp4, .mov, .mkv"), std::string::npos);
    }
}

TEST(Films, MemoryIsBounded) {
    REQUIRE_VIDEO();
    const TemporaryFolder folder;
    films::ffmpeg(folder.path(),
                  "-f lavfi -i color=size=1024x1024:rate=5:duration=1 -c:v ffv1 f.mkv");
    Limits limits;
    limits.maxMemoryBytes = 1u << 20;
    auto film = Film::open(folder / "f.mkv", limits);
    if (film) {
        Job job;
        const auto chosen = (*film)->select(0, false, job);
        const auto picture = chosen ? (*film)->picture(0) : tl::unexpected(chosen.error());
        ASSERT_FALSE(picture);
        EXPECT_NE(picture.error().text().find("f.mkv'"), std::string::npos);
    }
}

/// The data reference of a film that names another file: what lies here is not its data.
TEST(Film, DataInAnotherFileAreNotReadFromThisOne) {
    REQUIRE_VIDEO();
    const TemporaryFolder folder;
    films::ffmpeg(folder.path(),
                  "-f lavfi -i testsrc=size=48x32:rate=10:duration=1 -pix_fmt yuv420p a.mp4");
    auto bytes = readFile(folder / "a.mp4", Limits());
    ASSERT_TRUE(bytes);
    ASSERT_TRUE(Film::open(folder / "a.mp4", {}));
    const std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
    const auto url = text.find("url ");
    ASSERT_NE(url, text.npos);
    (*bytes)[url + 7] = std::byte{0};  // its flags: no longer "in this file"
    ASSERT_TRUE(writeFile(folder / "b.mp4", *bytes));
    const auto film = Film::open(folder / "b.mp4", {});
    ASSERT_FALSE(film);
    EXPECT_EQ(film.error().code, ErrorCode::unsupported);
    EXPECT_NE(film.error().text().find("in another file"), std::string::npos);
}

}  // namespace
}  // namespace stx

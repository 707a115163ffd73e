// Films of MPEG-4 whose pictures are video: other software's are read, ours are written and read.

#include <algorithm>
#include <set>

#include "formats/any/sequences.hpp"
#include "formats/files/files.hpp"
#include "formats/mpeg4/mapping/media_clock.hpp"
#include "formats/mpeg4/mpeg4.hpp"
#include "tests/ffmpeg.hpp"
#include "tests/shared_data.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/sequences/moving_views.hpp"

namespace stx {
namespace {

/// 16-bit values, little-endian, that ffmpeg decodes: luma as it is coded.
std::vector<std::uint16_t> rawFrames(const TemporaryFolder& folder, const std::string& input,
                                     int track, const std::string& pixels, std::size_t frameBytes,
                                     std::size_t lumaCount, std::size_t frame) {
    films::ffmpeg(folder.path(),
                  fmt::format("-i '{}' -map 0:{} -vsync passthrough -f rawvideo -pix_fmt {} raw",
                              input, track, pixels));
    const auto bytes = readFile(folder / "raw", {});
    EXPECT_TRUE(bytes);
    std::vector<std::uint16_t> out(lumaCount);
    EXPECT_GE(bytes->size(), (frame + 1) * frameBytes);
    std::memcpy(out.data(), bytes->data() + frame * frameBytes, lumaCount * 2);
    return out;
}

TEST(VideoFilms, OtherSoftwaresH264IsReadAsFfmpegReadsIt) {
    REQUIRE_SHARED(file, "reference/motion/avc.mp4");
    REQUIRE_VIDEO();
    const TemporaryFolder folder;
    Job job;
    const auto read = openSequence(file, {}, job);
    ASSERT_TRUE(read) << read.error().text();
    // Of a second and a half there are moments of pictures, commands and the interpolator.
    const auto document = readMpeg4(file, job);
    ASSERT_TRUE(document);
    const auto path = std::filesystem::absolute(file).string();
    for (const std::size_t frame : {std::size_t{0}, std::size_t{7}, std::size_t{3}}) {
        const std::size_t moment = (*read)->timeline().frameAt(static_cast<double>(frame) / 25.0);
        const auto bundle = (*read)->frame(moment, job);
        ASSERT_TRUE(bundle) << bundle.error().text();
        ASSERT_EQ(bundle->views.size(), 1u);
        const ReferenceView& view = bundle->views[0];
        ASSERT_EQ(view.depth.size(), glm::ivec2(64, 48));
        const auto codes = rawFrames(folder, path, 3, "yuv420p10le", 64 * 48 * 3, 64 * 48, frame);
        const DepthCode code{1, 5, 1023};
        int points = 0;
        for (std::size_t i = 0; i < codes.size(); ++i) {
            ASSERT_EQ(hasPoint(view.depth.data()[i]), codes[i] > 0) << i;
            if (codes[i] == 0) continue;
            ++points;
            ASSERT_NEAR(view.depth.data()[i], code.decode(codes[i]), 1e-5) << i;
        }
        EXPECT_GT(points, 100);
    }
}

TEST(VideoFilms, HevcDepthIsRead) {
    REQUIRE_SHARED(file, "reference/motion/hevc.mp4");
    REQUIRE_VIDEO();
    Job job;
    const auto read = openSequence(file, {}, job);
    ASSERT_TRUE(read) << read.error().text();
    const auto first = (*read)->frame(0, job);
    ASSERT_TRUE(first) << first.error().text();
    EXPECT_GT(first->pointCount(), 100);
}

TEST(VideoFilms, ReadInAnyOrderIsTheSame) {
    REQUIRE_SHARED(file, "reference/motion/m4v.mp4");
    REQUIRE_VIDEO();
    Job job;
    const auto read = openSequence(file, {}, job);
    ASSERT_TRUE(read) << read.error().text();
    const auto again = openSequence(file, {}, job);
    ASSERT_TRUE(again);
    const std::size_t count = (*read)->timeline().count();
    for (std::size_t i = 0; i < count; ++i) {
        const auto forwards = (*read)->frame(i, job);
        ASSERT_TRUE(forwards) << forwards.error().text();
        const auto backwards = (*again)->frame(count - 1 - i, job);
        ASSERT_TRUE(backwards) << backwards.error().text();
        const auto same = (*again)->frame(i, job);
        ASSERT_TRUE(same);
        expectSameFrame(*same, *forwards);
    }
}

/// MovingViews with a depth that moves by more than a step of 10 bits.
class FarMovingViews : public MovingViews {
  public:
    using MovingViews::MovingViews;
    Result<Bundle> frame(std::size_t index, Job& job) override {
        auto bundle = MovingViews::frame(index, job);
        ReferenceView& view = bundle->views[0];
        view.depth.at(1, 0) =
            static_cast<float>(view.depthCode().decode(20000 + 640 * static_cast<unsigned>(index)));
        return bundle;
    }
};

/// Such frames, saved with H.264 and opened again.
struct Written {
    TemporaryFolder folder{"video"};
    std::filesystem::path path = folder / "a.mp4";
    FarMovingViews frames;
    std::vector<std::string> notes;

    explicit Written(int count, int crf = 6) : frames(count) {
        Job job;
        SaveOptions save;
        save.h264 = crf;
        const auto done = saveSequence(frames, path, save, job);
        EXPECT_TRUE(done) << done.error().text();
        notes = job.takeNotes();
    }
};

TEST(VideoFilms, WrittenDepthIsExactToItsBits) {
    REQUIRE_VIDEO();
    Written film(30);
    Job job;
    const auto read = openSequence(film.path, {}, job);
    ASSERT_TRUE(read) << read.error().text();
    ASSERT_EQ((*read)->timeline().count(), 30u);
    EXPECT_NEAR((*read)->timeline().rate(), 25, 1e-6);
    for (const std::size_t k : {std::size_t{0}, std::size_t{29}, std::size_t{4}}) {
        const auto is = (*read)->frame(k, job);
        ASSERT_TRUE(is) << is.error().text();
        const auto expected = film.frames.frame(k, job);
        const ReferenceView& a = is->views[0];
        const ReferenceView& b = expected->views[0];
        const DepthCode code{b.nearPlane, b.farPlane, 1023};
        for (std::size_t i = 0; i < a.depth.count(); ++i) {
            const float db = b.depth.data()[i];
            ASSERT_EQ(hasPoint(a.depth.data()[i]), hasPoint(db)) << i;
            if (!hasPoint(db)) continue;
            ASSERT_NEAR(a.depth.data()[i], code.decode(code.encode(db)), 1e-5) << i;
        }
        // The second view stands still: pictures, exact.
        ASSERT_EQ(*is->views[1].texture.rgba8(), *expected->views[1].texture.rgba8());
    }
    const auto said = [&](const char* part) {
        return std::ranges::any_of(film.notes, [&](const std::string& note) {
            return note.find(part) != std::string::npos;
        });
    };
    EXPECT_TRUE(said("colour is H.264 of quality 6"));
    EXPECT_TRUE(said("lossless H.264 of 8 or 10 bits"));
}

/// FarMovingViews with float depth, of which `count` are left: the first one's moves.
class FloatMovingViews : public FarMovingViews {
  public:
    FloatMovingViews(int frames, std::size_t count) : FarMovingViews(frames), count_(count) {}
    Result<Bundle> frame(std::size_t index, Job& job) override {
        auto bundle = FarMovingViews::frame(index, job);
        bundle->views.resize(count_);
        for (ReferenceView& view : bundle->views) {
            // Within the planes, and on no code.
            const auto middle = static_cast<float>((view.nearPlane + view.farPlane) / 2);
            for (float& d : view.depth.pixels())
                if (hasPoint(d)) d += 1e-5f * (middle - d);
            view.depthBits = 32;
        }
        return bundle;
    }

  private:
    std::size_t count_;
};

// What the pictures of the first frame lose was said of depth, too, that became video.
TEST(VideoFilms, DepthThatIsVideoIsNotedOnce) {
    REQUIRE_VIDEO();
    for (const std::size_t count : {std::size_t{1}, std::size_t{2}}) {
        TemporaryFolder folder{"video"};
        FloatMovingViews frames(4, count);
        Job job;
        SaveOptions save;
        save.h264 = 6;
        const auto done = saveSequence(frames, folder / "a.mp4", save, job);
        ASSERT_TRUE(done) << done.error().text();
        const auto notes = job.takeNotes();
        const auto said = [&](const char* part) {
            return std::ranges::any_of(
                notes, [&](const std::string& note) { return note.starts_with(part); });
        };
        EXPECT_TRUE(said("depth that moves is lossless H.264"));
        // The second view stands still and is pictures.
        EXPECT_EQ(said("depth is rounded to 16 bits"), count == 2)
            << fmt::format("{}", fmt::join(notes, "\n"));
    }
}

/// FarMovingViews as a masked sensor sees them: unknown depth is possible. The first view has it at
/// a pixel of one frame, the second at none.
class MaskedViews : public FarMovingViews {
  public:
    static constexpr glm::ivec2 kUnknown{6, 5};

    using FarMovingViews::FarMovingViews;
    Result<Bundle> frame(std::size_t index, Job& job) override {
        auto bundle = FarMovingViews::frame(index, job);
        for (ReferenceView& view : bundle->views) view.noDepth = NoDepth::unknown;
        if (index == 1)
            bundle->views[0].depth.at(kUnknown.x, kUnknown.y) = kNoDepth;  // with full alpha
        return bundle;
    }
};

void expectEmptyIsKept(const SaveOptions& save) {
    const TemporaryFolder folder;
    MaskedViews frames(3);
    Job job;
    const auto done = saveSequence(frames, folder / "a.mp4", save, job);
    ASSERT_TRUE(done) << done.error().text();
    const auto read = openSequence(folder / "a.mp4", {}, job);
    ASSERT_TRUE(read) << read.error().text();
    for (std::size_t k = 0; k < 3; ++k) {
        const auto is = (*read)->frame(k, job);
        ASSERT_TRUE(is) << is.error().text();
        EXPECT_EQ(is->views[0].noDepth, NoDepth::unknown);
        EXPECT_EQ(is->views[1].noDepth, NoDepth::empty);
        for (const ReferenceView& view : is->views)
            EXPECT_EQ(view.texture.at(2, 3).a, 0) << "frame " << k;
        EXPECT_EQ(is->views[0].texture.at(MaskedViews::kUnknown.x, MaskedViews::kUnknown.y).a, 1);
    }
}

TEST(VideoFilms, WhatIsEmptyStaysSo) {
    REQUIRE_VIDEO();
    SaveOptions save;
    save.h264 = 6;
    expectEmptyIsKept(save);
}

TEST(VideoFilms, WhatIsEmptyStaysSoInJpeg) {
    SaveOptions save;
    save.jpegQuality = 92;
    expectEmptyIsKept(save);
}

TEST(VideoFilms, FfmpegReadsWhatWeWrite) {
    REQUIRE_VIDEO();
    Written film(30);
    Job job;
    // Track 1 and 2 are the scene and its descriptors: 0 and 1 of ffmpeg's count.
    const auto expected = film.frames.frame(17, job);
    const ReferenceView& view = expected->views[0];
    const auto codes = rawFrames(film.folder, "a.mp4", 3, "yuv420p10le", 24 * 16 * 3, 24 * 16, 17);
    const DepthCode code{view.nearPlane, view.farPlane, 1023};
    for (std::size_t i = 0; i < codes.size(); ++i)
        ASSERT_EQ(codes[i], code.encode(view.depth.data()[i])) << i;
    const std::string probe =
        "cd '" + film.folder.path().string() +
        "' && ffprobe -v error -select_streams v -show_entries "
        "stream=codec_name,color_range,nb_frames,profile -of csv=p=0 a.mp4 > tracks.txt";
    ASSERT_EQ(std::system(probe.c_str()), 0);
    const auto text = *readFile(film.folder / "tracks.txt", {});
    const std::string tracks(reinterpret_cast<const char*>(text.data()), text.size());
    EXPECT_NE(tracks.find("h264,High,pc,30"), std::string::npos) << tracks;
    EXPECT_NE(tracks.find("h264,High 4:4:4 Predictive,pc,30"), std::string::npos) << tracks;
}

TEST(VideoFilms, TheSameBytesAgain) {
    REQUIRE_VIDEO();
    Written a(12), b(12);
    EXPECT_EQ(*readFile(a.path, {}), *readFile(b.path, {}));
}

TEST(VideoFilms, PassThroughTexts) {
    REQUIRE_VIDEO();
    Written film(6);
    Job job;
    for (const char* text : {"t.bt", "t.xmt"}) {
        auto document = readMpeg4(film.path, job);
        ASSERT_TRUE(document);
        ASSERT_TRUE(writeMpeg4(*document, film.folder / text, job));
        const auto read = openSequence(film.folder / text, {}, job);
        ASSERT_TRUE(read) << read.error().text();
        const auto is = (*read)->frame(3, job);
        ASSERT_TRUE(is) << is.error().text();
        const auto direct = openSequence(film.path, {}, job);
        expectSameFrame(*is, *(*direct)->frame(3, job));
    }
}

/// Views of such a size, with colours that chroma of half the size would smear.
class OddViews : public MovingViews {
  public:
    OddViews(std::size_t count, glm::ivec2 size) : MovingViews(count), size_(size) {}
    Result<Bundle> frame(std::size_t index, Job& job) override {
        auto bundle = MovingViews::frame(index, job);
        ReferenceView view = mpeg4::makeView(size_.x, size_.y, 8, 1);
        Rgba8Image colour(size_.x, size_.y);
        for (int y = 0; y < size_.y; ++y)
            for (int x = 0; x < size_.x; ++x)
                colour.at(x, y) = x + 1 == size_.x || y + 1 == size_.y
                                      ? glm::u8vec4(200, 30, 40 + 9 * index, 255)
                                      : glm::u8vec4(20 + 6 * x, 90, 120, 255);
        view.texture = Texture(std::move(colour));
        view.depth = Image<float>(size_.x, size_.y, view.nearPlane);
        for (int y = 0; y < size_.y; ++y)
            for (int x = 0; x < size_.x; ++x)
                view.depth.at(x, y) = static_cast<float>(
                    view.depthCode().decode(static_cast<unsigned>(40 + x + 3 * y + 2 * index)));
        bundle->views[0] = std::move(view);
        return bundle;
    }

  private:
    glm::ivec2 size_;
};

TEST(VideoFilms, OddSidesComeBack) {
    REQUIRE_VIDEO();
    for (const glm::ivec2 size : {glm::ivec2(25, 17), glm::ivec2(25, 16), glm::ivec2(24, 17)}) {
        const TemporaryFolder folder;
        OddViews frames(3, size);
        Job job;
        SaveOptions save;
        save.h264 = 4;
        const auto done = saveSequence(frames, folder / "a.mp4", save, job);
        ASSERT_TRUE(done) << done.error().text();
        const auto notes = job.takeNotes();
        EXPECT_TRUE(std::ranges::any_of(notes, [](const std::string& note) {
            return note.find("odd side is H.264 (4:4:4)") != std::string::npos;
        }));
        const auto read = openSequence(folder / "a.mp4", {}, job);
        ASSERT_TRUE(read) << read.error().text();
        for (const std::size_t k : {std::size_t{2}, std::size_t{0}}) {
            const auto is = (*read)->frame(k, job);
            ASSERT_TRUE(is) << is.error().text();
            const auto expected = frames.frame(k, job);
            const ReferenceView &a = is->views[0], &b = expected->views[0];
            ASSERT_EQ(a.depth.size(), size);
            ASSERT_EQ(glm::ivec2(a.texture.width(), a.texture.height()), size);
            for (std::size_t i = 0; i < a.depth.count(); ++i)
                ASSERT_NEAR(a.depth.data()[i], b.depth.data()[i], 1e-5) << i;
            // The last column and row have their own colour: nothing was padded or smeared.
            for (int y = 0; y < size.y; ++y)
                for (int x = 0; x < size.x; ++x)
                    for (int c = 0; c < 3; ++c)
                        ASSERT_NEAR(a.texture.rgba8()->at(x, y)[c], b.texture.rgba8()->at(x, y)[c],
                                    10)
                            << x << " " << y;
        }
        const std::string probe = "cd '" + folder.path().string() +
                                  "' && ffprobe -v error -select_streams v -show_entries "
                                  "stream=width,height,codec_name -of csv=p=0 a.mp4 > sizes.txt && "
                                  "ffmpeg -nostdin -v error -xerror -i a.mp4 -map 0:v -f null -";
        ASSERT_EQ(std::system(probe.c_str()), 0);
        const auto text = *readFile(folder / "sizes.txt", {});
        const std::string line = fmt::format("h264,{},{}\n", size.x, size.y);
        const std::string sizes(reinterpret_cast<const char*>(text.data()), text.size());
        EXPECT_EQ(sizes.substr(0, 2 * line.size()), line + line) << sizes;
    }
}

}  // namespace
}  // namespace stx

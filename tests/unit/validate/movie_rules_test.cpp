// Rules 7xxx: each broken once in a sound film.

#include "formats/mpeg4/container/isobmff.hpp"
#include "formats/mpeg4/mapping/sequence_write.hpp"
#include "formats/validate/validate_mpeg4.hpp"
#include "tests/shared_data.hpp"
#include "tests/unit/sequences/moving_views.hpp"
#include "tests/unit/validate/numbers.hpp"

namespace stx::mpeg4 {
namespace {

/// A film whose first view moves in colour and depth (object descriptors 2 and 3).
struct Film {
    Document document;
    ElementaryStream& stream(int id) {
        auto& update = std::get<UpdateObjectDescriptors>(document.odFrames[0].commands[0]);
        for (ObjectDescriptor& od : update.descriptors)
            if (od.id == id) return od.streams[0];
        throw std::runtime_error("no stream");
    }
    NodePtr texture() {
        const auto& root = std::get<ReplaceScene>(document.frames[0].commands[0]).root;
        for (const NodePtr& node : root->get<NodeList>("children"))
            if (node->is("DepthImage")) return node->get<NodePtr>("diTexture");
        return nullptr;
    }
    NodePtr movie(const char* field = "texture") { return texture()->get<NodePtr>(field); }
};

Film film() {
    TemporaryFolder folder("movie_rules");
    Job job;
    MovingViews frames(4, 25, false);
    auto spool = PictureSpool::create(folder.path());
    auto document = sceneFromSequence(frames, {}, *spool, job);
    if (!document) throw std::runtime_error(document.error().text());
    return {std::move(*document)};
}

Numbers brokenBy(const std::function<void(Film&)>& change) {
    Film broken = film();
    change(broken);
    Job job;
    return numbersOf(validate(broken.document, {}, {}, job));
}

TEST(ValidateMovies, AFilmOfOursIsSound) {
    EXPECT_EQ(brokenBy([](Film&) {}), Numbers{});
}

/// Takes the points of a sample of depth away.
void emptyDepth(Film& f, std::size_t sample) {
    ByteRange& data = f.stream(3).samples[sample].data;
    const auto bytes = data.load(Limits());
    ASSERT_TRUE(bytes);
    const auto info = probeImage(*bytes);
    ASSERT_TRUE(info);
    const std::vector<std::uint16_t> none(static_cast<std::size_t>(info->width) *
                                          static_cast<std::size_t>(info->height));
    const auto png = encodePng(info->width, info->height, 1, info->bits, none.data(), false);
    ASSERT_TRUE(png);
    data = ByteRange::of(*png);
}

TEST(ValidateMovies, AViewMayBeWithoutAPointForAWhile) {
    EXPECT_EQ(brokenBy([](Film& f) { emptyDepth(f, 0); }), Numbers{});
    EXPECT_EQ(brokenBy([](Film& f) {
                  for (const std::size_t sample : {0u, 1u, 2u}) emptyDepth(f, sample);
              }),
              Numbers{});
    EXPECT_EQ(brokenBy([](Film& f) {
                  for (const std::size_t sample : {0u, 1u, 2u, 3u}) emptyDepth(f, sample);
              }),
              Numbers{4006});
}

TEST(ValidateMovies, PicturesOfAPairHaveTheSameTimes) {
    EXPECT_EQ(brokenBy([](Film& f) { f.stream(3).samples.pop_back(); }), Numbers{7001});
    EXPECT_EQ(brokenBy([](Film& f) { f.stream(3).samples[2].time += 10; }), Numbers{7001});
}

TEST(ValidateMovies, PairsRunTogether) {
    EXPECT_EQ(brokenBy([](Film& f) { f.movie()->set("startTime", 1.0); }), Numbers{7002});
    EXPECT_EQ(brokenBy([](Film& f) { f.movie("depth")->set("speed", 2.0f); }), Numbers{7002});
    EXPECT_EQ(brokenBy([](Film& f) { f.stream(3).ocrEsId = std::uint16_t{3}; }), Numbers{7002});
}

TEST(ValidateMovies, LoopsNeedAClock) {
    const auto loop = [](Film& f) {
        f.movie()->set("loop", true);
        f.movie("depth")->set("loop", true);
    };
    EXPECT_EQ(brokenBy(loop), Numbers{7003});
    EXPECT_EQ(brokenBy([&](Film& f) {
                  loop(f);
                  f.stream(2).ocrEsId = f.stream(3).ocrEsId = std::uint16_t{3};
              }),
              Numbers{});
}

TEST(ValidateMovies, FilesKeepTheClock) {
    Film looping = film();
    looping.movie()->set("loop", true);
    looping.movie("depth")->set("loop", true);
    looping.stream(2).ocrEsId = looping.stream(3).ocrEsId = std::uint16_t{3};
    Job job;
    const auto bytes = writeMp4(looping.document, job);
    ASSERT_TRUE(bytes) << bytes.error().text();
    const auto again = readMp4(ByteSource::fromBytes(*bytes), job);
    ASSERT_TRUE(again) << again.error().text();
    EXPECT_EQ(numbersOf(validate(*again, {}, {}, job)), Numbers{});
    Film read{*again};
    EXPECT_EQ(read.stream(2).ocrEsId, std::uint16_t{3});
    EXPECT_EQ(read.stream(3).ocrEsId, std::uint16_t{3});
}

// Files of another program, whose movies loop on a clock of their own: but for the pictures, which
// are on the scene's.
TEST(ValidateMovies, ReadsTheClocksOfOthers) {
    REQUIRE_SHARED(folder, "reference/motion");
    for (const char* name : {"avc.mp4", "hevc.mp4", "m4v.mp4", "imgseq.mp4"}) {
        Job job;
        const auto findings = validateFile(folder / name, {}, job);
        ASSERT_TRUE(findings) << findings.error().text();
        const bool own = name != std::string("imgseq.mp4");
        EXPECT_EQ(numbersOf(*findings), own ? Numbers{} : Numbers{7003}) << name;
    }
}

TEST(ValidateMovies, TheFirstPictureStandsAlone) {
    EXPECT_EQ(brokenBy([](Film& f) { f.stream(2).samples[0].sync = false; }), Numbers{7004});
}

TEST(ValidateMovies, PicturesInTimeAreInAMovieTexture) {
    EXPECT_EQ(brokenBy([](Film& f) {
                  for (const char* field : {"texture", "depth"}) {
                      NodePtr still = makeNode("ImageTexture");
                      still->set("url", f.movie(field)->value(std::string_view("url")));
                      f.texture()->set(std::string_view(field), still);
                  }
              }),
              Numbers{7005});
}

TEST(ValidateMovies, MoviesRunForwards) {
    EXPECT_EQ(brokenBy([](Film& f) {
                  f.movie()->set("speed", -1.0f);
                  f.movie("depth")->set("speed", -1.0f);
              }),
              Numbers{7006});
}

TEST(ValidateMovies, PicturesKeepTheirSize) {
    EXPECT_EQ(brokenBy([](Film& f) {
                  const std::vector<std::uint8_t> grey(4 * 4, 128);
                  f.stream(3).samples[2].data =
                      ByteRange::of(*encodePng(4, 4, 1, 8, grey.data(), false));
              }),
              Numbers{7007});
}

TEST(ValidateMovies, EditListsShowEveryPicture) {
    EXPECT_EQ(brokenBy([](Film& f) {
                  for (const int id : {2, 3}) f.stream(id).edits = {1000, {{80, 0, 0x10000}}};
              }),
              Numbers{7008});
}

}  // namespace
}  // namespace stx::mpeg4

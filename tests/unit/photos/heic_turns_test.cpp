// HEIC whose picture and depth are cut, turned and mirrored by properties of their items: the file
// of a phone, in which properties that decoding does not need become others.
#include <algorithm>

#include <gtest/gtest.h>

#include "formats/photos/photo.hpp"
#include "tests/made_photos.hpp"
#include "tests/shared_data.hpp"

using namespace stx;

namespace {

/// Boxes of pug.heic, by where they begin: the profile of the picture and its tiles, how both
/// pictures are turned, what pixels they have, and what the gain map is, which only that has.
constexpr std::size_t kProfile = 1580, kTurnOfBoth = 2280, kPictureBits = 2289, kDepthBits = 2438,
                      kGainMapKind = 2452;
/// The lists of properties: of the tiles (ispe, colr, hvcC), six bytes each; of the picture (colr,
/// ispe, irot, pixi) and the depth (hvcC, ispe, irot, pixi, auxC).
constexpr std::size_t kTileLists = 2711, kTiles = 48, kPictureList = 2999, kDepthList = 3014;
constexpr int kSizeOfTiles = 3, kGainMapKindNumber = 10;

Bytes pug(const std::filesystem::path& path) {
    return readFile(path, Limits()).value();
}

/// Makes a box another one whose content begins with these bytes.
void become(Bytes& file, std::size_t at, std::string_view was, std::string_view type,
            const Bytes& content) {
    const std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
    ASSERT_EQ(text.substr(at + 4, 4), was);
    std::memcpy(file.data() + at + 4, type.data(), 4);
    std::ranges::copy(content, file.begin() + static_cast<std::ptrdiff_t>(at + 8));
}

/// Size, and how far the middle is from the picture's.
Bytes clap(std::uint32_t width, std::uint32_t height, int right, int down) {
    return made::numbers({{width, 4},
                          {1, 4},
                          {height, 4},
                          {1, 4},
                          {static_cast<std::uint32_t>(right), 4},
                          {1, 4},
                          {static_cast<std::uint32_t>(down), 4},
                          {1, 4}});
}

struct Decoded {
    photos::Photo photo;
    Rgba8Image colour;
    Image<float> depth;
};

Result<Decoded> decoded(Bytes file) {
    Job job;
    std::string note;
    Decoded out;
    STX_TRY(out.photo,
            photos::openPhoto(std::make_shared<const Bytes>(std::move(file)), {}, job.limits));
    out.photo.colours = {};  // which the tests need for a cut
    STX_TRY(out.colour, photos::decodeColour(out.photo, note, job));
    STX_TRY(auto depth, photos::decodeDepth(out.photo, job));
    out.depth = std::move(depth.values);
    return out;
}

/// Whether each pixel of a picture is that of another one at the place that `from` gives.
template <class T, class From>
bool isPartOf(const Image<T>& part, const Image<T>& whole, const From& from) {
    for (int y = 0; y < part.height(); ++y)
        for (int x = 0; x < part.width(); ++x) {
            const glm::ivec2 at = from(x, y);
            if (!whole.contains(at.x, at.y) || part.at(x, y) != whole.at(at.x, at.y)) return false;
        }
    return true;
}

// HEIC needs a module that a build may lack.
#define DECODED(name, file)                                                                 \
    auto name##Result = decoded(file);                                                      \
    if (!name##Result && name##Result.error().text().find("stx_heif") != std::string::npos) \
        GTEST_SKIP() << name##Result.error().text();                                        \
    ASSERT_TRUE(name##Result) << name##Result.error().text();                               \
    const Decoded& name = *name##Result

}  // namespace

TEST(HeicTurns, CutsAreTakenOutOfPictureDepthAndCamera) {
    REQUIRE_SHARED(path, "data/phones/apple-heic/pug.heic");
    Bytes file = pug(path);
    DECODED(whole, file);
    // Half of both sides, a quarter to the right of the middle and an eighth above it.
    become(file, kProfile, "colr", "clap", clap(2016, 1512, 1008, -378));
    become(file, kGainMapKind, "auxC", "clap", clap(384, 288, 192, -72));
    for (std::size_t i = 0; i < kTiles; ++i) file[kTileLists + 6 * i + 4] = std::byte{kSizeOfTiles};
    file[kDepthList + 6] = std::byte{0x80 | kGainMapKindNumber};
    std::swap(file[kPictureList + 3], file[kPictureList + 4]);  // its size comes first
    DECODED(cut, file);
    ASSERT_EQ(cut.colour.size(), glm::ivec2(2016, 1512));
    ASSERT_EQ(cut.depth.size(), glm::ivec2(384, 288));
    EXPECT_TRUE(isPartOf(cut.colour, whole.colour,
                         [](int x, int y) { return glm::ivec2(x + 2016, y + 378); }));
    EXPECT_TRUE(
        isPartOf(cut.depth, whole.depth, [](int x, int y) { return glm::ivec2(x + 384, y + 72); }));
    EXPECT_NEAR(cut.photo.intrinsics->cx, whole.photo.intrinsics->cx - 2016, 1e-9);
    EXPECT_NEAR(cut.photo.intrinsics->cy, whole.photo.intrinsics->cy - 378, 1e-9);
    EXPECT_EQ(cut.photo.intrinsics->fx, whole.photo.intrinsics->fx);
}

TEST(HeicTurns, CutsThatAreNotThoseOfTheirDepthAreRefused) {
    REQUIRE_SHARED(path, "data/phones/apple-heic/pug.heic");
    Bytes file = pug(path);
    become(file, kGainMapKind, "auxC", "clap", clap(2016, 1512, 0, 0));
    file[kPictureList + 6] = std::byte{0x80 | kGainMapKindNumber};
    const auto open = [&] {
        return photos::openPhoto(std::make_shared<const Bytes>(file), {}, Limits());
    };
    ASSERT_FALSE(open());
    EXPECT_EQ(open().error().code, ErrorCode::unsupported);
    EXPECT_NE(open().error().text().find("not cut alike"), std::string::npos);
    // Beyond the picture.
    for (const Bytes& wrong :
         {clap(5000, 1512, 0, 0), clap(2016, 1512, 1500, 0), clap(0, 2, 0, 0)}) {
        become(file, kGainMapKind, "clap", "clap", wrong);
        ASSERT_FALSE(open());
        EXPECT_EQ(open().error().code, ErrorCode::invalidInput);
        EXPECT_NE(open().error().text().find("4032x3024"), std::string::npos);
    }
}

TEST(HeicTurns, MirrorsTakePictureDepthAndCameraAlong) {
    REQUIRE_SHARED(path, "data/phones/apple-heic/pug.heic");
    const Bytes file = pug(path);
    DECODED(whole, file);
    const glm::ivec2 size = whole.colour.size(), small = whole.depth.size();
    const photos::PhotoIntrinsics k = *whole.photo.intrinsics;
    for (const int axis : {0, 1}) {
        Bytes mirror = file;
        become(mirror, kPictureBits, "pixi", "imir", made::numbers({{axis, 1}}));
        become(mirror, kDepthBits, "pixi", "imir", made::numbers({{axis, 1}}));
        DECODED(mirrored, mirror);
        const auto upsideDown = [&](glm::ivec2 of) {
            return [of](int x, int y) { return glm::ivec2(x, of.y - 1 - y); };
        };
        const auto leftAndRight = [&](glm::ivec2 of) {
            return [of](int x, int y) { return glm::ivec2(of.x - 1 - x, y); };
        };
        // Which one the number means was not agreed for long: the camera follows the pixels.
        const bool sideways = isPartOf(mirrored.colour, whole.colour, leftAndRight(size));
        EXPECT_NE(sideways, isPartOf(mirrored.colour, whole.colour, upsideDown(size))) << axis;
        EXPECT_TRUE(sideways ? isPartOf(mirrored.depth, whole.depth, leftAndRight(small))
                             : isPartOf(mirrored.depth, whole.depth, upsideDown(small)));
        EXPECT_NEAR(mirrored.photo.intrinsics->cx, sideways ? size.x - k.cx : k.cx, 1e-9) << axis;
        EXPECT_NEAR(mirrored.photo.intrinsics->cy, sideways ? k.cy : size.y - k.cy, 1e-9) << axis;
    }
}

TEST(HeicTurns, QuartersComeBeforeMirrorsWhereTheFileSaysSo) {
    REQUIRE_SHARED(path, "data/phones/apple-heic/pug.heic");
    Bytes file = pug(path);
    DECODED(whole, file);
    // A quarter counter-clockwise, then a mirror.
    become(file, kTurnOfBoth, "irot", "irot", made::numbers({{1, 1}}));
    DECODED(turned, file);
    become(file, kPictureBits, "pixi", "imir", made::numbers({{1, 1}}));
    become(file, kDepthBits, "pixi", "imir", made::numbers({{1, 1}}));
    DECODED(both, file);
    const glm::ivec2 size = turned.colour.size();
    ASSERT_EQ(size, glm::ivec2(whole.colour.height(), whole.colour.width()));
    EXPECT_TRUE(isPartOf(turned.colour, whole.colour, [&](int x, int y) {
        return glm::ivec2(whole.colour.width() - 1 - y, x);
    }));
    const photos::PhotoIntrinsics k = *turned.photo.intrinsics, m = *both.photo.intrinsics;
    EXPECT_NEAR(k.cx, whole.photo.intrinsics->cy, 1e-9);
    EXPECT_NEAR(k.cy, whole.colour.width() - whole.photo.intrinsics->cx, 1e-9);
    const bool sideways = isPartOf(both.colour, turned.colour,
                                   [&](int x, int y) { return glm::ivec2(size.x - 1 - x, y); });
    EXPECT_NEAR(m.cx, sideways ? size.x - k.cx : k.cx, 1e-9);
    EXPECT_NEAR(m.cy, sideways ? k.cy : size.y - k.cy, 1e-9);
}

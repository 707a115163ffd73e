#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "formats/images/exif.hpp"
#include "formats/photos/photo.hpp"
#include "tests/made_photos.hpp"

using namespace stx;
using namespace stx::photos;

namespace {

Result<Photo> open(Bytes bytes, bool portrait = false) {
    PhotoOptions options;
    options.portrait = portrait;
    return openPhoto(std::make_shared<const Bytes>(std::move(bytes)), options, Limits());
}

Image<float> distancesOf(const Photo& photo) {
    Job job;
    auto depth = decodeDepth(photo, job);
    EXPECT_TRUE(depth) << depth.error().text();
    if (!depth) return {};
    Camera camera;
    camera.width = depth->values.width();
    camera.height = depth->values.height();
    camera.fx = camera.fy = 16;
    camera.cx = camera.width * 0.5;
    camera.cy = camera.height * 0.5;
    photo.code.toDistances(depth->values, camera, (1 << depth->bits) - 1);
    return depth->values;
}

/// Red of the sharp picture grows to the right; blue is 0 in it and 255 in the blurred one.
bool isSharp(const Photo& photo) {
    Job job;
    std::string note;
    const auto colour = decodeColour(photo, note, job);
    EXPECT_TRUE(colour) << colour.error().text();
    return colour && colour->at(5, 5).b < 60;
}

}  // namespace

TEST(MadePhotos, AppleJpegTakesTheDepthAndTheMatteOfAPortrait) {
    const auto photo = open(made::applePhoto());
    ASSERT_TRUE(photo) << photo.error().text();
    EXPECT_EQ(photo->format, "Apple JPEG");
    EXPECT_EQ(photo->accuracy, "absolute");
    EXPECT_EQ(photo->mattes, std::vector<std::string>{"portraiteffectsmatte"});
    EXPECT_EQ(photo->matte.width, 8);
    Job job;
    const auto matte = decodeMatte(*photo, job);
    ASSERT_TRUE(matte) << matte.error().text();
    EXPECT_EQ(matte->height(), 6);
    EXPECT_NEAR(matte->at(6, 3), 6 * 8 + 120, 3);
    ASSERT_TRUE(photo->intrinsics);
    EXPECT_DOUBLE_EQ(photo->intrinsics->fx, 30);
    EXPECT_DOUBLE_EQ(photo->intrinsics->cx, 17);
    const auto z = distancesOf(*photo);
    // Code 8 x of 255 between 0.5 and 2 per unit; JPEG is off by a code or two.
    EXPECT_NEAR(z.at(0, 0), 2, 0.03);
    EXPECT_NEAR(1 / z.at(10, 3), 0.5 + 1.5 * 80 / 255, 0.02);
}

TEST(MadePhotos, AMatteOfAnotherShapeOrLargerThanThePictureIsPassedOver) {
    for (const glm::ivec2 size : {glm::ivec2(8, 7), glm::ivec2(64, 48)}) {
        const auto photo = open(
            made::mpf(made::colourJpeg(),
                      {made::withSegments(made::depthJpeg(size.x, size.y),
                                          {made::xmpSegment(made::matteXmp())}),
                       made::withSegments(made::depthJpeg(), {made::xmpSegment(made::appleXmp())})},
                      {}));
        ASSERT_TRUE(photo) << photo.error().text();
        EXPECT_EQ(photo->mattes.size(), 1u);
        EXPECT_EQ(photo->matte.coding, PhotoImage::Coding::none);
    }
}

TEST(MadePhotos, AreTurnedUprightWithTheirCamera) {
    const auto photo = open(made::applePhoto(6));
    ASSERT_TRUE(photo) << photo.error().text();
    EXPECT_EQ(photo->uprightSize(photo->depth), glm::ivec2(12, 16));
    ASSERT_TRUE(photo->intrinsics);
    // Turned clockwise: the row from below becomes the column.
    EXPECT_DOUBLE_EQ(photo->intrinsics->cx, 24 - 11);
    EXPECT_DOUBLE_EQ(photo->intrinsics->cy, 17);
    const auto z = distancesOf(*photo);
    ASSERT_EQ(z.size(), glm::ivec2(12, 16));
    // Codes grew to the right: now downward, so that it is nearer there.
    EXPECT_LT(z.at(8, 14), z.at(8, 1));
}

TEST(MadePhotos, MirroredCamerasFollowThePicture) {
    for (int orientation = 1; orientation <= 8; ++orientation) {
        const auto photo = open(made::applePhoto(orientation));
        ASSERT_TRUE(photo) << photo.error().text();
        // The pixel of the principal point, carried along by the picture itself.
        Image<float> mark(32, 24, 0.0f);
        mark.at(16, 10) = 1;
        mark = turnedUpright(std::move(mark), orientation);
        const PhotoIntrinsics k = *photo->intrinsics;
        // (17, 11) is the lower right corner of that pixel.
        bool found = false;
        for (const int dx : {-1, 0})
            for (const int dy : {-1, 0}) {
                const int x = static_cast<int>(k.cx) + dx, y = static_cast<int>(k.cy) + dy;
                found = found || (mark.contains(x, y) && mark.at(x, y) == 1);
            }
        EXPECT_TRUE(found) << orientation << ": " << k.cx << " " << k.cy;
    }
}

TEST(MadePhotos, GDepthTakesTheSharpOriginal) {
    const auto photo = open(made::gdepthPhoto());
    ASSERT_TRUE(photo) << photo.error().text();
    EXPECT_EQ(photo->format, "GDepth");
    EXPECT_EQ(photo->colourIs, "original");
    EXPECT_TRUE(isSharp(*photo));
    const auto z = distancesOf(*photo);
    EXPECT_NEAR(z.at(0, 0), 1, 1e-4);  // black is near
    const double v = 80 / 255.0;
    EXPECT_NEAR(z.at(10, 3), 9.0 / (9 - v * 8), 1e-4);
    const auto blurred = open(made::gdepthPhoto(), true);
    ASSERT_TRUE(blurred) << blurred.error().text();
    EXPECT_EQ(blurred->colourIs, "portrait");
    EXPECT_FALSE(isSharp(*blurred));
}

TEST(MadePhotos, GDepthMayHaveBase64InLines) {
    for (const char* lineEnd : {"\n", "\r\n\t ", " "}) {
        const auto photo = open(made::gdepthPhoto(made::colourJpeg(32, 24, 255), "RangeInverse",
                                                  made::depthPng(), made::colourJpeg(),
                                                  "D:Near=\"1\" D:Far=\"9\"", 400, {}, lineEnd));
        ASSERT_TRUE(photo) << photo.error().text();
        EXPECT_NEAR(distancesOf(*photo).at(0, 0), 1, 1e-4);
        EXPECT_TRUE(isSharp(*photo));
    }
}

TEST(MadePhotos, GDepthMayNameItsMd5InSmallLetters) {
    // In both places, or in the packet alone.
    for (const bool both : {true, false}) {
        Bytes file = made::gdepthPhoto();
        const auto text = [&] {
            return std::string_view(reinterpret_cast<const char*>(file.data()), file.size());
        };
        constexpr std::string_view kBefore = "HasExtendedXMP=\"";
        const auto at = text().find(kBefore);
        ASSERT_NE(at, std::string_view::npos);
        const std::string guid(text().substr(at + kBefore.size(), 32));
        const auto firstPart = text().find("http://ns.adobe.com/xmp/extension/");
        bool changed = false;
        for (std::size_t found = text().find(guid); found != std::string_view::npos;
             found = text().find(guid, found + 1)) {
            if (!both && found > firstPart) break;
            for (std::size_t i = found; i < found + guid.size(); ++i) {
                const char c = static_cast<char>(file[i]);
                if (c < 'A' || c > 'F') continue;
                file[i] = static_cast<std::byte>(c - 'A' + 'a');
                changed = true;
            }
        }
        EXPECT_TRUE(changed);
        const auto photo = open(std::move(file));
        ASSERT_TRUE(photo) << photo.error().text();
        EXPECT_NEAR(distancesOf(*photo).at(0, 0), 1, 1e-4);
    }
}

TEST(MadePhotos, GDepthSaysWhichEndOfItsRangeIsNoNumber) {
    const auto errorOf = [](const std::string& attributes) {
        const auto photo = open(made::gdepthPhoto(made::colourJpeg(), "RangeInverse",
                                                  made::depthPng(), {}, attributes, 400));
        EXPECT_FALSE(photo);
        return photo ? std::string() : photo.error().message;
    };
    EXPECT_EQ(errorOf("D:Near=\"0,5\" D:Far=\"8\""),
              "the GDepth:Near of its depth is '0,5'; a finite number like 0.5 is expected");
    EXPECT_EQ(errorOf("D:Near=\"0.5\" D:Far=\"inf\""),
              "the GDepth:Far of its depth is 'inf'; a finite number like 0.5 is expected");
    EXPECT_EQ(errorOf("D:Near=\"0.5\""),
              "it has depth, but not its GDepth:Far; a finite number is expected");
    EXPECT_EQ(errorOf("D:Near=\"0\" D:Far=\"8\""),
              "its depth is from 0 to 8; the first must be above 0 and below the second");
}

TEST(MadePhotos, GDepthOfRaysIsAlongThem) {
    const auto photo = open(made::gdepthPhoto(400, "RangeLinear", "D:MeasureType=\"OpticRay\""));
    ASSERT_TRUE(photo) << photo.error().text();
    const auto z = distancesOf(*photo);
    const double length = std::sqrt(7.5 * 7.5 / 256 + 5.5 * 5.5 / 256 + 1);
    EXPECT_NEAR(z.at(0, 0), 1 / length, 1e-4);
}

TEST(MadePhotos, DynamicDepthFindsItsItems) {
    const auto photo = open(made::dynamicPhoto());
    ASSERT_TRUE(photo) << photo.error().text();
    EXPECT_EQ(photo->format, "Dynamic Depth");
    EXPECT_EQ(photo->accuracy, "absolute");
    EXPECT_TRUE(isSharp(*photo));
    ASSERT_TRUE(photo->intrinsics);
    EXPECT_DOUBLE_EQ(photo->intrinsics->fx, 30);
    EXPECT_DOUBLE_EQ(photo->intrinsics->cy, 13);
    EXPECT_NEAR(distancesOf(*photo).at(10, 3), 0.5 + 8 * 80 / 255.0, 0.1);
}

TEST(MadePhotos, TrailersOfSamsungAndHuaweiHaveOppositeGreys) {
    auto samsung = open(made::samsungPhoto());
    ASSERT_TRUE(samsung) << samsung.error().text();
    EXPECT_TRUE(isSharp(*samsung));
    EXPECT_FALSE(samsung->code.scaled());
    samsung->code.setRange(1, 4);
    EXPECT_NEAR(distancesOf(*samsung).at(0, 0), 4, 1e-4);
    auto huawei = open(made::huaweiPhoto());
    ASSERT_TRUE(huawei) << huawei.error().text();
    EXPECT_TRUE(isSharp(*huawei));
    huawei->code.setRange(1, 4);
    EXPECT_NEAR(distancesOf(*huawei).at(0, 0), 1, 1e-4);
    const auto turned = open(made::huaweiPhoto(0x13));
    ASSERT_TRUE(turned);
    EXPECT_EQ(turned->uprightSize(turned->depth), glm::ivec2(12, 16));
}

TEST(MadePhotos, AnAssumedRangeHasItsMedianAtOne) {
    auto photo = open(made::samsungPhoto());
    ASSERT_TRUE(photo);
    Job job;
    const auto depth = decodeDepth(*photo, job);
    ASSERT_TRUE(depth);
    photo->code.assumeRange(depth->values, 255);
    auto z = distancesOf(*photo);
    const auto middle = z.pixels().begin() + z.count() / 2;
    std::nth_element(z.pixels().begin(), middle, z.pixels().end());
    EXPECT_NEAR(*middle, 1, 0.02);
    EXPECT_NEAR(photo->code.one / photo->code.zero, 4, 1e-9);
}

TEST(MadePhotos, LayoutsThatAreNotReadAreNamed) {
    const auto later = open(made::samsungPhoto(3, "DualShot_DepthMap_5"));
    ASSERT_FALSE(later);
    EXPECT_EQ(later.error().code, ErrorCode::unsupported);
    EXPECT_NE(later.error().text().find("DualShot_DepthMap_5"), std::string::npos);
    const auto version = open(made::samsungPhoto(9));
    ASSERT_FALSE(version);
    EXPECT_EQ(version.error().code, ErrorCode::unsupported);
    // A lossless JPEG, as unfiltered depth of 16 bits is.
    Bytes lossless = made::depthJpeg();
    for (std::size_t i = 0; i + 1 < lossless.size(); ++i)
        if (lossless[i] == std::byte{0xff} && lossless[i + 1] == std::byte{0xc0})
            lossless[i + 1] = std::byte{0xc3};
    const auto sixteen =
        open(made::mpf(made::colourJpeg(),
                       {made::withSegments(lossless, {made::xmpSegment(made::appleXmp())})}, {}));
    ASSERT_FALSE(sixteen);
    EXPECT_EQ(sixteen.error().code, ErrorCode::unsupported);
}

TEST(MadePhotos, WithoutDepthTheySayWhatThereIs) {
    const auto matte = open(made::mpf(
        made::colourJpeg(),
        {made::withSegments(made::depthJpeg(), {made::xmpSegment(made::matteXmp())})}, {}));
    ASSERT_FALSE(matte);
    EXPECT_EQ(matte.error().code, ErrorCode::invalidInput);
    EXPECT_NE(matte.error().text().find("a matte of a portrait"), std::string::npos);
    EXPECT_FALSE(open(made::colourJpeg()));
    EXPECT_FALSE(open(made::mpf(made::colourJpeg(), {made::depthJpeg()}, {}, 1 << 30)));
    EXPECT_FALSE(open(Bytes()));
}

TEST(MadePhotos, HeicBoxesTellSizesTurnAndDepth) {
    for (const int targets : {1, 2}) {
        const auto photo = open(made::heicBoxes(0, targets));
        ASSERT_TRUE(photo) << photo.error().text();
        EXPECT_EQ(photo->format, "Apple HEIC");
        EXPECT_EQ(photo->uprightSize(photo->colour), glm::ivec2(32, 24));
        EXPECT_EQ(photo->uprightSize(photo->depth), glm::ivec2(16, 12));
        EXPECT_DOUBLE_EQ(photo->intrinsics->cx, 17);
    }
    // Three quarters counter-clockwise are one clockwise.
    const auto turned = open(made::heicBoxes(3));
    ASSERT_TRUE(turned) << turned.error().text();
    EXPECT_EQ(turned->uprightSize(turned->colour), glm::ivec2(24, 32));
    EXPECT_DOUBLE_EQ(turned->intrinsics->cx, 24 - 11);
    EXPECT_DOUBLE_EQ(turned->intrinsics->cy, 17);
}

TEST(MadePhotos, HeicColoursAreThoseOfTheProfileOrElseOfTheCodes) {
    const auto colr = [](std::string_view kind, const Bytes& rest) {
        Bytes out;
        made::append(out, kind);
        out.insert(out.end(), rest.begin(), rest.end());
        return out;
    };
    const Bytes profile(5, std::byte{7});
    const Bytes icc = colr("prof", profile);
    const auto codes = [&](std::uint32_t primaries, std::uint32_t transfer) {
        return colr("nclx", made::numbers({{primaries, 2}, {transfer, 2}, {6, 2}, {0x80, 1}}));
    };
    const auto coloursOf = [](const std::vector<Bytes>& colours) {
        const auto photo = open(made::heicBoxes(0, 1, colours));
        EXPECT_TRUE(photo) << photo.error().text();
        return photo ? photo->colours : photos::FileColours();
    };
    EXPECT_TRUE(coloursOf({}).profile.empty());
    EXPECT_EQ(coloursOf({icc}).profile, profile);
    EXPECT_EQ(coloursOf({icc, codes(1, 13)}).profile, profile);
    EXPECT_EQ(coloursOf({codes(1, 13), icc}).profile, profile);
    Rgba8Image picture(1, 1, {120, 90, 60, 255});
    EXPECT_EQ(madeSrgb(picture, coloursOf({codes(1, 13)})), "");
    EXPECT_EQ(picture.at(0, 0), glm::u8vec4(120, 90, 60, 255));
    EXPECT_NE(madeSrgb(picture, coloursOf({codes(12, 13)})), "");
    EXPECT_EQ(picture.at(0, 0), glm::u8vec4(126, 88, 55, 255));
    EXPECT_EQ(coloursOf({codes(9, 16)}).note,
              "its colours are coded by the primaries 9 and the transfer function 16 of ITU-T "
              "H.273, which are not converted: they are taken for sRGB");
    EXPECT_TRUE(coloursOf({colr("nclx", {})}).profile.empty());
}

TEST(MadePhotos, CutAnywhereTheyAreAnErrorOrAPhoto) {
    for (const Bytes& whole : {made::applePhoto(), made::gdepthPhoto(), made::dynamicPhoto(),
                               made::samsungPhoto(), made::huaweiPhoto(), made::heicBoxes(1, 2)})
        for (std::size_t n = 0; n < whole.size(); n += n < 400 ? 1 : 13) {
            const auto photo = open(Bytes(whole.begin(), whole.begin() + static_cast<long>(n)));
            if (photo) continue;
            EXPECT_FALSE(photo.error().message.empty());
            EXPECT_TRUE(photo.error().code == ErrorCode::invalidInput ||
                        photo.error().code == ErrorCode::unsupported);
        }
}

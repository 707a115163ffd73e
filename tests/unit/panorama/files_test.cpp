#include <filesystem>

#include <gtest/gtest.h>

#include "formats/environment/environment_files.hpp"
#include "formats/exr/exr_file.hpp"
#include "formats/images/exif.hpp"
#include "formats/images/images.hpp"
#include "formats/panorama/panorama_files.hpp"
#include "lib/model/srgb8.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

/// A panorama whose colours tell directions.
PanoramaImage paintedDirections(int width) {
    PanoramaImage out{Rgba8Image(width, width / 2)};
    for (int y = 0; y < width / 2; ++y)
        for (int x = 0; x < width; ++x)
            out.pixels.at(x, y) = glm::u8vec4(
                127.5 * (PanoramaImage::direction({x + 0.5, y + 0.5}, width) + 1.0) + 0.5, 255);
    return out;
}

/// The direction that a colour (0..255) tells.
glm::dvec3 directionOf(glm::dvec3 colour) {
    return glm::normalize(colour / 127.5 - 1.0);
}

glm::dvec3 directionOfLight(const float* rgb) {
    return directionOf(255.0 *
                       glm::dvec3(srgbByTable(rgb[0]), srgbByTable(rgb[1]), srgbByTable(rgb[2])));
}

TEST(PanoramaFiles, EnvironmentMapsAreOpenExrs) {
    const TemporaryFolder folder;
    const auto panorama = paintedDirections(256);
    Job job;
    for (const int faceSize : {0, 33}) {
        const auto path = folder.path() / "map.exr";
        PanoramaWriteOptions options;
        options.faceSize = faceSize;
        ASSERT_TRUE(writePanorama(panorama, path, options, job));
        const auto reader = ExrReader::open(path, job.limits);
        ASSERT_TRUE(reader);
        const ExrPart& part = reader->parts()[0];
        const auto* kind = part.attribute<std::int64_t>("envmap");
        ASSERT_NE(kind, nullptr);
        EXPECT_EQ(*kind, faceSize > 0 ? 1 : 0);
        EXPECT_EQ(part.width, faceSize > 0 ? 33 : 256);
        EXPECT_EQ(part.height, faceSize > 0 ? 198 : 128);
        std::vector<float> rgb(static_cast<std::size_t>(part.width * part.height) * 3);
        ASSERT_TRUE(reader->readPart(
            0, {{"R", rgb.data(), 3}, {"G", rgb.data() + 1, 3}, {"B", rgb.data() + 2, 3}}));
        // What Imf::LatLongMap and Imf::CubeMap say of these pixels, turned by half a turn about Y.
        struct Place {
            int x, y;
            glm::dvec3 direction;
        };
        const std::vector<Place> latlong = {{0, 0, {0, 1, 0}},
                                            {127, 127, {0, -1, 0}},
                                            {0, 63, {0, 0.012, 1}},
                                            {128, 63, {0.012, 0.012, -1}},
                                            {64, 63, {-1, 0.012, 0.0}}};
        const std::vector<Place> cube = {
            {16, 16, {-1, 0, 0}},  {16, 49, {1, 0, 0}},  {16, 82, {0, 1, 0}}, {16, 115, {0, -1, 0}},
            {16, 148, {0, 0, -1}}, {16, 181, {0, 0, 1}}, {0, 0, {-1, 1, 1}},  {32, 66, {-1, 1, -1}},
            {32, 99, {-1, -1, 1}}, {32, 132, {1, 1, -1}}};
        for (const Place& p : faceSize > 0 ? cube : latlong) {
            const auto seen =
                directionOfLight(rgb.data() + static_cast<std::size_t>(p.y * part.width + p.x) * 3);
            EXPECT_LT(glm::distance(seen, glm::normalize(p.direction)), 0.03)
                << p.x << " " << p.y << ": " << seen.x << " " << seen.y << " " << seen.z;
        }
    }
}

TEST(PanoramaFiles, EveryEndingIsWritten) {
    const TemporaryFolder folder;
    const auto panorama = paintedDirections(64);
    Job job;
    for (const char* name : {"a.png", "a.jpg", "a.tif", "a.webp"}) {
        const auto path = folder.path() / name;
        ASSERT_TRUE(writePanorama(panorama, path, {}, job)) << name;
        const auto bytes = readFile(path, job.limits);
        ASSERT_TRUE(bytes);
        const auto back = decodeRgba8(*bytes, name, job.limits);
        ASSERT_TRUE(back) << name;
        EXPECT_EQ(back->size(), panorama.pixels.size());
        EXPECT_LT(glm::distance(directionOf(glm::dvec3(back->at(40, 20))),
                                PanoramaImage::direction({40.5, 20.5}, 64)),
                  0.06)
            << name;
    }
    ASSERT_TRUE(writePanorama(panorama, folder.path() / "faces", {}, job));
    for (const char* face : kCubeFaceNames)
        EXPECT_TRUE(
            std::filesystem::exists(folder.path() / "faces" / (std::string(face) + ".png")));
    ASSERT_TRUE(writePanorama(panorama, folder.path() / "a.mp4", {}, job));
    const auto scene = openEnvironment(folder.path() / "a.mp4", job);
    ASSERT_TRUE(scene);
    ASSERT_EQ((*scene)->pictureCount(), 6);
    for (std::size_t f = 0; f < 6; ++f) {
        const auto& face = (*scene)->pictures[f];
        ASSERT_EQ(face.width(), 16);
        const glm::dvec3 seen(glm::vec3(face.at(12, 3)) * 255.0f);
        const glm::dvec3 wanted =
            faceDirection(static_cast<CubeFace>(f), glm::dvec2(12.5, 3.5) / 16.0);
        EXPECT_LT(glm::distance(directionOf(seen), glm::normalize(wanted)), 0.06) << f;
    }
}

std::string tiffWithExif(bool little, int orientation, int focal35) {
    std::string tiff;
    const auto number = [&](unsigned value, int size) {
        for (int i = 0; i < size; ++i)
            tiff += static_cast<char>(value >> 8 * (little ? i : size - 1 - i) & 255);
    };
    const auto entry = [&](unsigned tag, unsigned type, unsigned value) {
        number(tag, 2);
        number(type, 2);
        number(1, 4);
        number(value, type == 3 ? 2 : 4);
        if (type == 3) number(0, 2);
    };
    tiff += little ? "II" : "MM";
    number(42, 2);
    number(8, 4);
    number(2, 2);
    entry(0x112, 3, static_cast<unsigned>(orientation));
    entry(0x8769, 4, 38);
    number(0, 4);
    number(1, 2);
    entry(0xa405, 3, static_cast<unsigned>(focal35));
    number(0, 4);
    return tiff;
}

Bytes bytesOf(const std::string& text) {
    const auto* bytes = reinterpret_cast<const std::byte*>(text.data());
    return Bytes(bytes, bytes + text.size());
}

Bytes jpegWithExif(bool little, int orientation, int focal35) {
    const std::string tiff = tiffWithExif(little, orientation, focal35);
    std::string file("\xff\xd8\xff\xe1", 4);
    const std::size_t size = tiff.size() + 8;
    file += static_cast<char>(size >> 8);
    file += static_cast<char>(size & 255);
    file += std::string("Exif\0\0", 6) + tiff + "\xff\xd9";
    return bytesOf(file);
}

TEST(PanoramaFiles, ExifTellsOrientationAndFocalLength) {
    for (const bool little : {true, false}) {
        const Bytes file = jpegWithExif(little, 6, 28);
        EXPECT_EQ(readExif(file).orientation, 6);
        EXPECT_EQ(readExif(file).focal35, 28);
        // Cut off anywhere: what can be read, or nothing.
        for (std::size_t n = 0; n < file.size(); ++n) {
            const ExifNotes notes = readExif(ByteSpan(file).first(n));
            EXPECT_TRUE(notes.orientation == 1 || notes.orientation == 6);
        }
    }
    EXPECT_EQ(readExif(jpegWithExif(true, 9, 28)).orientation, 1);
    // XMP is in a segment of the same kind, often before it.
    Bytes second = jpegWithExif(true, 6, 28);
    constexpr std::string_view kXmp("\xff\xe1\x00\x08http:/", 10);
    const auto xmp = std::as_bytes(std::span(kXmp));
    second.insert(second.begin() + 2, xmp.begin(), xmp.end());
    EXPECT_EQ(readExif(second).orientation, 6);
}

/// Of either order of bytes; and one whose directory is behind more than libexif reads.
TEST(PanoramaFiles, TagsOfATiffItselfTellThemToo) {
    for (const bool little : {true, false}) {
        const Bytes file = bytesOf(tiffWithExif(little, 6, 28));
        EXPECT_EQ(readExif(file).orientation, 6);
        EXPECT_TRUE(readExif(file).oriented);
        EXPECT_EQ(readExif(file).focal35, 28);
        for (std::size_t n = 0; n < file.size(); ++n) {
            const ExifNotes notes = readExif(ByteSpan(file).first(n));
            EXPECT_TRUE(notes.orientation == 1 || notes.orientation == 6);
        }
    }
    EXPECT_EQ(readExif(bytesOf(tiffWithExif(true, 9, 28))).orientation, 1);
    // OpenImageIO and others write it into each file.
    EXPECT_FALSE(readExif(bytesOf(tiffWithExif(true, 1, 28))).oriented);
    EXPECT_TRUE(readExif(jpegWithExif(true, 1, 28)).oriented);
}

TEST(PanoramaFiles, BigTiffTellsItsSizeAndOrientation) {
    std::string tiff("MM\0\x2b\0\x08\0\0", 8);
    const auto number = [&](std::uint64_t value, int size) {
        for (int i = size - 1; i >= 0; --i) tiff += static_cast<char>(value >> 8 * i & 255);
    };
    number(16, 8);
    number(3, 8);
    for (const auto& [tag, type, value] :
         {std::tuple{256, 4, 70000}, std::tuple{257, 3, 12}, std::tuple{274, 3, 8}}) {
        number(static_cast<unsigned>(tag), 2);
        number(static_cast<unsigned>(type), 2);
        number(1, 8);
        // To the left in its field.
        const int size = type == 3 ? 2 : 4;
        number(static_cast<unsigned>(value), size);
        number(0, 8 - size);
    }
    number(0, 8);
    EXPECT_EQ(storedSizeOfTiff(bytesOf(tiff)), glm::ivec2(70000, 12));
    EXPECT_EQ(readExif(bytesOf(tiff)).orientation, 8);
    EXPECT_EQ(storedSizeOfTiff(jpegWithExif(true, 6, 28)), glm::ivec2(0));
}

TEST(PanoramaFiles, PicturesAreTurnedUpright) {
    // Upright it is a b c / d e f; where its first pixel is, for each orientation (EXIF 2.3).
    Rgba8Image upright(3, 2);
    for (int i = 0; i < 6; ++i)
        upright.pixels()[static_cast<std::size_t>(i)] = glm::u8vec4(i, 0, 0, 255);
    const char* stored[] = {"abcdef", "cbafed", "fedcba", "defabc",
                            "adbecf", "cfbead", "fcebda", "daebfc"};
    for (int o = 1; o <= 8; ++o) {
        Rgba8Image picture(o < 5 ? 3 : 2, o < 5 ? 2 : 3);
        for (std::size_t i = 0; i < 6; ++i)
            picture.pixels()[i] = glm::u8vec4(stored[o - 1][i] - 'a', 0, 0, 255);
        EXPECT_TRUE(turnedUpright(picture, o) == upright) << o;
    }
}

}  // namespace
}  // namespace stx

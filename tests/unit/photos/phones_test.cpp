#include <algorithm>
#include <cmath>
#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "formats/images/exif.hpp"
#include "formats/images/images.hpp"
#include "formats/imagesets/kinds.hpp"
#include "formats/photos/photo.hpp"
#include "tests/shared_data.hpp"

using namespace stx;

namespace {

struct Read {
    imagesets::SetDescription set;
    imagesets::StoredView stored;  ///< depth as codes
    Image<float> distances;
};

Result<Read> readPhoto(const std::filesystem::path& file) {
    Job job;
    Read out;
    STX_TRY(out.set, imagesets::describePhoto(file, {}, job));
    const auto& view = out.set.views.front();
    STX_TRY(out.stored, view.load(view, job));
    out.distances = out.stored.depth;
    STX_CHECK(view.distances(out.distances,
                             view.camera.resized(out.distances.width(), out.distances.height()),
                             out.stored.largest, job));
    return out;
}

/// HEIC needs a module that a build may lack.
bool lacksHeif(const Error& error) {
    return error.code == ErrorCode::unsupported &&
           error.text().find("stx_heif") != std::string::npos;
}

/// The colours as the file has them, upright, before a profile changes them.
Rgba8Image coloursOf(const photos::Photo& photo) {
    Job job;
    std::string note;
    photos::Photo plain = photo;
    plain.colours = {};
    if (plain.colour.coding == photos::PhotoImage::Coding::heif)
        return photos::decodeColour(plain, note, job).value();
    return turnedUpright(decodeRgba8(plain.colour.bytes, "photo", job.limits).value(),
                         plain.orientation);
}

glm::dvec3 meanAround(const Rgba8Image& picture, double fx, double fy) {
    // Five pixels of a picture of 400.
    const double pixel = std::max(picture.width(), picture.height()) / 400.0;
    const double reach = 2.5 * pixel;
    const auto at = [pixel](double f, int size) {
        return (std::floor(f * std::round(size / pixel)) + 0.5) * pixel;
    };
    glm::dvec3 sum(0);
    int count = 0;
    for (int y = static_cast<int>(at(fy, picture.height()) - reach);
         y < at(fy, picture.height()) + reach; ++y)
        for (int x = static_cast<int>(at(fx, picture.width()) - reach);
             x < at(fx, picture.width()) + reach; ++x) {
            if (!picture.contains(x, y)) continue;
            sum += glm::dvec3(picture.at(x, y));
            ++count;
        }
    return sum / static_cast<double>(count);
}

}  // namespace

TEST(PhotosOfPhones, HaveTheSizesCamerasAndDistancesThatAreKnown) {
    REQUIRE_SHARED(folder, "data/phones/expected.json");
    std::ifstream in(folder);
    const auto expected = nlohmann::json::parse(in);
    for (const auto& [name, wanted] : expected.items()) {
        SCOPED_TRACE(name);
        const auto read = readPhoto(folder.parent_path() / name);
        if (!read && lacksHeif(read.error())) continue;
        ASSERT_TRUE(read) << read.error().text();
        const Camera& camera = read->set.views.front().camera;
        EXPECT_EQ(camera.width, wanted["uprightSize"][0]);
        EXPECT_EQ(camera.height, wanted["uprightSize"][1]);
        EXPECT_EQ(read->stored.texture.width(), wanted["uprightSize"][0]);
        EXPECT_EQ(read->distances.width(), wanted["uprightDepthSize"][0]);
        EXPECT_EQ(read->distances.height(), wanted["uprightDepthSize"][1]);
        for (const auto& [key, value] :
             {std::pair{"fx", camera.fx}, {"fy", camera.fy}, {"cx", camera.cx}, {"cy", camera.cy}})
            EXPECT_NEAR(value, wanted[key].get<double>(), 0.001 * wanted[key].get<double>()) << key;
        if (wanted["accuracy"].is_string()) {
            EXPECT_EQ(read->set.photo->accuracy, wanted["accuracy"]);
        }
        for (const auto& sample : wanted["z_samples_xy_fraction"]) {
            const int x = static_cast<int>(sample[0].get<double>() * read->distances.width());
            const int y = static_cast<int>(sample[1].get<double>() * read->distances.height());
            const double z = sample[2];
            EXPECT_NEAR(read->distances.at(x, y), z, 0.005 * z) << sample.dump();
        }
        const Rgba8Image colours = coloursOf(*read->set.photo);
        for (const auto& sample : wanted["colour_samples_400px_mean5x5"]) {
            const glm::dvec3 mean = meanAround(colours, sample[0], sample[1]);
            for (int k = 0; k < 3; ++k)
                EXPECT_NEAR(mean[k], sample[2][static_cast<std::size_t>(k)].get<double>(), 6)
                    << sample.dump();
        }
    }
}

TEST(PhotosOfPhones, HeicDepthIsThatOfAnotherDecoderToTheBit) {
    REQUIRE_SHARED(truth, "data/phones/apple-heic/pug_depth.png");
    const auto folder = truth.parent_path();
    const auto read = readPhoto(folder / "pug.heic");
    if (!read && lacksHeif(read.error())) GTEST_SKIP() << read.error().text();
    ASSERT_TRUE(read) << read.error().text();
    const auto png = decodeImage(readFile(truth, Limits()).value(), "png", Limits());
    ASSERT_TRUE(png);
    const auto& values = std::get<0>(png->values);
    ASSERT_EQ(png->width, read->stored.depth.width());
    for (std::size_t i = 0; i < read->stored.depth.count(); ++i)
        ASSERT_EQ(read->stored.depth.data()[i],
                  values[i * static_cast<std::size_t>(png->channels)]);
    // The same with references to two pictures each, as phones write since iOS 18.
    const auto two = readPhoto(folder.parent_path() / "made/pug-two-targets.heic");
    ASSERT_TRUE(two) << two.error().text();
    EXPECT_TRUE(two->stored.depth == read->stored.depth);
    EXPECT_TRUE(*two->stored.texture.rgba8() == *read->stored.texture.rgba8());
    EXPECT_TRUE(two->set.views.front().camera == read->set.views.front().camera);
}

TEST(PhotosOfPhones, AMatteTellsWhereAPersonIs) {
    REQUIRE_SHARED(file, "data/phones/apple-heic/selfie-mattes.heic");
    const auto read = readPhoto(file);
    if (!read && lacksHeif(read.error())) GTEST_SKIP() << read.error().text();
    ASSERT_TRUE(read) << read.error().text();
    const auto& matte = read->stored.matte;
    ASSERT_EQ(matte.width(), 1158);
    ASSERT_EQ(matte.height(), 1544);
    // Chin and shoulders, and the wall beside and above them.
    for (const glm::ivec2 at : {glm::ivec2(520, 640), {300, 1400}, {1000, 1400}})
        EXPECT_GT(matte.at(at.x, at.y), 250);
    for (const glm::ivec2 at : {glm::ivec2(100, 640), {520, 200}, {1000, 640}})
        EXPECT_LT(matte.at(at.x, at.y), 5);
}

TEST(PhotosOfPhones, MadeFilesGiveTheirDepthBack) {
    REQUIRE_SHARED(truth, "data/phones/made/depth-in-made-files.jpg");
    const auto depth = decodeImage(readFile(truth, Limits()).value(), "jpeg", Limits());
    ASSERT_TRUE(depth);
    const auto& values = std::get<0>(depth->values);
    for (const char* name :
         {"made_samsung_sef.jpg", "made_huawei_edof.jpg", "made_dynamic_depth.jpg"}) {
        SCOPED_TRACE(name);
        const auto read = readPhoto(truth.parent_path() / name);
        ASSERT_TRUE(read) << read.error().text();
        ASSERT_EQ(read->stored.depth.count(), values.size());
        // The dynamic one holds it coded once more.
        const bool again = std::string(name) == "made_dynamic_depth.jpg";
        double sum = 0;
        for (std::size_t i = 0; i < values.size(); ++i) {
            const double off = std::abs(read->stored.depth.data()[i] - values[i]);
            sum += off;
            ASSERT_LE(off, again ? 12 : 0);
        }
        EXPECT_LT(sum / static_cast<double>(values.size()), 0.5);
    }
}

TEST(PhotosOfPhones, WithoutDepthOrBrokenTheyAreOneError) {
    REQUIRE_SHARED(folder, "data/phones/broken");
    for (const auto& from : {folder, folder.parent_path() / "without"})
        for (const auto& entry : std::filesystem::directory_iterator(from)) {
            SCOPED_TRACE(entry.path().string());
            const auto read = readPhoto(entry.path());
            ASSERT_FALSE(read);
            EXPECT_TRUE(read.error().code == ErrorCode::invalidInput ||
                        read.error().code == ErrorCode::unsupported);
            EXPECT_EQ(read.error().text().find('\n'), std::string::npos);
        }
    const auto eyes = readPhoto(folder.parent_path() / "without/stereo-pair.heic");
    ASSERT_FALSE(eyes);
    EXPECT_NE(eyes.error().text().find("a pair for two eyes"), std::string::npos);
}

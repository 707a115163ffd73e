// OpenEXR's attribute `chromaticities`: colours of other primaries become those of Rec. 709.
#include "formats/exr/exr_primaries.hpp"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cstring>

#include "formats/exr/bundle_exr.hpp"
#include "formats/exr/environment_exr.hpp"
#include "formats/images/images.hpp"
#include "tests/small_bundle.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

using Chromaticities = std::array<float, 8>;  // R, G, B, white
constexpr Chromaticities kBt2020 = {0.708f, 0.292f, 0.17f, 0.797f, 0.131f, 0.046f, 0.3127f, 0.329f};
constexpr std::string_view kConverted =
    "its chromaticities are not those of Rec. 709: colours are converted to these";

/// The same file with other chromaticities in the place of those of Rec. 709, in each part.
void tag(Bytes& file, const Chromaticities& as) {
    static constexpr std::string_view kHead("chromaticities\0chromaticities\0\x20\0\0\0", 34);
    const std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
    std::size_t count = 0;
    for (auto at = text.find(kHead); at != text.npos; at = text.find(kHead, at + 1), ++count)
        std::memcpy(file.data() + at + kHead.size(), as.data(), sizeof(as));
    ASSERT_GT(count, 0u);
}

/// A picture of one colour, its channels, and a depth beside them.
Bytes exrOf(const std::vector<std::pair<std::string, float>>& channels, int width, int height) {
    const TemporaryFolder folder;
    ExrPart part;
    part.width = part.displayWidth = width;
    part.height = part.displayHeight = height;
    std::vector<Image<float>> planes;
    std::vector<ExrConstPixels> pixels;
    for (const auto& [name, value] : channels) {
        part.channels.push_back({name});
        planes.emplace_back(width, height, value);
    }
    for (std::size_t i = 0; i < planes.size(); ++i)
        pixels.push_back({channels[i].first, planes[i].data(), 1});
    auto file = OutputFile::create(folder / "a.exr");
    auto writer = ExrWriter::create(*file, {part});
    EXPECT_TRUE(writer && writer->writePart(0, pixels) && writer->finish() && file->commit());
    return *readFile(folder / "a.exr", Limits());
}

void expectNear(glm::dvec3 is, glm::dvec3 expected, double tolerance) {
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(is[k], expected[k], tolerance) << "channel " << k;
}

TEST(ExrPrimaries, TheMatrixIsThatOfTheStandards) {
    // ITU-R BT.2087-0, M2 of section 4 inverted; four digits there.
    const auto bt2020 =
        rec709From({{0.708, 0.292}, {0.17, 0.797}, {0.131, 0.046}, {0.3127, 0.329}});
    ASSERT_TRUE(bt2020);
    expectNear(*bt2020 * glm::dvec3(1, 0, 0), {1.6605, -0.1246, -0.0182}, 1e-4);
    expectNear(*bt2020 * glm::dvec3(0, 1, 0), {-0.5876, 1.1329, -0.1006}, 1e-4);
    expectNear(*bt2020 * glm::dvec3(0, 0, 1), {-0.0728, -0.0083, 1.1187}, 1e-4);
    // ACES2065-1, whose blue has a negative y and whose white is another: Bradford's adaptation, as
    // in the Academy's transform to Rec. 709.
    const auto ap0 = rec709From({{0.7347, 0.2653}, {0, 1}, {0.0001, -0.077}, {0.32168, 0.33767}});
    ASSERT_TRUE(ap0);
    expectNear(*ap0 * glm::dvec3(1, 1, 1), {1, 1, 1}, 1e-12);
    expectNear(*ap0 * glm::dvec3(1, 0, 0), {2.5217, -0.2765, -0.0154}, 5e-4);
    const auto same = rec709From({});
    ASSERT_TRUE(same);
    expectNear(*same * glm::dvec3(0.2, 0.5, 0.7), {0.2, 0.5, 0.7}, 1e-12);
    EXPECT_FALSE(rec709From({{0, 0}, {0, 0}, {0, 0}, {0, 0}}));
    EXPECT_FALSE(rec709From({{0.64, 0.33}, {0.3, 0.6}, {0.15, 0.06}, {0.7, 0.2}}));
}

TEST(ExrPrimaries, OfPicturesAreConvertedAndDepthIsNot) {
    Bytes file = exrOf({{"R", 0.2f}, {"G", 0.5f}, {"B", 0.2f}, {"Z", 3}}, 4, 3);
    const auto plain = decodeImage(file, "a.exr", Limits());
    ASSERT_TRUE(plain);
    tag(file, kBt2020);
    auto image = decodeImage(file, "a.exr", Limits());
    ASSERT_TRUE(image) << image.error().text();
    EXPECT_EQ(std::get<2>(image->values), std::get<2>(plain->values)) << "as the file has them";
    EXPECT_EQ(toRec709(*image), kConverted);
    EXPECT_EQ(toRec709(*image), "") << "once";
    const auto& values = std::get<2>(image->values);
    expectNear({values[0], values[1], values[2]}, {0.02371, 0.53987, 0.16981}, 1e-4);
    EXPECT_EQ(values[3], 3);
    const auto coded = decodeRgba8(file, "a.exr", Limits());
    ASSERT_TRUE(coded);
    EXPECT_EQ(coded->at(1, 1), glm::u8vec4(43, 194, 114, 255));

    for (const char* names : {"Z", "Y"}) {  // without R, G and B there is nothing to convert
        Bytes grey = exrOf({{names, 0.2f}}, 4, 3);
        tag(grey, kBt2020);
        auto decoded = decodeImage(grey, "a.exr", Limits());
        ASSERT_TRUE(decoded);
        EXPECT_EQ(toRec709(*decoded), "");
        EXPECT_EQ(std::get<2>(decoded->values)[0], 0.2f);
    }
}

TEST(ExrPrimaries, ThatAreNoneAreNoted) {
    Bytes file = exrOf({{"R", 0.2f}, {"G", 0.5f}, {"B", 0.2f}}, 4, 3);
    tag(file, {});
    auto image = decodeImage(file, "a.exr", Limits());
    ASSERT_TRUE(image) << image.error().text();
    EXPECT_EQ(toRec709(*image),
              "its chromaticities are no primaries of a white: colours are taken as they are");
    EXPECT_EQ(std::get<2>(image->values)[1], 0.5f);
}

TEST(ExrPrimaries, OfEnvironmentsAndBundlesAreConverted) {
    const TemporaryFolder folder;
    Bytes around = exrOf({{"R", 0.2f}, {"G", 0.5f}, {"B", 0.2f}}, 8, 4);
    tag(around, kBt2020);
    ASSERT_TRUE(writeFile(folder / "around.exr", around));
    Job job;
    const auto environment = readEnvironmentExr(folder / "around.exr", job);
    ASSERT_TRUE(environment) << environment.error().text();
    expectNear(glm::dvec3((*environment)->pictures.at(0).at(3, 2)), {0.02371, 0.53987, 0.16981},
               1e-4);
    EXPECT_EQ(job.takeNotes(), std::vector<std::string>{fmt::format(
                                   "'{}': {}", (folder / "around.exr").string(), kConverted)});

    const Bundle bundle = smallBundle(2, 32, false, true);
    ASSERT_TRUE(writeExrViews(*viewsOf(bundle), folder / "b.exr", job));
    Bytes bytes = *readFile(folder / "b.exr", Limits());
    tag(bytes, kBt2020);
    const auto back = readExrBundle(bytes, "b.exr", job);
    ASSERT_TRUE(back) << back.error().text();
    EXPECT_EQ(job.takeNotes(), std::vector<std::string>{fmt::format("'b.exr': {}", kConverted)});
    const auto matrix =
        rec709From({{0.708, 0.292}, {0.17, 0.797}, {0.131, 0.046}, {0.3127, 0.329}});
    for (std::size_t v = 0; v < 2; ++v) {
        const auto& was = *bundle.views[v].texture.rgbaFloat();
        const auto& is = *back->views[v].texture.rgbaFloat();
        for (std::size_t i = 0; i < was.count(); ++i) {
            if (was.data()[i].a <= 0) continue;
            expectNear(glm::dvec3(is.data()[i]), *matrix * glm::dvec3(was.data()[i]), 1e-5);
            EXPECT_EQ(is.data()[i].a, was.data()[i].a);
        }
        EXPECT_EQ(back->views[v].depth, bundle.views[v].depth);
    }
}

}  // namespace
}  // namespace stx

#include "formats/exr/bundle_exr.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdio>

#include "lib/base/parallel.hpp"
#include "lib/model/srgb8.hpp"
#include "tests/shared_data.hpp"
#include "tests/small_bundle.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

namespace fs = std::filesystem;

Bytes bytesOf(const Bundle& bundle) {
    const TemporaryFolder folder;
    Job job;
    const auto written = writeExrViews(*viewsOf(bundle), folder / "a.exr", job);
    EXPECT_TRUE(written) << written.error().text();
    const auto bytes = readFile(folder / "a.exr", Limits());
    return bytes ? *bytes : Bytes();
}

/// What a program prints; empty with `found` false when it is not installed.
std::string outputOf(const std::string& command, bool& found, int& status) {
    std::string text;
    FILE* pipe = ::popen((command + " 2>&1").c_str(), "r");
    std::array<char, 4096> block{};
    while (const auto n = std::fread(block.data(), 1, block.size(), pipe))
        text.append(block.data(), n);
    status = WEXITSTATUS(::pclose(pipe));
    found = status != 127;
    return text;
}

class BundleOfEachKind : public testing::TestWithParam<std::tuple<int, bool, bool>> {};

TEST_P(BundleOfEachKind, ComesBackToTheBit) {
    const auto [bits, v2, linear] = GetParam();
    const Bundle bundle = smallBundle(5, bits, v2, linear);
    ASSERT_TRUE(bundle.check());
    const Bytes bytes = bytesOf(bundle);
    Job job;
    const auto back = readExrBundle(bytes, "a.exr", job);
    ASSERT_TRUE(back) << back.error().text();
    EXPECT_EQ(differenceOf(bundle, *back), "");
    EXPECT_TRUE(job.takeNotes().empty());
}

INSTANTIATE_TEST_SUITE_P(All, BundleOfEachKind,
                         testing::Combine(testing::Values(8, 16, 32), testing::Bool(),
                                          testing::Bool()));

TEST(BundleExr, FileIsReadInPiecesAndNotWhole) {
    const TemporaryFolder folder;
    const Bundle bundle = smallBundle(2, 16, false, false);
    Job job;
    ASSERT_TRUE(writeExrViews(*viewsOf(bundle), folder / "a.exr", job));
    // Bytes behind the pixels, which no part of the file uses, beyond what may be held at once.
    fs::resize_file(folder / "a.exr", 300u << 20);
    job.limits.maxMemoryBytes = 64u << 20;
    const auto back = readExrBundle(folder / "a.exr", job);
    ASSERT_TRUE(back) << back.error().text();
    EXPECT_EQ(differenceOf(bundle, *back), "");
}

TEST(ExrColour, EachCodeUnderEachAlphaSurvivesHalfFloats) {
    Bundle bundle;
    ReferenceView v;
    v.name = "all";
    v.camera = Camera::fromFieldOfView({}, {1, 0, 0, 0}, {1, 1}, false, 256, 256);
    Rgba8Image image(256, 256);
    for (int a = 0; a < 256; ++a) {
        for (int c = 0; c < 256; ++c) image.at(c, a) = {c, 255 - c, c / 2, a};
    }
    v.texture = Texture(image);
    bleedColour(v.texture);
    v.depth = Image<float>(256, 256, 20.0f);
    bundle.views.push_back(v);
    const Bytes bytes = bytesOf(bundle);
    Job job;
    const auto back = readExrBundle(bytes, "a.exr", job);
    ASSERT_TRUE(back) << back.error().text();
    EXPECT_EQ(back->views[0].texture, v.texture);
    const auto reader = ExrReader::open(bytes, "a.exr", Limits());
    EXPECT_EQ(reader->parts()[0].channel("R")->type, ExrChannel::Type::half);
}

TEST(ExrColour, IsLinearLight) {
    EXPECT_NEAR(linearFromSrgb8(188), 0.5f, 0.003f);
    for (int code = 0; code < 256; ++code) {
        const auto c = static_cast<std::uint8_t>(code);
        EXPECT_EQ(srgb8FromLinear(linearFromSrgb8(c)), c);
        EXPECT_NEAR(linearFromSrgb8(c), linearFromSrgb(static_cast<float>(code) / 255.0f), 1e-6f);
    }
    EXPECT_EQ(srgb8FromLinear(-1.0f), 0);
    EXPECT_EQ(srgb8FromLinear(std::nanf("")), 0);
    EXPECT_EQ(srgb8FromLinear(7.0f), 255);
}

TEST(BundleExr, HeaderTellsAllWithoutPixels) {
    const TemporaryFolder folder;
    const Bundle bundle = smallBundle(3, 16, true, false);
    Job job;
    ASSERT_TRUE(writeExrViews(*viewsOf(bundle), folder / "a.exr", job));
    const auto header = readExrBundleHeader(folder / "a.exr", Limits());
    ASSERT_TRUE(header) << header.error().text();
    EXPECT_EQ(header->title, bundle.title);
    EXPECT_EQ(header->bounds, bundle.bounds);
    EXPECT_STREQ(header->nodeKind(), "SimpleTextureV2");
    EXPECT_FALSE(header->linear);
    ASSERT_EQ(header->views.size(), 3u);
    std::uint64_t bytes = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        const auto& entry = header->views[i];
        EXPECT_EQ(entry.view.name, bundle.views[i].name);
        EXPECT_EQ(entry.view.camera, bundle.views[i].camera);
        EXPECT_EQ(entry.view.nearPlane, bundle.views[i].nearPlane);
        EXPECT_EQ(entry.points, bundle.views[i].pointCount());
        EXPECT_TRUE(entry.normals && entry.splats);
        EXPECT_GT(entry.bytes, 500u);
        bytes += entry.bytes;
    }
    EXPECT_LT(bytes, fs::file_size(folder / "a.exr"));
}

TEST(BundleExr, SameBytesOnAnyNumberOfThreads) {
    const Bundle bundle = smallBundle(4, 16, true, false);
    const Bytes many = bytesOf(bundle);
    const ThreadLimit one(1);
    EXPECT_EQ(bytesOf(bundle), many);
}

TEST(BundleExr, OtherProgramsUnderstandIt) {
    const TemporaryFolder folder;
    Bundle bundle = smallBundle(2, 16, true, false);
    bundle.views[0].camera = Camera::fromFieldOfView({1, 2, 3}, *lookAt({1, 2, 3}, {0, 0, 0}),
                                                     {1.0, 1.2}, false, 17, 23);
    Job job;
    const auto path = folder / "a.exr";
    ASSERT_TRUE(writeExrViews(*viewsOf(bundle), path, job));
    bool found = false;
    int status = 0;
    const std::string header = outputOf("exrheader " + path.string(), found, status);
    if (!found) GTEST_SKIP() << "exrheader is not installed";
    EXPECT_EQ(status, 0) << header;
    for (const char* line :
         {"name (type string): \"view 0\"", "view (type string): \"view 1\"",
          "R, 16-bit floating-point", "Z, 32-bit floating-point", "N.X, 32-bit floating-point",
          "splatU.X, 32-bit floating-point", "worldToCamera (type m44f)", "worldToNDC (type m44f)",
          "compression (type compression): zip, multi-scanline blocks", "chromaticities"}) {
        EXPECT_NE(header.find(line), std::string::npos) << line << "\n" << header;
    }
    EXPECT_EQ(header.find("capDate"), std::string::npos);
    const std::string info = outputOf("oiiotool --info -v -a " + path.string(), found, status);
    if (!found) GTEST_SKIP() << "oiiotool is not installed";
    EXPECT_EQ(status, 0) << info;
    EXPECT_NE(info.find("2 subimages"), std::string::npos) << info;
    // The values, read by another program: premultiplied linear red of a pixel.
    const std::string dump = outputOf("oiiotool --dumpdata " + path.string(), found, status);
    EXPECT_EQ(status, 0) << dump.substr(0, 500);
    const glm::u8vec4 p = bundle.views[0].texture.rgba8()->at(0, 0);
    const std::string red =
        fmt::format("{:.6f}", static_cast<double>(linearFromSrgb8(p.r) * p.a / 255.0f));
    EXPECT_NE(dump.find("Pixel (0, 0): " + red.substr(0, 5)), std::string::npos)
        << red << "\n"
        << dump.substr(0, 300);
}

TEST(BundleExr, StandardAttributesProjectAsOursDo) {
    const Bundle bundle = smallBundle(4, 16, false, false);
    const Bytes bytes = bytesOf(bundle);
    const auto reader = ExrReader::open(bytes, "a.exr", Limits());
    ASSERT_TRUE(reader);
    for (std::size_t i = 0; i < bundle.views.size(); ++i) {
        const auto& part = reader->parts()[i];
        const auto& v = bundle.views[i];
        const auto* ndc = part.attribute<glm::dmat4>("worldToNDC");
        const auto* camera = part.attribute<glm::dmat4>("worldToCamera");
        ASSERT_TRUE(ndc && camera);
        for (int y = 0; y < v.depth.height(); y += 5) {
            for (int x = 0; x < v.depth.width(); x += 5) {
                if (!hasPoint(v.depth.at(x, y))) continue;
                const glm::dvec4 world(v.worldPoint(x, y), 1.0);
                const glm::dvec4 inNdc = *ndc * world;
                EXPECT_NEAR(inNdc.x / inNdc.w * part.displayWidth, x + 0.5, 2e-3);
                EXPECT_NEAR(inNdc.y / inNdc.w * part.displayHeight, y + 0.5, 2e-3);
                const glm::dvec4 inCamera = *camera * world;
                EXPECT_NEAR(inCamera.z, v.depth.at(x, y), 1e-4);  // +Z forward
            }
        }
    }
}

TEST(BundleExr, CamerasOfOtherProgramsAreRead) {
    const Bundle bundle = smallBundle(3, 32, false, true);
    Bytes bytes = bytesOf(bundle);
    const auto reader = ExrReader::open(bytes, "a.exr", Limits());
    ASSERT_TRUE(reader);
    for (std::size_t i = 0; i < bundle.views.size(); ++i) {
        ExrPart part = reader->parts()[i];
        std::erase_if(part.attributes, [](const auto& a) { return a.first.starts_with("stx:"); });
        const auto view = exrCamera(part);
        ASSERT_TRUE(view) << view.error().text();
        const Camera& c = view->camera;
        const Camera& expected = bundle.views[i].camera;
        EXPECT_LT(glm::length(c.position - expected.position), 1e-5);
        EXPECT_GT(std::abs(glm::dot(c.orientation, expected.orientation)), 1 - 1e-10);
        EXPECT_EQ(c.orthographic, expected.orthographic);
        EXPECT_NEAR(c.fx, expected.fx, 1e-4 * expected.fx);
        EXPECT_NEAR(c.cx, expected.cx, 1e-3);
        EXPECT_NEAR(c.cy, expected.cy, 1e-3);
    }
}

TEST(BundleExr, CamerasFollowADataWindowThatWasTrimmed) {
    const Bundle bundle = smallBundle(1, 16, false, false);
    const Bytes bytes = bytesOf(bundle);
    const auto reader = ExrReader::open(bytes, "a.exr", Limits());
    ASSERT_TRUE(reader);
    const Camera& whole = bundle.views[0].camera;
    EXPECT_FALSE(isTrimmed(reader->parts()[0], whole));
    for (const glm::ivec2 at : {glm::ivec2(3, -2), glm::ivec2(0, 0)}) {
        ExrPart part = reader->parts()[0];
        part.originX = at.x;
        part.originY = at.y;
        part.width -= 5;
        const auto trimmed = exrCamera(part);
        ASSERT_TRUE(trimmed) << trimmed.error().text();
        EXPECT_EQ(trimmed->camera.cx, whole.cx - at.x);
        EXPECT_EQ(trimmed->camera.cy, whole.cy - at.y);
        EXPECT_EQ(trimmed->camera.width, whole.width - 5);
        EXPECT_TRUE(isTrimmed(part, trimmed->camera));
    }
    ExrPart part = reader->parts()[0];
    part.width = part.displayWidth = 9;
    const auto resized = exrCamera(part);
    ASSERT_FALSE(resized);
    EXPECT_EQ(
        resized.error().message,
        "part 'view 0': its camera is not one of 9x23 pixels, for stx:fieldOfView is another; "
        "a program has resized the picture and left the camera as it was");
}

TEST(BundleExr, HostileFilesEndInErrors) {
    REQUIRE_SHARED(folder, "data/malformed/images");
    int files = 0;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
        if (entry.path().extension() != ".exr") continue;
        SCOPED_TRACE(entry.path().string());
        ++files;
        Job job;
        const auto bundle = readExrBundle(entry.path(), job);
        EXPECT_FALSE(bundle);
        EXPECT_FALSE(readExrBundleHeader(entry.path(), Limits()));
    }
    EXPECT_GT(files, 10);
}

TEST(BundleExr, EveryCutAndManyFlipsEndCleanly) {
    const Bytes good = bytesOf(smallBundle(2, 16, true, false));
    for (std::size_t size = 0; size < good.size(); size += 1 + size / 64) {
        Job job;
        EXPECT_FALSE(readExrBundle(ByteSpan(good).first(size), "cut", job)) << size;
    }
    std::mt19937 random(5);
    Job job;
    job.limits.maxMemoryBytes = 64 << 20;
    for (int i = 0; i < 600; ++i) {
        Bytes bad = good;
        // Mostly in the headers, where the numbers are.
        const std::size_t range = i % 2 ? std::min<std::size_t>(bad.size(), 3000) : bad.size();
        bad[random() % range] = static_cast<std::byte>(random());
        (void)readExrBundle(bad, "flipped", job);
    }
}

TEST(BundleExr, LimitsAreHeld) {
    const Bytes bytes = bytesOf(smallBundle(3, 16, false, false));
    Job job;
    job.limits.maxMemoryBytes = 4096;
    const auto memory = readExrBundle(bytes, "a.exr", job);
    ASSERT_FALSE(memory);
    EXPECT_NE(memory.error().message.find("--max-memory"), std::string::npos);
    Limits few;
    few.maxViews = 2;
    EXPECT_FALSE(ExrReader::open(bytes, "a.exr", few));
    Limits narrow;
    narrow.maxImageSide = 16;
    EXPECT_FALSE(ExrReader::open(bytes, "a.exr", narrow));
}

TEST(BundleExr, ErrorsNameTheFile) {
    const TemporaryFolder folder;
    const auto missing = readExrBundleHeader(folder / "none.exr", Limits());
    ASSERT_FALSE(missing);
    EXPECT_EQ(missing.error().code, ErrorCode::io);
    Job job;
    const auto nothing = readExrBundle(ByteSpan(), "b.exr", job);
    ASSERT_FALSE(nothing);
    EXPECT_EQ(nothing.error().text(), "'b.exr': it is not an OpenEXR file");
    const auto unwritable =
        writeExrViews(*viewsOf(smallBundle(1, 8, false, false)), folder / "no/a.exr", job);
    ASSERT_FALSE(unwritable);
    EXPECT_EQ(unwritable.error().code, ErrorCode::io);
    // What the file system says comes through the library.
    const auto full = writeExrViews(*viewsOf(smallBundle(1, 8, false, false)), "/dev/full", job);
    ASSERT_FALSE(full);
    EXPECT_NE(full.error().message.find("No space left"), std::string::npos) << full.error().text();
}

}  // namespace
}  // namespace stx

// Bundles through the facade: what is refused on the way out and on the way in, and where.
#include "formats/any/save.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "formats/exr/bundle_exr.hpp"
#include "tests/small_bundle.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

TEST(SaveBundle, RefusesWrongDepthsInEveryContainer) {
    const TemporaryFolder folder;
    for (const float wrong : {kNan, -1.0f}) {
        for (const int bits : {8, 16, 32}) {
            Bundle bundle = smallBundle(2, bits, false, false);
            bundle.views[1].depth.at(3, 4) = wrong;
            for (const bool pointTexture : {false, true}) {
                for (const char* name : {"a.exr", "a.mp4", "a.bt", "a.xmt"}) {
                    Job job;
                    SaveOptions options;
                    options.pointTexture = pointTexture && std::string_view(name) != "a.exr";
                    const auto saved = saveBundle(bundle, folder / name, options, job);
                    ASSERT_FALSE(saved) << name << " " << wrong;
                    EXPECT_EQ(saved.error().code, ErrorCode::invalidInput);
                    EXPECT_NE(saved.error().text().find("view 1"), std::string::npos)
                        << saved.error().text();
                    EXPECT_FALSE(std::filesystem::exists(folder / name));
                }
            }
        }
    }
}

TEST(SaveBundle, RefusesWrongHeaders) {
    const TemporaryFolder folder;
    Job job;
    Bundle bundle = smallBundle(2, 16, false, false);
    std::swap(bundle.views[1].nearPlane, bundle.views[1].farPlane);
    EXPECT_FALSE(bundle.check());
    EXPECT_FALSE(bundle.checkHeaders());
    EXPECT_FALSE(saveBundle(bundle, folder / "a.exr", {}, job));
    EXPECT_FALSE(saveBundle(bundle, folder / "a.mp4", {}, job));
    bundle = {};
    EXPECT_FALSE(saveBundle(bundle, folder / "a.exr", {}, job));
}

TEST(OpenBundle, RefusesWrongDepthsOfAFile) {
    const TemporaryFolder folder;
    const auto path = folder / "a.exr";
    Job job;
    ReferenceView view = smallBundle(1, 32, false, false).views[0];
    view.depth.at(3, 4) = kNan;
    ExrPart part;
    part.name = "view";
    part.width = part.displayWidth = view.camera.width;
    part.height = part.displayHeight = view.camera.height;
    part.channels = {{"Z"}};
    setExrCamera(part, view);
    auto file = OutputFile::create(path);
    ASSERT_TRUE(file);
    auto writer = ExrWriter::create(*file, {part});
    ASSERT_TRUE(writer);
    ASSERT_TRUE(writer->writePart(0, std::vector<ExrConstPixels>{{"Z", view.depth.data(), 1}}));
    ASSERT_TRUE(writer->finish());
    ASSERT_TRUE(file->commit());
    const auto opened = openBundle(path, {}, job);
    ASSERT_FALSE(opened);
    EXPECT_EQ(opened.error().code, ErrorCode::invalidInput);
    EXPECT_NE(opened.error().message.find("distances are 0 or more"), std::string::npos);
}

}  // namespace
}  // namespace stx

// The environment of a bundle through every container, an atlas, and what picks or changes views.
#include <gtest/gtest.h>

#include "formats/any/save.hpp"
#include "formats/atlas/atlas_files.hpp"
#include "formats/imagesets/export.hpp"
#include "lib/packing/packing.hpp"
#include "lib/selection/selection.hpp"
#include "tests/painted_environment.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/torus_bundle.hpp"

namespace stx {
namespace {

Bundle torusInAPlace(Environment environment) {
    Bundle bundle = torusViews(48);
    bundle.views.resize(2);
    bundle.environment = std::make_shared<const Environment>(std::move(environment));
    return bundle;
}

Environment turnedCube() {
    Environment e = paintedCube(24);
    e.orientation = quatFromAxisAngle({1, 0, 0, 0.5});
    e.skyColours = {{0.25, 0.5, 1}, {1, 1, 1}};
    e.skyAngles = {1.5};
    return e;
}

TEST(KeptEnvironment, ComesBackFromEveryContainer) {
    const TemporaryFolder folder;
    for (const Environment& e : {turnedCube(), paintedAround(64)}) {
        const Bundle bundle = torusInAPlace(e);
        for (const char* name : {"a.exr", "a.mp4", "a.bt", "a.xmt", "transforms", "miv"}) {
            SCOPED_TRACE(name);
            const auto path = folder / name;
            Job job;
            if (path.has_extension()) {
                const auto saved = saveBundle(bundle, path, {}, job);
                ASSERT_TRUE(saved) << saved.error().text();
            } else {
                ExportOptions how;
                if (path.filename() == "miv") how.kind = ExportOptions::Kind::miv;
                const auto written = exportViews(*viewsOf(bundle), path, how, job);
                ASSERT_TRUE(written) << written.error().text();
            }
            const auto back = openBundle(path, {}, job);
            ASSERT_TRUE(back) << back.error().text();
            ASSERT_TRUE(back->environment);
            EXPECT_EQ(back->views.size(), 2u);
            if (e.layout == Environment::Layout::equirectangular && path.extension() != ".exr" &&
                path.has_extension()) {
                EXPECT_EQ(back->environment->pictureCount(), 6);
                continue;
            }
            EXPECT_EQ(back->environment->pictures, e.pictures);
            EXPECT_EQ(back->environment->skyColours, e.skyColours);
            EXPECT_LT(std::abs(1 - glm::dot(back->environment->orientation, e.orientation)), 1e-12);
        }
    }
}

TEST(KeptEnvironment, ComesBackFromAtlases) {
    const Bundle bundle = torusInAPlace(turnedCube());
    const TemporaryFolder folder;
    for (const char* name : {"atlas", "atlas.exr"}) {
        SCOPED_TRACE(name);
        Job job;
        const auto atlas = pack(bundle, {}, job);
        ASSERT_TRUE(atlas) << atlas.error().text();
        const auto written = writeAtlas(*atlas, folder / name, job);
        ASSERT_TRUE(written) << written.error().text();
        const auto back = readAtlas(folder / name, job);
        ASSERT_TRUE(back) << back.error().text();
        ASSERT_TRUE(back->environment);
        EXPECT_EQ(*back->environment, turnedCube());
        const auto unpacked = unpack(*back, job);
        ASSERT_TRUE(unpacked);
        EXPECT_EQ(unpacked->environment, back->environment);
    }
}

TEST(KeptEnvironment, StaysWithViewsThatAreKept) {
    const Bundle bundle = torusInAPlace(turnedCube());
    EXPECT_EQ(keepViews(bundle, {1}).environment, bundle.environment);
}

TEST(KeptEnvironment, ColmapHasNoPlaceForIt) {
    const TemporaryFolder folder;
    Job job;
    ExportOptions how;
    how.kind = ExportOptions::Kind::colmap;
    Bundle bundle = torusInAPlace(turnedCube());
    std::erase_if(bundle.views, [](const ReferenceView& v) { return v.camera.orthographic; });
    const auto written = exportViews(*viewsOf(bundle), folder / "colmap", how, job);
    ASSERT_TRUE(written) << written.error().text();
    bool told = false;
    for (const auto& note : job.takeNotes())
        told = told || note.find("environment") != std::string::npos;
    EXPECT_TRUE(told);
}

}  // namespace
}  // namespace stx

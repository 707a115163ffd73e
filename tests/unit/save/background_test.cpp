// The mark of background views ("drawn only where no other view shows a surface") in every
// container that a bundle can be written to.
#include <gtest/gtest.h>

#include "formats/any/save.hpp"
#include "formats/atlas/atlas_files.hpp"
#include "formats/imagesets/export.hpp"
#include "lib/packing/packing.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/torus_bundle.hpp"

namespace stx {
namespace {

/// A view, and another of the same camera as its background.
Bundle bundleWithBackground() {
    Bundle bundle = torusViews(48);
    bundle.views.resize(2);
    for (ReferenceView& view : bundle.views)
        for (std::size_t i = 0; i < view.depth.count(); ++i)
            view.texture.rgba8()->pixels()[i].a = hasPoint(view.depth.pixels()[i]) ? 255 : 0;
    ReferenceView behind = bundle.views[0];
    behind.name = "behind";
    behind.background = true;
    bundle.views.push_back(std::move(behind));
    return bundle;
}

std::vector<bool> marksOf(const std::vector<ReferenceView>& views) {
    std::vector<bool> marks;
    for (const ReferenceView& view : views) marks.push_back(view.background);
    return marks;
}

TEST(BackgroundView, ComesBackFromEveryContainer) {
    const Bundle bundle = bundleWithBackground();
    SaveOptions plain, points;
    points.pointTexture = true;
    const TemporaryFolder folder;
    for (const auto& [name, options] :
         {std::pair{"a.exr", plain}, std::pair{"a.mp4", plain}, std::pair{"points.mp4", points},
          std::pair{"a.bt", plain}, std::pair{"a.xmt", plain}, std::pair{"transforms", plain},
          std::pair{"miv", plain}}) {
        SCOPED_TRACE(name);
        const auto path = folder / name;
        Job job;
        if (path.has_extension()) {
            const auto saved = saveBundle(bundle, path, options, job);
            ASSERT_TRUE(saved) << saved.error().text();
        } else {
            ExportOptions how;
            if (path.filename() == "miv") how.kind = ExportOptions::Kind::miv;
            ASSERT_TRUE(exportViews(*viewsOf(bundle), path, how, job));
        }
        const auto back = openBundle(path, {}, job);
        ASSERT_TRUE(back) << back.error().text();
        ASSERT_EQ(back->views.size(), 3u);
        // Views of one camera stand together in a PointTexture.
        std::vector<bool> marks = marksOf(back->views);
        std::sort(marks.begin(), marks.end());
        EXPECT_EQ(marks, (std::vector<bool>{false, false, true}));
        for (const ReferenceView& view : back->views) {
            if (!view.background) continue;
            EXPECT_LT(glm::length(view.camera.position - bundle.views[0].camera.position), 1e-6);
        }
    }
}

TEST(BackgroundView, ComesBackFromAnAtlas) {
    Job job;
    const TemporaryFolder folder;
    for (const char* name : {"atlas", "atlas.exr"}) {
        SCOPED_TRACE(name);
        const auto atlas = pack(bundleWithBackground(), {}, job);
        ASSERT_TRUE(atlas) << atlas.error().text();
        ASSERT_TRUE(writeAtlas(*atlas, folder / name, job));
        const auto back = readAtlas(folder / name, job);
        ASSERT_TRUE(back) << back.error().text();
        EXPECT_EQ(marksOf(back->views), (std::vector<bool>{false, false, true}));
    }
}

}  // namespace
}  // namespace stx

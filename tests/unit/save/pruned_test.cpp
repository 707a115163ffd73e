// Pixels of full alpha without a depth (pruned, or of unknown depth) in every container that a
// bundle can be written to.
#include <gtest/gtest.h>

#include <random>

#include "formats/any/save.hpp"
#include "formats/atlas/atlas_files.hpp"
#include "formats/imagesets/export.hpp"
#include "formats/mpeg4/mapping/view_notes.hpp"
#include "lib/packing/packing.hpp"
#include "lib/packing/prune.hpp"
#include "lib/quality/view_quality.hpp"
#include "lib/render/factory.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/torus_bundle.hpp"

namespace stx {
namespace {

/// Without soft edges, which JPEG and PointTexture cannot hold.
Bundle prunedTorus() {
    Bundle bundle = torusViews(96);
    for (ReferenceView& view : bundle.views)
        for (std::size_t i = 0; i < view.depth.count(); ++i)
            view.texture.rgba8()->pixels()[i].a = hasPoint(view.depth.pixels()[i]) ? 255 : 0;
    Job job;
    EXPECT_TRUE(prune(bundle, {}, job));
    // What is left of a view without points is not what this is about.
    std::erase_if(bundle.views, [](const ReferenceView& v) { return v.pointCount() == 0; });
    EXPECT_TRUE(bundle.pruned());
    return bundle;
}

std::vector<std::size_t> prunedPixels(const ReferenceView& view) {
    std::vector<std::size_t> list;
    if (!view.pruned) return list;
    for (std::size_t i = 0; i < view.depth.count(); ++i)
        if (view.texture.at(i).a == 1.0f && !hasPoint(view.depth.data()[i])) list.push_back(i);
    return list;
}

/// PSNR of the torus drawn from between the reference views, against a renderer of the original.
double psnrOf(const Bundle& bundle, const Bundle& original) {
    std::vector<Camera> cameras;
    for (const ReferenceView& view : original.views) {
        Camera c = view.camera;
        c.position = quatFromAxisAngle({0, 1, 0, 0.2}) * c.position;
        c.orientation = quatFromAxisAngle({0, 1, 0, 0.2}) * c.orientation;
        cameras.push_back(c);
        if (cameras.size() == 4) break;
    }
    Job job;
    auto truth = makeRenderer(Backend::cpu, original, {}, -1, job);
    auto drawn = makeRenderer(Backend::cpu, bundle, {}, -1, job);
    EXPECT_TRUE(truth && drawn);
    if (!truth || !drawn) return 0;
    const auto quality = ViewQuality::against(**truth, cameras, job);
    EXPECT_TRUE(quality);
    const auto psnr = quality->measure(**drawn, job);
    EXPECT_TRUE(psnr);
    return psnr ? psnr->worst : 0;
}

struct Way {
    const char* name;
    SaveOptions options;
    double leastPsnr;  ///< 8-bit colour is exact but for JPEG
};

TEST(Pruned, ComesBackFromEveryContainer) {
    const Bundle bundle = prunedTorus();
    SaveOptions plain, jpeg, points;
    jpeg.jpegQuality = 90;
    points.pointTexture = true;
    const TemporaryFolder folder;
    for (const Way& way :
         {Way{"a.exr", plain, 55}, Way{"a.mp4", plain, 55}, Way{"jpeg.mp4", jpeg, 30},
          Way{"points.mp4", points, 50}, Way{"a.bt", plain, 55}, Way{"jpeg.xmt", jpeg, 30},
          Way{"transforms", plain, 55}, Way{"miv", plain, 55}}) {
        SCOPED_TRACE(way.name);
        const auto path = folder / way.name;
        Job job;
        if (path.has_extension()) {
            const auto saved = saveBundle(bundle, path, way.options, job);
            ASSERT_TRUE(saved) << saved.error().text();
        } else {
            ExportOptions options;
            if (path.filename() == "miv") options.kind = ExportOptions::Kind::miv;
            ASSERT_TRUE(exportViews(*viewsOf(bundle), path, options, job));
        }
        const auto back = openBundle(path, {}, job);
        ASSERT_TRUE(back) << back.error().text();
        ASSERT_EQ(back->views.size(), bundle.views.size());
        for (std::size_t i = 0; i < bundle.views.size(); ++i) {
            EXPECT_EQ(back->views[i].pruned, bundle.views[i].pruned) << i;
            EXPECT_EQ(prunedPixels(back->views[i]), prunedPixels(bundle.views[i])) << i;
        }
        EXPECT_GT(psnrOf(*back, bundle), way.leastPsnr);
        // Nothing is lost that would have to be said.
        const std::size_t notes = way.options.jpegQuality > 0 ? 1 : 0;  // "which is lossy"
        EXPECT_EQ(job.takeNotes().size(), notes);
    }
}

/// Opaque photographs whose sensors missed some pixels; one has a hole that is empty, too.
Bundle photographs(bool someEmpty) {
    Bundle bundle = torusViews(48);
    for (ReferenceView& view : bundle.views) {
        view.noDepth = NoDepth::unknown;
        int x = 0;
        for (std::size_t i = 0; i < view.depth.count(); ++i) {
            auto& pixel = view.texture.rgba8()->pixels()[i];
            const bool point = hasPoint(view.depth.pixels()[i]);
            if (!point) pixel = glm::u8vec4(90, 120, 30, 255);
            if (someEmpty && !point && ++x % 2) pixel.a = 0;
            if (point) pixel.a = 255;
        }
    }
    bundle.views[1].noDepth = NoDepth::empty;
    for (const std::size_t i : {0, 2}) bundle.views[i].refined = {"noise,agree", 0.0031f};
    for (std::size_t i = 0; i < bundle.views[1].depth.count(); ++i)
        if (!hasPoint(bundle.views[1].depth.pixels()[i]))
            bundle.views[1].texture.rgba8()->pixels()[i].a = 0;
    return bundle;
}

TEST(UnknownDepth, ComesBackFromEveryContainer) {
    SaveOptions plain, jpeg, points;
    jpeg.jpegQuality = 90;
    points.pointTexture = true;
    for (const bool someEmpty : {false, true}) {
        const Bundle bundle = photographs(someEmpty);
        const TemporaryFolder folder;
        for (const auto& [name, options] : {std::pair<const char*, SaveOptions>{"a.exr", plain},
                                            {"a.mp4", plain},
                                            {"jpeg.mp4", jpeg},
                                            {"points.mp4", points},
                                            {"a.bt", plain},
                                            {"jpeg.xmt", jpeg},
                                            {"transforms", plain},
                                            {"miv", plain},
                                            {"atlas", plain}}) {
            SCOPED_TRACE(fmt::format("{}, {}", name, someEmpty));
            const auto path = folder / name;
            Job job;
            if (path.has_extension()) {
                const auto saved = saveBundle(bundle, path, options, job);
                ASSERT_TRUE(saved) << saved.error().text();
            } else if (path.filename() == "atlas") {
                const auto atlas = pack(bundle, {}, job);
                ASSERT_TRUE(atlas);
                ASSERT_TRUE(writeAtlas(*atlas, path, job));
            } else {
                ExportOptions how;
                if (path.filename() == "miv") how.kind = ExportOptions::Kind::miv;
                ASSERT_TRUE(exportViews(*viewsOf(bundle), path, how, job));
            }
            auto back = path.filename() == "atlas"
                            ? readAtlas(path, job).and_then(
                                  [&](const Atlas& atlas) { return unpack(atlas, job); })
                            : openBundle(path, {}, job);
            ASSERT_TRUE(back) << back.error().text();
            ASSERT_EQ(back->views.size(), bundle.views.size());
            for (std::size_t i = 0; i < bundle.views.size(); ++i) {
                const ReferenceView &was = bundle.views[i], &now = back->views[i];
                EXPECT_EQ(now.noDepth, was.noDepth) << i;
                EXPECT_EQ(now.refined, was.refined) << i << " " << now.refined.text();
                EXPECT_FALSE(now.pruned);
                int wrong = 0;
                for (std::size_t k = 0; k < was.depth.count(); ++k)
                    wrong += now.texture.at(k).a != was.texture.at(k).a ? 1 : 0;
                EXPECT_EQ(wrong, 0) << i;
            }
        }
    }
}

TEST(Pruned, OtherViewsGetNoMark) {
    const Bundle bundle = torusViews(48);
    const TemporaryFolder folder;
    Job job;
    ASSERT_TRUE(saveBundle(bundle, folder / "a.mp4", {}, job));
    const auto back = openBundle(folder / "a.mp4", {}, job);
    ASSERT_TRUE(back);
    EXPECT_FALSE(back->pruned());
}

/// A mask that is not what it should be costs quality, not the file.
TEST(Pruned, ADamagedMaskIsANote) {
    const Bundle bundle = prunedTorus();
    const TemporaryFolder folder;
    Job job;
    SaveOptions jpeg;
    jpeg.jpegQuality = 90;
    ASSERT_TRUE(saveBundle(bundle, folder / "a.bt", jpeg, job));
    auto bytes = readFile(folder / "a.bt", Limits());
    ASSERT_TRUE(bytes);
    std::string text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
    const auto at = text.find("pruned ");
    ASSERT_NE(at, std::string::npos);
    text.replace(text.find("iVBOR", at), 5, "iVBO?");
    ASSERT_TRUE(writeFile(folder / "a.bt", std::as_bytes(std::span(text.data(), text.size()))));
    (void)job.takeNotes();
    const auto back = openBundle(folder / "a.bt", {}, job);
    ASSERT_TRUE(back) << back.error().text();
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("not base64"), std::string::npos) << notes[0];
}

/// Whatever is in the mask, the file is read; what is marked has no depth.
TEST(Pruned, MasksWithChangedBytesCostNothingButTheMark) {
    const Bundle bundle = prunedTorus();
    ReferenceView view = bundle.views[0];
    const auto mask = mpeg4::unknownMask(*view.texture.rgba8(), view.depth);
    ASSERT_TRUE(mask);
    std::mt19937 random(3);
    int applied = 0;
    for (int i = 0; i < 2000; ++i) {
        std::string changed = *mask;
        for (unsigned n = random() % 3 + 1; n > 0; --n)
            changed[random() % changed.size()] = static_cast<char>(random() % 128);
        if (i % 4 == 0) changed.resize(random() % changed.size());
        ReferenceView marked = view;
        if (!mpeg4::applyUnknownMask(marked, changed, Limits())) {
            EXPECT_EQ(marked.texture, view.texture);
        } else {
            ++applied;
        }
        EXPECT_EQ(marked.depth, view.depth);
    }
    EXPECT_LT(applied, 200) << "a PNG has checksums";
}

}  // namespace
}  // namespace stx

// OctreeImages that are written: the voxels of a bundle, and back.
#include <random>

#include "formats/mpeg4/mapping/octree.hpp"
#include "formats/mpeg4/mapping/octree_write.hpp"
#include "formats/validate/validate_mpeg4.hpp"
#include "tests/torus_bundle.hpp"
#include "tests/unit/mpeg4/mapping_fixtures.hpp"

namespace stx::mpeg4 {
namespace {

const Node* octreeOf(const Document& document) {
    const Node* found = nullptr;
    for (const CommandFrame& frame : document.frames)
        for (const Command& command : frame.commands)
            forEachNode(command, [&](const NodePtr& node) {
                if (node->is("OctreeImage")) found = node.get();
            });
    return found;
}
std::vector<std::int32_t> bytesOf(const Document& document) {
    const Node* node = octreeOf(document);
    EXPECT_NE(node, nullptr);
    return node ? node->get<std::vector<std::int32_t>>("octree") : std::vector<std::int32_t>();
}

/// An OctreeImage of random voxels with a picture on each of its six sides, a pixel a voxel.
std::string randomOctree(int levels, unsigned seed) {
    std::mt19937 random(seed);
    std::string text =
        "OctreeImage { octreeResolution " + std::to_string(1 << levels) + " octree [";
    std::size_t nodes = 1;
    for (int level = 0; level < levels; ++level) {
        std::size_t next = 0;
        for (std::size_t i = 0; i < nodes; ++i) {
            const auto byte = (random() | random()) % 255 + 1;
            text += " " + std::to_string(byte);
            next += static_cast<std::size_t>(std::popcount(static_cast<unsigned>(byte)));
        }
        nodes = next;
    }
    text += " ] images [";
    const char* sides[] = {"position 0 0 2 orientation 0 1 0 0",
                           "position 0 0 -2 orientation 0 1 0 3.1415926536",
                           "position 2 0 0 orientation 0 1 0 1.5707963268",
                           "position -2 0 0 orientation 0 1 0 -1.5707963268",
                           "position 0 2 0 orientation 1 0 0 -1.5707963268",
                           "position 0 -2 0 orientation 1 0 0 1.5707963268"};
    for (const char* side : sides) {
        const int n = 1 << levels;
        text += " DepthImage { fieldOfView 1 1 orthographic TRUE " + std::string(side) +
                " diTexture SimpleTexture { texture PixelTexture { image " + std::to_string(n) +
                " " + std::to_string(n) + " 3";
        for (int i = 0; i < n * n; ++i) text += " " + std::to_string(random() & 0xffffff);
        text += " } } }";
    }
    return text + " ] }";
}

Document writtenAs(const Bundle& bundle, int levels) {
    SceneWriteOptions options;
    options.octreeLevels = levels;
    return sceneOf(bundle, options);
}

void expectSamePictures(const Bundle& a, const Bundle& b) {
    ASSERT_EQ(a.views.size(), b.views.size());
    for (std::size_t i = 0; i < a.views.size(); ++i) {
        const ReferenceView &v = a.views[i], &w = b.views[i];
        ASSERT_EQ(v.depth.size(), w.depth.size());
        for (std::size_t p = 0; p < v.depth.count(); ++p) {
            const int x = static_cast<int>(p) % v.depth.width(),
                      y = static_cast<int>(p) / v.depth.width();
            ASSERT_EQ(hasPoint(v.depth.pixels()[p]), hasPoint(w.depth.pixels()[p]))
                << i << " " << p;
            EXPECT_EQ(v.texture.at(p), w.texture.at(p)) << i << " " << p;
            if (hasPoint(v.depth.pixels()[p])) {
                EXPECT_LT(glm::length(v.worldPoint(x, y) - w.worldPoint(x, y)), 1e-5);
            }
        }
    }
}

TEST(OctreeWriting, ComesBackWithoutLossFromTheUnitCube) {
    for (const unsigned seed : {1u, 2u, 3u}) {
        const Bundle first = mustRead(randomOctree(3, seed));
        ASSERT_EQ(first.views.size(), 6u);
        const Document document = writtenAs(first, 3);
        const Bundle second = bundleOf(document);
        expectSamePictures(first, second);
        EXPECT_EQ(bytesOf(writtenAs(second, 3)), bytesOf(document)) << "written once more";
    }
}

/// Elsewhere and larger: the Transform above it is undone and made again.
TEST(OctreeWriting, ComesBackWithoutLossUnderATransform) {
    const Bundle first = mustRead("Transform { translation 100 3 -7 scale 4 4 4 children " +
                                  randomOctree(3, 5) + " }");
    const Document document = writtenAs(first, 3);
    const Bundle second = bundleOf(document);
    expectSamePictures(first, second);
    EXPECT_EQ(bytesOf(writtenAs(second, 3)), bytesOf(document));
    const Bounds points = second.computeBounds();
    ASSERT_TRUE(second.bounds);
    EXPECT_LT(glm::length(second.bounds->min - points.min), 1e-3);
    EXPECT_LT(glm::length(second.bounds->max - points.max), 1e-3);
}

/// The distance to torusViews()' surface.
double offTorus(glm::dvec3 p) {
    return std::abs(std::hypot(std::hypot(p.x, p.z) - 0.75, p.y) - 0.3);
}

TEST(OctreeWriting, PerspectiveViewsBecomePicturesOfTheVoxels) {
    const Bundle torus = torusViews(96);
    constexpr int kLevels = 6;
    const Document document = writtenAs(torus, kLevels);
    Job job;
    const auto findings = stx::validate(document, {}, {}, job);
    EXPECT_TRUE(findings.empty()) << findings[0].text();
    const Bundle back = bundleOf(document);
    ASSERT_EQ(back.views.size(), torus.views.size());
    ASSERT_TRUE(back.bounds);
    const double voxel = 2.1 / ((1 << kLevels) - 1);
    EXPECT_LT(glm::length(back.bounds->min - torus.bounds->min), 2 * voxel);
    for (std::size_t i = 0; i < back.views.size(); ++i) {
        const ReferenceView& view = back.views[i];
        EXPECT_EQ(view.name, torus.views[i].name);
        EXPECT_TRUE(view.camera.orthographic);
        EXPECT_GT(view.pointCount(), 300);
        std::int64_t coloured = 0;
        for (int y = 0; y < view.depth.height(); ++y)
            for (int x = 0; x < view.depth.width(); ++x) {
                if (!hasPoint(view.depth.at(x, y))) continue;
                ASSERT_LT(offTorus(view.worldPoint(x, y)), voxel * 1.8);
                coloured += view.texture.rgba8()->at(x, y).a == 255;
            }
        EXPECT_EQ(coloured, view.pointCount());
    }
    // And once more, from what was read: the same voxels, the same pictures.
    const Document again = writtenAs(back, kLevels);
    expectSamePictures(bundleOf(again), back);
}

/// Voxels reach past the silhouette of a disc. Its pictures are black beyond it, as renderers leave
/// them, and the disc has no black.
TEST(OctreeWriting, VoxelsPastTheSilhouetteHaveTheColourOfTheObject) {
    constexpr int kSide = 48;
    const glm::u8vec4 red(200, 60, 40, 255);
    ReferenceView view;
    view.name = "disc";
    view.camera.orthographic = true;
    view.camera.width = view.camera.height = kSide;
    view.camera.fx = view.camera.fy = kSide / 2.4;
    view.camera.cx = view.camera.cy = kSide / 2.0;
    view.camera.position = {0, 0, 2};
    view.nearPlane = 1;
    view.farPlane = 3;
    view.depth = Image<float>(kSide, kSide, kNoDepth);
    Rgba8Image colour(kSide, kSide, glm::u8vec4(0));
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x)
            if (std::hypot(x + 0.5 - kSide / 2.0, y + 0.5 - kSide / 2.0) < 20) {
                view.depth.at(x, y) = 2;
                colour.at(x, y) = red;
            }
    view.texture = colour;
    Bundle disc;
    disc.views = {view};

    const Bundle back = bundleOf(writtenAs(disc, 3));
    ASSERT_EQ(back.views.size(), 1u);
    const ReferenceView& seen = back.views[0];
    EXPECT_GT(seen.pointCount(), view.pointCount()) << "voxels do not reach past the disc";
    for (std::size_t i = 0; i < seen.depth.count(); ++i) {
        if (hasPoint(seen.depth.pixels()[i])) {
            ASSERT_EQ(seen.texture.rgba8()->pixels()[i], red) << i;
        }
    }
}

/// Pixels that are wider than high, or higher than wide, by more than what tears a surface.
TEST(OctreeWriting, PixelsOfAnyShapeLeaveNoHoles) {
    for (const glm::ivec2 size : {glm::ivec2(32, 6), glm::ivec2(6, 32)}) {
        for (const bool orthographic : {true, false}) {
            ReferenceView view;
            view.camera = Camera::fromFieldOfView({0, 0, 10}, glm::dquat(1, 0, 0, 0), {0.2, 0.2},
                                                  orthographic, size.x, size.y);
            view.nearPlane = 5;
            view.farPlane = 15;
            view.depth = Image<float>(size.x, size.y, 10.0f);
            view.texture = Rgba8Image(size.x, size.y, glm::u8vec4(90, 80, 70, 255));
            Bundle wall;
            wall.views = {view};
            const Bundle back = bundleOf(writtenAs(wall, 4));
            ASSERT_EQ(back.views.size(), 1u);
            const ReferenceView& seen = back.views[0];
            EXPECT_EQ(seen.pointCount(), static_cast<std::int64_t>(seen.depth.count()))
                << size.x << "x" << size.y << " " << orthographic;
        }
    }
}

TEST(OctreeWriting, SaysWhatIsLost) {
    Bundle bundle;
    bundle.views = {makeView(8, 6, 16, 1)};
    addVectors(bundle.views[0]);
    bundle.views[0].background = true;
    SceneWriteOptions options;
    options.octreeLevels = 3;
    options.texture = SceneWriteOptions::Texture::jpeg;
    Job job;
    ASSERT_TRUE(sceneFromBundle(bundle, options, job));
    std::string all;
    for (const std::string& note : job.takeNotes()) all += note + "\n";
    for (const char* what :
         {"voxels of", "no normals and splats", "no background", "JPEG of quality 92"})
        EXPECT_NE(all.find(what), std::string::npos) << what << " is not in\n" << all;
}

TEST(OctreeWriting, SaysWhatItCannotDo) {
    Job job;
    SceneWriteOptions options;
    for (const int levels : {-1, 17}) {
        options.octreeLevels = levels;
        EXPECT_EQ(sceneFromBundle(torusViews(16), options, job).error().code, ErrorCode::usage);
    }
    options.octreeLevels = 4;
    options.pointTexture = true;
    EXPECT_EQ(sceneFromBundle(torusViews(16), options, job).error().code, ErrorCode::usage);
    options.pointTexture = false;
    job.limits.maxMemoryBytes = 1000;
    const auto tooLarge = sceneFromBundle(torusViews(64), options, job);
    ASSERT_FALSE(tooLarge);
    EXPECT_NE(tooLarge.error().text().find("octree"), std::string::npos) << tooLarge.error().text();
}

}  // namespace
}  // namespace stx::mpeg4

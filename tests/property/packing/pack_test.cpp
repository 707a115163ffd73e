#include <random>

#include <gtest/gtest.h>

#include "lib/base/parallel.hpp"
#include "lib/packing/packing.hpp"

namespace stx {
namespace {

/// Views of random sizes with random blobs of object pixels in random colours.
Bundle randomBundle(std::mt19937& random, int views, int largest, bool normals, bool splats,
                    bool linear) {
    const auto pick = [&](int from, int to) {
        return static_cast<int>(from + random() % (to - from + 1));
    };
    Bundle bundle;
    bundle.title = "random";
    for (int i = 0; i < views; ++i) {
        ReferenceView v;
        v.name = fmt::format("view{}", i);
        const int w = pick(1, largest), h = pick(1, largest);
        v.camera = Camera::fromFieldOfView({i, 0, 10}, {1, 0, 0, 0}, {0.8, 0.8}, false, w, h);
        v.depth = Image<float>(w, h, kNoDepth);
        Rgba8Image colour(w, h);
        for (auto& c : colour.pixels()) c = {pick(0, 255), pick(0, 255), pick(0, 255), 0};
        for (int blobs = pick(i == 0 ? 1 : 0, 4); blobs > 0; --blobs) {
            const int cx = pick(0, w - 1), cy = pick(0, h - 1), r = pick(0, std::max(1, w / 4));
            for (int y = std::max(0, cy - r); y <= std::min(h - 1, cy + r); ++y) {
                for (int x = std::max(0, cx - r); x <= std::min(w - 1, cx + r); ++x) {
                    if ((x - cx) * (x - cx) + (y - cy) * (y - cy) > r * r) continue;
                    v.depth.at(x, y) = static_cast<float>(pick(1000, 9000)) * 0.01f;
                    colour.at(x, y).a = static_cast<glm::u8>(pick(1, 255));
                }
            }
            // Coverage without a point, as beside a silhouette.
            colour.at(pick(0, w - 1), pick(0, h - 1)).a = 7;
        }
        if (linear) {
            RgbaFloatImage floats(w, h);
            for (std::size_t k = 0; k < floats.count(); ++k)
                floats.pixels()[k] = glm::vec4(colour.pixels()[k]) * 0.01f;
            v.texture = std::move(floats);
        } else {
            v.texture = std::move(colour);
        }
        const auto vectors = [&] {
            Image<glm::vec3> image(w, h, glm::vec3(0));
            for (std::size_t k = 0; k < image.count(); ++k) {
                if (hasPoint(v.depth.pixels()[k]))
                    image.pixels()[k] = {pick(1, 99), pick(1, 99), k};
            }
            return image;
        };
        if (normals) v.normal = vectors();
        if (splats) {
            v.splatU = vectors();
            v.splatV = vectors();
        }
        bundle.views.push_back(std::move(v));
    }
    return bundle;
}

/// Each point and each covered pixel of `before` is the same in `after`; nothing else became a
/// point.
void expectRecovered(const ReferenceView& before, const ReferenceView& after) {
    ASSERT_EQ(before.camera, after.camera);
    ASSERT_EQ(before.depth, after.depth);
    for (int y = 0; y < before.camera.height; ++y) {
        for (int x = 0; x < before.camera.width; ++x) {
            const glm::vec4 a = before.texture.at(x, y), b = after.texture.at(x, y);
            ASSERT_EQ(a.a, b.a);
            if (a.a > 0) {
                ASSERT_EQ(a, b) << before.name << " at " << x << "," << y;
            }
            if (!hasPoint(before.depth.at(x, y))) continue;
            ASSERT_EQ(a, b);
            if (before.hasNormals()) {
                ASSERT_EQ(before.normal.at(x, y), after.normal.at(x, y));
            }
            if (before.hasSplats()) {
                ASSERT_EQ(before.splatU.at(x, y), after.splatU.at(x, y));
                ASSERT_EQ(before.splatV.at(x, y), after.splatV.at(x, y));
            }
        }
    }
}

/// Rectangles with their padding neither overlap nor leave the page: painted pixel by pixel.
void expectApart(const Atlas& atlas) {
    std::vector<Image<int>> painted(atlas.pages.size(),
                                    Image<int>(atlas.width(), atlas.height(), 0));
    for (const auto& r : atlas.rectangles) {
        for (int y = -atlas.padding; y < r.atlasHeight() + atlas.padding; ++y) {
            for (int x = -atlas.padding; x < r.atlasWidth() + atlas.padding; ++x) {
                ASSERT_TRUE(painted[r.page].contains(r.atlasX + x, r.atlasY + y));
                ASSERT_EQ(painted[r.page].at(r.atlasX + x, r.atlasY + y)++, 0);
            }
        }
    }
}

class Pack : public testing::TestWithParam<PackSettings::Layout> {};

TEST_P(Pack, EverySourcePixelIsRecoverable) {
    std::mt19937 random(20061);
    for (int round = 0; round < 60; ++round) {
        const bool normals = round % 3 == 1, splats = round % 4 == 2, linear = round % 5 == 3;
        const Bundle bundle =
            randomBundle(random, 1 + static_cast<int>(random() % 12), 40, normals, splats, linear);
        PackSettings settings;
        settings.layout = GetParam();
        settings.padding = static_cast<int>(random() % 4);
        settings.maxSize = normals || splats ? 4096 : 128;
        Job job;
        const auto atlas = pack(bundle, settings, job);
        if (!atlas) {
            EXPECT_EQ(atlas.error().code, ErrorCode::invalidInput);
            EXPECT_EQ(settings.maxSize, 128) << atlas.error().text();
            continue;
        }
        ASSERT_TRUE(atlas->check()) << atlas->check().error().text();
        EXPECT_LE(atlas->textureCount(), 4);
        EXPECT_LE(atlas->width(), settings.maxSize);
        EXPECT_LE(atlas->height(), settings.maxSize);
        EXPECT_EQ(atlas->sourcePixels, bundle.pointCount());
        expectApart(*atlas);
        const auto back = unpack(*atlas, job);
        ASSERT_TRUE(back) << back.error().text();
        std::size_t k = 0;
        for (const auto& view : bundle.views) {
            if (k < back->views.size() && back->views[k].name == view.name) {
                expectRecovered(view, back->views[k++]);
            } else {
                EXPECT_EQ(view.pointCount(), 0) << "only views without points may be dropped";
            }
        }
        EXPECT_EQ(k, back->views.size());
    }
}

TEST_P(Pack, SameOnAnyNumberOfThreads) {
    std::mt19937 random(7);
    const Bundle bundle = randomBundle(random, 9, 60, true, true, false);
    PackSettings settings;
    settings.layout = GetParam();
    Job job;
    const auto packOn = [&](int threads) {
        const ThreadLimit limit(threads);
        return pack(bundle, settings, job);
    };
    const auto one = packOn(1), many = packOn(6);
    ASSERT_TRUE(one && many);
    EXPECT_EQ(one->rectangles, many->rectangles);
    EXPECT_EQ(one->pages[0].depth, many->pages[0].depth);
    EXPECT_EQ(one->pages[0].texture, many->pages[0].texture);
    EXPECT_EQ(one->pages[0].splatV, many->pages[0].splatV);
}

INSTANTIATE_TEST_SUITE_P(Grid, Pack, testing::Values(PackSettings::Layout::grid));
INSTANTIATE_TEST_SUITE_P(Tight, Pack, testing::Values(PackSettings::Layout::tight));

}  // namespace
}  // namespace stx

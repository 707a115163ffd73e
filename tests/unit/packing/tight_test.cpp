#include <numeric>
#include <random>

#include <gtest/gtest.h>

#include "lib/packing/packing.hpp"
#include "lib/packing/patches.hpp"
#include "lib/packing/rectangles.hpp"
#include "lib/render/scene/page_set.hpp"

namespace stx {
namespace {

double usedOf(const std::vector<glm::ivec2>& sizes, const RectanglePacking& packing) {
    double area = 0;
    for (const auto& s : sizes) area += static_cast<double>(s.x) * s.y;
    return area / (static_cast<double>(packing.width) * packing.height * packing.pages);
}

std::vector<glm::ivec2> randomSizes(unsigned seed, int count, glm::ivec2 from, glm::ivec2 to) {
    std::mt19937 random(seed);
    std::vector<glm::ivec2> sizes;
    for (int i = 0; i < count; ++i) {
        const int w = from.x + static_cast<int>(random() % (to.x - from.x + 1));
        const int h = from.y + static_cast<int>(random() % (to.y - from.y + 1));
        sizes.emplace_back(w, h);
    }
    return sizes;
}

/// Nothing overlaps or leaves its page: painted pixel by pixel.
void expectApart(const std::vector<glm::ivec2>& sizes, const RectanglePacking& packing) {
    ASSERT_EQ(packing.places.size(), sizes.size());
    std::vector<Image<std::uint8_t>> pages(packing.pages,
                                           Image<std::uint8_t>(packing.width, packing.height, 0));
    for (std::size_t i = 0; i < sizes.size(); ++i) {
        const auto& p = packing.places[i];
        const glm::ivec2 s = p.turned ? glm::ivec2(sizes[i].y, sizes[i].x) : sizes[i];
        ASSERT_TRUE(p.x >= 0 && p.y >= 0 && p.x + s.x <= packing.width &&
                    p.y + s.y <= packing.height);
        for (int y = p.y; y < p.y + s.y; ++y) {
            for (int x = p.x; x < p.x + s.x; ++x) ASSERT_EQ(pages[p.page].at(x, y)++, 0);
        }
    }
}

TEST(Rectangles, FillTheTextureAsWellAsAsked) {
    for (unsigned seed = 1; seed <= 4; ++seed) {
        const auto views = randomSizes(seed, 36, {300, 300}, {1000, 760});
        const auto a = packRectangles(views, {});
        ASSERT_TRUE(a);
        expectApart(views, *a);
        EXPECT_GT(usedOf(views, *a), 0.94);
        const auto patches = randomSizes(seed + 100, 500, {16, 16}, {256, 256});
        const auto b = packRectangles(patches, {});
        ASSERT_TRUE(b);
        expectApart(patches, *b);
        EXPECT_GT(usedOf(patches, *b), 0.965);
    }
    const std::vector<glm::ivec2> equal(16, {1024, 768});
    const auto c = packRectangles(equal, {});
    ASSERT_TRUE(c);
    EXPECT_DOUBLE_EQ(usedOf(equal, *c), 1.0);
    EXPECT_EQ(std::max(c->width, c->height), 4096);
}

TEST(Rectangles, OrderOfInputDoesNotMatter) {
    auto sizes = randomSizes(5, 80, {10, 10}, {90, 60});
    const auto a = packRectangles(sizes, {});
    std::vector<std::size_t> shuffled(sizes.size());
    std::iota(shuffled.begin(), shuffled.end(), 0);
    std::shuffle(shuffled.begin(), shuffled.end(), std::mt19937(1));
    std::vector<glm::ivec2> other;
    for (const auto i : shuffled) other.push_back(sizes[i]);
    const auto b = packRectangles(other, {});
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->width, b->width);
    EXPECT_EQ(a->height, b->height);
    // The same places for each size (equal sizes may have changed places among each other).
    const auto sorted = [](const std::vector<glm::ivec2>& s, const RectanglePacking& p) {
        std::vector<std::array<int, 5>> all;
        for (std::size_t i = 0; i < s.size(); ++i)
            all.push_back({s[i].x, s[i].y, p.places[i].x, p.places[i].y, p.places[i].turned});
        std::sort(all.begin(), all.end());
        return all;
    };
    EXPECT_EQ(sorted(sizes, *a), sorted(other, *b));
}

TEST(Rectangles, TurnOnlyWhereItHelps) {
    // 10x30 and 30x10 in turn: together they only close a page when some are turned.
    std::vector<glm::ivec2> sizes = {{10, 30}, {30, 10}, {10, 30}};
    const auto packing = packRectangles(sizes, {30, 1, true});
    ASSERT_TRUE(packing);
    expectApart(sizes, *packing);
    EXPECT_DOUBLE_EQ(usedOf(sizes, *packing), 1.0);
    const auto straight = packRectangles(std::vector<glm::ivec2>(6, {20, 30}), {});
    ASSERT_TRUE(straight);
    for (const auto& p : straight->places) EXPECT_FALSE(p.turned);
}

TEST(Rectangles, TakePagesWhenOneIsNotEnough) {
    const auto sizes = randomSizes(9, 60, {100, 100}, {400, 400});
    const auto packing = packRectangles(sizes, {1024, 8, true});
    ASSERT_TRUE(packing);
    EXPECT_GT(packing->pages, 1);
    EXPECT_LE(packing->width, 1024);
    expectApart(sizes, *packing);
    EXPECT_GT(usedOf(sizes, *packing), 0.8);
    const auto none = packRectangles(sizes, {1024, 1, true});
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().code, ErrorCode::invalidInput);
}

TEST(Rectangles, SayWhatWouldDo) {
    // Room for them there is, but one of 84 pixels alone fits on a page of 150.
    const std::vector<glm::ivec2> three(3, {84, 84});
    RectangleLimits limits{150, 2, true};
    for (const glm::ivec2 size : {glm::ivec2(0), glm::ivec2(150)}) {
        limits.size = size;
        const auto none = packRectangles(three, limits);
        ASSERT_FALSE(none);
        EXPECT_EQ(
            none.error().message,
            fmt::format("3 rectangles with 21168 pixels do not fit on 2 textures of {}150x150; "
                        "84x252 would do",
                        size.x > 0 ? "" : "at most "));
    }
}

TEST(Rectangles, OneSideOfAPageMayBeShorter) {
    const std::vector<glm::ivec2> three(3, {84, 84});
    RectangleLimits limits;
    limits.maxPages = 2;
    const auto sizeOf = [&](glm::ivec2 most) {
        limits.maxPage = most;
        const auto packing = packRectangles(three, limits);
        EXPECT_TRUE(packing);
        if (packing) expectApart(three, *packing);
        return packing ? glm::ivec3(packing->width, packing->height, packing->pages)
                       : glm::ivec3(0);
    };
    EXPECT_EQ(sizeOf({260, 90}), glm::ivec3(252, 84, 1));
    EXPECT_EQ(sizeOf({90, 260}), glm::ivec3(84, 252, 1));
    const glm::ivec3 two = sizeOf({200, 90});
    EXPECT_EQ(two.z, 2);
    EXPECT_LE(two.x, 200);
    EXPECT_LE(two.y, 90);
    limits.powerOfTwo = true;
    EXPECT_EQ(sizeOf({300, 200}), glm::ivec3(256, 128, 1));
    limits.powerOfTwo = false;
    limits.maxPages = 1;
    limits.maxPage = {200, 90};
    const auto none = packRectangles(three, limits);
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().message,
              "3 rectangles with 21168 pixels do not fit on a texture of at most 200x90; 84x252 "
              "would do");
}

TEST(Rectangles, AtTheExactLimit) {
    const auto packing = packRectangles(std::vector<glm::ivec2>(4, {512, 512}), {1024, 1, true});
    ASSERT_TRUE(packing);
    EXPECT_EQ(packing->width, 1024);
    EXPECT_EQ(packing->height, 1024);
    EXPECT_TRUE(packRectangles({{65535, 65535}}, {65535, 1, true}));
    EXPECT_FALSE(packRectangles({{1025, 1}}, {1024, 4, true}));
    EXPECT_FALSE(packRectangles({{0, 1}}, {}));
    EXPECT_TRUE(packRectangles({}, {}));
}

TEST(Rectangles, TenThousandTinyOnes) {
    const auto sizes = randomSizes(3, 10000, {1, 1}, {30, 30});
    const auto packing = packRectangles(sizes, {});
    ASSERT_TRUE(packing);
    expectApart(sizes, *packing);
    EXPECT_GT(usedOf(sizes, *packing), 0.97);
}

ReferenceView blankView(int width, int height) {
    ReferenceView v;
    v.camera = Camera::fromFieldOfView({0, 0, 10}, {1, 0, 0, 0}, {0.8, 0.8}, false, width, height);
    v.depth = Image<float>(width, height, kNoDepth);
    v.texture = Rgba8Image(width, height, glm::u8vec4(0));
    return v;
}

void paint(ReferenceView& v, int x0, int y0, int w, int h) {
    for (int y = y0; y < y0 + h; ++y) {
        for (int x = x0; x < x0 + w; ++x) {
            v.depth.at(x, y) = 20.0f;
            v.texture.rgba8()->at(x, y) = {static_cast<glm::u8>(x), static_cast<glm::u8>(y), 0,
                                           255};
        }
    }
}

TEST(Patches, TrimAndCutWhatSavesRoom) {
    ReferenceView v = blankView(200, 100);
    EXPECT_TRUE(contentPatches(v, 2).empty());
    paint(v, 50, 20, 30, 40);
    EXPECT_EQ(contentPatches(v, 2), (std::vector<Patch>{{50, 20, 30, 40}}));
    v.texture.rgba8()->at(49, 30).a = 1;  // coverage without a point is content as well
    EXPECT_EQ(contentPatches(v, 2), (std::vector<Patch>{{49, 20, 31, 40}}));
    paint(v, 150, 70, 30, 20);
    EXPECT_EQ(contentPatches(v, 2), (std::vector<Patch>{{49, 20, 31, 40}, {150, 70, 30, 20}}));
    // An L is cut through its content.
    ReferenceView l = blankView(100, 100);
    paint(l, 0, 0, 20, 100);
    paint(l, 20, 80, 80, 20);
    EXPECT_EQ(contentPatches(l, 2).size(), 2u);
    // A speck beside a body is not worth a patch of its own.
    ReferenceView speck = blankView(100, 100);
    paint(speck, 0, 0, 20, 20);
    paint(speck, 22, 10, 1, 1);
    EXPECT_EQ(contentPatches(speck, 2).size(), 1u);
}

TEST(Patches, WhatIsPrunedInTheMiddleIsCutOut) {
    // No single cut saves room: the middle goes only when the frame around it falls in four.
    ReferenceView frame = blankView(200, 200);
    paint(frame, 0, 0, 200, 200);
    for (int y = 20; y < 180; ++y)
        for (int x = 30; x < 170; ++x) frame.depth.at(x, y) = kNoDepth;
    const auto patches = contentPatches(frame, 2);
    EXPECT_EQ(patches.size(), 4u);
    int pixels = 0;
    for (const Patch& p : patches) pixels += p.width * p.height;
    EXPECT_LE(pixels, (200 * 200 - 160 * 140) * 11 / 10);
}

TEST(Patches, PixelsOfFullAlphaWithoutADepthAreNoContent) {
    ReferenceView v = blankView(100, 100);
    paint(v, 10, 10, 5, 5);
    for (int y = 40; y < 100; ++y) {
        for (int x = 0; x < 100; ++x) v.texture.rgba8()->at(x, y).a = 255;
    }
    EXPECT_EQ(contentPatches(v, 2), (std::vector<Patch>{{10, 10, 5, 5}}));
}

TEST(Tight, EmptyViewsAreDroppedAndSaid) {
    Bundle bundle;
    for (int i = 0; i < 3; ++i) {
        bundle.views.push_back(blankView(64, 64));
        bundle.views.back().name = fmt::format("v{}", i);
    }
    PackSettings settings;
    settings.layout = PackSettings::Layout::tight;
    Job job;
    EXPECT_FALSE(pack(bundle, settings, job));
    paint(bundle.views[1], 7, 9, 1, 1);
    const auto atlas = pack(bundle, settings, job);
    ASSERT_TRUE(atlas);
    EXPECT_EQ(job.takeNotes(), std::vector<std::string>{"2 of 3 views dropped: they are empty"});
    ASSERT_EQ(atlas->views.size(), 1u);
    EXPECT_EQ(atlas->views[0].name, "v1");
    EXPECT_EQ(atlas->width(), 5);  // one pixel and its padding
    EXPECT_EQ(atlas->layout, "tight");
    const auto back = unpack(*atlas, job);
    ASSERT_TRUE(back);
    EXPECT_EQ(back->views[0].depth, bundle.views[1].depth);
}

TEST(Tight, WhatOneViewMissesChangesNoOther) {
    // A mesh's view beside a photograph whose sensor missed something, and shows what that has not.
    Bundle bundle;
    for (int i = 0; i < 2; ++i) {
        bundle.views.push_back(blankView(64, 64));
        bundle.views.back().name = fmt::format("v{}", i);
    }
    paint(bundle.views[0], 5, 5, 10, 10);
    ReferenceView& photo = bundle.views[1];
    photo.noDepth = NoDepth::unknown;
    paint(photo, 40, 40, 10, 10);
    for (glm::u8vec4& colour : photo.texture.rgba8()->pixels()) colour.a = 255;
    PackSettings settings;
    settings.layout = PackSettings::Layout::tight;
    Job job;
    const auto atlas = pack(bundle, settings, job);
    ASSERT_TRUE(atlas);
    ASSERT_LT(atlas->keptPixels, atlas->sourcePixels);
    EXPECT_TRUE(outsideBits(*atlas, 0).empty());
    EXPECT_FALSE(outsideBits(*atlas, 1).empty());
    const auto back = unpack(*atlas, job);
    ASSERT_TRUE(back);
    const auto pages = PageSet::of(*atlas, job);
    ASSERT_TRUE(pages);
    for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 64; ++x) {
            const float alpha = bundle.views[0].texture.at(x, y).a;
            ASSERT_EQ(back->views[0].texture.at(x, y).a, alpha) << x << ' ' << y;
            ASSERT_EQ(pages->alpha(0, x, y), alpha) << x << ' ' << y;
        }
    }
    EXPECT_EQ(back->views[1].texture.at(10, 30).a, 1);
}

TEST(Tight, PaddingShowsTheNeighboursInTheView) {
    Bundle bundle;
    bundle.views.push_back(blankView(100, 100));
    paint(bundle.views[0], 0, 0, 20, 100);
    paint(bundle.views[0], 20, 80, 80, 20);
    PackSettings settings;
    settings.layout = PackSettings::Layout::tight;
    Job job;
    const auto atlas = pack(bundle, settings, job);
    ASSERT_TRUE(atlas);
    ASSERT_EQ(atlas->rectangles.size(), 2u);
    const auto& view = *bundle.views[0].texture.rgba8();
    for (const auto& r : atlas->rectangles) {
        for (int y = r.viewY - 2; y < r.viewY + r.height + 2; ++y) {
            for (int x = r.viewX - 2; x < r.viewX + r.width + 2; ++x) {
                const auto p = r.atlasFromView(x, y);
                EXPECT_EQ(atlas->pages[0].texture.rgba8()->at(p.x, p.y),
                          view.at(std::clamp(x, 0, 99), std::clamp(y, 0, 99)));
            }
        }
    }
}

TEST(Tight, PaddingKeepsMipLevelsClean) {
    // Views of one colour each: a texel of level L that touches a rectangle must show no other, nor
    // the black of gaps, when the padding is 2^L - 1 or more.
    Bundle bundle;
    for (int i = 0; i < 12; ++i) {
        bundle.views.push_back(blankView(90, 70));
        paint(bundle.views.back(), 3 * i, 2 * i, 20 + 3 * i, 11 + 2 * i);
        paint(bundle.views.back(), 3 * i, 2 * i, 5, 40);
        for (auto& c : bundle.views.back().texture.rgba8()->pixels())
            c = glm::u8vec4(20 * i + 10, 250 - 20 * i, 99, c.a);
    }
    for (const int level : {1, 2, 3}) {
        PackSettings settings;
        settings.layout = PackSettings::Layout::tight;
        settings.padding = (1 << level) - 1;
        Job job;
        const auto atlas = pack(bundle, settings, job);
        ASSERT_TRUE(atlas);
        const auto& page = *atlas->pages[0].texture.rgba8();
        int foreign = 0;
        for (const auto& r : atlas->rectangles) {
            const glm::u8vec3 own(20 * r.view + 10, 250 - 20 * r.view, 99);
            for (int y = r.atlasY >> level << level; y < r.atlasY + r.atlasHeight();
                 y += 1 << level) {
                for (int x = r.atlasX >> level << level; x < r.atlasX + r.atlasWidth();
                     x += 1 << level) {
                    for (int k = 0; k < 1 << 2 * level; ++k) {
                        const int px = x + (k & ((1 << level) - 1)), py = y + (k >> level);
                        if (page.contains(px, py)) foreign += glm::u8vec3(page.at(px, py)) != own;
                    }
                }
            }
        }
        EXPECT_EQ(foreign, 0) << "level " << level;
    }
}

TEST(Tight, TenThousandTinyViews) {
    Bundle bundle;
    for (int i = 0; i < 10000; ++i) {
        bundle.views.push_back(blankView(4, 3));
        paint(bundle.views.back(), i % 4, i % 3, 1, 1);
    }
    PackSettings settings;
    settings.layout = PackSettings::Layout::tight;
    settings.padding = 0;
    Job job;
    const auto atlas = pack(bundle, settings, job);
    ASSERT_TRUE(atlas);
    EXPECT_DOUBLE_EQ(atlas->used(), 1.0);
    EXPECT_EQ(atlas->width(), 100);
    EXPECT_TRUE(atlas->check());
}

}  // namespace
}  // namespace stx

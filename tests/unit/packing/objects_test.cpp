#include <tuple>
#include <utility>

#include <gtest/gtest.h>

#include "lib/packing/packing.hpp"
#include "lib/packing/rectangles.hpp"
#include "lib/packing/views_one_by_one.hpp"
#include "tests/small_bundle.hpp"

namespace stx {
namespace {

std::vector<PackObject> threeObjects() {
    return {{"cup", smallBundle(4, 16, true, false, 1)},
            {"jug", smallBundle(9, 16, false, false, 2)},
            {"a long name", smallBundle(2, 16, true, false, 3)}};
}

PackSettings settingsOf(PackSettings::Layout layout, const JoinedObjects& joined) {
    PackSettings settings;
    settings.layout = layout;
    settings.objects = &joined.objects;
    return settings;
}

void expectSameViews(const Bundle& a, const Bundle& b) {
    ASSERT_EQ(a.views.size(), b.views.size());
    EXPECT_EQ(a.title, b.title);
    EXPECT_EQ(a.bounds.has_value(), b.bounds.has_value());
    for (std::size_t i = 0; i < a.views.size(); ++i) {
        EXPECT_EQ(a.views[i].name, b.views[i].name);
        EXPECT_EQ(a.views[i].camera, b.views[i].camera);
        EXPECT_EQ(a.views[i].depth, b.views[i].depth);
        EXPECT_EQ(*a.views[i].texture.rgba8(), *b.views[i].texture.rgba8());
        EXPECT_EQ(a.views[i].normal, b.views[i].normal);
        EXPECT_EQ(a.views[i].splatV, b.views[i].splatV);
    }
}

TEST(PackObjects, EachComesBackAsFromAnAtlasOfItsOwn) {
    for (const auto layout : {PackSettings::Layout::grid, PackSettings::Layout::tight}) {
        Job job;
        const auto joined = joinObjects(threeObjects(), job);
        ASSERT_TRUE(joined) << joined.error().text();
        const auto sheet = pack(joined->bundle, settingsOf(layout, *joined), job);
        ASSERT_TRUE(sheet) << sheet.error().text();
        ASSERT_TRUE(sheet->check());
        EXPECT_EQ(sheet->textureCount(), 4);
        ASSERT_EQ(sheet->objects.size(), 3u);
        EXPECT_FALSE(unpack(*sheet, job)) << "which one?";
        std::int64_t kept = 0;
        for (const auto& given : threeObjects()) {
            PackSettings alone;
            alone.layout = layout;
            const auto own = pack(given.bundle, alone, job);
            ASSERT_TRUE(own);
            const auto object = objectOf(*sheet, given.name);
            ASSERT_TRUE(object) << object.error().text();
            EXPECT_TRUE(object->check());
            EXPECT_TRUE(object->objects.empty());
            EXPECT_EQ(object->sourcePixels, own->sourcePixels);
            EXPECT_EQ(object->keptPixels, own->keptPixels);
            EXPECT_EQ(object->paddingHolds(2), own->paddingHolds(2));
            EXPECT_LE(object->pages[0].depth.count(), sheet->pages[0].depth.count());
            expectSameViews(*unpack(*own, job), *unpack(*object, job));
            kept += own->keptPixels;
            if (layout == PackSettings::Layout::tight) continue;
            // A grid is the whole of the part that is left.
            EXPECT_EQ(object->rectangles, own->rectangles);
            EXPECT_EQ(*object->pages[0].texture.rgba8(), *own->pages[0].texture.rgba8());
            EXPECT_EQ(object->pages[0].depth, own->pages[0].depth);
        }
        EXPECT_EQ(sheet->keptPixels, kept);
    }
}

// Zeros would make smooth plastic of it.
TEST(PackObjects, WithoutMaterialsAreRoughBesideThoseThatHaveThem) {
    for (const auto layout : {PackSettings::Layout::grid, PackSettings::Layout::tight}) {
        auto given = threeObjects();
        for (ReferenceView& view : given[0].bundle.views)
            view.metallicRoughness =
                Image<glm::vec2>(view.depth.width(), view.depth.height(), glm::vec2(0.5f, 0.25f));
        Job job;
        const auto joined = joinObjects(std::move(given), job);
        ASSERT_TRUE(joined) << joined.error().text();
        const auto sheet = pack(joined->bundle, settingsOf(layout, *joined), job);
        ASSERT_TRUE(sheet) << sheet.error().text();
        for (const auto& [name, expected] :
             {std::pair("cup", glm::vec2(0.5f, 0.25f)), std::pair("jug", glm::vec2(0, 1))}) {
            const auto object = objectOf(*sheet, name);
            ASSERT_TRUE(object) << object.error().text();
            const auto bundle = unpack(*object, job);
            ASSERT_TRUE(bundle) << bundle.error().text();
            for (const ReferenceView& view : bundle->views) {
                ASSERT_EQ(view.metallicRoughness.size(), view.depth.size());
                for (std::size_t i = 0; i < view.depth.count(); ++i)
                    if (hasPoint(view.depth.data()[i])) {
                        ASSERT_EQ(view.metallicRoughness.data()[i], expected) << name;
                    }
            }
        }
    }
}

TEST(PackObjects, OfViewsOneByOneGiveTheSameAtlas) {
    for (const auto layout : {PackSettings::Layout::grid, PackSettings::Layout::tight}) {
        Job job;
        const auto joined = joinObjects(threeObjects(), job);
        ASSERT_TRUE(joined);
        std::vector<PackTable> tables;
        for (PackObject& object : threeObjects())
            tables.push_back({object.name, tableOf(std::move(object.bundle))});
        const auto views = joinTables(std::move(tables), job);
        ASSERT_TRUE(views) << views.error().text();
        PackSettings settings = settingsOf(layout, *joined);
        const auto whole = pack(joined->bundle, settings, job);
        settings.objects = &views->objects;
        const auto each = pack(*views->views, settings, job);
        ASSERT_TRUE(whole);
        ASSERT_TRUE(each) << each.error().text();
        EXPECT_EQ(each->rectangles, whole->rectangles);
        EXPECT_EQ(*each->pages[0].texture.rgba8(), *whole->pages[0].texture.rgba8());
        EXPECT_EQ(each->pages[0].depth, whole->pages[0].depth);
        EXPECT_EQ(each->pages[0].normal, whole->pages[0].normal);
        ASSERT_EQ(each->objects.size(), whole->objects.size());
        for (std::size_t i = 0; i < each->objects.size(); ++i) {
            const AtlasObject &a = each->objects[i], &b = whole->objects[i];
            EXPECT_EQ(
                std::tie(a.name, a.title, a.firstView, a.views, a.keptPixels, a.sourcePixels),
                std::tie(b.name, b.title, b.firstView, b.views, b.keptPixels, b.sourcePixels));
        }
    }
}

TEST(PackObjects, ErrorsNameTheObjectAndAWayOut) {
    Job job;
    const auto textOf = [&](std::vector<PackObject> objects) {
        const auto joined = joinObjects(std::move(objects), job);
        return joined ? std::string() : joined.error().text();
    };
    auto objects = threeObjects();
    objects[2].name = "cup";
    EXPECT_NE(textOf(objects).find("two objects are called 'cup'"), std::string::npos);
    objects = threeObjects();
    objects[1].bundle = smallBundle(2, 32, false, true);
    EXPECT_NE(textOf(objects).find("object 'jug': its colour is linear light and that of 'cup' "
                                   "8-bit sRGB"),
              std::string::npos)
        << textOf(objects);
    objects = threeObjects();
    for (auto& view : objects[0].bundle.views)
        for (float& d : view.depth.pixels()) d = kNoDepth;
    EXPECT_NE(textOf(objects).find("object 'cup': it has no point"), std::string::npos);
    const auto joined = joinObjects(threeObjects(), job);
    const auto sheet = pack(joined->bundle, settingsOf(PackSettings::Layout::tight, *joined), job);
    ASSERT_TRUE(sheet);
    for (const char* name : {"", "vase"}) {
        const auto object = objectOf(*sheet, name);
        ASSERT_FALSE(object);
        EXPECT_EQ(object.error().code, ErrorCode::usage);
        EXPECT_NE(object.error().text().find("cup, jug, a long name"), std::string::npos);
    }
    EXPECT_FALSE(objectOf(*pack(smallBundle(2, 16, false, false), {}, job), "cup"));
}

TEST(PackObjects, PagesAreAsLargeAsAsked) {
    Job job;
    const auto joined = joinObjects(threeObjects(), job);
    for (const auto layout : {PackSettings::Layout::grid, PackSettings::Layout::tight}) {
        PackSettings settings = settingsOf(layout, *joined);
        const auto free = pack(joined->bundle, settings, job);
        ASSERT_TRUE(free);
        settings.size = {free->width() + 40, free->height() + 3};
        const auto exact = pack(joined->bundle, settings, job);
        ASSERT_TRUE(exact) << exact.error().text();
        EXPECT_EQ(glm::ivec2(exact->width(), exact->height()), settings.size);
        EXPECT_TRUE(exact->check());
        settings.size = {};
        settings.powerOfTwo = true;
        const auto two = pack(joined->bundle, settings, job);
        ASSERT_TRUE(two) << two.error().text();
        EXPECT_EQ(two->width() & (two->width() - 1), 0);
        EXPECT_EQ(two->height() & (two->height() - 1), 0);
        EXPECT_GE(two->used(), 0.2);
        settings.powerOfTwo = false;
        settings.size = {64, 96};
        const auto small = pack(joined->bundle, settings, job);
        ASSERT_FALSE(small);
        EXPECT_NE(
            small.error().text().find(fmt::format("{}x{} would do", free->width(), free->height())),
            std::string::npos)
            << small.error().text();
        EXPECT_NE(small.error().text().find("--size"), std::string::npos);
    }
}

TEST(PackObjects, OneGridAlsoTakesASize) {
    Job job;
    const Bundle bundle = smallBundle(9, 16, false, false);
    PackSettings settings;
    settings.powerOfTwo = true;
    const auto two = pack(bundle, settings, job);
    ASSERT_TRUE(two);
    // Cells of 61x51: 256x128 holds eight.
    EXPECT_EQ(glm::ivec2(two->width(), two->height()), glm::ivec2(128, 256));
    settings.powerOfTwo = false;
    settings.size = {640, 128};
    const auto wide = pack(bundle, settings, job);
    ASSERT_TRUE(wide) << wide.error().text();
    EXPECT_EQ(glm::ivec2(wide->width(), wide->height()), settings.size);
    settings.size = {100, 100};
    EXPECT_NE(pack(bundle, settings, job).error().text().find("textures are 100x100"),
              std::string::npos);
    settings.size = {100, 0};
    EXPECT_EQ(pack(bundle, settings, job).error().code, ErrorCode::usage);
}

TEST(Rectangles, FillAPageOfAGivenSize) {
    RectangleLimits limits;
    limits.size = {1024, 512};
    const std::vector<glm::ivec2> equal(8, {256, 256});
    const auto full = packRectangles(equal, limits);
    ASSERT_TRUE(full) << full.error().text();
    EXPECT_EQ(full->pages, 1);
    std::vector<glm::ivec2> nine = equal;
    nine.emplace_back(1, 1);
    EXPECT_FALSE(packRectangles(nine, limits));
    limits.maxPages = 2;
    const auto two = packRectangles(nine, limits);
    ASSERT_TRUE(two);
    EXPECT_EQ(two->pages, 2);
    EXPECT_EQ(glm::ivec2(two->width, two->height), limits.size);
    // Turned only where that is allowed.
    limits.maxPages = 1;
    EXPECT_TRUE(packRectangles({{400, 1000}}, limits));
    limits.mayTurn = false;
    EXPECT_FALSE(packRectangles({{400, 1000}}, limits));
}

}  // namespace
}  // namespace stx

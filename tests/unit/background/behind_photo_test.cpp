// What one photograph hides: a card before a wall, whose pixels behind it are known.

#include "lib/background/behind_photo.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "lib/base/parallel.hpp"
#include "lib/render/factory.hpp"

namespace stx {
namespace {

constexpr int kPhotoWidth = 200, kPhotoHeight = 150;
constexpr float kFarWall = 4.0f, kNearCard = 2.0f, kShelf = 3.0f;
constexpr float kFocalLength = 300;
/// How far what is behind the card comes out at a shift of 8 %: parallax of the card less the
/// wall's, pixels.
const float kOut = 0.08f * kFocalLength * (kFarWall / kNearCard - 1);

/// Red and green stripes and dots; no blue.
glm::u8vec3 wallPattern(int x, int y) {
    const int wave = static_cast<int>(40 * std::sin(0.6 * x + 0.15 * y));
    return {150 + wave, 120 + ((x / 3 + y / 3) % 2 != 0 ? 40 : -40), 0};
}

struct Box {
    int x0, y0, x1, y1;
    [[nodiscard]] bool has(int x, int y) const { return x >= x0 && y >= y0 && x < x1 && y < y1; }
    /// How far a pixel inside is from the nearest one outside.
    [[nodiscard]] int inside(int x, int y) const {
        return std::min({x - x0, y - y0, x1 - 1 - x, y1 - 1 - y}) + 1;
    }
};
constexpr Box kCard = {70, 40, 130, 110};

/// A wall, a shelf of its right part if asked for, and a blue card before it.
ReferenceView cardBeforeWall(bool card, int shelfFrom = kPhotoWidth) {
    ReferenceView view;
    view.name = "photo";
    view.camera.width = kPhotoWidth;
    view.camera.height = kPhotoHeight;
    view.camera.fx = view.camera.fy = kFocalLength;
    view.camera.cx = kPhotoWidth * 0.5;
    view.camera.cy = kPhotoHeight * 0.5;
    view.nearPlane = 1;
    view.farPlane = 8;
    view.depthBits = 32;
    view.depth = Image<float>(kPhotoWidth, kPhotoHeight, kFarWall);
    Rgba8Image colour(kPhotoWidth, kPhotoHeight);
    for (int y = 0; y < kPhotoHeight; ++y) {
        for (int x = 0; x < kPhotoWidth; ++x) {
            const bool before = card && kCard.has(x, y);
            if (x >= shelfFrom) view.depth.at(x, y) = kShelf;
            if (before) view.depth.at(x, y) = kNearCard;
            colour.at(x, y) =
                glm::u8vec4(before ? glm::u8vec3(20, 20, 250) : wallPattern(x, y), 255);
        }
    }
    view.texture = std::move(colour);
    return view;
}

BehindPhoto behindOf(const ReferenceView& view, double percent = 8) {
    Job job;
    auto behind = behindPhoto(view, {percent}, job);
    if (!behind) {
        ADD_FAILURE() << behind.error().text();
        return {};
    }
    return std::move(*behind);
}

Image<glm::vec4> drawn(const Bundle& bundle, const Camera& camera, Fill fill = Fill::background) {
    Job job;
    RenderSettings settings;
    settings.fill = fill;
    auto renderer = makeRenderer(Backend::cpu, bundle, settings, -1, job);
    if (!renderer) {
        ADD_FAILURE() << renderer.error().text();
        return {};
    }
    return (*renderer)->render(camera)->colour;
}

/// Steps to the right neighbour, squared, of pixels that another picture leaves open.
double textureOf(const Image<glm::vec4>& picture, const Image<glm::vec4>& covered) {
    double sum = 0;
    for (int y = 0; y < picture.height(); ++y) {
        for (int x = 0; x + 1 < picture.width(); ++x) {
            if (covered.at(x, y).a > 0 || covered.at(x + 1, y).a > 0) continue;
            const glm::vec3 d = glm::vec3(picture.at(x + 1, y)) - glm::vec3(picture.at(x, y));
            sum += glm::dot(d, d);
        }
    }
    return sum;
}

Bundle withBehind(const ReferenceView& view) {
    Bundle bundle;
    bundle.views = {view};
    Job job;
    EXPECT_TRUE(addBehind(bundle, {}, job));
    return bundle;
}

}  // namespace

TEST(BehindPhoto, WhatACardHidesIsTheWallAsFarAsItComesOut) {
    const ReferenceView photo = cardBeforeWall(true);
    const BehindPhoto behind = behindOf(photo);
    ASSERT_TRUE(behind.view.check());
    EXPECT_TRUE(behind.view.background);
    const Rgba8Image& colour = *behind.view.texture.rgba8();
    int blue = 0, seen = 0;
    for (int y = 3; y < kPhotoHeight - 3; ++y) {
        for (int x = 3; x < kPhotoWidth - 3; ++x) {
            const int u = x + behind.border.x, v = y + behind.border.y;
            const float depth = behind.view.depth.at(u, v);
            const int in = kCard.has(x, y) ? kCard.inside(x, y) : 0;
            if (in > 0 && static_cast<float>(in) < kOut - 2) {
                EXPECT_TRUE(hasPoint(depth)) << x << ' ' << y;
            }
            const bool beside = Box{67, 37, 133, 113}.has(x, y);
            // It goes on under the card by eight pixels more.
            if (static_cast<float>(in) > kOut + 9 || !beside) {
                EXPECT_FALSE(hasPoint(depth)) << x << ' ' << y;
            }
            EXPECT_EQ(colour.at(u, v).a > 0, hasPoint(depth));
            if (!hasPoint(depth)) continue;
            EXPECT_NEAR(depth, kFarWall, 1e-3);
            ++seen;
            blue += colour.at(u, v).b > 12;
        }
    }
    EXPECT_GT(seen, 2000);
    EXPECT_EQ(blue, 0);
}

TEST(BehindPhoto, WithoutACardThereIsOnlyTheBorder) {
    const BehindPhoto behind = behindOf(cardBeforeWall(false));
    // What is under the edge of the frame, two pixels wide.
    EXPECT_LE(behind.hidden, 2 * 2 * (kPhotoWidth + kPhotoHeight));
    for (int y = 0; y < behind.view.depth.height(); ++y) {
        for (int x = 0; x < behind.view.depth.width(); ++x) {
            const Box frame = {behind.border.x, behind.border.y, behind.border.x + kPhotoWidth,
                               behind.border.y + kPhotoHeight};
            EXPECT_EQ(hasPoint(behind.view.depth.at(x, y)),
                      !frame.has(x, y) || frame.inside(x, y) <= 2);
        }
    }
}

TEST(BehindPhoto, DepthIsThatOfTheNearestPlaceBehindAndNotTheFarthest) {
    // The shelf begins behind the middle of the card, which hides that edge.
    const BehindPhoto behind = behindOf(cardBeforeWall(true, 100));
    const auto at = [&](int x, int y) {
        return behind.view.depth.at(x + behind.border.x, y + behind.border.y);
    };
    EXPECT_NEAR(at(kCard.x0 + 4, 75), kFarWall, 0.05);
    EXPECT_NEAR(at(kCard.x1 - 4, 75), kShelf, 0.05);
}

TEST(BehindPhoto, TextureGoesOnBehind) {
    const BehindPhoto behind = behindOf(cardBeforeWall(true));
    double invented = 0, truth = 0;
    const Rgba8Image& colour = *behind.view.texture.rgba8();
    for (int y = kCard.y0 + 4; y < kCard.y1 - 4; ++y) {
        for (int x = kCard.x0 + 2; x < kCard.x0 + 18; ++x) {
            const glm::ivec2 at = glm::ivec2(x, y) + behind.border;
            const auto step = [](glm::u8vec3 a, glm::u8vec3 b) {
                const glm::vec3 d = glm::vec3(a) - glm::vec3(b);
                return glm::dot(d, d);
            };
            invented +=
                step(glm::u8vec3(colour.at(at.x, at.y)), glm::u8vec3(colour.at(at.x + 1, at.y)));
            truth += step(wallPattern(x, y), wallPattern(x + 1, y));
        }
    }
    EXPECT_GT(invented, 0.5 * truth);
    EXPECT_LT(invented, 1.6 * truth);
}

TEST(BehindPhoto, AnyNumberOfThreadsGivesTheSameBytes) {
    const ReferenceView photo = cardBeforeWall(true, 100);
    const auto with = [&](int threads) {
        const ThreadLimit limit(threads);
        return behindOf(photo);
    };
    const BehindPhoto one = with(1), four = with(4);
    EXPECT_EQ(one.view.depth, four.view.depth);
    EXPECT_EQ(one.view.texture, four.view.texture);
}

TEST(BehindPhoto, ThePhotographsOwnPoseStaysExact) {
    const ReferenceView photo = cardBeforeWall(true);
    Bundle alone;
    alone.views = {photo};
    EXPECT_EQ(drawn(withBehind(photo), photo.camera), drawn(alone, photo.camera));
}

TEST(BehindPhoto, FromTheSideTheWallIsThereAndNoBorder) {
    const ReferenceView photo = cardBeforeWall(true);
    const Bundle bundle = withBehind(photo);
    Bundle alone, wall;
    alone.views = {photo};
    wall.views = {cardBeforeWall(false)};
    const double step = 0.08 * kFarWall;
    for (const glm::dvec3 aside : {glm::dvec3(step, 0, 0), glm::dvec3(-step, 0, 0),
                                   glm::dvec3(0, step, 0), glm::dvec3(0, -step, 0)}) {
        Camera camera = photo.camera;
        camera.position += aside;
        camera.orientation = *lookAt(camera.position, {0, 0, -kFarWall});
        const Image<glm::vec4> picture = drawn(bundle, camera);
        int blue = 0;
        for (int y = 0; y < kPhotoHeight; ++y) {
            for (int x = 0; x < kPhotoWidth; ++x) {
                const glm::vec4 c = picture.at(x, y);
                ASSERT_GT(c.a, 0.99f) << x << ' ' << y;
                // Wall and border are never dark, and blue is the card's alone.
                EXPECT_GT(c.b > 0.5f ? c.b : c.r + c.g, 0.4f) << x << ' ' << y;
                blue += c.b > 0.5f;
            }
        }
        EXPECT_NEAR(blue, 60 * 70, 0.05 * 60 * 70);
        // What drawing fills by itself has a tenth of the texture.
        const Image<glm::vec4> covered = drawn(alone, camera, Fill::none);
        EXPECT_GT(textureOf(picture, covered), 0.4 * textureOf(drawn(wall, camera), covered));
    }
}

// A part that was cut from the side of a photograph: the border was as wide as in its middle.
TEST(BehindPhoto, BesideTheAxisTheBorderIsWideEnough) {
    ReferenceView photo = cardBeforeWall(false);
    photo.camera.fx = photo.camera.fy = 200;
    photo.camera.cx = 12;
    Bundle bundle;
    bundle.views = {photo};
    Job job;
    ASSERT_TRUE(addBehind(bundle, {25}, job));
    // What is in the middle of the frame stays there.
    const double middle = (0.5 * kPhotoWidth - photo.camera.cx) / photo.camera.fx;
    for (const double eye : {-0.25, 0.25}) {
        Camera camera = photo.camera;
        camera.position.x += eye * kFarWall;
        const double turn = std::atan(middle) - std::atan(middle - eye);
        camera.orientation = glm::angleAxis(turn, glm::dvec3(0, 1, 0));
        const Image<glm::vec4> picture = drawn(bundle, camera);
        int empty = 0;
        for (int y = 20; y < kPhotoHeight - 20; ++y)
            for (int x = 0; x < kPhotoWidth; ++x) empty += picture.at(x, y).a < 0.99f;
        EXPECT_EQ(empty, 0) << eye;
    }
}

TEST(BehindPhoto, ThingsThatAreNotPhotographsAreRefused) {
    Job job;
    ReferenceView view = cardBeforeWall(true);
    for (const double percent : {0.0, -1.0, 26.0}) {
        const auto behind = behindPhoto(view, {percent}, job);
        ASSERT_FALSE(behind);
        EXPECT_EQ(behind.error().code, ErrorCode::usage);
    }
    ReferenceView flat = view;
    flat.camera.orthographic = true;
    ASSERT_FALSE(behindPhoto(flat, {}, job));
    ReferenceView empty = view;
    empty.depth = Image<float>(kPhotoWidth, kPhotoHeight, kNoDepth);
    empty.noDepth = NoDepth::unknown;
    const auto nothing = behindPhoto(empty, {}, job);
    ASSERT_FALSE(nothing);
    EXPECT_EQ(nothing.error().code, ErrorCode::invalidInput);
    Job small;
    small.limits.maxMemoryBytes = 100000;
    const auto large = behindPhoto(view, {}, small);
    ASSERT_FALSE(large);
    EXPECT_EQ(large.error().code, ErrorCode::invalidInput);
}

TEST(BehindPhoto, ABundleGetsOneBackgroundInPlaceOfItsOwn) {
    Bundle bundle = withBehind(cardBeforeWall(true));
    ASSERT_EQ(bundle.views.size(), 2u);
    EXPECT_EQ(bundle.views[1].name, "photo_behind");
    Job job;
    const auto again = addBehind(bundle, {4}, job);
    ASSERT_TRUE(again) << again.error().text();
    EXPECT_EQ(bundle.views.size(), 2u);
    EXPECT_GT(again->hidden, 0);
    bundle.views[1].background = false;
    const auto two = addBehind(bundle, {}, job);
    ASSERT_FALSE(two);
    EXPECT_EQ(two.error().code, ErrorCode::invalidInput);
}

}  // namespace stx

// Depth whose surfaces in front reach over what is behind: found by the colours there, and taken
// back; exact views stay as they are.

#include "lib/refine/edges.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "lib/base/median.hpp"
#include "lib/packing/packing.hpp"
#include "lib/render/bench/analytic_scene.hpp"
#include "lib/render/surface/prepare/source.hpp"
#include "tests/noisy_depth.hpp"

namespace stx {
namespace {

/// Views of the closed room as thinFatEdges() takes them.
struct Room {
    Bundle bundle;
    std::vector<PixelSpace> spaces;
    std::vector<Image<float>> q;

    explicit Room(Bundle from) : bundle(std::move(from)) {
        for (const ReferenceView& view : bundle.views) {
            spaces.emplace_back(view.camera, 0.0);
            q.push_back(view.depth);
            for (float& value : q.back().pixels())
                value = hasPoint(value) ? static_cast<float>(spaces.back().axis.q(value)) : 0.0f;
        }
    }
    [[nodiscard]] std::vector<EdgeView> views(std::size_t count) {
        std::vector<EdgeView> out;
        for (std::size_t i = 0; i < count; ++i)
            out.push_back({&spaces[i], &bundle.views[i].texture, &q[i], 0.0f});
        return out;
    }
};

Bundle exactRoom() {
    return analyticBundle(AnalyticScene::room, 3);
}

/// Only where the surface in front is clearly before what is behind: slopes stay.
void displaceJumps(Bundle& bundle) {
    Bundle moved = bundle;
    noisy::displaceEdges(moved, 1);
    for (std::size_t i = 0; i < bundle.views.size(); ++i)
        for (std::size_t k = 0; k < bundle.views[i].depth.count(); ++k) {
            float& dist = bundle.views[i].depth.data()[k];
            if (moved.views[i].depth.data()[k] < 0.95f * dist)
                dist = moved.views[i].depth.data()[k];
        }
}

/// Share of the pixels whose q is off by more than this share of it.
double wrong(const Room& room, const Room& exact, std::size_t view, float by) {
    int count = 0;
    for (std::size_t k = 0; k < exact.q[view].count(); ++k) {
        const float truth = exact.q[view].data()[k];
        count += std::abs(room.q[view].data()[k] - truth) > by * truth;
    }
    return static_cast<double>(count) / static_cast<double>(exact.q[view].count());
}

TEST(FatEdges, ExactViewsStayAsTheyAre) {
    Room room(exactRoom());
    const auto before = room.q;
    EXPECT_GT(colourAtEdges(room.views(3)), 0.7f);
    EXPECT_EQ(thinFatEdges(room.views(3)), 0);
    EXPECT_EQ(room.q, before);
}

/// Means of squares of pixels.
Rgba8Image blurred(const Rgba8Image& from, int reach) {
    Rgba8Image out(from.width(), from.height());
    for (int y = 0; y < from.height(); ++y) {
        for (int x = 0; x < from.width(); ++x) {
            glm::ivec4 sum(0);
            int count = 0;
            for (int v = std::max(y - reach, 0); v <= std::min(y + reach, from.height() - 1); ++v)
                for (int u = std::max(x - reach, 0); u <= std::min(x + reach, from.width() - 1);
                     ++u, ++count)
                    sum += glm::ivec4(from.at(u, v));
            out.at(x, y) = glm::u8vec4(sum / count);
        }
    }
    return out;
}

// Edge pixels of blurred pictures have much of the colour of what is behind, but hardly any has all
// of it.
TEST(FatEdges, BlurredEdgesAreExact) {
    Bundle bundle = exactRoom();
    for (auto& view : bundle.views) view.texture = blurred(*view.texture.rgba8(), 5);
    Room room(std::move(bundle));
    const auto shares = sharesAtEdges(room.views(1)[0]);
    EXPECT_LT(medianOf(shares), 0.62f);
    EXPECT_EQ(colourAtEdges(room.views(3)), 1.0f);
    const auto before = room.q;
    EXPECT_EQ(thinFatEdges(room.views(3)), 0);
    EXPECT_EQ(room.q, before);
}

TEST(FatEdges, APixelIsTakenBackEverywhereWhereSlopesMovedToo) {
    const Room exact(exactRoom());
    Bundle bundle = exactRoom();
    noisy::displaceEdges(bundle, 1);
    Room room(std::move(bundle));
    const Room moved = room;
    EXPECT_LT(colourAtEdges(room.views(3)), 0.4f);
    EXPECT_EQ(thinFatEdges(room.views(3)), 1);
    for (std::size_t v = 0; v < 3; ++v) {
        EXPECT_LT(wrong(room, exact, v, 0.01f), 0.3 * wrong(moved, exact, v, 0.01f));
        EXPECT_LT(wrong(room, exact, v, 1e-5f), 0.1 * wrong(moved, exact, v, 1e-5f));
    }
}

TEST(FatEdges, OnlyEdgesAreTakenBackWhereSlopesDidNotMove) {
    const Room exact(exactRoom());
    Bundle bundle = exactRoom();
    displaceJumps(bundle);
    for (const std::size_t count : {1, 3}) {
        Room room(bundle);
        const Room moved = room;
        EXPECT_EQ(thinFatEdges(room.views(count)), 1);
        for (std::size_t v = 0; v < count; ++v) {
            EXPECT_LT(wrong(room, exact, v, 0.01f), 0.5 * wrong(moved, exact, v, 0.01f));
            // Nothing but edges has changed.
            EXPECT_LT(wrong(room, exact, v, 1e-5f), 1.5 * wrong(moved, exact, v, 1e-5f));
        }
    }
}

// The farthest of nine noisy distances differ less from view to view than the distances do.
TEST(FatEdges, NoiseIsNotTakenForMovedSlopes) {
    Bundle bundle = exactRoom();
    displaceJumps(bundle);
    noisy::addNoise(bundle, 0.001);
    Room room(bundle);
    const Room moved = room;
    EXPECT_EQ(thinFatEdges(room.views(3)), 1);
    for (std::size_t v = 0; v < 3; ++v) EXPECT_LT(wrong(room, moved, v, 1e-5f), 0.1);
}

TEST(FatEdges, ViewsOfOneColourTellNothing) {
    Bundle bundle = exactRoom();
    noisy::displaceEdges(bundle, 1);
    for (auto& view : bundle.views)
        view.texture =
            Rgba8Image(view.camera.width, view.camera.height, glm::u8vec4(90, 90, 90, 255));
    Room room(std::move(bundle));
    EXPECT_EQ(colourAtEdges(room.views(3)), 1.0f);
    EXPECT_EQ(thinFatEdges(room.views(3)), 0);
}

/// Pixels whose q is not the same when the views are drawn from an atlas.
int changedByPacking(const Bundle& bundle) {
    Job job;
    PackSettings settings;
    settings.layout = PackSettings::Layout::tight;
    const auto atlas = pack(bundle, settings, job);
    if (!atlas) return -1;
    const auto set = PageSet::of(*atlas, job);
    if (!set || set->views()[0].whole) return -1;
    const surface::SurfaceScene whole{PageSet(bundle).refined({})}, packed(set->refined({}));
    int changed = 0;
    for (std::size_t v = 0; v < bundle.views.size(); ++v)
        for (int y = 0; y < whole.sources[v].height; ++y)
            for (int x = 0; x < whole.sources[v].width; ++x)
                changed += whole.sources[v].q(x, y) != packed.sources[v].q(x, y);
    return changed;
}

TEST(FatEdges, AreTakenBackInAnAtlasAsInWholeViews) {
    Bundle bundle = exactRoom();
    noisy::displaceEdges(bundle, 1);
    EXPECT_EQ(changedByPacking(bundle), 0);
}

TEST(NoisyDepth, AgreesInAnAtlasAsInWholeViews) {
    Bundle bundle = exactRoom();
    bundle.views.resize(2);
    noisy::addNoise(bundle, 0.005);
    EXPECT_EQ(changedByPacking(bundle), 0);
}

}  // namespace
}  // namespace stx

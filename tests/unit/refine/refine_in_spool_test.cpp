// Refining in a spool: the same bytes as in memory, whatever is wrong with the views, and nothing
// of all views stays in memory.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>
#include <string>

#include "lib/model/view_table.hpp"
#include "lib/refine/refine.hpp"
#include "lib/render/bench/analytic_scene.hpp"
#include "lib/surface/normals.hpp"
#include "tests/noisy_depth.hpp"
#include "tests/torus_bundle.hpp"

namespace stx {
namespace {

/// Memory that is counted.
class CountedSpool final : public PixelSpool {
  public:
    void* take(std::size_t bytes) override {
        void* room = std::malloc(bytes);
        if (!room) throw std::bad_alloc();
        const std::size_t now = taken_ += bytes;
        for (std::size_t most = most_; now > most && !most_.compare_exchange_weak(most, now);) {
        }
        return room;
    }
    void give(void* room, std::size_t bytes) noexcept override {
        taken_ -= bytes;
        std::free(room);
    }
    void settle() noexcept override {}

    [[nodiscard]] std::size_t taken() const { return taken_; }
    [[nodiscard]] std::size_t most() const { return most_; }

  private:
    std::atomic<std::size_t> taken_ = 0, most_ = 0;
};

void expectSame(const Bundle& a, const Bundle& b, const std::string& what) {
    ASSERT_EQ(a.views.size(), b.views.size());
    EXPECT_EQ(a.bounds.has_value(), b.bounds.has_value());
    if (a.bounds && b.bounds) {
        EXPECT_EQ(a.bounds->min, b.bounds->min) << what;
        EXPECT_EQ(a.bounds->max, b.bounds->max) << what;
    }
    for (std::size_t v = 0; v < a.views.size(); ++v) {
        const ReferenceView &one = a.views[v], &other = b.views[v];
        EXPECT_EQ(one.depth, other.depth) << what << ", view " << v;
        EXPECT_EQ(one.texture, other.texture) << what << ", view " << v;
        EXPECT_EQ(one.normal, other.normal) << what << ", view " << v;
        EXPECT_EQ(one.splatU, other.splatU) << what << ", view " << v;
        EXPECT_EQ(one.splatV, other.splatV) << what << ", view " << v;
        EXPECT_EQ(one.camera, other.camera) << what << ", view " << v;
        EXPECT_EQ(one.refined, other.refined) << what << ", view " << v;
        EXPECT_EQ(one.noDepth, other.noDepth) << what << ", view " << v;
        EXPECT_EQ(one.nearPlane, other.nearPlane) << what << ", view " << v;
        EXPECT_EQ(one.farPlane, other.farPlane) << what << ", view " << v;
    }
}

/// Refines in memory and in spools, with room for all views and for one.
RefineReport expectSameInSpool(const Bundle& bundle, const RefineSettings& settings,
                               const std::string& what) {
    Job job;
    Bundle inMemory = bundle;
    const auto expected = refine(inMemory, settings, job);
    EXPECT_TRUE(expected) << what;
    if (!expected) return {};
    const ReferenceView& first = bundle.views[0];
    for (const bool little : {false, true}) {
        Job own;
        if (little) own.limits.maxMemoryBytes = 40 * first.depth.count();
        CountedSpool spool;
        std::size_t images = 0, pixels = 0;
        {
            Bundle inSpool = bundle;
            for (ReferenceView& view : inSpool.views) view.moveTo(&spool);
            const auto report = refine(inSpool, settings, spool, own);
            EXPECT_TRUE(report) << what;
            if (!report) return *expected;
            EXPECT_EQ(report->text(), expected->text());
            EXPECT_EQ(report->noise, expected->noise);
            EXPECT_EQ(report->ownColour, expected->ownColour);
            expectSame(inMemory, inSpool, what);
            for (const ReferenceView& view : inSpool.views) {
                pixels += view.depth.count();
                images += view.depth.count() * ViewImageKinds::of(view).bytesPerPixel();
            }
            EXPECT_EQ(spool.taken(), images) << what << ": the images, and nothing else, stay";
        }
        EXPECT_EQ(spool.taken(), 0u);
        // What is known of each pixel: q; of noisy views its surface, q before a step and after it,
        // and how light it is.
        EXPECT_LE(spool.most(), images + 28 * pixels) << what;
        const bool noisy = expected->of(RefineStep::noise).views > 0;
        EXPECT_GE(spool.most(), images + (noisy ? 12 : 4) * pixels) << what;
    }
    return *expected;
}

Bundle spoiled(const char* fault) {
    Bundle bundle = analyticBundle(AnalyticScene::object, 6);
    EXPECT_TRUE(noisy::damage(bundle, fault)) << fault;
    bundle.bounds = bundle.computeBounds();
    return bundle;
}

TEST(RefineInSpool, IsTheSameAsInMemory) {
    const auto noise = expectSameInSpool(spoiled("noise1"), RefineSettings().forSplats(), "noise");
    for (const RefineStep step :
         {RefineStep::noise, RefineStep::silhouettes, RefineStep::agree, RefineStep::colours})
        EXPECT_GT(noise.of(step).views, 0) << infoOf(step).name;
    Job job;
    Bundle baked = spoiled("noise1");
    ASSERT_TRUE(bake(baked, {}, job));
    EXPECT_TRUE(expectSameInSpool(baked, {}, "baked").changed());
    const auto edges = expectSameInSpool(spoiled("edges1"), {}, "edges");
    EXPECT_GT(edges.of(RefineStep::edges).views, 0);
    const auto light = expectSameInSpool(spoiled("light"), {}, "light");
    EXPECT_GT(light.of(RefineStep::exposure).views, 0);
    EXPECT_FALSE(expectSameInSpool(torusViews(64), {}, "exact").changed());
}

TEST(RefineInSpool, IsTheSameOfStepsThatAreAskedFor) {
    RefineSettings settings;
    for (const RefineStep step :
         {RefineStep::mixed, RefineStep::gaps, RefineStep::align, RefineStep::poses})
        settings.set(step, true);
    Bundle bundle = spoiled("missing3");
    bundle.views[1].camera.position += glm::dvec3(0.01, 0, 0);
    const auto report = expectSameInSpool(bundle, settings, "asked for");
    EXPECT_GT(report.of(RefineStep::gaps).views, 0);
    EXPECT_GT(report.of(RefineStep::poses).views, 0);
}

TEST(RefineInSpool, IsTheSameOfBackgroundsAndOfCapturedViewsThatDisagree) {
    Bundle behind = spoiled("noise1");
    behind.views[2].background = behind.views[4].background = true;
    expectSameInSpool(behind, {}, "background");
    Bundle captured = analyticBundle(AnalyticScene::room, 4);
    for (std::size_t v = 0; v < captured.views.size(); ++v) {
        ReferenceView& view = captured.views[v];
        view.noDepth = NoDepth::unknown;
        for (float& d : view.depth.pixels())
            if (hasPoint(d)) d *= 1.0f + 0.01f * static_cast<float>(v % 2);
        view.farPlane *= 1.02;
    }
    const auto report = expectSameInSpool(captured, {}, "captured");
    EXPECT_GT(report.of(RefineStep::agree).views, 0);
}

TEST(RefineInSpool, AViewThatIsTooLargeIsRefused) {
    CountedSpool spool;
    Bundle bundle = torusViews(64);
    Job job;
    job.limits.maxMemoryBytes = 10 * bundle.views[0].depth.count();
    const auto report = refine(bundle, {}, spool, job);
    ASSERT_FALSE(report);
    EXPECT_EQ(report.error().code, ErrorCode::invalidInput);
    EXPECT_EQ(spool.most(), 0u);
}

}  // namespace
}  // namespace stx

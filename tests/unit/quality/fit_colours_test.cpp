#include "lib/quality/fit_colours.hpp"

#include <gtest/gtest.h>

#include "lib/packing/prune.hpp"
#include "tests/torus_bundle.hpp"

namespace stx {
namespace {

/// Views of the torus, pruned, with the colours that were kept darker by `codes`.
Bundle prunedTorus(const Bundle& source, int codes) {
    Bundle pruned = source;
    Job job;
    EXPECT_TRUE(prune(pruned, {}, job));
    for (auto& view : pruned.views)
        for (auto& c : view.texture.rgba8()->pixels())
            for (int i = 0; i < 3; ++i) c[i] = static_cast<std::uint8_t>(std::max(0, c[i] - codes));
    return pruned;
}

TEST(FitColours, BringsPicturesNearerToTheSource) {
    const Bundle source = torusViews(64);
    Bundle pruned = prunedTorus(source, 20);
    const Bundle before = pruned;
    Job job;
    const auto fit = fitColours(source, pruned, job);
    ASSERT_TRUE(fit) << fit.error().text();
    EXPECT_GT(fit->after, fit->before + 2);
    for (std::size_t i = 0; i < pruned.views.size(); ++i) {
        const ReferenceView &a = before.views[i], &b = pruned.views[i];
        EXPECT_EQ(a.depth, b.depth);
        for (std::size_t p = 0; p < a.depth.count(); ++p) {
            const glm::u8vec4 was = a.texture.rgba8()->data()[p], is = b.texture.rgba8()->data()[p];
            EXPECT_EQ(was.a, is.a);
            if (!hasPoint(a.depth.data()[p])) {
                EXPECT_EQ(was, is) << "only points are fitted";
            }
        }
    }
    // It never makes pictures worse: where it would, nothing changes.
    for (int round = 0; round < 6; ++round) {
        const Bundle last = pruned;
        const auto again = fitColours(source, pruned, job);
        ASSERT_TRUE(again);
        EXPECT_GE(again->after, again->before);
        if (again->after > again->before) continue;
        for (std::size_t i = 0; i < pruned.views.size(); ++i)
            EXPECT_EQ(last.views[i].texture, pruned.views[i].texture);
    }
}

TEST(FitColours, LeavesWhatLacksNothing) {
    const Bundle source = torusViews(48);
    Bundle same = source;
    Job job;
    const auto fit = fitColours(source, same, job);
    ASSERT_TRUE(fit);
    EXPECT_EQ(fit->before, fit->after);
    for (std::size_t i = 0; i < same.views.size(); ++i)
        EXPECT_EQ(source.views[i].texture, same.views[i].texture);
}

TEST(FitColours, WantsTheViewsThatWerePruned) {
    const Bundle source = torusViews(48);
    Bundle fewer = source;
    fewer.views.pop_back();
    Job job;
    EXPECT_EQ(fitColours(source, fewer, job).error().code, ErrorCode::usage);
    job.cancelled = true;
    Bundle same = source;
    EXPECT_FALSE(fitColours(source, same, job));
}

}  // namespace
}  // namespace stx

#pragma once

#include <functional>

#include <gtest/gtest.h>

#include "lib/background/temporal.hpp"

/// The background of `count` frames, streamed as often as it takes.
inline stx::BackgroundModel backgroundOf(const std::function<stx::ReferenceView(int)>& frame,
                                         const std::function<double(int)>& time, int count,
                                         stx::Job& job) {
    auto background = stx::TemporalBackground::start(frame(0), {}, job);
    EXPECT_TRUE(background) << background.error().text();
    for (int pass = 0; pass < background->passes(); ++pass) {
        for (int i = 0; i < count; ++i) {
            const auto ok = background->add(frame(i), time(i), job);
            EXPECT_TRUE(ok) << ok.error().text();
        }
        const auto ok = background->endPass(job);
        EXPECT_TRUE(ok) << ok.error().text();
    }
    auto model = background->finish(job);
    EXPECT_TRUE(model) << model.error().text();
    return *std::move(model);
}

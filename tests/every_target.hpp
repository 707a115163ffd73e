#pragma once

#include <gtest/gtest.h>
#include <hwy/targets.h>

namespace stx {

/// Runs `body` on each kind of vectors that this machine has.
template <class Body>
void onEveryTarget(const Body& body) {
    for (const auto target : hwy::SupportedAndGeneratedTargets()) {
        hwy::SetSupportedTargetsForTest(target);
        hwy::GetChosenTarget().DeInit();
        SCOPED_TRACE(hwy::TargetName(target));
        body();
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().DeInit();
}

}  // namespace stx

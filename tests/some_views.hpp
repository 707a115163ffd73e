#pragma once

#include <utility>
#include <vector>

#include "lib/model/bundle.hpp"

/// A bundle whose views that are not needed have their headers only, as one that was read for some
/// pictures (see stx::neededViews()).
inline stx::Bundle withSomeViews(stx::Bundle bundle, const std::vector<bool>& needed) {
    for (std::size_t i = 0; i < needed.size(); ++i) {
        if (needed[i]) continue;
        stx::ReferenceView header;
        static_cast<stx::ViewHeader&>(header) = bundle.views[i];
        bundle.views[i] = std::move(header);
    }
    return bundle;
}

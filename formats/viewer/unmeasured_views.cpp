#include "formats/viewer/unmeasured_views.hpp"

#include <algorithm>
#include <optional>

#include "lib/refine/unmeasured.hpp"

namespace stx {
namespace {

/// One of the views of a camera: of `depth` those that `takes` says, if there are any.
template <typename Takes>
std::optional<ReferenceView> layerOf(const ReferenceView& captured, const Image<float>& depth,
                                     const Takes& takes) {
    ReferenceView out;
    static_cast<ViewHeader&>(out) = captured;
    out.noDepth = NoDepth::unknown;
    out.pruned = false;
    out.depthBits = 16;
    out.refined = {};
    out.colourFile = {};
    out.depth = Image<float>(depth.width(), depth.height(), kNoDepth);
    float nearest = 0, farthest = 0;
    for (std::size_t i = 0; i < depth.count(); ++i) {
        const float dist = depth.data()[i];
        if (!hasPoint(dist) || !takes(dist)) continue;
        out.depth.data()[i] = dist;
        nearest = nearest > 0 ? std::min(nearest, dist) : dist;
        farthest = std::max(farthest, dist);
    }
    if (!(farthest > 0)) return std::nullopt;
    // What is all at one distance has planes that differ, too.
    out.nearPlane = nearest < farthest ? nearest : 0.5 * nearest;
    out.farPlane = farthest;
    out.texture = captured.texture;
    return out;
}

}  // namespace

Bundle unmeasuredViews(const Bundle& all) {
    Bundle out;
    out.origin = all.origin;
    std::vector<RefineView> given;
    std::vector<bool> wanted;
    std::vector<const ReferenceView*> views;
    for (const ReferenceView& view : all.views) {
        if (view.background) continue;
        views.push_back(&view);
        given.push_back({&view, &view.texture, &view.depth});
        wanted.push_back(mayHaveUnmeasured(view));
    }
    if (std::ranges::find(wanted, true) == wanted.end()) return out;
    const UnmeasuredDepth found = unmeasuredDepth(given, wanted);
    const double limit = 0.5 * found.farAway;
    for (std::size_t i = 0; i < views.size(); ++i) {
        if (found.depth[i].empty()) continue;
        auto near = layerOf(*views[i], found.depth[i], [&](float d) { return d < limit; });
        auto far = layerOf(*views[i], found.depth[i], [&](float d) { return d >= limit; });
        if (far) far->name += " far";
        if (near) out.views.push_back(std::move(*near));
        if (far) out.views.push_back(std::move(*far));
    }
    return out;
}

std::uint64_t memoryOfUnmeasured(const ViewTable& views) {
    return memoryOfAll(views, peak::kPageUnmeasured);
}

}  // namespace stx

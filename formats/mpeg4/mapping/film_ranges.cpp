#include "formats/mpeg4/mapping/film_ranges.hpp"

#include <algorithm>

#include "formats/mpeg4/mapping/texture_images.hpp"
#include "formats/mpeg4/mapping/view_images.hpp"
#include "formats/mpeg4/scene/placement.hpp"

namespace stx::mpeg4 {
namespace {

/// Whether headers alone tell of a frame what a film has to know.
bool headersTellAll(const ViewTable& table, bool alpha) {
    if (!table.about().bounds || !table.planesKnown()) return false;
    return std::ranges::none_of(table.kinds(), &ViewImageKinds::hasSplats) &&
           std::ranges::all_of(table.about().views, [&](const ViewHeader& view) {
               return planesSaySomething(view.nearPlane, view.farPlane) &&
                      (alpha || view.noDepth == NoDepth::empty);
           });
}

void addPlanes(ViewRange& range, const ViewHeader& view) {
    range.nearPlane = std::min(range.nearPlane, view.nearPlane);
    range.farPlane = std::max(range.farPlane, view.farPlane);
}

/// `alpha`: as keepsAlpha().
void addPixels(ViewRange& range, const ReferenceView& view, bool alpha) {
    // The planes of a view without a point are around nothing.
    if (std::ranges::any_of(view.depth.pixels(), hasPoint)) addPlanes(range, view);
    if (view.hasSplats()) range.longestSplat = std::max(range.longestSplat, longestSplatOf(view));
    if (alpha || view.noDepth == NoDepth::empty) return;
    bool clamped = false;
    const Rgba8Image* own = view.texture.rgba8();
    range.unknown.add(own ? *own : rgba8FromTexture(view.texture, clamped), view.depth);
}

}  // namespace

bool keepsAlpha(const SceneWriteOptions& options) {
    return options.h264 < 0 && options.texture == SceneWriteOptions::Texture::png;
}

Result<void> FilmRanges::add(const ViewTable& table, Job& job) {
    const Bundle& about = table.about();
    const bool first = ranges_.empty(), alpha = keepsAlpha(options_);
    ranges_.resize(table.count());
    for (std::size_t k = 0; k < table.count(); ++k)
        STX_CHECK(within(fmt::format("view '{}'", about.views[k].name),
                         addView(ranges_[k], about.views[k], table.kindsOf(k), first)));
    std::vector<Bounds> bounds(table.count());
    if (headersTellAll(table, alpha)) {
        for (std::size_t k = 0; k < table.count(); ++k) addPlanes(ranges_[k], about.views[k]);
    } else {
        STX_CHECK(forEachView(
            table, {"reading", 0}, job,
            [&](std::size_t k, const std::shared_ptr<const ReferenceView>& view) -> Result<void> {
                if (!about.bounds) bounds[k] = view->computeBounds();
                addPixels(ranges_[k], *view, alpha);
                return {};
            }));
    }
    if (about.bounds) bounds = {*about.bounds};
    for (const Bounds& here : bounds) {
        if (here.empty()) continue;
        bounds_.add(here.min);
        bounds_.add(here.max);
    }
    return {};
}

Result<void> FilmRanges::addView(ViewRange& range, const ViewHeader& view,
                                 const ViewImageKinds& kinds, bool first) const {
    if (first) {
        range.normals = kinds.normal;
        range.splats = kinds.hasSplats();
        range.refined.steps = view.refined.steps;
    }
    range.refined.doubt = std::max(range.refined.doubt, view.refined.doubt);
    if (range.normals != kinds.normal || range.splats != kinds.hasSplats())
        return fail(ErrorCode::unsupported,
                    "normals or splats are there in some frames only; bake all or none");
    if (view.pruned && !keepsAlpha(options_))
        return fail(ErrorCode::unsupported,
                    "a pruned view that moves keeps its mark in the alpha of its colour, which {} "
                    "does not have; use PNG",
                    options_.h264 >= 0 ? "H.264" : "JPEG");
    if (view.noDepth == NoDepth::unknown)
        range.everUnknown = true;
    else {
        range.everEmpty = true;
        range.unknown.addEmpty();
    }
    range.everPruned = range.everPruned || view.pruned;
    range.everWhole = range.everWhole || !view.depthMayBeUnknown();
    range.depthBits = std::max(range.depthBits, view.depthBits);
    return {};
}

std::vector<ViewRange> FilmRanges::finish(const Bundle& first, Job& job) {
    for (std::size_t k = 0; k < ranges_.size(); ++k) {
        ViewRange& range = ranges_[k];
        const ViewHeader& view = first.views[k];
        if (range.everUnknown && range.everEmpty)
            job.note(
                fmt::format("view '{}': missing depth is empty in some frames and unknown in "
                            "others; in MPEG-4 it is unknown in all",
                            view.name));
        if (range.everPruned && range.everWhole)
            job.note(
                fmt::format("view '{}': it is pruned in some frames and not in others; in MPEG-4 "
                            "it is in all",
                            view.name));
        if (range.farPlane > 0) continue;
        addPlanes(range, view);
        // Pruning and backgrounds leave such views on purpose.
        if (!range.everPruned && !view.background)
            job.note(fmt::format("view '{}': no frame of it has a point", view.name));
    }
    return std::move(ranges_);
}

}  // namespace stx::mpeg4

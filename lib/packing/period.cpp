#include "lib/packing/period.hpp"

#include <limits>

#include "lib/base/parallel.hpp"
#include "lib/packing/layout.hpp"

namespace stx {
namespace {

bool isPartial(const Texture& texture, int x, int y) {
    const float alpha = texture.at(x, y).a;
    return alpha > 0 && alpha < 1;
}

}  // namespace

Result<void> PackPeriod::add(const Bundle& whole, const Bundle& pruned) {
    STX_CHECK(whole.check());
    if (views_.empty()) {
        for (const ReferenceView& view : whole.views) {
            const Image<std::uint8_t> none(view.depth.width(), view.depth.height(), 0);
            views_.push_back({view.camera, view.name, none, none, none});
        }
    }
    const auto alike = [](const std::vector<View>& a, const std::vector<ReferenceView>& b) {
        bool same = a.size() == b.size();
        for (std::size_t i = 0; same && i < a.size(); ++i)
            same = a[i].kept.size() == b[i].depth.size();
        return same;
    };
    if (!alike(views_, whole.views) || !alike(views_, pruned.views))
        return fail(ErrorCode::invalidInput,
                    "views come, go or change their size; frames that are packed alike have the "
                    "same views");
    parallelFor(0, views_.size(), [&](std::size_t k) {
        View& to = views_[k];
        for (int y = 0; y < to.kept.height(); ++y) {
            for (int x = 0; x < to.kept.width(); ++x) {
                to.kept.at(x, y) |= hasPoint(pruned.views[k].depth.at(x, y)) ? 1 : 0;
                to.rim.at(x, y) |= isPartial(whole.views[k].texture, x, y) ? 1 : 0;
                to.stays.at(x, y) |= isPartial(pruned.views[k].texture, x, y) ? 1 : 0;
            }
        }
    });
    return {};
}

PruneReport PackPeriod::prune(Bundle& frame) const {
    PruneReport report;
    report.sourcePoints = frame.pointCount();
    report.psnr = std::numeric_limits<double>::quiet_NaN();
    std::vector<std::int64_t> object(frame.views.size()), unmeasured(object.size());
    parallelFor(0, frame.views.size(), [&](std::size_t k) {
        object[k] = objectPixels(frame.views[k]);
        if (mayBeUnmeasured(frame.views[k]))
            unmeasured[k] = object[k] - frame.views[k].pointCount();
        Image<std::uint8_t> kept = views_[k].kept;
        for (std::size_t p = 0; p < kept.count(); ++p)
            kept.data()[p] &= hasPoint(frame.views[k].depth.data()[p]) ? 1 : 0;
        keepOnly(kept, frame.views[k]);
    });
    for (const std::int64_t n : object) report.sourcePixels += n;
    for (const std::int64_t n : unmeasured) report.unmeasuredPixels += n;
    report.keptPixels = frame.pointCount();
    for (const auto& v : frame.views) report.emptiedViews += v.pointCount() == 0 ? 1 : 0;
    return report;
}

Bundle PackPeriod::content() const {
    Bundle out;
    for (const View& view : views_) {
        const int width = view.kept.width(), height = view.kept.height();
        ReferenceView v;
        v.camera = view.camera;
        v.name = view.name;
        v.depth = Image<float>(width, height, kNoDepth);
        Rgba8Image colour(width, height, glm::u8vec4(0));
        for (int y = 0; y < height; ++y) {
            for (int x = 0; x < width; ++x) {
                if (view.kept.at(x, y)) v.depth.at(x, y) = 1;
                bool beside = false;
                for (int ny = std::max(0, y - 1); ny <= std::min(height - 1, y + 1); ++ny)
                    for (int nx = std::max(0, x - 1); nx <= std::min(width - 1, x + 1); ++nx)
                        beside = beside || view.kept.at(nx, ny);
                // Soft edges that pruning one frame gives up stay where another keeps the surface.
                if (view.stays.at(x, y) || (view.rim.at(x, y) && beside)) colour.at(x, y).a = 128;
            }
        }
        v.texture = std::move(colour);
        out.views.push_back(std::move(v));
    }
    return out;
}

}  // namespace stx

#include "lib/model/bundle.hpp"

#include <algorithm>
#include <string_view>
#include <unordered_set>

#include "lib/base/parallel.hpp"
#include "lib/model/depth_values.hpp"
#include "lib/model/view_checks.hpp"
#include "lib/model/view_table.hpp"

namespace stx {

void ReferenceView::moveTo(PixelSpool* spool) {
    texture.moveTo(spool);
    depth.moveTo(spool);
    for (Image<glm::vec3>* image : {&normal, &splatU, &splatV, &emissive}) image->moveTo(spool);
    metallicRoughness.moveTo(spool);
}

std::int64_t ReferenceView::pointCount() const {
    return summariseDepth(depth.pixels()).points;
}

Result<std::int64_t> ReferenceView::checkedPointCount() const {
    return countPoints(depth);
}

Bounds ReferenceView::computeBounds() const {
    return boundsOfPoints(depth, camera);
}

Result<std::int64_t> countPoints(const Image<float>& depth) {
    const DepthSummary summary = summariseDepth(depth.pixels());
    if (!summary.wrong) return summary.points;
    return depthError(*std::ranges::find_if(depth.pixels(), [](float d) { return !(d >= 0); }));
}

Result<void> checkNames(const std::vector<std::string_view>& names) {
    std::unordered_set<std::string_view> taken;
    for (const std::string_view name : names)
        if (!name.empty() && !taken.insert(name).second)
            return fail(ErrorCode::invalidInput,
                        "two views have the name '{}'; names are unique in a bundle", name);
    return {};
}

Result<void> checkOrigin(const glm::dvec3& origin) {
    if (std::isfinite(origin.x) && std::isfinite(origin.y) && std::isfinite(origin.z)) return {};
    return fail(ErrorCode::invalidInput,
                "the origin is {:g}, {:g}, {:g}; finite numbers are expected", origin.x, origin.y,
                origin.z);
}

Result<void> checkNumbers(const ViewHeader& view) {
    STX_CHECK(view.camera.check());
    if (!std::isfinite(view.nearPlane) || !std::isfinite(view.farPlane) || view.nearPlane < 0 ||
        !(view.nearPlane < view.farPlane))
        return fail(ErrorCode::invalidInput,
                    "nearPlane is {:g} and farPlane {:g}; 0 <= nearPlane < farPlane must hold",
                    view.nearPlane, view.farPlane);
    if (view.depthBits != 8 && view.depthBits != 16 && view.depthBits != 32)
        return fail(ErrorCode::invalidInput, "depth has {} bits; 8, 16 or 32 (float) is possible",
                    view.depthBits);
    return {};
}

Result<void> ReferenceView::checkHeader() const {
    STX_CHECK(checkNumbers(*this));
    const auto sizeOf = [](const auto& image) {
        return fmt::format("{}x{}", image.width(), image.height());
    };
    const auto fits = [&](const auto& image) {
        return image.width() == camera.width && image.height() == camera.height;
    };
    if (!fits(depth) || !fits(texture))
        return fail(ErrorCode::invalidInput,
                    "depth is {} but texture is {} and the camera {}x{}; all must match",
                    sizeOf(depth), sizeOf(texture), camera.width, camera.height);
    if ((!normal.empty() && !fits(normal)) || (!splatU.empty() && !fits(splatU)) ||
        (!splatV.empty() && !fits(splatV)))
        return fail(ErrorCode::invalidInput,
                    "normal is {}, splatU {} and splatV {} but depth is {}; all must match",
                    sizeOf(normal), sizeOf(splatU), sizeOf(splatV), sizeOf(depth));
    if (splatU.empty() != splatV.empty())
        return fail(ErrorCode::invalidInput,
                    "it has {0} without {1}; both axes of the splats, or none, are expected",
                    splatV.empty() ? "splatU" : "splatV", splatV.empty() ? "splatV" : "splatU");
    if ((!metallicRoughness.empty() && !fits(metallicRoughness)) ||
        (!emissive.empty() && !fits(emissive)))
        return fail(ErrorCode::invalidInput,
                    "metallicRoughness is {} and emissive {} but depth is {}; all must match",
                    sizeOf(metallicRoughness), sizeOf(emissive), sizeOf(depth));
    return {};
}

Result<void> ReferenceView::check() const {
    STX_CHECK(checkHeader());
    STX_CHECK(checkedPointCount());
    return texture.check();
}

const char* Bundle::nodeKind() const {
    for (const auto& v : views) {
        if (v.hasNormals() || v.hasSplats()) return "SimpleTextureV2";
    }
    return "SimpleTexture";
}

bool Bundle::pruned() const {
    return std::any_of(views.begin(), views.end(), [](const ReferenceView& v) { return v.pruned; });
}

bool Bundle::hasMaterial() const {
    return std::any_of(views.begin(), views.end(),
                       [](const ReferenceView& v) { return v.hasMaterial(); });
}

void Bundle::noteMaterialLeftOut(Job& job) const {
    stx::noteMaterialLeftOut(*viewsOf(*this), job);
}

std::int64_t Bundle::pointCount() const {
    std::int64_t n = 0;
    for (const auto& v : views) n += v.pointCount();
    return n;
}

Bounds Bundle::computeBounds() const {
    std::vector<Bounds> each(views.size());
    parallelFor(0, views.size(), [&](std::int64_t i) { each[i] = views[i].computeBounds(); });
    return boundsTogether(each);
}

namespace {

using ViewCheck = Result<void> (ReferenceView::*)() const;

Result<void> checkViews(const std::vector<ReferenceView>& views, ViewCheck check) {
    if (views.empty()) return fail(ErrorCode::invalidInput, "the bundle has no reference view");
    for (std::size_t i = 0; i < views.size(); ++i) {
        STX_CHECK(within(fmt::format("view {}", i), (views[i].*check)()));
        if (views[i].texture.isLinear() != views[0].texture.isLinear())
            return fail(ErrorCode::invalidInput,
                        "view {} is {} but view 0 is {}; a bundle has one colour space", i,
                        views[i].texture.isLinear() ? "linear" : "sRGB",
                        views[0].texture.isLinear() ? "linear" : "sRGB");
    }
    return {};
}

}  // namespace

Result<void> Bundle::check() const {
    STX_CHECK(checkOrigin(origin));
    return checkViews(views, &ReferenceView::check);
}

Result<void> Bundle::checkHeaders() const {
    STX_CHECK(checkOrigin(origin));
    return checkViews(views, &ReferenceView::checkHeader);
}

}  // namespace stx

#include "lib/surface/normals.hpp"

#include <cmath>

#include "lib/base/parallel.hpp"
#include "lib/model/peak_memory.hpp"
#include "lib/surface/depth_gradient.hpp"

namespace stx {
namespace {

glm::dvec3 shortened(glm::dvec3 v, double longest) {
    const double length = glm::length(v);
    return length > longest ? v * (longest / length) : v;
}

void bakeView(ReferenceView& view, const BakeSettings& settings) {
    const Camera& camera = view.camera;
    DepthSurface surface = depthSurface(view, settings);
    const int width = view.depth.width(), height = view.depth.height();
    const bool makeNormals = !(settings.keepNormals && view.hasNormals());
    if (makeNormals) view.normal = Image<glm::vec3>(width, height, glm::vec3(0));
    view.splatU = Image<glm::vec3>(width, height, glm::vec3(0));
    view.splatV = Image<glm::vec3>(width, height, glm::vec3(0));
    parallelFor(0, height, 16, [&](int y) {
        for (int x = 0; x < width; ++x) {
            const double w = surface.w.at(x, y);
            if (std::isnan(w)) continue;
            const glm::dvec2 gradient = surface.gradient.at(x, y);
            const PixelSteps steps = planeSteps(camera, x, y, w, gradient);
            const glm::dvec2 spacing = camera.sampleSpacing(view.depth.at(x, y));
            const double half = std::sqrt(0.5);
            view.splatU.at(x, y) = glm::vec3(
                camera.orientation * (half * shortened(steps.alongX, kMaxSplatTilt * spacing.x)));
            view.splatV.at(x, y) = glm::vec3(
                camera.orientation * (half * shortened(steps.alongY, kMaxSplatTilt * spacing.y)));
        }
    });
    if (!makeNormals) return;
    // Splats cover what is seen of them: at outlines those that face the viewpoint do.
    continueSlopes(camera, surface);
    parallelFor(0, height, 16, [&](int y) {
        for (int x = 0; x < width; ++x) {
            const double w = surface.w.at(x, y);
            if (!std::isnan(w))
                view.normal.at(x, y) =
                    glm::vec3(camera.orientation *
                              planeNormal(camera, x, y, w, glm::dvec2(surface.gradient.at(x, y))));
        }
    });
}

}  // namespace

Result<ViewChange> bakeOfViews(const BakeSettings& settings, const PeakMemory& takes) {
    if (!(settings.discontinuity > 0 && settings.discontinuity <= 1))
        return fail(ErrorCode::usage,
                    "the depth discontinuity is {:g}; it must be over 0 and at most 1",
                    settings.discontinuity);
    ViewChange change;
    change.change = [settings](ReferenceView& view, Job&) -> Result<void> {
        bakeView(view, settings);
        return {};
    };
    change.kinds = [](ViewImageKinds& kinds) { kinds.normal = kinds.splatU = kinds.splatV = true; };
    change.takes = takes;
    change.keepsPixels = true;
    return change;
}

Result<void> bake(Bundle& bundle, const BakeSettings& settings, Job& job) {
    STX_CHECK(bakeOfViews(settings));
    STX_CHECK(bundle.check());
    STX_CHECK(checkPeak(peak::kBake, bundle.views, job.limits));
    const auto count = static_cast<std::int64_t>(bundle.views.size());
    for (std::int64_t i = 0; i < count; ++i) {
        STX_CHECK(job.checkCancelled());
        bakeView(bundle.views[i], settings);
        job.progress(i + 1, count, "baking normals and splats");
    }
    return {};
}

glm::u8vec3 rgbFromNormal(glm::vec3 normal) {
    if (normal == glm::vec3(0)) return glm::u8vec3(0);
    return glm::u8vec3(glm::round((glm::clamp(normal, -1.0f, 1.0f) + 1.0f) * 127.5f));
}

glm::vec3 normalFromRgb(glm::u8vec3 rgb) {
    if (rgb == glm::u8vec3(0)) return glm::vec3(0);
    const glm::vec3 n = glm::vec3(rgb) * (2.0f / 255.0f) - 1.0f;
    const float length = glm::length(n);
    return length > 0 ? n / length : glm::vec3(0);
}

}  // namespace stx

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

/// Writes the images of a view that have room: splat axes, and normals if asked for. With `was`
/// only where the depth is another. Unfinished when `job`, where there is one, is cancelled.
void writeVectors(ReferenceView& view, const BakeSettings& settings, bool normals,
                  const Image<float>* was, const Job* job = nullptr) {
    const Camera& camera = view.camera;
    const auto stopped = [job] { return job && !job->checkCancelled(); };
    DepthSurface surface = depthSurface(view, settings, job);
    // Its links may be missing then.
    if (stopped()) return;
    const auto ofEach = [&](const auto& write) {
        parallelFor(0, view.depth.height(), 16, [&](int y) {
            if (stopped()) return;
            for (int x = 0; x < view.depth.width(); ++x) {
                const double w = surface.w.at(x, y);
                if (std::isnan(w) || (was && was->at(x, y) == view.depth.at(x, y))) continue;
                write(x, y, w, glm::dvec2(surface.gradient.at(x, y)));
            }
        });
    };
    ofEach([&](int x, int y, double w, glm::dvec2 gradient) {
        const PixelSteps steps = planeSteps(camera, x, y, w, gradient);
        const glm::dvec2 spacing = camera.sampleSpacing(view.depth.at(x, y));
        const auto put = [&](Image<glm::vec3>& to, glm::dvec3 along, double longest) {
            if (!to.empty())
                to.at(x, y) =
                    glm::vec3(camera.orientation * (std::sqrt(0.5) * shortened(along, longest)));
        };
        put(view.splatU, steps.alongX, kMaxSplatTilt * spacing.x);
        put(view.splatV, steps.alongY, kMaxSplatTilt * spacing.y);
    });
    if (!normals || stopped()) return;
    // Splats cover what is seen of them: at outlines those that face the viewpoint do.
    continueSlopes(camera, surface);
    ofEach([&](int x, int y, double w, glm::dvec2 gradient) {
        view.normal.at(x, y) =
            glm::vec3(camera.orientation * planeNormal(camera, x, y, w, gradient));
    });
}

Result<void> bakeView(ReferenceView& view, const BakeSettings& settings, const Job& job) {
    const bool makeNormals = !(settings.keepNormals && view.hasNormals());
    const auto room = [&] {
        return Image<glm::vec3>(view.depth.width(), view.depth.height(), glm::vec3(0));
    };
    if (makeNormals) view.normal = room();
    view.splatU = room();
    view.splatV = room();
    writeVectors(view, settings, makeNormals, nullptr, &job);
    return job.checkCancelled();
}

/// Zero where a depth was and none is.
template <class T>
void clearLost(Image<T>& image, const Image<float>& depth, const Image<float>& was) {
    for (std::size_t i = 0; i < image.count(); ++i)
        if (hasPoint(was.data()[i]) && !hasPoint(depth.data()[i])) image.data()[i] = T(0);
}

}  // namespace

void renewSurface(ReferenceView& view, const Image<float>& was) {
    for (Image<glm::vec3>* image : {&view.normal, &view.splatU, &view.splatV, &view.emissive})
        clearLost(*image, view.depth, was);
    clearLost(view.metallicRoughness, view.depth, was);
    if (view.hasNormals() || !view.splatU.empty() || !view.splatV.empty())
        writeVectors(view, {}, view.hasNormals(), &was);
}

Result<ViewChange> bakeOfViews(const BakeSettings& settings, const PeakMemory& takes) {
    if (!(settings.discontinuity > 0 && settings.discontinuity <= 1))
        return fail(ErrorCode::usage,
                    "the depth discontinuity is {:g}; it must be over 0 and at most 1",
                    settings.discontinuity);
    ViewChange change;
    change.change = [settings](ReferenceView& view, Job& job) {
        return bakeView(view, settings, job);
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
        STX_CHECK(bakeView(bundle.views[i], settings, job));
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

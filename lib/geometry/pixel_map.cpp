#include "lib/geometry/pixel_map.hpp"

namespace stx {

PixelMap pixelMap(const Camera& source, const Camera& novel) {
    const glm::dmat4 novelFromSource = novel.cameraFromWorld() * source.worldFromCamera();
    const glm::dmat3 r(novelFromSource);
    const glm::dvec3 t(novelFromSource[3]);
    // H of a point q in the novel camera's space; half a pixel makes centres whole numbers.
    const double cx = novel.cx - 0.5, cy = novel.cy - 0.5;
    const auto image = [&](glm::dvec3 q) {
        const double centre = novel.orthographic ? 0.0 : -q.z;
        return glm::dvec3(novel.fx * q.x + cx * centre, -novel.fy * q.y + cy * centre, -q.z);
    };
    const glm::dvec3 offset =
        image(t) + (novel.orthographic ? glm::dvec3(cx, cy, 0) : glm::dvec3(0));
    const glm::dvec3 du = image(r * glm::dvec3(1 / source.fx, 0, 0));
    const glm::dvec3 dv = image(r * glm::dvec3(0, -1 / source.fy, 0));
    const glm::dvec3 origin = du * (0.5 - source.cx) + dv * (0.5 - source.cy);
    const glm::dvec3 axis = image(r * glm::dvec3(0, 0, -1));
    PixelMap m{};
    if (source.orthographic) {
        m.a0 = axis;
        m.b0 = origin + offset;
        m.bu = du;
        m.bv = dv;
    } else {
        m.a0 = origin + axis;
        m.au = du;
        m.av = dv;
        m.b0 = offset;
    }
    return m;
}

}  // namespace stx

#include "formats/mpeg4/scene/placement.hpp"

#include <cmath>

#include <glm/gtc/matrix_transform.hpp>

namespace stx::mpeg4 {

glm::dmat4 transformMatrix(glm::dvec3 center, glm::dvec4 rotation, glm::dvec3 scale,
                           glm::dvec4 scaleOrientation, glm::dvec3 translation) {
    const glm::dmat4 one(1.0);
    const glm::dmat4 r = glm::mat4_cast(quatFromAxisAngle(rotation));
    const glm::dmat4 so = glm::mat4_cast(quatFromAxisAngle(scaleOrientation));
    return glm::translate(one, translation + center) * r * so * glm::scale(one, scale) *
           glm::transpose(so) * glm::translate(one, -center);
}

Result<Similarity> similarityFrom(const glm::dmat4& worldFromLocal) {
    constexpr double kTolerance = 1e-5;  // float fields, several Transforms deep
    if (worldFromLocal == glm::dmat4(1.0)) return Similarity();
    const glm::dmat3 linear(worldFromLocal);
    const double determinant = glm::determinant(linear);
    if (!std::isfinite(determinant) || !std::isfinite(glm::length(worldFromLocal[3])))
        return fail(ErrorCode::invalidInput,
                    "the Transforms above the DepthImage give values that are not finite");
    const glm::dvec3 lengths(glm::length(linear[0]), glm::length(linear[1]),
                             glm::length(linear[2]));
    if (!(std::abs(determinant) > 0) || !(lengths.x > 0 && lengths.y > 0 && lengths.z > 0))
        return fail(ErrorCode::invalidInput,
                    "the Transforms above the DepthImage scale by 0; scales must be above 0");
    Similarity result;
    result.scale = std::cbrt(std::abs(determinant));
    double skew = 0;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            skew = std::max(
                skew, std::abs(glm::dot(linear[i], linear[j]) / (result.scale * result.scale) -
                               (i == j ? 1.0 : 0.0)));
    if (skew > 2 * kTolerance)
        return fail(
            ErrorCode::invalidInput,
            "the Transforms above the DepthImage scale by {:.6g} {:.6g} {:.6g} or shear; only "
            "one scale for all axes can be folded into a camera (apply it to the object "
            "before capturing)",
            lengths.x, lengths.y, lengths.z);
    if (determinant < 0)
        return fail(
            ErrorCode::invalidInput,
            "the Transforms above the DepthImage mirror it; only scales above 0 can be folded "
            "into a camera");
    // A scale within rounding of one is one: planes then stay as the file has them.
    if (std::abs(result.scale - 1.0) < 1e-7) result.scale = 1.0;
    result.rotation = glm::normalize(glm::quat_cast(linear / result.scale));
    if (std::abs(result.rotation.w) == 1.0) result.rotation = {1, 0, 0, 0};
    result.translation = glm::dvec3(worldFromLocal[3]);
    return result;
}

void applySimilarity(ReferenceView& view, const Similarity& worldFromLocal) {
    if (worldFromLocal.isIdentity()) return;
    const double s = worldFromLocal.scale;
    Camera& c = view.camera;
    c.position = worldFromLocal.translation + worldFromLocal.rotation * (s * c.position);
    c.orientation = glm::normalize(worldFromLocal.rotation * c.orientation);
    if (c.orthographic) {
        c.fx /= s;
        c.fy /= s;
    }
    view.nearPlane *= s;
    view.farPlane *= s;
    if (s != 1.0)
        for (float& d : view.depth.pixels()) d = static_cast<float>(d * s);
    const glm::mat3 rotation(glm::mat3_cast(worldFromLocal.rotation));
    const glm::mat3 tangents = rotation * static_cast<float>(s);
    for (auto& n : view.normal.pixels()) n = rotation * n;
    for (auto& u : view.splatU.pixels()) u = tangents * u;
    for (auto& v : view.splatV.pixels()) v = tangents * v;
}

Result<Padding> centringPadding(const Camera& camera, int maxSide) {
    Padding p;
    p.camera = camera;
    const double offX = 2 * camera.cx - camera.width;   // pixels to add on the right
    const double offY = 2 * camera.cy - camera.height;  // ... at the bottom
    if (camera.orthographic) {
        // All rays are parallel: moving the viewpoint sideways is the same as moving the image.
        if (!camera.centred(0.0)) {
            const glm::dvec3 inCamera(-offX / 2 / camera.fx, offY / 2 / camera.fy, 0.0);
            p.camera.position += camera.orientation * inCamera;
            p.camera.cx = camera.width * 0.5;
            p.camera.cy = camera.height * 0.5;
        }
        return p;
    }
    if (std::abs(offX) > maxSide || std::abs(offY) > maxSide)
        return fail(
            ErrorCode::unsupported,
            "the principal point {:.6g} {:.6g} is so far from the centre of the {}x{} image "
            "that padding would exceed {} pixels; crop the view first",
            camera.cx, camera.cy, camera.width, camera.height, maxSide);
    // A rest below what float rounding changes does not count.
    const auto whole = [](double off) { return static_cast<int>(std::lround(off)); };
    const int x = whole(offX), y = whole(offY);
    (x > 0 ? p.right : p.left) = std::abs(x);
    (y > 0 ? p.bottom : p.top) = std::abs(y);
    p.camera.width += std::abs(x);
    p.camera.height += std::abs(y);
    if (p.camera.width > maxSide || p.camera.height > maxSide)
        return fail(
            ErrorCode::unsupported,
            "the view is {}x{} with its principal point at {:.6g} {:.6g}; centred by padding "
            "it would be {}x{}, above {} pixels",
            camera.width, camera.height, camera.cx, camera.cy, p.camera.width, p.camera.height,
            maxSide);
    p.camera.cx = p.camera.width * 0.5;
    p.camera.cy = p.camera.height * 0.5;
    p.shift = std::hypot(p.camera.cx - (camera.cx + p.left), p.camera.cy - (camera.cy + p.top));
    return p;
}

}  // namespace stx::mpeg4

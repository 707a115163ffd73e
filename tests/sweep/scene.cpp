#include "tests/sweep/scene.hpp"

#include <glm/gtc/constants.hpp>

#include "lib/base/parallel.hpp"
#include "lib/geometry/view_layout.hpp"

namespace {

using stx::Camera;

constexpr double kFar = 1e300;

/// A ray against one solid, both in the solid's own axes: distance, normal, face.
struct Meeting {
    double t = kFar;
    glm::dvec3 normal{0};
    int face = 0;
};

Meeting meetBall(double radius, glm::dvec3 from, glm::dvec3 direction) {
    const double b = glm::dot(from, direction), c = glm::dot(from, from) - radius * radius;
    if (b * b < c) return {};
    const double t = -b - std::sqrt(b * b - c);
    if (t <= 0) return {};
    return {t, (from + direction * t) / radius, 0};
}

/// From outside, or, of a room, from inside.
Meeting meetBox(glm::dvec3 half, glm::dvec3 from, glm::dvec3 direction, bool inside) {
    double enter = -kFar, leave = kFar;
    int enterAxis = 0, leaveAxis = 0;
    for (int axis = 0; axis < 3; ++axis) {
        if (direction[axis] == 0) {
            if (std::abs(from[axis]) > half[axis]) return {};
            continue;
        }
        const double sign = direction[axis] > 0 ? 1 : -1;
        const double first = (-sign * half[axis] - from[axis]) / direction[axis];
        const double second = (sign * half[axis] - from[axis]) / direction[axis];
        if (first > enter) enter = first, enterAxis = axis;
        if (second < leave) leave = second, leaveAxis = axis;
    }
    if (enter >= leave) return {};
    const int axis = inside ? leaveAxis : enterAxis;
    const double t = inside ? leave : enter;
    if (t <= 0) return {};
    Meeting out{t, glm::dvec3(0), 0};
    out.normal[axis] = direction[axis] > 0 ? -1 : 1;
    out.face = axis * 2 + (out.normal[axis] > 0);
    return out;
}

double torusDistance(glm::dvec2 radii, glm::dvec3 p) {
    return glm::length(glm::dvec2(std::hypot(p.x, p.z) - radii.x, p.y)) - radii.y;
}

/// The formula is the exact distance, so steps of it never pass the surface.
Meeting meetTorus(glm::dvec2 radii, glm::dvec3 from, glm::dvec3 direction) {
    const double around = radii.x + radii.y;
    const double b = glm::dot(from, direction), c = glm::dot(from, from) - around * around;
    if (b * b < c) return {};
    const double root = std::sqrt(b * b - c);
    double t = std::max(0.0, -b - root);
    double d = 0;
    for (int step = 0; step < 300 && t < root - b; ++step) {
        d = torusDistance(radii, from + direction * t);
        if (d < 1e-9) break;
        t += d;
    }
    if (d > 1e-6 || t >= root - b || t <= 0) return {};
    const glm::dvec3 p = from + direction * t;
    const double ring = std::hypot(p.x, p.z);
    const glm::dvec3 middle(p.x / ring * radii.x, 0, p.z / ring * radii.x);
    return {t, glm::normalize(p - middle), 0};
}

Meeting meetCone(double radius, double half, glm::dvec3 from, glm::dvec3 direction) {
    Meeting out;
    // x² + z² = (k (half - y))²
    const double k = radius / (2 * half), h = half - from.y;
    const double a =
        direction.x * direction.x + direction.z * direction.z - k * k * direction.y * direction.y;
    const double b = from.x * direction.x + from.z * direction.z + k * k * h * direction.y;
    const double c = from.x * from.x + from.z * from.z - k * k * h * h;
    const double root = b * b - a * c;
    if (root >= 0) {
        // So that a ray along the slope of the cone, whose a is 0, meets it once.
        const double sum = -(b + std::copysign(std::sqrt(root), b));
        for (const double t : {sum / a, c / sum}) {
            const glm::dvec3 p = from + direction * t;
            if (!(t > 0 && t < out.t && std::abs(p.y) <= half)) continue;
            out = {t, glm::normalize(glm::dvec3(p.x, k * k * (half - p.y), p.z)), 0};
        }
    }
    if (direction.y != 0) {
        const double t = (-half - from.y) / direction.y;
        const glm::dvec3 p = from + direction * t;
        if (t > 0 && t < out.t && p.x * p.x + p.z * p.z <= radius * radius)
            out = {t, glm::dvec3(0, -1, 0), 1};
    }
    return out;
}

Meeting meet(const Solid& solid, glm::dvec3 from, glm::dvec3 direction) {
    switch (solid.kind) {
        case Solid::Kind::ball:
            return meetBall(solid.size.x, from, direction);
        case Solid::Kind::box:
            return meetBox(solid.size, from, direction, false);
        case Solid::Kind::room: {
            const Meeting wall = meetBox(solid.size, from, direction, true);
            return wall.face == solid.openFace ? Meeting{} : wall;
        }
        case Solid::Kind::torus:
            return meetTorus(glm::dvec2(solid.size), from, direction);
        case Solid::Kind::cone:
            return meetCone(solid.size.x, solid.size.y, from, direction);
    }
    return {};
}

/// Colour and coverage of a pixel, as 8-bit values with straight alpha.
glm::u8vec4 meanColour(const Scene& scene, const Camera& camera, int x, int y, int samples) {
    glm::dvec4 sum(0);
    for (int j = 0; j < samples; ++j) {
        for (int i = 0; i < samples; ++i) {
            const Hit hit = scene.trace(camera, x + (i + 0.5) / samples, y + (j + 0.5) / samples);
            if (hit.any()) sum += glm::dvec4(scene.colourAt(hit.point, hit.surface), 1);
        }
    }
    if (sum.a == 0) return glm::u8vec4(0);
    return glm::u8vec4(
        glm::round(glm::dvec4(glm::dvec3(sum) / sum.a, sum.a / (samples * samples)) * 255.0));
}

}  // namespace

Hit Scene::trace(glm::dvec3 origin, glm::dvec3 direction) const {
    Hit out;
    out.t = kFar;
    for (std::size_t i = 0; i < solids.size(); ++i) {
        const Solid& solid = solids[i];
        const glm::dquat solidFromWorld = glm::conjugate(solid.worldFromSolid);
        const Meeting found =
            meet(solid, solidFromWorld * (origin - solid.centre), solidFromWorld * direction);
        if (found.t >= out.t) continue;
        out.t = found.t;
        out.normal = solid.worldFromSolid * found.normal;
        out.surface = static_cast<int>(i) * 8 + found.face;
    }
    if (out.any()) out.point = origin + direction * out.t;
    return out;
}

Hit Scene::trace(const Camera& camera, double x, double y) const {
    glm::dvec3 origin = camera.position;
    if (camera.orthographic) origin += camera.orientation * camera.unproject(x, y, 0.0);
    return trace(origin, camera.viewDirection(x, y));
}

glm::dvec3 Scene::colourAt(glm::dvec3 p, int surface) const {
    const auto wave = [&](glm::dvec3 along, double phase) {
        return 0.5 + 0.32 * std::sin(waves * glm::dot(p, along) + phase + 1.7 * surface);
    };
    return {wave({0.8, 0.5, 0.33}, 0.0), wave({-0.4, 0.7, 0.59}, 1.0),
            wave({0.3, -0.62, 0.73}, 2.0)};
}

std::vector<glm::vec3> Scene::points() const {
    std::vector<glm::vec3> out;
    constexpr int kDirections = 600;
    for (const glm::dvec3 direction :
         stx::layoutDirections({stx::ViewLayout::Kind::sphere, kDirections, 0})) {
        for (const Solid& solid : solids) {
            Scene alone;
            alone.solids = {solid};
            const bool room = solid.kind == Solid::Kind::room;
            const Hit hit = alone.trace(solid.centre + direction * (room ? 0.0 : 100.0),
                                        room ? direction : -direction);
            if (hit.any()) out.emplace_back(hit.point);
            // Rays to the centre miss the hole of a torus and the edges of boxes.
            if (solid.kind == Solid::Kind::torus) {
                const auto at = [&](double angle) {
                    return glm::dvec3(std::cos(angle), 0, std::sin(angle));
                };
                const double angle = std::atan2(direction.z, direction.x);
                out.emplace_back(solid.centre + solid.worldFromSolid *
                                                    (at(angle) * (solid.size.x + solid.size.y)));
                out.emplace_back(solid.centre +
                                 solid.worldFromSolid *
                                     (at(angle) * solid.size.x + glm::dvec3(0, solid.size.y, 0)));
            } else if (solid.kind == Solid::Kind::box) {
                const glm::dvec3 corner = glm::mix(glm::dvec3(-1), glm::dvec3(1),
                                                   glm::greaterThan(direction, glm::dvec3(0)));
                out.emplace_back(solid.centre + solid.worldFromSolid * (corner * solid.size));
            }
        }
    }
    return out;
}

stx::ReferenceView look(const Scene& scene, const Camera& camera) {
    using namespace stx;
    ReferenceView view;
    view.camera = camera;
    view.depthBits = 32;
    const int width = camera.width, height = camera.height;
    Image<Hit> hits(width, height);
    view.depth = Image<float>(width, height, kNoDepth);
    parallelFor(0, height, [&](std::int64_t row) {
        const int y = static_cast<int>(row);
        for (int x = 0; x < width; ++x) {
            Hit& hit = hits.at(x, y);
            hit = scene.trace(camera, x + 0.5, y + 0.5);
            if (hit.any())
                view.depth.at(x, y) =
                    static_cast<float>(glm::dot(hit.point - camera.position, camera.forward()));
        }
    });
    Rgba8Image colour(width, height, glm::u8vec4(0));
    parallelFor(0, height, [&](std::int64_t row) {
        const int y = static_cast<int>(row);
        for (int x = 0; x < width; ++x) {
            const Hit& hit = hits.at(x, y);
            bool smooth = x > 0 && y > 0 && x + 1 < width && y + 1 < height;
            for (int v = std::max(y - 1, 0); v <= std::min(y + 1, height - 1); ++v) {
                for (int u = std::max(x - 1, 0); u <= std::min(x + 1, width - 1); ++u) {
                    const Hit& other = hits.at(u, v);
                    smooth = smooth && other.surface == hit.surface &&
                             (!hit.any() || glm::dot(hit.normal, other.normal) > 0.95);
                }
            }
            if (!smooth || hit.any())
                colour.at(x, y) = meanColour(scene, camera, x, y, smooth ? 2 : 4);
            // A sliver that only the ray of the centre meets.
            if (colour.at(x, y).a == 0) view.depth.at(x, y) = kNoDepth;
        }
    });
    double nearest = kFar, farthest = 0;
    for (const float d : view.depth.pixels()) {
        if (!hasPoint(d)) continue;
        nearest = std::min(nearest, double(d));
        farthest = std::max(farthest, double(d));
    }
    view.nearPlane = farthest > 0 ? nearest * 0.999 : 1.0;
    view.farPlane = farthest > 0 ? farthest * 1.001 : 2.0;
    view.texture = Texture(std::move(colour));
    bleedColour(view.texture);
    return view;
}

#include "lib/render/bench/analytic_scene.hpp"

#include <glm/gtc/constants.hpp>

#include "lib/base/parallel.hpp"

namespace stx {
namespace {

struct Hit {
    double t = -1;  ///< along the ray; negative = none
    glm::dvec3 point{0}, normal{0};
    glm::dvec3 colour{0};
};

double wave(double x) {
    return 0.5 + 0.5 * std::sin(x);
}

// --- The object: a ring whose surface is raised and lowered along and around it.

constexpr double kRing = 0.62, kTube = 0.22, kBump = 0.035;

double ringDistance(glm::dvec3 p) {
    const double around = std::atan2(p.z, p.x);
    const glm::dvec2 q(std::hypot(p.x, p.z) - kRing, p.y);
    const double across = std::atan2(q.y, q.x);
    return glm::length(q) - kTube - kBump * std::sin(9 * around) * std::cos(4 * across);
}

glm::dvec3 ringNormal(glm::dvec3 p) {
    const double h = 1e-5;
    return glm::normalize(
        glm::dvec3(ringDistance(p + glm::dvec3(h, 0, 0)) - ringDistance(p - glm::dvec3(h, 0, 0)),
                   ringDistance(p + glm::dvec3(0, h, 0)) - ringDistance(p - glm::dvec3(0, h, 0)),
                   ringDistance(p + glm::dvec3(0, 0, h)) - ringDistance(p - glm::dvec3(0, 0, h))));
}

Hit traceObject(glm::dvec3 origin, glm::dvec3 direction) {
    Hit hit;
    // Within the ball around the ring only.
    const double radius = kRing + kTube + kBump;
    const double b = glm::dot(origin, direction), c = glm::dot(origin, origin) - radius * radius;
    if (b * b < c) return hit;
    const double root = std::sqrt(b * b - c);
    double t = std::max(0.0, -b - root);
    const double end = -b + root;
    for (int step = 0; step < 400 && t < end; ++step) {
        // The bumps make the formula overrate the distance; two thirds is safe.
        const double d = ringDistance(origin + direction * t);
        if (d < 1e-7) break;
        t += d * 0.6;
    }
    if (t >= end) return hit;
    hit.t = t;
    hit.point = origin + direction * t;
    hit.normal = ringNormal(hit.point);
    const double around = std::atan2(hit.point.z, hit.point.x);
    const double across = std::atan2(hit.point.y, std::hypot(hit.point.x, hit.point.z) - kRing);
    hit.colour = {0.15 + 0.75 * wave(14 * around), 0.15 + 0.75 * wave(5 * across + 3 * around),
                  0.2 + 0.6 * wave(11 * hit.point.y + 7 * hit.point.x)};
    return hit;
}

// --- The room: a box from (-4,-2,-7) to (4,2.5,3) with three balls.

constexpr glm::dvec3 kLow{-4, -2, -7}, kHigh{4, 2.5, 3};
struct Ball {
    glm::dvec3 centre;
    double radius;
};
constexpr std::array<Ball, 3> kBalls{
    {{{-1.2, -1.1, -3.6}, 0.9}, {{1.1, -1.3, -4.4}, 0.7}, {{0.2, 0.6, -5.4}, 0.8}}};

glm::dvec3 roomColour(glm::dvec3 p, double scale) {
    return {0.15 + 0.7 * wave(scale * p.x + 1.3 * std::sin(scale * 0.7 * p.y)),
            0.15 + 0.7 * wave(scale * 1.2 * p.y - scale * 0.8 * p.z),
            0.15 + 0.7 * wave(scale * 0.9 * p.z + scale * 0.5 * p.x * p.y)};
}

Hit traceRoom(glm::dvec3 origin, glm::dvec3 direction) {
    Hit hit;
    double exit = 1e300;
    for (int axis = 0; axis < 3; ++axis) {
        if (direction[axis] == 0) continue;
        const double wall = direction[axis] > 0 ? kHigh[axis] : kLow[axis];
        const double t = (wall - origin[axis]) / direction[axis];
        if (t > 0 && t < exit) {
            exit = t;
            hit.normal = glm::dvec3(0);
            hit.normal[axis] = direction[axis] > 0 ? -1 : 1;
        }
    }
    hit.t = exit;
    double scale = 4;
    for (const Ball& ball : kBalls) {
        const glm::dvec3 from = origin - ball.centre;
        const double b = glm::dot(from, direction),
                     c = glm::dot(from, from) - ball.radius * ball.radius;
        if (b * b < c) continue;
        const double t = -b - std::sqrt(b * b - c);
        if (t > 0 && t < hit.t) {
            hit.t = t;
            hit.normal = (origin + direction * t - ball.centre) / ball.radius;
            scale = 9;
        }
    }
    hit.point = origin + direction * hit.t;
    hit.colour = roomColour(hit.point, scale);
    return hit;
}

Hit trace(AnalyticScene scene, const Camera& camera, double x, double y) {
    glm::dvec3 origin = camera.position;
    const glm::dvec3 direction = camera.viewDirection(x, y);
    if (camera.orthographic) origin += camera.orientation * camera.unproject(x, y, 0.0);
    return scene == AnalyticScene::object ? traceObject(origin, direction)
                                          : traceRoom(origin, direction);
}

Camera placed(glm::dvec3 eye, glm::dvec3 target, double fovRad, int width, int height) {
    const auto orientation = lookAt(eye, target).value_or(glm::dquat(1, 0, 0, 0));
    const double vertical = 2 * std::atan(std::tan(fovRad * 0.5) * height / width);
    return Camera::fromFieldOfView(eye, orientation, {fovRad, vertical}, false, width, height);
}

}  // namespace

ReferenceView viewOfAnalyticScene(AnalyticScene scene, const Camera& camera, int samples) {
    ReferenceView view;
    view.camera = camera;
    view.depthBits = 32;
    Rgba8Image colour(camera.width, camera.height, glm::u8vec4(0));
    view.depth = Image<float>(camera.width, camera.height, kNoDepth);
    view.normal = Image<glm::vec3>(camera.width, camera.height, glm::vec3(0));
    parallelFor(0, camera.height, [&](int y) {
        for (int x = 0; x < camera.width; ++x) {
            const Hit centre = trace(scene, camera, x + 0.5, y + 0.5);
            if (centre.t >= 0) {
                view.depth.at(x, y) =
                    static_cast<float>(glm::dot(centre.point - camera.position, camera.forward()));
                view.normal.at(x, y) = glm::vec3(centre.normal);
            }
            glm::dvec4 sum(0);
            for (int j = 0; j < samples; ++j) {
                for (int i = 0; i < samples; ++i) {
                    const Hit hit = samples == 1 ? centre
                                                 : trace(scene, camera, x + (i + 0.5) / samples,
                                                         y + (j + 0.5) / samples);
                    if (hit.t >= 0) sum += glm::dvec4(hit.colour, 1);
                }
            }
            if (sum.a > 0)
                colour.at(x, y) = glm::u8vec4(glm::round(
                    glm::dvec4(glm::dvec3(sum) / sum.a, sum.a / (samples * samples)) * 255.0));
        }
    });
    double nearest = 1e300, farthest = 0;
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

Camera analyticCamera(AnalyticScene scene, double index, int count) {
    if (scene == AnalyticScene::room) {
        const double offset = (index - 0.5 * (count - 1)) * 0.25;
        return placed({offset, 0.2, 0.6}, {offset * 0.4, -0.2, -4}, glm::radians(60.0), 1024, 768);
    }
    const double turn = glm::two_pi<double>() * index / count;
    const double lift = glm::radians(35.0);
    const double distance = 4.9;  // makes the object a sixth of the picture, as the paper's is
    const glm::dvec3 eye(distance * std::cos(lift) * std::sin(turn), distance * std::sin(lift),
                         distance * std::cos(lift) * std::cos(turn));
    return placed(eye, glm::dvec3(0), glm::radians(34.0), 256, 256);
}

Bundle analyticBundle(AnalyticScene scene, int references, int samples) {
    Bundle bundle;
    bundle.title = scene == AnalyticScene::object ? "ring" : "room";
    for (int i = 0; i < references; ++i) {
        bundle.views.push_back(
            viewOfAnalyticScene(scene, analyticCamera(scene, i, references), samples));
        bundle.views.back().name = fmt::format("view{}", i);
    }
    return bundle;
}

}  // namespace stx

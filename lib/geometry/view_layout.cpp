#include "lib/geometry/view_layout.hpp"

#include <charconv>
#include <cmath>
#include <numbers>

#include "lib/base/parallel_try.hpp"

namespace stx {
namespace {

/// Layouts of N x N views, of which all have the same window.
bool isGrid(ViewLayout::Kind kind) {
    return kind == ViewLayout::Kind::octahedral || kind == ViewLayout::Kind::hemiOctahedral;
}

/// Where the i-th of n cameras of a ring is, radians.
double ringAngle(int i, int n) {
    return 2.0 * std::numbers::pi * i / n;
}

}  // namespace

Result<ViewLayout> parseViewLayout(std::string_view text) {
    ViewLayout layout;
    const auto colon = text.find(':');
    const auto word = text.substr(0, colon);
    if (word == "cube" && colon == std::string_view::npos) {
        layout.kind = ViewLayout::Kind::cube;
        layout.count = 6;
        return layout;
    }
    if (word == "ring")
        layout.kind = ViewLayout::Kind::ring;
    else if (word == "sphere")
        layout.kind = ViewLayout::Kind::sphere;
    else if (word == "octahedral")
        layout.kind = ViewLayout::Kind::octahedral;
    else if (word == "hemi-octahedral")
        layout.kind = ViewLayout::Kind::hemiOctahedral;
    else
        return fail(ErrorCode::usage,
                    "'{}' is not a view layout; use cube, ring:N, sphere:N, octahedral:N, "
                    "hemi-octahedral:N, auto:N, auto:DBdB or a camera file",
                    text);
    const auto digits =
        colon == std::string_view::npos ? std::string_view() : text.substr(colon + 1);
    const auto parsed = std::from_chars(digits.data(), digits.data() + digits.size(), layout.count);
    const bool large = parsed.ec == std::errc::result_out_of_range;
    if (digits.empty() || (parsed.ec != std::errc() && !large) ||
        parsed.ptr != digits.data() + digits.size())
        return fail(ErrorCode::usage, "'{}' needs a number of views, as in {}:16", text, word);
    const int most = isGrid(layout.kind) ? 64 : 4096;
    const int least = isGrid(layout.kind) ? 2 : 1;
    if (large || layout.count < least || layout.count > most)
        return fail(ErrorCode::usage, "'{}' asks for {} views; {} to {} are possible", text, digits,
                    least, most);
    return layout;
}

glm::dvec3 octahedralDirection(int i, int j, int n) {
    double x = 2.0 * i / (n - 1) - 1.0, z = 2.0 * j / (n - 1) - 1.0;
    const double y = 1.0 - std::abs(x) - std::abs(z);
    if (y < 0) {
        const double fx = (1.0 - std::abs(z)) * (x < 0 ? -1.0 : 1.0);
        const double fz = (1.0 - std::abs(x)) * (z < 0 ? -1.0 : 1.0);
        x = fx;
        z = fz;
    }
    return glm::normalize(glm::dvec3(x, y, z));
}

glm::dvec3 hemiOctahedralDirection(int i, int j, int n) {
    const double px = 2.0 * i / (n - 1) - 1.0, py = 2.0 * j / (n - 1) - 1.0;
    const double x = 0.5 * (px + py), z = 0.5 * (px - py);
    return glm::normalize(glm::dvec3(x, 1.0 - std::abs(x) - std::abs(z), z));
}

glm::dquat rotationToUp(glm::dvec3 up) {
    const glm::dvec3 from(0, 1, 0), to = glm::normalize(scaledToOne(up));
    const double cosine = glm::dot(from, to);
    if (cosine > 1 - 1e-15) return {1, 0, 0, 0};
    if (cosine < -1 + 1e-9) return {0, 1, 0, 0};  // half a turn about X
    const glm::dvec3 axis = glm::cross(from, to);
    return glm::normalize(glm::dquat(1 + cosine, axis.x, axis.y, axis.z));
}

glm::dmat3 turnOfUp(glm::dvec3 from, glm::dvec3 to) {
    glm::dmat3 turn =
        glm::mat3_cast(rotationToUp(to)) * glm::transpose(glm::mat3_cast(rotationToUp(from)));
    for (int k = 0; k < 3; ++k) turn[k] = glm::round(turn[k]) + 0.0;  // without zeros below 0
    return turn;
}

std::string turnedAxes(const glm::dmat3& turn) {
    std::string text;
    for (int row = 0; row < 3; ++row) {
        for (int k = 0; k < 3; ++k) {
            if (turn[k][row] == 0) continue;
            if (!text.empty()) text += ' ';
            if (turn[k][row] < 0) text += '-';
            text += "xyz"[k];
        }
    }
    return text;
}

glm::dvec3 upOfCameras(const std::vector<Camera>& cameras) {
    constexpr double kTilt = 0.2;     // sine of what a hand tilts a camera by
    constexpr double kUpright = 0.3;  // of the mean: else they look down or are upside down
    glm::dvec3 tilt(0), up(0);
    for (const auto& c : cameras) {
        const glm::dvec3 right = c.orientation * glm::dvec3(1, 0, 0);
        tilt += right * right;
        up += c.orientation * glm::dvec3(0, 1, 0);
    }
    const auto n = static_cast<double>(std::max<std::size_t>(cameras.size(), 1));
    for (const int axis : {1, 2, 0}) {
        if (std::sqrt(tilt[axis] / n) > kTilt || std::abs(up[axis] / n) < kUpright) continue;
        glm::dvec3 found(0);
        found[axis] = up[axis] < 0 ? -1 : 1;
        return found;
    }
    return {0, 1, 0};
}

std::optional<glm::dvec3> upAtPole(double aroundRad, double elevationRad) {
    // The cosine of a right angle, rounded; lookAt() takes as little for no `up` at all.
    constexpr double kRounding = 1e-9;
    if (std::abs(std::cos(elevationRad)) >= kRounding) return std::nullopt;
    return -std::sin(elevationRad) * glm::dvec3(std::sin(aroundRad), 0, std::cos(aroundRad));
}

std::vector<glm::dvec3> layoutDirections(const ViewLayout& layout) {
    std::vector<glm::dvec3> out;
    const int n = layout.count;
    switch (layout.kind) {
        case ViewLayout::Kind::cube:
            return {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
        case ViewLayout::Kind::ring:
            for (int i = 0; i < n; ++i) {
                const double a = ringAngle(i, n), e = layout.elevationRad;
                out.emplace_back(std::sin(a) * std::cos(e), std::sin(e), std::cos(a) * std::cos(e));
            }
            break;
        case ViewLayout::Kind::sphere: {
            const double golden = std::numbers::pi * (3.0 - std::sqrt(5.0));
            for (int i = 0; i < n; ++i) {
                const double y = 1.0 - 2.0 * (i + 0.5) / n, r = std::sqrt(1.0 - y * y),
                             a = golden * i;
                out.emplace_back(r * std::sin(a), y, r * std::cos(a));
            }
            break;
        }
        case ViewLayout::Kind::octahedral:
            for (int j = 0; j < n; ++j) {
                for (int i = 0; i < n; ++i) out.push_back(octahedralDirection(i, j, n));
            }
            break;
        case ViewLayout::Kind::hemiOctahedral:
            for (int j = 0; j < n; ++j) {
                for (int i = 0; i < n; ++i) out.push_back(hemiOctahedralDirection(i, j, n));
            }
            break;
    }
    return out;
}

BoundingSphere boundingSphere(const std::vector<glm::vec3>& points) {
    Bounds bounds;
    for (const auto& p : points) bounds.add(p);
    if (bounds.empty()) return {};
    BoundingSphere sphere{bounds.centre(), 0.0};
    for (const auto& p : points)
        sphere.radius = std::max(sphere.radius, glm::length(glm::dvec3(p) - sphere.centre));
    return sphere;
}

Result<Camera> frameCamera(glm::dvec3 direction, const ViewFraming& framing,
                           const std::vector<glm::vec3>& points, const BoundingSphere& sphere,
                           bool tight) {
    // Points at one place have no size: as floats round it, or the unit where that is 0.
    constexpr double kRounding = 1e-6;
    const double least = std::max(sphere.radius, kRounding * glm::length(sphere.centre));
    const double radius = least > 0 ? least : kRounding;
    const double distance = radius / std::sin(framing.fovRad * 0.5);
    const glm::dvec3 eye = sphere.centre + direction * distance;
    STX_TRY(const auto orientation, lookAt(eye, sphere.centre, framing.up));
    const glm::dmat3 cameraFromWorld = glm::transpose(glm::mat3_cast(orientation));

    // Half extents of the object in the image plane (at dist 1, or in scene units).
    glm::dvec2 half(0.0);
    if (tight) {
        for (const auto& p : points) {
            const glm::dvec3 q = cameraFromWorld * (glm::dvec3(p) - eye);
            const double scale = framing.orthographic ? 1.0 : -1.0 / q.z;
            half = glm::max(half, glm::abs(glm::dvec2(q)) * scale);
        }
    } else {
        half = glm::dvec2(framing.orthographic ? radius : std::tan(framing.fovRad * 0.5));
    }
    const double innerX = std::max(1.0, framing.width - 2.0 * framing.marginPixels);
    const double innerY = std::max(1.0, framing.height - 2.0 * framing.marginPixels);
    // Square pixels: the narrower fit decides. Flat objects seen edge-on keep a usable scale.
    const double floor = 1e-3 * radius / (framing.orthographic ? 1.0 : distance);
    const double unitsPerPixel = std::max(
        {2.0 * half.x / innerX, 2.0 * half.y / innerY, 2.0 * floor / std::max(innerX, innerY)});
    Camera c;
    c.position = eye;
    c.orientation = orientation;
    c.width = framing.width;
    c.height = framing.height;
    c.orthographic = framing.orthographic;
    c.fx = c.fy = 1.0 / unitsPerPixel;
    c.cx = framing.width * 0.5;
    c.cy = framing.height * 0.5;
    return c;
}

Result<std::vector<Camera>> layoutCameras(const ViewLayout& layout, const ViewFraming& framing,
                                          const std::vector<glm::vec3>& points) {
    if (points.empty()) return fail(ErrorCode::invalidInput, "the object has no points to look at");
    const auto sphere = boundingSphere(points);
    if (!(glm::length(scaledToOne(framing.up)) > 0))
        return fail(ErrorCode::usage, "up is 0,0,0; it must point somewhere");
    auto directions = layoutDirections(layout);
    // The faces of a cube are those of the axes, whichever is up.
    const bool turned = framing.up != glm::dvec3(0, 1, 0) && layout.kind != ViewLayout::Kind::cube;
    const glm::dquat toUp = turned ? rotationToUp(framing.up) : glm::dquat(1, 0, 0, 0);
    if (turned)
        for (auto& d : directions) d = toUp * d;
    const bool tight = !isGrid(layout.kind);
    std::vector<Camera> cameras(directions.size());
    STX_CHECK(parallelTry(0, directions.size(), [&](std::size_t i) -> Result<void> {
        ViewFraming own = framing;
        if (layout.kind == ViewLayout::Kind::ring)
            if (const auto up =
                    upAtPole(ringAngle(static_cast<int>(i), layout.count), layout.elevationRad))
                own.up = toUp * *up;
        STX_TRY(cameras[i], frameCamera(directions[i], own, points, sphere, tight));
        return {};
    }));
    return cameras;
}

}  // namespace stx

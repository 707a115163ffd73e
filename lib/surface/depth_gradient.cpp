#include "lib/surface/depth_gradient.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "lib/base/parallel.hpp"

namespace stx {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
constexpr std::int64_t kRowsPerTask = 16;

// Where no source is named the value was chosen by trial on the project's image sets.
/// The resolution of a float, as a share of its value: 2^-23, rounded up.
constexpr double kFloatStep = 1.2e-7;
/// A distance this close to a code's value, in steps, was stored as that code.
constexpr double kOnStep = 0.02;
/// Steps of the code by which w of neighbours may differ beside the discontinuity: one, and
/// rounding.
constexpr double kStepRoom = 1.01;
/// Of orthographic views: pixel spacings of depth that neighbours on one surface may always differ
/// by.
constexpr double kOrthographicSlope = 4.0;
/// Neighbours differ by so many times what tells two surfaces apart where the slopes on both sides
/// must explain it: a step looks like a slope from one side.
constexpr double kSteep = 4.0;
/// Windows are weighed by a Gaussian of this width: per pixel of their radius, and in pixels.
constexpr double kSigmaOfRadius = 0.6, kSigmaLeast = 0.3;
/// Taps nearly on a line (determinant over squared weight) give no plane.
constexpr double kOnLine = 1e-3;
/// Steps of the code, in pixel spacings, from which on depth is smoothed before it is fitted; is
/// smoothed more; is fitted in a larger window.
constexpr double kCoarse = 0.05, kCoarser = 0.3, kCoarsest = 3.0;

/// The step of the depth code when nearly all distances lie on it; 0 when the image was never
/// coded.
double codedStep(const ReferenceView& view) {
    if (view.depthBits == 32) return 0;
    const DepthCode code = view.depthCode();
    std::int64_t points = 0, onStep = 0;
    for (const float z : view.depth.pixels()) {
        if (!hasPoint(z)) continue;
        ++points;
        const double off = std::abs(z - code.decode(code.encode(z)));
        onStep += off <= kOnStep * code.step() + kFloatStep * z ? 1 : 0;
    }
    return points > 0 && onStep * 20 >= points * 19 ? code.step() : 0;
}

/// One pixel of a fitting window and the pixels through which it is linked with the centre.
struct Tap {
    int dx, dy;
    float weight;
    int towardsX, towardsY;  ///< indices of the taps one nearer to the centre; -1 = none
};

/// Taps of a disc, each after those nearer to the centre.
std::vector<Tap> makeWindow(int radius) {
    std::vector<Tap> taps;
    std::vector<int> index((2 * radius + 1) * (2 * radius + 1), -1);
    const auto slot = [&](int dx, int dy) -> int& {
        return index[(dy + radius) * (2 * radius + 1) + dx + radius];
    };
    const double sigma = kSigmaOfRadius * radius + kSigmaLeast;
    for (int ring = 0; ring <= 2 * radius; ++ring) {
        for (int dy = -radius; dy <= radius; ++dy) {
            for (int dx = -radius; dx <= radius; ++dx) {
                if (std::abs(dx) + std::abs(dy) != ring) continue;
                if (dx * dx + dy * dy > (radius + 0.5) * (radius + 0.5)) continue;
                const int sx = dx > 0 ? 1 : -1, sy = dy > 0 ? 1 : -1;
                slot(dx, dy) = static_cast<int>(taps.size());
                taps.push_back(
                    {dx, dy,
                     static_cast<float>(std::exp(-0.5 * (dx * dx + dy * dy) / (sigma * sigma))),
                     dx != 0 ? slot(dx - sx, dy) : -1, dy != 0 ? slot(dx, dy - sy) : -1});
            }
        }
    }
    return taps;
}

struct Plane {
    double w = 0, gx = 0, gy = 0;
};

/// Weighted plane through the pixels of the window that are linked with its centre.
/// False when they do not span a plane.
bool fitPlane(const Image<float>& w, const Image<std::uint8_t>& links,
              const std::vector<Tap>& window, int x, int y, Plane& plane) {
    std::array<bool, 512> reached{};
    const float centre = w.at(x, y);
    double s = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0, sv = 0, sxv = 0, syv = 0;
    for (std::size_t i = 0; i < window.size(); ++i) {
        const Tap& tap = window[i];
        const int px = x + tap.dx, py = y + tap.dy;
        if (!w.contains(px, py)) continue;
        bool joined = i == 0;
        if (!joined && tap.towardsX >= 0 && reached[tap.towardsX])
            joined = links.at(tap.dx > 0 ? px - 1 : px, py) & DepthSurface::kRight;
        if (!joined && tap.towardsY >= 0 && reached[tap.towardsY])
            joined = links.at(px, tap.dy > 0 ? py - 1 : py) & DepthSurface::kDown;
        if (!joined) continue;
        reached[i] = true;
        const double k = tap.weight, v = static_cast<double>(w.at(px, py)) - centre;
        s += k;
        sx += k * tap.dx;
        sy += k * tap.dy;
        sxx += k * tap.dx * tap.dx;
        sxy += k * tap.dx * tap.dy;
        syy += k * tap.dy * tap.dy;
        sv += k * v;
        sxv += k * tap.dx * v;
        syv += k * tap.dy * v;
    }
    const double cxx = sxx - sx * sx / s, cxy = sxy - sx * sy / s, cyy = syy - sy * sy / s;
    const double cxv = sxv - sx * sv / s, cyv = syv - sy * sv / s;
    const double det = cxx * cyy - cxy * cxy;
    if (!(det > kOnLine * s * s)) return false;
    plane.gx = (cxv * cyy - cyv * cxy) / det;
    plane.gy = (cyv * cxx - cxv * cxy) / det;
    plane.w = centre + (sv - plane.gx * sx - plane.gy * sy) / s;
    return true;
}

/// Slope of a surface that faces the viewpoint, for pixels that know nothing better.
glm::dvec2 facingGradient(const Camera& camera, int x, int y, double w) {
    if (camera.orthographic) return glm::dvec2(0);
    const double X = (x + 0.5 - camera.cx) / camera.fx, Y = (y + 0.5 - camera.cy) / camera.fy;
    const double k = w / (X * X + Y * Y + 1);
    return {X * k / camera.fx, Y * k / camera.fy};
}

/// The five values of w around a pixel along one axis, as far as links reach.
struct Line {
    double w[5];
    bool linked[4];  ///< between w[i] and w[i + 1]
};

Line lineAt(const DepthSurface& surface, int x, int y, bool alongY) {
    Line line;
    const int dx = alongY ? 0 : 1, dy = alongY ? 1 : 0;
    const std::uint8_t bit = alongY ? DepthSurface::kDown : DepthSurface::kRight;
    const int place = alongY ? y : x, size = alongY ? surface.w.height() : surface.w.width();
    if (place >= 2 && place + 2 < size) {
        const std::ptrdiff_t step = alongY ? surface.w.width() : 1;
        const float* w = &surface.w.at(x, y) - 2 * step;
        const std::uint8_t* links = &surface.links.at(x, y) - 2 * step;
        for (int i = 0; i < 5; ++i) line.w[i] = w[i * step];
        for (int i = 0; i < 4; ++i) line.linked[i] = links[i * step] & bit;
        return line;
    }
    for (int i = 0; i < 5; ++i) {
        const int px = x + (i - 2) * dx, py = y + (i - 2) * dy;
        const bool inside = surface.w.contains(px, py);
        line.w[i] = inside ? surface.w.at(px, py) : kNone;
        if (i < 4) line.linked[i] = inside && (surface.links.at(px, py) & bit);
    }
    return line;
}

/// Mean of the one-sided differences that no discontinuity forbids.
double paperSlope(const Line& l, double without) {
    const bool before = l.linked[1], after = l.linked[2];
    if (before && after) return 0.5 * (l.w[3] - l.w[1]);
    if (before) return l.w[2] - l.w[1];
    if (after) return l.w[3] - l.w[2];
    return without;
}

/// The same, but at a crease the slope of the side whose surface goes on straight.
double creaseSlope(const Line& l, double noise, double without) {
    const bool before = l.linked[1], after = l.linked[2];
    const bool twoBefore = before && l.linked[0], twoAfter = after && l.linked[3];
    const double bendBefore = twoBefore ? std::abs(l.w[2] - 2 * l.w[1] + l.w[0]) : 1e300;
    const double bendAfter = twoAfter ? std::abs(l.w[2] - 2 * l.w[3] + l.w[4]) : 1e300;
    if (before && after) {
        const double bend = std::abs(l.w[1] - 2 * l.w[2] + l.w[3]);
        const double least = std::min(bendBefore, bendAfter);
        if (bend <= 3 * least + 4 * noise) return 0.5 * (l.w[3] - l.w[1]);
        return bendBefore < bendAfter ? 1.5 * l.w[2] - 2 * l.w[1] + 0.5 * l.w[0]
                                      : -1.5 * l.w[2] + 2 * l.w[3] - 0.5 * l.w[4];
    }
    // A one-sided slope lags half a pixel behind a curved surface; the next difference corrects
    // that.
    if (twoBefore) return 1.5 * l.w[2] - 2 * l.w[1] + 0.5 * l.w[0];
    if (twoAfter) return -1.5 * l.w[2] + 2 * l.w[3] - 0.5 * l.w[4];
    return paperSlope(l, without);
}

/// Whether the work for a job, where there is one, is to stop.
bool isStopped(const Job* job) {
    return job && !job->checkCancelled();
}

void link(const ReferenceView& view, double discontinuity, DepthSurface& surface, const Job* job) {
    const auto& w = surface.w;
    const int width = w.width(), height = w.height();
    surface.links = Image<std::uint8_t>(width, height, 0);
    const bool ortho = view.camera.orthographic;
    const auto linked = [&](int x, int y, int dx, int dy) {
        const int qx = x + dx, qy = y + dy;
        if (!w.contains(qx, qy)) return false;
        const double a = w.at(x, y), b = w.at(qx, qy);
        if (std::isnan(a) || std::isnan(b)) return false;
        const double stepW = ortho ? surface.step : surface.step * a * b;
        double limit =
            discontinuity * (ortho ? std::min(a, b) : std::max(a, b)) + kStepRoom * stepW;
        // Parallel rays have no distance that could give a scale, so an orthographic viewpoint near
        // the object must not cut surfaces of ordinary tilt apart.
        if (ortho)
            limit =
                std::max(limit, kOrthographicSlope * view.camera.sampleSpacing(1.0)[dx ? 0 : 1]);
        const double d = b - a;
        if (std::abs(d) <= limit) return true;
        // How far the slope of two pixels beside misses it; NaN where they are not there.
        const auto misses = [&](int fx, int fy, int tx, int ty) {
            if (!w.contains(fx, fy) || !w.contains(tx, ty)) return std::nan("");
            return std::abs(d - (static_cast<double>(w.at(tx, ty)) - w.at(fx, fy)));
        };
        const double before = misses(x - dx, y - dy, x, y);
        const double after = misses(qx, qy, qx + dx, qy + dy);
        const bool steep = std::abs(d) > kSteep * limit;
        if (steep && (before > limit || after > limit)) return false;
        return before <= limit || after <= limit;
    };
    parallelFor(0, height, kRowsPerTask, [&](int y) {
        if (isStopped(job)) return;
        for (int x = 0; x < width; ++x) {
            std::uint8_t bits = 0;
            if (linked(x, y, 1, 0)) bits |= DepthSurface::kRight;
            if (linked(x, y, 0, 1)) bits |= DepthSurface::kDown;
            surface.links.at(x, y) = bits;
        }
    });
}

/// Takes the stairs of a coarse depth code away: plane fits, each result held to the distances that
/// the code could have meant.
void smoothWithinSteps(const ReferenceView& view, int radius, int rounds, DepthSurface& surface,
                       const Job* job) {
    const auto window = makeWindow(radius);
    const int width = surface.w.width(), height = surface.w.height();
    const double half = 0.5 * surface.step;
    Image<float> next = surface.w;
    for (int round = 0; round < rounds; ++round) {
        parallelFor(0, height, kRowsPerTask, [&](int y) {
            if (isStopped(job)) return;
            for (int x = 0; x < width; ++x) {
                Plane plane;
                if (std::isnan(surface.w.at(x, y)) ||
                    !fitPlane(surface.w, surface.links, window, x, y, plane))
                    continue;
                const double z = view.depth.at(x, y);
                const double a = affineDepth(view.camera, z + half);
                const double b = affineDepth(view.camera, std::max(z - half, 0.5 * z));
                next.at(x, y) =
                    static_cast<float>(std::clamp(plane.w, std::min(a, b), std::max(a, b)));
            }
        });
        std::swap(surface.w, next);
    }
}

/// Pixels whose slope is not known: a bit for each axis, and one for those that wait to ask again.
constexpr std::uint8_t kBothAxes = 3, kAsking = 4;

/// The slopes of the neighbour that comes nearest to the depth of an open pixel when it goes on
/// straight, of those that know what it does not; none where there are none.
std::optional<glm::vec2> slopeBeside(const DepthSurface& surface, const Image<std::uint8_t>& open,
                                     glm::ivec2 at) {
    const std::uint8_t wanted = open.at(at.x, at.y);
    double nearest = std::numeric_limits<double>::infinity();
    std::optional<glm::vec2> slope;
    for (int j = -1; j <= 1; ++j) {
        for (int i = -1; i <= 1; ++i) {
            const int x = at.x + i, y = at.y + j;
            if (!surface.w.contains(x, y) || std::isnan(surface.w.at(x, y)) ||
                (open.at(x, y) & wanted))
                continue;
            const glm::vec2 g = surface.gradient.at(x, y);
            const double off =
                std::abs(surface.w.at(x, y) - g.x * i - g.y * j - surface.w.at(at.x, at.y));
            if (!(off < nearest)) continue;
            nearest = off;
            slope = g;
        }
    }
    return slope;
}

}  // namespace

DepthSurface depthSurface(const ReferenceView& view, const BakeSettings& settings, const Job* job) {
    const Camera& camera = view.camera;
    const int width = view.depth.width(), height = view.depth.height();
    DepthSurface surface;
    surface.w = Image<float>(width, height, kNone);
    surface.gradient = Image<glm::vec2>(width, height, glm::vec2(0));
    double sumZ = 0;
    std::int64_t points = 0;
    for (std::size_t i = 0; i < view.depth.count(); ++i) {
        const float z = view.depth.pixels()[i];
        if (!hasPoint(z) || (!camera.orthographic && !(z > 0))) continue;
        surface.w.pixels()[i] = static_cast<float>(affineDepth(camera, z));
        sumZ += z;
        ++points;
    }
    if (points == 0) {
        surface.links = Image<std::uint8_t>(width, height, 0);
        return surface;
    }
    const double meanZ = sumZ / static_cast<double>(points);
    surface.step = std::max(codedStep(view), kFloatStep * meanZ);
    link(view, settings.discontinuity, surface, job);

    const glm::dvec2 spacing = camera.sampleSpacing(meanZ);
    const double stairs = surface.step / std::max(spacing.x, spacing.y);
    const bool robust = settings.method == BakeSettings::Method::robust;
    const bool coarse = robust && stairs > kCoarse;
    if (coarse)
        smoothWithinSteps(view, std::clamp(static_cast<int>(std::lround(2 + stairs)), 2, 8),
                          stairs > kCoarser ? 4 : 2, surface, job);
    const auto window = makeWindow(stairs > kCoarsest ? 3 : 2);
    parallelFor(0, height, kRowsPerTask, [&](int y) {
        if (isStopped(job)) return;
        for (int x = 0; x < width; ++x) {
            const double w = surface.w.at(x, y);
            if (std::isnan(w)) continue;
            Plane plane;
            if (coarse && fitPlane(surface.w, surface.links, window, x, y, plane)) {
                surface.gradient.at(x, y) = {plane.gx, plane.gy};
                continue;
            }
            const glm::dvec2 facing = facingGradient(camera, x, y, w);
            const Line alongX = lineAt(surface, x, y, false), alongY = lineAt(surface, x, y, true);
            const double noise = camera.orthographic ? surface.step : surface.step * w * w;
            surface.gradient.at(x, y) =
                robust && !coarse
                    ? glm::dvec2(creaseSlope(alongX, noise, facing.x),
                                 creaseSlope(alongY, noise, facing.y))
                    : glm::dvec2(paperSlope(alongX, facing.x), paperSlope(alongY, facing.y));
        }
    });
    return surface;
}

void continueSlopes(const Camera& camera, DepthSurface& surface) {
    const int width = surface.w.width(), height = surface.w.height();
    const auto linked = [&](int x, int y, int axis) {
        const std::uint8_t bit = axis == 0 ? DepthSurface::kRight : DepthSurface::kDown;
        const int bx = axis == 0 ? x - 1 : x, by = axis == 0 ? y : y - 1;
        return (surface.links.at(x, y) & bit) ||
               (surface.links.contains(bx, by) && (surface.links.at(bx, by) & bit));
    };
    Image<std::uint8_t> open(width, height, 0);
    std::vector<glm::ivec2> asking;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const double w = surface.w.at(x, y);
            if (std::isnan(w)) continue;
            const glm::vec2 facing(facingGradient(camera, x, y, w));
            for (int axis = 0; axis < 2; ++axis)
                if (!linked(x, y, axis) && surface.gradient.at(x, y)[axis] == facing[axis])
                    open.at(x, y) |= static_cast<std::uint8_t>(1 << axis);
            if (open.at(x, y)) asking.emplace_back(x, y);
        }
    }
    // From those beside known slopes on, so that a strip of several pixels gets them, too.
    while (!asking.empty()) {
        std::vector<std::pair<glm::ivec2, glm::vec2>> found;
        for (const glm::ivec2 at : asking) {
            open.at(at.x, at.y) &= kBothAxes;
            if (const auto slope = slopeBeside(surface, open, at)) found.emplace_back(at, *slope);
        }
        for (const auto& [at, slope] : found) {
            for (int axis = 0; axis < 2; ++axis)
                if (open.at(at.x, at.y) >> axis & 1)
                    surface.gradient.at(at.x, at.y)[axis] = slope[axis];
            open.at(at.x, at.y) = 0;
        }
        // Only those beside what was found can find more than before.
        asking.clear();
        for (const auto& [at, slope] : found) {
            for (int y = std::max(at.y - 1, 0); y <= std::min(at.y + 1, height - 1); ++y) {
                for (int x = std::max(at.x - 1, 0); x <= std::min(at.x + 1, width - 1); ++x) {
                    std::uint8_t& state = open.at(x, y);
                    if (state == 0 || state > kBothAxes) continue;
                    state |= kAsking;
                    asking.emplace_back(x, y);
                }
            }
        }
    }
}

glm::dvec3 planeNormal(const Camera& camera, int x, int y, double w, glm::dvec2 gradient) {
    const double a = gradient.x * camera.fx, b = gradient.y * camera.fy;
    if (camera.orthographic) return glm::normalize(glm::dvec3(a, -b, 1.0));
    // w = a X + b Y + c along the rays (X, -Y, -1), so (-a, b, c) points back along each of them.
    const double c = w - gradient.x * (x + 0.5 - camera.cx) - gradient.y * (y + 0.5 - camera.cy);
    return glm::normalize(glm::dvec3(-a, b, c));
}

PixelSteps planeSteps(const Camera& camera, int x, int y, double w, glm::dvec2 gradient) {
    if (camera.orthographic)
        return {{1 / camera.fx, 0, -gradient.x}, {0, -1 / camera.fy, -gradient.y}};
    const double z = 1 / w;
    const glm::dvec2 dz = -gradient * z * z;
    const double X = (x + 0.5 - camera.cx) / camera.fx, Y = (y + 0.5 - camera.cy) / camera.fy;
    return {{z / camera.fx + X * dz.x, -Y * dz.x, -dz.x},
            {X * dz.y, -z / camera.fy - Y * dz.y, -dz.y}};
}

}  // namespace stx

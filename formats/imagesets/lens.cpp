#include "formats/imagesets/lens.hpp"

#include <algorithm>
#include <cmath>

namespace stx::imagesets {

glm::dvec2 Lens::realFromIdeal(const Camera& c, glm::dvec2 pixel) const {
    const double x = (pixel.x - c.cx) / c.fx;
    const double y = (pixel.y - c.cy) / c.fy;
    const double r2 = x * x + y * y;
    if (fisheye) {
        const double r = std::sqrt(r2), t = std::atan(r), t2 = t * t;
        const double scale =
            r > 1e-12 ? t * (1.0 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4)))) / r : 1.0;
        return {c.fx * (x + skew * y) * scale + c.cx, c.fy * y * scale + c.cy};
    }
    double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
    if (rational) radial /= 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6));
    const double xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
    const double yd = y * radial + 2.0 * p2 * x * y + p1 * (r2 + 2.0 * y * y);
    return {c.fx * (xd + skew * yd) + c.cx, c.fy * yd + c.cy};
}

namespace {

constexpr int kGrid = 64;  ///< cells of the grid on which the mapping is judged

template <class Visit>
void overGrid(const Camera& c, const Visit& visit) {
    for (int j = 0; j <= kGrid; ++j)
        for (int i = 0; i <= kGrid; ++i)
            visit(glm::dvec2(c.width * static_cast<double>(i) / kGrid,
                             c.height * static_cast<double>(j) / kGrid));
}

}  // namespace

double Lens::largestShift(const Camera& c) const {
    double largest = 0;
    overGrid(c, [&](glm::dvec2 p) {
        largest = std::max(largest, glm::length(realFromIdeal(c, p) - p));
    });
    return largest;
}

bool Lens::isShown(const Camera& c, glm::dvec2 pixel) const {
    const glm::dvec2 at = realFromIdeal(c, pixel);
    return at.x >= 0 && at.y >= 0 && at.x < c.width && at.y < c.height;
}

PixelRectangle Lens::shownPart(const Camera& c) const {
    PixelRectangle r{0, 0, c.width, c.height};
    // Pixels of each side that the picture does not show. A step changes all of one side, and the
    // ends of two others.
    const auto isMissing = [&](int x, int y) { return isShown(c, {x + 0.5, y + 0.5}) ? 0 : 1; };
    const auto inColumn = [&](int x) {
        int count = 0;
        for (int y = r.y; y < r.y + r.height; ++y) count += isMissing(x, y);
        return count;
    };
    const auto inRow = [&](int y) {
        int count = 0;
        for (int x = r.x; x < r.x + r.width; ++x) count += isMissing(x, y);
        return count;
    };
    int left = inColumn(r.x), right = inColumn(r.x + r.width - 1);
    int top = inRow(r.y), bottom = inRow(r.y + r.height - 1);
    while (r.width > 0 && r.height > 0) {
        const double wide = std::max(left, right) / static_cast<double>(r.height);
        const double high = std::max(top, bottom) / static_cast<double>(r.width);
        if (wide == 0 && high == 0) break;
        if (wide >= high) {
            const bool first = left >= right;
            const int x = first ? r.x : r.x + r.width - 1;
            top -= isMissing(x, r.y);
            bottom -= isMissing(x, r.y + r.height - 1);
            r.x += first ? 1 : 0;
            --r.width;
            (first ? left : right) = inColumn(first ? r.x : r.x + r.width - 1);
        } else {
            const bool first = top >= bottom;
            const int y = first ? r.y : r.y + r.height - 1;
            left -= isMissing(r.x, y);
            right -= isMissing(r.x + r.width - 1, y);
            r.y += first ? 1 : 0;
            --r.height;
            (first ? top : bottom) = inRow(first ? r.y : r.y + r.height - 1);
        }
    }
    if (r.width <= 0 || r.height <= 0) return {};
    if (c.width % 2 == 0 && r.width % 2 != 0) --r.width;
    if (c.height % 2 == 0 && r.height % 2 != 0) --r.height;
    return r.width > 0 && r.height > 0 ? r : PixelRectangle{};
}

double Lens::cutShare(const Camera& c, const PixelRectangle& part) const {
    constexpr int kCells = 256;
    double kept = 0;
    const auto real = [&](double i, double j) {
        return realFromIdeal(c,
                             {part.x + part.width * i / kCells, part.y + part.height * j / kCells});
    };
    for (int j = 0; j < kCells; ++j) {
        for (int i = 0; i < kCells; ++i) {
            const glm::dvec2 middle = real(i + 0.5, j + 0.5);
            if (!(middle.x >= 0 && middle.y >= 0 && middle.x <= c.width && middle.y <= c.height))
                continue;
            // Half the cross product of the diagonals is the area of a quadrangle.
            const glm::dvec2 a = real(i + 1, j + 1) - real(i, j);
            const glm::dvec2 b = real(i, j + 1) - real(i + 1, j);
            kept += 0.5 * (a.x * b.y - a.y * b.x);
        }
    }
    return std::clamp(1.0 - kept / (static_cast<double>(c.width) * c.height), 0.0, 1.0);
}

bool Lens::invertible(const Camera& c) const {
    bool fine = true;
    overGrid(c, [&](glm::dvec2 p) {
        const glm::dvec2 here = realFromIdeal(c, p);
        const glm::dvec2 dx = realFromIdeal(c, p + glm::dvec2(0.5, 0)) - here;
        const glm::dvec2 dy = realFromIdeal(c, p + glm::dvec2(0, 0.5)) - here;
        // Where the picture itself is looked at; beyond it, nothing is fetched.
        const bool inside = here.x >= 0 && here.y >= 0 && here.x <= c.width && here.y <= c.height;
        if (inside && !(dx.x * dy.y - dx.y * dy.x > 1e-3)) fine = false;
    });
    return fine;
}

double Focal::of(int side) const {
    return pixels ? *pixels : side * 0.5 / std::tan(*angle * 0.5);
}

void Pinhole::fill(Camera& camera) const {
    if (x.said()) camera.fx = camera.fy = x.of(camera.width);
    if (y.said()) camera.fy = y.of(camera.height);
    camera.cx = cx.value_or(camera.width * 0.5);
    camera.cy = cy.value_or(camera.height * 0.5);
}

std::optional<glm::ivec2> Pinhole::sizeAround() const {
    if (!cx || !cy) return std::nullopt;
    const glm::dvec2 size = glm::round(glm::dvec2(*cx, *cy) * 2.0);
    constexpr double kMost = 65535;
    if (!(size.x >= 1 && size.y >= 1 && size.x <= kMost && size.y <= kMost)) return std::nullopt;
    return glm::ivec2(size);
}

}  // namespace stx::imagesets

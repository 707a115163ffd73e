#include "lib/geometry/pixel_space.hpp"

#include <algorithm>

namespace stx {
namespace {

/// Of orthographic cameras: depth range in parts of the window's larger side.
constexpr double kOrthographicRange = 1.2;
/// A scene counts as no larger than so many windows: it may have a sky around what is looked at.
/// Windows of a tenth of an object, which magnify its views ten times, are as large as the sweep
/// has.
constexpr double kMostAcross = 10;
/// Shares of q that neighbouring pixels may differ by hold for pixels up to this share of their
/// distance (a view of 64 pixels for 35 degrees) and grow with larger ones; else a ball in few
/// pixels falls apart where it is steep. Of 150 random captures (tests/sweep) 14 have a quality
/// that is worse than a lower one and 14 are worse than splats; with 1/200 15 and 14, with 1/600 20
/// and 16: at steep rims links follow chords, which lie beside the surface.
constexpr double kFinePixel = 1.0 / 100.0;

/// A depth range as wide as the window makes shares of it mean what they do in perspective.
double orthographicRange(const Camera& c, double across) {
    const double window = std::max(c.width / c.fx, c.height / c.fy);
    return kOrthographicRange * std::clamp(across, window, kMostAcross * window);
}

}  // namespace

ShareLength::ShareLength(const Camera& camera, double radius) : orthographic_(camera.orthographic) {
    // Summaries of views that are not read have bounds a little wider than their points. A radius
    // that is rounded up to a power of two is the same for both, unless it is just below one.
    const double whole = std::exp2(std::ceil(std::log2(radius)));
    most_ = kMostRadii * whole;
    if (orthographic_) most_ = std::min(most_, orthographicRange(camera, whole));
}

PixelSpace::PixelSpace(const Camera& c, double farthest, double across) : camera(c) {
    axis.inverse = !c.orthographic;
    if (c.orthographic) {
        axis.unit = orthographicRange(c, across);
        axis.origin = farthest + axis.unit;
    }
    axis.pixel = 1.0 / std::max(c.fx, c.fy);
    // Of what a telephoto camera sees, shares of its distance would bridge all steps: they are
    // those of so many times half of its picture, as in an orthographic one.
    const double seen =
        axis.inverse ? kMostRadii * 0.5 * std::max(c.width / c.fx, c.height / c.fy) : 1.0;
    axis.coarse =
        std::max(std::min(1.0, seen), axis.pixel / (axis.inverse ? 1.0 : axis.unit) / kFinePixel);
    // Columns of camera points (X, Y, Z, 1) up to scale over (x, y, q, 1), and back.
    glm::dmat4 cameraFromPixel(0.0), pixelFromCamera(0.0);
    cameraFromPixel[0][0] = 1.0 / c.fx;
    cameraFromPixel[3][0] = -c.cx / c.fx;
    cameraFromPixel[1][1] = -1.0 / c.fy;
    cameraFromPixel[3][1] = c.cy / c.fy;
    pixelFromCamera[0][0] = c.fx;
    pixelFromCamera[1][1] = -c.fy;
    if (axis.inverse) {
        cameraFromPixel[3][2] = -1.0;
        cameraFromPixel[2][3] = 1.0;
        pixelFromCamera[2][0] = -c.cx;
        pixelFromCamera[2][1] = -c.cy;
        pixelFromCamera[3][2] = 1.0;
        pixelFromCamera[2][3] = -1.0;
    } else {
        cameraFromPixel[2][2] = axis.unit;
        cameraFromPixel[3][2] = -axis.origin;
        cameraFromPixel[3][3] = 1.0;
        pixelFromCamera[3][0] = c.cx;
        pixelFromCamera[3][1] = c.cy;
        pixelFromCamera[2][2] = 1.0 / axis.unit;
        pixelFromCamera[3][2] = axis.origin / axis.unit;
        pixelFromCamera[3][3] = 1.0;
    }
    pixelFromWorld = pixelFromCamera * c.cameraFromWorld();
    worldFromPixel = c.worldFromCamera() * cameraFromPixel;
}

Warp warpFrom(const glm::dmat4& m) {
    Warp w;
    for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column)
            w.m[row * 4 + column] = static_cast<float>(m[column][row]);
    return w;
}

}  // namespace stx

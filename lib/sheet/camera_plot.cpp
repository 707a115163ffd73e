#include "lib/sheet/camera_plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include "lib/base/counted.hpp"
#include "lib/base/printable.hpp"
#include "lib/geometry/view_layout.hpp"
#include "lib/sheet/false_colour.hpp"

namespace stx {
namespace {

constexpr double kPanel = 560;        ///< pixels of the longest side of what is drawn
constexpr double kLeastPanel = 160;   ///< of the shortest
constexpr double kPanelMargin = 40;   ///< around it, for numbers and axes
constexpr double kPlotHeader = 58;    ///< for the title
constexpr double kPyramid = 0.11;     ///< length of a drawn pyramid, of the longest extent
constexpr double kNumberOffset = 13;  ///< pixels from a viewpoint to the middle of its number

/// One of the two drawings: which axes of the upright space are across and down, and what they are
/// called.
struct PlotPanel {
    const char* title;
    glm::dvec3 across, down;
};

/// A camera as it is drawn, in the upright space.
struct Pyramid {
    glm::dvec3 eye;
    std::array<glm::dvec3, 4> nearCorners, farCorners;  ///< near: the eye, or the window's
    glm::dvec3 middle;                                  ///< of the far corners
};

Pyramid pyramidOf(const Camera& c, const glm::dquat& upright, double length) {
    Pyramid p;
    const auto world = [&](double x, double y, double dist) {
        return upright * (c.position + c.orientation * c.unproject(x, y, dist));
    };
    p.eye = upright * c.position;
    const std::array<glm::dvec2, 4> corners = {glm::dvec2(0, 0), glm::dvec2(c.width, 0),
                                               glm::dvec2(c.width, c.height),
                                               glm::dvec2(0, c.height)};
    // A wide lens must not make a pyramid wider than it is long.
    const double wide = std::max(c.width / c.fx, c.height / c.fy);
    const double dist = c.orthographic ? length : length / std::max(1.0, wide);
    for (std::size_t i = 0; i < corners.size(); ++i) {
        p.nearCorners[i] = world(corners[i].x, corners[i].y, 0.0);
        p.farCorners[i] = world(corners[i].x, corners[i].y, dist);
    }
    p.middle = 0.25 * (p.farCorners[0] + p.farCorners[1] + p.farCorners[2] + p.farCorners[3]);
    return p;
}

/// The name of a direction in the world that is an axis, or nearly so.
std::string axisName(glm::dvec3 direction) {
    for (int axis = 0; axis < 3; ++axis)
        if (std::abs(direction[axis]) > 0.999)
            return std::string(direction[axis] < 0 ? "-" : "+") + "XYZ"[axis];
    return fmt::format("({:.2f} {:.2f} {:.2f})", direction.x, direction.y, direction.z);
}

/// The largest of 1, 2 and 5 times a power of ten that is at most `most`.
double roundLength(double most) {
    const double power = std::pow(10.0, std::floor(std::log10(most)));
    return most >= 5 * power ? 5 * power : most >= 2 * power ? 2 * power : power;
}

/// Text that is kept free of other text.
class FreePlaces {
  public:
    /// Takes the place when nothing is in it.
    bool take(glm::dvec2 middle, glm::dvec2 size) {
        for (const auto& [m, s] : taken_) {
            const glm::dvec2 apart = glm::abs(m - middle);
            if (apart.x < 0.5 * (s.x + size.x) && apart.y < 0.5 * (s.y + size.y)) return false;
        }
        taken_.emplace_back(middle, size);
        return true;
    }

  private:
    std::vector<std::pair<glm::dvec2, glm::dvec2>> taken_;
};

/// Adds the pyramids of cameras, and their numbers where there is room; `at` gives places in the
/// picture.
template <class At>
void addPyramids(const std::vector<PlottedCamera>& cameras, const std::vector<Pyramid>& pyramids,
                 const At& at, std::string& out) {
    auto to = std::back_inserter(out);
    FreePlaces places;
    std::string numbers;
    for (std::size_t i = 0; i < pyramids.size(); ++i) {
        const Pyramid& p = pyramids[i];
        // Not to the map's pale end, which does not show on white.
        const glm::u8vec3 c =
            viridis(0.85 * static_cast<double>(i) /
                    static_cast<double>(std::max<std::size_t>(pyramids.size() - 1, 1)));
        const std::string colour = fmt::format("#{:02x}{:02x}{:02x}", c.r, c.g, c.b);
        std::string lines, base;
        for (std::size_t n = 0; n < 4; ++n) {
            const glm::dvec2 from = at(p.nearCorners[n]), corner = at(p.farCorners[n]);
            lines +=
                fmt::format("M{:.1f} {:.1f}L{:.1f} {:.1f}", from.x, from.y, corner.x, corner.y);
            base += fmt::format("{}{:.1f} {:.1f}", n ? "L" : "M", corner.x, corner.y);
        }
        const glm::dvec2 eye = at(p.eye);
        fmt::format_to(to,
                       "<g stroke=\"{0}\"><title>{1} {2}</title><path d=\"{3}\" fill=\"none\" "
                       "stroke-width=\"0.8\"/><path d=\"{4}Z\" fill=\"{0}\" "
                       "fill-opacity=\"0.2\" stroke-width=\"0.8\"/><circle cx=\"{5:.1f}\" "
                       "cy=\"{6:.1f}\" r=\"2.5\" fill=\"{0}\"/></g>\n",
                       colour, i, xmlText(cameras[i].name), lines, base, eye.x, eye.y);
        // Behind the camera, where it does not look.
        glm::dvec2 away = eye - at(p.middle);
        away = glm::length(away) > 2 ? glm::normalize(away) : glm::dvec2(0.7, -0.7);
        const std::string number = std::to_string(i);
        const glm::dvec2 place = eye + kNumberOffset * away;
        if (places.take(place, {7.0 * static_cast<double>(number.size()) + 2, 12}))
            numbers += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n", place.x,
                                   place.y + 4, number);
    }
    fmt::format_to(to, "<g text-anchor=\"middle\" font-size=\"11\">\n{}</g>\n", numbers);
}

/// Adds the axes, in the lower left corner of a panel whose left edge and width these are, and the
/// scale: pixels of a unit.
void addAxes(const PlotPanel& panel, const glm::dquat& worldFromUpright, double left,
             double panelWidth, double fullHeight, double scale, std::string& out) {
    auto to = std::back_inserter(out);
    const glm::dvec2 zero(left + 24, fullHeight - 20);
    fmt::format_to(
        to,
        "<path d=\"M{0:.1f} {1:.1f}v-26M{0:.1f} {1:.1f}h26\" stroke=\"#333\" fill=\"none\"/>\n"
        "<text x=\"{2:.1f}\" y=\"{3:.1f}\">{4}</text><text x=\"{5:.1f}\" y=\"{6:.1f}\" "
        "text-anchor=\"middle\">{7}</text>\n",
        zero.x, zero.y, zero.x + 30, zero.y + 4, axisName(worldFromUpright * panel.across), zero.x,
        zero.y - 30, axisName(worldFromUpright * -panel.down));
    const double length = roundLength(0.25 * (panelWidth - 2 * kPanelMargin) / scale);
    const glm::dvec2 end(left + panelWidth - 18, fullHeight - 16);
    fmt::format_to(to,
                   "<path d=\"M{0:.1f} {1:.1f}h{2:.1f}m0 -4v8m{3:.1f} 0v-8\" stroke=\"#333\" "
                   "fill=\"none\"/>\n<text x=\"{4:.1f}\" y=\"{5:.1f}\" "
                   "text-anchor=\"middle\">{6:g}</text>\n</g>\n",
                   end.x - length * scale, end.y, length * scale, -length * scale,
                   end.x - 0.5 * length * scale, end.y - 7, length);
}

}  // namespace

std::string cameraPlot(const std::vector<PlottedCamera>& cameras, const Bounds& object,
                       const std::string& title) {
    std::vector<Camera> plain;
    for (const auto& c : cameras) plain.push_back(c.camera);
    const glm::dquat worldFromUpright = rotationToUp(upOfCameras(plain));
    const glm::dquat upright = glm::conjugate(worldFromUpright);

    Bounds box;
    if (!object.empty()) {
        for (int corner = 0; corner < 8; ++corner)
            box.add(upright * glm::dvec3(corner & 1 ? object.max.x : object.min.x,
                                         corner & 2 ? object.max.y : object.min.y,
                                         corner & 4 ? object.max.z : object.min.z));
    }
    Bounds all = box;
    for (const Camera& c : plain) all.add(upright * c.position);
    if (all.empty()) all.add(glm::dvec3(0));
    double extent = std::max({all.max.x - all.min.x, all.max.y - all.min.y, all.max.z - all.min.z});
    if (!(extent > 0)) extent = 1;
    std::vector<Pyramid> pyramids;
    for (const Camera& c : plain) {
        pyramids.push_back(pyramidOf(c, upright, kPyramid * extent));
        for (const auto& p : pyramids.back().farCorners) all.add(p);
        for (const auto& p : pyramids.back().nearCorners) all.add(p);
    }
    extent = std::max({all.max.x - all.min.x, all.max.y - all.min.y, all.max.z - all.min.z});
    const double scale = kPanel / (extent > 0 ? extent : 1);

    const std::array<PlotPanel, 2> panels = {PlotPanel{"from above", {1, 0, 0}, {0, 0, 1}},
                                             PlotPanel{"from the side", {1, 0, 0}, {0, -1, 0}}};
    const auto extentAlong = [&](glm::dvec3 axis) {
        return glm::dot(all.max - all.min, glm::abs(axis)) * scale;
    };
    const double width = std::max(extentAlong(panels[0].across), kLeastPanel);
    double height = kLeastPanel;
    for (const auto& panel : panels) height = std::max(height, extentAlong(panel.down));
    const double panelWidth = width + 2 * kPanelMargin;
    const double fullWidth = 2 * panelWidth, fullHeight = height + 2 * kPanelMargin + kPlotHeader;

    std::string out;
    auto to = std::back_inserter(out);
    fmt::format_to(to,
                   "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" "
                   "viewBox=\"0 0 {0:.0f} {1:.0f}\" font-family=\"sans-serif\" font-size=\"12\">\n"
                   "<rect width=\"{0:.0f}\" height=\"{1:.0f}\" fill=\"white\"/>\n"
                   "<text x=\"14\" y=\"24\" font-size=\"15\">{2}</text>\n",
                   fullWidth, fullHeight, xmlText(title));
    for (std::size_t k = 0; k < panels.size(); ++k) {
        const PlotPanel& panel = panels[k];
        const double left = static_cast<double>(k) * panelWidth;
        const glm::dvec2 middle(left + panelWidth / 2, kPlotHeader + kPanelMargin + height / 2);
        const auto at = [&](glm::dvec3 p) {
            const glm::dvec3 from = p - all.centre();
            return middle +
                   scale * glm::dvec2(glm::dot(from, panel.across), glm::dot(from, panel.down));
        };
        fmt::format_to(to, "<g>\n<text x=\"{:.0f}\" y=\"48\" fill=\"#555\">{}</text>\n", left + 14,
                       panel.title);
        if (k > 0)
            fmt::format_to(to,
                           "<line x1=\"{0:.0f}\" y1=\"36\" x2=\"{0:.0f}\" y2=\"{1:.0f}\" "
                           "stroke=\"#ddd\"/>\n",
                           left, fullHeight - 12);
        if (!box.empty()) {
            const glm::dvec2 a = at(box.min), b = at(box.max);
            const glm::dvec2 corner = glm::min(a, b), size = glm::abs(b - a);
            fmt::format_to(to,
                           "<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" "
                           "fill=\"#ececef\" stroke=\"#888\"><title>the object</title></rect>\n",
                           corner.x, corner.y, size.x, size.y);
        }
        addPyramids(cameras, pyramids, at, out);
        addAxes(panel, worldFromUpright, left, panelWidth, fullHeight, scale, out);
    }
    return out + "</svg>\n";
}

}  // namespace stx

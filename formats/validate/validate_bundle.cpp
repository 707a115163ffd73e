#include <algorithm>
#include <cassert>
#include <cmath>

#include "formats/validate/findings.hpp"
#include "lib/base/error_text.hpp"
#include "lib/model/view_checks.hpp"
#include "lib/surface/normals.hpp"

namespace stx {

void Findings::add(int rule, std::string where, std::string found, std::string expected) {
    const Rule* known = findRule(rule);
    assert(known);
    list.push_back({known, std::move(where), std::move(found), std::move(expected)});
}

Result<std::vector<Finding>> unreadable(const Error& error) {
    if (error.code == ErrorCode::io) return tl::unexpected(error);
    Findings findings;
    findings.add(1001, "", textNamingOnce(error), "a file that can be read");
    return findings.list;
}

std::string sizeText(int width, int height) {
    return fmt::format("{}x{}", width, height);
}

std::string viewText(std::size_t index, const std::string& name) {
    return fmt::format("view {} '{}'", index, name);
}

void checkNormalLengths(std::int64_t off, std::int64_t count, const std::string& where,
                        Findings& findings) {
    if (off * 100 > count)
        findings.add(6007, where, fmt::format("{} of {} normals with another length", off, count),
                     "length 1");
}

void NormalCounts::add(int x, int y, float depth, glm::vec3 normal) {
    if (!hasPoint(depth) || normal == glm::vec3(0)) return;
    ++count_;
    if (!std::isfinite(glm::dot(normal, glm::vec3(1))))
        ++notFinite_;
    else if (!hasNormalLength(normal))
        ++off_;
    if (!directed_) return;
    const glm::dvec3 towards = -camera_.viewDirection(x + 0.5, y + 0.5);
    // Edge-on normals are rounded to either side.
    if (glm::dot(glm::dvec3(normal), towards) < -0.05) ++away_;
}

void NormalCounts::add(const Image<float>& depth, const Image<glm::vec3>& normal) {
    for (int y = 0; y < depth.height(); ++y)
        for (int x = 0; x < depth.width(); ++x) add(x, y, depth.at(x, y), normal.at(x, y));
}

void NormalCounts::reportLengths(const std::string& where, Findings& findings) const {
    // Rounding makes no such numbers, so that one is too many.
    if (notFinite_ > 0)
        findings.add(6007, where,
                     fmt::format("{} of {} normals with NaN or infinity", notFinite_, count_),
                     "length 1");
    else
        checkNormalLengths(off_, count_, where, findings);
}

void NormalCounts::reportDirections(const std::string& where, Findings& findings) const {
    if (away_ * 10 > count_)
        findings.add(6008, where, fmt::format("{} of {} normals point away from it", away_, count_),
                     "normals that point to the viewer");
}

void checkViewHeader(const ReferenceView& view, const std::string& where, Findings& findings) {
    const Camera& c = view.camera;
    bool finite = std::isfinite(view.nearPlane) && std::isfinite(view.farPlane);
    for (const double v :
         {c.position.x, c.position.y, c.position.z, c.orientation.w, c.orientation.x,
          c.orientation.y, c.orientation.z, c.fx, c.fy, c.cx, c.cy})
        finite = finite && std::isfinite(v);
    if (!finite) {
        findings.add(3005, where, "a value that is not finite in its camera", "finite numbers");
    } else if (!(c.fx > 0 && c.fy > 0)) {
        findings.add(3003, where, fmt::format("focal lengths {:g} and {:g}", c.fx, c.fy),
                     "both above 0");
    } else if (const auto ok = c.check(); !ok) {
        findings.add(3005, where, ok.error().message, "a camera");
    }
    if (!(view.nearPlane < view.farPlane))
        findings.add(3001, where,
                     fmt::format("nearPlane {} and farPlane {}", view.nearPlane, view.farPlane),
                     "nearPlane < farPlane");
    if (view.nearPlane < 0)
        findings.add(3002, where, fmt::format("nearPlane {}", view.nearPlane), "0 or more");
    if (view.depthBits != 8 && view.depthBits != 16 && view.depthBits != 32)
        findings.add(4011, where, fmt::format("depth of {} bits", view.depthBits),
                     "8, 16 or 32 (floats)");
}

std::int64_t checkViewImages(const ReferenceView& view, const std::string& where,
                             Findings& findings) {
    const glm::ivec2 size(view.camera.width, view.camera.height);
    if (view.depth.size() != size || view.texture.width() != size.x ||
        view.texture.height() != size.y) {
        findings.add(4001, where,
                     fmt::format("depth {}, texture {} and camera {}",
                                 sizeText(view.depth.width(), view.depth.height()),
                                 sizeText(view.texture.width(), view.texture.height()),
                                 sizeText(size.x, size.y)),
                     "one size");
        return 0;
    }
    if (const auto colours = view.texture.check(); !colours)
        findings.add(4005, where, colours.error().message, "finite colours");
    for (const auto* image : {&view.normal, &view.splatU, &view.splatV})
        if (!image->empty() && image->size() != size)
            findings.add(6001, where, sizeText(image->width(), image->height()),
                         sizeText(size.x, size.y));
    if (view.splatU.empty() != view.splatV.empty())
        findings.add(6003, where, "one of splatU and splatV", "both or neither");
    // Planes are rounded when they are written; a code's half step covers that.
    const double slack = (view.farPlane - view.nearPlane) * 1e-4;
    std::int64_t points = 0, outside = 0;
    for (const float d : view.depth.pixels()) {
        if (std::isinf(d) && d > 0) continue;
        ++points;
        if (!(d >= 0 && d >= view.nearPlane - slack && d <= view.farPlane + slack)) ++outside;
    }
    if (points == 0) findings.add(4006, where, "no point", "one point at least");
    if (outside > 0)
        findings.add(4030, where,
                     fmt::format("{} of {} distances outside {} to {}", outside, points,
                                 view.nearPlane, view.farPlane),
                     "distances between the planes");
    if (view.normal.size() == size) {
        NormalCounts normals(view.camera);
        normals.add(view.depth, view.normal);
        normals.reportLengths(where, findings);
        normals.reportDirections(where, findings);
    }
    return points;
}

namespace {

/// What the views break, one after the other; `points`: of each.
std::vector<Finding> ofAllViews(const std::vector<Findings>& views,
                                const std::vector<std::int64_t>& points) {
    Findings all;
    for (const Findings& found : views)
        all.list.insert(all.list.end(), found.list.begin(), found.list.end());
    if (std::ranges::all_of(points, [](std::int64_t n) { return n == 0; }))
        all.add(4007, "", "no point in any view", "points");
    return all.list;
}

/// Gives its count of points.
std::int64_t checkWholeView(const ReferenceView& view, std::size_t index, Findings& findings) {
    const std::string where = viewText(index, view.name);
    checkViewHeader(view, where, findings);
    return checkViewImages(view, where, findings);
}

}  // namespace

std::vector<Finding> validate(const Bundle& bundle) {
    std::vector<Findings> found(bundle.views.size());
    std::vector<std::int64_t> points(bundle.views.size());
    for (std::size_t i = 0; i < bundle.views.size(); ++i)
        points[i] = checkWholeView(bundle.views[i], i, found[i]);
    if (const auto named = checkNames(viewNamesOf(bundle.views)); !named)
        found.emplace_back().add(3009, "", named.error().message, "names that differ");
    return ofAllViews(found, points);
}

Result<std::vector<Finding>> validateViews(const ViewTable& table, Job& job) {
    std::vector<Findings> found(table.count());
    std::vector<std::int64_t> points(table.count());
    const auto look = [&](std::size_t i,
                          const std::shared_ptr<const ReferenceView>& view) -> Result<void> {
        points[i] = checkWholeView(*view, i, found[i]);
        return {};
    };
    STX_CHECK(forEachView(table, {"validating", 0}, job, look));
    return ofAllViews(found, points);
}

}  // namespace stx

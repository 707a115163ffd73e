#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include <glm/gtc/constants.hpp>

#include "formats/atlas/atlas_files.hpp"
#include "formats/validate/findings.hpp"
#include "lib/model/view_checks.hpp"

namespace stx {
namespace {

/// 5001 and 5002. `views` has the sizes; only rectangles that lie inside are left in `rectangles`.
void checkRectangles(const std::vector<ReferenceView>& views, int pages, glm::ivec2 pageSize,
                     std::vector<AtlasRectangle>& rectangles, Findings& findings) {
    std::vector<AtlasRectangle> good;
    std::vector<std::size_t> indexOf;
    for (std::size_t i = 0; i < rectangles.size(); ++i) {
        const AtlasRectangle& r = rectangles[i];
        const auto within = [](int at, int size, int whole) {
            return at >= 0 && size > 0 && size <= whole && at <= whole - size;
        };
        bool inside = r.view >= 0 && static_cast<std::size_t>(r.view) < views.size() &&
                      r.page >= 0 && r.page < pages &&
                      within(r.atlasX, r.atlasWidth(), pageSize.x) &&
                      within(r.atlasY, r.atlasHeight(), pageSize.y);
        if (inside) {
            const Camera& c = views[r.view].camera;
            inside = within(r.viewX, r.width, c.width) && within(r.viewY, r.height, c.height);
        }
        if (inside) {
            good.push_back(r);
            indexOf.push_back(i);
            continue;
        }
        findings.add(5001, fmt::format("rectangle {}", i),
                     fmt::format("{}x{} at {} {} of view {}, at {} {} of page {}", r.width,
                                 r.height, r.viewX, r.viewY, r.view, r.atlasX, r.atlasY, r.page),
                     "a rectangle inside both");
    }
    for (int page = 0; page < pages; ++page)
        for (const auto& [a, b] : findOverlaps(good, page))
            findings.add(5002, fmt::format("rectangles {} and {}", indexOf[a], indexOf[b]),
                         fmt::format("an overlap on page {}", page), "none");
    rectangles = std::move(good);
}

/// Those of views, 3009 and 5005.
void checkHeaders(const Atlas& atlas, Findings& findings) {
    for (std::size_t i = 0; i < atlas.views.size(); ++i)
        checkViewHeader(atlas.views[i], viewText(i, atlas.views[i].name), findings);
    if (const auto ok = checkObjects(atlas.objects, atlas.views.size()); !ok)
        findings.add(5005, "", ok.error().message, "a name and views for each object");
    else if (const auto named = checkNames(atlas); !named)
        findings.add(3009, "", named.error().text(), "names that differ");
}

/// 3003: where the edges of the image are by the angles, or the window, and by fx and fy.
void checkFieldOfView(const Camera& c, glm::dvec2 said, const std::string& where,
                      Findings& findings) {
    // What half a pixel changes is not drawn from another pixel.
    constexpr double kMostPixels = 0.5;
    const auto fits = [&](double angle, double focal, int size) {
        const double edge = c.orthographic ? focal * angle * 0.5 : focal * std::tan(angle * 0.5);
        return angle > 0 && (c.orthographic || angle < glm::pi<double>()) &&
               std::abs(edge - size * 0.5) <= kMostPixels;
    };
    if (fits(said.x, c.fx, c.width) && fits(said.y, c.fy, c.height)) return;
    const glm::dvec2 own = c.fieldOfView();
    findings.add(3003, where, fmt::format("fieldOfView {:g} {:g}", said.x, said.y),
                 fmt::format("{:g} {:g}, as of fx, fy and the size", own.x, own.y));
}

/// 3005: whether axis and angle are the rotation of the quaternion.
void checkOrientation(const Camera& c, glm::dvec4 said, const std::string& where,
                      Findings& findings) {
    // Half of the angle between both, radians. Floats are off by 1e-6; this is a fifth of a pixel
    // where 1000 of them see one radian.
    constexpr double kMostHalfAngle = 1e-4;
    const glm::dquat between = glm::conjugate(c.orientation) * quatFromAxisAngle(said);
    if (glm::length(glm::dvec3(between.x, between.y, between.z)) <= kMostHalfAngle) return;
    const glm::dvec4 own = axisAngleFromQuat(c.orientation);
    findings.add(
        3005, where, fmt::format("orientation {:g} {:g} {:g} {:g}", said.x, said.y, said.z, said.w),
        fmt::format("{:g} {:g} {:g} {:g}, as of the quaternion", own.x, own.y, own.z, own.w));
}

/// What the index says of cameras twice. A camera that breaks a rule itself is left out.
void checkSaidAgain(const AtlasHeader& header, Findings& findings) {
    for (std::size_t i = 0; i < header.again.size(); ++i) {
        const ReferenceView& view = header.atlas.views[i];
        const AtlasHeader::Again& again = header.again[i];
        if (!view.camera.check()) continue;
        const std::string where = viewText(i, view.name);
        if (again.fieldOfView) checkFieldOfView(view.camera, *again.fieldOfView, where, findings);
        if (again.orientation) checkOrientation(view.camera, *again.orientation, where, findings);
    }
}

/// 4006, 4007, 4030, 6007 and 6008, over the rectangles of each view, which lie inside their page.
class RectangleCounts {
  public:
    RectangleCounts(const std::vector<ReferenceView>& views,
                    const std::vector<AtlasRectangle>& rectangles)
        : views_(views),
          rectangles_(rectangles),
          points_(views.size()),
          outside_(views.size()),
          normals_(views.size()) {}

    void add(const Image<float>& depth, int page) {
        for (const AtlasRectangle& r : rectangles_) {
            if (r.page != page) continue;
            const ReferenceView& view = views_[r.view];
            const double slack = (view.farPlane - view.nearPlane) * 1e-4;
            for (int y = 0; y < r.atlasHeight(); ++y)
                for (const float d : depth.row(r.atlasY + y)
                                         .subspan(static_cast<std::size_t>(r.atlasX),
                                                  static_cast<std::size_t>(r.atlasWidth()))) {
                    if (std::isinf(d) && d > 0) continue;
                    ++points_[r.view];
                    if (!(d >= 0 && d >= view.nearPlane - slack && d <= view.farPlane + slack))
                        ++outside_[r.view];
                }
        }
    }
    void add(const Image<float>& depth, const Image<glm::vec3>& normal, int page) {
        for (const AtlasRectangle& r : rectangles_) {
            if (r.page != page) continue;
            auto& normals = normals_[r.view];
            if (!normals) normals.emplace(views_[r.view].camera);
            for (int y = r.viewY; y < r.viewY + r.height; ++y)
                for (int x = r.viewX; x < r.viewX + r.width; ++x) {
                    const glm::ivec2 at = r.atlasFromView(x, y);
                    normals->add(x, y, depth.at(at.x, at.y), normal.at(at.x, at.y));
                }
        }
    }

    /// `each`: whether a view without a point breaks a rule; not where some of its rectangles were
    /// left out.
    void report(bool each, Findings& findings) const {
        for (std::size_t i = 0; i < views_.size(); ++i) {
            const std::string where = viewText(i, views_[i].name);
            // Pruning may take all points of a view: others show them.
            if (each && points_[i] == 0 && !views_[i].pruned)
                findings.add(4006, where, "no point", "one point at least");
            if (outside_[i] > 0)
                findings.add(4030, where,
                             fmt::format("{} distances outside {} to {}", outside_[i],
                                         views_[i].nearPlane, views_[i].farPlane),
                             "distances between the planes");
        }
        if (std::ranges::all_of(points_, [](std::int64_t n) { return n == 0; }))
            findings.add(4007, "", "no point in any view", "points");
    }
    void reportNormals(Findings& findings) const {
        for (std::size_t i = 0; i < views_.size(); ++i) {
            if (!normals_[i]) continue;
            const std::string where = viewText(i, views_[i].name);
            normals_[i]->reportLengths(where, findings);
            normals_[i]->reportDirections(where, findings);
        }
    }

  private:
    const std::vector<ReferenceView>& views_;
    const std::vector<AtlasRectangle>& rectangles_;
    std::vector<std::int64_t> points_, outside_;
    std::vector<std::optional<NormalCounts>> normals_;
};

std::string textureText(const AtlasTexture& t) {
    return t.file.empty() ? fmt::format("{} of page {}", t.attribute, t.page)
                          : fmt::format("'{}'", t.file);
}

/// Sizes of the images and what is in them. `header` has good rectangles only; `allInside`: no
/// others were there.
void checkTextures(const std::filesystem::path& path, const AtlasHeader& header, bool allInside,
                   const ValidateOptions& options, Job& job, Findings& findings) {
    RectangleCounts counts(header.atlas.views, header.atlas.rectangles);
    bool allDepth = options.pixels;
    // What normals are looked at with; of each page the first of both waits for the other.
    std::map<int, AtlasPage> waiting;
    const auto hasNormals = [&](int page) {
        return std::ranges::any_of(header.textures, [&](const AtlasTexture& other) {
            return other.page == page && other.attribute == "normal";
        });
    };
    for (const AtlasTexture& t : header.textures) {
        if (job.cancelled) return;
        const std::string where = textureText(t);
        const bool isDepth = t.attribute == "depth";
        // Two pictures of the page are beside or below each other.
        const glm::ivec2 expected(header.pageWidth + t.secondX, header.pageHeight + t.secondY);
        const auto stored = atlasTextureSize(path, t, job.limits);
        bool fits = stored && *stored == expected;
        if (!stored) {
            findings.add(4005, where, stored.error().text(), "an image");
        } else if (!fits) {
            findings.add(5004, where, sizeText(stored->x, stored->y),
                         sizeText(expected.x, expected.y));
        }
        if (glm::ivec2(t.width, t.height) != expected) {
            findings.add(5004, where, fmt::format("{} in the index", sizeText(t.width, t.height)),
                         sizeText(expected.x, expected.y));
            fits = false;
        }
        AtlasPage page;
        if (fits && options.pixels) {
            const auto read = readAtlasTexture(path, header, t, page, job.limits);
            if (!read) findings.add(4005, where, read.error().text(), "an image that can be read");
            fits = read.has_value();
        }
        const bool isRead = fits && options.pixels;
        if (isDepth && !isRead) allDepth = false;
        if (isDepth && isRead) counts.add(page.depth, t.page);
        if (!isRead || !(isDepth ? hasNormals(t.page) : t.attribute == "normal")) continue;
        AtlasPage& both = waiting[t.page];
        if (isDepth)
            both.depth = std::move(page.depth);
        else
            both.normal = std::move(page.normal);
        if (both.depth.empty() || both.normal.empty()) continue;
        counts.add(both.depth, both.normal, t.page);
        waiting.erase(t.page);
    }
    if (allDepth) counts.report(allInside, findings);
    counts.reportNormals(findings);
}

}  // namespace

std::vector<Finding> validate(const Atlas& atlas) {
    Findings findings;
    checkHeaders(atlas, findings);
    const int textures = atlas.textureCount();
    if (textures > 4) findings.add(5003, "", fmt::format("{} textures", textures), "at most 4");
    const glm::ivec2 size(atlas.width(), atlas.height());
    for (std::size_t p = 0; p < atlas.pages.size(); ++p) {
        const AtlasPage& page = atlas.pages[p];
        const auto fits = [&](const auto& image) {
            return image.width() == 0 || glm::ivec2(image.width(), image.height()) == size;
        };
        if (page.depth.size() != size || !fits(page.texture) || !fits(page.normal) ||
            !fits(page.splatU) || !fits(page.splatV) || !fits(page.metallicRoughness) ||
            !fits(page.emissive))
            findings.add(5004, fmt::format("page {}", p), "textures of several sizes",
                         sizeText(size.x, size.y));
        if (const auto colours = page.texture.check(); !colours)
            findings.add(4005, fmt::format("page {}", p), colours.error().message,
                         "finite colours");
    }
    auto rectangles = atlas.rectangles;
    checkRectangles(atlas.views, static_cast<int>(atlas.pages.size()), size, rectangles, findings);
    RectangleCounts counts(atlas.views, rectangles);
    bool allDepth = true;
    for (std::size_t p = 0; p < atlas.pages.size(); ++p) {
        const AtlasPage& page = atlas.pages[p];
        allDepth = allDepth && page.depth.size() == size;
        if (page.depth.size() != size) continue;
        counts.add(page.depth, static_cast<int>(p));
        if (page.normal.size() == size) counts.add(page.depth, page.normal, static_cast<int>(p));
    }
    counts.report(allDepth && rectangles.size() == atlas.rectangles.size(), findings);
    counts.reportNormals(findings);
    return findings.list;
}

Result<std::vector<Finding>> validateAtlasFile(const std::filesystem::path& path,
                                               const ValidateOptions& options, Job& job) {
    auto header = readAtlasHeader(path, job.limits, AtlasChecks::format);
    if (!header) return unreadable(header.error());
    Findings findings;
    checkHeaders(header->atlas, findings);
    checkSaidAgain(*header, findings);
    const auto textures =
        std::count_if(header->textures.begin(), header->textures.end(), [](const AtlasTexture& t) {
            return t.attribute != "metallic_roughness" && t.attribute != "emissive";
        });
    if (textures > 4) findings.add(5003, "", fmt::format("{} textures", textures), "at most 4");
    const std::size_t rectangles = header->atlas.rectangles.size();
    checkRectangles(header->atlas.views, header->pages, {header->pageWidth, header->pageHeight},
                    header->atlas.rectangles, findings);
    checkTextures(path, *header, header->atlas.rectangles.size() == rectangles, options, job,
                  findings);
    if (options.pixels) checkEnvironment(readAtlasEnvironment(path, *header, job), findings);
    return findings.list;
}

}  // namespace stx

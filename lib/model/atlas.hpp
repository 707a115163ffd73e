#pragma once

#include <optional>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "lib/base/image.hpp"
#include "lib/model/bundle.hpp"

namespace stx {

/// A rectangle of a reference view and where it lies in the atlas. Pixel (x, y) of the rectangle,
/// 0 <= x < width, 0 <= y < height, is pixel (viewX + x, viewY + y) of the view and pixel
/// (atlasX + x, atlasY + y) of the page, or, when turned, (atlasX + height - 1 - y, atlasY + x).
struct AtlasRectangle {
    int view = 0;
    int page = 0;
    int viewX = 0, viewY = 0;    ///< pixels, in the view
    int width = 0, height = 0;   ///< pixels, in the view
    int atlasX = 0, atlasY = 0;  ///< pixels, in the page; of the rectangle without its padding
    bool turned = false;         ///< a quarter clockwise

    /// Page pixel of a view pixel inside the rectangle.
    [[nodiscard]] glm::ivec2 atlasFromView(int x, int y) const {
        const int dx = x - viewX, dy = y - viewY;
        if (turned) return {atlasX + height - 1 - dy, atlasY + dx};
        return {atlasX + dx, atlasY + dy};
    }
    [[nodiscard]] int atlasWidth() const { return turned ? height : width; }
    [[nodiscard]] int atlasHeight() const { return turned ? width : height; }

    bool operator==(const AtlasRectangle&) const = default;
};

/// Pairs of rectangles of one page that overlap, by their indices. A rectangle that overlaps
/// several is the second of one pair only, so there are fewer pairs than rectangles. No size may be
/// 0 or less.
[[nodiscard]] std::vector<std::pair<std::size_t, std::size_t>> findOverlaps(
    const std::vector<AtlasRectangle>& rectangles, int page);

/// One page of an atlas: its textures all have the same size.
struct AtlasPage {
    Texture texture;
    ColourFile colourFile;    ///< as in views
    Image<float> depth;       ///< distances in scene units, kNoDepth outside
    Image<glm::vec3> normal;  ///< empty when absent
    Image<glm::vec3> splatU;  ///< empty when absent
    Image<glm::vec3> splatV;
    Image<glm::vec2> metallicRoughness;  ///< as in views; empty when absent
    Image<glm::vec3> emissive;           ///< as in views; empty when absent
};

/// One of the models that share an atlas: a run of its views, in coordinates of their own.
struct AtlasObject {
    std::string name;  ///< not empty, and no other object's
    std::string title;
    int firstView = 0, views = 0;   ///< 1 view or more
    std::optional<Bounds> bounds;   ///< as Atlas::bounds
    glm::dvec3 origin{0.0};         ///< as Bundle::origin
    std::int64_t sourcePixels = 0;  ///< object pixels before and after pruning
    std::int64_t keptPixels = 0;
};

/// Pixels of the rectangles of `views` views from view `first` on.
[[nodiscard]] std::int64_t coveredPixels(const std::vector<AtlasRectangle>& rectangles, int first,
                                         int views);

/// The reference views of a bundle, or of several, merged into at most four textures: colour,
/// depth, normal and splat (Lee & Park, section 3.1). A page of an atlas has up to four textures;
/// an atlas with several pages keeps pages x textures-per-page at most four. What an engine needs
/// beside them, metallic-roughness and emissive, are further textures with the same rectangles.
struct Atlas {
    /// Cameras, planes and names of the views; their images are empty.
    std::vector<ReferenceView> views;
    std::vector<AtlasRectangle> rectangles;
    std::vector<AtlasPage> pages;
    std::string layout = "grid";  ///< "grid" or "tight"
    int padding = 2;              ///< pixels around each rectangle, filled from its edge
    std::optional<Bounds> bounds;
    glm::dvec3 origin{0.0};                          ///< as Bundle::origin
    std::shared_ptr<const Environment> environment;  ///< as Bundle::environment
    std::string title;
    std::optional<double> time, duration;  ///< as those of Bundle
    /// Object pixels before and after pruning.
    std::int64_t sourcePixels = 0;
    std::int64_t keptPixels = 0;
    /// Several models: one after the other they have all views, and bounds and origin. Empty: there
    /// is one model, without a name. What draws or unpacks an atlas wants one: objectOf().
    std::vector<AtlasObject> objects;

    [[nodiscard]] int width() const { return pages.empty() ? 0 : pages[0].depth.width(); }
    [[nodiscard]] int height() const { return pages.empty() ? 0 : pages[0].depth.height(); }
    /// Pixels of rectangles that are points of the object.
    [[nodiscard]] std::int64_t pointCount() const;
    /// Textures of a SimpleTexture in all pages together, at most 4: without those of materials.
    [[nodiscard]] int textureCount() const;
    /// Metallic-roughness and emissive textures in all pages together.
    [[nodiscard]] int materialTextureCount() const;
    /// Share of the page area that rectangles cover, without padding, 0..1.
    [[nodiscard]] double used() const;
    /// Each rectangle has this many texels of padding on each side to itself, or as many as its
    /// view has pixels there. The atlas must pass check().
    [[nodiscard]] bool paddingHolds(int texels) const;
    /// Errors (invalidInput) when a rectangle leaves its view or page, two overlap, sizes disagree,
    /// objects do not have all views, or a number (padding: 0 to 65535; the origin: finite), a
    /// depth or the layout is one that cannot be.
    [[nodiscard]] Result<void> check() const;
};

/// Errors (invalidInput): names that are empty or the same, or objects that do not have `views`
/// views, one after the other. No objects are right.
[[nodiscard]] Result<void> checkObjects(const std::vector<AtlasObject>& objects, std::size_t views);

/// Takes the views and rectangles of all other objects away, and leaves the pages as they are.
/// `name` is empty where there is one object or none; then nothing may be taken away (false).
/// Errors (usage): no object of that name, or no name among several, with the names that there are.
[[nodiscard]] Result<bool> keepObject(Atlas& atlas, const std::string& name);
/// The same with a part of the pages alone: what the rectangles that are left and their padding
/// lie on.
[[nodiscard]] Result<Atlas> objectOf(Atlas atlas, const std::string& name);

}  // namespace stx

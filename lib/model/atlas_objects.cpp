#include <algorithm>
#include <set>

#include "lib/model/atlas.hpp"

namespace stx {
namespace {

/// Names for a message: of many the first.
std::string namesOf(const std::vector<AtlasObject>& objects) {
    constexpr std::size_t kMostNames = 20;
    std::string names;
    for (std::size_t i = 0; i < std::min(objects.size(), kMostNames); ++i)
        names += (i == 0 ? "" : ", ") + objects[i].name;
    if (objects.size() > kMostNames)
        names += fmt::format(" and {} more, which stx info lists", objects.size() - kMostNames);
    return names;
}

/// Part of a page.
struct PageBox {
    glm::ivec2 low, high;
};

AtlasPage cropped(const AtlasPage& page, const PageBox& box) {
    const auto part = [&](const auto& image) {
        const glm::ivec2 size = box.high - box.low;
        return image.part(box.low.x, box.low.y, size.x, size.y);
    };
    AtlasPage out;
    if (const auto* colour = page.texture.rgba8()) out.texture = part(*colour);
    if (const auto* colour = page.texture.rgbaFloat()) out.texture = part(*colour);
    out.depth = part(page.depth);
    out.normal = part(page.normal);
    out.splatU = part(page.splatU);
    out.splatV = part(page.splatV);
    out.metallicRoughness = part(page.metallicRoughness);
    out.emissive = part(page.emissive);
    return out;
}

/// Takes the rectangles and pages that are not of the atlas' views away, and what is around them.
void cropPages(Atlas& atlas) {
    PageBox box{{atlas.width(), atlas.height()}, {0, 0}};
    std::vector<int> number(atlas.pages.size(), -1);
    for (const auto& r : atlas.rectangles) {
        const glm::ivec2 corner(r.atlasX, r.atlasY), size(r.atlasWidth(), r.atlasHeight());
        box.low = glm::min(box.low, corner - atlas.padding);
        box.high = glm::max(box.high, corner + size + atlas.padding);
        number[r.page] = 0;
    }
    box.low = glm::max(box.low, glm::ivec2(0));
    box.high = glm::min(box.high, glm::ivec2(atlas.width(), atlas.height()));
    std::vector<AtlasPage> pages;
    for (std::size_t i = 0; i < number.size(); ++i) {
        if (number[i] < 0) continue;
        number[i] = static_cast<int>(pages.size());
        pages.push_back(cropped(atlas.pages[i], box));
        atlas.pages[i] = {};
    }
    atlas.pages = std::move(pages);
    for (auto& r : atlas.rectangles) {
        r.page = number[r.page];
        r.atlasX -= box.low.x;
        r.atlasY -= box.low.y;
    }
}

}  // namespace

Result<void> checkObjects(const std::vector<AtlasObject>& objects, std::size_t views) {
    if (objects.empty()) return {};
    std::int64_t next = 0;
    std::set<std::string> names;
    for (const auto& o : objects) {
        if (o.name.empty()) return fail(ErrorCode::invalidInput, "an object has no name");
        if (!names.insert(o.name).second)
            return fail(ErrorCode::invalidInput, "two objects are called '{}'", o.name);
        if (o.firstView != next || o.views < 1)
            return fail(ErrorCode::invalidInput,
                        "object '{}' has {} views from view {} on; at least one is expected, from "
                        "view {} on",
                        o.name, o.views, o.firstView, next);
        next += o.views;
    }
    if (next != static_cast<std::int64_t>(views))
        return fail(ErrorCode::invalidInput, "the objects have {} views, but there are {}", next,
                    views);
    return {};
}

Result<bool> keepObject(Atlas& atlas, const std::string& name) {
    if (atlas.objects.empty()) {
        if (name.empty()) return false;
        return fail(ErrorCode::usage, "there is no object '{}': it holds one model without a name",
                    name);
    }
    const auto found = std::ranges::find(atlas.objects, name, &AtlasObject::name);
    const bool alone = name.empty() && atlas.objects.size() == 1;
    if (found == atlas.objects.end() && !alone)
        return fail(ErrorCode::usage, "{}; it holds {}",
                    name.empty() ? "it holds several objects, and --object NAME says which"
                                 : fmt::format("there is no object '{}'", name),
                    namesOf(atlas.objects));
    const AtlasObject object = alone ? atlas.objects.front() : *found;
    atlas.objects.clear();
    atlas.title = object.title;
    atlas.bounds = object.bounds;
    atlas.origin = object.origin;
    atlas.sourcePixels = object.sourcePixels;
    atlas.keptPixels = object.keptPixels;
    const int end = object.firstView + object.views;
    std::erase_if(atlas.rectangles, [&](const AtlasRectangle& r) {
        return r.view < object.firstView || r.view >= end;
    });
    for (auto& r : atlas.rectangles) r.view -= object.firstView;
    atlas.views.erase(atlas.views.begin() + end, atlas.views.end());
    atlas.views.erase(atlas.views.begin(), atlas.views.begin() + object.firstView);
    return true;
}

Result<Atlas> objectOf(Atlas atlas, const std::string& name) {
    STX_TRY(const bool less, keepObject(atlas, name));
    if (!less) return atlas;
    if (atlas.rectangles.empty())
        return fail(ErrorCode::invalidInput, "object '{}' has no rectangle", name);
    cropPages(atlas);
    return atlas;
}

}  // namespace stx

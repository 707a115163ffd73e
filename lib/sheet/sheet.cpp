#include "lib/sheet/sheet.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>

#include "lib/base/counted.hpp"
#include "lib/base/printable.hpp"
#include "lib/model/peak_memory.hpp"
#include "lib/model/same_pictures.hpp"
#include "lib/sheet/layout.hpp"
#include "lib/sheet/tiles.hpp"

namespace stx {
namespace {

constexpr int kViewLines = 4;
constexpr int kMoments = 6;  ///< of a sequence, unless --columns says how many
/// Rectangles on a texture: two colours in turns, so that neighbours are told apart.
constexpr glm::u8vec3 kOutlines[] = {{255, 64, 64}, {64, 160, 255}};

glm::ivec2 largestOf(const std::vector<ReferenceView>& views) {
    glm::ivec2 largest(1);
    for (const auto& v : views) largest = glm::max(largest, {v.camera.width, v.camera.height});
    return largest;
}

std::string vectorText(glm::dvec3 v) {
    // -0 is 0.
    return fmt::format("{:.4g} {:.4g} {:.4g}", v.x + 0.0, v.y + 0.0, v.z + 0.0);
}

std::string lensText(const Camera& camera) {
    const glm::dvec2 fov = camera.fieldOfView();
    if (camera.orthographic) return fmt::format("orthographic {:.4g} x {:.4g}", fov.x, fov.y);
    return fmt::format("{:.3g} x {:.3g} degrees", glm::degrees(fov.x), glm::degrees(fov.y));
}

std::string nameText(const ReferenceView& view, std::size_t number) {
    return fmt::format("{} {}{}{}", number, printable(view.name), view.pruned ? ", pruned" : "",
                       view.background ? ", background" : "");
}

/// A direction's part that is next to nothing is rounding.
glm::dvec3 tidy(glm::dvec3 v) {
    for (int axis = 0; axis < 3; ++axis)
        if (std::abs(v[axis]) < 1e-6) v[axis] = 0;
    return v;
}

std::vector<std::string> viewLines(const ReferenceView& view, std::size_t number,
                                   glm::dvec3 origin) {
    return {nameText(view, number),
            fmt::format("{}x{}, {}", view.camera.width, view.camera.height, lensText(view.camera)),
            "at " + vectorText(tidy(view.camera.position) + origin),
            "towards " + vectorText(tidy(view.camera.forward()))};
}

/// "12 of 400 views are shown", where not all are.
std::string shownText(const SheetPlan& plan) {
    if (plan.shown == plan.content.groups) return {};
    return fmt::format("{} of {} {} are shown", plan.shown, plan.content.groups, plan.content.what);
}

std::vector<std::string> headerOf(const SheetPlan& plan, const SheetSettings& settings,
                                  std::string second) {
    if (const auto shown = shownText(plan); !shown.empty()) second = shown + "; " + second;
    return {settings.title, std::move(second)};
}

/// A texture of an atlas and the rectangles on it.
Tile withRectangles(Tile tile, const Atlas& atlas, int page) {
    const glm::dvec2 scale =
        glm::dvec2(tile.picture.size()) / glm::dvec2(atlas.width(), atlas.height());
    Canvas canvas(tile.picture.width(), tile.picture.height(), kEmptyColour);
    canvas.picture({0, 0}, tile.picture);
    for (const auto& r : atlas.rectangles) {
        if (r.page != page) continue;
        const glm::ivec2 from(glm::dvec2(r.atlasX, r.atlasY) * scale);
        const glm::ivec2 to(glm::dvec2(r.atlasX + r.atlasWidth(), r.atlasY + r.atlasHeight()) *
                            scale);
        const glm::u8vec3 colour = kOutlines[r.view % 2];
        canvas.frame(from, glm::max(to - from, glm::ivec2(1)), colour);
        const std::string number = std::to_string(r.view);
        const int width = static_cast<int>(number.size()) * Canvas::kGlyphWidth;
        // Where the number would hide the rectangle the outline is enough.
        if (to.x - from.x < width + 6 || to.y - from.y < Canvas::kLineHeight + 4) continue;
        canvas.fill(from + 1, {width + 3, Canvas::kLineHeight - 1}, {255, 255, 255});
        canvas.text(from + glm::ivec2(3, 1), number, glm::u8vec3(glm::vec3(colour) * 0.7f), width);
    }
    tile.picture = canvas.image();
    return tile;
}

/// What a sheet of views has on it.
SheetContent contentOf(const ViewTable& table) {
    const auto some = [&](auto of) { return std::ranges::any_of(table.kinds(), of); };
    SheetContent content;
    content.groups = static_cast<int>(table.count());
    content.tiles = 2;
    for (const bool also :
         {some(&ViewImageKinds::normal), some(&ViewImageKinds::hasSplats),
          some(&ViewImageKinds::metallicRoughness), some(&ViewImageKinds::emissive)})
        content.tiles += also ? 1 : 0;
    content.lines = kViewLines;
    content.headerLines = 2;
    content.largest = largestOf(table.about().views);
    return content;
}

/// What a sheet of moments has on it; `groups`: views at a moment.
SheetContent contentOfMoments(const Bundle& first, int groups) {
    SheetContent content;
    content.groups = groups;
    content.tiles = 2;
    content.lines = 2;
    content.headerLines = 2;
    content.largest = largestOf(first.views);
    content.what = "views at a time";
    return content;
}

}  // namespace

Result<Sheet> sheetOf(const ViewTable& table, const SheetSettings& settings, Job& job) {
    const Bundle& bundle = table.about();
    STX_TRY(const auto plan, planSheet(contentOf(table), settings, job.limits));
    std::vector<SheetGroup> groups(static_cast<std::size_t>(plan.shown));
    std::vector<int> places(table.count(), -1);  // of those that are shown
    for (int i = 0; i < plan.shown; ++i) places[plan.groupAt(i)] = i;
    std::atomic<std::int64_t> points = 0, done = 0;
    const auto draw = [&](std::size_t number,
                          const std::shared_ptr<const ReferenceView>& read) -> Result<void> {
        const ReferenceView& view = *read;
        points += view.pointCount();
        job.progress(++done, plan.content.groups, "views");
        if (places[number] < 0) return {};
        SheetGroup& group = groups[places[number]];
        group.lines = viewLines(view, number, bundle.origin);
        group.tiles.push_back(colourTile(view.texture, plan.cell));
        group.tiles.push_back(depthTile(view.depth, plan.cell));
        if (view.hasNormals()) group.tiles.push_back(normalTile(view.normal, plan.cell));
        if (view.hasSplats()) group.tiles.push_back(splatTile(view.splatU, view.splatV, plan.cell));
        if (!view.metallicRoughness.empty())
            group.tiles.push_back(metallicRoughnessTile(view.metallicRoughness, plan.cell));
        if (!view.emissive.empty()) group.tiles.push_back(emissiveTile(view.emissive, plan.cell));
        return {};
    };
    STX_CHECK(forEachView(table, peak::kSheet, job, draw));
    const bool second =
        std::ranges::any_of(table.kinds(), [](const auto& k) { return k.normal || k.hasSplats(); });
    const auto header =
        headerOf(plan, settings,
                 fmt::format("{}, {}, {}", second ? "SimpleTextureV2" : "SimpleTexture",
                             counted(bundle.views.size(), "view"),
                             counted(static_cast<std::size_t>(points.load()), "point")));
    return Sheet{drawSheet(plan, header, groups), plan.shown, plan.content.groups};
}

std::uint64_t memoryOfSheet(const ViewTable& first, std::size_t frames) {
    SheetSettings settings;
    SheetContent content = contentOf(first);
    if (frames > 1) {
        settings.columns = static_cast<int>(std::min<std::size_t>(frames, kMoments));
        content = contentOfMoments(first.about(), content.groups * settings.columns);
    }
    Limits none;
    none.maxMemoryBytes = std::numeric_limits<std::uint64_t>::max();
    const auto plan = planSheet(content, settings, none);
    return plan ? plan->bytes() : 0;
}

Result<Sheet> sheetOf(const Atlas& atlas, const SheetSettings& settings, Job& job) {
    STX_CHECK(atlas.check());
    struct AtlasTexture {
        const char* name;
        int page;
    };
    std::vector<AtlasTexture> textures;
    for (int page = 0; page < static_cast<int>(atlas.pages.size()); ++page) {
        const AtlasPage& p = atlas.pages[page];
        textures.push_back({"colour", page});
        textures.push_back({"depth", page});
        if (!p.normal.empty()) textures.push_back({"normal", page});
        if (!p.splatU.empty()) textures.push_back({"splat", page});
        if (!p.metallicRoughness.empty()) textures.push_back({"metallic_roughness", page});
        if (!p.emissive.empty()) textures.push_back({"emissive", page});
    }
    SheetContent content;
    content.groups = static_cast<int>(textures.size());
    content.headerLines = 2;
    content.largest = {atlas.width(), atlas.height()};
    content.what = "textures";
    STX_TRY(const auto plan, planSheet(content, settings, job.limits));
    std::vector<SheetGroup> groups;
    for (int i = 0; i < plan.shown; ++i) {
        STX_CHECK(job.checkCancelled());
        const AtlasTexture& kind = textures[plan.groupAt(i)];
        const AtlasPage& page = atlas.pages[kind.page];
        const std::string_view name = kind.name;
        Tile tile = name == "colour"     ? colourTile(page.texture, plan.cell)
                    : name == "depth"    ? depthTile(page.depth, plan.cell)
                    : name == "normal"   ? normalTile(page.normal, plan.cell)
                    : name == "splat"    ? splatTile(page.splatU, page.splatV, plan.cell)
                    : name == "emissive" ? emissiveTile(page.emissive, plan.cell)
                                         : metallicRoughnessTile(page.metallicRoughness, plan.cell);
        groups.push_back(
            {{fmt::format("{}, page {}, {}x{}", name, kind.page, atlas.width(), atlas.height())},
             {}});
        groups.back().tiles.push_back(withRectangles(std::move(tile), atlas, kind.page));
    }
    const auto header =
        headerOf(plan, settings,
                 fmt::format("{} layout, {}, {}, {:.1f} % used, {} of {} pixels kept", atlas.layout,
                             counted(atlas.views.size(), "view"),
                             counted(atlas.rectangles.size(), "rectangle"), 100 * atlas.used(),
                             atlas.keptPixels, atlas.sourcePixels));
    return Sheet{drawSheet(plan, header, groups), plan.shown, content.groups};
}

namespace {

/// A view at one of the moments that are shown.
struct SequenceCell {
    std::size_t view = 0;
    int moment = 0;
    bool still = false;
};

/// Which views are background with the same pictures and camera in the first frame and the last.
Result<std::vector<bool>> stillBackgrounds(Sequence& frames, const Bundle& first, Job& job) {
    std::vector<bool> still(first.views.size());
    if (std::ranges::none_of(first.views, &ReferenceView::background)) return still;
    Job quiet;  // its notes come with the moments
    quiet.workFor(job);
    std::array<std::vector<PicturesKey>, 2> keys;
    Bundle last;
    for (const std::size_t end : {std::size_t{0}, std::size_t{1}}) {
        STX_TRY(const auto table, frames.views(end * (frames.timeline().count() - 1), quiet));
        keys[end].resize(table->count());
        last = headersOf(std::as_const(*table).about());
        STX_CHECK(forEachView(
            *table, peak::kSheet, quiet,
            [&](std::size_t i, const std::shared_ptr<const ReferenceView>& view) -> Result<void> {
                if (view->background) keys[end][i] = PicturesKey::of(*view);
                return {};
            }));
    }
    for (std::size_t i = 0; i < std::min(still.size(), last.views.size()); ++i)
        still[i] = first.views[i].background && last.views[i].background &&
                   first.views[i].camera == last.views[i].camera && keys[0][i] == keys[1][i];
    return still;
}

/// Rows of a sheet: of each view that may change all moments, then background that stands still,
/// once each.
std::vector<std::vector<SequenceCell>> rowsOfViews(const std::vector<bool>& stands, int moments) {
    std::vector<std::vector<SequenceCell>> rows;
    std::vector<SequenceCell> still;
    for (std::size_t i = 0; i < stands.size(); ++i) {
        if (stands[i]) {
            still.push_back({i, 0, true});
            continue;
        }
        rows.emplace_back();
        for (int m = 0; m < moments; ++m) rows.back().push_back({i, m, false});
    }
    for (std::size_t i = 0; i < still.size(); ++i) {
        if (i % static_cast<std::size_t>(moments) == 0) rows.emplace_back();
        rows.back().push_back(still[i]);
    }
    return rows;
}

/// As many rows as hold `shown` cells, evenly chosen: rows are whole, and those of the moments come
/// before what stands still.
std::vector<SequenceCell> shownCells(const std::vector<std::vector<SequenceCell>>& wanted,
                                     int shown, int moments) {
    const auto rows = static_cast<std::size_t>((shown + moments - 1) / moments);
    std::vector<SequenceCell> cells;
    for (std::size_t r = 0; r < rows; ++r) {
        const auto& row = wanted[r * wanted.size() / rows];
        cells.insert(cells.end(), row.begin(), row.end());
    }
    return cells;
}

}  // namespace

Result<Sheet> sheetOf(Sequence& frames, const SheetSettings& settings, Job& job) {
    const Timeline timeline = frames.timeline();
    const int all = static_cast<int>(timeline.count());
    const int moments = std::min(settings.columns > 0 ? settings.columns : kMoments, all);
    STX_TRY(auto table, frames.views(0, job));
    const Bundle first = headersOf(std::as_const(*table).about());
    const std::size_t views = first.views.size();
    // It does not serve when another frame is asked for.
    if (std::ranges::any_of(first.views, &ReferenceView::background)) table.reset();
    STX_TRY(const auto stands, stillBackgrounds(frames, first, job));
    const auto wanted = rowsOfViews(stands, moments);
    int cellsWanted = 0;
    for (const auto& row : wanted) cellsWanted += static_cast<int>(row.size());
    SheetSettings fixed = settings;
    fixed.columns = moments;
    STX_TRY(auto plan, planSheet(contentOfMoments(first, cellsWanted), fixed, job.limits));
    const auto cells = shownCells(wanted, plan.shown, moments);
    plan.shown = static_cast<int>(cells.size());
    std::vector<SheetGroup> groups(cells.size());
    std::vector<Image<float>> depths(cells.size());
    std::vector<ValueRange> ranges(views);
    std::atomic<std::int64_t> points = 0;
    for (int m = 0; m < moments; ++m) {
        STX_CHECK(job.checkCancelled());
        // From the first frame to the last.
        const auto frame = static_cast<std::size_t>(
            moments == 1 ? 0 : static_cast<std::int64_t>(m) * (all - 1) / (moments - 1));
        const auto look = [&](std::size_t k,
                              const std::shared_ptr<const ReferenceView>& view) -> Result<void> {
            if (m == 0) points += view->pointCount();
            for (std::size_t i = 0; i < cells.size(); ++i) {
                if (cells[i].moment != m || cells[i].view != k) continue;
                groups[i].lines = {nameText(*view, k),
                                   cells[i].still ? std::string("background that stands still")
                                                  : fmt::format("{:.3f} s, frame {}",
                                                                timeline.times[frame], frame)};
                groups[i].tiles.push_back(colourTile(view->texture, plan.cell));
                ranges[k].add(rangeOf(view->depth));
                depths[i] = shrunkValues(view->depth, plan.cell);
            }
            return {};
        };
        auto looked = [&]() -> Result<void> {
            Job quiet;  // the notes of the first have been said, but for those of its views
            quiet.workFor(job);
            if (m > 0) table.reset();
            if (!table) {
                STX_TRY(table, frames.views(frame, frame == 0 ? quiet : job));
            }
            STX_CHECK(checkSameViews(first, std::as_const(*table).about()));
            return forEachView(*table, peak::kSheet, job, look);
        }();
        if (!looked)
            return tl::unexpected(
                looked.error().at(fmt::format("at {:g} s", timeline.times[frame])));
        job.progress(m + 1, moments, "moments");
    }
    for (std::size_t i = 0; i < groups.size(); ++i) {
        const ValueRange& range = ranges[cells[i].view];
        groups[i].tiles.push_back({falseColour(depths[i], range, kEmptyColour),
                                   rangeText("depth", range), !range.empty()});
    }
    const auto header = headerOf(
        plan, settings,
        fmt::format("{} of {} over {:.4g} s, {}, {} in the first",
                    counted(static_cast<std::size_t>(moments), "moment"),
                    counted(timeline.count(), "frame"), timeline.duration(), counted(views, "view"),
                    counted(static_cast<std::size_t>(points.load()), "point")));
    return Sheet{drawSheet(plan, header, groups), plan.shown, plan.content.groups};
}

}  // namespace stx

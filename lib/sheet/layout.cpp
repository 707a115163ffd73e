#include "lib/sheet/layout.hpp"

#include <algorithm>
#include <cmath>

namespace stx {
namespace {

constexpr int kMargin = 12;      ///< around the sheet
constexpr int kGroupGap = 16;    ///< between groups
constexpr int kTileGap = 6;      ///< between pictures of a group
constexpr int kBarHeight = 4;    ///< of the map below a picture in false colour
constexpr int kLeastSide = 48;   ///< of a picture: less shows nothing
constexpr int kFewPixels = 128;  ///< pictures smaller than this are enlarged up to it
constexpr int kLeastText = 22 * Canvas::kGlyphWidth;
constexpr double kShape = 4.0 / 3.0;  ///< of a sheet that is good to look at
constexpr glm::u8vec3 kPaper{255, 255, 255}, kInk{30, 30, 34}, kPaleInk{96, 96, 104};

/// A cell whose longer side is `side`.
glm::ivec2 cellOf(glm::ivec2 largest, double side) {
    const double longer = std::max(largest.x, largest.y);
    return glm::max(glm::ivec2(glm::dvec2(largest) * (side / longer)), glm::ivec2(1));
}

/// What a group takes beside its pictures.
int textHeight(const SheetContent& c) {
    return (c.lines + 1) * Canvas::kLineHeight + kBarHeight;
}

glm::ivec2 groupSize(const SheetContent& c, glm::ivec2 cell) {
    return {std::max(c.tiles * cell.x + (c.tiles - 1) * kTileGap, kLeastText),
            cell.y + textHeight(c)};
}

glm::ivec2 sheetSize(const SheetContent& c, glm::ivec2 group, int columns, int rows) {
    return {2 * kMargin + columns * group.x + (columns - 1) * kGroupGap,
            2 * kMargin + c.headerLines * Canvas::kLineHeight + rows * (group.y + kGroupGap)};
}

/// The longest side of pictures, such that `columns` groups fit beside each other.
double sideForWidth(const SheetContent& c, int columns, int most) {
    const double group =
        static_cast<double>(most - 2 * kMargin - (columns - 1) * kGroupGap) / columns;
    if (group < kLeastText) return 0;
    const double tile = (group - (c.tiles - 1) * kTileGap) / c.tiles;
    return tile * std::max(c.largest.x, c.largest.y) / c.largest.x;
}

double sideForHeight(const SheetContent& c, int rows, int most) {
    const double group =
        static_cast<double>(most - 2 * kMargin - c.headerLines * Canvas::kLineHeight) / rows;
    const double tile = group - kGroupGap - textHeight(c);
    return tile * std::max(c.largest.x, c.largest.y) / c.largest.y;
}

}  // namespace

Result<SheetPlan> planSheet(const SheetContent& content, const SheetSettings& settings,
                            const Limits& limits) {
    const glm::ivec2 most = settings.mostSize;
    const auto native = static_cast<double>(std::max(content.largest.x, content.largest.y));
    const double cap = std::max<double>(native, kFewPixels);
    const int asked = std::min(settings.columns, content.groups);
    const int first = asked > 0 ? asked : 1;
    const int last = asked > 0 ? asked : std::min(content.groups, std::max(1, most.x / kLeastText));
    SheetPlan best;
    best.content = content;
    best.shown = 0;
    double bestSide = 0, bestShape = 0;
    for (int columns = first; columns <= last; ++columns) {
        const double forWidth = std::min(sideForWidth(content, columns, most.x), cap);
        if (forWidth < std::min<double>(kLeastSide, cap)) continue;
        int rows = (content.groups + columns - 1) / columns;
        int shown = content.groups;
        double side = std::min(forWidth, sideForHeight(content, rows, most.y));
        if (side < kLeastSide) {
            side = kLeastSide;
            const int height = groupSize(content, cellOf(content.largest, side)).y + kGroupGap;
            rows = (most.y - 2 * kMargin - content.headerLines * Canvas::kLineHeight) / height;
            shown = std::min(content.groups, std::max(rows, 0) * columns);
        }
        if (shown < 1) continue;
        side = std::floor(side);
        const glm::ivec2 cell = cellOf(content.largest, side), group = groupSize(content, cell);
        const glm::ivec2 size = sheetSize(content, group, columns, rows);
        const double shape = std::abs(std::log(static_cast<double>(size.x) / size.y / kShape));
        const bool better = shown != best.shown ? shown > best.shown
                            : side != bestSide  ? side > bestSide
                                                : shape < bestShape;
        if (!better) continue;
        bestSide = side;
        bestShape = shape;
        best.columns = columns;
        best.rows = rows;
        best.shown = shown;
        best.cell = cell;
        best.group = group;
        best.size = size;
    }
    if (best.shown == 0) {
        const int columns = std::max(asked, 1);
        const glm::ivec2 group = groupSize(content, cellOf(content.largest, kLeastSide));
        const glm::ivec2 needed = sheetSize(content, group, columns, 1);
        return fail(ErrorCode::usage,
                    "a sheet of {}x{} is too small for {} of {} {} beside each other; {}x{} and "
                    "more will do",
                    most.x, most.y, columns, content.groups, content.what, needed.x, needed.y);
    }
    STX_CHECK(limits.checkAllocation(
        static_cast<std::uint64_t>(best.size.x) * static_cast<std::uint64_t>(best.size.y),
        SheetPlan::kBytesPerPixel, "the sheet"));
    return best;
}

Rgb8Image drawSheet(const SheetPlan& plan, const std::vector<std::string>& header,
                    const std::vector<SheetGroup>& groups) {
    Canvas canvas(plan.size.x, plan.size.y, kPaper);
    glm::ivec2 at(kMargin);
    for (const auto& line : header) {
        canvas.text(at, line, kInk, plan.size.x - 2 * kMargin);
        at.y += Canvas::kLineHeight;
    }
    const int top = kMargin + plan.content.headerLines * Canvas::kLineHeight + kGroupGap;
    for (std::size_t i = 0; i < groups.size(); ++i) {
        const int number = static_cast<int>(i);
        const glm::ivec2 corner(kMargin + number % plan.columns * (plan.group.x + kGroupGap),
                                top + number / plan.columns * (plan.group.y + kGroupGap));
        at = corner;
        for (std::size_t line = 0; line < groups[i].lines.size(); ++line) {
            canvas.text(at, groups[i].lines[line], line == 0 ? kInk : kPaleInk, plan.group.x);
            at.y += Canvas::kLineHeight;
        }
        at = corner + glm::ivec2(0, plan.content.lines * Canvas::kLineHeight);
        for (const Tile& tile : groups[i].tiles) {
            canvas.picture(at, tile.picture);
            const glm::ivec2 below = at + glm::ivec2(0, tile.picture.height());
            const int width = tile.picture.width();
            for (int x = 0; tile.bar && x < width; ++x)
                canvas.fill({below.x + x, below.y + 1}, {1, kBarHeight - 1},
                            viridis(static_cast<double>(x) / std::max(width - 1, 1)));
            // With one picture the text may be as long as the group is wide.
            const int room = groups[i].tiles.size() == 1 ? plan.group.x : plan.cell.x;
            canvas.text(below + glm::ivec2(0, kBarHeight), tile.caption, kPaleInk, room);
            at.x += plan.cell.x + kTileGap;
        }
    }
    return canvas.image();
}

}  // namespace stx

#include "lib/packing/patches.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>

namespace stx {
namespace {

/// A cut must save this share of the patch's room, and this many pixels: more patches are more
/// borders to filter across.
constexpr double kLeastShare = 0.03;
constexpr std::int64_t kLeastPixels = 192;

/// From where to where a row or column has content; empty when first > last.
struct Extent {
    int first = std::numeric_limits<int>::max();
    int last = -1;

    void join(Extent o) {
        first = std::min(first, o.first);
        last = std::max(last, o.last);
    }
    [[nodiscard]] bool empty() const { return first > last; }
    [[nodiscard]] int length() const { return empty() ? 0 : last - first + 1; }
};

class Cutter {
  public:
    Cutter(const Image<std::uint8_t>& content, int padding)
        : content_(content), padding_(padding) {}

    void cut(Patch box, std::vector<Patch>& out) const {
        if (!trim(box)) return;
        std::vector<Extent> columns(box.width), rows(box.height);
        extents(box, columns, rows);
        std::int64_t best = room(box.width, box.height);
        const std::int64_t whole = best;
        const auto least = std::max(
            kLeastPixels, static_cast<std::int64_t>(kLeastShare * static_cast<double>(whole)));
        best -= least;
        int atColumn = 0, atRow = 0;
        const int column = bestCut(columns, best);
        if (column > 0) atColumn = column;
        const int row = bestCut(rows, best);
        if (row > 0) {
            atRow = row;
            atColumn = 0;
        }
        if (atColumn > 0) {
            cut({box.x, box.y, atColumn, box.height}, out);
            cut({box.x + atColumn, box.y, box.width - atColumn, box.height}, out);
        } else if (atRow > 0) {
            cut({box.x, box.y, box.width, atRow}, out);
            cut({box.x, box.y + atRow, box.width, box.height - atRow}, out);
        } else {
            out.push_back(box);
        }
    }

  private:
    [[nodiscard]] std::int64_t room(int width, int height) const {
        if (width == 0 || height == 0) return 0;
        return (width + 2ll * padding_) * (height + 2ll * padding_);
    }

    /// Content of each column (as rows) and each row (as columns), relative to the box.
    void extents(const Patch& box, std::vector<Extent>& columns, std::vector<Extent>& rows) const {
        for (int y = 0; y < box.height; ++y) {
            const auto line = content_.row(box.y + y).subspan(box.x, box.width);
            for (int x = 0; x < box.width; ++x) {
                if (!line[x]) continue;
                columns[x].join({y, y});
                rows[y].join({x, x});
            }
        }
    }

    /// Shrinks a box to its content; false when it has none.
    [[nodiscard]] bool trim(Patch& box) const {
        Extent across, down;
        for (int y = 0; y < box.height; ++y) {
            const auto line = content_.row(box.y + y).subspan(box.x, box.width);
            int first = 0, last = box.width - 1;
            while (first <= last && !line[first]) ++first;
            if (first > last) continue;
            while (!line[last]) --last;
            across.join({first, last});
            down.join({y, y});
        }
        if (across.empty()) return false;
        box = {box.x + across.first, box.y + down.first, across.length(), down.length()};
        return true;
    }

    /// The cut before line i that leaves the least room for both trimmed parts, when that is below
    /// `best` (then lowered to it); else 0.
    int bestCut(const std::vector<Extent>& lines, std::int64_t& best) const {
        const int count = static_cast<int>(lines.size());
        // Of lines [i, count): their extent and the first of them that has content.
        std::vector<Extent> after(count + 1);
        std::vector<int> firstAfter(count + 1, count);
        for (int i = count - 1; i >= 0; --i) {
            after[i] = after[i + 1];
            after[i].join(lines[i]);
            firstAfter[i] = lines[i].empty() ? firstAfter[i + 1] : i;
        }
        Extent before;
        int lastBefore = -1, at = 0;
        for (int i = 1; i < count; ++i) {
            before.join(lines[i - 1]);
            if (!lines[i - 1].empty()) lastBefore = i - 1;
            const std::int64_t both = room(lastBefore + 1, before.length()) +
                                      room(count - firstAfter[i], after[i].length());
            if (both < best) {
                best = both;
                at = i;
            }
        }
        return at;
    }

    const Image<std::uint8_t>& content_;
    int padding_;
};

}  // namespace

std::vector<Patch> contentPatches(const ReferenceView& view, int padding) {
    Image<std::uint8_t> content(view.depth.width(), view.depth.height(), 0);
    for (int y = 0; y < content.height(); ++y) {
        for (int x = 0; x < content.width(); ++x) {
            const bool rim = view.texture.rgba8() ? view.texture.rgba8()->at(x, y).a % 255 != 0
                                                  : view.texture.rgbaFloat()->at(x, y).a > 0 &&
                                                        view.texture.rgbaFloat()->at(x, y).a < 1;
            content.at(x, y) = rim || hasPoint(view.depth.at(x, y)) ? 1 : 0;
        }
    }
    std::vector<Patch> patches;
    Cutter(content, padding).cut({0, 0, content.width(), content.height()}, patches);
    return patches;
}

}  // namespace stx

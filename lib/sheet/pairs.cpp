#include <cmath>

#include "lib/base/counted.hpp"
#include "lib/metrics/compare.hpp"
#include "lib/model/srgb8.hpp"
#include "lib/sheet/layout.hpp"
#include "lib/sheet/sheet.hpp"
#include "lib/sheet/tiles.hpp"

namespace stx {
namespace {

/// Where only one of two has a depth.
constexpr glm::u8vec3 kOnlyOne{255, 0, 255};

Rgba8Image codedOf(const Texture& texture) {
    if (const Rgba8Image* coded = texture.rgba8()) return *coded;
    Rgba8Image out(texture.width(), texture.height());
    for (std::size_t i = 0; i < out.count(); ++i) {
        const glm::vec4 c = texture.at(i);
        out.data()[i] = {srgb8FromLinear(c.r), srgb8FromLinear(c.g), srgb8FromLinear(c.b),
                         static_cast<std::uint8_t>(glm::clamp(c.a, 0.0f, 1.0f) * 255.0f + 0.5f)};
    }
    return out;
}

Result<ColourError> colourError(const SheetPair& pair) {
    if (pair.error) return *pair.error;
    const Texture &a = pair.a, &b = pair.b;
    ColourError error;
    if (a.isLinear() && b.isLinear()) {
        STX_TRY(error.found, compare(*a.rgbaFloat(), *b.rgbaFloat()));
        STX_TRY(error.picture,
                errorPicture(*a.rgbaFloat(), *b.rgbaFloat(), {}, ColourError::kGain));
        return error;
    }
    const Rgba8Image first = codedOf(a), second = codedOf(b);
    STX_TRY(error.found, compare(first, second));
    STX_TRY(error.picture, errorPicture(first, second, {}, ColourError::kGain));
    return error;
}

Tile depthError(const Image<float>& a, const Image<float>& b, glm::ivec2 cell) {
    Image<float> difference(a.width(), a.height(), kNoDepth);
    std::size_t onlyOne = 0;
    Rgb8Image lonely(a.width(), a.height(), kEmptyColour);
    for (std::size_t i = 0; i < a.count(); ++i) {
        const bool hasA = hasPoint(a.data()[i]), hasB = hasPoint(b.data()[i]);
        if (hasA && hasB) difference.data()[i] = std::abs(a.data()[i] - b.data()[i]);
        if (hasA == hasB) continue;
        ++onlyOne;
        lonely.data()[i] = kOnlyOne;
    }
    ValueRange range = rangeOf(difference);
    if (!range.empty()) range.least = 0;
    // The differences over the pixels that only one has.
    // As short as the tile is narrow.
    Tile tile{shrunk(lonely, cell),
              range.empty() ? "nothing in both" : fmt::format("to {:.3g} off", range.most),
              !range.empty()};
    const auto values = shrunkLargest(difference, cell);
    for (std::size_t i = 0; i < values.count(); ++i)
        if (std::isfinite(values.data()[i]) && tile.picture.data()[i] == kEmptyColour)
            tile.picture.data()[i] = viridis(range.place(values.data()[i]));
    if (onlyOne > 0) tile.caption += fmt::format(", {} px in one only", onlyOne);
    return tile;
}

std::string decibels(const std::optional<double>& value) {
    return value ? fmt::format("{:.2f} dB", *value) : std::string("identical");
}

}  // namespace

Result<Sheet> sheetOf(const std::vector<SheetPair>& pairs, const SheetSettings& settings,
                      Job& job) {
    if (pairs.empty()) return fail(ErrorCode::usage, "a sheet of pairs needs at least one");
    // Colour and depth of a pair are groups of their own, with their own sentence.
    struct Row {
        const SheetPair* pair;
        bool depth;
    };
    std::vector<Row> rows;
    SheetContent content;
    content.largest = glm::ivec2(1);
    for (const auto& pair : pairs) {
        rows.push_back({&pair, false});
        if (!pair.depthA.empty() && !pair.depthB.empty()) rows.push_back({&pair, true});
        content.largest = glm::max(content.largest, glm::ivec2(pair.a.width(), pair.a.height()));
    }
    content.groups = static_cast<int>(rows.size());
    content.tiles = 3;
    content.lines = 2;
    content.headerLines = 2;
    content.what = "pairs";
    STX_TRY(const auto plan, planSheet(content, settings, job.limits));
    SequenceComparison total;
    std::vector<SheetGroup> groups;
    // Every pair counts in the figure, also when not all are shown.
    int next = 0;
    for (int i = 0; i < content.groups; ++i) {
        STX_CHECK(job.checkCancelled());
        const SheetPair& pair = *rows[i].pair;
        const bool shown = next < plan.shown && plan.groupAt(next) == i;
        if (shown) ++next;
        if (rows[i].depth) {
            if (!shown) continue;
            if (pair.depthA.size() != pair.depthB.size())
                return failAt(pair.title, ErrorCode::invalidInput,
                              "the depth images are {}x{} and {}x{}; both must match",
                              pair.depthA.width(), pair.depthA.height(), pair.depthB.width(),
                              pair.depthB.height());
            ValueRange range = rangeOf(pair.depthA);
            range.add(rangeOf(pair.depthB));
            const auto side = [&](const Image<float>& depth) {
                return Tile{falseColour(shrunkValues(depth, plan.cell), range, kEmptyColour),
                            "depth", !range.empty()};
            };
            groups.push_back({{pair.title, rangeText("depth", range)}, {}});
            groups.back().tiles.push_back(side(pair.depthA));
            groups.back().tiles.push_back(side(pair.depthB));
            groups.back().tiles.push_back(depthError(pair.depthA, pair.depthB, plan.cell));
            continue;
        }
        STX_TRY(auto error, within(pair.title, colourError(pair)));
        total.add(error.found);
        if (!shown) continue;
        groups.push_back({{pair.title, fmt::format("PSNR {}, SSIM {:.4f}, worst {:g} at {} {}",
                                                   decibels(error.found.psnrRgb), error.found.ssimY,
                                                   error.found.worst.difference,
                                                   error.found.worst.x, error.found.worst.y)},
                          {}});
        groups.back().tiles.push_back(colourTile(pair.a, plan.cell));
        groups.back().tiles.push_back(colourTile(pair.b, plan.cell));
        Tile heat{shrunk(Texture(std::move(error.picture)), plan.cell),
                  fmt::format("error, {:g} times", ColourError::kGain)};
        groups.back().tiles.push_back(std::move(heat));
        job.progress(i + 1, content.groups, "pairs");
    }
    std::string second = fmt::format("{}, PSNR {} over all", counted(pairs.size(), "pair"),
                                     decibels(total.total().psnrRgb));
    if (plan.shown < content.groups)
        second = fmt::format("{} of {} rows are shown; {}", plan.shown, content.groups, second);
    return Sheet{drawSheet(plan, {settings.title, second}, groups), plan.shown, content.groups};
}

}  // namespace stx

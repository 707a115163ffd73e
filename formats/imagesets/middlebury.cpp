// Middlebury's stereo sets: calib.txt with PFM disparities (2014 and later), and the older ones
// with 8-bit disparities, whose focal length and baseline must be given. Cameras look along -Z of
// our world and differ along +X.

#include <algorithm>
#include <cmath>

#include "formats/files/messages.hpp"
#include "formats/imagesets/kinds.hpp"
#include "formats/imagesets/middlebury.hpp"
#include "formats/imagesets/pictures.hpp"
#include "formats/imagesets/set_options.hpp"
#include "formats/imagesets/text_lines.hpp"
#include "lib/base/whole_number.hpp"
#include "lib/refine/shift.hpp"

namespace stx::imagesets {
namespace {

/// Z = baseline f / (disparity / scale + offset). Floats: NaN and infinity are unknown; integers:
/// 0.
auto distancesOf(double baselineTimesFocal, double scale, double offset) {
    return [=](Image<float>& values, const Camera&, int largest, Job&) -> Result<void> {
        for (float& v : values.pixels()) {
            const bool known = largest == 0 ? std::isfinite(v) : v != 0;
            const double disparity = v / scale + offset;
            v = known && disparity > 0 ? static_cast<float>(baselineTimesFocal / disparity) : 0.0f;
        }
        return {};
    };
}

Camera cameraAt(double x, double f, double cx, double cy, int width, int height) {
    Camera c;
    c.position = {x, 0, 0};
    c.fx = c.fy = f;
    c.cx = cx;
    c.cy = cy;
    c.width = width;
    c.height = height;
    return c;
}

Result<SetDescription> describeCalibrated(const path& file, Job& job) {
    const path folder = folderOf(file);
    const std::string where = inQuotes(file.string());
    STX_TRY(const auto bytes, readSetFile(file, job.limits));
    STX_TRY(const auto calibration, within(where, parseMiddlebury(textOf(bytes), job.limits)));
    SetDescription set;
    for (int i = 0; i < 2; ++i) {
        const std::string texture = withImageEnding(folder, fmt::format("im{}", i));
        const std::string depth =
            firstThere(folder, {fmt::format("disp{}.pfm", i), fmt::format("disp{}GT.pfm", i)});
        if (depth.empty()) continue;
        SetView view;
        view.name = fmt::format("im{}", i);
        STX_TRY(view.texture, sourceInside(folder, texture, where, job.limits));
        STX_TRY(view.depth, sourceInside(folder, depth, where, job.limits));
        // The principal points count from the first pixel's centre.
        view.camera = cameraAt(i * calibration.baseline, calibration.f, calibration.cx[i] + 0.5,
                               calibration.cy[i] + 0.5, calibration.width, calibration.height);
        view.distances = distancesOf(calibration.baseline * calibration.f, 1, calibration.doffs);
        set.views.push_back(std::move(view));
    }
    if (set.views.empty())
        return failAt(where, ErrorCode::io, "there is neither disp0.pfm nor disp1.pfm beside it");
    return set;
}

/// The number at the end of `stem` after `prefix`.
std::optional<int> numberAfter(const std::string& stem, std::string_view prefix) {
    if (!stem.starts_with(prefix)) return std::nullopt;
    const auto value = wholeNumber<int>(std::string_view(stem).substr(prefix.size()));
    return value && *value >= 0 && *value <= 99 ? value : std::nullopt;
}

/// A picture of an older set, from which disparities of others are looked at.
struct NumberedPicture {
    int number = 0;
    PictureSource source;
};

/// The numbers of the two views between which an older set's baseline and disparities are.
struct NumberedPair {
    int first = 0, last = 4;
    /// How far `number` is along the baseline: 0 at the first view, 1 at the last.
    [[nodiscard]] double stepsTo(int number) const {
        return static_cast<double>(number - first) / (last - first);
    }
};

/// The outermost of those that have disparities, at least one. A single one does not say where the
/// other is: four numbers away, as in published sets (1 and 5, 2 and 6).
NumberedPair pairOf(const std::vector<int>& disparities) {
    const auto [low, high] = std::ranges::minmax(disparities);
    if (low != high) return {low, high};
    return low > 4 ? NumberedPair{low - 4, low} : NumberedPair{low, low + 4};
}

/// See SetView::shift, of view `number`. Integers may have been cut off, which takes half a step in
/// the mean, and rectified pictures lie a little beside each other: a step either way at most.
auto shiftBy(const std::vector<NumberedPicture>& pictures, const NumberedPair& pair, int number,
             double scale) {
    return [=](const Image<float>& values, const Texture& texture, Job& job) {
        std::vector<SidePicture> beside;
        std::optional<std::size_t> first;  // of those beside
        for (const NumberedPicture& p : pictures) {
            if (p.number == number) continue;
            // Only a help: what cannot be read is not needed.
            auto read = readColour(p.source, {}, texture.isLinear(), job);
            if (!read || read->texture.width() != texture.width() ||
                read->texture.height() != texture.height())
                continue;
            if (p.number < number && p.number == pictures.front().number) first = beside.size();
            beside.push_back(
                {std::move(read->texture), pair.stepsTo(p.number) - pair.stepsTo(number)});
        }
        Image<float> disparities = values;
        for (float& d : disparities.pixels())
            if (hasPoint(d)) d = static_cast<float>(d / scale);
        const PictureShift shift = pictureShift(disparities, texture, beside, 1.2 / scale);
        return SetShift{static_cast<float>(std::clamp(shift.disparity * scale, -1.0, 1.0)),
                        first ? shift.down[*first] : 0.0};
    };
}

Result<SetDescription> describeOlder(const path& folder, const ImageSetOptions& options, Job& job) {
    const std::string where = inQuotes(folder.string());
    if (!(options.focal > 0 && options.baseline > 0))
        return failAt(
            where, ErrorCode::usage,
            "this Middlebury set has no calib.txt; give the focal length in pixels and the "
            "baseline with --focal and --baseline (sets of 2006 at full size: 3740, 160)");
    if (!(options.disparityScale > 0))
        return failAt(where, ErrorCode::usage, "the disparity scale is {:g}; it must be above 0",
                      options.disparityScale);
    double offset = options.disparityOffset.value_or(0);
    std::error_code ec;
    if (!options.disparityOffset && std::filesystem::is_regular_file(folder / "dmin.txt", ec)) {
        STX_TRY(const auto bytes, readSetFile(folder / "dmin.txt", job.limits));
        const auto lines = linesOf(textOf(bytes));
        const std::string place = inQuotes((folder / "dmin.txt").string());
        if (lines.empty()) return failAt(place, ErrorCode::invalidInput, "the file is empty");
        STX_TRY(const auto n, within(place, numbersOf(lines[0].words(), 0, 1, lines[0].where())));
        offset = n[0];
    }
    SetDescription set;
    const auto files = filesIn(folder);
    std::vector<NumberedPicture> pictures;
    std::vector<int> disparities;
    for (const std::string& name : files) {
        const auto stem = path(name).stem().string();
        if (const auto number = numberAfter(stem, "disp")) disparities.push_back(*number);
        const auto number = numberAfter(stem, "view");
        const auto older = number ? number : numberAfter(stem, "im");
        if (!older) continue;
        STX_TRY(auto source, sourceInside(folder, name, where, job.limits));
        pictures.push_back({*older, std::move(source)});
    }
    if (disparities.empty())
        return failAt(where, ErrorCode::io,
                      "no disparity image was found in it; disp1.png and disp5.png, or such, are "
                      "expected");
    std::ranges::sort(pictures, {}, &NumberedPicture::number);
    const NumberedPair pair = pairOf(disparities);
    for (const std::string& name : files) {
        const auto number = numberAfter(path(name).stem().string(), "disp");
        if (!number) continue;
        SetView view;
        view.name = fmt::format("view{}", *number);
        std::string texture = withImageEnding(folder, view.name);
        if (texture == view.name) texture = withImageEnding(folder, fmt::format("im{}", *number));
        STX_TRY(view.texture, sourceInside(folder, texture, where, job.limits));
        STX_TRY(view.depth, sourceInside(folder, name, where, job.limits));
        STX_TRY(const auto size, within(where, imageSizeOf(view.texture, job)));
        // The pictures are cropped such that a disparity of `offset` is 0.
        const double steps = pair.stepsTo(*number);
        view.camera = cameraAt(options.baseline * steps, options.focal,
                               size.x * 0.5 + offset * steps, size.y * 0.5, size.x, size.y);
        view.distances =
            distancesOf(options.baseline * options.focal, options.disparityScale, offset);
        view.shift = shiftBy(pictures, pair, *number, options.disparityScale);
        view.measured = true;
        set.views.push_back(std::move(view));
    }
    return set;
}

}  // namespace

Result<MiddleburyCalibration> parseMiddlebury(std::string_view text, const Limits& limits) {
    MiddleburyCalibration c;
    bool camera[2] = {false, false};
    std::optional<double> doffs, baseline, width, height;
    for (const TextLine& line : linesOf(text)) {
        const auto equals = line.text.find('=');
        if (equals == std::string_view::npos)
            return failAt(line.where(), ErrorCode::invalidInput, "'key=value' is expected");
        const std::string_view key = line.text.substr(0, equals);
        std::string value(line.text.substr(equals + 1));
        if (key == "cam0" || key == "cam1") {
            for (char& letter : value)
                if (letter == '[' || letter == ']' || letter == ';') letter = ' ';
            const TextLine words{line.number, value};
            STX_TRY(const auto n, numbersOf(words.words(), 0, 9, line.where()));
            const int i = key == "cam1";
            if (!(n[0] > 0) || std::abs(n[0] - n[4]) > 1e-6 * n[0] || n[1] != 0 || n[3] != 0)
                return failAt(line.where(), ErrorCode::invalidInput,
                              "{} is not a matrix of rows f 0 cx; 0 f cy; 0 0 1 with f above 0",
                              key);
            if (camera[1 - i] && c.f != n[0])
                return failAt(line.where(), ErrorCode::invalidInput,
                              "the focal lengths of cam0 and cam1 differ ({:g}, {:g}); the set is "
                              "not rectified",
                              c.f, n[0]);
            c.f = n[0];
            c.cx[i] = n[2];
            c.cy[i] = n[5];
            camera[i] = true;
            continue;
        }
        for (auto& [name, to] :
             std::initializer_list<std::pair<const char*, std::optional<double>*>>{
                 {"doffs", &doffs},
                 {"baseline", &baseline},
                 {"width", &width},
                 {"height", &height}}) {
            if (key != name) continue;
            const TextLine words{line.number, value};
            STX_TRY(const auto n, numbersOf(words.words(), 0, 1, line.where()));
            *to = n[0];
        }
    }
    if (!camera[0] || !camera[1] || !doffs || !baseline || !width || !height)
        return fail(ErrorCode::invalidInput,
                    "'{}' is missing; cam0, cam1, doffs, baseline, width and height are needed",
                    !camera[0]   ? "cam0"
                    : !camera[1] ? "cam1"
                    : !doffs     ? "doffs"
                    : !baseline  ? "baseline"
                    : !width     ? "width"
                                 : "height");
    if (!(*baseline > 0))
        return fail(ErrorCode::invalidInput, "'baseline' is {:g}; it must be above 0", *baseline);
    c.baseline = *baseline;
    c.doffs = *doffs;
    STX_TRY(c.width, imageSide(*width, "width", limits.maxImageSide, ""));
    STX_TRY(c.height, imageSide(*height, "height", limits.maxImageSide, ""));
    return c;
}

Result<SetDescription> describeMiddlebury(const path& given, const ImageSetOptions& options,
                                          Job& job) {
    std::error_code ec;
    const path file = std::filesystem::is_directory(given, ec) ? given / "calib.txt" : given;
    if (file == given || std::filesystem::is_regular_file(file, ec)) {
        STX_CHECK(checkOptionsOf(kCalibrated, options, inQuotes(given.string()), job));
        return describeCalibrated(file, job);
    }
    return describeOlder(given, options, job);
}

}  // namespace stx::imagesets

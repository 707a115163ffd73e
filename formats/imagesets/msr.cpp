// The MSR 3D Video sets: calibParams-*.txt with camN/color-camN-fNNN.jpg and depth-camN-fNNN.png.
// Rows count from the bottom, and depth is the world's Z (the frame of one camera, number 4), not
// the distance along each camera's own axis.

#include "formats/imagesets/msr.hpp"

#include <bit>
#include <cmath>

#include "formats/files/messages.hpp"
#include "formats/imagesets/kinds.hpp"
#include "formats/imagesets/patterns.hpp"
#include "formats/imagesets/pictures.hpp"
#include "formats/imagesets/poses.hpp"
#include "formats/imagesets/text_lines.hpp"

namespace stx::imagesets {
namespace {

constexpr double kMsrRate = 15;  ///< frames a second of Breakdancers and Ballet

constexpr std::size_t kNumbersPerCamera = 24;  // index, 3x3, 2, 3x4

std::vector<std::string> usualNames(const char* what, const std::string& name, int frame) {
    std::vector<std::string> names;
    for (const char* folder : {"{name}/", ""})
        for (const char* ending : {"png", "jpg", "bmp"})
            for (const char* middle : {"-{name}-f{frame:03}.", "-{name}-f{frame:04}.", "-{name}."})
                names.push_back(filled(fmt::format("{}{}{}{}", folder, what, middle, ending),
                                       {name, 0, 0, frame}));
    return names;
}

/// The pinhole in our axes, and what keeps it from being one.
struct Placed {
    Camera camera;
    Lens lens;
    VisionCamera vision;
};

Result<Placed> place(const MsrCamera& m, int width, int height, const std::string& where,
                     Job& job) {
    Placed p;
    STX_TRY(const glm::dmat3 r, repairRotation(m.rotation, std::abs(m.fx), where, job));
    VisionCamera& v = p.vision;
    v.worldFromCamera = glm::transpose(r);
    v.centre = -(v.worldFromCamera * m.translation);
    v.width = width;
    v.height = height;
    // Row = H - 1 - v, and pixel centres of ours lie at +0.5.
    v.fx = m.fx;
    v.fy = -m.fy;
    v.cx = m.cx + 0.5;
    v.cy = height - 0.5 - m.cy;
    p.camera = cameraFromVision(v);
    p.lens.skew = (v.fy < 0 ? -m.skew : m.skew) / p.camera.fx;
    p.lens.k1 = m.k1;
    p.lens.k2 = m.k2;
    return p;
}

/// Planar distance of each pixel whose stored value is the code of the world's Z.
auto distancesOf(Placed placed, double minZ, double maxZ) {
    return [placed, minZ, maxZ](Image<float>& values, const Camera& camera, int largest,
                                Job&) -> Result<void> {
        if (largest != 255)
            return fail(ErrorCode::invalidInput, "the depth has {} bits; 8 are expected",
                        largest == 0 ? 32 : std::bit_width(static_cast<unsigned>(largest)));
        const VisionCamera& v = placed.vision;
        const double right = v.fx < 0 ? -1 : 1, down = v.fy < 0 ? -1 : 1;
        for (int y = 0; y < values.height(); ++y) {
            for (int x = 0; x < values.width(); ++x) {
                const glm::dvec2 real(x + 0.5, y + 0.5);
                glm::dvec2 ideal = real;
                for (int i = 0; i < 6 && !placed.lens.ideal(); ++i)
                    ideal += real - placed.lens.realFromIdeal(camera, ideal);
                const glm::dvec3 ray((ideal.x - camera.cx) / camera.fx * right,
                                     (ideal.y - camera.cy) / camera.fy * down, 1.0);
                const double perUnit = (v.worldFromCamera * ray).z;
                const double z = msrWorldZ(values.at(x, y), minZ, maxZ);
                const double dist = (z - v.centre.z) / perUnit;
                values.at(x, y) = dist > 0 ? static_cast<float>(dist) : 0.0f;
            }
        }
        return {};
    };
}

}  // namespace

double msrWorldZ(double d, double minZ, double maxZ) {
    return 1.0 / (d / 255.0 * (1.0 / minZ - 1.0 / maxZ) + 1.0 / maxZ);
}

Result<std::vector<MsrCamera>> parseMsrCalibration(std::string_view text, const Limits& limits) {
    struct Number {
        double value;
        int line;
    };
    std::vector<Number> numbers;
    for (const TextLine& line : linesOf(text)) {
        for (const std::string_view word : line.words()) {
            STX_TRY(const double value, numberOf(word, line.where()));
            numbers.push_back({value, line.number});
        }
        STX_CHECK(checkViewCount(numbers.size() / kNumbersPerCamera, limits, "the calibration"));
    }
    if (numbers.empty())
        return fail(ErrorCode::invalidInput,
                    "the calibration has no camera; lines of numbers are expected (index, 3x3 "
                    "intrinsics, 2 of distortion, 3x4 rotation and translation)");
    const std::size_t over = numbers.size() % kNumbersPerCamera;
    if (over != 0)
        return failAt(fmt::format("line {}", numbers.back().line), ErrorCode::invalidInput,
                      "camera {} is cut short: {} numbers, {} are expected (index, 3x3 intrinsics, "
                      "2 of distortion, 3x4 rotation and translation)",
                      numbers.size() / kNumbersPerCamera, over, kNumbersPerCamera);
    std::vector<MsrCamera> cameras;
    for (std::size_t at = 0; at < numbers.size(); at += kNumbersPerCamera) {
        const auto n = [&](std::size_t i) { return numbers[at + i].value; };
        const std::string where = fmt::format("line {}", numbers[at].line);
        MsrCamera c;
        if (!(n(0) >= 0 && n(0) <= limits.maxViews && n(0) == std::floor(n(0))))
            return failAt(where, ErrorCode::invalidInput, "{:g} where a camera's index is expected",
                          n(0));
        c.index = static_cast<int>(n(0));
        c.fx = n(1);
        c.skew = n(2);
        c.cx = n(3);
        c.fy = n(5);
        c.cy = n(6);
        if (n(4) != 0 || n(7) != 0 || n(8) != 0 || n(9) != 1 || c.fx == 0 || c.fy == 0)
            return failAt(where, ErrorCode::invalidInput,
                          "the intrinsics of camera {} are no matrix of rows fx skew cx, 0 fy cy, "
                          "0 0 1",
                          c.index);
        c.k1 = n(10);
        c.k2 = n(11);
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 3; ++column)
                c.rotation[column][row] =
                    n(12 + static_cast<std::size_t>(row) * 4 + static_cast<std::size_t>(column));
            c.translation[row] = n(15 + static_cast<std::size_t>(row) * 4);
        }
        cameras.push_back(c);
    }
    return cameras;
}

Result<SetDescription> describeMsr(const path& given, const ImageSetOptions& options, Job& job) {
    path file = given;
    std::error_code ec;
    if (std::filesystem::is_directory(given, ec)) {
        file.clear();
        for (const std::string& name : filesIn(given))
            if (name.starts_with("calibParams") && file.empty()) file = given / name;
        if (file.empty())
            return failAt(inQuotes(given.string()), ErrorCode::invalidInput,
                          "no calibParams-*.txt was found in it; give the folder of Breakdancers "
                          "or Ballet, or the file");
    }
    const path folder = folderOf(file);
    const std::string where = inQuotes(file.string());
    if (!(options.depthMin > 0 && options.depthMin < options.depthMax))
        return failAt(where, ErrorCode::usage,
                      "these sets do not tell what their depth means; give it with --depth-range "
                      "MIN,MAX (Breakdancers: 44,120, Ballet: 42,130)");
    STX_TRY(const auto bytes, readSetFile(file, job.limits));
    STX_TRY(const auto cameras, within(where, parseMsrCalibration(textOf(bytes), job.limits)));

    SetDescription set;
    for (const MsrCamera& m : cameras) {
        SetView view;
        view.name = fmt::format("cam{}", m.index);
        const std::string place1 = fmt::format("{}: camera {}", where, m.index);
        const auto names = [name = view.name](const std::string& pattern, const char* what,
                                              int frame) {
            return pattern.empty() ? usualNames(what, name, frame)
                                   : std::vector<std::string>{filled(pattern, {name, 0, 0, frame})};
        };
        const auto textures = names(options.texturePattern, "color", options.frame);
        const auto depths = names(options.depthPattern, "depth", options.frame);
        const std::string texture = firstThere(folder, textures);
        const std::string depth = firstThere(folder, depths);
        if (texture.empty() && depth.empty() && cameras.size() > 1) {
            job.note(fmt::format("camera {} has no images and is left out", m.index));
            continue;
        }
        if (texture.empty() || depth.empty())
            return failAt(place1, ErrorCode::io,
                          "'{}' is missing, and so is every other usual name of it",
                          texture.empty() ? textures.front() : depths.front());
        STX_TRY(view.texture, sourceInside(folder, texture, place1, job.limits));
        STX_TRY(view.depth, sourceInside(folder, depth, place1, job.limits));
        STX_TRY(const auto size, within(place1, imageSizeOf(view.texture, job)));
        STX_TRY(const Placed placed, place(m, size.x, size.y, place1, job));
        view.camera = placed.camera;
        view.lens = placed.lens;
        view.distances = distancesOf(placed, options.depthMin, options.depthMax);
        set.views.push_back(std::move(view));
        if (set.views.size() == 1) {
            const auto there = [&](int frame) {
                const auto of = names(options.depthPattern, "depth", frame);
                const std::string found = firstThere(folder, of);
                return !found.empty() && of != depths && found != depth;
            };
            set.frames = 1 + lastFrame(folder, folder / depth, options.frame, there);
            set.rate = kMsrRate;
        }
    }
    if (set.views.empty())
        return failAt(where, ErrorCode::io,
                      "no camera has images; cam0/color-cam0-f{:03}.jpg and "
                      "cam0/depth-cam0-f{:03}.png are looked for",
                      options.frame, options.frame);
    return set;
}

}  // namespace stx::imagesets

#include "formats/imagesets/set_options.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "lib/background/behind_photo.hpp"

namespace stx::imagesets {
namespace {

/// An option and what takes it.
struct SetOption {
    std::string_view name;
    /// Whether its value is another than the default.
    bool (*given)(const ImageSetOptions&);
    std::vector<std::string_view> kinds;
    std::string_view of;  ///< these kinds in words
};

const std::vector<SetOption>& setOptions() {
    using O = ImageSetOptions;
    static const std::vector<std::string_view> recordings = {"tum", "7scenes"};
    static const std::vector<SetOption> all = {
        {"--texture",
         [](const O& o) { return !o.texturePattern.empty(); },
         {"miv", "msr", "panorama", kFilms},
         "MIV and MSR 3D Video sets, panoramas and films"},
        {"--depth",
         [](const O& o) { return !o.depthPattern.empty(); },
         {"miv", "msr", "panorama", "photo", kFilms},
         "MIV and MSR 3D Video sets, panoramas, photographs and films"},
        {"--depth-range",
         [](const O& o) { return o.depthMax != 0; },
         {"msr", "photo", kFilms},
         "MSR 3D Video sets, photographs and films"},
        {"--depth-unit",
         [](const O& o) { return o.depthUnit != 0; },
         {"transforms", "cameras", "tum", "7scenes", "open3d", "panorama", "photo", kFilms},
         "sets whose depth is distances in steps"},
        {"--intrinsics",
         [](const O& o) { return o.intrinsics[0] != 0; },
         {"tum", "7scenes", "open3d", "photo"},
         "TUM, 7-Scenes and Open3D recordings and photographs"},
        {"--depth-intrinsics", [](const O& o) { return o.depthIntrinsics.has_value(); }, recordings,
         "TUM and 7-Scenes recordings"},
        {"--depth-to-colour", [](const O& o) { return !o.depthToColour.empty(); }, recordings,
         "TUM and 7-Scenes recordings"},
        {"--focal",
         [](const O& o) { return o.focal != 0; },
         {"middlebury"},
         "Middlebury sets without calib.txt"},
        {"--baseline",
         [](const O& o) { return o.baseline != 0; },
         {"middlebury"},
         "Middlebury sets without calib.txt"},
        {"--disparity-offset",
         [](const O& o) { return o.disparityOffset.has_value(); },
         {"middlebury"},
         "Middlebury sets without calib.txt"},
        {"--disparity-scale",
         [](const O& o) { return o.disparityScale != 1; },
         {"middlebury"},
         "Middlebury sets without calib.txt"},
        {"--yuv",
         [](const O& o) { return o.yuv != YuvColour(); },
         {"miv"},
         "MIV sets with .yuv files"},
        {"--depth-near",
         [](const O& o) { return o.photo.nearIs != NearIs::unknown; },
         {"photo"},
         "photographs"},
        {"--colour-of", [](const O& o) { return o.photo.portrait; }, {"photo"}, "photographs"},
        // Without --behind it is 0 or the usual, by what reads the set.
        {"--behind",
         [](const O& o) {
             return o.photo.behindPercent != 0 && o.photo.behindPercent != kUsualBehindPercent;
         },
         {"photo"},
         "photographs"},
    };
    return all;
}

/// Integers of more than 8 bits alone; `expected` says what else may be.
Distances moreThan8Bits(Distances integers, std::string_view expected) {
    return [integers = std::move(integers), expected](Image<float>& values, const Camera& camera,
                                                      int largest, Job& job) -> Result<void> {
        if (largest <= 255)
            return fail(ErrorCode::invalidInput, "the depth has {} bits; {}",
                        std::bit_width(static_cast<unsigned>(largest)), expected);
        return integers(values, camera, largest, job);
    };
}

}  // namespace

Result<void> checkOptionsOf(std::string_view kind, const ImageSetOptions& options,
                            const std::string& where, Job& job) {
    for (const SetOption& option : setOptions()) {
        if (!option.given(options) || std::ranges::find(option.kinds, kind) != option.kinds.end())
            continue;
        if (!options.manyKinds)
            return failAt(where, ErrorCode::usage, "{} is of {}; this set is '{}'", option.name,
                          option.of, kind);
        job.note(fmt::format("{} is not used: it is of {}, and this set is '{}'", option.name,
                             option.of, kind));
    }
    return {};
}

tl::unexpected<Error> depthIsFloats(std::string_view option) {
    return fail(ErrorCode::usage,
                "the depth is floats, which are distances; {} is of grey pictures", option);
}

Distances orFloats(const ImageSetOptions& options, Distances integers) {
    const bool given = options.depthUnit > 0;
    return [integers = std::move(integers), given](Image<float>& values, const Camera& camera,
                                                   int largest, Job& job) -> Result<void> {
        if (largest > 0) return integers(values, camera, largest, job);
        if (given) return depthIsFloats("--depth-unit");
        return {};
    };
}

Distances sensorsOrFloats(const ImageSetOptions& options, double usual) {
    if (options.depthUnit > 0) return orFloats(options, sensorIntegers(options.depthUnit));
    return orFloats(options,
                    moreThan8Bits(sensorIntegers(usual),
                                  "16 or floats are expected; where it is distances all the same, "
                                  "give their step with --depth-unit"));
}

Distances integersOrFloats(const ImageSetOptions& options, std::optional<double> named,
                           double usual) {
    if (options.depthUnit > 0) named = options.depthUnit;
    const Distances integers = named ? scaledIntegers(*named) : sensorIntegers(usual);
    return orFloats(options, moreThan8Bits(integers, "16 (millimetres) or floats are expected"));
}

}  // namespace stx::imagesets

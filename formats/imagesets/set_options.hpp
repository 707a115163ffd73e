#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "formats/imagesets/set_view.hpp"

/// Which kinds of sets take which options of ImageSetOptions.
namespace stx::imagesets {

/// What checkOptionsOf() calls sets that --from does not name.
inline constexpr std::string_view kFilms = "films", kCalibrated = "middlebury with calib.txt";

/// Errors (usage, from `where`), or a note where ImageSetOptions::manyKinds: options are given that
/// a set of this kind does not take. A value that is also the default is not seen.
[[nodiscard]] Result<void> checkOptionsOf(std::string_view kind, const ImageSetOptions& options,
                                          const std::string& where, Job& job);

/// The error (usage) of an option that says what integers of depth are, where depth is floats.
[[nodiscard]] tl::unexpected<Error> depthIsFloats(std::string_view option);

/// Of sets that hold integers or floats: floats are distances, whatever `integers` makes of the
/// others. Errors (usage): floats, and --depth-unit is given.
[[nodiscard]] Distances orFloats(const ImageSetOptions& options, Distances integers);

/// Of sensors, sensorIntegers() in steps of --depth-unit, else of `usual`, or floats.
/// Errors: (invalidInput) 8 bits without --depth-unit: they are no steps of `usual`, but a picture
/// to look at; as orFloats().
[[nodiscard]] Distances sensorsOrFloats(const ImageSetOptions& options, double usual);

/// Of sets that hold integers of 16 bits or floats. The integers are steps of --depth-unit, else of
/// the unit that the set names, else a sensor's in steps of `usual`.
/// Errors: (invalidInput) 8 bits; (usage) floats, and --depth-unit is given.
[[nodiscard]] Distances integersOrFloats(const ImageSetOptions& options,
                                         std::optional<double> named, double usual = kMillimetre);

}  // namespace stx::imagesets

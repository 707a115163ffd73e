#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "lib/base/job.hpp"
#include "lib/model/reference_view.hpp"

namespace stx {

/// What a step of work takes at its peak beside the images of the views that it is given.
struct PeakMemory {
    std::string_view what;  ///< for the message: "drawing"
    /// Bytes for each pixel of all views, and of the largest one, which is worked on by itself.
    std::uint64_t perPixel = 0, perPixelOfLargest = 0;
    /// Of views in memory: for each pixel without a point instead, where that is less.
    std::uint64_t perEmpty = perPixel;
    /// For each pixel, where more shows on the way: what a refusal names, so that it is enough.
    std::uint64_t perPixelAtMost = 0;
    /// Views with so many pixels are worked on one by one, where the work on one keeps all threads
    /// busy (forEachView()). 0: never.
    std::uint64_t oneByOneFrom = 0;
};

/// Each step's, rounded up: the largest memory of the process with one view of 16 million pixels
/// that are all points, and with four of 4 million, less what the views' images take and less the
/// 60 MiB that the program takes for nothing (a driver in software: 270 MiB; tests/cli/peak_test.py
/// --measure 1).
namespace peak {
// Of views in memory: pages that are as large, and what is below.
inline constexpr PeakMemory kAtlas = {"an atlas", 24};
// Of pages beside themselves, while they are written: pictures that are coded.
inline constexpr PeakMemory kAtlasPages = {"an atlas", 16};
inline constexpr PeakMemory kAtlasInExr = {"an atlas", 1};  // by a few rows at a time
inline constexpr PeakMemory kAtlasPagesVectors = {"an atlas", 40};
inline constexpr PeakMemory kBake = {"baking", 36, 24};  // the vectors that it adds
inline constexpr PeakMemory kBakeToMpeg4 = {"baking into MPEG-4", 76};
inline constexpr PeakMemory kBackground = {"a background", 32};
inline constexpr PeakMemory kCompared = {"two pictures that are compared", 36};
inline constexpr PeakMemory kComparedLinear = {"two pictures that are compared", 80};
inline constexpr PeakMemory kExport = {"writing pictures", 0, 16};
inline constexpr PeakMemory kFewerSplats = {"merging splats", 140};
// Beyond surfaces it is checked by what they have: kPerTriangle, and kPerPixelOfTriangles.
inline constexpr PeakMemory kFewerTriangles = {"fewer triangles", 76, 94, 20, 248};
inline constexpr std::uint64_t kPerTriangle = 115, kPerPixelOfTriangles = 16;
// With normals that are made for light.
inline constexpr PeakMemory kLitSplatMode = {"drawing lit splats", 20};
inline constexpr PeakMemory kLitSurfaceMode = {"drawing in light", 44};
// Pictures are coded in bands, on all threads: two photographs of 12 million pixels take as long
// one after the other as side by side, and 470 MB for 590.
inline constexpr std::uint64_t kCodedOnAllThreads = 4'000'000;
inline constexpr PeakMemory kMpeg4 = {"writing MPEG-4", 16, 0, 16, 0, kCodedOnAllThreads};
inline constexpr PeakMemory kMpeg4Vectors = {"writing MPEG-4", 40, 0, 40, 0, kCodedOnAllThreads};
inline constexpr PeakMemory kPage = {"a page", 36};
// With the views of what has no depth, 16, in a page of their own (23 where 85 % have none).
inline constexpr PeakMemory kPageUnmeasured = {"a page with what has no depth", 52};
inline constexpr PeakMemory kPoints = {"points", 40};
inline constexpr PeakMemory kPointsDraco = {"points in Draco", 88};
inline constexpr PeakMemory kRefine = {"refining", 24};
inline constexpr PeakMemory kSelect = {"selecting", 20};
inline constexpr PeakMemory kSheet = {"the sheet", 0, 12};
inline constexpr PeakMemory kSheetOfTwo = {"the sheet of two", 34};
inline constexpr PeakMemory kSplatMode = {"drawing splats", 8};
inline constexpr PeakMemory kSplats = {"splats", 118};
inline constexpr PeakMemory kSummary = {"summaries of views", 24};
inline constexpr PeakMemory kSurfaceMode = {"drawing", 14};
inline constexpr PeakMemory kSurfaces = {"surfaces", 76, 94, 20};
// Where the memory of a device is that of the process.
inline constexpr PeakMemory kSplatsBySoftware = {"drawing by a software driver", 32};
inline constexpr PeakMemory kSurfacesBySoftware = {"drawing by a software driver", 70};
}  // namespace peak

/// Error (invalidInput) when a step on these views would take more than the limits allow; it says
/// how much would do.
[[nodiscard]] Result<void> checkPeak(const PeakMemory& step,
                                     const std::vector<ReferenceView>& views, const Limits& limits);
/// The same of the step's triangles, once they are known.
[[nodiscard]] Result<void> checkPeakOfTriangles(std::uint64_t triangles,
                                                const std::vector<ReferenceView>& views,
                                                const Limits& limits);
/// The same of other pixels, whose own images take `held` bytes.
[[nodiscard]] Result<void> checkPeak(const PeakMemory& step, std::uint64_t pixels,
                                     std::uint64_t largest, std::uint64_t held,
                                     const Limits& limits);

}  // namespace stx

#pragma once

#include <optional>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "lib/base/job.hpp"
#include "lib/metrics/compare.hpp"
#include "lib/model/atlas.hpp"
#include "lib/model/bundle.hpp"
#include "lib/model/sequence.hpp"
#include "lib/model/view_table.hpp"
#include "lib/sheet/canvas.hpp"

namespace stx {

struct SheetSettings {
    glm::ivec2 mostSize{2600, 2600};  ///< of the sheet, pixels; it gets no larger than it needs
    /// Views beside each other (of what moves: moments); 0 = so many that the pictures get largest.
    int columns = 0;
    std::string title;  ///< the first line; printable
};

/// A contact sheet: what a model holds, at one look. Pictures are shrunk to fit; depth, splats and
/// differences are in false colours (viridis()), with what the ends of the map stand for below
/// them.
struct Sheet {
    Rgb8Image picture;
    int shown = 0;  ///< views, textures, moments times views or pairs on the sheet
    int count = 0;  ///< of all
};

/// Every view with its name and camera: colour, depth, and normals and splats where there are some.
/// Views are shrunk when they are read.
/// Errors: those of the views, a sheet that is too small (planSheet()), memory, cancelled.
[[nodiscard]] Result<Sheet> sheetOf(const ViewTable& table, const SheetSettings& settings,
                                    Job& job);

/// The bytes that such a sheet takes as a picture with SheetSettings(), beside the views that are
/// looked at; of a film of more than one frame its sheet of moments, `first` being the first. 0
/// where a sheet would be an error.
[[nodiscard]] std::uint64_t memoryOfSheet(const ViewTable& first, std::size_t frames);

/// The textures of an atlas, with the rectangles and the numbers of their views drawn on them.
[[nodiscard]] Result<Sheet> sheetOf(const Atlas& atlas, const SheetSettings& settings, Job& job);

/// The views of a sequence at moments that are evenly spread over it, a row for each view. The
/// depth of a view has one range over all of its moments.
[[nodiscard]] Result<Sheet> sheetOf(Sequence& frames, const SheetSettings& settings, Job& job);

/// How far the colours of two pictures are apart.
struct ColourError {
    /// Of `picture`: white is a difference of 1/8 of the full range.
    static constexpr double kGain = 8.0;
    Comparison found;
    Rgba8Image picture;  ///< as errorPicture() has it
};

/// Two pictures of one thing, straight alpha.
struct SheetPair {
    std::string title;
    Texture a, b;
    Image<float> depthA, depthB;  ///< empty: none
    /// Of what is finer than `a` and `b` show; nothing: it is found from these.
    std::optional<ColourError> error{};
};

/// Pairs side by side with the error: differences of colour as errorPicture() has them, with the
/// PSNR, and of depth in scene units. Errors also when the two of a pair differ in size.
[[nodiscard]] Result<Sheet> sheetOf(const std::vector<SheetPair>& pairs,
                                    const SheetSettings& settings, Job& job);

}  // namespace stx

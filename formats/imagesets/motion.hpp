#pragma once

#include <string>
#include <vector>

#include "formats/imagesets/set_view.hpp"
#include "lib/model/sequence.hpp"

namespace stx::imagesets {

/// The pictures of a set along time.
struct Motion {
    /// The pictures of one camera, as indices of SetDescription::views, ascending in time.
    struct Track {
        std::string name;
        std::vector<std::size_t> views;
    };
    std::vector<Track> tracks;
    std::vector<double> times;  ///< seconds by the set's clock, ascending: when any track changes
                                ///< (pictures of one moment may be half a microsecond apart)
    double end = 0;             ///< when the last picture ends

    [[nodiscard]] bool moves() const { return times.size() > 1; }
    [[nodiscard]] Timeline timeline() const;
    /// Each track's last picture at times[frame], or its first one where it begins later.
    [[nodiscard]] SetDescription moment(const SetDescription& set, std::size_t frame) const;
};

/// What of a set moves: nothing when its views have no times or one only, or options.moving says
/// so. Errors (invalidInput): some views have times and others do not, times that are not finite,
/// two pictures of one camera at one time.
[[nodiscard]] Result<Motion> motionOf(const SetDescription& set, const ImageSetOptions& options);

}  // namespace stx::imagesets

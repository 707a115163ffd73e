#pragma once

#include <map>
#include <optional>
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

    /// How many cameras there are where only poses say so and some took one picture only, so that
    /// they may be one that moves; 0 where all is clear.
    std::size_t doubtfulCameras = 0;

    [[nodiscard]] bool moves() const { return times.size() > 1; }
    [[nodiscard]] Timeline timeline() const;
    /// Pictures that cannot be used and why: missing files, damage. By index of
    /// SetDescription::views.
    std::map<std::size_t, Error> gone;
    bool damaged = false;  ///< one of them is damaged, and a note has said so

    /// The picture that a track shows at times[frame]: its last one that can be used, or where it
    /// begins later its first one, of which nothing but the size is shown (SetView::absent).
    /// Nothing when none can be used.
    [[nodiscard]] std::optional<std::size_t> pictureAt(const SetDescription& set,
                                                       const Track& track, std::size_t frame) const;
    /// Whether all tracks begin later than times[frame].
    [[nodiscard]] bool nothingBegan(const SetDescription& set, std::size_t frame) const;
    /// The pictures of all tracks at times[frame] as a set of one moment. Each has one.
    [[nodiscard]] SetDescription moment(const SetDescription& set, std::size_t frame) const;
};

/// What of a set moves: nothing when its views have no times or one only, or options.moving says
/// so. Errors (invalidInput): some views have times and others do not, times that are not finite,
/// two pictures of one camera at one moment.
[[nodiscard]] Result<Motion> motionOf(const SetDescription& set, const ImageSetOptions& options);

}  // namespace stx::imagesets

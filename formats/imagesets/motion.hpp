#pragma once

#include <set>
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
    /// Pictures that cannot be used: missing files, damage. Indices of SetDescription::views.
    std::set<std::size_t> gone;
    bool damaged = false;  ///< one of them is damaged, and a note has said so

    /// The picture that each track shows at times[frame]: its last one, or where it begins later
    /// its first one, of which nothing but the size is shown (SetView::absent). Errors: none of a
    /// track can be used.
    [[nodiscard]] Result<std::vector<std::size_t>> picturesAt(const SetDescription& set,
                                                              std::size_t frame) const;
    /// Those pictures as a set of one moment.
    [[nodiscard]] Result<SetDescription> moment(const SetDescription& set, std::size_t frame) const;
};

/// What of a set moves: nothing when its views have no times or one only, or options.moving says
/// so. Errors (invalidInput): some views have times and others do not, times that are not finite,
/// two pictures of one camera at one time.
[[nodiscard]] Result<Motion> motionOf(const SetDescription& set, const ImageSetOptions& options);

}  // namespace stx::imagesets

#pragma once

#include <filesystem>
#include <string>

#include "formats/imagesets/image_sets.hpp"

namespace stx {

struct OpenOptions {
    std::string texture;     ///< texture of a mesh, in place of those that it names; empty = none
    bool materials = false;  ///< of a mesh: its metallic-roughness is read, too
    /// MPEG-4: startTime and stopTime that come with a later access unit count from the start of
    /// the scene, not from that unit.
    bool timesFromStart = false;
    /// Of an atlas with several objects: the name of the one to open.
    std::string object;
    bool keepColourFiles = false;  ///< MPEG-4: see ColourFile
    ImageSetOptions set;  ///< of image sets; with set.from whatever is given is read as one

    /// The same for what is written to `target`: an OpenEXR file keeps colours of 16 bits, and an
    /// MPEG-4 film rounds the depth of its frames itself.
    [[nodiscard]] OpenOptions into(const std::filesystem::path& target) const;
};

struct SaveOptions {
    bool noClobber = false;  ///< error (io) when the target exists
    /// OpenEXR: what is known of each view, kept for those who draw without its pixels
    /// (ViewTable::summaries()). A file of exact views has it, where each may be left out.
    enum class Summaries {
        none,
        /// Of views that come from a file with summaries, and of those in which refine() would
        /// change nothing: they are read up to three times more for that.
        ofExact,
        known,  ///< the views are exact, as those of a mesh are: they are not looked at for it
    } summaries = Summaries::ofExact;
    int jpegQuality = 0;  ///< 0 = PNG, exact; 1..100 = colour as JPEG (MPEG-4, atlas folders)
    /// MPEG-4 films: pictures that change as H.264 video, colour of this quality (0 best, 51
    /// worst), depth lossless in 8 or 10 bits; -1: as PNG or JPEG pictures.
    int h264 = -1;
    bool pointTexture = false;  ///< MPEG-4: PointTexture nodes instead of SimpleTexture
    int octreeLevels = 0;       ///< MPEG-4: an OctreeImage of 1..16 levels; 0 = none
    int bifsVersion = 0;  ///< MPEG-4: 1 or 2, of the scene's stream; 0 = as it is, 1 for new ones
};

}  // namespace stx

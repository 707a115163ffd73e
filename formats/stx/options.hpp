#pragma once

#include <string>

#include "formats/imagesets/image_sets.hpp"

namespace stx {

struct OpenOptions {
    std::string texture;  ///< texture of a mesh, in place of those that it names; empty = none
    ImageSetOptions set;  ///< of image sets; with set.from whatever is given is read as one
};

struct SaveOptions {
    bool noClobber = false;     ///< error (io) when the target exists
    int jpegQuality = 0;        ///< 0 = PNG, exact; 1..100 = colour as JPEG (MPEG-4, atlas folders)
    bool pointTexture = false;  ///< MPEG-4: PointTexture nodes instead of SimpleTexture
    int octreeLevels = 0;       ///< MPEG-4: an OctreeImage of 1..16 levels; 0 = none
};

}  // namespace stx

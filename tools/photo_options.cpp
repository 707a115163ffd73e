#include "tools/photo_options.hpp"

namespace stx::tools {

void addPhotoOptions(const Command& command, PhotoSetOptions& options, const char* heading) {
    Command c = command;
    c.choice<NearIs>("--depth-near", options.nearIs,
                     {{"white", NearIs::white}, {"black", NearIs::black}},
                     "What is near in a grey picture of depth beside a photo: two customs exist")
        .group(heading);
    c.choice<bool>("--colour-of", options.portrait, {{"original", false}, {"portrait", true}},
                   "Of a photo that holds both: the sharp picture (original) or the one whose "
                   "background is blurred (portrait)")
        .group(heading);
}

}  // namespace stx::tools

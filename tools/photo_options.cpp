#include "tools/photo_options.hpp"

#include "lib/background/behind_photo.hpp"

namespace stx::tools {

void addPhotoOptions(Command c, PhotoSetOptions& options) {
    c.choice<NearIs>("--depth-near", options.nearIs,
                     {{"white", NearIs::white}, {"black", NearIs::black}},
                     "What is near in a grey picture of depth beside a photo: two customs exist");
    c.choice<bool>("--colour-of", options.portrait, {{"original", false}, {"portrait", true}},
                   "Of a photo that holds both: the sharp picture (original) or the one whose "
                   "background is blurred (portrait)");
}

void addBehindOption(Command c, PhotoSetOptions& options) {
    options.behindPercent = kUsualBehindPercent;
    c.option(
         "--behind",
         [&options](const std::string& text) -> Result<void> {
             options.behindPercent = 0;
             if (text == "none") return {};
             STX_TRY(const auto percent, parseNumbers(text, 1, "--behind"));
             if (!(percent[0] > 0 && percent[0] <= kMostBehindPercent))
                 return fail(ErrorCode::usage,
                             "it is {}; none or a number above 0 and up to {:g} is expected", text,
                             kMostBehindPercent);
             options.behindPercent = percent[0];
             return {};
         },
         "Of a photo: how far to the side an eye may go without a hole, percent of the median "
         "distance; what the photo hides is invented for it, as a view of its own (default 8). "
         "none: only what was photographed")
        .takes("PERCENT|none");
}

}  // namespace stx::tools

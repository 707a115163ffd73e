// Gives the depth of a bundle the faults of sensors and stereo, or its colours those of cameras,
// see tests/noisy_depth.hpp:
//   noisy_depth BUNDLE OUT.exr noisePERCENT|codes8|missing3|edges1|mixedPERCENT|light

#include "tests/noisy_depth.hpp"

#include <cstdio>
#include <cstdlib>

#include "formats/any/open.hpp"
#include "formats/exr/bundle_exr.hpp"

int main(int argc, char** argv) {
    using namespace stx;
    const auto run = [&]() -> Result<void> {
        Job job;
        STX_TRY(Bundle bundle, openBundle(argv[1], {}, job));
        if (!noisy::damage(bundle, argv[3]))
            return fail(ErrorCode::usage,
                        "'{}' is not noise or mixed and a percentage, codes8, missing3, edges1 or "
                        "light",
                        argv[3]);
        return writeExrViews(*viewsOf(bundle), argv[2], job);
    };
    if (argc != 4) {
        std::fprintf(stderr, "usage: noisy_depth BUNDLE OUT.exr KIND\n");
        return 1;
    }
    const auto done = run();
    if (!done) std::fprintf(stderr, "%s\n", done.error().text().c_str());
    std::_Exit(done ? 0 : 4);
}

#pragma once

#include "formats/imagesets/image_sets.hpp"
#include "lib/model/sequence.hpp"
#include "tests/unit/imagesets/set_writer.hpp"

/// Small sets whose pictures have times.
namespace shots {

using namespace stx;
using namespace sets;

/// A picture of a camera: its depth is 1000 + `depth` mm everywhere.
struct Shot {
    std::string camera;
    double time = 0;
    double x = 0;  ///< of the camera
    int depth = 0;
};

/// transforms.json with pictures of 8x6: picture i is c{i}.png, of the grey i, and d{i}.png.
inline std::filesystem::path writeShots(const TemporaryFolder& folder,
                                        const std::vector<Shot>& shots,
                                        const std::string& head = "") {
    std::string frames;
    for (std::size_t i = 0; i < shots.size(); ++i) {
        const Shot& s = shots[i];
        const std::vector<std::uint8_t> rgb(8 * 6 * 3, static_cast<std::uint8_t>(i));
        const std::vector<std::uint16_t> depth(8 * 6, static_cast<std::uint16_t>(1000 + s.depth));
        writeBytes(folder / fmt::format("c{}.png", i), *encodePng(8, 6, 3, 8, rgb.data(), true));
        writeBytes(folder / fmt::format("d{}.png", i),
                   *encodePng(8, 6, 1, 16, depth.data(), false));
        frames += fmt::format(
            "{}{{\"file_path\":\"c{}.png\",\"depth_file_path\":\"d{}.png\",\"time\":{}{},"
            "\"transform_matrix\":[[1,0,0,{}],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}}",
            i ? "," : "", i, i, s.time,
            s.camera.empty() ? "" : fmt::format(",\"camera\":\"{}\"", s.camera), s.x);
    }
    writeText(folder / "transforms.json",
              fmt::format("{{\"w\":8,\"h\":6,\"fl_x\":8,{}\"frames\":[{}]}}", head, frames));
    return folder / "transforms.json";
}

/// The sequence, or null after a failed expectation.
inline std::unique_ptr<Sequence> opened(const std::filesystem::path& set,
                                        ImageSetOptions options = {}) {
    Job job;
    auto sequence = openImageSet(set, options, job);
    EXPECT_TRUE(sequence) << sequence.error().text();
    return sequence ? std::move(*sequence) : nullptr;
}

/// The depth of a pixel amid a view.
inline float depthOf(Sequence& sequence, std::size_t frame, std::size_t view) {
    Job job;
    const auto bundle = sequence.frame(frame, job);
    EXPECT_TRUE(bundle) << bundle.error().text();
    return bundle ? bundle->views.at(view).depth.at(3, 3) : 0;
}

}  // namespace shots

// Cameras to draw pictures from, as files of others have them.

#include "formats/imagesets/camera_file.hpp"

#include <filesystem>

#include "tests/unit/imagesets/set_writer.hpp"

using namespace stx;
using namespace sets;

namespace {

/// nerfstudio's own layout: DATA/transforms.json, DATA/camera_paths/NAME.json and the file of the
/// training elsewhere. What was applied before is undone there as it is beside the transforms.json.
TEST(CameraFile, FindsTheTransformsAboveACameraPath) {
    const TemporaryFolder folder;
    const std::string path =
        "{\"camera_type\":\"perspective\",\"render_width\":16,\"render_height\":12,"
        "\"camera_path\":[{\"camera_to_world\":[1,0,0,1, 0,1,0,2, 0,0,1,3, 0,0,0,1],"
        "\"fov\":50}]}";
    writeText(folder / "data/camera_paths/p.json", path);
    writeText(folder / "outputs/dataparser_transforms.json",
              "{\"transform\":[[1,0,0,5],[0,1,0,0],[0,0,1,0]],\"scale\":0.5}");
    const auto placeOf = [&](const std::filesystem::path& file, std::string& notes) {
        Job job;
        const auto cameras = readCameraFile(folder / file, job, std::nullopt,
                                            folder / "outputs/dataparser_transforms.json");
        EXPECT_TRUE(cameras) << cameras.error().text();
        notes.clear();
        for (const std::string& note : job.takeNotes()) notes += note + "\n";
        return cameras ? cameras->at(0).camera.position : glm::dvec3(0.0);
    };
    std::string notes;
    EXPECT_LT(glm::distance(placeOf("data/camera_paths/p.json", notes), {-3, 4, 6}), 1e-9);
    EXPECT_NE(notes.find("where the set has no applied_transform"), std::string::npos) << notes;

    writeText(folder / "data/transforms.json",
              "{\"applied_transform\":[[1,0,0,0],[0,1,0,0],[0,0,1,7]],\"frames\":[]}");
    writeText(folder / "data/p.json", path);
    for (const char* file : {"data/p.json", "data/camera_paths/p.json"}) {
        EXPECT_LT(glm::distance(placeOf(file, notes), {-3, 4, 13}), 1e-9) << file;
        EXPECT_EQ(notes.find("applied_transform"), std::string::npos) << notes;
    }
}

}  // namespace
